// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/task/task.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/ocp/inverse_kinematics.h>
#include <dyntape/interface/scene/scene.h>
#include <dyntape/interface/scene/scene_keys.h>
#include <dyntape/interface/task/limits.h>
#include <dyntape/interface/task/task_costs.h>
#include <dyntape/interface/task/task_keys.h>

namespace dyntape {

namespace {

using io::Section;

// What a scene file says, for a problem that is solved.
bool take_scene(Section& file, Task& task, const std::string& name) {
  for (const char* key : {"robot", "effects", "actuated"}) {
    if (file.has(key))
      file.problem(key,
                   std::string("'") + key + "' stands here and in the scene '" + name + "'; expected one");
  }
  try {
    Scene scene = read_scene(path_beside(task.file, file, "scene", name));
    task.urdf = std::move(scene.urdf);
    task.notes = std::move(scene.notes);
    task.scene = std::move(scene.robot);
    if (task.scene.lag.size() > 0)
      file.problem("scene", "'" + name + "' has motors with a lag, which only simulate knows");
    if (!task.scene.constraints.empty())
      file.problem("scene", "'" + name + "' has constraints, which only simulate knows");
    return true;
  } catch (const Error& e) {
    file.problem("scene", e.what());
    return false;
  }
}

// Of the goal's frame at the end, and of bodies and obstacles along the path.
void add_places(Problem& problem, const Task& task, const TaskKeys& keys) {
  if (keys.target)
    problem.add(terminal_equality("goal of " + keys.target->frame, frame_error(task.scene, *keys.target)));
  for (const Surroundings::Pair& pair : task.around.apart)
    problem.add(keep_clear(task.scene, pair.a, pair.b, pair.least));
}

void add_frame_tracking(Problem& problem, const Task& task, const TaskKeys& keys) {
  const auto add = [&](const char* name, double weight, const FrameTarget& target) {
    if (weight > 0) problem.add(running_squares(name, weighted(frame_error(task.scene, target), weight)));
  };
  if (!keys.target) return;
  const FrameTarget& target = *keys.target;
  add("position tracking", keys.costs.tracking_position, {target.frame, target.position, {}});
  add("orientation tracking", keys.costs.tracking_orientation, {target.frame, {}, target.orientation});
}

void add_costs(Problem& problem, const Task& task, const TaskKeys::Costs& costs) {
  for (std::size_t k = 0; k < costs.weights.size(); ++k) {
    if (costs.weights[k] > 0) problem.add(task_costs()[k].term(problem, task, costs.weights[k]));
  }
  if (costs.tracking_q.isZero(0) && costs.tracking_v.isZero(0)) return;
  const int n = task.scene.model.nv;
  const Eigen::VectorXd goal = problem.goal.array().isNaN().select(0, problem.goal);
  problem.add(joint_tracking(costs.tracking_q, goal.head(n), costs.tracking_v, goal.tail(n)));
}

void add_limits(Problem& problem, const Task& task, const TaskKeys::Limits& limits) {
  const int n = task.scene.model.nv;
  const auto all = [](auto lower, auto upper, const Limit& limit) {
    lower.setConstant(-limit.value);
    upper.setConstant(limit.value);
  };
  all(problem.x.lower.head(n), problem.x.upper.head(n), limits.positions);
  all(problem.x.lower.tail(n), problem.x.upper.tail(n), limits.velocities);
  all(problem.u.lower.head(problem.n_u()), problem.u.upper.head(problem.n_u()), limits.efforts);
  bound_by_ratings(problem, task, limits.of_robot());
}

// The goal as the guess takes it: where only a frame is given, a configuration in which it is in place.
Eigen::VectorXd guessed_goal(Task& task, const TaskKeys& keys) {
  const Problem& problem = task.problem;
  if (!keys.target) return problem.goal;
  const int n = task.scene.model.nv;
  Eigen::VectorXd goal = problem.goal;
  const Eigen::VectorXd from = problem.start.head(n).array().isNaN().select(0, problem.start.head(n));
  const auto is_clear = [&](const Eigen::VectorXd& q) {
    const auto keeps = [&](const Surroundings::Pair& pair) {
      return clearance(task.scene.model, q, pair.a, pair.b) >= pair.least;
    };
    return std::all_of(task.around.apart.begin(), task.around.apart.end(), keeps);
  };
  // One that keeps clear, if there is one; the solver may still find its way from another.
  std::optional<Eigen::VectorXd> q = inverse_kinematics(task.scene, *keys.target, from, {.accept = is_clear});
  const bool keeps_clear = q.has_value();
  if (!q) q = inverse_kinematics(task.scene, *keys.target, from);
  if (q && !keeps_clear) {
    task.notes.push_back(task.file + ": no configuration was found in which '" + keys.target->frame +
                         "' is at its goal and every body keeps clear; the guess ends in one that does not");
  }
  if (q) {
    goal.head(n) = *q;
  } else {
    task.notes.push_back(task.file + ": no configuration within the robot's limits was found in which '" +
                         keys.target->frame +
                         "' is at its goal, which may be out of reach; the guess stays at the start");
  }
  return goal;
}

void add_guess(Problem& problem, const Task& task, const Eigen::VectorXd& goal,
               const TaskKeys::Guess& guess) {
  Problem ends = problem;
  ends.goal = goal;
  const auto line = straight_line(ends);
  const int n = task.scene.model.nv;
  const Eigen::VectorXd slope =
      (line(problem.duration).x.head(n) - line(0).x.head(n)) / problem.duration * (guess.slope ? 1 : 0);
  const RobotScene scene = task.scene;
  const std::vector<int> dofs = actuated_dofs(scene);
  const bool fraction = task.robot.unit == ControlUnit::kFraction;
  problem.guess = [=](double t) {
    Stage<double> stage = line(t);
    stage.x.tail(n) = slope;
    if (!guess.holding) return stage;
    const Eigen::VectorXd torque = holding_torque(scene, stage.x.head(n));
    for (std::size_t k = 0; k < dofs.size(); ++k) {
      const double limit = scene.model.joints[static_cast<std::size_t>(dofs[k])].limits.effort;
      stage.u[static_cast<Eigen::Index>(k)] = torque[dofs[k]] / (fraction ? limit : 1);
    }
    return stage;
  };
}

}  // namespace

bool read_task_scene(Section& file, Task& task) {
  file.about("a scene file that says robot, effects and actuated, in place of those keys here");
  if (const std::string name = file.get_or("scene", ""); !name.empty()) return take_scene(file, task, name);
  SceneRobot found = read_scene_robot(file, task.file, Floating::kRefused);
  task.urdf = found.urdf;
  if (found.robot) {
    task.notes = std::move(found.robot->notes);
    task.scene.model = std::move(found.robot->model);
  }
  read_scene_keys(file, task.scene, found.robot ? &task.scene.model : nullptr);
  return found.robot.has_value();
}

Task read_task(const std::string& path) {
  const std::string text = read_file(path);
  check_is_no_robot(text, path,
                    "a task file; expected an .info file that names its robot, as those in config/tasks do");
  Section file = Section::parse(text, path);
  Task task;
  task.file = path;
  task.name = read_task_name(file, std::filesystem::path(path).stem().string());
  const bool known = read_task_scene(file, task);
  const TaskKeys keys = read_task_keys(file, task, known ? &task.scene.model : nullptr);
  file.finish();
  task.effective = file.effective_values();

  task.problem = robot_problem(task.scene, task.robot);
  task.problem.name = task.name;
  task.problem.free_time = keys.free_time;
  task.problem.start = keys.start;
  task.problem.goal = keys.goal;
  add_places(task.problem, task, keys);
  add_costs(task.problem, task, keys.costs);
  add_frame_tracking(task.problem, task, keys);
  add_limits(task.problem, task, keys.limits);
  add_guess(task.problem, task, guessed_goal(task, keys), keys.guess);
  check_ends(task, keys.limits.of_robot());
  return task;
}

}  // namespace dyntape
