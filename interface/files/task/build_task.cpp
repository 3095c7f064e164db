// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/task/task.h>

#include <algorithm>
#include <cmath>
#include <set>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/interface/control/problem/penalties.h>
#include <dyntape/interface/files/joint_values.h>
#include <dyntape/interface/files/task/task_costs.h>
#include <dyntape/interface/files/task/task_faults.h>
#include <dyntape/interface/files/task/task_keys.h>
#include <dyntape/interface/files/task/task_phases.h>
#include <dyntape/interface/files/task/term_keys.h>
#include <dyntape/interface/files/task/waypoint_keys.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/motion/inverse_kinematics.h>
#include <dyntape/interface/motion/robot_configuration.h>
#include <dyntape/interface/motion/tied/tied_joints.h>

namespace dyntape {

namespace {

constexpr double kMark = 0.02;  // m, of a waypoint in a picture

// Of the goal's frame at the end, of waypoints, and of bodies and obstacles along the path.
void add_places(Problem& problem, const TaskSpec& task) {
  if (task.target)
    problem.add(terminal_equality("goal of " + task.target->frame, frame_error(task.scene, *task.target)));
  for (const TaskWaypoint& waypoint : task.waypoints) problem.add(term_of(waypoint, task.scene));
  for (const Surroundings::Pair& pair : task.around.apart) {
    const Term clear = keep_clear(task.scene, pair.a, pair.b, pair.least);
    const double mu = task.around.barrier;
    problem.add(mu > 0 ? soft(clear, RelaxedBarrier{mu, task.around.width}) : clear);
  }
}

void add_costs(Problem& problem, const TaskSpec& task) {
  for (const TaskCost& cost : task_costs()) {
    if (const double weight = task.costs.*cost.weight; weight > 0)
      problem.add(cost.term(problem, task, weight));
  }
}

void add_frame_tracking(Problem& problem, const TaskSpec& task) {
  const auto add = [&](const char* name, double weight, const FrameTarget& target) {
    if (weight > 0) problem.add(running_squares(name, weighted(frame_error(task.scene, target), weight)));
  };
  if (!task.target) return;
  const FrameTarget& target = *task.target;
  add("position tracking", task.costs.tracking_position, {target.frame, target.position, {}});
  add("orientation tracking", task.costs.tracking_orientation, {target.frame, {}, target.orientation});
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

Task::Aim aim_of(const dynamics::Model<double>& model, const TermSpec& term) {
  return {"the moving target of " + term.frame, "m",
          [model, frame = term.frame, target = target_over_time(term)](double t, const Eigen::VectorXd& x) {
            dynamics::Data<double> data(model);
            dynamics::forward_kinematics<double>(model, data, Eigen::VectorXd(x.head(model.nq)));
            return (dynamics::frame_placement(model, data, model.frame_index(frame)).p - target(t)).norm();
          }};
}

Task::Aim aim_of(const Task& task) {
  const auto& model = task.scene.model;
  if (task.reference) return aim_of(*task.reference, model.nq);
  if (task.target) return aim_of(task.scene, *task.target);
  const Eigen::VectorXd goal = task.goal.head(model.nq);
  if (goal.array().isNaN().all()) {
    const TermSpec* term = follower(task.terms);
    return term ? aim_of(model, *term) : Task::Aim();
  }
  return {"the goal", "norm over the joints, rad or m",
          [model, goal, by = task.travel](double t, const Eigen::VectorXd& x) {
            Eigen::VectorXd q = x.head(model.nq), known = goal;
            fill_free(model, q, known);
            if (!by.isZero(0)) known.head<2>() += by * t;
            return dynamics::difference<double>(model, known, q).norm();
          },
          [state = task.goal](double) { return state; }};
}

// A configuration in which a frame is where it shall be, from one nearby; `there`: "at its goal".  None: `otherwise`, and a note
// says so.
Eigen::VectorXd placed_for_guess(Task& task, const FrameTarget& target, const Eigen::VectorXd& from,
                                 const std::string& there, const Eigen::VectorXd& otherwise,
                                 const std::string& stays) {
  const auto& model = task.scene.model;
  if (!is_on_lines(model)) {
    task.notes.push_back(told_of(task) + ": where '" + target.frame + "' is " + there +
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
    task.notes.push_back(told_of(task) + ": no configuration was found in which '" + target.frame + "' is " +
                         there + " and every body keeps clear; the guess has one that does not");
  if (q) return *q;
  task.is_out_of_reach = true;
  const std::string why = why_unreachable(model, target, "the place of '" + target.frame + "' " + there);
  if (task.unreachable.empty()) task.unreachable = why;
  task.notes.push_back(told_of(task) + ": no configuration within the robot's limits was found in which '" +
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
std::vector<GuessKnot> guess_knots(Task& task) {
  const auto& model = task.scene.model;
  Eigen::VectorXd from = task.start.head(model.nq), to = task.goal.head(model.nq),
                  neutral = dynamics::neutral(model);
  Eigen::VectorXd start = from;
  fill_free(model, start, neutral);
  std::vector<GuessKnot> passed;
  for (const TaskWaypoint& waypoint : task.waypoints) {
    const Eigen::VectorXd& before = passed.empty() ? start : passed.back().q;
    const std::string there = "at waypoint '" + waypoint.name + "'";
    Eigen::VectorXd q = before;
    if (waypoint.target)
      q = placed_for_guess(task, *waypoint.target, before, there, before, "the guess stays where it was");
    if (waypoint.q.size() > 0) take_joints(model, configuration_of(model, waypoint.q), q);
    if (passed.empty() || waypoint.at > passed.back().share) passed.push_back({waypoint.at, q});
  }
  if (task.target)
    to = placed_for_guess(task, *task.target, passed.empty() ? start : passed.back().q, "at its goal", to,
                          "the guess stays at the start");
  if (task.periodic) to = end_of_step(model, task.periodic->step, from);
  fill_free(model, from, to);
  passed.insert(passed.begin(), {0, from});
  passed.push_back({1, to});
  const Ties ties = ties_of(task.scene);
  for (GuessKnot& knot : passed) knot.q = ties.tied_q(knot.q);
  return passed;
}

void add_guess(Problem& problem, const TaskSpec& task, const std::vector<GuessKnot>& knots) {
  const Stage<double> rest{0, Eigen::VectorXd::Zero(problem.n_x()), Eigen::VectorXd::Zero(problem.n_a()),
                           Eigen::VectorXd::Zero(problem.n_u())};
  problem.guess = [=, scene = task.scene, options = task.robot, guess = task.guess,
                   duration = problem.duration](double t) {
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
void place_contacts(Task& task) {
  const Eigen::VectorXd q = task.start.head(task.scene.model.nq);
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
void check_floor(Task& task) {
  constexpr double kStands = 1e-3;  // m
  const double floor = task.floor.value_or(0);
  std::set<std::string> held, moved;
  bool steps_down = false;  // then the floor is that of the lower ground
  for (const TaskSpec::Phase& phase : task.phases) {
    held.insert(phase.hold.begin(), phase.hold.end());
    for (const auto& [name, by] : phase.moved)
      if (by.z() != 0) moved.insert(name), steps_down = steps_down || by.z() < 0;
  }
  std::vector<SpecFault> faults;
  for (const HeldContact& contact : task.robot.contacts) {
    if (!contact.place || moved.count(contact.frame)) continue;
    if (!task.phases.empty() && !held.count(contact.frame)) continue;
    const double height = above_floor(contact, floor);
    if (!(std::abs(height) > kStands) || (steps_down && height > 0)) continue;
    faults.push_back({"contacts.floor", "the contact \"" + contact.frame + "\" is held " +
                                            io::significant(std::abs(height), 3) + " m " +
                                            (height > 0 ? "above" : "below") +
                                            " the floor, which is at z = " + io::significant(floor, 3) +
                                            " m; expected a start with the contacts on it, or its height in "
                                            "'contacts.floor'"});
  }
  if (faults.empty()) return;
  if (task.floor) refuse(task, faults);
  for (const SpecFault& fault : faults) task.notes.push_back(told_of(task) + ": " + fault.message);
}

void check_spec(const TaskSpec& spec) {
  std::vector<SpecFault> faults = faults_of(spec);
  for (const TermSpec& term : spec.terms) {
    for (const SpecFault& fault : faults_of(term, spec)) {
      const std::string key = "terms." + term.name + "." + fault.key;
      faults.push_back({key, key + ": " + fault.message});
    }
  }
  if (!faults.empty()) refuse(spec, faults);
}

}  // namespace

std::string told_of(const TaskSpec& task) {
  return task.file.empty() ? "task \"" + task.name + "\"" : task.file;
}

void refuse(const TaskSpec& task, const std::vector<SpecFault>& faults) {
  std::vector<std::string> told;
  for (const SpecFault& fault : faults)
    told.push_back(task.places.at(fault.key, told_of(task)) + ": " + fault.message);
  const FileError error(told);
  if (task.file.empty()) throw ArgumentError(error.what());
  throw error;
}

void compose_problem(Task& task, const std::vector<GuessKnot>& guess) {
  task.problem = robot_problem(task.scene, task.robot);
  task.problem.name = task.name;
  task.problem.free_time = task.free_time;
  const int nq = task.scene.model.nq, nv = task.scene.model.nv;
  const bool begins_anywhere = task.start.array().isNaN().all();  // as phases behind others do
  if (!begins_anywhere) start_at(task.problem, task.scene, task.start.head(nq), task.start.tail(nv));
  end_at(task.problem, task.scene, task.goal.head(nq), task.goal.tail(nv));
  for (const dynamics::MimicRule& rule : task.scene.mimics) {  // followers end where their leaders do
    const auto& joint = task.scene.model.joints[std::size_t(task.scene.model.joint_index(rule.joint))];
    task.problem.goal[joint.idx_q] = task.problem.goal[nq + joint.idx_v] = Problem::kFree;
  }
  add_places(task.problem, task);
  add_costs(task.problem, task);
  if (task.gait) walk(task.problem, task.scene, task.robot.contacts, *task.gait, task.swing_weight);
  if (task.reference) follow(task.problem, *task.reference);
  for (const TermSpec& term : task.terms) add(term, task, task.problem);
  bound_motion(task);
  add_guess(task.problem, task, guess);
}

void draw_to_goal(Task& task, const TaskSpec& whole, bool ends) {
  if (whole.gait && !whole.gait->velocity.isZero(0)) {
    task.travel = whole.gait->velocity;
    task.problem.parameters.add("travel", [by = task.travel](double t) -> Eigen::VectorXd { return by * t; });
  }
  add_frame_tracking(task.problem, whole);
  const auto& model = task.scene.model;
  const TaskSpec::Costs& costs = whole.costs;
  const Eigen::VectorXd q = whole.goal.head(model.nq), v = whole.goal.tail(model.nv);
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

Task build_task(TaskSpec given) {
  Task task{completed(std::move(given))};
  check_spec(task);
  for (const TaskWaypoint& w : task.waypoints) {
    if (w.target && w.target->position)
      task.passed.push_back(sphere(w.name, kWorld, *w.target->position, kMark));
  }

  place_contacts(task);
  if (task.periodic) place_last_step(task);
  check_floor(task);
  const std::vector<GuessKnot> guess = guess_knots(task);
  if (task.periodic) task.start.setConstant(Problem::kFree);
  compose_problem(task, guess);
  draw_to_goal(task, task, true);
  task.aim = aim_of(task);
  if (!task.phases.empty()) compose_phases(task, guess.front().q, guess.back().q);
  if (task.periodic) close_motion(task);
  if (task.by_ddp) {
    task.problem.x.lower.setConstant(-HUGE_VAL), task.problem.x.upper.setConstant(HUGE_VAL);
    try {
      check_shooting(tracking_problem(task));
    } catch (const ArgumentError& e) {
      refuse(task, {{"solver.method", std::string("'solver.method' is ddp: ") + e.what()}});
    }
  }
  return task;
}

TaskSpec read_task_spec(const std::string& path, const std::vector<io::Setting>& settings) {
  return read_task_file(read_file(path), path, settings);
}

Task read_task(const std::string& path, const std::vector<io::Setting>& settings) {
  return build_task(read_task_spec(path, settings));
}

Task read_task_text(const std::string& text, const std::string& path,
                    const std::vector<io::Setting>& settings) {
  return build_task(read_task_file(text, path, settings));
}

Problem tracking_problem(const Task& task) {
  Problem problem = task.problem;
  // A cost of what the motion is, not of what it takes.
  const auto draws = [](const Term& term) {
    const auto is_named = [&](const TaskCost& cost) { return cost.key == term.name; };
    return !is_constraint(term.role) && std::none_of(task_costs().begin(), task_costs().end(), is_named);
  };
  if (std::none_of(problem.terms.begin(), problem.terms.end(), draws))
    throw ArgumentError(
        "task \"" + task.name +
        "\": a controller needs a cost that pulls to the goal, since its steps do not demand the goal; "
        "expected weights in costs.tracking or reference, or a cost in terms");
  problem.goal.setConstant(Problem::kFree);
  std::erase_if(problem.terms,
                [](const Term& term) { return term.where == Where::kTerminal && is_constraint(term.role); });
  return TiedJoints(task.scene).shortened(problem);
}

}  // namespace dyntape
