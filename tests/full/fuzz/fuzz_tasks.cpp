// SPDX-License-Identifier: BSD-3-Clause
//
// Random tasks, and what their verdicts are worth.
//
//   fuzz_tasks ROBOTS_FOLDER [--seconds 60] [--first 1] [--keep FOLDER]
//
// Robots whose equations are written out here: a block on a rail, a pendulum, a cart with a pole.  Goals, bounds, schemes,
// meshes, weights, methods and starts vary, upright and hanging ones among them; each goal is where a smooth control leads
// within the bounds, so a refusal is wrong.  What is called a verified optimum is
// looked at by code that shares nothing with the solver: these equations, a Runge-Kutta integration of small steps, and
// differences of the cost by controls on a coarse grid.
//
//   intervals    each ends where the motion's next node is, to twice verify.integration_error of how far the motion moves the state
//   ends, bounds are met, bounds between the points as well, to 1 % of their range
//   first order  of changes of the control that keep the end where it is, none lowers the cost: the gradient that is left
//                is below kFirst of what it was.  Where bounds are active, of changes on a finer grid that leave controls at
//                their limits and velocities at theirs; and none lowers it that takes a control or a velocity off its limit
//   second order no such change lowers it by its square: the Hessian of the Lagrangian, on the changes that keep the end and what
//                is active, has no negative eigenvalue beyond kSecond of its largest
//
// Prints each seed whose verdict is wrong, refusals with their sentence, and a line of counts; status 1 where a verdict is
// wrong or more than 2 % of all tasks are refused.
#include <CLI/CLI.hpp>
#include <Eigen/Dense>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <numbers>
#include <random>

#include <unistd.h>

#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/run/solve/solve.h>

#include "timed_seeds.h"

namespace dyntape {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kFirst = 0.05, kSecond = 1e-2;
constexpr double kGravity = 9.81;

// A robot by hand: x = (q, v), one control.
struct Robot {
  const char* file;
  int joints;
  VectorXd (*acceleration)(const VectorXd& q, const VectorXd& v, double u);
};

VectorXd of_block(const VectorXd&, const VectorXd&, double u) { return VectorXd::Constant(1, u); }

VectorXd of_pendulum(const VectorXd& q, const VectorXd&, double u) {
  return VectorXd::Constant(1, u - kGravity * std::sin(q[0]));
}

// Masses 1 and 0.3 kg, rod 0.5 m; hangs at q[1] = 0.  Lagrange's equations of cart and pole, solved for the accelerations.
VectorXd of_cart_pole(const VectorXd& q, const VectorXd& v, double u) {
  const double M = 1, m = 0.3, l = 0.5, s = std::sin(q[1]), c = std::cos(q[1]);
  Eigen::Matrix2d mass;
  mass << M + m, m * l * c, m * l * c, m * l * l;
  return mass.ldlt().solve(Eigen::Vector2d(u + m * l * s * v[1] * v[1], -m * kGravity * l * s));
}

const Robot kRobots[] = {
    {"block", 1, of_block}, {"pendulum", 1, of_pendulum}, {"cart_pole", 2, of_cart_pole}};

struct RandomTask {
  const Robot* robot;
  std::string text;
  VectorXd start, goal;  // (2 joints)
  double duration, velocity, effort;
};

VectorXd rate(const Robot& robot, const VectorXd& x, double u) {
  const int n = robot.joints;
  VectorXd dx(2 * n);
  dx << x.tail(n), robot.acceleration(x.head(n), x.tail(n), u);
  return dx;
}

// The classical Runge-Kutta step, u(0 .. 1) being the control over it.
template <class Control>
VectorXd step(const Robot& robot, const VectorXd& x, double h, const Control& u) {
  const VectorXd a = rate(robot, x, u(0)), b = rate(robot, x + h / 2 * a, u(0.5)),
                 c = rate(robot, x + h / 2 * b, u(0.5)), d = rate(robot, x + h * c, u(1));
  return x + h / 6 * (a + 2 * b + 2 * c + d);
}

std::string number(double value) { return io::shortest(value); }

RandomTask random_task(std::uint64_t seed, const std::string& robots) {
  std::mt19937 random(static_cast<std::mt19937::result_type>(seed));
  const auto below = [&](int n) { return int(random() % unsigned(n)); };
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * double(random()) / double(std::mt19937::max());
  };
  RandomTask task{&kRobots[below(3)], "", {}, {}, 0, HUGE_VAL, HUGE_VAL};
  const Robot& robot = *task.robot;
  const bool swings = robot.acceleration != of_block, carries = robot.joints == 2;
  task.start.setZero(2 * robot.joints), task.goal.setZero(2 * robot.joints);
  constexpr double kAngles[] = {0, std::numbers::pi, 0.5, -2, 1e-3};
  if (swings) task.start[robot.joints - 1] = kAngles[below(5)];
  task.duration = std::round(100 * uniform(0.8, 2)) / 100;
  task.effort = carries ? 20 : 100;
  // Where a smooth control leads, so that there is a motion; nowhere else at times, where the start may be at rest.
  const double a = uniform(0.5, 3), b = uniform(-3, 3), c = uniform(0, 6);
  double size = below(4) == 0 ? 0 : uniform(1, carries ? 10 : 20), fastest = 0;
  for (;; size /= 2) {
    constexpr int kSteps = 2000;
    const double h = task.duration / kSteps;
    VectorXd x = task.start;
    double farthest = fastest = 0;
    for (int i = 0; i < kSteps; ++i) {
      x = step(robot, x, h,
               [&](double at) { return size * std::sin(c + (a + b * (i + at) * h) * (i + at) * h); });
      fastest = std::max(fastest, x.tail(robot.joints).cwiseAbs().maxCoeff());
      farthest = std::max(farthest, std::abs(x[0]));
    }
    task.goal = x;
    if (!carries || farthest < 1.8) break;
  }
  const char* schemes[] = {"hermite-simpson", "hermite-simpson", "trapezoid", "lobatto-4", "radau-3"};
  const char* methods[] = {"ipopt", "riccati"};
  const std::string scheme = schemes[below(5)];
  std::string q, v, goal_q, goal_v;
  for (int i = 0; i < robot.joints; ++i) {
    q += " " + number(task.start[i]), v += " " + number(task.start[robot.joints + i]);
    goal_q += " " + number(task.goal[i]), goal_v += " " + number(task.goal[robot.joints + i]);
  }
  task.text = "robot { urdf " + robots + "/" + robot.file + ".urdf }\n" +
              (carries ? "actuated slider\n" : "") + "horizon {\n duration " + number(task.duration) +
              "\n intervals " + std::to_string(10 + below(40)) + "\n}\nstart {\n q \"" + q + "\"\n v \"" + v +
              "\"\n}\ngoal {\n q \"" + goal_q + "\"\n v \"" + goal_v + "\"\n}\ntranscription { scheme " +
              scheme + " }\ncosts { control " + number(std::pow(10, uniform(-3, 2))) + " }\n";
  if (below(3) == 0) task.velocity = 1.05 * fastest + 0.1;  // kept by the control above
  task.text += std::string("solver { method ") + methods[below(2)] + " }\n";
  const int tight = below(3);  // barely
  if (tight == 1) task.velocity = 1.01 * fastest + 0.01;
  if (tight == 2) task.effort = std::min(task.effort, 1.01 * size + 0.1);
  task.text += "bounds {\n efforts " + number(task.effort) + "\n" +
               (task.velocity < HUGE_VAL ? " velocities " + number(task.velocity) + "\n" : "") + "}\n";
  return task;
}

// The control at a share of an interval, by its points: the scheme's polynomial, or the line of a trapezoid.
double control_at(const Trajectory& motion, int interval, double share, double effort) {
  const int stages = int(motion.scheme.c.size()), first = motion.node(interval);
  double u = 0;
  const bool skips_first = !motion.scheme.uses_first_point();
  for (int i = skips_first ? 1 : 0; i < stages; ++i) {
    double weight = 1;
    for (int j = skips_first ? 1 : 0; j < stages; ++j)
      if (j != i) weight *= (share - motion.scheme.c[j]) / (motion.scheme.c[i] - motion.scheme.c[j]);
    u += weight * motion.u(0, first + i);
  }
  return std::clamp(u, -effort, effort);
}

class Judge {
 public:
  Judge(const RandomTask& task, const Trajectory& motion) : task_(task), motion_(motion) {}

  // Why the verdict is wrong; empty: it is right as far as can be seen.
  std::string fault(double integration_error) {
    if (const std::string off = interval_fault(integration_error); !off.empty()) return off;
    return optimality_fault();
  }

  bool has_active() const { return active_; }

 private:
  const Robot& robot() const { return *task_.robot; }

  static constexpr int kSteps = 400;  // of an integration of the whole

  std::string interval_fault(double integration_error) {
    const int n = task_.robot->joints, last = motion_.points() - 1;
    VectorXd extent = motion_.x.rowwise().maxCoeff() - motion_.x.rowwise().minCoeff();
    for (const int kind :
         {0, n}) {  // positions and velocities are measured by the largest of their kind where they are small
      const double most = extent.segment(kind, n).maxCoeff();
      extent.segment(kind, n) = extent.segment(kind, n).cwiseMax(std::max(1e-2, 1e-4 * most));
    }
    if ((motion_.x.col(0) - task_.start).cwiseAbs().maxCoeff() > 1e-6) return "does not begin at the start";
    if ((motion_.x.col(last) - task_.goal).cwiseAbs().maxCoeff() > 1e-5) return "does not end at the goal";
    for (int k = 0; k < motion_.intervals(); ++k) {
      const double begin = motion_.t[motion_.node(k)], h = motion_.t[motion_.node(k + 1)] - begin;
      VectorXd x = motion_.x.col(motion_.node(k));
      constexpr int kPieces = 64;
      for (int i = 0; i < kPieces; ++i) {
        x = step(robot(), x, h / kPieces,
                 [&](double at) { return control_at(motion_, k, (i + at) / kPieces, task_.effort); });
        if (x.tail(n).cwiseAbs().maxCoeff() > 1.01 * task_.velocity)
          return "a velocity of " + number(x.tail(n).cwiseAbs().maxCoeff()) + " at " +
                 number(begin + h * i / kPieces) + " s, bounded by " + number(task_.velocity);
      }
      const double off =
          ((x - motion_.x.col(motion_.node(k + 1))).cwiseAbs().array() / extent.array()).maxCoeff();
      if (!(off <= 2 * integration_error))
        return "interval " + std::to_string(k) + " is off by " + number(off) + " of the motion";
    }
    return "";
  }

  // A velocity at its limit, at a step of the integration; `run`: of those that follow one another.
  struct Held {
    int step, state, run;
    double sign;
  };

  // What is to be kept, the end and then what is held, and the cost of the motion, its control changed by hats of these heights.
  std::pair<VectorXd, double> shoot(const VectorXd& change) const {
    VectorXd x = motion_.x.col(0), kept(x.size() + Eigen::Index(held_.size()));
    double cost = 0;
    const double h = task_.duration / kSteps;
    int k = 0;
    for (int i = 0; i < kSteps; ++i) {
      const auto u = [&](double at) {
        const double t = std::min((i + at) * h, task_.duration);
        while (k + 1 < motion_.intervals() && motion_.t[motion_.node(k + 1)] < t - 1e-12) ++k;
        while (k > 0 && motion_.t[motion_.node(k)] > t + 1e-12) --k;
        const double begin = motion_.t[motion_.node(k)], end = motion_.t[motion_.node(k + 1)];
        double value =
            control_at(motion_, k, std::clamp((t - begin) / (end - begin), 0.0, 1.0), task_.effort);
        for (int g = 0; g < grid_; ++g)
          value += change[g] * std::max(0.0, 1 - std::abs(t / task_.duration * (grid_ - 1) - g));
        return value;
      };
      const double a = u(0), b = u(0.5), c = u(1);
      cost += h / 6 * (a * a + 4 * b * b + c * c);
      x = step(robot(), x, h, u);
      for (std::size_t j = 0; j < held_.size(); ++j)
        if (held_[j].step == i + 1) kept[x.size() + Eigen::Index(j)] = held_[j].sign * x[held_[j].state];
    }
    kept.head(x.size()) = x;
    return {kept, cost};
  }

  // What is active, and the grid: hats whose control is off its limits in all of their width are free.
  void find_active() {
    const int n = task_.robot->joints;
    const auto at_limit = [&](int p) { return std::abs(motion_.u(0, p)) > 0.98 * task_.effort; };
    const auto held = [&](int i, int p) { return std::abs(motion_.x(n + i, p)) > 0.9999 * task_.velocity; };
    for (int p = 0; p < motion_.points(); ++p) {
      active_ |= at_limit(p);
      for (int i = 0; i < n; ++i) active_ |= held(i, p);
    }
    grid_ = active_ ? 24 : 8;
    limit_ = VectorXd::Zero(grid_);
    const double width = task_.duration / (grid_ - 1);
    for (int g = 0; g < grid_; ++g) {
      bool up = false, down = false;
      for (int p = 0; p < motion_.points(); ++p) {
        // The neighbours of a switch belong to it.
        if (!at_limit(p) || std::abs(motion_.t[p] - g * width) > width + task_.duration / motion_.intervals())
          continue;
        (motion_.u(0, p) > 0 ? up : down) = true;
      }
      limit_[g] = up && down ? std::nan("") : double(up) - double(down);
      if (limit_[g] == 0) free_.push_back(g);
    }
    int runs = 0;
    for (int i = 0; i < n; ++i) {
      for (int p = 0, end; p < motion_.points(); p = end + 1) {
        for (end = p; end < motion_.points() && held(i, end);) ++end;
        if (end == p) continue;
        for (int k = p; k < end; ++k)
          held_.push_back({std::clamp(int(std::lround(motion_.t[k] / task_.duration * kSteps)), 1, kSteps),
                           n + i, runs, motion_.x(n + i, k) > 0 ? 1.0 : -1.0});
        ++runs;
      }
    }
  }

  std::string optimality_fault() {
    find_active();
    const int n_free = int(free_.size());
    if (n_free == 0) return "";
    const double size = std::max(1e-3, motion_.u.cwiseAbs().maxCoeff()), d = 1e-4 * size;
    const Eigen::Index n_x = motion_.x.rows(), n_kept = n_x + Eigen::Index(held_.size());
    MatrixXd kept(n_kept, grid_), H(n_free, n_free);
    VectorXd slope(grid_);
    const auto hat = [&](int g) { return VectorXd::Unit(grid_, g).eval(); };
    for (int g = 0; g < grid_; ++g) {
      const auto up = shoot(d * hat(g)), down = shoot(-d * hat(g));
      kept.col(g) = (up.first - down.first) / (2 * d);
      slope[g] = (up.second - down.second) / (2 * d);
    }
    const MatrixXd of_free = kept(Eigen::all, free_);
    // In units of each row, so that its rank is seen.
    const VectorXd unit = kept.rowwise().norm().cwiseMax(1e-12);
    const MatrixXd scaled = unit.cwiseInverse().asDiagonal() * of_free;
    Eigen::CompleteOrthogonalDecomposition<MatrixXd> rows;
    rows.setThreshold(1e-6).compute(scaled.transpose());
    const VectorXd lambda = unit.cwiseInverse().asDiagonal() * rows.solve(-slope(free_));
    const VectorXd left = slope + kept.transpose() * lambda;
    // A control of this size has this much of a gradient; one of no size has none.
    const double whole = std::max(slope.norm(), 2 * size * task_.duration / grid_);
    if (const double most = left(free_).norm(); most > kFirst * whole)
      return "the cost falls along changes of the control that keep the end: " + number(most / whole) +
             " of its gradient is left";
    for (int g = 0; g < grid_; ++g)
      if (limit_[g] * left[g] > kFirst * whole)
        return "the cost falls where the control leaves its limit, at " +
               number(task_.duration * g / (grid_ - 1)) + " s: " + number(left[g] / whole) +
               " of its gradient";
    for (std::size_t j = 0; j < held_.size(); ++j) {
      double pull = 0;
      for (std::size_t k = 0; k < held_.size(); ++k)
        if (held_[k].run == held_[j].run) pull += lambda[n_x + Eigen::Index(k)] * unit[n_x + Eigen::Index(k)];
      if (pull < -kFirst * whole)
        return "the cost falls where a velocity leaves its limit, at " +
               number(task_.duration * held_[j].step / kSteps) + " s: " + number(-pull / whole);
    }
    const auto lagrangian = [&](const VectorXd& change) {
      const auto [values, cost] = shoot(change);
      return cost + lambda.dot(values);
    };
    // So long that the end moves by this much, where the robot amplifies changes.
    constexpr double kMoved = 1e-2;
    const double e =
        std::min(1e-2 * size, kMoved / std::max(1e-9, of_free.topRows(n_x).cwiseAbs().maxCoeff()));
    for (int a = 0; a < n_free; ++a) {
      for (int b = 0; b <= a; ++b) {
        const VectorXd p = e * hat(free_[a]), q = e * hat(free_[b]);
        H(a, b) = H(b, a) =
            (lagrangian(p + q) - lagrangian(p - q) - lagrangian(q - p) + lagrangian(-p - q)) / (4 * e * e);
      }
    }
    Eigen::FullPivLU<MatrixXd> lu(scaled);
    lu.setThreshold(1e-6);
    MatrixXd free = lu.kernel();
    if (lu.dimensionOfKernel() == 0) return "";
    free = free.householderQr().householderQ() * MatrixXd::Identity(n_free, free.cols());
    const Eigen::SelfAdjointEigenSolver<MatrixXd> own(free.transpose() * H * free);
    const double least = own.eigenvalues().minCoeff(), most = own.eigenvalues().cwiseAbs().maxCoeff();
    if (least < -kSecond * most)
      return "no minimum: a curvature of " + number(least) + " beside " + number(most);
    return "";
  }

  const RandomTask& task_;
  const Trajectory& motion_;
  bool active_ = false;
  int grid_ = 8;  // changes of the control: so many hats over the duration
  VectorXd
      limit_;  // (grid_) of each hat the side of the limit that the control is at, 0: at none, NaN: at both
  std::vector<int> free_;  // hats
  std::vector<Held> held_;
};

int run(std::uint64_t first, double seconds, const std::string& robots, const std::string& folder) {
  int verified = 0, refused = 0, wrong = 0, active = 0;
  testing::TimedSeeds seeds(first, seconds);
  for (std::uint64_t seed; seeds.take(seed);) {
    const RandomTask random = random_task(seed, robots);
    const std::string path = folder + "/task_" + std::to_string(seed) + ".info";
    write_file_atomically(path, random.text);
    std::string fault;
    try {
      Task task = read_task(path);
      task.optimise.mesh.evaluation.route = Route::kInterpreter;
      const SolveReport report = solve_task(task);
      if (!report.success()) {
        ++refused;
        std::cout << "seed " << seed << " is refused: " << report.verdict() << "\n";
        continue;
      }
      ++verified;
      Judge judge(random, report.solution.motion);
      fault = judge.fault(task.demands.integration_error);
      active += judge.has_active();
    } catch (const std::exception& e) {
      ++refused;
      std::cout << "seed " << seed << " is refused: " << e.what() << "\n";
      continue;
    }
    if (fault.empty()) continue;
    ++wrong;
    std::cout << "seed " << seed << ", called verified: " << fault << "\n" << random.text << "\n";
  }
  std::cout << seeds.taken() << " tasks from seed " << first << ": " << verified << " verified (" << active
            << " with active bounds), " << refused << " refused, " << wrong << " wrong\n";
  return wrong > 0 || 50 * refused > int(seeds.taken()) ? 1 : 0;
}

}  // namespace
}  // namespace dyntape

int main(int argc, char** argv) {
  CLI::App app("random tasks, and what their verdicts are worth");
  double seconds = 60;
  std::uint64_t first = 1;
  std::string robots, folder;
  app.add_option("robots", robots, "folder of the robots")->required();
  app.add_option("--seconds", seconds, "how long")->capture_default_str();
  app.add_option("--first", first, "seed");
  app.add_option("--keep", folder, "folder in which the tasks stay");
  CLI11_PARSE(app, argc, argv);
  namespace fs = std::filesystem;
  const bool keeps = !folder.empty();
  if (!keeps)
    folder = (fs::temp_directory_path() / ("dyntape-fuzz-tasks-" + std::to_string(getpid()))).string();
  fs::create_directories(folder);
  const int status = dyntape::run(first, seconds, fs::absolute(robots).string(), folder);
  if (!keeps) fs::remove_all(folder);
  return status;
}
