// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/task/task.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>

#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/io/section.h>
#include <dyntape/interface/task/joint_values.h>
#include <dyntape/interface/task/limits.h>

namespace dyntape {

namespace {

using io::Section;

// A list in which no name stands twice.
std::vector<std::string> distinct_names(Section& section, const std::string& key,
                                        const std::vector<std::string>& valid = {}) {
  const std::vector<std::string> names = section.strings_or(key, {}, valid);
  for (auto name = names.begin(); name != names.end(); ++name) {
    if (std::find(names.begin(), name, *name) == name) continue;
    section.problem(key, "'" + key + "' names '" + *name + "' twice, expected once");
  }
  return names;
}

// The robot is read as soon as its block is known to be right: joint names are keys of what follows.
dynamics::UrdfRobot read_robot(Section& file, Task& task) {
  Section robot = file.child("robot");
  const auto urdf = robot.get<std::string>("urdf");
  dynamics::UrdfOptions options;
  options.base = robot.choice_or<dynamics::Base>("base", "fixed", {{"fixed", dynamics::Base::kFixed}});
  options.lock = distinct_names(robot, "lock");
  options.snap = robot.get_or("snap", options.snap, io::between(0, 0.01));
  options.continuous = dynamics::ContinuousJoint::kAngle;
  if (urdf.empty()) robot.problem("urdf", "'robot.urdf' is empty");
  robot.finish();
  task.urdf = (std::filesystem::path(task.file).parent_path() / urdf).lexically_normal().string();
  dynamics::UrdfRobot read = dynamics::read_urdf(task.urdf, options);
  if (read.model.nv == 0) robot.problem("urdf", "'" + urdf + "' has no joint that moves: nothing to control");
  robot.finish();
  return read;
}

// `robot` takes the values of the robot's file, anything else is a vector.
std::optional<Eigen::VectorXd> read_effect(Section& section, const std::string& key,
                                           const dynamics::Model<double>& model,
                                           const Eigen::VectorXd& of_robot) {
  if (!section.has(key)) return std::nullopt;
  const std::string word = section.children(key).front().value();
  if (word == "off") return std::nullopt;
  if (word == "robot" || word == "on") return of_robot;
  return read_joint_values(section, key, model, 0.0, io::not_negative());
}

dynamics::Effects<double> read_effects(Section& file, const dynamics::Model<double>& model) {
  Section section = file.child_or_empty("effects");
  dynamics::Effects<double> effects;
  effects.gravity = section.get_or("gravity", true);
  effects.armature = read_effect(section, "armature", model, dynamics::model_armature(model));
  effects.damping = read_effect(section, "joint_damping", model, dynamics::model_damping(model));
  if (section.has("joint_friction")) {
    Section friction = section.child("joint_friction");
    const auto torque = read_effect(friction, "torque", model, dynamics::model_friction(model));
    const double smoothing = friction.get<double>("smoothing", io::positive());
    if (torque) effects.friction = {*torque, smoothing};
  }
  if (section.has("joint_springs")) {
    Section springs = section.child("joint_springs");
    effects.springs = {read_joint_values(springs, "stiffness", model, std::nullopt, io::not_negative()),
                       read_joint_values(springs, "rest", model, 0.0)};
  }
  return effects;
}

RobotProblemOptions read_form(Section& file) {
  Section horizon = file.child("horizon"), transcription = file.child_or_empty("transcription");
  RobotProblemOptions options;
  options.duration = horizon.get<double>("duration", io::positive());
  options.form = transcription.choice_or<DynamicsForm>(
      "dynamics", "forward", {{"forward", DynamicsForm::kForward}, {"inverse", DynamicsForm::kInverse}});
  options.unit = transcription.choice_or<ControlUnit>(
      "controls", "physical", {{"physical", ControlUnit::kPhysical}, {"fraction", ControlUnit::kFraction}});
  return options;
}

MeshOptions read_mesh(Section& file) {
  Section horizon = file.child("horizon"), transcription = file.child_or_empty("transcription");
  std::vector<std::pair<std::string, Scheme>> schemes;
  for (const std::string& name : scheme_names()) schemes.emplace_back(name, scheme_by_name(name));
  MeshOptions mesh;
  mesh.intervals = horizon.get<int>("intervals", io::at_least(1));
  mesh.scheme = transcription.choice_or<Scheme>("scheme", "hermite-simpson", schemes);
  mesh.hessian = transcription.choice_or<HessianKind>("hessian", "exact",
                                                      {{"exact", HessianKind::kExact},
                                                       {"gauss_newton", HessianKind::kGaussNewton},
                                                       {"limited_memory", HessianKind::kLimitedMemory}});
  return mesh;
}

void read_solver(Section& file, OptimiseOptions& optimise) {
  Section solver = file.child_or_empty("solver");
  IpoptOptions& options = optimise.solver;
  options.tolerance = solver.get_or("tolerance", options.tolerance, io::positive());
  options.dual_tolerance = solver.get_or("dual_tolerance", options.dual_tolerance, io::positive());
  options.bound_relaxation = solver.get_or("bound_relaxation", options.bound_relaxation, io::not_negative());
  options.max_iterations = solver.get_or("max_iterations", options.max_iterations, io::not_negative());
  options.max_seconds = solver.get_or("max_seconds", options.max_seconds, io::positive());
  options.stop_at_acceptable = solver.get_or("stop_at_acceptable", options.stop_at_acceptable);
  options.print_level = solver.get_or("print_level", options.print_level, io::between(0, 12));
  optimise.check_derivatives = solver.get_or("check_derivatives", true);
  Section extra = solver.child_or_empty("ipopt");
  for (Section& option : extra.all_children()) options.extra.emplace_back(option.name(), option.value());
}

// State at one end, at rest unless it says otherwise; joints named in `free` are left open.
Eigen::VectorXd read_end(Section& file, const std::string& key, const dynamics::Model<double>& model) {
  Section end = file.child(key);
  Eigen::VectorXd x(2 * model.nv);
  x << read_joint_values(end, "q", model, std::nullopt), read_joint_values(end, "v", model, 0.0);
  const std::vector<std::string> names = joint_names(model);
  for (const std::string& name : distinct_names(end, "free", names)) {
    for (int i = 0; i < model.nv; ++i) {
      if (names[static_cast<std::size_t>(i)] == name) x[i] = x[model.nv + i] = Problem::kFree;
    }
  }
  return x;
}

struct Costs {
  double control, effort, acceleration;
  Eigen::VectorXd tracking_q, tracking_v;
};

Costs read_costs(Section& file, const dynamics::Model<double>& model) {
  Section costs = file.child("costs");
  const auto weight = [&](const std::string& key) { return costs.get_or(key, 0.0, io::not_negative()); };
  Section tracking = costs.child_or_empty("tracking");
  return {weight("control"), weight("effort"), weight("acceleration"),
          read_joint_values(tracking, "q", model, 0.0, io::not_negative()),
          read_joint_values(tracking, "v", model, 0.0, io::not_negative())};
}

struct Guess {
  bool slope, holding;
};

Guess read_guess(Section& file) {
  Section guess = file.child_or_empty("guess");
  guess.choice_or<int>("positions", "line", {{"line", 0}});
  return {guess.choice_or<bool>("velocities", "zero", {{"zero", false}, {"slope", true}}),
          guess.choice_or<bool>("control", "zero", {{"zero", false}, {"gravity", true}})};
}

// Where the bounds come from: nothing, the robot, or one number for all.
struct Limit {
  bool robot = false;
  double value = std::numeric_limits<double>::infinity();
};

Limit read_limit(Section& bounds, const std::string& key) {
  const std::string word = bounds.get_or(key, "robot");
  if (word == "none") return {};
  if (word == "robot") return {true};
  Limit limit;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), limit.value);
  if (error != std::errc() || end != word.data() + word.size() || !(limit.value > 0)) {
    bounds.problem(key, "'" + key + "' must be none, robot or a positive number, got '" + word + "'");
  }
  return limit;
}

struct Limits {
  Limit positions, velocities, efforts;
  RatedParts of_robot() const { return {positions.robot, velocities.robot, efforts.robot}; }
};

Limits read_limits(Section& file) {
  Section bounds = file.child_or_empty("bounds");
  return {read_limit(bounds, "positions"), read_limit(bounds, "velocities"), read_limit(bounds, "efforts")};
}

Task::Demands read_demands(Section& file) {
  Task::Demands demands;
  Section verify = file.child_or_empty("verify");
  demands.violation = verify.get_or("violation", demands.violation, io::positive());
  demands.true_defect = verify.get_or("true_defect", demands.true_defect, io::or_infinite(io::positive()));
  demands.refinements = verify.get_or("refinements", demands.refinements, io::between(0, 10));
  demands.limits = verify.get_or("limits", demands.limits);
  return demands;
}

void read_output(Section& file, Task& task) {
  Section output = file.child_or_empty("output");
  std::vector<std::string> frames;
  for (const auto& frame : task.scene.model.frames) frames.push_back(frame.name);
  task.traces = distinct_names(output, "trace", frames);
  task.view = output.choice_or<View>(
      "view", "xz", {{"xz", View::kXz}, {"xy", View::kXy}, {"yz", View::kYz}, {"oblique", View::kOblique}});
}

void add_costs(Problem& problem, const Task& task, const Costs& costs) {
  if (costs.control > 0) problem.add(squared_controls(costs.control));
  if (costs.effort > 0) problem.add(squared_fractions(task.scene, costs.effort, task.robot.unit));
  if (costs.acceleration > 0) problem.add(squared_accelerations(problem, costs.acceleration));
  if (costs.tracking_q.isZero(0) && costs.tracking_v.isZero(0)) return;
  const int n = task.scene.model.nv;
  const Eigen::VectorXd goal = problem.goal.array().isNaN().select(0, problem.goal);
  problem.add(joint_tracking(costs.tracking_q, goal.head(n), costs.tracking_v, goal.tail(n)));
}

void add_limits(Problem& problem, const Task& task, const Limits& limits) {
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

void add_guess(Problem& problem, const Task& task, const Guess& guess) {
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
  Section file = Section::read(path);
  Task task;
  task.file = path;
  task.name = file.get_or<std::string>("name", std::filesystem::path(path).stem().string());
  dynamics::UrdfRobot robot = read_robot(file, task);
  task.notes = std::move(robot.notes);
  task.scene.model = std::move(robot.model);
  const dynamics::Model<double>& model = task.scene.model;
  task.scene.effects = read_effects(file, model);
  task.scene.actuated = distinct_names(file, "actuated", joint_names(model));
  task.robot = read_form(file);
  task.optimise.mesh = read_mesh(file);
  read_solver(file, task.optimise);
  const Eigen::VectorXd start = read_end(file, "start", model), goal = read_end(file, "goal", model);
  const Guess guess = read_guess(file);
  const Costs costs = read_costs(file, model);
  const Limits limits = read_limits(file);
  read_output(file, task);
  task.models = io::read_model_settings(file);
  task.demands = read_demands(file);
  if (file.has("expected")) {
    Section expected = file.child("expected");
    task.expected = {expected.get<double>("cost"), expected.get<double>("tolerance", io::positive())};
  }
  file.finish();
  task.effective = file.effective_values();

  task.problem = robot_problem(task.scene, task.robot);
  task.problem.name = task.name;
  task.problem.start = start;
  task.problem.goal = goal;
  add_costs(task.problem, task, costs);
  add_limits(task.problem, task, limits);
  add_guess(task.problem, task, guess);
  check_ends(task, limits.of_robot());
  return task;
}

}  // namespace dyntape
