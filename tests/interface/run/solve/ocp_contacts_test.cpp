// SPDX-License-Identifier: BSD-3-Clause
//
// Held contacts and tasks of robots that float.  Accelerations and forces are held against constrained_dynamics(), which
// knows no optimal control; solved motions, against where their feet are and what their forces may be.
#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>
#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/dynamics/contact/constraints.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/io/csv.h>
#include <dyntape/interface/motion/robot_configuration.h>
#include <dyntape/interface/run/solve/pictures.h>
#include <dyntape/interface/run/solve/solve.h>
#include "dynamics/robot_files.h"
#include "interface/files/task/task_text.h"

namespace dyntape::ocp_contacts_test {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using Eigen::VectorXd;

const std::vector<std::string> kFeet = {"FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"};

const Term& term_of(const Problem& problem, const std::string& name) {
  for (const Term& term : problem.terms) {
    if (term.name == name) return term;
  }
  throw ArgumentError("no term " + name);
}

// The forces of rigid contacts, given as controls, make the motion of rigid contacts.
TEST(HeldContacts, AccelerationsAndForcesAreThoseOfRigidContacts) {
  using dynamics::ConstraintData;
  const RobotScene scene{
      dynamics::load_urdf(dynamics::robot_file("solo12"), {.base = dynamics::Base::kFloating}), {}, {}};
  const auto& model = scene.model;
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> uniform(-0.3, 0.3);
  for (int trial = 0; trial < 5; ++trial) {
    VectorXd d(model.nv), v(model.nv), tau = VectorXd::Zero(model.nv);
    for (double& x : d) x = uniform(random);
    for (double& x : v) x = uniform(random);
    for (int i = 6; i < model.nv; ++i) tau[i] = uniform(random);
    const VectorXd knees =
        (VectorXd(18) << VectorXd::Zero(6), 0, 0.8, -1.6, 0, 0.8, -1.6, 0, -0.8, 1.6, 0, -0.8, 1.6)
            .finished();
    const VectorXd q = dynamics::integrate<double>(model, dynamics::neutral(model), knees + d);
    dynamics::Data<double> data(model);
    dynamics::forward_kinematics<double>(model, data, q);
    std::vector<dynamics::Constraint<double>> list;
    RobotProblemOptions options;
    std::vector<Eigen::Matrix3d> axes;
    for (const std::string& foot : kFeet) {
      const int frame = model.frame_index(foot);
      const auto X = dynamics::frame_placement(model, data, frame);
      const Vector3d place = X.p + Vector3d(0.01, -0.02, 0.005);  // not quite where it is to be
      list.push_back(dynamics::point_constraint(model, frame, place));
      options.contacts.push_back({.frame = foot, .place = place});
      axes.push_back(X.R);
    }
    ConstraintData<double> feet(model, list);
    const VectorXd a = dynamics::constrained_dynamics<double>(model, data, feet, q, v, tau);
    VectorXd u(24), x(model.nq + model.nv);
    u.head(12) = tau.tail(12);
    for (int c = 0; c < 4; ++c)
      u.segment<3>(12 + 3 * c) = axes[std::size_t(c)] * feet.lambda.segment<3>(3 * c);
    x << q, v;
    for (DynamicsForm form : {DynamicsForm::kForward, DynamicsForm::kInverse}) {
      options.form = form;
      const Problem p = robot_problem(scene, options);
      const bool inverse = form == DynamicsForm::kInverse;
      const Stage<double> s = p.stage(0, x, inverse ? a : VectorXd(), u);
      EXPECT_LT((p.ode(s).tail(18) - a).norm(), 1e-9 * a.norm());
      for (const std::string& foot : kFeet)
        EXPECT_LT(term_of(p, foot + " holds").function(s).norm(), 1e-8) << foot;
      if (inverse) {
        EXPECT_LT(p.residual(s).norm(), 1e-9);
        continue;
      }
      Stage<double> other = s;
      other.u[14] += 1;  // another force, another motion
      EXPECT_GT(term_of(p, "FL_FOOT holds").function(other).norm(), 1e-2);
    }
  }
}

TEST(HeldContacts, ConesAndNames) {
  const RobotScene scene{
      dynamics::load_urdf(dynamics::robot_file("solo12"), {.base = dynamics::Base::kFloating}), {}, {}};
  RobotProblemOptions options;
  options.contacts = {{.frame = "FL_FOOT", .friction = 0.5}};
  const Problem p = robot_problem(scene, options);
  EXPECT_EQ(p.controls[12], "f.FL_FOOT.x");
  EXPECT_EQ(p.controls[14], "f.FL_FOOT.z");
  EXPECT_EQ(p.u.lower[14], 0);
  const auto room = [&](double x, double y, double z) {
    VectorXd u = VectorXd::Zero(15);
    u.tail(3) << x, y, z;
    return term_of(p, "FL_FOOT cone").function(p.stage(0, VectorXd::Zero(37), {}, u))[0];
  };
  // The tip is a thousandth of the weight below no force: 0.0245 N less sideways.
  const double weight = 2.50000279 * 9.81, z = 10 - 0.001 * weight / 0.5;
  EXPECT_NEAR(room(3, 4, z), 0, 1e-9);
  EXPECT_GT(room(3, 4, 10), 0);
  EXPECT_LT(room(3, 4.1, 10), 0);
  EXPECT_GT(room(0, 0, 0), 0);
  EXPECT_NEAR((room(0, 0, 1e-6) - room(0, 0, 0)) / 1e-6, 0.5 / weight, 1e-8);  // a slope at the tip too
  const auto message = [&](std::vector<HeldContact> contacts) {
    options.contacts = std::move(contacts);
    try {
      robot_problem(scene, options);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("nothing thrown");
  };
  EXPECT_NE(message({{.frame = "FL_FOT"}}).find("FL_FOOT"), std::string::npos);
  EXPECT_NE(message({{.frame = "FL_FOOT", .friction = 0}}).find("above zero"), std::string::npos);
  EXPECT_NE(message({{.frame = "FL_FOOT"}, {.frame = "FL_FOOT"}}).find("two held contacts"),
            std::string::npos);
}

class FloatingTasks : public test::TaskText {
 protected:
  FloatingTasks() : TaskText("floating") {}
};

TEST_F(FloatingTasks, TheQuadrotorFliesByBothMethods) {
  load("quadrotor_flight");
  double costs[2];
  for (NlpMethod method : {NlpMethod::kIpopt, NlpMethod::kRiccati}) {
    Task task = read();
    task.optimise.solver.method = method;
    SolveReport report = solve_task(task);
    ASSERT_TRUE(report.success()) << report.verdict();
    const Trajectory& motion = report.solution.motion;
    const VectorXd end = motion.x.col(motion.points() - 1);
    EXPECT_LT((end.head<3>() - Vector3d(3, 0.5, 1.5)).norm(), 1e-6);
    const Eigen::Vector4d yaw(0, 0, std::sin(2.61799387799149 / 2), std::cos(2.61799387799149 / 2));
    EXPECT_NEAR(std::abs(end.segment<4>(3).normalized().dot(yaw)), 1, 1e-12);
    EXPECT_LT(end.tail(6).norm(), 1e-7);
    EXPECT_GE(motion.u.minCoeff(), 0.1 - 1e-6);
    for (int k = 0; k < motion.points(); ++k) {
      const Vector3d p = motion.x.col(k).head<3>();
      EXPECT_GT(std::hypot(p.x() - 1.5, p.y() - 0.2), 0.4 - 1e-6) << "point " << k;
      EXPECT_NEAR(motion.x.col(k).segment<4>(3).norm(), 1, 1e-3) << "point " << k;
    }
    costs[method == NlpMethod::kRiccati] = report.solution.cost();
    write_results(task, report, (folder_ / "out").string());
    const io::CsvTable table = io::read_csv((folder_ / "out" / "trajectory.csv").string());
    EXPECT_EQ(table.column("q6").size(), std::size_t(motion.points()));
    EXPECT_EQ(table.column("f.front")[0], motion.u(0, 0));
    EXPECT_EQ(motion_player(task, motion).q.rows(), 7);
    // A panel a unit: position, orientation, two velocities, thrusts.
    const io::Plot plot = trajectory_plot(task, motion);
    ASSERT_EQ(plot.panels.size(), 5u);
    EXPECT_EQ(plot.panels[0].y_label, "q [m]");
    EXPECT_EQ(plot.panels[1].series.size(), 3u);  // roll, pitch, yaw
    EXPECT_EQ(plot.panels[4].y_label, "f [N]");
    EXPECT_EQ(plot.panels[4].series[1].name, "left");
  }
  EXPECT_NEAR(costs[1] / costs[0], 1, 1e-6);
}

TEST_F(FloatingTasks, TheQuadrupedCrouchesAndItsFeetStay) {
  load("quadruped_crouch");
  const Task task = read();
  const SolveReport report = solve_task(task);
  ASSERT_TRUE(report.success()) << report.verdict();
  const Trajectory& motion = report.solution.motion;
  const auto& model = task.scene.model;
  // The base in one row; a panel for each leg; no noise.
  const io::Plot plot = trajectory_plot(task, motion);
  EXPECT_EQ(plot.columns, 4);
  const auto row = [&](std::size_t k) { return std::pair(plot.panels[k].title, plot.panels[k].starts_row); };
  EXPECT_EQ(row(0), std::pair(std::string("position of the base"), false));
  EXPECT_EQ(row(3), std::pair(std::string("angular velocity of the base (body axes)"), false));
  EXPECT_EQ(row(4), std::pair(std::string("joint angle, FL"), true));
  EXPECT_EQ(row(5), std::pair(std::string("joint angle, FR"), false));
  EXPECT_EQ(row(8), std::pair(std::string("joint velocity, FL"), true));
  EXPECT_EQ(plot.panels[5].series.size(), 3u);
  EXPECT_EQ(plot.panels[5].series[2].name, "FR_KFE");
  dynamics::Data<double> data(model);
  std::vector<Vector3d> places;
  double slip = 0, moved = 0;
  for (int k = 0; k < motion.points(); ++k) {
    const VectorXd q = motion.x.col(k).head(model.nq);
    dynamics::forward_kinematics<double>(model, data, q);
    for (std::size_t c = 0; c < kFeet.size(); ++c) {
      const Vector3d p = dynamics::frame_placement(model, data, model.frame_index(kFeet[c])).p;
      if (k == 0) places.push_back(p);
      slip = std::max(slip, (p - places[c]).norm());
      const Vector3d f = motion.u.col(k).segment<3>(12 + 3 * long(c));
      EXPECT_GE(f.z(), 0);
      EXPECT_LE(f.head<2>().norm(), 0.6 * f.z() + 1e-6);
    }
    moved = std::max(moved, (q.head<3>() - motion.x.col(0).head<3>()).norm());
    EXPECT_LE(motion.u.col(k).head(12).cwiseAbs().maxCoeff(), 1 + 1e-6);
  }
  EXPECT_GT(moved, 0.08);
  EXPECT_LT(slip, 1e-5);  // m
  EXPECT_NEAR(motion.u.col(0).head(12).cwiseAbs().maxCoeff(), 0.6, 0.4);
  // Newton: what the feet push changes the momentum of the whole, here by the weight's impulse and back to rest.
  double mass = 0;
  for (const auto& inertia : model.inertias) mass += inertia.mass;
  double impulse = 0;
  const Eigen::VectorXd& t = motion.t;
  for (int k = 0; k + 2 < motion.points(); k += 2) {
    const auto push = [&](int at) {
      double sum = 0;
      for (int c = 0; c < 4; ++c) sum += motion.u(12 + 3 * c + 2, at);
      return sum;
    };
    impulse += (t[k + 2] - t[k]) / 6 * (push(k) + 4 * push(k + 1) + push(k + 2));
  }
  EXPECT_NEAR(impulse / (mass * 9.81 * 0.6), 1, 1e-4);
}

TEST_F(FloatingTasks, MistakesAreNamedWithTheirPlace) {
  load("quadrotor_flight");
  const std::string sound = text_;
  const auto says = [&](const std::string& old, const std::string& with, const std::string& part) {
    text_ = sound;
    replace(old, with);
    EXPECT_NE(message().find(part), std::string::npos) << part << " not in: " << message();
    EXPECT_NE(message().find("task.info"), std::string::npos) << message();
  };
  says("frame  rotor_2", "frame rotr_2", "did you mean 'rotor_2'?");
  says("thruster left", "thruster front", "'front' names two of 'thrusters'");
  says("moment 0.016", "moment 0.016\n axis \"0 0 0\"", "'thrusters.thruster.axis' is zero");
  says("lower  0.1", "lower 4", "is below 'lower'");
  says("base floating", "base fixed", "has no joint that moves");
  says("roll_pitch_yaw", "roll_pich_yaw", "did you mean 'roll_pitch_yaw'?");
  says("position       \"3", "free \"yaw\"\n position \"3", "'yaw'");
  says("costs { control 1 }",
       "costs {\n control 1\n tracking {\n base_orientation 1\n }\n}\ncontacts {\n points post\n}", "'post'");
  text_ = sound;
  replace("costs { control 1 }",
          "costs {\n control 1\n tracking {\n base_orientation 2\n base_position 3\n }\n}");
  const Task task = read();
  VectorXd x = task.problem.guess(2).x;
  const Term& tracking = term_of(task.problem, "tracking");
  EXPECT_LT(tracking.function(task.problem.stage(0, x, {}, VectorXd::Zero(4))).norm(), 1e-12);
  x[0] += 0.1;
  x.segment<4>(3) << 0, 0, std::sin(2.61799387799149 / 2 + 0.1), std::cos(2.61799387799149 / 2 + 0.1);
  EXPECT_NEAR(tracking.function(task.problem.stage(0, x, {}, VectorXd::Zero(4))).squaredNorm(),
              3 * 0.01 + 2 * 0.04, 1e-12);
  // The base of a goal has to be said, for it is nowhere by itself.
  text_ = sound;
  const std::size_t at = text_.find("goal {");
  text_.erase(at, text_.find("obstacles {") - at);
  text_ += "\ngoal {\n v 0\n}\n";
  EXPECT_NE(message().find("'goal.base' is missing"), std::string::npos) << message();
}

TEST_F(FloatingTasks, APartOfTheBaseMayBeLeftOpen) {
  load("quadrotor_flight");
  replace("position       \"3", "free \"roll_pitch_yaw velocity\"\n position \"3");
  const Task task = read();
  EXPECT_TRUE(task.problem.goal.segment(3, 7).array().isNaN().all());
  EXPECT_EQ(task.problem.goal[0], 3);
  EXPECT_EQ(task.problem.goal[12], 0);
  for (const Term& term : task.problem.terms) EXPECT_EQ(term.name.find("goal of"), std::string::npos);
}

}  // namespace
}  // namespace dyntape::ocp_contacts_test
