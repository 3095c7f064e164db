// SPDX-License-Identifier: BSD-3-Clause
//
// Sweeps: each row is what simulate makes of a scene with these numbers, whoever computes it and beside whom; what is
// drawn is a function of the seed; what is wrong in a file is said with its place.
#include <gtest/gtest.h>

#include <boost/math/special_functions/jacobi_elliptic.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/io/csv.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/scene/simulate.h>
#include <dyntape/interface/sweep/random_numbers.h>
#include <dyntape/interface/sweep/run_sweep.h>

#include "temporary_cache.h"

namespace dyntape {
namespace {

namespace fs = std::filesystem;
using Eigen::VectorXd;

const TemporaryCache& sweep_cache() {
  static const TemporaryCache cache;
  return cache;
}

const std::string kSource = DYNTAPE_SOURCE_DIR;

// Of a text that stands beside the shipped sweeps.
SceneSweep sweep_of(const std::string& text) {
  SceneSweep sweep = read_sweep_text(text, kSource + "/config/sweeps/made_up.info");
  sweep.evaluation.cache_folder = sweep_cache().path();
  return sweep;
}
SceneSweep shipped_sweep(const std::string& name) {
  SceneSweep sweep = read_sweep(kSource + "/" + name);
  sweep.evaluation.cache_folder = sweep_cache().path();
  return sweep;
}

std::string block(const std::string& name, const std::string& lines) {
  return name + "\n{\n" + lines + "\n}\n";
}
std::string value(const std::string& lines) { return block("value", lines); }
std::string pendulum_sweep(const std::string& values, const std::string& rest = "samples 8\n") {
  return "scene ../scenes/pendulum.info\n" + rest + block("vary", values);
}

ComputedRows computed(const SceneSweep& sweep, long first, long count) {
  SweepRows rows(sweep, sweep.evaluation);
  return rows.compute(first, count, {}).value();
}

io::CsvTable table_of(const SceneSweep& sweep, const ComputedRows& rows) {
  std::string header;
  for (const std::string& name : row_names(sweep)) header += (header.empty() ? "" : ",") + name;
  return io::parse_csv(header + "\n" + rows.text, "rows");
}

// Each row against the motion of its scene: the same bits.
void expect_rows_of_scenes(const SceneSweep& sweep, long first, long count) {
  const io::CsvTable table = table_of(sweep, computed(sweep, first, count));
  for (long k = 0; k < count; ++k) {
    const Scene scene = scene_of(sweep, first + k);
    const SimulatedMotion motion = simulate(scene);
    ASSERT_EQ(motion.trouble, "") << sweep.name << " " << first + k;
    const int last = motion.samples() - 1, q = table.index("t") + 1, v = q + scene.robot.model.nq;
    for (int i = 0; i < scene.robot.model.nq; ++i)
      EXPECT_EQ(table(int(k), q + i), motion.q(i, last)) << sweep.file << " q" << i << " of " << first + k;
    for (int i = 0; i < scene.robot.model.nv; ++i)
      EXPECT_EQ(table(int(k), v + i), motion.v(i, last)) << sweep.file << " v" << i << " of " << first + k;
    double most = -HUGE_VAL;
    for (int i = 0; i < motion.samples(); ++i) most = std::max(most, motion.energy(i));
    const auto near = [&](const char* name, double expected) {
      EXPECT_NEAR(table(int(k), table.index(name)), expected, 1e-12 * (1 + std::abs(expected))) << name;
    };
    near("energy.kinetic", motion.kinetic.back());
    near("energy.stored", motion.stored.back());
    near("most.energy", most);
    EXPECT_GE(table(int(k), table.index("most.v")), motion.v.cwiseAbs().maxCoeff());
  }
}

TEST(Sweeps, RandomNumbersAreThoseOfPhilox) {
  // Known answers of the authors' library.
  using Four = std::array<std::uint32_t, 4>;
  EXPECT_EQ(philox({0, 0, 0, 0}, {0, 0}), (Four{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  const std::uint32_t all = 0xffffffff;
  EXPECT_EQ(philox({all, all, all, all}, {all, all}), (Four{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(philox({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
            (Four{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(Sweeps, RandomNumbersAreSpreadAsTheirNamesSay) {
  const SceneSweep sweep = sweep_of(pendulum_sweep(
      value("of start.q\nfrom -1\nto 3") + value("of start.v\nspread normal\nmean 2\ndeviation 0.5\nfrom 1") +
          value("of robot.mass:rod\nspread log-uniform\nfrom 0.1\nto 10"),
      "samples 20000\nseed 7\n"));
  const long n = sweep.rows();
  VectorXd sum = VectorXd::Zero(3), squares = VectorXd::Zero(3);
  double least = 9, most = -9;
  for (long row = 0; row < n; ++row) {
    VectorXd x = values_of(sweep, row);
    EXPECT_EQ(x, values_of(sweep, row));
    EXPECT_GE(x[1], 1);
    x[2] = std::log10(x[2]);
    sum += x, squares += x.cwiseProduct(x);
    least = std::min(least, x[0]), most = std::max(most, x[0]);
  }
  const VectorXd mean = sum / double(n);
  const VectorXd variance = squares / double(n) - mean.cwiseProduct(mean);
  EXPECT_NEAR(mean[0], 1, 0.04);
  EXPECT_NEAR(variance[0], 16. / 12, 0.04);
  EXPECT_NEAR(least, -1, 1e-3);
  EXPECT_NEAR(most, 3, 1e-3);
  // Cut off two deviations below its mean: phi(2) = 0.0539910, Phi(2) = 0.9772499.
  EXPECT_NEAR(mean[1], 2 + 0.5 * 0.0539910 / 0.9772499, 0.015);
  EXPECT_NEAR(variance[1], 0.25 * (1 - 2 * 0.0552478 - 0.0552478 * 0.0552478), 0.01);
  EXPECT_NEAR(mean[2], 0, 0.02);
  EXPECT_NEAR(variance[2], 4. / 12, 0.02);
  SceneSweep other = sweep;
  other.seed = 8;
  EXPECT_NE(values_of(sweep, 0), values_of(other, 0));
}

TEST(Sweeps, GridsAreNestedLoops) {
  const SceneSweep sweep = sweep_of(pendulum_sweep(
      value("of start.q\nspread grid\nfrom 0\nto 1\nsteps 3") +
          value("of start.v\nspread grid\nfrom 5\nto 6\nsteps 2") + value("of robot.mass:rod\nfrom 1\nto 2"),
      "samples 4\n"));
  ASSERT_EQ(sweep.rows(), 24);
  std::set<double> masses;
  for (long row = 0; row < 24; ++row) {
    const VectorXd x = values_of(sweep, row);
    EXPECT_EQ(x[0], 0.5 * double(row / 8)) << row;
    EXPECT_EQ(x[1], 5 + double(row / 4 % 2)) << row;
    masses.insert(x[2]);
  }
  EXPECT_EQ(masses.size(), 24u);
}

TEST(Sweeps, PendulumsAreWhereEllipticFunctionsPutThem) {
  const SceneSweep sweep = shipped_sweep("config/sweeps/pendulum_amplitudes.info");
  const io::CsvTable table = table_of(sweep, computed(sweep, 0, sweep.rows()));
  ASSERT_EQ(table.rows(), 30);
  for (int row = 0; row < table.rows(); ++row) {
    const double k = std::sin(table(row, table.index("start.q")) / 2);
    const double expected = 2 * std::asin(k * boost::math::jacobi_cd(k, std::sqrt(9.81) * 10));
    EXPECT_NEAR(table(row, table.index("q.hinge")), expected, 1e-9) << row;
    EXPECT_EQ(table(row, table.index("ok")), 1);
    // Fastest at the bottom: v = 2 sqrt(g) k.
    EXPECT_NEAR(table(row, table.index("most.v")), 2 * std::sqrt(9.81) * k, 2e-5);
  }
}

TEST(Sweeps, RowsAreWhatSimulateMakesOfTheirScenes) {
  expect_rows_of_scenes(shipped_sweep("config/sweeps/pendulum_amplitudes.info"), 11, 6);
  SceneSweep drop = shipped_sweep("config/sweeps/quadruped_dropped.info");
  drop.scene.duration = 0.4;
  expect_rows_of_scenes(drop, 3, 2);
  SceneSweep lanes = shipped_sweep("tests/bench/quadruped_sweep.info");
  lanes.scene.duration = 0.5;
  expect_rows_of_scenes(lanes, 17, 5);
}

// A scene with every effect on a floating robot.
constexpr const char* kEverything = R"(
robot
{
  urdf ")" DYNTAPE_SOURCE_DIR R"(/config/robots/solo12.urdf"
  base floating
  lock "FR_HAA FR_HFE FR_KFE HL_HAA HL_HFE HL_KFE HR_HAA HR_HFE HR_KFE"
}
effects
{
  gravity
  {
    vector "0.1 0.2 -9"
  }
  armature
  {
    inertia 0.01
    rotor_inertia 1e-5
    gear_ratio 9
  }
  joint_damping 0.05
  joint_friction
  {
    torque 0.02
    smoothing 0.5
    breakaway 0.03
    stribeck_speed 0.4
  }
  joint_springs
  {
    stiffness 2
    rest 0.3
  }
  joint_limits
  {
    stiffness 10
    damping 0.1
    margin 0.2
  }
  torque_saturation
  {
    limit 3
    kind smooth
  }
  back_emf
  {
    torque_constant 0.02
    voltage_constant 0.02
    resistance 0.5
    gear_ratio 9
  }
  tendons
  {
    tendon
    {
      arms "0.02 0.03 0.01"
      length 0.2
      rest_length 0.19
      stiffness 500
      damping 1
      kind tension
      slack 0.001
    }
  }
  wrenches
  {
    wrench
    {
      frames "FL_FOOT base_link"
      fixed_in world
      force "0.5 0.1 1"
      moment "0.01 0.02 0.03"
    }
  }
  drag
  {
    medium "1 0.5 0.2"
    density 1.2
    smoothing 0.1
    body
    {
      frames "FL_FOOT"
      area 0.01
      linear 0.1
    }
  }
  buoyancy
  {
    density 1000
    gravity 9.81
    body
    {
      frames "base_link"
      volume 1e-4
    }
  }
  contacts
  {
    ground waves
    normal "0 0 1"
    offset 0.05
    slope "0.05 0.02 0"
    amplitude 0.01
    wave "3 2 0"
    slip 0.1
    contact
    {
      frames "FL_FOOT base_link"
      radius 0.05
      second_end "0.01 0.02 0.01"
      stiffness 2000
      exponent 1.5
      dissipation 0.5
      friction 0.6
    }
  }
}
start
{
  q "0.1 0.8 -1.6"
  v "0.3 -0.2 0.1"
  base
  {
    position "0 0 0.3"
    roll_pitch_yaw "0.1 0.2 0.3"
    velocity "0.1 0 -0.2"
    angular_velocity "0.1 0.2 -0.3"
  }
}
commands
{
  torque "0.5 -0.3 0.2"
}
actuators
{
  lag 0.02
}
simulation
{
  duration 0.03
  step 1e-3
  integrator runge-kutta-4
}
)";

// What the scene has of a number: of a vector, one entry.
struct NominalNumber {
  std::string path;
  int entry = 0;
  double found = 0;

  double at(double x) const { return x; }
  double at(const VectorXd& x) const { return x[x.size() - 1]; }
  double at(const Eigen::Vector3d& x) const { return x[entry]; }
  template <class Value>
  double at(const std::optional<Value>& x) const {
    return at(*x);
  }
  template <class Word>
  requires std::is_enum_v<Word>
  double at(Word) const { return 0; }
};

double nominal_of(const Scene& scene, const std::string& path, int entry) {
  NominalNumber number{path, entry};
  dynamics::for_each_chosen_effect(scene.robot.effects, [&](const auto& effect) {
    detail::for_each_parameter_of(
        effect, [&](const std::string& at, int, const dynamics::ParameterInfo&, const auto& x) {
          if (at == path) number.found = number.at(x);
        });
  });
  return number.found;
}

// Ten per cent about what the scene has, the entries of a vector in space one by one.
std::string about(const Scene& scene, const EffectNumber& number) {
  const bool is_vector = number.shape == EffectNumber::Shape::kVector3;
  std::string text;
  for (int axis = 0; axis < (is_vector ? 3 : 1); ++axis) {
    const double x = nominal_of(scene, number.path, axis);
    const double a = x == 0 ? 0 : 0.9 * x, b = x == 0 ? 0.01 : 1.1 * x;
    text += value("of " + number.path + (is_vector ? std::string("\naxis ") + "xyz"[axis] : "") + "\nfrom " +
                  io::shortest(std::min(a, b)) + "\nto " + io::shortest(std::max(a, b)));
  }
  return text;
}

// In a folder of its own.
class MadeScene {
 public:
  explicit MadeScene(const std::string& scene) : folder_(fs::path(sweep_cache().path()) / "made") {
    fs::create_directories(folder_);
    std::ofstream(folder_ / "scene.info") << scene;
  }
  Scene scene() const { return read_scene((folder_ / "scene.info").string()); }
  SceneSweep sweep(const std::string& text) const {
    SceneSweep sweep = read_sweep_text("scene scene.info\n" + text, (folder_ / "sweep.info").string());
    sweep.evaluation.cache_folder = sweep_cache().path();
    return sweep;
  }

 private:
  fs::path folder_;
};

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  return text.replace(text.find(what), what.size(), by);
}

TEST(Sweeps, EveryNumberOfEveryEffectVaries) {
  for (const char* integrator : {"runge-kutta-4", "implicit-midpoint", "semi-implicit-euler"}) {
    const MadeScene made(replaced(kEverything, "runge-kutta-4", integrator));
    const Scene scene = made.scene();
    std::string values;
    int count = 0;
    for (const EffectNumber& number : effect_numbers(scene.robot)) {
      if (number.use != EffectNumber::Use::kVaries) continue;
      values += about(scene, number);
      ++count;
    }
    EXPECT_GE(count, 40);
    EXPECT_TRUE(absent_effects(scene.robot).empty());
    values += value("of start.q\njoint FL_HFE\nfrom 0.7\nto 0.9") + value("of start.v\nfrom 0\nto 1") +
              value("of start.base.roll_pitch_yaw\naxis y\nfrom 0\nto 1") +
              value("of start.base.angular_velocity\naxis z\nfrom 0\nto 1") +
              value("of commands.torque\njoint \"FL_KFE FL_HAA\"\nfrom 0\nto 1") +
              value("of robot.mass:FL_LOWER_LEG\nfrom 0.1\nto 0.2") +
              value("of robot.length:FL_KFE\nfrom 0.9\nto 1.1") +
              value("of robot.comx:base_link\nfrom 0\nto 0.01");
    SceneSweep sweep = made.sweep("samples 3\n" + block("vary", values));
    sweep.evaluation.route = Route::kInterpreter;
    expect_rows_of_scenes(sweep, 0, 3);
    // Each of them matters for where the motion ends.
    const std::string nominal = computed(sweep, 0, 1).text;
    for (std::size_t k = 0; k < sweep.values.size(); ++k) {
      SceneSweep other = sweep;
      if (std::string(integrator) != "runge-kutta-4") break;
      other.values[k].from = other.values[k].to;
      const io::CsvTable a = table_of(sweep, computed(sweep, 0, 1)),
                         b = table_of(other, computed(other, 0, 1));
      bool differs = false;
      for (int i = a.index("t"); i < a.cols(); ++i) differs = differs || a(0, i) != b(0, i);
      const bool may_be_idle = sweep.values[k].name.find("normal") != std::string::npos;  // of a plane
      EXPECT_TRUE(differs || may_be_idle) << sweep.values[k].name;
    }
  }
}

TEST(Sweeps, ThreadsLanesAndNeighboursChangeNoBit) {
  SceneSweep sweep = shipped_sweep("tests/bench/quadruped_sweep.info");
  sweep.scene.duration = 0.3;
  const std::string all = computed(sweep, 0, 23).text;
  std::string one_by_one;
  SweepRows rows(sweep, sweep.evaluation);
  for (long row = 0; row < 23; ++row) one_by_one += rows.twin().compute(row, 1, {})->text;
  EXPECT_EQ(all, one_by_one);
  sweep.evaluation.lanes = Lanes::kNone;
  EXPECT_EQ(all, computed(sweep, 0, 23).text);
  sweep.evaluation.route = Route::kInterpreter;
  EXPECT_EQ(all, computed(sweep, 0, 23).text);
}

// A spring on the edge of what the step follows: some samples fly apart.
TEST(Sweeps, ASampleThatFailsLeavesTheOthersAsTheyAre) {
  const MadeScene made("robot\n{\nurdf \"" + kSource + "/config/robots/pendulum.urdf\"\n}\n" +
                       "effects\n{\njoint_springs\n{\nstiffness 1\n}\n}\nstart\n{\nq 1\n}\n" +
                       "simulation\n{\nduration 3\nstep 0.01\nintegrator semi-implicit-euler\n}\n");
  const std::string spread = "of effects.joint_springs\nspread grid\nfrom 1e4\nto 1e5\nsteps 19";
  const SceneSweep sweep = made.sweep(block("vary", value(spread)));
  const ComputedRows rows = computed(sweep, 0, 19);
  const io::CsvTable table = table_of(sweep, rows);
  // m = 1 kg at 1 m: omega^2 = k + 9.81, stable below (2 / h)^2 = 4e4.
  std::size_t failed = 0;
  for (int row = 0; row < 19; ++row) {
    const double k = table(row, 1);
    const bool ok = table(row, table.index("ok")) == 1;
    EXPECT_TRUE(k < 4.1e4 || !ok) << k;
    failed += !ok;
    for (int i = 0; i < table.cols(); ++i) EXPECT_TRUE(std::isfinite(table(row, i)));
    EXPECT_EQ(rows.text.find(computed(sweep, row, 1).text) == std::string::npos, false) << row;
  }
  EXPECT_EQ(failed, rows.failures.size());
  EXPECT_LT(table(18, table.index("t")), 3);
  EXPECT_NE(rows.failures.back().find("sample 18: ended at t = "), std::string::npos) << rows.failures.back();
  EXPECT_NE(rows.failures.back().find("oscillates at"), std::string::npos) << rows.failures.back();
}

TEST(Sweeps, SaysWhatIsWrongInAFile) {
  const std::pair<std::string, std::string> cases[] = {
      {value("of start.qq\nfrom 0\nto 1"),
       "nothing in the scene is called 'start.qq'; did you mean 'start.q'?"},
      {value("of start.q\nfrom 0\nto 1\nstep 3"), "unknown key 'step'"},
      {value("of start.q\nfrom 1\nto 0"), "'to' is less than 'from'"},
      {value("of start.q\njoint hing\nfrom 0\nto 1"), "did you mean 'hinge'"},
      {value("of start.q\nfrom 0"), "required key 'vary.value.to' is missing"},
      {value("of start.q\nfrom 0\nto x"), "must be a number"},
      {value("of start.q\nfrom 0\nto inf"), "finite"},
      {value("of start.q\nfrom 0\nto 1\nspread flat"), "spread"},
      {value("of start.q\nfrom 0\nto 1\nspread log-uniform"), "must be positive"},
      {value("of start.q\nfrom 0\nto 1\nspread grid"), "required key 'vary.value.steps' is missing"},
      {value("of start.q\nmean 0\ndeviation 1\nspread normal\nfrom 9\nto 10"), "lie between their limits"},
      {value("of start.q\nmean 0\ndeviation 0\nspread normal"), "must be positive"},
      {value("of start.q\nfrom 0\nto 1") + value("of start.q\njoint hinge\nfrom 0\nto 1"),
       "varies with 'start.q'"},
      {value("of start.q\nfrom 0\nto 1\nname a") + value("of start.v\nfrom 0\nto 1\nname a"), "called 'a'"},
      {value("of start.q\nfrom 0\nto 1\nname \"a b\""), "without blanks"},
      {value("of effects.joint_damping\nfrom 0\nto 1"), "'effects.joint_damping' does not act in the scene"},
      {value("of effects.gravity.vector\naxis z\nfrom -9\nto -8"), "not given in the scene"},
      {value("of start.base.position\naxis z\nfrom 0\nto 1"), "nothing in the scene is called"},
      {value("of robot.mass:rodd\nfrom 1\nto 2"), "did you mean"},
      {value("of robot.mass:rod\nfrom -1\nto 2"), "must be positive"},
      {value("of robot.Ixx:rod\nfrom 1\nto 2"), "nothing that varies"},
      {"", "required key 'vary.value' is missing"},
  };
  for (const auto& [values, expected] : cases) {
    try {
      sweep_of(pendulum_sweep(values));
      ADD_FAILURE() << "accepted: " << values;
    } catch (const FileError& e) {
      EXPECT_NE(std::string(e.what()).find(expected), std::string::npos) << e.what();
      EXPECT_NE(std::string(e.what()).find("made_up.info:"), std::string::npos) << e.what();
    }
  }
  const std::string one = value("of start.q\nfrom 0\nto 1");
  EXPECT_THROW(sweep_of(pendulum_sweep(one, "")), FileError);  // how many
  EXPECT_THROW(sweep_of(pendulum_sweep(one, "samples 2000000\n")), FileError);
  EXPECT_THROW(sweep_of(pendulum_sweep(one, "samples 0\n")), FileError);
  EXPECT_THROW(sweep_of(pendulum_sweep(one, "samples 3\nshow most.w\n")), FileError);
  EXPECT_THROW(sweep_of("samples 3\n" + block("vary", one)), FileError);  // no scene
  EXPECT_THROW(sweep_of("scene none.info\nsamples 3\n" + block("vary", one)), FileError);
}

TEST(Sweeps, RangesOfParametersHoldForAllNumbers) {
  const MadeScene made(kEverything);
  const std::pair<std::string, std::string> cases[] = {
      {"of effects.contacts.contact.friction\nfrom -0.1\nto 1", "must be not negative"},
      {"of effects.joint_friction.smoothing\nfrom 0\nto 1", "must be positive"},
      {"of effects.torque_saturation.limit\nfrom 1\nto 2", "what is recorded depends on it"},
      {"of effects.contacts.ground\nfrom 1\nto 2", "is a word"},
      {"of effects.contacts.contact.friction\nitem 3\nfrom 0.1\nto 1", "between 1 and 2"},
      {"of effects.contacts.contact.fraction\nfrom 0.1\nto 1",
       "did you mean 'effects.contacts.contact.friction'"},
      {"of effects.gravity.vector\nfrom 0.1\nto 1", "'vary.value.axis' is missing"},
  };
  for (const auto& [lines, expected] : cases) {
    try {
      made.sweep("samples 3\n" + block("vary", value(lines)));
      ADD_FAILURE() << "accepted: " << lines;
    } catch (const FileError& e) {
      EXPECT_NE(std::string(e.what()).find(expected), std::string::npos) << e.what();
    }
  }
  // Normal numbers stay where the parameter may be.
  const SceneSweep sweep = made.sweep(
      "samples 2000\n" +
      block("vary", value("of effects.contacts.contact.friction\nspread normal\nmean 0.05\ndeviation 0.1")));
  for (long row = 0; row < sweep.rows(); ++row) EXPECT_GE(values_of(sweep, row)[0], 0);
}

TEST(Sweeps, FoldersGoOnRefuseAndForgive) {
  SceneSweep sweep = sweep_of(pendulum_sweep(value("of start.q\nfrom 0\nto 1"), "samples 100\n"));
  sweep.scene.duration = 0.1;
  sweep.threads = 3;
  const std::string path = sweep_cache().path() + "/folder";
  std::string whole;
  {
    SweepFolder folder(path, sweep, Restart::kNo);
    EXPECT_THROW(SweepFolder(path, sweep, Restart::kNo), FileError);  // in use
    whole = run_sweep(sweep, folder).csv;
    EXPECT_EQ(folder.kept(), chunks_of(sweep));
    EXPECT_GE(chunks_of(sweep), 4);
  }
  const std::string damaged = path + "/chunks/000001.rows";
  std::string text = read_file(damaged);
  text[text.size() / 2] ^= 1;
  std::ofstream(damaged) << text;
  fs::remove(path + "/chunks/000002.rows");
  {
    SweepFolder folder(path, sweep, Restart::kNo);
    EXPECT_EQ(folder.kept(), chunks_of(sweep) - 2);
    for (unsigned threads : {1u, 2u, 7u}) {
      sweep.threads = threads;
      EXPECT_EQ(run_sweep(sweep, folder).csv, whole);
    }
    EXPECT_THROW(folder.keep(0, text), FileError);
  }
  SceneSweep other = sweep;
  other.seed = 2;
  EXPECT_THROW(SweepFolder(path, other, Restart::kNo), FileError);
  EXPECT_EQ(SweepFolder(path, other, Restart::kYes).kept(), 0);
  for (const auto& change : std::initializer_list<void (*)(SceneSweep&)>{
           [](SceneSweep& s) { s.values[0].to = 2; }, [](SceneSweep& s) { s.samples = 99; },
           [](SceneSweep& s) {
             s.values[0].place = StartPlace{StartPlace::Block::kVelocity, {0}};
           },
           [](SceneSweep& s) { s.scene.effective += "step 2e-3\n"; }}) {
    SceneSweep changed = sweep;
    change(changed);
    EXPECT_NE(identity_of(changed), identity_of(sweep));
  }
  SceneSweep same = sweep;
  same.threads = 1, same.evaluation.lanes = Lanes::kNative;
  EXPECT_EQ(identity_of(same), identity_of(sweep));
}

}  // namespace
}  // namespace dyntape
