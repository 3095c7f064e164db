// SPDX-License-Identifier: BSD-3-Clause
//
// What of a scene varies in a sweep: every number of every effect; what is wrong in a file is said with its place.
#include <gtest/gtest.h>

#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/number.h>

#include "interface/run/sweep/swept.h"
#include "source_folder.h"

namespace dyntape::sweep_numbers_test {
namespace {

using Eigen::VectorXd;

// A scene with every effect on a floating robot.
const std::string kEverything = R"(
robot
{
  urdf ")" + test::source_folder() +
                                R"(/config/robots/solo12.urdf"
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
    position "0 0 0.09"
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
  time_constant 0.02
}
simulation
{
  duration 0.003
  step 1e-4
  integrator runge-kutta-4
}
)";

const std::string kMotors = R"(
robot
{
  urdf ")" + test::source_folder() +
                            R"(/config/robots/pendulum.urdf"
}
effects
{
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
}
start
{
  q 1
  v 2
}
commands
{
  torque 1.5
}
simulation
{
  duration 0.02
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

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  return text.replace(text.find(what), what.size(), by);
}

std::string about_all_effects(const Scene& scene) {
  std::string values;
  for (const EffectNumber& number : effect_numbers(scene.robot)) {
    if (number.use == EffectNumber::Use::kVaries) values += about(scene, number);
  }
  return values;
}

std::string about_the_rest() {
  return value("parameter start.q\njoint FL_HFE\nfrom 0.7\nto 0.9") +
         value("parameter start.v\nfrom 0\nto 1") +
         value("parameter start.base.roll_pitch_yaw\naxis y\nfrom 0\nto 1") +
         value("parameter start.base.angular_velocity\naxis z\nfrom 0\nto 1") +
         value("parameter commands.torque\njoint \"FL_KFE FL_HAA\"\nfrom 0\nto 1") +
         value("parameter robot.mass:FL_LOWER_LEG\nfrom 0.1\nto 0.2") +
         value("parameter robot.length:FL_KFE\nfrom 0.9\nto 1.1") +
         value("parameter robot.comx:base_link\nfrom 0\nto 0.01");
}

SceneSweep interpreted(SceneSweep sweep) {
  sweep.evaluation.route = Route::kInterpreter;
  return sweep;
}

TEST(Sweeps, EveryNumberOfEveryEffectVaries) {
  for (const char* integrator :
       {"runge-kutta-4", "implicit-midpoint", "semi-implicit-euler", "variational"}) {
    const MadeScene made(replaced(kEverything, "runge-kutta-4", integrator));
    const std::string values = about_all_effects(made.scene()) + about_the_rest();
    const SceneSweep sweep = interpreted(made.sweep("samples 3\n" + block("vary", values)));
    EXPECT_GE(sweep.values.size(), 50u);
    expect_rows_of_scenes(sweep, 0, 3);
  }
  const MadeScene motors(kMotors);
  const SceneSweep sweep =
      interpreted(motors.sweep("samples 5\n" + block("vary", about_all_effects(motors.scene()))));
  EXPECT_GE(sweep.values.size(), 4u);
  expect_rows_of_scenes(sweep, 0, 5);
}

// Another number, another end; but of limits that are far, and of what waves do not read.
TEST(Sweeps, EveryNumberMatters) {
  const MadeScene made(kEverything);
  const std::string values = about_all_effects(made.scene()) + about_the_rest();
  const SceneSweep sweep = interpreted(made.sweep("samples 1\n" + block("vary", values)));
  const io::CsvTable nominal = table_of(sweep, computed(sweep, 0, 1));
  for (std::size_t k = 0; k < sweep.values.size(); ++k) {
    SceneSweep other = sweep;
    other.values[k].from = other.values[k].to;
    const io::CsvTable table = table_of(other, computed(other, 0, 1));
    bool differs = false;
    for (int i = table.index("t"); i < table.cols(); ++i) differs = differs || table(0, i) != nominal(0, i);
    const std::string& name = sweep.values[k].name;
    const bool is_idle = name.starts_with("effects.joint_limits") || name.find(".normal.") != name.npos ||
                         name.ends_with("slope.z") || name.ends_with("wave.z");
    EXPECT_EQ(differs, !is_idle) << name;
  }
}

TEST(Sweeps, SaysWhatIsWrongInAFile) {
  const std::pair<std::string, std::string> cases[] = {
      {value("parameter start.qq\nfrom 0\nto 1"),
       "nothing in the scene is called 'start.qq'; did you mean 'start.q'?"},
      {value("parameter start.q\nfrom 0\nto 1\nstep 3"), "unknown key 'step'"},
      {value("parameter start.q\nfrom 1\nto 0"), "'to' is less than 'from'"},
      {value("parameter start.q\njoint hing\nfrom 0\nto 1"), "did you mean 'hinge'"},
      {value("parameter start.q\nfrom 0"), "required key 'vary.value.to' is missing"},
      {value("parameter start.q\nfrom 0\nto x"), "expects a number"},
      {value("parameter start.q\nfrom 0\nto inf"), "finite"},
      {value("parameter start.q\nfrom 0\nto 1\ndistribution flat"), "distribution"},
      {value("parameter start.q\nfrom 0\nto 1\nspread log-uniform"), "must be positive"},
      {value("parameter start.q\nfrom 0\nto 1\nspread grid"), "required key 'vary.value.steps' is missing"},
      {value("parameter start.q\nmean 0\ndeviation 1\nspread normal\nfrom 9\nto 10"),
       "lie between their limits"},
      {value("parameter start.q\nmean 0\ndeviation 0\nspread normal"), "must be positive"},
      {value("parameter start.q\nfrom 0\nto 1") + value("parameter start.q\njoint hinge\nfrom 0\nto 1"),
       "varies with 'start.q'"},
      {value("parameter start.q\nfrom 0\nto 1\nname a") + value("parameter start.v\nfrom 0\nto 1\nname a"),
       "called 'a'"},
      {value("parameter start.q\nfrom 0\nto 1\nname \"a b\""), "without blanks"},
      {value("parameter start.q\nfrom 0\nto 1\nname ok"), "column 'ok' of their own"},
      {value("parameter start.q\nfrom 0\nto 1\nname most.v"), "column 'most.v' of their own"},
      {value("parameter start.q\nfrom -1e308\nto 1e308"), "farther apart"},
      {value("parameter effects.joint_damping\nfrom 0\nto 1"),
       "'effects.joint_damping' does not act in the scene"},
      {value("parameter effects.gravity.vector\naxis z\nfrom -9\nto -8"), "not given in the scene"},
      {value("parameter start.base.position\naxis z\nfrom 0\nto 1"), "nothing in the scene is called"},
      {value("parameter robot.mass:rodd\nfrom 1\nto 2"), "did you mean"},
      {value("parameter robot.mass:rod\nfrom -1\nto 2"), "must be positive"},
      {value("parameter robot.Ixx:rod\nfrom 1\nto 2"), "nothing that varies"},
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
  const std::string one = value("parameter start.q\nfrom 0\nto 1");
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
      {"parameter effects.contacts.contact.friction\nfrom -0.1\nto 1", "must be not negative"},
      {"parameter effects.joint_friction.smoothing\nfrom 0\nto 1", "must be positive"},
      {"parameter effects.contacts.ground\nfrom 1\nto 2", "is a word"},
      {"parameter effects.contacts.contact.friction\nitem 3\nfrom 0.1\nto 1", "between 1 and 2"},
      {"parameter effects.contacts.contact.fraction\nfrom 0.1\nto 1",
       "did you mean 'effects.contacts.contact.friction'"},
      {"parameter effects.gravity.vector\nfrom 0.1\nto 1", "'vary.value.axis' is missing"},
  };
  for (const auto& [lines, expected] : cases) {
    try {
      made.sweep("samples 3\n" + block("vary", value(lines)));
      ADD_FAILURE() << "accepted: " << lines;
    } catch (const FileError& e) {
      EXPECT_NE(std::string(e.what()).find(expected), std::string::npos) << e.what();
    }
  }
  try {
    MadeScene(kMotors).sweep("samples 3\n" +
                             block("vary", value("parameter effects.torque_saturation.limit\nfrom 1\nto 2")));
    ADD_FAILURE() << "accepted";
  } catch (const FileError& e) {
    EXPECT_NE(std::string(e.what()).find("what is recorded depends on it"), std::string::npos) << e.what();
  }
  // Normal numbers stay where the parameter may be.
  const SceneSweep sweep =
      MadeScene(kEverything)
          .sweep("samples 2000\n" + block("vary", value("parameter effects.contacts.contact.friction\nspread "
                                                        "normal\nmean 0.05\ndeviation 0.1")));
  for (long row = 0; row < sweep.rows(); ++row) EXPECT_GE(values_of(sweep, row)[0], 0);
}

}  // namespace
}  // namespace dyntape::sweep_numbers_test
