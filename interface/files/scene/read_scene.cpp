// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/scene/scene.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <Eigen/Geometry>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/dynamics/effects/check.h>
#include <dyntape/interface/files/file_kind.h>
#include <dyntape/interface/files/joint_values.h>
#include <dyntape/interface/files/lists.h>
#include <dyntape/interface/files/old_names.h>
#include <dyntape/interface/files/planar_keys.h>
#include <dyntape/interface/files/scene/constraint_keys.h>
#include <dyntape/interface/files/scene/left_out.h>
#include <dyntape/interface/files/scene/scene_keys.h>
#include <dyntape/interface/files/scene/scene_of_robot.h>
#include <dyntape/interface/io/csv.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using io::Section;
using RobotModel = dynamics::Model<double>;

void read_start(Section& file, const RobotModel* model, Scene& scene) {
  Section start = file.about("initial state").child_or_empty("start");
  const JointValues at_rest{.fallback = 0.0, .followers = scene.robot.mimics};
  const VectorXd q = read_joint_values(start.about("joint positions [rad or m]"), "q", model, at_rest);
  const VectorXd v = read_joint_values(start.about("joint velocities [rad/s or m/s]"), "v", model, at_rest);
  if (model && !floats(*model)) {
    if (start.has("base"))
      start.problem("base", "'start.base' is of a floating base; this robot's base is fixed");
  }
  const bool reads_base = !model || floats(*model);
  scene.base = reads_base ? read_base(start) : BaseStart();
  start.about(
      "state of a planar joint, one block per joint; joints without a block are at their neutral position");
  if (!model) {
    (void)read_planar(start, nullptr, scene.q, scene.v);
    return;
  }
  scene.q = configuration_of(*model, q);
  scene.v = v;
  if (floats(*model)) place_base(scene.base, scene.q, scene.v);
  start.about("state of a planar joint, one block per joint");
  (void)read_planar(start, model, scene.q, scene.v);
  const Ties ties = ties_of(scene.robot);
  scene.q = ties.tied_q(scene.q), scene.v = ties.tied_v(scene.v);
}

// Whether `whole` is made of steps; rounding apart.
void check_whole(Section& block, const std::string& key, double step, const std::string& of, double whole) {
  const double count = whole / step, nearest = std::round(count);
  if (count < 1 - 1e-9 && of == "duration") return;  // said elsewhere
  if (nearest >= 1 && std::abs(count - nearest) <= 1e-6 * nearest) return;
  block.problem(key, "'" + of + "' of " + io::shortest(whole) + " s is not made of whole steps of " +
                         io::shortest(step) + " s; the nearest that is: " +
                         io::with_digits(std::max(nearest, 1.0) * step, 12) + " s");
}

// Whole steps of about a hundredth of a second, within the duration.
double usual_sample(const Scene& scene) {
  if (!(scene.step > 0 && scene.duration > 0)) return 0.01;
  const double wanted = std::min(0.01, scene.duration) / scene.step;
  return std::max(1.0, std::floor(wanted * (1 + 1e-9))) * scene.step;
}

// A motion is kept in memory: at most a gigabyte of numbers.
double most_rows(const Scene& scene) {
  constexpr double kNumbers = 1e9 / sizeof(double);
  return std::floor(kNumbers / (20 + scene.robot.model.nq + 2 * scene.robot.model.nv));
}

// Of adaptive integrators; known: those of others have none.
void read_tolerances(Section& block, Scene& scene, bool known) {
  if (known && !is_adaptive(scene.integrator)) {
    const bool relative = block.has("relative_tolerance"), absolute = block.has("absolute_tolerance");
    if (!block.sound()) return;  // as a misspelt integrator
    for (const auto& [key, is_given] :
         {std::pair("relative_tolerance", relative), {"absolute_tolerance", absolute}})
      if (is_given)
        block.problem(key, "'" + std::string(key) + "' is of adaptive and adaptive-stiff; steps of " +
                               to_string(scene.integrator) + " are as long as 'step' says");
    return;
  }
  Tolerances& allowed = scene.tolerances;
  block.about(
      "of adaptive integrators: largest error of an internal step, relative to the size of the state");
  allowed.relative = block.get_or("relative_tolerance", allowed.relative,
                                  io::between(Tolerances::kLeastRelative, Tolerances::kMostRelative));
  block.about(
      "of adaptive integrators: largest error of an internal step where the state is near zero [rad, m, "
      "rad/s or m/s]");
  allowed.absolute = block.get_or("absolute_tolerance", allowed.absolute, io::positive());
}

void read_method(Section& file, Scene& scene, bool known) {
  Section block = file.about("how the motion is simulated").child("simulation");
  scene.duration = block.about("simulated time [s]").get<double>("duration", io::positive());
  block.about(
      "time step of the integrator; of an adaptive integrator: time for which a command is constant [s]");
  scene.step = block.get_or("step", 1e-3, io::positive());
  block.about("time between rows of the results, a multiple of the step [s]");
  scene.sample = block.get_or("sample", usual_sample(scene), io::positive());
  std::vector<std::pair<std::string, Integrator>> choices;
  for (Integrator integrator : kIntegrators) choices.emplace_back(to_string(integrator), integrator);
  scene.integrator = block.about("integration scheme")
                         .choice_or<Integrator>("integrator", to_string(scene.integrator), choices);
  read_tolerances(block, scene, known);
  if (!(scene.duration > 0 && scene.step > 0 && scene.sample > 0)) return;  // said already
  const double count = scene.duration / scene.step;
  if (scene.integrator == Integrator::kVariational && !scene.robot.effects.acting().coriolis)
    block.problem("integrator", "'variational' has all velocity products; they are off in this scene");
  if (scene.integrator == Integrator::kVariational && !scene.robot.mimics.empty())
    block.problem("integrator",
                  "'variational' has no joints that follow others; expected another, such as "
                  "implicit-midpoint, or 'robot.mimic false'");
  if (scene.integrator == Integrator::kVariational && !scene.robot.constraints.loops.empty())
    block.problem("integrator", "'variational' has no loops; expected another, such as implicit-midpoint");
  if (is_adaptive(scene.integrator) && !scene.robot.constraints.rigid.empty())
    block.problem("integrator",
                  "'" + std::string(to_string(scene.integrator)) +
                      "' has no rigid contacts or stops; expected steps of a length, such as runge-kutta-4");
  // A default is no one's mistake.
  const auto given = [&](const char* key) { return block.has(key) ? key : "duration"; };
  const std::string lasts = " of a motion of " + io::shortest(scene.duration) + " s";
  if (scene.sample > scene.duration * (1 + 1e-9)) {
    block.problem("sample", "'sample' is longer than the duration of " + io::shortest(scene.duration) + " s");
  } else if (scene.duration / scene.sample > most_rows(scene)) {
    block.problem(given("sample"), "'sample' of " + io::shortest(scene.sample) + " s makes " +
                                       io::with_digits(scene.duration / scene.sample, 3) + " rows" + lasts +
                                       "; expected at most " + io::with_digits(most_rows(scene), 3));
  }
  if (count > 1e9)
    block.problem(given("step"), "'step' of " + io::shortest(scene.step) + " s makes " +
                                     io::with_digits(count, 3) + " steps" + lasts + "; expected at most 1e9");
  check_whole(block, given("step"), scene.step, "duration", scene.duration);
  check_whole(block, "sample", scene.step, "sample", scene.sample);
  if (count < 1 - 1e-9)
    block.problem(given("step"),
                  "'step' is longer than the duration of " + io::shortest(scene.duration) + " s");
}

// Columns tau.<joint> over t, as solve writes them.
// Columns <block>.<joint>, (joints x rows).
Eigen::MatrixXd columns_of(const io::CsvTable& table, const std::string& block,
                           const std::vector<std::string>& joints) {
  Eigen::MatrixXd rows(Eigen::Index(joints.size()), table.rows());
  for (std::size_t k = 0; k < joints.size(); ++k) {
    const std::vector<double> column = table.column(block + "." + joints[k]);
    rows.row(Eigen::Index(k)) = Eigen::Map<const Eigen::RowVectorXd>(column.data(), table.rows());
  }
  return rows;
}

// Of the gains of all joints those of the driven ones, which are to have one position each.
Commands::Followed followed_by(const RobotScene& robot, const io::CsvTable& table,
                               const std::vector<std::string>& joints, const VectorXd& stiffness,
                               const VectorXd& damping) {
  const std::vector<int> dofs = actuated_dofs(robot);
  Commands::Followed f{VectorXd(Eigen::Index(dofs.size())),
                       VectorXd(Eigen::Index(dofs.size())),
                       columns_of(table, "q", joints),
                       columns_of(table, "v", joints),
                       {}};
  for (std::size_t k = 0; k < dofs.size(); ++k) {
    const auto& joint = robot.model.joints[std::size_t(robot.model.joint_index(joints[k]))];
    if (!dynamics::traits(joint.type).on_a_line)
      throw ArgumentError("joint \"" + joint.name + "\" has no single position that a motor could follow");
    f.stiffness[Eigen::Index(k)] = stiffness[dofs[k]], f.damping[Eigen::Index(k)] = damping[dofs[k]];
    f.in_x.push_back(joint.idx_q);
  }
  for (int dof : dofs) f.in_x.push_back(robot.model.nq + dof);
  return f;
}

Commands read_table(Section& block, const std::string& path, const RobotScene& robot,
                    const VectorXd& stiffness, const VectorXd& damping) {
  Commands commands;
  const io::CsvTable table = io::read_csv(path);
  const std::vector<std::string> joints = driven_names(robot);
  commands.t = table.column("t");
  commands.u = columns_of(table, "tau", joints);
  if (!stiffness.isZero(0) || !damping.isZero(0))
    commands.followed = followed_by(robot, table, joints, stiffness, damping);
  if (commands.t.empty()) block.problem("file", "'" + path + "' has no row");
  if (!std::is_sorted(commands.t.begin(), commands.t.end()))
    block.problem("file", "'" + path + "': the times of column t do not ascend");
  return commands;
}

Commands read_commands(Section& file, const std::string& path, const Scene& scene, bool known) {
  Section block = file.about("commands to the driven joints").child_or_empty("commands");
  const VectorXd torque = read_joint_values(block.about("constant torque [N m or N]"), "torque",
                                            known ? &scene.robot.model : nullptr,
                                            {.fallback = 0.0, .followers = scene.robot.mimics});
  const std::string table =
      block.about("path of a table with columns t [s] and tau.<joint>, as `dyntape solve` writes it")
          .get_or("file", "");
  const RobotModel* model = known ? &scene.robot.model : nullptr;
  block.about(
      "gain of the feedback to the table's q.<joint>, evaluated at the begin of each step [N m/rad or N/m]");
  const JointValues gains{.fallback = 0.0, .range = io::not_negative(), .followers = scene.robot.mimics};
  const VectorXd stiffness = read_joint_values(block, "stiffness", model, gains);
  block.about("gain of the feedback to the table's v.<joint> [N m s/rad or N s/m]");
  const VectorXd damping = read_joint_values(block, "damping", model, gains);
  if (!known) return {};
  for (const char* key : {"stiffness", "damping"})
    if (table.empty() && block.has(key))
      block.problem(
          key, std::string("'commands.") + key + "' pulls towards the motion of a table; expected 'file'");
  if (!table.empty() && block.has("torque"))
    block.problem("file", "'commands' has 'torque' and 'file', expected one of them");
  try {
    if (!table.empty())
      return read_table(block, path_beside(path, block, "file", table), scene.robot, stiffness, damping);
  } catch (const Error& e) {
    block.problem("file", e.what());
    return {};
  }
  const std::vector<int> dofs = actuated_dofs(scene.robot);
  Commands commands{{0}, Eigen::MatrixXd(Eigen::Index(dofs.size()), 1)};
  for (std::size_t k = 0; k < dofs.size(); ++k) commands.u(Eigen::Index(k), 0) = torque[dofs[k]];
  return commands;
}

void read_lag(Section& file, const RobotModel* model, RobotScene& robot) {
  Section block = file.about("dynamics of the motors").child_or_empty("actuators");
  block.about("time constant with which the torque follows its command [s]; 0: no delay");
  const VectorXd lag =
      read_joint_values(block, "time_constant", model,
                        {.fallback = 0.0, .range = io::not_negative(), .followers = robot.mimics});
  if (!model || lag.isZero(0)) return;
  const std::vector<int> dofs = actuated_dofs(robot);
  robot.lag.resize(Eigen::Index(dofs.size()));
  for (std::size_t k = 0; k < dofs.size(); ++k) robot.lag[Eigen::Index(k)] = lag[dofs[k]];
}

void read_keys(Section& file, Scene& scene, const std::string& path, const RobotModel* model,
               const dynamics::UrdfCollisions* collisions = nullptr) {
  const KeyedRobot robot{model, scene.urdf, &scene.left_out, collisions};
  read_scene_keys(file, scene.robot, robot);
  scene.robot.constraints = read_constraints(file, robot);
  read_lag(file, model, scene.robot);
  read_start(file, model, scene);
  scene.commands = read_commands(file, path, scene, model != nullptr);
  read_method(file, scene, model != nullptr);
  scene.evaluation = read_evaluation(file, PointsAtOnce::kOne).options;
}

std::string read_name(Section& file, const std::string& fallback) {
  return file.about("name of the scene in reports and pictures").get_or<std::string>("name", fallback);
}

}  // namespace

BaseStart read_base(Section& state) {
  Section base = state.about("pose and velocity of a floating base").child_or_empty("base");
  BaseStart keys;
  keys.position =
      read_vector3(base.about("position of its origin in the world [m]"), "position", Vector3d::Zero());
  base.about("rotation about the world's x axis, then y, then z [rad]");
  keys.roll_pitch_yaw = read_vector3(base, "roll_pitch_yaw", Vector3d::Zero());
  base.about("velocity of its origin, in the base's axes [m/s]");
  keys.velocity = read_vector3(base, "velocity", Vector3d::Zero());
  base.about("angular velocity, in the base's axes [rad/s]");
  keys.angular_velocity = read_vector3(base, "angular_velocity", Vector3d::Zero());
  return keys;
}

void place_base(const BaseStart& base, VectorXd& q, VectorXd& v) {
  const Eigen::Quaterniond turn = Eigen::AngleAxisd(base.roll_pitch_yaw.z(), Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(base.roll_pitch_yaw.y(), Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(base.roll_pitch_yaw.x(), Vector3d::UnitX());
  q.head<3>() = base.position;
  q.segment<4>(3) = turn.coeffs();
  v.head<3>() = base.velocity;
  v.segment<3>(3) = base.angular_velocity;
}

VectorXd Commands::at(double time, const VectorXd& x) const {
  const auto after = std::upper_bound(t.begin(), t.end(), time);
  const auto last = Eigen::Index(t.size()) - 1, k = std::min(Eigen::Index(after - t.begin()), last);
  const Eigen::Index before = after == t.begin() || after == t.end() ? k : k - 1;
  const double from = t[std::size_t(before)], to = t[std::size_t(k)];
  const double s = before == k ? 0 : (time - from) / (to - from);
  const auto now = [&](const Eigen::MatrixXd& rows) {
    return VectorXd((1 - s) * rows.col(before) + s * rows.col(k));
  };
  if (!followed) return now(u);
  const Eigen::Index n = u.rows();
  const VectorXd off_q = now(followed->q) - x(followed->in_x).head(n);
  const VectorXd off_v = now(followed->v) - x(followed->in_x).tail(n);
  return now(u) + followed->stiffness.cwiseProduct(off_q) + followed->damping.cwiseProduct(off_v);
}

long Scene::steps() const { return std::max(1L, std::lround(duration / step)); }
long Scene::stride() const { return std::max(1L, std::lround(sample / step)); }

namespace {

void check_is_for_scenes(const dynamics::UrdfRobot& robot) {
  for (const auto& joint : robot.model.joints)
    if (joint.type == dynamics::JointType::kContinuous)
      throw ArgumentError(
          "scene: joint \"" + joint.name +
          "\" has two entries, (cos, sin), and scenes have its angle; load the robot with that");
}

Scene read_scene_of(const GivenRobot* given, const std::string& text, const std::string& path,
                    const std::vector<io::Setting>& settings) {
  check_is_no_robot(text, path, "a scene; expected an .info file, as those in config/scenes");
  check_file_kind(text, path, FileKind::kScene);
  Section file = Section::parse(text, path, old_names(), settings);
  Scene scene;
  scene.file = path;
  scene.name = read_name(file, std::filesystem::path(path).stem().string());
  SceneRobot found = given ? SceneRobot{"", given->robot} : read_scene_robot(file, path, Floating::kAllowed);
  const bool known = take_robot(std::move(found), scene, scene.robot);
  read_keys(file, scene, path, known ? &scene.robot.model : nullptr, given ? &given->collisions : nullptr);
  file.finish();
  try {
    dynamics::check(scene.robot.model, scene.robot.effects);
    (void)actuated_dofs(scene.robot);
  } catch (const ArgumentError& e) {
    throw FileError(path + ": " + e.what());
  }
  scene.places = file.places();
  note_left_out(scene.notes, given ? "\"" + scene.robot.model.name + "\"" : scene.urdf, scene.left_out,
                scene.robot, LimitsOfFile::kByChoice);
  note_old_names(scene.notes, file);
  scene.effective = file.effective_values();
  scene.inputs = file.files();
  return scene;
}

}  // namespace

Scene read_scene_text(const std::string& text, const std::string& path,
                      const std::vector<io::Setting>& settings) {
  return read_scene_of(nullptr, text, path, settings);
}

Scene read_scene_text(const GivenRobot& robot, const std::string& text, const std::string& path,
                      const std::vector<io::Setting>& settings) {
  check_is_for_scenes(robot.robot);
  return read_scene_of(&robot, text, path, settings);
}

Scene read_scene(const std::string& path, const std::vector<io::Setting>& settings) {
  return read_scene_text(read_file(path), path, settings);
}

std::vector<io::Question> scene_questions() {
  Section file = Section::catalogue();
  Scene scene;
  read_name(file, "its file's");
  read_scene_robot(file, "", Floating::kAllowed);
  read_keys(file, scene, "", nullptr);
  return file.questions();
}

}  // namespace dyntape
