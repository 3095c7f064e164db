// SPDX-License-Identifier: BSD-3-Clause
#include "random_task_judge.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <dyntape/interface/io/number.h>

namespace dyntape::testing {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kDefect = 1e-3;     // verify.integration_error, of how far the motion moves a state
constexpr double kGoal = 1e-2;       // verify.goal_error
constexpr double kEnds = 1e-5;       // rad, m, rad/s, m/s
constexpr double kAgreement = 0.02;  // of a figure that the report gives, and the same found here

// Where the points of an interval are, which of them its control is a polynomial through, and what they weigh in a cost.
struct Points {
  std::vector<double> at, weight;  // of what is held a step's cost has no such weights
  int first_used, used;
};

Points points_of(const std::string& scheme) {
  const double s5 = std::sqrt(5.), s6 = std::sqrt(6.);
  static const std::map<std::string, Points> all = {
      {"held", {{0, 1}, {}, 0, 1}},
      {"runge-kutta-4", {{0, 1}, {}, 0, 1}},
      {"trapezoid", {{0, 1}, {0.5, 0.5}, 0, 2}},
      {"hermite-simpson", {{0, 0.5, 1}, {1. / 6, 4. / 6, 1. / 6}, 0, 3}},
      {"hermite-simpson-linear", {{0, 0.5, 1}, {1. / 6, 4. / 6, 1. / 6}, 0, 3}},
      {"lobatto-4", {{0, (5 - s5) / 10, (5 + s5) / 10, 1}, {1. / 12, 5. / 12, 5. / 12, 1. / 12}, 0, 4}},
      {"radau-3", {{0, (4 - s6) / 10, (4 + s6) / 10, 1}, {0, (16 - s6) / 36, (16 + s6) / 36, 1. / 9}, 1, 3}}};
  return all.at(scheme);
}

std::string digits(double value) { return io::with_digits(value, 4); }

class Judge {
 public:
  Judge(const RandomTask& task, const SolveReport& report, bool by_ddp)
      : task_(task),
        report_(report),
        motion_(report.solution.motion),
        by_ddp_(by_ddp),
        robot_(task),
        points_(points_of(by_ddp ? "held" : task.scheme)),
        nq_(task.model.nq),
        nv_(task.model.nv) {}

  std::string fault() {
    for (const auto& check : {&Judge::times_fault, &Judge::ends_fault, &Judge::controls_fault,
                              &Judge::intervals_fault, &Judge::whole_fault, &Judge::cost_fault}) {
      const std::string fault = (this->*check)();
      if (!fault.empty()) return fault;
    }
    return "";
  }

 private:
  int per_interval() const { return int(points_.at.size()) - 1; }
  int intervals() const { return int(motion_.t.size() - 1) / per_interval(); }
  int node(int k) const { return k * per_interval(); }
  VectorXd state(int point) const { return motion_.x.col(point); }
  VectorXd last() const { return state(int(motion_.t.size()) - 1); }

  std::string times_fault() {
    const Eigen::Index last = motion_.t.size() - 1;
    if (last < 1 || last % per_interval() != 0) return "has no whole number of intervals";
    if (!(std::abs(motion_.t[0]) + std::abs(motion_.t[last] - task_.duration) < 1e-9))
      return "does not last as long as the task";
    for (Eigen::Index k = 0; k < last; ++k)
      if (!(motion_.t[k + 1] > motion_.t[k])) return "goes back in time";
    for (int k = 0; k < intervals(); ++k) {
      const double begin = motion_.t[node(k)], h = motion_.t[node(k + 1)] - begin;
      for (int i = 0; i < per_interval(); ++i)
        if (!(std::abs(motion_.t[node(k) + i] - begin - points_.at[std::size_t(i)] * h) < 1e-9))
          return "has points where its scheme has none";
    }
    return "";
  }

  // How far a state is from the goal: position, turn, rates, each as a length.
  struct Away {
    double place, turn, rate;
  };
  Away away(const VectorXd& x) const {
    const auto angle = [](const Eigen::Matrix3d& off) { return Eigen::AngleAxisd(off).angle(); };
    const double rate = x.tail(nv_).norm();
    if (task_.floats()) {
      const auto turn = [](const VectorXd& q) {
        return Eigen::Quaterniond(q[6], q[3], q[4], q[5]).normalized().toRotationMatrix();
      };
      return {(x - task_.goal).head(3).norm(), angle(turn(task_.goal).transpose() * turn(x)), rate};
    }
    if (task_.goal.size() > 0) return {(x - task_.goal).head(nq_).norm(), 0, rate};
    const Eigen::Isometry3d X = robot_.pose(x.head(nq_), task_.frame);
    return {(X.translation() - task_.place).norm(),
            task_.axes ? angle(task_.axes->transpose() * X.linear()) : 0, rate};
  }

  std::string ends_fault() {
    if (!((state(0) - task_.start).cwiseAbs().maxCoeff() < 1e-7)) return "does not begin at the start";
    const Away off = away(last());
    const auto missed = [&](const Away& allowed) {
      return off.place <= allowed.place && off.turn <= allowed.turn && off.rate <= allowed.rate
                 ? ""
                 : "misses the goal by " + digits(off.place) + " and " + digits(off.turn) +
                       " rad, at a rate of " + digits(off.rate);
    };
    if (!by_ddp_) return missed({kEnds, kEnds, kEnds});
    // Of each state a part of how far the motion moves it; of a pose, of how far it begins from its goal.
    const VectorXd most = kGoal * 1.01 * extents();
    const Away begin = away(task_.start);
    const double rate = most.tail(nv_).norm(), turn = kGoal * 1.01 * begin.turn;
    if (task_.goal.size() > 0)
      return missed({most.head(task_.floats() ? 3 : nq_).norm(),
                     task_.floats() ? 2 * 1.01 * most.segment(3, 4).norm() : 0, rate});
    const double pose = kGoal * 1.01 * std::hypot(begin.place, begin.turn);
    return missed({pose, std::max(pose, turn), rate});
  }

  // What the motion moves each state by, or what it is measured by where it moves little.
  VectorXd extents() const {
    VectorXd extent = motion_.x.rowwise().maxCoeff() - motion_.x.rowwise().minCoeff();
    const VectorXd size = motion_.x.cwiseAbs().rowwise().maxCoeff();
    for (const auto& [first, count] : {std::pair{0, nq_}, {nq_, nv_}}) {
      const double most = extent.segment(first, count).maxCoeff();
      for (int i = first; i < first + count; ++i)
        extent[i] = std::max({extent[i], 1e-4 * most, 1e-2 * std::max(1., size[i])});
    }
    return extent;
  }

  std::string controls_fault() {
    for (Eigen::Index p = 0; p < motion_.t.size(); ++p) {
      const int within = int(p) % per_interval();
      // What a scheme extrapolates to the ends has no limit.
      if (within < points_.first_used && points_.first_used > 0 && p == 0) continue;
      for (Eigen::Index i = 0; i < task_.most.size(); ++i) {
        const double u = motion_.u(i, p), range = task_.most[i] - task_.least[i];
        if (!(u <= task_.most[i] + 1e-6 * range && u >= task_.least[i] - 1e-6 * range))
          return "control " + std::to_string(i) + " is " + digits(u) + " at " + digits(motion_.t[p]) +
                 " s, allowed " + digits(task_.most[i]);
      }
    }
    return "";
  }

  // The polynomial through the points that the scheme uses, cut where it passes a limit by more than a slack.
  VectorXd control(int k, double share) const {
    VectorXd u = VectorXd::Zero(motion_.u.rows());
    for (int i = points_.first_used; i < points_.first_used + points_.used; ++i) {
      double weight = 1;
      for (int j = points_.first_used; j < points_.first_used + points_.used; ++j) {
        const double ti = points_.at[std::size_t(i)], tj = points_.at[std::size_t(j)];
        if (j != i) weight *= (share - tj) / (ti - tj);
      }
      u += weight * motion_.u.col(node(k) + i);
    }
    for (Eigen::Index i = 0; i < u.size(); ++i) {
      const double moved = motion_.u.row(i).maxCoeff() - motion_.u.row(i).minCoeff();
      const double slack = 9e-4 * std::max(task_.most[i] - task_.least[i], moved);
      u[i] = std::clamp(u[i], task_.least[i] - slack, task_.most[i] + slack);
    }
    return u;
  }

  // The classical Runge-Kutta steps of an interval; all states on the way.
  std::vector<VectorXd> steps(int k, VectorXd x, int count) {
    const double h = (motion_.t[node(k + 1)] - motion_.t[node(k)]) / count;
    std::vector<VectorXd> states = {x};
    for (int i = 0; i < count; ++i) {
      const VectorXd first = control(k, double(i) / count), middle = control(k, (i + 0.5) / count),
                     end = control(k, (i + 1.) / count);
      const VectorXd a = robot_.rate(x, first), b = robot_.rate(x + h / 2 * a, middle),
                     c = robot_.rate(x + h / 2 * b, middle), d = robot_.rate(x + h * c, end);
      x += h / 6 * (a + 2 * b + 2 * c + d);
      states.push_back(x);
    }
    return states;
  }

  // Steps are halved until that changes nothing, and what is left is extrapolated.
  std::vector<VectorXd> integrated(int k, const VectorXd& from) {
    std::vector<VectorXd> coarse = steps(k, from, 8);
    for (int count = 16;; count *= 2) {
      std::vector<VectorXd> fine = steps(k, from, count);
      const VectorXd change = (fine.back() - coarse.back()) / 15;
      fine.back() += change;
      if (!(change.cwiseAbs().maxCoeff() > 1e-10 * (1 + from.cwiseAbs().maxCoeff())) || count >= 1024)
        return fine;
      coarse = std::move(fine);
      coarse.back() -= change;
    }
  }

  std::string intervals_fault() {
    const VectorXd extent = extents(), &reported = report_.solution.verification.integration_error;
    if (reported.size() != intervals()) return "has not been re-simulated in all its intervals";
    for (int k = 0; k < intervals(); ++k) {
      const std::vector<VectorXd> states = integrated(k, state(node(k)));
      const VectorXd off = (states.back() - state(node(k + 1))).cwiseAbs();
      const std::string where = "interval " + std::to_string(k) + " of " + std::to_string(intervals());
      if (const double part = off.cwiseQuotient(extent).maxCoeff(); !(part <= 1.02 * kDefect))
        return where + " is off by " + digits(part) + " of the motion";
      if (!(std::abs(off.maxCoeff() - reported[k]) <= kAgreement * reported[k] + 1e-7))
        return where + " is off by " + digits(off.maxCoeff()) + ", reported as " + digits(reported[k]);
      for (const VectorXd& x : states)
        if (const std::string beyond = state_fault(x, off); !beyond.empty()) return beyond + " in " + where;
    }
    return "";
  }

  // A state on the way, of an interval that ends off by `off`.
  std::string state_fault(const VectorXd& x, const VectorXd& off) {
    for (int i = 0; task_.bounds_states && !task_.floats() && i < nv_; ++i) {
      const auto& joint = task_.model.joints[std::size_t(i)];
      const auto within = [&](double value, double low, double high, double defect) {
        const double allowed = kDefect * (high - low) + defect + 1e-6;
        return value <= high + allowed && value >= low - allowed;
      };
      if (!within(x[i], joint.limits.lower, joint.limits.upper, off[i]))
        return joint.name + " is at " + digits(x[i]);
      const double most = joint.limits.velocity;
      if (most > 0 && !within(x[nq_ + i], -most, most, off[nq_ + i]))
        return joint.name + " moves at " + digits(x[nq_ + i]);
    }
    // What an interval is off by moves bodies by no more than a metre a radian here.
    const double moved = off.head(nq_).cwiseAbs().sum();
    for (const Capsule& body : task_.bodies) {
      for (const Capsule& obstacle : task_.obstacles) {
        const double gap = robot_.gap(x.head(nq_), body, obstacle);
        if (!(gap >= -1e-6 - 2e-3 * (body.radius + obstacle.radius) - moved))
          return body.name + " is in " + obstacle.name + " by " + digits(-gap) + " m";
      }
    }
    return "";
  }

  std::string whole_fault() {
    VectorXd x = state(0);
    for (int k = 0; k < intervals(); ++k) x = integrated(k, x).back();
    const double miss = (x - last()).cwiseAbs().maxCoeff(), reported = report_.solution.verification.miss;
    // What amplifies an interval's error amplifies that of the integrations as well.
    const double worst = report_.solution.verification.worst_defect;
    const double amplified = worst > 1e-9 ? 1e-9 * std::max(1., reported / worst) : 1e-6;
    if (std::abs(miss - reported) <= kAgreement * reported + 1e-6 + amplified) return "";
    return "the controls alone lead " + digits(miss) + " away from the end, reported as " + digits(reported);
  }

  double running_cost(const VectorXd& x, const VectorXd& u) {
    const double speed = task_.slows * x.tail(nv_).squaredNorm();
    switch (task_.cost) {
      case RandomTask::Cost::kControl:
        return speed + u.squaredNorm();
      case RandomTask::Cost::kEffort:
        return speed + u.cwiseQuotient(task_.most).squaredNorm();
      case RandomTask::Cost::kAcceleration:
        break;
    }
    return speed + robot_.acceleration(x, u).squaredNorm();
  }

  // Of an interval whose control is held, by one Runge-Kutta step.
  double cost_of_step(int k) {
    const double h = motion_.t[node(k + 1)] - motion_.t[node(k)];
    const VectorXd x = state(node(k)), u = control(k, 0), a = robot_.rate(x, u), xb = x + h / 2 * a,
                   b = robot_.rate(xb, u), xc = x + h / 2 * b, xd = x + h * robot_.rate(xc, u);
    return h / 6 *
           (running_cost(x, u) + 2 * running_cost(xb, u) + 2 * running_cost(xc, u) + running_cost(xd, u));
  }

  double cost_of_points(int k) {
    const double h = motion_.t[node(k + 1)] - motion_.t[node(k)];
    double cost = 0;
    for (int i = 0; i <= per_interval(); ++i) {
      const double weight = h * points_.weight[std::size_t(i)];
      if (weight > 0) cost += weight * running_cost(state(node(k) + i), motion_.u.col(node(k) + i));
    }
    return cost;
  }

  std::string cost_fault() {
    double cost = 0;
    for (int k = 0; k < intervals(); ++k) cost += points_.used == 1 ? cost_of_step(k) : cost_of_points(k);
    const Away off = away(last());
    cost +=
        task_.draws_q * (off.place * off.place + off.turn * off.turn) + task_.draws_v * off.rate * off.rate;
    const double reported = report_.solution.cost();
    if (std::abs(cost - reported) <= 1e-6 * std::max(1., std::abs(cost))) return "";
    return "costs " + io::with_digits(cost, 9) + ", reported as " + io::with_digits(reported, 9);
  }

  const RandomTask& task_;
  const SolveReport& report_;
  const Trajectory& motion_;
  const bool by_ddp_;
  RobotAlone robot_;
  const Points points_;
  const int nq_, nv_;
};

}  // namespace

std::string fault_of(const RandomTask& task, const SolveReport& report, bool by_ddp) {
  return Judge(task, report, by_ddp).fault();
}

}  // namespace dyntape::testing
