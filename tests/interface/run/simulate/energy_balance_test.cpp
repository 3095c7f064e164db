// SPDX-License-Identifier: BSD-3-Clause
//
// The balance of energy: what steps take is said and is no success beyond a tenth of what moved, in each mechanism by itself;
// and of adaptive steps it is as good as they are.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/report/simulation_results.h>
#include <dyntape/interface/system/mechanisms.h>

#include "interface/run/shipped_scenes.h"
#include "source_folder.h"

namespace dyntape::energy_balance_test {
namespace {

using Eigen::VectorXd;

// A ball falls from 1 m and comes back to 0.680 m; steps that end lower have taken the difference, and what its dissipation
// has less to take from.
TEST(EnergyBalance, WhatImplicitVelocityTakesIsSaidAndNoSuccess) {
  Scene scene = shipped("bouncing_ball");
  scene.duration = 0.8;
  const SimulatedMotion exact = run(scene);
  EXPECT_LT(exact.balances.front().part(), 1e-4);
  scene.integrator = Integrator::kImplicitVelocity;
  for (const double step : {1e-4, 1e-3, 1e-2}) {
    scene.step = step, scene.sample = 0.01;
    const SimulatedMotion motion = simulate(scene);
    const double lower = exact.energy(exact.samples() - 1) - motion.energy(motion.samples() - 1);
    const MechanismBalance& balance = motion.balances.front();
    EXPECT_GT(balance.taken, lower) << step;
    EXPECT_LT(balance.taken, 3 * lower) << step;
    EXPECT_EQ(motion.warning.empty(), step < 1e-3) << step << " " << balance.part();
    const std::string text = SimulationReport{scene, motion}.text();
    EXPECT_NE(text.find("lost by the steps"), std::string::npos) << text;
  }
}

// Two robots beside each other, of random lengths and masses.
std::string rod(const std::string& name, double length, double mass, const std::string& axis) {
  const std::string l = io::shortest(length), m = io::shortest(mass);
  return "<link name=\"" + name + "_body\"><inertial><origin xyz=\"0 0 -" + l + "\"/><mass value=\"" + m +
         "\"/><inertia ixx=\"0.1\" ixy=\"0\" ixz=\"0\" iyy=\"0.1\" iyz=\"0\" izz=\"0.1\"/></inertial></link>"
         "<joint name=\"" +
         name + "\" type=\"continuous\"><parent link=\"world\"/><child link=\"" + name +
         "_body\"/><axis xyz=\"" + axis + "\"/></joint>";
}
Scene scene_of(const std::string& parts, const VectorXd& q, const VectorXd& torque) {
  Scene scene;
  scene.robot.model =
      dynamics::load_urdf_text("<robot name=\"parts\"><link name=\"world\"/>" + parts + "</robot>",
                               "parts.urdf", {.continuous = dynamics::ContinuousJoint::kAngle});
  scene.q = q, scene.v = VectorXd::Zero(q.size());
  scene.commands = {{0}, torque};
  scene.evaluation.route = Route::kInterpreter;
  return scene;
}

TEST(EnergyBalance, EachMechanismHasItsOwn) {
  std::mt19937_64 random(3);
  const auto between = [&](double a, double b) { return std::uniform_real_distribution(a, b)(random); };
  int doubted = 0;
  for (int trial = 0; trial < 12; ++trial) {
    const std::string swing = rod("swing", between(0.3, 2), between(0.1, 3), "1 0 0"),
                      wheel = rod("wheel", 0, between(1, 5), "0 0 1");
    const VectorXd from = VectorXd::Constant(1, between(0.5, 3));
    Scene alone = scene_of(swing, from, VectorXd::Zero(1));
    Scene both = scene_of(swing + wheel, VectorXd{{from[0], 0.0}}, VectorXd{{0.0, between(1, 100)}});
    for (Scene* scene : {&alone, &both}) {
      scene->integrator = trial % 3 == 0 ? Integrator::kSemiImplicitEuler : Integrator::kImplicitVelocity;
      scene->step = scene->sample = trial % 2 ? 1e-3 : 2e-2;
      scene->duration = 5;
    }
    const SimulatedMotion a = simulate(alone), b = simulate(both);
    ASSERT_EQ(b.balances.size(), 2u);
    EXPECT_EQ(b.balances[0].name, "swing");
    EXPECT_NEAR(b.balances[0].error, a.balances[0].error, 1e-9 * a.balances[0].moved);
    EXPECT_NEAR(b.balances[0].moved, a.balances[0].moved, 1e-9 * a.balances[0].moved);
    EXPECT_EQ(a.warning.empty(), b.warning.empty()) << a.warning << " | " << b.warning;
    if (!b.warning.empty()) {
      EXPECT_NE(b.warning.find("'swing'"), std::string::npos) << b.warning;
    }
    doubted += !a.warning.empty();
  }
  EXPECT_GT(doubted, 2);
  EXPECT_LT(doubted, 12);
}

TEST(EnergyBalance, WhatTendonsAndLoopsConnectIsOne) {
  Scene scene = scene_of(rod("a", 1, 1, "1 0 0") + rod("b", 1, 1, "1 0 0") + rod("c", 1, 1, "1 0 0"),
                         VectorXd::Zero(3), VectorXd::Zero(3));
  EXPECT_EQ(mechanisms_of(scene.robot).size(), 3u);
  dynamics::Tendon<double> tendon;
  tendon.arms = VectorXd{{0.1, 0.0, -0.1}};
  tendon.stiffness = 100;
  scene.robot.effects.tendons.push_back(tendon);
  const std::vector<Mechanism> joined = mechanisms_of(scene.robot);
  ASSERT_EQ(joined.size(), 2u);
  EXPECT_EQ(joined[0].joints, (std::vector<int>{0, 2}));
  EXPECT_EQ(mechanism_of_joints(joined, 3), (std::vector<int>{0, 1, 0}));
  EXPECT_EQ(mechanisms_of(shipped("four_bar").robot).size(), 1u);
  // Energy goes from one to the other through the tendon, and is accounted for in what both are.
  scene.q[0] = 1;
  scene.duration = 2;
  const SimulatedMotion motion = run(scene);
  EXPECT_LT(motion.energy_error(), 1e-8 * motion.energy_scale());
}

// Of a motion that parts from its neighbours: 4.4e-3 J by the powers at the ends of long steps.
TEST(EnergyBalance, OfAdaptiveStepsIsAsGoodAsTheyAre) {
  for (const Integrator integrator : {Integrator::kAdaptive, Integrator::kAdaptiveStiff}) {
    for (const double step : {1e-3, 0.02, 0.5}) {
      Scene scene = shipped("pendulum");
      scene.robot.model = dynamics::load_urdf(test::source_folder() + "/config/robots/double_pendulum.urdf");
      scene.q = VectorXd{{2.5, 1.0}}, scene.v = VectorXd::Zero(2);
      scene.commands = {{0}, VectorXd::Zero(2)};
      scene.integrator = integrator;
      scene.step = scene.sample = step, scene.duration = 5;
      const SimulatedMotion motion = run(scene);
      double drift = 0;
      for (int k = 0; k < motion.samples(); ++k)
        drift = std::max(drift, std::abs(motion.energy(k) - motion.energy(0)));
      EXPECT_LT(motion.energy_error(), 20 * drift + 1e-9 * motion.energy_scale())
          << to_string(integrator) << " " << step << " " << drift;
    }
  }
}

// --- scenes whose energy is known in closed form: a scheme is off by what it takes or gives itself, and by nothing else ---

struct Scheme {
  Integrator integrator;
  int order;
  bool has_one_stage, keeps_quadratic;  // kinetic energies change by h f w exactly; energies of springs stay
};
const Scheme kSchemes[] = {{Integrator::kSemiImplicitEuler, 1, true, false},
                           {Integrator::kRungeKutta4, 4, false, false},
                           {Integrator::kImplicitMidpoint, 2, true, true},
                           {Integrator::kImplicitVelocity, 1, true, false},
                           {Integrator::kVariational, 2, true, true}};

class Account : public ::testing::TestWithParam<Scheme> {
 protected:
  static Scene scene_from(const std::string& text, double step) {
    Scene scene = read_scene_text(text, test::source_folder() + "/config/robots/(text)");
    scene.evaluation.route = Route::kInterpreter;
    scene.integrator = GetParam().integrator;
    const double finer = GetParam().order == 1 ? 40 : GetParam().order == 4 ? 2 : 1;  // where orders show
    scene.step = scene.sample = step / finer;
    return scene;
  }

  // What is off with h and with h / 2 falls as the order says, or is rounding.
  static void expect_order(double coarse, double fine, double scale, const std::string& what) {
    EXPECT_LE(fine, 1.4 * coarse / std::pow(2.0, GetParam().order) + 2e-12 * scale) << what << " " << coarse;
    EXPECT_LE(coarse, 0.1 * scale) << what;
  }
};

double energy_at(const SimulatedMotion& motion, int k) { return motion.energy(k) - motion.energy(0); }

struct Conservative {
  std::string name, text;
  double step;
  bool is_quadratic;
};
const Conservative kConservative[] = {
    {"spring",
     "robot { urdf block.urdf }\neffects { gravity off joint_springs { stiffness 400 } }\nstart { q 1 }\n"
     "simulation { duration 1 }",
     4e-3, true},
    {"fall",
     "robot { urdf block.urdf }\neffects { gravity { vector \"-9.81 0 0\" } }\nstart { q 2\nv 3 }\n"
     "simulation { duration 0.8 }",
     0.02, true},
    {"pendulum", "robot { urdf pendulum.urdf }\nstart { q 2 }\nsimulation { duration 1 }", 4e-3, false},
    {"double pendulum",
     "robot { urdf double_pendulum.urdf }\nstart { q \"0.5 -0.4\" }\nsimulation { duration 1 }", 4e-3, false},
    {"free body",
     "robot { urdf free_body.urdf\nbase floating }\neffects { gravity off }\n"
     "start { base { angular_velocity \"0.5 2 0.3\" } }\nsimulation { duration 1 }",
     4e-3, false},
};

// The account is off by the change of the energy, which is zero in truth.
TEST_P(Account, OfWhatKeepsItsEnergyIsOffByWhatTheStepsChange) {
  for (const Conservative& known : kConservative) {
    double off[2];
    for (int i = 0; i < 2; ++i) {
      const SimulatedMotion motion = simulate(scene_from(known.text, known.step / (1 + i)));
      EXPECT_EQ(motion.trouble + motion.warning, "") << known.name;
      double changed = 0;
      for (int k = 0; k < motion.samples(); ++k) changed = std::max(changed, std::abs(energy_at(motion, k)));
      off[i] = motion.energy_error();
      EXPECT_NEAR(off[i], changed, 1e-12 * motion.energy_scale()) << known.name;
      if (known.is_quadratic && GetParam().keeps_quadratic) {
        EXPECT_LT(off[i], 1e-11 * motion.energy_scale()) << known.name;
      }
      if (i == 1) expect_order(off[0], off[1], motion.energy_scale(), known.name);
    }
  }
}

// Of a block of 1 kg: the unstored work up to t.
struct Lossy {
  std::string name, flow, text;
  double step;
  double (*work)(double t);
  bool has_potential;
};
double damped_spring(double t) {  // q'' + 2 q' + 400 q = 0
  const double w = std::sqrt(399.0), c = std::cos(w * t), s = std::sin(w * t), e = std::exp(-t);
  const double q = e * (c + s / w), v = -e * (400 / w) * s;
  return v * v / 2 + 200 * q * q - 200;
}
const std::string kBlock = "robot { urdf block.urdf }\n", kOneSecond = "simulation { duration 1 }";
const Lossy kLossy[] = {
    {"damped spring", "joint damping",
     kBlock +
         "effects { gravity off joint_springs { stiffness 400 }\njoint_damping { coefficient 2 } }\n"
         "start { q 1 }\n" +
         kOneSecond,
     4e-3, damped_spring, true},
    {"sliding block", "joint damping",
     kBlock + "effects { gravity off joint_damping { coefficient 3 } }\nstart { v 2 }\n" + kOneSecond, 0.02,
     [](double t) { return 2 * (std::exp(-6 * t) - 1); }, false},
    {"drag", "drag",
     kBlock +
         "effects { gravity off drag { density 1\nsmoothing 1e-6\nbody { frames block\narea 2 } } }\n"
         "start { v 2 }\n" +
         kOneSecond,
     0.02, [](double t) { return 2 / ((1 + 2 * t) * (1 + 2 * t)) - 2; }, false},
    {"pushed block", "motors", kBlock + "effects { gravity off }\n" + kOneSecond, 0.02,
     [](double t) { return 12.5 * t * t; }, false},
    {"ramp", "motors", kBlock + "effects { gravity off }\n" + kOneSecond, 0.02,
     [](double t) { return 12.5 * t * t * t * t; }, false},
};

TEST_P(Account, OfWhatIsTakenAndGivenHasTheOrderOfTheScheme) {
  for (const Lossy& known : kLossy) {
    double off[2], off_work[2], off_energy[2];
    for (int i = 0; i < 2; ++i) {
      Scene scene = scene_from(known.text, known.step / (1 + i));
      if (known.name == "pushed block") scene.commands = {{0}, VectorXd::Constant(1, 5)};
      if (known.name == "ramp") scene.commands = {{0, 2}, Eigen::RowVector2d(0, 20)};
      const SimulatedMotion motion = simulate(scene);
      EXPECT_EQ(motion.trouble + motion.warning, "") << known.name;
      const int last = motion.samples() - 1;
      const double exact = known.work(motion.t.back());
      off[i] = motion.energy_error(), off_energy[i] = std::abs(energy_at(motion, last) - exact);
      off_work[i] = HUGE_VAL;
      for (const EnergyFlow& flow : motion.flows) {
        if (flow.name == known.flow) off_work[i] = std::abs(flow.work.back() - exact);
      }
      const double scale = motion.energy_scale();
      if (GetParam().has_one_stage && (!known.has_potential || GetParam().keeps_quadratic)) {
        EXPECT_LT(off[i], 1e-12 * scale) << known.name;
      }
      if (i == 0) continue;
      expect_order(off[0], off[1], scale, known.name);
      expect_order(off_work[0], off_work[1], scale, known.name + ", work");
      expect_order(off_energy[0], off_energy[1], scale, known.name + ", energy");
    }
  }
}

// A ball that gives back what it takes: its ground has done no work when it is in the air again.
TEST_P(Account, OfAnElasticBallHasNoWorkOfItsGround) {
  Scene scene = shipped("bouncing_ball");
  scene.integrator = GetParam().integrator;
  scene.robot.effects.contacts[0].dissipation = 0;
  scene.duration = 0.9, scene.sample = scene.step;
  const SimulatedMotion motion = run(scene);
  bool touched = false;
  for (const EnergyFlow& flow : motion.flows) {
    if (flow.name != "contacts") continue;
    touched = *std::min_element(flow.work.begin(), flow.work.end()) < -1;
    EXPECT_NEAR(flow.work.back(), 0, 1e-12);
  }
  EXPECT_TRUE(touched);
  double changed = 0;
  for (int k = 0; k < motion.samples(); ++k) changed = std::max(changed, std::abs(energy_at(motion, k)));
  EXPECT_NEAR(motion.energy_error(), changed, 1e-9 * changed + 1e-12);
}

// Of a step of one radian of its oscillation, damped or not.
TEST(AccountOfLongSteps, IsThatOfTheSchemeItself) {
  for (const Integrator integrator : {Integrator::kImplicitMidpoint, Integrator::kVariational}) {
    for (const char* damping : {"0", "5"}) {
      Scene scene = read_scene_text(
          kBlock + "effects { gravity off joint_springs { stiffness 1e4 }\njoint_damping { coefficient " +
              damping + " } }\nstart { q 1 }\nsimulation { duration 6 step 0.01 sample 0.01 }",
          test::source_folder() + "/config/robots/(text)");
      scene.integrator = integrator;
      scene.evaluation.route = Route::kInterpreter;
      const SimulatedMotion motion = run(scene);
      EXPECT_LT(motion.energy_error(), 1e-10 * motion.energy_scale()) << to_string(integrator) << damping;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Each, Account, ::testing::ValuesIn(kSchemes), [](const auto& scheme) {
  std::string name = to_string(scheme.param.integrator);
  std::erase(name, '-');
  return name;
});

}  // namespace
}  // namespace dyntape::energy_balance_test
