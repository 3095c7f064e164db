// SPDX-License-Identifier: BSD-3-Clause
#include "random_task.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/io/number.h>

namespace dyntape::testing {

using Eigen::Vector3d;
using Eigen::VectorXd;
using std::numbers::pi;

namespace {

constexpr double kRoom = 0.03;  // m between bodies and obstacles at both ends, at least

std::string number(double value) { return io::shortest(value); }

std::string list(const VectorXd& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : " ") + number(value);
  return "\"" + text + "\"";
}

std::string block(const std::string& name, const std::string& inside) {
  return name + " {\n" + inside + "}\n";
}

// An arm: the frame of its pose goals, whether these turn it as well, and what keeps clear.
struct Arm {
  const char *file, *lock, *frame;
  bool turns;
  double longest;  // s: quick motors allow less than is sensible for a mesh of 20
  std::vector<Capsule> bodies;
};

const std::vector<Arm>& arms() {
  static const std::vector<Arm> all = {
      {"arm_2r",
       "",
       "hand",
       false,
       0.8,
       {sphere("tip", "hand", {0, 0, 0}, 0.04), capsule("rod", "forearm", {0, 0, 0}, {0.4, 0, 0}, 0.03)}},
      {"ur5",
       "",
       "tool0",
       true,
       0.8,
       {sphere("tool", "tool0", {0, 0, 0}, 0.07),
        capsule("forearm", "forearm_link", {0, 0, 0}, {0, 0, 0.392}, 0.06)}},
      {"iiwa14",
       "",
       "iiwa_link_ee",
       true,
       0.8,
       {sphere("tool", "iiwa_link_ee", {0, 0, 0}, 0.07),
        capsule("forearm", "iiwa_link_5", {0, 0, -0.18}, {0, 0, 0.2}, 0.07)}},
      {"panda",
       "panda_finger_joint1 panda_finger_joint2",
       "panda_hand",
       true,
       0.8,
       {sphere("hand", "panda_hand", {0, 0, 0.05}, 0.1),
        capsule("forearm", "panda_link5", {0.06, 0, -0.32}, {0, 0, 0}, 0.08)}}};
  return all;
}

class Draw {
 public:
  Draw(const std::string& robots, unsigned seed, int index) : robots_(robots) {
    std::seed_seq sequence{seed, unsigned(index)};
    random_.seed(sequence);
  }

  RandomTask task() {
    const int kind = below(20);
    if (kind < 1) return block_on_rail();
    if (kind < 3) return pendulum();
    if (kind < 6) return cart_pole();
    if (kind < 8) return double_pendulum();
    if (kind < 10) return quadrotor();
    return arm(arms()[kind < 12 ? 0 : kind < 15 ? 1 : kind < 17 ? 2 : 3]);
  }

 private:
  int below(int n) { return int(random_() % unsigned(n)); }
  bool one_in(int n) { return below(n) == 0; }
  // Not by distributions, which differ between libraries.
  double uniform(double low, double high) {
    return low + (high - low) * double(random_()) / double(std::mt19937::max());
  }
  double rounded(double low, double high) { return std::round(1000 * uniform(low, high)) / 1000; }
  Vector3d within(double half) { return {rounded(-half, half), rounded(-half, half), rounded(-half, half)}; }

  void load(const std::string& file, const std::vector<std::string>& lock = {}, bool floats = false) {
    task_ = {};
    task_.robot = file;
    const std::string path = robots_ + "/" + file + ".urdf";
    dynamics::UrdfOptions options;
    options.base = floats ? dynamics::Base::kFloating : dynamics::Base::kFixed;
    options.lock = lock;
    task_.model = dynamics::load_urdf(path, options);
    task_.start = task_.goal = VectorXd::Zero(task_.model.nq + task_.model.nv);
    std::string locked;
    for (const std::string& joint : lock) locked += (locked.empty() ? "" : " ") + joint;
    task_.text = block("robot", " urdf \"" + path + "\"\n" + (floats ? " base floating\n" : "") +
                                    (lock.empty() ? "" : " lock \"" + locked + "\"\n"));
  }

  void drive(const std::vector<int>& dofs, double effort) {
    task_.driven = dofs;
    task_.most = VectorXd::Constant(Eigen::Index(dofs.size()), effort);
    if (effort == 0) {  // that of the file
      for (std::size_t k = 0; k < dofs.size(); ++k)
        task_.most[Eigen::Index(k)] = task_.model.joints[std::size_t(dofs[k])].limits.effort;
    }
    task_.least = -task_.most;
  }

  void set_scheme(bool is_forward) {
    const char* schemes[] = {"hermite-simpson", "hermite-simpson", "hermite-simpson",
                             "trapezoid",       "lobatto-4",       "hermite-simpson-linear",
                             "radau-3",         "runge-kutta-4",   "runge-kutta-4"};
    task_.scheme = schemes[below(is_forward ? 9 : 7)];
    task_.kind += ", " + task_.scheme + (is_forward ? "" : ", inverse");
    task_.dynamics = is_forward ? "forward" : "inverse";
  }

  void set_horizon(double duration) {
    task_.duration = duration;
    task_.text += block(
        "horizon", " duration " + number(duration) + "\n intervals " + std::to_string(20 + below(21)) + "\n");
  }

  void set_joints(const char* which, const VectorXd& state) {
    task_.text += block(which, " q " + list(state.head(task_.model.nq)) + "\n");
  }

  // Where differential dynamic programming is to apply there is no limit of states, and costs draw to the goal.
  void set_bounds(double effort, bool is_for_ddp) {
    task_.is_for_ddp = is_for_ddp, task_.bounds_states = !is_for_ddp;
    std::string bounds = is_for_ddp ? " positions none\n velocities none\n" : "";
    if (effort > 0) bounds += " efforts " + number(effort) + "\n";
    task_.text += bounds.empty() ? "" : block("bounds", bounds);
    if (is_for_ddp) task_.text += block("verify", " limits off\n");
  }

  void set_costs(RandomTask::Cost cost, double draws_q, double draws_v) {
    const char* names[] = {"control", "effort", "acceleration"};
    task_.cost = cost;
    std::string costs = std::string(" ") + names[int(cost)] + " 1\n", end;
    if (task_.is_for_ddp) {
      task_.draws_q = draws_q, task_.draws_v = draws_v;
      const bool by_joints = task_.goal.size() > 0 && !task_.floats();
      if (by_joints) end += " q " + number(draws_q) + "\n";
      if (!task_.floats()) end += " v " + number(draws_v) + "\n";
      std::string tracking = end.empty() ? "" : block("end", end);
      // Without it arms that have no limit whirl.
      if (cost == RandomTask::Cost::kEffort) {
        task_.slows = 0.05;
        tracking += " v " + number(task_.slows) + "\n";
      }
      if (!tracking.empty()) costs += block("tracking", tracking);
    }
    task_.text += block("costs", costs);
  }

  // Costs of the end that draw a frame to its place, where joints have none.
  std::string drawing_term(const std::string& type, const std::string& target, double weight) const {
    return block("term to_" + type, " type " + type + "\n frame " + task_.frame + "\n" +
                                        (target.empty() ? "" : " target " + target + "\n") +
                                        " where end\n weight " + number(weight) + "\n");
  }

  // With the ends given: those that keep clear of both, near the way between.
  void place_obstacles(int count, const std::vector<VectorXd>& ends, const VectorXd& middle,
                       const std::string& hand, bool in_plane) {
    const RobotAlone robot(task_);
    std::string text;
    for (int i = 0, tries = 0; i < count && tries < 200; ++tries) {
      Vector3d center = robot.pose(middle, hand).translation() + within(0.15);
      Vector3d to = center + Vector3d(within(0.4));
      if (in_plane) center[1] = to[1] = 0;
      for (int k = 0; k < 3; ++k) center[k] = std::round(1000 * center[k]) / 1000;
      const bool is_ball = one_in(2);
      if (is_ball) to = center;
      const std::string name = "obstacle_" + std::to_string(i);
      task_.obstacles.push_back(Capsule{name, kWorld, center, to, rounded(0.03, 0.1)});
      const auto is_clear = [&](const VectorXd& q) { return robot.least_gap(q) > kRoom; };
      if (!std::all_of(ends.begin(), ends.end(), is_clear)) {
        task_.obstacles.pop_back();
        continue;
      }
      text += of_capsule(task_.obstacles.back()), ++i;
    }
    task_.kind += ", " + std::to_string(task_.obstacles.size()) + " obstacles";
    if (text.empty()) return;
    task_.text += block("obstacles", text);
    text.clear();
    for (const Capsule& body : task_.bodies) text += of_capsule(body);
    task_.text += block("bodies", text);
  }

  static std::string of_capsule(const Capsule& c) {
    std::string inside = c.frame.empty() ? "" : " frame " + c.frame + "\n";
    inside += c.is_ball() ? " center " + list(c.from) + "\n"
                          : " from " + list(c.from) + "\n to " + list(c.to) + "\n";
    return block((c.is_ball() ? "sphere " : "capsule ") + c.name,
                 inside + " radius " + number(c.radius) + "\n");
  }

  // Bang and coast would need 4 d / T^2: from barely to amply.
  RandomTask block_on_rail() {
    load("block");
    const bool is_for_ddp = one_in(2);
    const double d = rounded(0.2, 2), T = rounded(0.5, 2), effort = d / T / T * uniform(4.3, 12);
    task_.goal[0] = one_in(2) ? d : -d;
    task_.kind = "move";
    drive({0}, effort);
    set_horizon(T), set_joints("start", task_.start), set_joints("goal", task_.goal), set_scheme(true);
    set_bounds(effort, is_for_ddp), set_costs(RandomTask::Cost::kControl, 1e5, 1e4);
    return task_;
  }

  RandomTask pendulum() {
    load("pendulum");
    const bool is_for_ddp = !one_in(3), is_forward = is_for_ddp || one_in(2);
    const double effort = rounded(4, 14);
    task_.goal[0] = one_in(2) ? pi : -pi;
    task_.kind = "swing-up";
    drive({0}, effort);
    set_horizon(rounded(1.5, 4)), set_joints("start", task_.start), set_joints("goal", task_.goal);
    set_scheme(is_forward), set_bounds(effort, is_for_ddp), set_costs(RandomTask::Cost::kControl, 1e4, 1e3);
    return task_;
  }

  RandomTask cart_pole() {
    load("cart_pole");
    const bool is_for_ddp = !one_in(3), is_forward = is_for_ddp || one_in(2), is_up = one_in(5);
    task_.start[0] = rounded(-0.8, 0.8), task_.start[1] = is_up ? pi : 0;
    task_.goal[0] = rounded(-1, 1), task_.goal[1] = is_up ? pi : one_in(4) ? 0 : one_in(2) ? pi : -pi;
    task_.kind = is_up ? "move, upright" : task_.goal[1] == 0 ? "move, hanging" : "swing-up";
    task_.text += "actuated slider\n";
    drive({0}, 0);
    set_horizon(rounded(1.6, 3)), set_joints("start", task_.start), set_joints("goal", task_.goal);
    set_scheme(is_forward), set_bounds(0, is_for_ddp), set_costs(RandomTask::Cost::kControl, 1e4, 1e3);
    return task_;
  }

  RandomTask double_pendulum() {
    load("double_pendulum");
    const bool is_for_ddp = !one_in(3), is_forward = is_for_ddp || one_in(2), is_acrobot = !one_in(3);
    const double effort = rounded(12, 40);
    task_.goal[0] = one_in(2) ? pi : -pi;
    task_.kind = is_acrobot ? "acrobot's swing-up" : "swing-up";
    if (is_acrobot) task_.text += "actuated elbow\n";
    drive(is_acrobot ? std::vector{1} : std::vector{0, 1}, effort);
    set_horizon(rounded(2, 4)), set_joints("start", task_.start), set_joints("goal", task_.goal);
    set_scheme(is_forward), set_bounds(effort, is_for_ddp), set_costs(RandomTask::Cost::kControl, 1e5, 1e4);
    return task_;
  }

  RandomTask quadrotor() {
    load("quadrotor", {}, true);
    const char* names[] = {"front", "left", "back", "right"};
    std::string text;
    for (int k = 0; k < 4; ++k) {
      const double moment = k % 2 ? -0.016 : 0.016;
      task_.rotors.push_back("rotor_" + std::to_string(k + 1)), task_.moments.push_back(moment);
      text +=
          block(std::string("thruster ") + names[k],
                " frame " + task_.rotors.back() + "\n lower 0.1\n upper 3\n moment " + number(moment) + "\n");
    }
    task_.text += block("thrusters", text);
    task_.least = VectorXd::Constant(4, 0.1), task_.most = VectorXd::Constant(4, 3);
    const Vector3d from(0, 0, 1), to(rounded(-3, 3), rounded(-3, 3), rounded(0.6, 2));
    const double yaw = rounded(-2.6, 2.6);
    task_.start.head<7>() << from, 0, 0, 0, 1;
    task_.goal.head<7>() << to, 0, 0, std::sin(yaw / 2), std::cos(yaw / 2);
    task_.kind = "flight", task_.frame = "frame";
    set_horizon(rounded(1.5, 3));
    task_.text += block("start", " base {\n position " + list(from) + "\n }\n");
    task_.text += block(
        "goal", " base {\n position " + list(to) + "\n roll_pitch_yaw \"0 0 " + number(yaw) + "\"\n }\n");
    task_.bodies = {sphere("hull", "frame", {0, 0, 0}, 0.25)};
    VectorXd middle = task_.start.head(7);
    middle.head<3>() = (from + to) / 2;
    place_obstacles(below(4), {task_.start, task_.goal}, middle, "frame", false);
    const bool is_for_ddp = task_.obstacles.empty(), is_forward = is_for_ddp || one_in(2);
    set_scheme(is_forward), set_bounds(0, is_for_ddp), set_costs(RandomTask::Cost::kControl, 1e4, 1e3);
    if (is_for_ddp)
      task_.text +=
          block("terms", drawing_term("frame_position", list(to), task_.draws_q) +
                             drawing_term("frame_orientation", "\"0 0 " + number(yaw) + "\"", task_.draws_q) +
                             drawing_term("frame_velocity", "", task_.draws_v));
    task_.text += block("guess", " control gravity\n");
    return task_;
  }

  // Between two configurations a joint's limits allow, in the time that its quickest joint takes and more.
  RandomTask arm(const Arm& of) {
    const std::string locked = of.lock;
    const std::size_t space = locked.find(' ');
    load(of.file, locked.empty() ? std::vector<std::string>{}
                                 : std::vector{locked.substr(0, space), locked.substr(space + 1)});
    const int n = task_.model.nq, wanted = one_in(2) ? 0 : below(4);
    const bool is_pose = one_in(2), is_for_ddp = wanted == 0 && !one_in(3);
    const bool is_forward = is_for_ddp || one_in(3);
    task_.bodies = of.bodies;
    double least_time = 0;
    std::vector<int> all;
    for (int i = 0; i < n; ++i) {
      const auto& limits = task_.model.joints[std::size_t(i)].limits;
      const double low = std::max(limits.lower, -pi) + 0.05, high = std::min(limits.upper, pi) - 0.05;
      task_.start[i] = rounded(low, high);
      task_.goal[i] = std::clamp(task_.start[i] + rounded(-1.3, 1.3), low, high);
      least_time = std::max(least_time, std::abs(task_.goal[i] - task_.start[i]) / limits.velocity);
      all.push_back(i);
    }
    drive(all, 0);
    task_.is_damped = one_in(3);
    if (task_.is_damped) task_.text += block("effects", " gravity on\n joint_damping robot\n");
    set_horizon(std::round(1000 * std::max(of.longest, 1.5 * least_time) * uniform(1, 1.8)) / 1000);
    set_joints("start", task_.start);
    const VectorXd end = task_.goal.head(n), middle = (task_.start.head(n) + end) / 2;
    std::string terms;
    task_.kind = is_pose ? "pose goal" : "joint goal";
    if (is_pose)
      terms = set_pose(of, end);
    else
      set_joints("goal", task_.goal);
    place_obstacles(wanted, {task_.start.head(n), end}, middle, of.frame, n == 2);
    set_scheme(is_forward), set_bounds(0, is_for_ddp);
    set_costs(is_for_ddp ? RandomTask::Cost::kEffort : RandomTask::Cost(1 + below(2)), 1e4, 1e3);
    if (is_pose && is_for_ddp) task_.text += block("terms", terms);
    task_.text += block("guess", " control gravity\n");
    return task_;
  }

  // That of a configuration, so that it can be reached.  Returns the terms that would draw to it.
  std::string set_pose(const Arm& of, const VectorXd& q) {
    const Eigen::Isometry3d X = RobotAlone(task_).pose(q, of.frame);
    task_.goal.resize(0);
    task_.frame = of.frame, task_.place = X.translation();
    std::string inside = " position " + list(task_.place) + "\n";
    std::string terms = drawing_term("frame_position", list(task_.place), 1e4);
    if (of.turns && !one_in(3)) {
      task_.axes = X.linear();
      const Vector3d ypr = X.linear().eulerAngles(2, 1, 0);
      const std::string turn = list(ypr.reverse());
      inside += " orientation " + turn + "\n", terms += drawing_term("frame_orientation", turn, 1e4);
      task_.kind = "pose goal, turned";
    }
    task_.text += block("goal", block("frame " + task_.frame, inside));
    return terms;
  }

  std::string robots_;
  std::mt19937 random_;
  RandomTask task_;
};

}  // namespace

RandomTask draw_task(const std::string& robots, unsigned seed, int index) {
  return Draw(robots, seed, index).task();
}

std::string file_text(const RandomTask& task, const std::string& method) {
  // Differential dynamic programming has steps of its own.
  const std::string scheme = method == "ddp" ? "" : " scheme " + task.scheme + "\n";
  return task.text + block("transcription", scheme + " dynamics " + task.dynamics + "\n") +
         block("solver", " method " + method + "\n max_iterations 1000\n max_seconds 10\n") +
         block("evaluation", " route machine_code\n");
}

}  // namespace dyntape::testing
