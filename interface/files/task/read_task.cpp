// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/task/task.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/interface/control/problem/penalties.h>
#include <dyntape/interface/files/file_kind.h>
#include <dyntape/interface/files/joint_values.h>
#include <dyntape/interface/files/old_names.h>
#include <dyntape/interface/files/scene/left_out.h>
#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/files/scene/scene_keys.h>
#include <dyntape/interface/files/task/limits.h>
#include <dyntape/interface/files/task/task_costs.h>
#include <dyntape/interface/files/task/task_keys.h>
#include <dyntape/interface/files/task/task_phases.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/motion/inverse_kinematics.h>
#include <dyntape/interface/motion/robot_configuration.h>

namespace dyntape {

namespace {

using io::Section;

constexpr double kMark = 0.02;  // m, of a waypoint in a picture

// What a scene file says, for a problem that is solved.
bool take_scene(Section& file, Task& task, const std::string& name) {
  for (const char* key : {"robot", "effects", "actuated"}) {
    if (file.has(key))
      file.problem(key,
                   std::string("'") + key + "' stands here and in the scene '" + name + "'; expected one");
  }
  try {
    const auto simulated =
        std::make_shared<const Scene>(read_scene(path_beside(task.file, file, "scene", name)));
    task.urdf = simulated->urdf;
    task.inputs = simulated->inputs;
    task.notes = simulated->notes;
    task.left_out = simulated->left_out;
    task.scene = simulated->robot;
    if (task.scene.lag.size() > 0)
      file.problem("scene", "'" + name + "' has motors with a lag, which only simulate knows");
    if (!task.scene.constraints.rigid.empty()) task.simulated = simulated;
    try {
      check_implicit_contacts(task.scene);
    } catch (const ArgumentError& e) {
      file.problem("scene", "'" + name + "': " + e.what());
    }
    return true;
  } catch (const Error& e) {
    file.problem("scene", e.what());
    return false;
  }
}

// Of the goal's frame at the end, of waypoints, and of bodies and obstacles along the path.
void add_places(Problem& problem, const Task& task, const TaskKeys& keys) {
  if (keys.target)
    problem.add(terminal_equality("goal of " + keys.target->frame, frame_error(task.scene, *keys.target)));
  for (const TaskWaypoint& waypoint : keys.waypoints) problem.add(term_of(waypoint, task.scene));
  for (const Surroundings::Pair& pair : task.around.apart) {
    const Term clear = keep_clear(task.scene, pair.a, pair.b, pair.least);
    const double mu = task.around.barrier;
    problem.add(mu > 0 ? soft(clear, RelaxedBarrier{mu, task.around.width}) : clear);
  }
}

void add_costs(Problem& problem, const Task& task, const TaskKeys::Costs& costs) {
  for (std::size_t k = 0; k < costs.weights.size(); ++k) {
    if (costs.weights[k] > 0) problem.add(task_costs()[k].term(problem, task, costs.weights[k]));
  }
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

// Weights of joints (nv): none where the goal (nq) is open.
Eigen::VectorXd where_known(const dynamics::Model<double>& model, const Eigen::VectorXd& goal,
                            Eigen::VectorXd w_q) {
  for (const auto& joint : model.joints) {
    const int n = dynamics::nv(joint.type);
    if (n > 0 && std::isnan(goal[joint.idx_q])) w_q.segment(joint.idx_v, n).setZero();
  }
  return w_q;
}

// Positions where they are weighed, else velocities.
Task::Aim aim_of(const ReferenceMotion& reference, Eigen::Index nq) {
  Eigen::VectorXd weight = reference.weight;
  const bool has_positions = !weight.head(nq).isZero(0);
  (has_positions ? weight.tail(weight.size() - nq) : weight.head(nq)).setZero();
  const Eigen::ArrayXd counts = (weight.array() > 0).cast<double>();
  return {"the reference",
          has_positions ? "norm over the joints, rad or m" : "norm over the joints, rad/s or m/s",
          [reference, counts](double t, const Eigen::VectorXd& x) {
            return ((x.head(counts.size()) - reference.at(t)).array() * counts).matrix().norm();
          },
          [reference](double t) {
            return Eigen::VectorXd((reference.weight.array() > 0).select(reference.at(t), std::nan("")));
          }};
}

Task::Aim aim_of(const RobotScene& scene, const FrameTarget& target) {
  const bool has_position = target.position.has_value();
  const StageFunction away = has_position ? frame_position(scene, target.frame, *target.position)
                                          : frame_orientation(scene, target.frame, *target.orientation);
  return {"the goal of " + target.frame,
          has_position ? "m" : "rad",
          [away](double t, const Eigen::VectorXd& x) {
            return away(Stage<double>{t, x, {}, {}}).norm();
          },
          {},
          has_position ? target.frame : "",
          target.position.value_or(Eigen::Vector3d::Zero())};
}

// The first frame that follows a target.
Task::Aim aim_of(const dynamics::Model<double>& model, const std::vector<TaskTerm>& terms) {
  const auto follows = [](const TaskTerm& term) { return term.target && !term.frame.empty(); };
  const auto term = std::find_if(terms.begin(), terms.end(), follows);
  if (term == terms.end()) return {};
  return {"the moving target of " + term->frame, "m",
          [model, frame = term->frame, target = term->target](double t, const Eigen::VectorXd& x) {
            dynamics::Data<double> data(model);
            dynamics::forward_kinematics<double>(model, data, Eigen::VectorXd(x.head(model.nq)));
            return (dynamics::frame_placement(model, data, model.frame_index(frame)).p - target(t)).norm();
          }};
}

Task::Aim aim_of(const Task& task, const TaskKeys& keys) {
  const auto& model = task.scene.model;
  if (keys.reference) return aim_of(*keys.reference, model.nq);
  if (keys.target) return aim_of(task.scene, *keys.target);
  const Eigen::VectorXd goal = keys.goal.head(model.nq);
  if (goal.array().isNaN().all()) return aim_of(model, keys.terms);
  return {"the goal", "norm over the joints, rad or m",
          [model, goal, by = task.travel](double t, const Eigen::VectorXd& x) {
            Eigen::VectorXd q = x.head(model.nq), known = goal;
            fill_free(model, q, known);
            if (!by.isZero(0)) known.head<2>() += by * t;
            return dynamics::difference<double>(model, known, q).norm();
          },
          [state = keys.goal](double) { return state; }};
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

// A configuration in which a frame is where it shall be, from one nearby; `there`: "at its goal".  None: `otherwise`, and a note
// says so.
Eigen::VectorXd placed_for_guess(Task& task, const FrameTarget& target, const Eigen::VectorXd& from,
                                 const std::string& there, const Eigen::VectorXd& otherwise,
                                 const std::string& stays) {
  const auto& model = task.scene.model;
  if (!is_on_lines(model)) {
    task.notes.push_back(task.file + ": where '" + target.frame + "' is " + there +
                         " is searched for robots with a fixed base; " + stays);
    return otherwise;
  }
  const auto is_clear = [&](const Eigen::VectorXd& q) {
    const auto keeps = [&](const Surroundings::Pair& pair) {
      return clearance(model, q, pair.a, pair.b) >= pair.least;
    };
    return std::all_of(task.around.apart.begin(), task.around.apart.end(), keeps);
  };
  // One that keeps clear, if there is one; the solver may still find its way from another.
  std::optional<Eigen::VectorXd> q = inverse_kinematics(task.scene, target, from, {.accept = is_clear});
  const bool keeps_clear = q.has_value();
  if (!q) q = inverse_kinematics(task.scene, target, from);
  if (q && !keeps_clear)
    task.notes.push_back(task.file + ": no configuration was found in which '" + target.frame + "' is " +
                         there + " and every body keeps clear; the guess has one that does not");
  if (q) return *q;
  task.is_out_of_reach = true;
  const std::string why = why_unreachable(model, target, "the place of '" + target.frame + "' " + there);
  if (task.unreachable.empty()) task.unreachable = why;
  task.notes.push_back(task.file + ": no configuration within the robot's limits was found in which '" +
                       target.frame + "' is " + there +
                       (why.empty() ? ", which may be out of reach; " : ": " + why + "; ") + stays);
  return otherwise;
}

// The joints of one velocity each, of another configuration.
void take_joints(const dynamics::Model<double>& model, const Eigen::VectorXd& from, Eigen::VectorXd& q) {
  for (const auto& joint : model.joints) {
    const int n = dynamics::nq(joint.type);
    if (dynamics::is_single(joint.type)) q.segment(joint.idx_q, n) = from.segment(joint.idx_q, n);
  }
}

// From the start over the waypoints to the goal.
std::vector<GuessKnot> guess_knots(Task& task, const TaskKeys& keys) {
  const auto& model = task.scene.model;
  Eigen::VectorXd from = keys.start.head(model.nq), to = keys.goal.head(model.nq),
                  neutral = dynamics::neutral(model);
  Eigen::VectorXd start = from;
  fill_free(model, start, neutral);
  std::vector<GuessKnot> passed;
  for (const TaskWaypoint& waypoint : keys.waypoints) {
    const Eigen::VectorXd& before = passed.empty() ? start : passed.back().q;
    const std::string there = "at waypoint '" + waypoint.name + "'";
    Eigen::VectorXd q = before;
    if (waypoint.target)
      q = placed_for_guess(task, *waypoint.target, before, there, before, "the guess stays where it was");
    if (waypoint.q.size() > 0) take_joints(model, configuration_of(model, waypoint.q), q);
    if (passed.empty() || waypoint.at > passed.back().share) passed.push_back({waypoint.at, q});
  }
  if (keys.target)
    to = placed_for_guess(task, *keys.target, passed.empty() ? start : passed.back().q, "at its goal", to,
                          "the guess stays at the start");
  if (keys.closed) to = end_of_step(model, keys.closed->step, from);
  fill_free(model, from, to);
  passed.insert(passed.begin(), {0, from});
  passed.push_back({1, to});
  return passed;
}

void add_guess(Problem& problem, const Task& task, const std::vector<GuessKnot>& knots,
               const TaskKeys::Guess& guess) {
  const Stage<double> rest{0, Eigen::VectorXd::Zero(problem.n_x()), Eigen::VectorXd::Zero(problem.n_a()),
                           Eigen::VectorXd::Zero(problem.n_u())};
  problem.guess = [=, scene = task.scene, options = task.robot, duration = problem.duration](double t) {
    Stage<double> stage = rest;
    stage.t = t;
    std::size_t k = 1;
    while (k + 1 < knots.size() && knots[k].share * duration < t) ++k;
    const GuessKnot &from = knots[k - 1], &to = knots[k];
    const double span = (to.share - from.share) * duration, s = (t - from.share * duration) / span;
    const Eigen::VectorXd q = between(scene.model, from.q, to.q, s);
    stage.x.head(scene.model.nq) = q;
    if (guess.slope) stage.x.tail(scene.model.nv) = velocity_between(scene.model, from.q, to.q, s) / span;
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
  for (HeldContact& contact : task.robot.contacts) {
    const auto placement = dynamics::frame_placement(model, data, model.frame_index(contact.frame));
    contact.place = placement.p, contact.axes = placement.R;
  }
}

// The height of a contact's point that is farthest from the floor (m), relative to it.
double above_floor(const HeldContact& contact, double floor) {
  double farthest = contact.corners.empty() ? contact.place->z() - floor : 0;
  for (const Eigen::Vector3d& corner : contact.corners) {
    const double height = (*contact.place + *contact.axes * corner).z() - floor;
    if (std::abs(height) > std::abs(farthest)) farthest = height;
  }
  return farthest;
}

// Contacts that are held in mid-air or below the floor; where a phase lands one higher or lower, it says so.
void check_floor(Task& task, const TaskKeys& keys) {
  constexpr double kStands = 1e-3;  // m
  const double floor = task.floor.value_or(0);
  std::set<std::string> held, moved;
  for (const TaskKeys::Phase& phase : keys.phases) {
    held.insert(phase.hold.begin(), phase.hold.end());
    for (const auto& [name, by] : phase.moved)
      if (by.z() != 0) moved.insert(name);
  }
  std::vector<std::string> faults;
  for (const HeldContact& contact : task.robot.contacts) {
    if (!contact.place || moved.count(contact.frame)) continue;
    if (!keys.phases.empty() && !held.count(contact.frame)) continue;
    const double height = above_floor(contact, floor);
    if (!(std::abs(height) > kStands)) continue;
    faults.push_back(task.file + ": the contact \"" + contact.frame + "\" is held " +
                     io::significant(std::abs(height), 3) + " m " + (height > 0 ? "above" : "below") +
                     " the floor, which is at z = " + io::significant(floor, 3) +
                     " m; expected a start that stands on it, or its height in 'contacts.floor'");
  }
  if (faults.empty()) return;
  if (task.floor) throw FileError(faults);
  task.notes.insert(task.notes.end(), faults.begin(), faults.end());
}

}  // namespace

void compose_problem(Task& task, const TaskKeys& keys, const std::vector<GuessKnot>& guess) {
  task.problem = robot_problem(task.scene, task.robot);
  task.problem.name = task.name;
  task.problem.free_time = keys.free_time;
  const int nq = task.scene.model.nq, nv = task.scene.model.nv;
  const bool begins_anywhere = keys.start.array().isNaN().all();  // as phases behind others do
  if (!begins_anywhere) start_at(task.problem, task.scene, keys.start.head(nq), keys.start.tail(nv));
  end_at(task.problem, task.scene, keys.goal.head(nq), keys.goal.tail(nv));
  add_places(task.problem, task, keys);
  add_costs(task.problem, task, keys.costs);
  if (keys.gait) walk(task.problem, task.scene, task.robot.contacts, *keys.gait, keys.swing);
  if (keys.reference) follow(task.problem, *keys.reference);
  for (const TaskTerm& term : keys.terms) add(term, task.problem);
  add_limits(task.problem, task, keys.limits);
  add_guess(task.problem, task, guess, keys.guess);
  check_ends(task, keys.limits.of_robot());
}

void draw_to_goal(Task& task, const TaskKeys& keys, bool ends) {
  if (keys.gait && !keys.gait->velocity.isZero(0)) {
    task.travel = keys.gait->velocity;
    task.problem.parameters.add("travel", [by = task.travel](double t) -> Eigen::VectorXd { return by * t; });
  }
  add_frame_tracking(task.problem, task, keys);
  const auto& model = task.scene.model;
  const TaskKeys::Costs& costs = keys.costs;
  const Eigen::VectorXd q = keys.goal.head(model.nq), v = keys.goal.tail(model.nv);
  const auto tracking = [&](const Eigen::VectorXd& w_q, const Eigen::VectorXd& weights_v, Where where,
                            const char* name) {
    const Eigen::VectorXd w_v = v.array().isNaN().select(0, weights_v);
    if (w_q.isZero(0) && w_v.isZero(0)) return;
    Term term = joint_tracking(task.scene, w_q, q.array().isNaN().select(dynamics::neutral(model), q), w_v,
                               v.array().isNaN().select(0, v));
    term.name = name, term.where = where;
    if (!task.travel.isZero(0)) {
      const Parameter gone = task.problem.parameters.find("travel");
      term.function = [f = term.function, gone, root = w_q.head<2>().cwiseSqrt().eval()](const auto& s) {
        auto r = f(s);
        for (int i = 0; i < 2; ++i) r[i] -= gone(s)[i] * root[i];
        return r;
      };
    }
    task.problem.add(std::move(term));
  };
  Eigen::VectorXd w_q = where_known(model, q, costs.tracking_q);
  if (floats(model)) {  // whose goals are checked when the file is read
    w_q.head<3>().setConstant(costs.tracking_base_position);
    w_q.segment<3>(3).setConstant(costs.tracking_base_orientation);
  }
  tracking(w_q, costs.tracking_v, Where::kRunning, "tracking");
  if (ends)
    tracking(where_known(model, q, costs.end_q), costs.end_v, Where::kTerminal, "tracking at the end");
}

bool read_task_scene(Section& file, Task& task) {
  file.about("a scene file that says robot, effects and actuated, in place of those keys here");
  if (const std::string name = file.get_or("scene", ""); !name.empty()) return take_scene(file, task, name);
  SceneRobot found = read_scene_robot(file, task.file, Floating::kAllowed);
  task.urdf = found.urdf;
  if (found.robot) {
    task.notes = std::move(found.robot->notes);
    task.left_out = std::move(found.robot->left_out);
    task.scene.model = std::move(found.robot->model);
  }
  read_scene_keys(file, task.scene, {found.robot ? &task.scene.model : nullptr, task.urdf, &task.left_out});
  return found.robot.has_value();
}

Task read_task(const std::string& path, const std::vector<io::Setting>& settings) {
  return read_task_text(read_file(path), path, settings);
}

Task read_task_text(const std::string& text, const std::string& path,
                    const std::vector<io::Setting>& settings) {
  check_is_no_robot(text, path,
                    "a task file; expected an .info file that names its robot, as those in config/tasks do");
  check_file_kind(text, path, FileKind::kTask);
  Section file = Section::parse(text, path, old_names(), settings);
  Task task;
  task.file = path;
  task.name = read_task_name(file, std::filesystem::path(path).stem().string());
  const bool known = read_task_scene(file, task);
  TaskKeys keys = read_task_keys(file, task, known ? &task.scene.model : nullptr);
  file.finish();
  note_left_out(task.notes, task.urdf, task.left_out, task.scene, LimitsOfFile::kHeld);
  note_old_names(task.notes, file);
  task.effective = file.effective_values();
  task.inputs.insert(task.inputs.end(), file.files().begin(), file.files().end());
  for (const TaskWaypoint& w : keys.waypoints) {
    if (w.target && w.target->position)
      task.passed.push_back(sphere(w.name, kWorld, *w.target->position, kMark));
  }

  place_contacts(task, keys.start.head(task.scene.model.nq));
  if (keys.closed) place_last_step(task, keys);
  check_floor(task, keys);
  const std::vector<GuessKnot> guess = guess_knots(task, keys);
  if (keys.closed) keys.start.setConstant(Problem::kFree);
  compose_problem(task, keys, guess);
  draw_to_goal(task, keys, true);
  task.aim = aim_of(task, keys);
  if (!keys.phases.empty()) compose_phases(task, keys, guess.front().q, guess.back().q);
  if (keys.closed) close_motion(task, keys);
  if (task.by_ddp) {
    task.problem.x.lower.setConstant(-HUGE_VAL), task.problem.x.upper.setConstant(HUGE_VAL);
    try {
      check_shooting(tracking_problem(task));
    } catch (const ArgumentError& e) {
      throw FileError(path + ": 'solver.method' is ddp: " + e.what());
    }
  }
  return task;
}

Problem tracking_problem(const Task& task) {
  Problem problem = task.problem;
  // A cost of what the motion is, not of what it takes.
  const auto draws = [](const Term& term) {
    const auto is_named = [&](const TaskCost& cost) { return cost.key == term.name; };
    return (term.role == Role::kCost || term.role == Role::kSquares) &&
           std::none_of(task_costs().begin(), task_costs().end(), is_named);
  };
  if (std::none_of(problem.terms.begin(), problem.terms.end(), draws))
    throw ArgumentError(
        "task \"" + task.name +
        "\": steps of feedback reach the goal by costs, since they do not demand it at the end, and "
        "there is no such cost; expected weights in costs.tracking or reference, or a cost in terms");
  problem.goal.setConstant(Problem::kFree);
  std::erase_if(problem.terms, [](const Term& term) {
    return term.where == Where::kTerminal && (term.role == Role::kEquality || term.role == Role::kInequality);
  });
  return problem;
}

}  // namespace dyntape
