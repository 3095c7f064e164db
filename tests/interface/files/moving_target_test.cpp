// SPDX-License-Identifier: BSD-3-Clause
//
// Targets that move: circles and tables as terms of task files, and a controller that follows one.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <dyntape/interface/files/moving_target.h>
#include <dyntape/interface/files/task/task.h>
#include <dyntape/interface/io/csv.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/motion/robot_terms.h>
#include <dyntape/interface/run/mpc/mpc_task.h>
#include "interface/files/task/task_text.h"
#include "source_folder.h"

namespace dyntape::moving_target_test {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

TEST(MovingTarget, ACircleIsGoneRoundOnceInAPeriod) {
  const Vector3d center(0.4, 0.1, 0.5), normal(0.3, -0.2, 2);
  const TargetOverTime at = circle(center, normal, 0.25, 4);
  for (int k = 0; k < 16; ++k) {
    const Vector3d off = at(0.25 * k) - center, next = at(0.25 * k + 1) - center;
    EXPECT_NEAR(off.norm(), 0.25, 1e-15);
    EXPECT_NEAR(off.dot(normal), 0, 1e-15);
    EXPECT_NEAR(off.dot(next), 0, 1e-15);       // a quarter of the way
    EXPECT_GT(off.cross(next).dot(normal), 0);  // by the right hand about the normal
    EXPECT_LT((at(0.25 * k + 4) - at(0.25 * k)).norm(), 1e-15);
  }
  EXPECT_GT((at(0) - center).x(), 0.24);
}

class MovingTargets : public test::TaskText {
 protected:
  MovingTargets() : TaskText("moving-targets") { load_alone("arm_reaching"); }
  void load_alone(const std::string& task) {
    load(task);
    text_ = text_.substr(0, text_.find("expected"));
  }
  void term(const std::string& keys) { text_ += "\nterms {\n term mine {\n" + keys + "\n }\n}\n"; }
  std::string table(const std::vector<std::string>& columns, const std::vector<std::vector<double>>& rows) {
    io::CsvTable table(columns);
    for (const auto& row : rows) table.append(row);
    write_csv((folder_ / "path.csv").string(), table);
    return "path.csv";
  }
  VectorXd value(const Task& task, double t) {
    Stage<double> s = task.problem.first_guess(0.3);
    for (Eigen::Index i = 0; i < s.x.size(); ++i) s.x[i] += 0.1 * std::sin(double(i));
    const Stage<double> now = task.problem.stage(t, s.x, s.a, s.u);
    for (const Term& term : task.problem.terms) {
      if (term.name == "mine") return term.function(now);
    }
    ADD_FAILURE() << "no term";
    return {};
  }
};

// At every time the term is that of a target which stands where the moving one then is.
TEST_F(MovingTargets, TermsAreThoseOfTheTargetAtThatTime) {
  const std::string bare = text_;
  const auto both = [&](const std::string& keys, const std::string& moves,
                        const std::function<std::string(double)>& target) {
    for (const double t : {0., 0.3, 0.75, 1.1}) {
      text_ = bare, term(keys + moves);
      const VectorXd moving = value(read(), t);
      text_ = bare, term(keys + "target \"" + target(t) + "\"\n");
      EXPECT_LT((moving - value(read(), t)).norm(), 1e-12) << keys << t;
    }
  };
  const auto text = [](const Vector3d& p) {
    return io::shortest(p[0]) + " " + io::shortest(p[1]) + " " + io::shortest(p[2]);
  };
  const Vector3d center(0.4, 0.2, 0.5);
  const std::string round = "target \"0.4 0.2 0.5\"\nmoves circle\nradius 0.2\nperiod 3\nnormal \"0 1 1\"\n";
  const TargetOverTime on_circle = circle(center, {0, 1, 1}, 0.2, 3);
  both("type frame_position\nframe panda_hand\nrole equality\n", round,
       [&](double t) { return text(on_circle(t)); });
  both("type com\nweight 3\n", round, [&](double t) { return text(on_circle(t)); });
  both("type frame_position\nframe panda_hand\nentries \"z x\"\n",
       "moves file\nfile " + table({"t", "x", "y", "z"}, {{0.2, 1, 2, 3}, {1, 2, 2, 1}}) + "\n",
       [&](double t) {
         const double share = std::clamp((t - 0.2) / 0.8, 0., 1.);
         return text(Vector3d(1 + share, 2, 3 - 2 * share));
       });
  both("type frame_orientation\nframe panda_hand\n",
       "moves file\nfile " + table({"t", "roll", "pitch", "yaw"}, {{0, 3, 0, 0}, {1, 3, 0, 1}}) + "\n",
       [&](double t) {
         const Eigen::Matrix3d from = rotation_of(3, 0, 0), to = rotation_of(3, 0, 1);
         const Eigen::AngleAxisd turn(Eigen::Matrix3d(from.transpose() * to));
         const Eigen::Matrix3d now =
             from * Eigen::AngleAxisd(std::min(t, 1.) * turn.angle(), turn.axis()).toRotationMatrix();
         return text(
             {std::atan2(now(2, 1), now(2, 2)), -std::asin(now(2, 0)), std::atan2(now(1, 0), now(0, 0))});
       });
}

// The plant's time goes on while the horizon's begins anew.
TEST_F(MovingTargets, AControllerFollowsACircle) {
  load_alone("block_move");
  replace("control 1", "control 1e-6");
  term(
      "type frame_position\nframe block\nentries x\nmoves circle\nradius 0.3\nperiod 3\nnormal \"0 1 0\"\n"
      "target \"0.1 0 0\"\nweight 1e3");
  text_ += "\nmpc {\n duration 3\n period 0.02\n}\n";
  const ControlReport report = control_task(read());
  const Trajectory& m = report.loop.motion;
  double worst = 0;
  for (int p = 0; p < m.points(); ++p) {
    const double wanted = 0.1 + 0.3 * std::cos(2 * std::acos(-1.0) * m.t[p] / 3);
    if (m.t[p] > 0.7) worst = std::max(worst, std::abs(m.x(0, p) - wanted));
  }
  EXPECT_LT(worst, 5e-3);
  EXPECT_GT(m.t[m.points() - 1], 2.9);
}

// The shipped one: no goal, joints that stand still by symmetry at first, a push on the way.
TEST_F(MovingTargets, AnArmFollowsACircle) {
  const Task task = read_task(test::source_folder() + "/config/control/arm_follows_circle.info");
  const ControlReport report = control_task(task);
  EXPECT_EQ(report.loop.steps.front().status, SolveStatus::kSolved);
  const Trajectory& m = report.loop.motion;
  ASSERT_GT(m.t[m.points() - 1], 5.9);
  const TargetOverTime on_circle = circle({0.5, 0, 0.5}, {1, 0, 0}, 0.1, 3);
  const auto& model = task.scene.model;
  dynamics::Data<double> data(model);
  double worst = 0;
  for (int p = 0; p < m.points(); ++p) {
    if (m.t[p] < 1 || (m.t[p] > 2 && m.t[p] < 2.6)) continue;
    dynamics::forward_kinematics<double>(model, data, VectorXd(m.x.col(p).head(model.nq)));
    const Vector3d hand = dynamics::frame_placement(model, data, model.frame_index("panda_hand")).p;
    worst = std::max(worst, (hand - on_circle(m.t[p])).norm());
  }
  EXPECT_LT(worst, 5e-3);
}

TEST_F(MovingTargets, WrongOnesAreNamed) {
  const std::string bare = text_;
  const auto says = [&](const std::string& keys, const std::string& part) {
    text_ = bare;
    term(keys);
    EXPECT_NE(message().find(part), std::string::npos) << part << " not in: " << message();
  };
  const std::string hand = "type frame_position\nframe panda_hand\n",
                    turn = "type frame_orientation\nframe panda_hand\n";
  says(hand + "moves circle", "'terms.term.period' is missing");
  says(hand + "moves circle\nperiod 0", "'terms.term.period'");
  says(hand + "moves circle\nperiod 1\nnormal \"0 0 0\"", "'normal' is zero");
  says(hand + "moves round", "cannot be 'round'");
  says(hand + "radius 1", "unknown key 'radius'");
  says(turn + "moves circle\nperiod 1", "an orientation does not move on a circle");
  says(hand + "moves file", "'terms.term.file' is missing");
  says(hand + "moves file\nfile nowhere.csv", "nowhere.csv");
  says(hand + "moves file\nfile " + table({"t", "x", "y"}, {{0, 1, 2}}), "'z'");
  says(hand + "moves file\nfile " + table({"t", "x", "y", "z"}, {{0, 1, 2, 3}, {0, 1, 2, 3}}),
       "expected more than 0 s");
  says("type joint_velocity\nmoves circle", "unknown key 'moves'");
  load_alone("block_move_free_time");
  term("type frame_position\nframe block\nmoves circle\nperiod 1");
  EXPECT_NE(message().find("expected no phases, a given duration"), std::string::npos) << message();
}

}  // namespace
}  // namespace dyntape::moving_target_test
