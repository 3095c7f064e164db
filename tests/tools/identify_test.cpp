// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape identify: rank and names, the excitation's files, estimates from a file of samples.
#include <gtest/gtest.h>

#include <filesystem>

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/identification/base_parameters.h>
#include <dyntape/interface/io/csv.h>

#include "run.h"

namespace identify_test {
namespace {

using dyntape::test::config;
using dyntape::test::run_dyntape;
using dyntape::test::Scratch;

TEST(Identify, PrintsRankAndNames) {
  const auto run = run_dyntape({"identify", config("robots/ur5.urdf")});
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_NE(run.out.find("36 base parameters of 60"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("Izz1 + "), std::string::npos);
  const auto wider = run_dyntape({"identify", config("robots/ur5.urdf"), "--friction"});
  EXPECT_NE(wider.out.find("48 base parameters of 72"), std::string::npos) << wider.out;
}

// Fingers that move as one: what each would tell by itself is told as a sum.
TEST(Identify, KnowsWhatFollows) {
  const std::string panda = config("robots/panda.urdf");
  const auto both = run_dyntape({"identify", panda}), one = run_dyntape({"identify", panda, "--mimic"});
  EXPECT_NE(both.out.find("51 base parameters of 90"), std::string::npos) << both.out;
  ASSERT_EQ(one.status, 0) << one.err;
  EXPECT_EQ(one.out.find("51 base parameters"), std::string::npos) << one.out;
  const auto excite = run_dyntape({"identify", panda, "--mimic", "--excite"});
  EXPECT_EQ(excite.status, 1);
  EXPECT_NE(excite.err.find("every joint moves by itself"), std::string::npos) << excite.err;
}

TEST(Identify, WritesTheMotionThatTellsMost) {
  const Scratch scratch;
  const auto run = run_dyntape({"identify", config("robots/arm_2r.urdf"), "--excite", "--iterations", "15",
                                "--output", scratch / "out"});
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_NE(run.out.find("errors on average 0."), std::string::npos) << run.out;
  const auto motion = dyntape::io::read_csv(scratch / "out/excitation.csv");
  EXPECT_EQ(motion.rows(), 500);
  EXPECT_EQ(motion.cols(), 1 + 3 * 2);
  EXPECT_TRUE(std::filesystem::exists(scratch / "out/excitation.svg"));
}

TEST(Identify, EstimatesFromAFileOfSamples) {
  const Scratch scratch;
  const auto arm = dyntape::dynamics::load_urdf(config("robots/arm_2r.urdf"));
  const auto samples = dyntape::random_samples(arm, 50, 4);
  dyntape::io::CsvTable table({"q0", "q1", "v0", "v1", "a0", "a1", "tau0", "tau1"});
  dyntape::dynamics::Data<double> data(arm);
  for (int i = 0; i < 50; ++i) {
    const Eigen::VectorXd tau =
        dyntape::dynamics::rnea(arm, data, samples.q.col(i), samples.v.col(i), samples.a.col(i));
    table.append({samples.q(0, i), samples.q(1, i), samples.v(0, i), samples.v(1, i), samples.a(0, i),
                  samples.a(1, i), tau[0], tau[1]});
  }
  dyntape::io::write_csv(scratch / "samples.csv", table);
  const auto run = run_dyntape({"identify", config("robots/arm_2r.urdf"), "--data", scratch / "samples.csv",
                                "--output", scratch / "out"});
  ASSERT_EQ(run.status, 0) << run.err;
  const auto found = dyntape::io::read_csv(scratch / "out/base_parameters.csv");
  for (int k = 0; k < found.rows(); ++k) EXPECT_NEAR(found(k, 0), found(k, 2), 1e-9);
}

// Friction is found exactly with the width that it has, and not with another.
TEST(Identify, FrictionHasAWidth) {
  const Scratch scratch;
  constexpr double kFriction = 0.7, kWidth = 0.5;
  auto arm = dyntape::dynamics::load_urdf(config("robots/arm_2r.urdf"));
  const auto samples = dyntape::random_samples(arm, 60, 4);
  dyntape::io::CsvTable table({"q0", "q1", "v0", "v1", "a0", "a1", "tau0", "tau1"});
  dyntape::dynamics::Data<double> data(arm);
  for (int i = 0; i < 60; ++i) {
    Eigen::VectorXd tau =
        dyntape::dynamics::rnea(arm, data, samples.q.col(i), samples.v.col(i), samples.a.col(i));
    tau += kFriction * (samples.v.col(i).array() / kWidth).tanh().matrix();
    table.append({samples.q(0, i), samples.q(1, i), samples.v(0, i), samples.v(1, i), samples.a(0, i),
                  samples.a(1, i), tau[0], tau[1]});
  }
  dyntape::io::write_csv(scratch / "samples.csv", table);
  const auto coulomb = [&](const std::string& width) {
    const auto run = run_dyntape({"identify", config("robots/arm_2r.urdf"), "--friction", "--friction-width",
                                  width, "--data", scratch / "samples.csv", "--output", scratch / width});
    EXPECT_EQ(run.status, 0) << run.err;
    const auto found = dyntape::io::read_csv(scratch / width + "/base_parameters.csv");
    return std::pair(found(found.rows() - 2, 0), found(found.rows() - 1, 0));
  };
  const auto [first, second] = coulomb("0.5");
  EXPECT_NEAR(first, kFriction, 1e-9);
  EXPECT_NEAR(second, kFriction, 1e-9);
  EXPECT_GT(std::abs(coulomb("0.01").first - kFriction), 1e-3);
  for (const char* wrong : {"0", "-1", "nan", "x"})
    EXPECT_NE(run_dyntape({"identify", config("robots/arm_2r.urdf"), "--friction-width", wrong}).status, 0);
}

// What solve writes needs no editing, and what does not belong is said once.
TEST(Identify, EstimatesFromTheMotionThatSolveWrites) {
  const Scratch scratch;
  ASSERT_EQ(
      run_dyntape({"solve", config("tasks/two_link_arm_reaching.info"), "--output", scratch / "out"}).status,
      0);
  const std::string robot = config("robots/arm_2r.urdf"), motion = scratch / "out/trajectory.csv";
  const auto refused = run_dyntape({"identify", robot, "--data", motion});
  EXPECT_EQ(refused.status, 1);
  EXPECT_NE(refused.err.find("column \"t\" is not an input"), std::string::npos) << refused.err;
  EXPECT_NE(refused.err.find("--pass-over"), std::string::npos) << refused.err;
  const auto run =
      run_dyntape({"identify", robot, "--data", motion, "--pass-over", "--output", scratch / "found"});
  ASSERT_EQ(run.status, 0) << run.err;
  const auto found = dyntape::io::read_csv(scratch / "found/base_parameters.csv");
  for (int k = 0; k < found.rows(); ++k) EXPECT_NEAR(found(k, 0), found(k, 2), 1e-6);
}

// A cart-pole's pivot is not driven: solve has no column for its torque.
TEST(Identify, TakesZerosForTorquesOfJointsThatAreNotDriven) {
  const Scratch scratch;
  ASSERT_EQ(
      run_dyntape({"solve", config("tasks/cart_pole_swing_up.info"), "--output", scratch / "out"}).status, 0);
  const std::string robot = config("robots/cart_pole.urdf"), motion = scratch / "out/trajectory.csv";
  const auto refused = run_dyntape({"identify", robot, "--data", motion, "--pass-over"});
  EXPECT_EQ(refused.status, 1);
  EXPECT_NE(refused.err.find("no column \"tau.pivot\""), std::string::npos) << refused.err;
  const auto run = run_dyntape({"identify", robot, "--data", motion, "--pass-over", "--fill-zero"});
  EXPECT_EQ(run.status, 0) << run.err;
}

TEST(Identify, RefusesWhatItCannotDrive) {
  const auto run = run_dyntape({"identify", config("robots/solo12.urdf"), "--base", "floating", "--excite"});
  EXPECT_EQ(run.status, 1);
  EXPECT_NE(run.err.find("one degree of freedom"), std::string::npos) << run.err;
}

}  // namespace

}  // namespace identify_test
