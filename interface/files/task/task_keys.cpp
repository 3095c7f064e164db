// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/task/task_keys.h>

#include <cmath>
#include <sstream>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/interface/control/nlp/solver_option_table.h>
#include <dyntape/interface/files/joint_values.h>
#include <dyntape/interface/files/lists.h>
#include <dyntape/interface/files/planar_keys.h>
#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/files/scene/scene_keys.h>
#include <dyntape/interface/files/task/place_keys.h>
#include <dyntape/interface/files/task/task_faults.h>
#include <dyntape/interface/files/task/term_keys.h>
#include <dyntape/interface/files/task/waypoint_keys.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

using io::Section;
using RobotModel = dynamics::Model<double>;

RobotProblemOptions read_form(Section& file, const std::string& dynamics) {
  Section horizon = file.about("duration and mesh of the motion").child("horizon");
  Section transcription = file.about("discretisation: how the motion becomes a nonlinear program")
                              .child_or_empty("transcription");
  RobotProblemOptions options;
  options.duration = horizon.about("duration of the motion [s]").get<double>("duration", seconds());
  options.form = transcription
                     .about(
                         "dynamics as a constraint: forward: accelerations from torques; inverse: torques "
                         "from accelerations")
                     .choice_or<DynamicsForm>("dynamics", dynamics, dynamics_forms());
  options.unit =
      transcription.about("unit of the controls: physical: N m or N; fraction: fraction of the effort limit")
          .choice_or<ControlUnit>("controls", "physical", control_units());
  return options;
}

// A duration that is to be found lies between two numbers, its first guess as well.
std::optional<Problem::Range> read_free_time(Section& horizon, double duration) {
  Problem::Range range{};
  range.shortest = horizon.about("smallest duration, if the duration is free [s]; 0: the duration is given")
                       .get_or("min_duration", 0.0, some_seconds());
  range.longest = horizon.about("largest duration, if the duration is free [s]; 0: the duration is given")
                      .get_or("max_duration", 0.0, some_seconds());
  if (range.shortest == 0 && range.longest == 0) return {};
  if (range.shortest == 0 || range.longest == 0) {
    const char *key = range.shortest > 0 ? "min_duration" : "max_duration",
               *other = range.shortest > 0 ? "max_duration" : "min_duration";
    if (horizon.sound() || !horizon.has(other))  // else what it says is wrong already
      horizon.problem(key,
                      std::string("'") + key + "' stands alone; expected '" + other + "' beside it, above 0");
  } else if (range.shortest > range.longest) {
    horizon.problem("min_duration", "'min_duration' is " + io::shortest(range.shortest) +
                                        " s, expected 'max_duration', " + io::shortest(range.longest) +
                                        " s, at most");
  } else if (duration > 0 && !(range.shortest <= duration && duration <= range.longest)) {
    horizon.problem("duration", "'duration' is " + io::shortest(duration) +
                                    " s, expected the first guess of one between " +
                                    io::shortest(range.shortest) + " and " + io::shortest(range.longest) +
                                    " s ('min_duration', 'max_duration')");
  }
  return range;
}

// All entries of a joint's q, or of its v.
void leave_open(const dynamics::Joint<double>& joint, const RobotModel& model, Eigen::VectorXd& x) {
  x.segment(joint.idx_q, dynamics::nq(joint.type)).setConstant(Problem::kFree);
  x.segment(model.nq + joint.idx_v, dynamics::nv(joint.type)).setConstant(Problem::kFree);
}

// A problem at a key of the file: "costs.time"; "phases.phase#1.impact" of the second block of that name.
void note_at(Section at, const SpecFault& fault) {
  std::istringstream words(fault.key);
  std::string key;
  for (std::string word; std::getline(words, word, '.');) {
    if (!key.empty()) at = at.child_or_empty(key);
    const std::size_t number = word.find('#');
    key = number == std::string::npos ? word : "";
    if (key.empty()) at = at.children(word.substr(0, number)).at(std::stoul(word.substr(number + 1)));
  }
  at.problem(key, fault.message);
}

enum class End { kStart, kGoal };

// The base of a robot that floats, to the beginning of q and v.  A goal says which parts of it are left open.
void read_base_at(Section& end, End which, const RobotModel* model, Eigen::VectorXd& x) {
  if (model && !floats(*model)) {
    if (end.has("base"))
      end.problem("base", "'" + end.path() + ".base' is of a floating base; this robot's base is fixed");
    return;
  }
  const BaseStart base = read_base(end);
  std::vector<std::string> open;
  if (which == End::kGoal) {
    if (model && !end.has("base"))
      end.problem("base", "'goal.base' is missing; expected where the floating base shall be");
    Section block = end.child_or_empty("base");
    open = distinct_names(
        block.about("which of position, roll_pitch_yaw, velocity and angular_velocity are free"), "free",
        {"position", "roll_pitch_yaw", "velocity", "angular_velocity"});
  }
  if (!model) return;
  Eigen::VectorXd q = x.head(model->nq), v = x.tail(model->nv);
  place_base(base, q, v);
  x << q, v;
  for (const std::string& part : open) {
    if (part == "position") x.head<3>().setConstant(Problem::kFree);
    if (part == "roll_pitch_yaw") x.segment<4>(3).setConstant(Problem::kFree);
    if (part == "velocity") x.segment<3>(model->nq).setConstant(Problem::kFree);
    if (part == "angular_velocity") x.segment<3>(model->nq + 3).setConstant(Problem::kFree);
  }
}

// What a goal does not say of planar joints is left open.
void place_planar_joints(Section& end, End which, const RobotModel* model, Eigen::VectorXd& x) {
  end.about(which == End::kGoal
                ? "state of a planar joint, one block per joint; joints without a block are free"
                : "state of a planar joint, one block per joint; joints without a block are at their neutral "
                  "position");
  Eigen::VectorXd q, v;
  if (model) q = x.head(model->nq), v = x.tail(model->nv);
  const std::vector<std::string> placed = read_planar(end, model, q, v);
  if (!model) return;
  x << q, v;
  if (which == End::kStart) return;
  for (const std::string& name : planar_names(*model)) {
    if (!contains(placed, name)) leave_open(model->joints[std::size_t(model->joint_index(name))], *model, x);
  }
}

// State at one end, at rest unless it says otherwise; joints named in `free` are left open, as all positions are where
// a frame says where to.
Eigen::VectorXd read_end(Section& end, End which, bool is_by_frame, const RobotScene& scene,
                         const RobotModel* model) {
  const std::vector<std::string> names = model ? independent_joints(scene) : std::vector<std::string>{};
  const std::optional<double> fallback = model && names.empty() ? std::optional(0.0) : std::nullopt;
  std::vector<std::string> all = names;
  if (model) {
    const std::vector<std::string> planar = planar_names(*model);
    all.insert(all.end(), planar.begin(), planar.end());
  }
  const std::vector<std::string> open =
      distinct_names(end.about("joints whose position and velocity are free"), "free", all);
  Eigen::VectorXd q, x;
  end.about("joint positions [rad or m]; not needed for free joints");
  if (!is_by_frame || end.has("q"))
    q = read_joint_values(end, "q", model, {.fallback = fallback, .open = open, .followers = scene.mimics});
  const Eigen::VectorXd v = read_joint_values(end.about("joint velocities [rad/s or m/s]"), "v", model,
                                              {.fallback = 0.0, .followers = scene.mimics});
  if (model) {
    x.resize(model->nq + model->nv);
    x << (q.size() ? configuration_of(*model, q) : dynamics::neutral(*model)), v;
  }
  if (!is_by_frame || !model) read_base_at(end, which, model, x);
  place_planar_joints(end, which, model, x);
  if (is_by_frame && model) x.head(model->nq).setConstant(Problem::kFree);
  for (const std::string& name : open)
    if (model && contains(all, name))  // else it is noted already
      leave_open(model->joints[static_cast<std::size_t>(model->joint_index(name))], *model, x);
  if (model) {
    const Ties ties = ties_of(scene);
    const Eigen::VectorXd of_q = x.head(model->nq), of_v = x.tail(model->nv);
    x << ties.tied_q(of_q), ties.tied_v(of_v);
  }
  return x;
}

// The state at the end of a motion or a phase, or a frame's place in it.
template <class Keys>
void read_goal(Section& of, Keys& keys, const RobotScene& scene, const RobotModel* model,
               const char* meaning = "final state") {
  Section goal = of.about(meaning).child("goal");
  keys.target = read_frame_target(goal, model);
  if (keys.target && goal.has("q") && model)
    goal.problem("q", "'goal' has both 'frame' and 'q', expected one of them");
  keys.goal = read_end(goal, End::kGoal, keys.target.has_value(), scene, model);
}

// What does not hold over the whole motion; the phase's own goal is that of the task in the last one.
TaskSpec::Phase read_phase(Section& phase, const TaskSpec& task, bool is_last, const RobotModel* model) {
  TaskSpec::Phase p;
  p.name = phase.value();
  if (p.name.empty()) phase.problem("", "'" + phase.path() + "' needs a name behind the word");
  p.duration = phase.about("duration of the phase [s]; absent: the duration of `horizon`")
                   .get_or("duration", task.robot.duration, seconds());
  p.intervals = phase.about("number of intervals; absent: the number of `horizon`")
                    .get_or("intervals", task.optimise.mesh.intervals, io::at_least(1));
  if (const std::string fault = task.optimise.mesh.scheme.fault_on(p.intervals); !fault.empty())
    phase.problem("intervals", fault);
  const bool is_of_horizon =
      !phase.has("duration") && !phase.has("min_duration") && !phase.has("max_duration");
  p.free_time = read_free_time(phase, p.duration);
  if (is_of_horizon) p.free_time = task.free_time;
  std::vector<std::string> contacts;
  for (const HeldContact& contact : task.robot.contacts) contacts.push_back(contact.frame);
  phase.about("contacts of the block `contacts` that hold during the phase; absent: all");
  std::vector<std::string> valid = contacts;
  if (model && phase.has_problems())  // one of which may be a contact's name
    for (const auto& frame : model->frames) valid.push_back(frame.name);
  p.hold = phase.has("contacts") && model ? distinct_names(phase, "contacts", valid) : contacts;
  if (!model) phase.get_or("contacts", "");
  p.impact =
      phase
          .about(
              "whether a contact that lands at the begin of the phase has an impact; off: it lands at rest")
          .get_or("impact", false);
  Section lands =
      phase.about("displacement of a contact's foothold from its previous one, by the contact's name [m]")
          .child_or_empty("foothold_offset");
  for (const std::string& name : contacts)
    if (model && !name.empty() && lands.has(name))
      p.moved.emplace_back(name, read_vector3(lands, name, std::nullopt, metres()));
  // The contacts are not known if the robot or their names are wrong, which is reported already.
  if (const bool are_known = model && !lands.has_problems(); !are_known)
    for (const std::string& name : lands.keys())
      if (!model || !contains(contacts, name)) read_vector3(lands, name, std::nullopt, metres());
  p.clearance =
      phase
          .about(
              "height that contacts in the air keep above the straight line to their next foothold, in its "
              "middle [m]")
          .get_or("clearance", 0.0, io::not_negative());
  if (model) p.goal = Eigen::VectorXd::Constant(model->nq + model->nv, Problem::kFree);
  if (!phase.has("goal")) return p;
  if (is_last && model) {
    phase.problem("goal", "the last phase ends in the task's 'goal'; expected none of its own");
    return p;
  }
  read_goal(phase, p, task.scene, model);
  return p;
}

void read_phases(Section& file, TaskSpec& task, const RobotModel* model) {
  if (!file.about("phases of the motion, in order, each with its own contacts and duration").has("phases"))
    return;
  Section block = file.child("phases");
  std::vector<Section> phases = block.about("phase <name> { ... }").each("phase");
  for (std::size_t k = 0; k < phases.size(); ++k) {
    task.phases.push_back(read_phase(phases[k], task, k + 1 == phases.size(), model));
    if (model && task.robot.contacts.empty() && phases[k].has("contacts") && !task.phases[k].hold.empty())
      phases[k].problem(
          "contacts",
          "the file has no 'contacts' that could be held; expected them, or no 'contacts' in the phase");
  }
}

TaskSpec::Guess read_guess(Section& file) {
  Section guess = file.about("initial guess").child_or_empty("guess");
  guess.about("positions: a straight line from start to goal")
      .choice_or<int>("positions", "line", {{"line", 0}});
  const bool slope = guess.about("velocities: zero, or the slope of the line")
                         .choice_or<bool>("velocities", "zero", {{"zero", false}, {"slope", true}});
  guess.about("controls: zero, or the torques that hold the robot against gravity");
  return {slope, guess.choice_or<bool>("control", "zero", {{"zero", false}, {"gravity", true}})};
}

Limit read_limit(Section& bounds, const std::string& key, const std::string& what) {
  const std::string word =
      bounds.about("limit of " + what + ": none, robot (the limits of its file), or one number for all")
          .get_or(key, "robot");
  if (word == "none") return {.robot = false};
  if (word == "robot") return {};
  const std::optional<double> value = io::parse_double(word);
  if (!value || !(*value > 0))
    bounds.problem(key, "'" + key + "' must be none, robot or a positive number, got '" + word + "'");
  return {false, value.value_or(0)};
}

TaskSpec::Limits read_limits(Section& file) {
  Section bounds = file.about("bounds of the motion").child_or_empty("bounds");
  TaskSpec::Limits limits;
  limits.positions = read_limit(bounds, "positions", "joint positions [rad or m]");
  limits.velocities = read_limit(bounds, "velocities", "joint velocities [rad/s or m/s]");
  limits.efforts = read_limit(bounds, "efforts", "controls [N m or N]");
  return limits;
}

TaskSpec::ModelSettings read_model_settings(Section& file) {
  Section block = file.about("compiled libraries, with OCS2's names").child_or_empty("model_settings");
  TaskSpec::ModelSettings settings;
  block.about("another name of recompileLibrariesCppAd");
  if (block.has("recompileLibraries")) settings.recompile_libraries = block.get<bool>("recompileLibraries");
  settings.recompile_libraries = block.about("compile the functions again even if the cache has them")
                                     .get_or("recompileLibrariesCppAd", settings.recompile_libraries);
  settings.model_folder = block.about("folder of the cache; empty: the usual folder")
                              .get_or("modelFolderCppAd", settings.model_folder);
  settings.verbose = block.about("print what is compiled").get_or("verboseCppAd", settings.verbose);
  return settings;
}

void read_accuracy(Section& verify, TaskSpec::VerifyOptions& demands) {
  verify.about(
      "largest difference of an interval from its re-simulation, relative to the motion's nominal values");
  demands.integration_error =
      verify.get_or("integration_error", demands.integration_error, io::or_infinite(io::positive()));
  verify.about(
      "largest violation of an inequality or bound between points, relative to the motion's movement there");
  demands.between = verify.get_or("between_nodes", demands.between, io::or_infinite(io::positive()));
  verify.about(
      "largest difference of the cost from the integral along the motion, relative to the sum of all costs");
  demands.cost_error = verify.get_or("cost_error", demands.cost_error, io::or_infinite(io::positive()));
}

void refuse_accuracy(Section& verify) {
  for (const char* key : {"integration_error", "between_nodes", "cost_error"}) {
    if (verify.has(key))
      verify.problem(key, std::string("'") + key +
                              "' is for motions without rigid contacts; for motions with rigid contacts "
                              "expected 'simulation_error', which compares with a simulation of the scene");
  }
}

void read_simulation(Section& verify, TaskSpec::VerifyOptions& demands) {
  verify.about(
      "for a scene with rigid contacts: largest error of a position when the torques drive the simulated "
      "scene, relative to its movement; also the largest fraction of the contacts' impulse that acts at a "
      "distance");
  demands.simulation = verify.get_or("simulation_error", demands.simulation, io::or_infinite(io::positive()));
  verify.about("stiffness of a servo that is added to the torques in that simulation [N m/rad or N/m]");
  demands.servo_stiffness = verify.get_or("servo_stiffness", demands.servo_stiffness, io::not_negative());
  verify.about("damping of that servo [N m s/rad or N s/m]");
  demands.servo_damping = verify.get_or("servo_damping", demands.servo_damping, io::not_negative());
}

// What is of rigid contacts is asked of tasks with some, and stands in the list of keys.
void read_demands(Section& file, TaskSpec::VerifyOptions& demands, bool has_contacts, bool is_list) {
  Section verify = file.about("requirements on the finished motion").child_or_empty("verify");
  verify.about("largest violation of a constraint, recomputed, relative to the program's nominal values");
  demands.violation = verify.get_or("violation", demands.violation, io::positive());
  if (has_contacts)
    refuse_accuracy(verify);
  else
    read_accuracy(verify, demands);
  verify.about("largest number of mesh refinements");
  demands.refinements = verify.get_or("max_refinements", demands.refinements, io::between(0, 10));
  verify.about("of method ddp: largest distance from the goal at the end, relative to the movement");
  demands.goal = verify.get_or("goal_error", demands.goal, io::or_infinite(io::positive()));
  if (has_contacts || is_list) read_simulation(verify, demands);
  verify.about(
      "whether the motion must keep the robot's limits and the clearances also between points, and limits "
      "that `bounds` does not impose");
  demands.limits = verify.get_or("limits", demands.limits);
}

void read_output(Section& file, TaskSpec& task, const RobotModel* model) {
  Section output = file.about("pictures").child_or_empty("output");
  std::vector<std::string> frames;
  if (model) {
    for (const auto& frame : model->frames) frames.push_back(frame.name);
  }
  output.about("links whose paths are drawn");
  task.traces = distinct_names(output, "trace", frames);
  task.view = output.about("view of the motion: a plane, or oblique")
                  .choice_or<View>(
                      "view", "xz",
                      {{"xz", View::kXz}, {"xy", View::kXy}, {"yz", View::kYz}, {"oblique", View::kOblique}});
}

void read_scheme(Section& transcription, const std::string& default_scheme, MeshOptions& mesh) {
  transcription.about("discretisation scheme: " + listed_schemes());
  const std::string scheme = transcription.get_or("scheme", default_scheme);
  try {
    mesh.scheme = scheme_by_name(scheme);
    const std::string fault = mesh.scheme.fault_on(mesh.intervals);
    if (!fault.empty()) throw ArgumentError(fault);
  } catch (const ArgumentError& e) {
    transcription.problem("scheme", e.what());
  }
}

}  // namespace

MeshOptions read_mesh(Section& file, WithLimitedMemory with, const std::string& default_scheme) {
  Section horizon = file.child("horizon"), transcription = file.child_or_empty("transcription");
  MeshOptions mesh;
  mesh.intervals =
      horizon.about("number of intervals, of equal length").get<int>("intervals", io::at_least(1));
  read_scheme(transcription, default_scheme, mesh);
  io::Choice<HessianKind> kinds = hessian_kinds();
  if (with == WithLimitedMemory::kNo) kinds.pop_back();
  mesh.hessian =
      transcription.about("Hessian for the solver").choice_or<HessianKind>("hessian", "exact", kinds);
  return mesh;
}

void read_task_keys(Section& file, TaskSpec& task, const RobotModel* model) {
  task.robot = read_form(file, task.simulated ? "inverse" : "forward");
  task.optimise.mesh =
      read_mesh(file, WithLimitedMemory::kYes, task.simulated ? kRigidScheme : "hermite-simpson");
  Section horizon = file.child("horizon");
  task.free_time = read_free_time(horizon, task.robot.duration);
  const EvaluationKeys evaluation = read_evaluation(file, PointsAtOnce::kMany);
  task.optimise.mesh.evaluation = evaluation.options;
  task.optimise.mesh.threads = evaluation.threads;
  read_solver(file, task);
  task.robot.thrusters = read_thrusters(file, model);
  task.robot.contacts = read_contacts(file, model);
  task.floor = read_floor(file);
  read_continuation(file, task, model);
  Section start = file.about("initial state").child("start");
  task.start = read_end(start, End::kStart, false, task.scene, model);
  task.periodic = read_periodic(file, task, model);
  const bool has_goal = file.has("goal");
  if (has_goal || !(task.periodic || (model && (file.has("reference") || file.has("terms")))))
    read_goal(file, task, task.scene, model, "final state; may be absent if there is a reference or terms");
  if (has_goal)
    task.has_soft_goal = file.child("goal")
                             .about("of method ddp: the goal is only a cost, the motion may end elsewhere")
                             .get_or("soft", false);
  read_phases(file, task, model);
  read_walk(file, task, model);
  task.waypoints = read_waypoints(file, task.scene, model);
  task.reference = read_reference(file, task.file, task.free_time.has_value(), task.scene, model);
  task.around = read_surroundings(file, model);
  task.guess = read_guess(file);
  task.costs = read_costs(file, task, model);
  task.terms = read_terms(file, task, model);
  task.bounds = read_limits(file);
  note_ddp_keys(file, task);
  read_output(file, task, model);
  task.models = read_model_settings(file);
  task.control = read_control(file, [&task, model](Section& push) { return read_hit(push, task, model); });
  read_plant(file, task, model);
  read_demands(file, task.demands, task.simulated != nullptr, model == nullptr);
  if (file.about("a known optimum, which is compared with the result").has("expected")) {
    Section expected = file.child("expected");
    const double cost = expected.about("cost of the optimum").get<double>("cost");
    expected.about("largest difference of the cost");
    task.expected = {cost, expected.get<double>("tolerance", io::positive())};
  }
  if (!model) return;
  for (const SpecFault& fault : faults_of(task)) note_at(file, fault);
}

std::vector<io::Question> task_questions() {
  Section file = Section::catalogue();
  TaskSpec task;
  read_task_name(file, "its file's");
  read_task_scene(file, task);
  read_task_keys(file, task, nullptr);
  return file.questions();
}

}  // namespace dyntape
