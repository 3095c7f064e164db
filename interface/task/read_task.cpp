// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/task/task.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/interface/ocp/inverse_kinematics.h>
#include <dyntape/interface/ocp/robot_configuration.h>
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

void add_costs(Problem& problem, const Task& task, const TaskKeys::Costs& costs,
               const Eigen::VectorXd& goal) {
  for (std::size_t k = 0; k < costs.weights.size(); ++k) {
    if (costs.weights[k] > 0) problem.add(task_costs()[k].term(problem, task, costs.weights[k]));
  }
  const auto& model = task.scene.model;
  Eigen::VectorXd w_q = costs.tracking_q;
  if (floats(model)) {
    w_q.head<3>().setConstant(costs.tracking_base_position);
    w_q.segment<3>(3).setConstant(costs.tracking_base_orientation);
  }
  const Eigen::VectorXd q = goal.head(model.nq), v = goal.tail(model.nv);
  const auto tracking = [&](const Eigen::VectorXd& of_q, const Eigen::VectorXd& of_v) {
    return joint_tracking(task.scene, of_q, q.array().isNaN().select(dynamics::neutral(model), q), of_v,
                          v.array().isNaN().select(0, v));
  };
  if (!w_q.isZero(0) || !costs.tracking_v.isZero(0)) problem.add(tracking(w_q, costs.tracking_v));
  if (costs.end_q.isZero(0) && costs.end_v.isZero(0)) return;
  Term end = tracking(costs.end_q, costs.end_v);
  end.name = "tracking at the end", end.where = Where::kTerminal;
  problem.add(std::move(end));
}

void add_limits(Problem& problem, const Task& task, const TaskKeys::Limits& limits) {
  const auto& model = task.scene.model;
  const auto bound = [](Bounds& bounds, int i, const Limit& limit) {
    bounds.lower[i] = -limit.value;
    bounds.upper[i] = limit.value;
  };
  for (const auto& joint : model.joints) {
    if (dynamics::traits(joint.type).on_a_line) bound(problem.x, joint.idx_q, limits.positions);
    if (dynamics::is_single(joint.type)) bound(problem.x, model.nq + joint.idx_v, limits.velocities);
  }
  const int driven = int(actuated_dofs(task.scene).size());
  for (int k = 0; k < driven; ++k) bound(problem.u, k, limits.efforts);
  bound_by_ratings(problem, task, limits.of_robot());
}

// The goal as the guess takes it: where only a frame is given, a configuration in which it is in place.
Eigen::VectorXd guessed_goal(Task& task, const TaskKeys& keys) {
  const auto& model = task.scene.model;
  const Eigen::VectorXd goal = keys.goal.head(model.nq);
  if (!keys.target) return goal;
  Eigen::VectorXd from = keys.start.head(model.nq), neutral = dynamics::neutral(model);
  fill_free(model, from, neutral);
  if (!is_on_lines(model)) {
    task.notes.push_back(
        task.file + ": where '" + keys.target->frame +
        "' is at its goal is searched for robots with a fixed base; the guess stays at the start");
    return goal;
  }
  const auto is_clear = [&](const Eigen::VectorXd& q) {
    const auto keeps = [&](const Surroundings::Pair& pair) {
      return clearance(model, q, pair.a, pair.b) >= pair.least;
    };
    return std::all_of(task.around.apart.begin(), task.around.apart.end(), keeps);
  };
  // One that keeps clear, if there is one; the solver may still find its way from another.
  std::optional<Eigen::VectorXd> q = inverse_kinematics(task.scene, *keys.target, from, {.accept = is_clear});
  const bool keeps_clear = q.has_value();
  if (!q) q = inverse_kinematics(task.scene, *keys.target, from);
  if (q && !keeps_clear)
    task.notes.push_back(task.file + ": no configuration was found in which '" + keys.target->frame +
                         "' is at its goal and every body keeps clear; the guess ends in one that does not");
  if (q) return *q;
  task.notes.push_back(task.file + ": no configuration within the robot's limits was found in which '" +
                       keys.target->frame +
                       "' is at its goal, which may be out of reach; the guess stays at the start");
  return goal;
}

void add_guess(Problem& problem, const Task& task, Eigen::VectorXd from, Eigen::VectorXd to,
               const TaskKeys::Guess& guess) {
  fill_free(task.scene.model, from, to);
  const Stage<double> rest{0, Eigen::VectorXd::Zero(problem.n_x()), Eigen::VectorXd::Zero(problem.n_a()),
                           Eigen::VectorXd::Zero(problem.n_u())};
  problem.guess = [=, scene = task.scene, options = task.robot, duration = problem.duration](double t) {
    Stage<double> stage = rest;
    stage.t = t;
    const Eigen::VectorXd q = between(scene.model, from, to, t / duration);
    stage.x.head(scene.model.nq) = q;
    if (guess.slope)
      stage.x.tail(scene.model.nv) = velocity_between(scene.model, from, to, t / duration) / duration;
    if (guess.holding) stage.u = holding_controls(scene, options, q);
    return stage;
  };
}

// Contacts stay where the start has them.
void place_contacts(Task& task, const Eigen::VectorXd& q) {
  if (task.robot.contacts.empty() || !q.allFinite()) return;
  const auto& model = task.scene.model;
  dynamics::Data<double> data(model);
  dynamics::forward_kinematics<double>(model, data, q);
  for (HeldContact& contact : task.robot.contacts)
    contact.place = dynamics::frame_placement(model, data, model.frame_index(contact.frame)).p;
}

}  // namespace

bool read_task_scene(Section& file, Task& task) {
  file.about("a scene file that says robot, effects and actuated, in place of those keys here");
  if (const std::string name = file.get_or("scene", ""); !name.empty()) return take_scene(file, task, name);
  SceneRobot found = read_scene_robot(file, task.file, Floating::kAllowed);
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

  place_contacts(task, keys.start.head(task.scene.model.nq));
  task.problem = robot_problem(task.scene, task.robot);
  task.problem.name = task.name;
  task.problem.free_time = keys.free_time;
  const int nq = task.scene.model.nq, nv = task.scene.model.nv;
  start_at(task.problem, task.scene, keys.start.head(nq), keys.start.tail(nv));
  end_at(task.problem, task.scene, keys.goal.head(nq), keys.goal.tail(nv));
  add_places(task.problem, task, keys);
  add_costs(task.problem, task, keys.costs, keys.goal);
  add_frame_tracking(task.problem, task, keys);
  add_limits(task.problem, task, keys.limits);
  add_guess(task.problem, task, keys.start.head(nq), guessed_goal(task, keys), keys.guess);
  check_ends(task, keys.limits.of_robot());
  if (task.by_ddp) {
    task.problem.x.lower.setConstant(-HUGE_VAL), task.problem.x.upper.setConstant(HUGE_VAL);
    try {
      check_shooting(drawn_problem(task));
    } catch (const ArgumentError& e) {
      throw FileError(path + ": 'solver.method' is ddp: " + e.what());
    }
  }
  return task;
}

Problem drawn_problem(const Task& task) {
  Problem problem = task.problem;
  const auto draws = [](const Term& term) { return term.name.find("tracking") != std::string::npos; };
  if (std::none_of(problem.terms.begin(), problem.terms.end(), draws))
    throw ArgumentError(
        "task \"" + task.name +
        "\": nothing draws it to its goal, which is not demanded; expected weights in costs.tracking");
  problem.goal.setConstant(Problem::kFree);
  std::erase_if(problem.terms, [](const Term& term) {
    return term.where == Where::kTerminal && (term.role == Role::kEquality || term.role == Role::kInequality);
  });
  return problem;
}

}  // namespace dyntape
