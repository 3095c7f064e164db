// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/task/task.h>

#include <cmath>
#include <filesystem>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/task/limits.h>
#include <dyntape/interface/task/task_costs.h>
#include <dyntape/interface/task/task_keys.h>

namespace dyntape {

namespace {

using io::Section;

// Each line of a robot's file would be a problem of its own.
void check_is_no_robot(std::string_view text, const std::string& file) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == text.npos || text[first] != '<') return;
  const char* const kind = text.find("<robot") == text.npos ? "XML" : "a URDF";
  throw FileError(file + " is " + kind +
                  ", not a task file; expected an .info file that names its robot, as those in config/tasks "
                  "do (dyntape info shows "
                  "a robot)");
}

// Nothing where there is none, or not the one that is meant: the file has a problem then.
std::optional<dynamics::UrdfRobot> read_robot(Section& file, Task& task) {
  const RobotKeys keys = read_robot_keys(file);
  if (!keys.are_sound) return std::nullopt;
  Section block = file.child("robot");
  task.urdf = (std::filesystem::path(task.file).parent_path() / keys.urdf).lexically_normal().string();
  try {
    dynamics::UrdfRobot robot = dynamics::read_urdf(task.urdf, keys.options);
    if (robot.model.nv > 0) return robot;
    block.problem("urdf", "'" + keys.urdf + "' has no joint that moves: nothing to control");
  } catch (const Error& e) {
    block.problem("urdf", e.what());
  }
  return std::nullopt;
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

void add_guess(Problem& problem, const Task& task, const TaskKeys::Guess& guess) {
  const auto line = straight_line(problem);
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

Task read_task(const std::string& path) {
  const std::string text = read_file(path);
  check_is_no_robot(text, path);
  Section file = Section::parse(text, path);
  Task task;
  task.file = path;
  task.name = read_task_name(file, std::filesystem::path(path).stem().string());
  std::optional<dynamics::UrdfRobot> robot = read_robot(file, task);
  if (robot) {
    task.notes = std::move(robot->notes);
    task.scene.model = std::move(robot->model);
  }
  const TaskKeys keys = read_task_keys(file, task, robot ? &task.scene.model : nullptr);
  file.finish();
  task.effective = file.effective_values();

  task.problem = robot_problem(task.scene, task.robot);
  task.problem.name = task.name;
  task.problem.start = keys.start;
  task.problem.goal = keys.goal;
  add_costs(task.problem, task, keys.costs);
  add_limits(task.problem, task, keys.limits);
  add_guess(task.problem, task, keys.guess);
  check_ends(task, keys.limits.of_robot());
  return task;
}

}  // namespace dyntape
