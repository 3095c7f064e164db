// SPDX-License-Identifier: BSD-3-Clause
//
// Sweeps: each row is what simulate makes of a scene with these numbers, whoever computes it and beside whom; what is
// drawn is a function of the seed; a folder goes on where it was left.
#include <gtest/gtest.h>

#include <boost/math/special_functions/jacobi_elliptic.hpp>
#include <cmath>
#include <set>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/files/sweep/random_numbers.h>

#include "swept.h"

namespace dyntape::sweep_test {
namespace {

using Eigen::VectorXd;

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
  const SceneSweep sweep =
      sweep_of(pendulum_sweep(value("parameter start.q\nfrom -1\nto 3") +
                                  value("parameter start.v\nspread normal\nmean 2\ndeviation 0.5\nfrom 1") +
                                  value("parameter robot.mass:rod\nspread log-uniform\nfrom 0.1\nto 10"),
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
  const SceneSweep sweep =
      sweep_of(pendulum_sweep(value("parameter start.q\nspread grid\nfrom 0\nto 1\nsteps 3") +
                                  value("parameter start.v\nspread grid\nfrom 5\nto 6\nsteps 2") +
                                  value("parameter robot.mass:rod\nfrom 1\nto 2"),
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
  // By the interpreter, whose bits those of compiled lanes are (below).
  for (const char* integrator : {"runge-kutta-4", "implicit-midpoint"}) {
    for (const char* file : {"config/sweeps/quadruped_dropped.info", "tests/bench/quadruped_sweep.info"}) {
      SceneSweep drop = shipped_sweep(file);
      drop.scene.integrator = integrator[0] == 'r' ? Integrator::kRungeKutta4 : Integrator::kImplicitMidpoint;
      drop.scene.duration = 0.04;
      drop.scene.base.position.z() = 0.25;
      drop.evaluation.route = Route::kInterpreter;
      expect_rows_of_scenes(drop, 3, 3);
    }
  }
}

// Impacts, contacts that close, and stops, with masses that vary; by explicit and implicit steps.
TEST(Sweeps, RigidContactsAndStopsMoveAsInTheirScenes) {
  for (const char* integrator : {"runge-kutta-4", "semi-implicit-euler", "implicit-velocity"}) {
    const std::string end =
        std::string("simulation\n{\nduration 0.6\nstep 2e-3\nintegrator ") + integrator + "\n}\n";
    const MadeScene box(
        "robot\n{\nurdf \"" + kSource + "/config/robots/box.urdf\"\nbase floating\n}\n" +
        "constraints\n{\ncontacts\n{\ncontact\n{\nframes \"corner_1 corner_2 corner_3 corner_4\"\n" +
        "friction 0.5\nrestitution 0.3\n}\n}\n}\nstart\n{\nbase\n{\nposition \"0 0 0.2\"\n" +
        "velocity \"0.5 0 0\"\nangular_velocity \"0 1 2\"\n}\n}\n" + end);
    expect_rows_of_scenes(
        box.sweep("samples 3\n" +
                  block("vary", value("parameter start.base.position\naxis z\nfrom 0.2\nto 0.4") +
                                    value("parameter robot.mass:box\nfrom 1\nto 3"))),
        0, 3);
    const MadeScene cart(
        "robot\n{\nurdf \"" + kSource + "/config/robots/cart_pole.urdf\"\n}\n" +
        "constraints\n{\nlimits\n{\nrestitution 0.5\n}\n}\nstart\n{\nq \"1.8 0.3\"\nv \"2 0\"\n}\n" + end);
    expect_rows_of_scenes(
        cart.sweep("samples 3\n" + block("vary", value("parameter robot.mass:pole\nfrom 0.1\nto 1"))), 0, 3);
  }
}

TEST(Sweeps, ASampleThatStartsBelowItsGroundFailsAlone) {
  const MadeScene made("robot\n{\nurdf \"" + kSource + "/config/robots/ball.urdf\"\nbase floating\n}\n" +
                       "constraints\n{\ncontacts\n{\ncontact\n{\nframes ball\nradius 0.1\n}\n}\n}\n" +
                       "simulation\n{\nduration 0.1\n}\n");
  const SceneSweep sweep = made.sweep(
      block("vary", value("parameter start.base.position\naxis z\nspread grid\nfrom 0\nto 0.4\nsteps 3")));
  const ComputedRows rows = computed(sweep, 0, 3);
  const io::CsvTable table = table_of(sweep, rows);
  EXPECT_EQ(table(0, table.index("ok")), 0);
  EXPECT_EQ(table(1, table.index("ok")), 1);
  EXPECT_EQ(table(2, table.index("ok")), 1);
  ASSERT_EQ(rows.failures.size(), 1u);
  EXPECT_NE(rows.failures[0].find("the contact at 'ball' is 0.1 m below its ground"), std::string::npos)
      << rows.failures[0];
}

TEST(Sweeps, RefuseLoops) {
  try {
    sweep_of("scene ../scenes/four_bar.info\n" + block("vary", value("parameter start.q\nfrom 0\nto 1")));
    FAIL() << "loops are swept";
  } catch (const FileError& e) {
    EXPECT_NE(std::string(e.what()).find("'../scenes/four_bar.info' has loops, which only simulate knows"),
              std::string::npos)
        << e.what();
  }
}

TEST(Sweeps, ThreadsLanesAndNeighboursChangeNoBit) {
  SceneSweep sweep = shipped_sweep("tests/bench/quadruped_sweep.info");
  sweep.scene.duration = 0.05;
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
  const MadeScene made("robot\n{\nurdf \"" + kSource + "/config/robots/block.urdf\"\n}\n" +
                       "effects\n{\njoint_springs\n{\nstiffness 1\n}\n}\nstart\n{\nq 1\n}\n" +
                       "simulation\n{\nduration 8\nstep 0.01\nintegrator semi-implicit-euler\n}\n");
  const std::string spread = "parameter effects.joint_springs\nspread grid\nfrom 1e4\nto 1e5\nsteps 19";
  const SceneSweep sweep = made.sweep(block("vary", value(spread)));
  const ComputedRows rows = computed(sweep, 0, 19);
  const io::CsvTable table = table_of(sweep, rows);
  // omega^2 = k / 1 kg, stable below (2 / h)^2 = 4e4.
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
  EXPECT_LT(table(18, table.index("t")), 8);
  EXPECT_NE(rows.failures.back().find("sample 18: ended at t = "), std::string::npos) << rows.failures.back();
  EXPECT_NE(rows.failures.back().find("oscillates at"), std::string::npos) << rows.failures.back();
}

TEST(Sweeps, FoldersGoOnRefuseAndForgive) {
  SceneSweep sweep = sweep_of(pendulum_sweep(value("parameter start.q\nfrom 0\nto 1"), "samples 100\n"));
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
  EXPECT_NE(identity_of(sweep, "0.0.1 of other sources"), identity_of(sweep));  // nor of another program
  SceneSweep same = sweep;
  same.threads = 1, same.evaluation.lanes = Lanes::kNative;
  EXPECT_EQ(identity_of(same), identity_of(sweep));
}

}  // namespace
}  // namespace dyntape::sweep_test
