// SPDX-License-Identifier: BSD-3-Clause
//
// A row is ok where simulate trusts the motion of its scene, for the same reasons: energy that steps lose or find, forces that are too
// stiff, by every scheme, with commands that stay and that change, of mechanisms one by one.
#include <dyntape/interface/run/simulate/simulate.h>

#include "swept.h"

namespace dyntape::sweep_judgement_test {
namespace {

struct Judged {
  int rows = 0, failed = 0;
};

void expect_the_same_verdicts(const SceneSweep& sweep, Judged& all) {
  const ComputedRows rows = computed(sweep, 0, sweep.rows());
  const io::CsvTable table = table_of(sweep, rows);
  std::size_t next = 0;
  for (long row = 0; row < sweep.rows(); ++row) {
    const bool ok = table(int(row), table.index("ok")) == 1;
    std::string reason;
    try {
      const SimulatedMotion motion = simulate(scene_of(sweep, row));
      reason = motion.trouble.empty() ? motion.warning : motion.trouble;
    } catch (const ArgumentError& e) {  // at the start already
      reason = e.what();
    }
    const std::string where = sweep.scene.effective + "row " + std::to_string(row) + ": " + reason;
    EXPECT_EQ(ok, reason.empty()) << where;
    if (!ok && next < rows.failures.size()) {
      const std::string said = rows.failures[next++];
      // The sentence is the same but for figures.
      const std::string kind =
          reason.substr(reason.find(": ") == reason.npos ? 0 : reason.rfind(": ") + 2, 20);
      EXPECT_NE(said.find(kind), std::string::npos) << said << "\n" << where;
    }
    ++all.rows, all.failed += !ok;
  }
}

std::string scene_text(const std::string& robot, const std::string& rest, const std::string& integrator,
                       double step) {
  return "robot\n{\nurdf \"" + kSource + "/config/robots/" + robot + ".urdf\"\n}\n" + rest +
         "simulation\n{\nduration 3\nstep " + std::to_string(step) + "\nintegrator " + integrator + "\n}\n";
}

TEST(Sweeps, JudgeAsSimulateDoes) {
  Judged all;
  const std::string from_rest =
      block("vary", value("parameter start.q\nspread grid\nfrom 0.5\nto 2.5\nsteps 3"));
  for (const char* robot : {"pendulum", "double_pendulum"}) {
    for (const char* integrator : {"runge-kutta-4", "semi-implicit-euler", "implicit-midpoint",
                                   "implicit-velocity", "variational", "adaptive"}) {
      for (double step : {0.005, 0.05, 0.2}) {
        const MadeScene made(scene_text(robot, "start\n{\nq 1\n}\n", integrator, step));
        expect_the_same_verdicts(made.sweep(from_rest), all);
      }
    }
  }
  EXPECT_GT(all.failed, all.rows / 10);
  EXPECT_LT(all.failed, all.rows * 9 / 10);
  std::printf("%d of %d rows are not ok\n", all.failed, all.rows);
}

TEST(Sweeps, JudgeCommandsThatChangeAsSimulateDoes) {
  Judged all;
  const std::string table = sweep_cache().path() + "/torques.csv";
  std::ofstream(table) << "t,tau.hinge\n0,0\n1,3\n2,-3\n3,2\n";
  for (const char* integrator : {"runge-kutta-4", "implicit-velocity", "adaptive"}) {
    for (double step : {0.01, 0.25}) {
      const MadeScene made(
          scene_text("pendulum", "commands\n{\nfile \"" + table + "\"\n}\n", integrator, step));
      expect_the_same_verdicts(
          made.sweep(block("vary", value("parameter start.q\nspread grid\nfrom -1\nto 1\nsteps 3"))), all);
    }
  }
  EXPECT_GT(all.failed, 0);
}

// Friction that is felt where joints have become slow alone.
TEST(Sweeps, JudgeStiffnessOnTheWay) {
  Judged all;
  const MadeScene made(scene_text("double_pendulum",
                                  "effects\n{\njoint_friction\n{\ntorque 0.5\nsmoothing "
                                  "0.001\n}\njoint_damping 0.05\n}\nstart\n{\nq 1\nv 3\n}\n",
                                  "runge-kutta-4", 0.01));
  expect_the_same_verdicts(
      made.sweep(block("vary",
                       value("parameter effects.joint_friction.torque\nspread grid\nfrom 0\nto 2\nsteps 6"))),
      all);
}

// Contacts that steps pass by too much.
TEST(Sweeps, JudgeRigidContactsAsSimulateDoes) {
  Judged all;
  for (const char* integrator : {"runge-kutta-4", "semi-implicit-euler", "implicit-midpoint"}) {
    for (double step : {0.002, 0.02}) {
      const MadeScene made(scene_text(
          "double_pendulum",
          "constraints\n{\ncontacts\n{\ncontact\n{\nframes tip\noffset -1.8\nfriction 0.2\n}\n}\n}\n",
          integrator, step));
      expect_the_same_verdicts(
          made.sweep(block("vary", value("parameter start.q\nspread grid\nfrom 0.5\nto 2.5\nsteps 3"))), all);
    }
  }
  EXPECT_GT(all.failed, 0);
  EXPECT_LT(all.failed, all.rows);
}

}  // namespace
}  // namespace dyntape::sweep_judgement_test
