// SPDX-License-Identifier: BSD-3-Clause
//
// Ready terms of robots, against chains of rotations written out in plain Eigen and against differences.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>
#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/control/problem/record_stage.h>
#include <dyntape/interface/motion/inverse_kinematics.h>
#include <dyntape/interface/motion/robot_problem.h>
#include "autodiff/dense.h"
#include "dynamics/robot_files.h"

namespace dyntape::terms_test {
namespace {

using dynamics::ReferenceFrame;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::jacobian;

constexpr unsigned kSeed = 5;

RobotScene scene_of(const std::string& robot) {
  dynamics::UrdfOptions options{.continuous = dynamics::ContinuousJoint::kAngle};
  if (robot == "panda") options.lock = {"panda_finger_joint1", "panda_finger_joint2"};
  return {dynamics::load_urdf(dynamics::robot_file(robot), options)};
}

// Where a frame is, joint after joint from the world to it: no kinematics of the library.
Eigen::Isometry3d isometry(const dynamics::Placement<double>& X) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = X.R;
  T.translation() = X.p;
  return T;
}
Eigen::Isometry3d body_placement(const dynamics::Model<double>& model, int body, const VectorXd& q) {
  if (body < 0) return Eigen::Isometry3d::Identity();
  const auto& joint = model.joints[std::size_t(body)];
  Eigen::Isometry3d moved = Eigen::Isometry3d::Identity();
  if (joint.type == dynamics::JointType::kPrismatic)
    moved.translation() = joint.axis * q[joint.idx_q];
  else
    moved.linear() = Eigen::AngleAxisd(q[joint.idx_q], joint.axis).toRotationMatrix();
  const auto i = std::size_t(body);
  return body_placement(model, model.parent[i], q) * isometry(model.X_PJ[i]) * moved;
}
Eigen::Isometry3d placement(const dynamics::Model<double>& model, const std::string& name,
                            const VectorXd& q) {
  const auto& frame = model.frames[std::size_t(model.frame_index(name))];
  return body_placement(model, frame.body, q) * isometry(frame.X_BF);
}

Stage<double> stage_at(const VectorXd& q, const VectorXd& v) {
  Stage<double> s;
  s.x.resize(q.size() + v.size());
  s.x << q, v;
  return s;
}

Function recorded(const StageFunction& f, Eigen::Index n_x) {
  return record("term", std::size_t(n_x), [&](const VectorXad& x) {
    Stage<AD> s;
    s.x = x;
    return f(s);
  });
}

MatrixXd derivatives(const StageFunction& f, const VectorXd& x) {
  return jacobian(recorded(f, x.size()), {x.begin(), x.end()});
}

MatrixXd differences(const StageFunction& f, const VectorXd& x) {
  const double h = 1e-6;
  const auto at = [&](const VectorXd& y) { return f(Stage<double>{0, y, {}, {}}); };
  MatrixXd J(at(x).size(), x.size());
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    const VectorXd d = h * VectorXd::Unit(x.size(), k);
    J.col(k) = (at(x + d) - at(x - d)) / (2 * h);
  }
  return J;
}

class Terms : public ::testing::TestWithParam<std::pair<std::string, std::string>> {
 protected:
  VectorXd drawn(double size) {
    VectorXd values(scene_.model.nv);
    for (double& value : values) value = size * uniform_(random_);
    return values;
  }
  Matrix3d drawn_rotation() {
    const Vector3d axis = Vector3d(uniform_(random_), uniform_(random_), uniform_(random_)).normalized();
    return Eigen::AngleAxisd(2.5 * uniform_(random_), axis).toRotationMatrix();
  }

  RobotScene scene_ = scene_of(GetParam().first);
  std::string frame_ = GetParam().second;
  std::mt19937_64 random_{kSeed};
  std::uniform_real_distribution<double> uniform_{-1, 1};
};

INSTANTIATE_TEST_SUITE_P(Robots, Terms,
                         ::testing::Values(std::pair("panda", "panda_hand"), std::pair("ur5", "tool0"),
                                           std::pair("cart_pole", "tip")),
                         [](const auto& info) { return info.param.first; });

TEST_P(Terms, ValuesAreThoseOfPlainEigen) {
  for (int k = 0; k < 20; ++k) {
    const VectorXd q = drawn(2), v = drawn(1);
    const Stage<double> s = stage_at(q, v);
    const Eigen::Isometry3d X = placement(scene_.model, frame_, q);
    const Vector3d target(0.3, -0.2, 0.5);
    EXPECT_LT((frame_position(scene_, frame_, target)(s) - (X.translation() - target)).norm(), 1e-14);

    const Matrix3d R = drawn_rotation();
    const Eigen::AngleAxisd off(Matrix3d(R.transpose() * X.linear()));
    const VectorXd turned = frame_orientation(scene_, frame_, R)(s);
    EXPECT_LT((turned - off.angle() * off.axis()).norm(), 1e-12) << "angle " << off.angle();
    const VectorXd pose = frame_error(scene_, {frame_, target, R})(s);
    EXPECT_EQ(pose.size(), 6);
    EXPECT_EQ(pose.tail(3), turned);

    // Velocities, from where the frame is a little later.
    const double h = 1e-6;
    const Eigen::Isometry3d after = placement(scene_.model, frame_, q + h * v),
                            before = placement(scene_.model, frame_, q - h * v);
    const Vector3d speed = (after.translation() - before.translation()) / (2 * h);
    const Matrix3d W = (after.linear() - before.linear()) / (2 * h) * X.linear().transpose();
    const Vector3d spin(W(2, 1), W(0, 2), W(1, 0));
    const auto velocity = [&](ReferenceFrame in) { return frame_velocity(scene_, frame_, in)(s); };
    Eigen::Matrix<double, 6, 1> expected;
    expected << speed, spin;
    EXPECT_LT((velocity(ReferenceFrame::kLocalWorldAligned) - expected).norm(), 1e-8);
    expected << X.linear().transpose() * speed, X.linear().transpose() * spin;
    EXPECT_LT((velocity(ReferenceFrame::kLocal) - expected).norm(), 1e-8);
    expected << speed - spin.cross(X.translation()), spin;
    EXPECT_LT((velocity(ReferenceFrame::kWorld) - expected).norm(), 1e-8);

    // tan(angle / 2) between the axis and the way to the place.
    const Vector3d axis(0.2, -2, 1), place(1.5, 0.7, -0.4);
    const double angle =
        std::acos((X.linear() * axis.normalized()).dot((place - X.translation()).normalized()));
    EXPECT_NEAR(frame_looks_at(scene_, frame_, axis, place)(s).norm(), std::tan(angle / 2),
                1e-9 * (1 + std::pow(std::tan(angle / 2), 2)));

    double mass = 0;
    Vector3d moment = Vector3d::Zero();
    for (int i = 0; i < scene_.model.njoints(); ++i) {
      const auto& body = scene_.model.inertias[std::size_t(i)];
      mass += body.mass;
      moment += body.mass * (body_placement(scene_.model, i, q) * Vector3d(body.com));
    }
    EXPECT_LT((com_position(scene_, target)(s) - (moment / mass - target)).norm(), 1e-13);
    EXPECT_LT(
        (weighted(frame_position(scene_, frame_, target), 9)(s) - 3 * (X.translation() - target)).norm(),
        1e-13);
    const VectorXd all = frame_position(scene_, frame_, target)(s);
    EXPECT_EQ(part_of(frame_position(scene_, frame_, target), 1, 2)(s), all.tail(2));
    EXPECT_THROW(part_of(frame_position(scene_, frame_, target), 1, 3)(s), ArgumentError);
    EXPECT_EQ(entries_of(frame_position(scene_, frame_, target), {2, 0})(s), Eigen::Vector2d(all[2], all[0]));
    EXPECT_THROW(entries_of(frame_position(scene_, frame_, target), {3})(s), ArgumentError);
  }
}

// The momentum of every body, from where it is a little later.
TEST_P(Terms, MomentumIsTheSumOverBodies) {
  const double h = 1e-6;
  for (int k = 0; k < 10; ++k) {
    const VectorXd q = drawn(2), v = drawn(1);
    std::vector<double> masses;
    std::vector<Vector3d> places, velocities, spins;
    Vector3d moment = Vector3d::Zero(), linear = Vector3d::Zero(), angular = Vector3d::Zero();
    double mass = 0;
    for (int i = 0; i < scene_.model.njoints(); ++i) {
      const auto& body = scene_.model.inertias[std::size_t(i)];
      const Eigen::Isometry3d X = body_placement(scene_.model, i, q),
                              after = body_placement(scene_.model, i, q + h * v),
                              before = body_placement(scene_.model, i, q - h * v);
      const Matrix3d W = (after.linear() - before.linear()) / (2 * h) * X.linear().transpose();
      const Vector3d spin(W(2, 1), W(0, 2), W(1, 0));
      masses.push_back(body.mass);
      places.push_back(X * Vector3d(body.com));
      velocities.push_back((after * Vector3d(body.com) - before * Vector3d(body.com)) / (2 * h));
      mass += body.mass, moment += body.mass * places.back(), linear += body.mass * velocities.back();
      angular += X.linear() * (Matrix3d(body.I_c) * (X.linear().transpose() * spin));
    }
    for (std::size_t i = 0; i < masses.size(); ++i)
      angular += masses[i] * (places[i] - moment / mass).cross(velocities[i]);
    VectorXd target(6), expected(6);
    target << 0.1, 0.2, 0.3, -0.1, -0.2, -0.3;
    expected << linear, angular;
    const VectorXd found = centroidal_momentum(scene_, target)(stage_at(q, v)) + target;
    EXPECT_LT((found - expected).norm(), 1e-7 * (1 + expected.norm())) << "seed 5, draw " << k;
  }
}

// Of fractions of limits and of torques alike; summed up it is the rate of the energy that the motors bring.
TEST_P(Terms, PowerIsTorqueTimesVelocity) {
  const std::vector<int> dofs = actuated_dofs(scene_);
  Stage<double> s = stage_at(drawn(2), drawn(1));
  s.u = VectorXd::Random(Eigen::Index(dofs.size()));
  const VectorXd torque = joint_torque(scene_, ControlUnit::kPhysical)(s),
                 power = joint_power(scene_, ControlUnit::kPhysical)(s);
  EXPECT_EQ(torque, s.u);
  for (std::size_t k = 0; k < dofs.size(); ++k)
    EXPECT_EQ(power[Eigen::Index(k)], s.u[Eigen::Index(k)] * s.x[scene_.model.nq + dofs[k]]);
  if (GetParam().first == "cart_pole") return;  // whose pivot has no limit
  const VectorXd of_fractions = joint_torque(scene_, ControlUnit::kFraction)(s);
  for (std::size_t k = 0; k < dofs.size(); ++k)
    EXPECT_EQ(of_fractions[Eigen::Index(k)], s.u[Eigen::Index(k)] * scene_.model.joints[k].limits.effort);
}

TEST_P(Terms, SlopesAreThoseOfDifferences) {
  const Matrix3d R = drawn_rotation();
  const Vector3d target(0.3, -0.2, 0.5);
  const std::vector<std::pair<const char*, StageFunction>> functions = {
      {"pose", frame_error(scene_, {frame_, target, R})},
      {"velocity", frame_velocity(scene_, frame_, ReferenceFrame::kWorld)},
      {"looks at", frame_looks_at(scene_, frame_, {0, 0.3, 1}, {3, 1, 2})},
      {"momentum", centroidal_momentum(scene_)},
      {"centre of mass", com_position(scene_, target)}};
  for (int k = 0; k < 5; ++k) {
    const VectorXd x = stage_at(drawn(1.5), drawn(1)).x;
    for (const auto& [name, f] : functions) {
      const VectorXd value = f(Stage<double>{0, x, {}, {}});
      const double scale = 1 + value.squaredNorm();
      EXPECT_LT((derivatives(f, x) - differences(f, x)).cwiseAbs().maxCoeff(), 1e-7 * scale)
          << name << ", draw " << k;
    }
  }
}

TEST_P(Terms, OrientationIsZeroAndSmoothAtItsTarget) {
  const VectorXd q = drawn(1.5), x = stage_at(q, VectorXd::Zero(q.size())).x;
  const Eigen::Isometry3d X = placement(scene_.model, frame_, q);
  const auto turned = [&](const Vector3d& w) {
    const Matrix3d R =
        X.linear() * Eigen::AngleAxisd(w.norm(), w.stableNormalized()).toRotationMatrix().transpose();
    return VectorXd(frame_orientation(scene_, frame_, R)(Stage<double>{0, x, {}, {}}));
  };
  const StageFunction at = frame_orientation(scene_, frame_, X.linear());
  EXPECT_LT(at(Stage<double>{0, x, {}, {}}).norm(), 1e-15);
  const MatrixXd J = derivatives(at, x);
  EXPECT_TRUE(J.allFinite());
  EXPECT_LT((J - differences(at, x)).cwiseAbs().maxCoeff(), 1e-9);
  const Vector3d axis = Vector3d(1, -2, 0.5).normalized();
  for (double angle : {1e-12, 1e-9, 1e-6, 1e-3, 1.0, 3.0, 3.14, std::numbers::pi - 1e-7})
    EXPECT_LT((turned(angle * axis) - angle * axis).norm(), 5e-15) << "angle " << angle;
}

// What two terms have in common is recorded once.
TEST_P(Terms, OfOneFrameShareTheirKinematics) {
  Problem without = robot_problem(scene_, {.duration = 1, .form = DynamicsForm::kInverse});
  Problem one = without, two = without;
  const StageFunction near =
      frame_error(scene_, {frame_, Vector3d(0.1, 0.2, 0.3), Matrix3d(Matrix3d::Identity())});
  const StageFunction far =
      frame_error(scene_, {frame_, Vector3d(0.3, 0.1, 0.2), Matrix3d(Matrix3d::Identity())});
  one.add(path_inequality("near", near, VectorXd::Constant(6, -1), VectorXd::Constant(6, 1)));
  two.terms = one.terms;
  two.add(path_inequality("far", far, VectorXd::Constant(6, -1), VectorXd::Constant(6, 1)));
  const auto operations = [](const Problem& p) { return total_operations(dissolved(record_stage(p).node)); };
  const std::size_t base = operations(without), with_one = operations(one), with_two = operations(two);
  EXPECT_GT(with_one, base + 10);
  EXPECT_LE(with_two, with_one + 3);  // differences of positions
}

TEST(TermErrors, SayWhatIsWrong) {
  const RobotScene scene = scene_of("panda");
  const auto message = [](const auto& call) -> std::string {
    try {
      call();
    } catch (const ArgumentError& e) {
      return e.what();
    }
    return "nothing thrown";
  };
  const auto says = [&](const auto& call, const char* part) {
    EXPECT_NE(message(call).find(part), std::string::npos) << part << " not in: " << message(call);
  };
  const Vector3d zero = Vector3d::Zero();
  says([&] { frame_position(scene, "panda_hnd", zero); }, "panda_hand");
  says([&] { frame_position(scene, "panda_link0", zero); }, "fixed to the world");
  says([&] { frame_position(scene, "panda_hand", Vector3d(0, NAN, 0)); }, "no finite number");
  says([&] { frame_orientation(scene, "panda_hand", Matrix3d::Ones()); }, "is no rotation");
  says([&] { frame_orientation(scene, "panda_hand", -Matrix3d::Identity()); }, "is no rotation");
  says([&] { frame_error(scene, {"panda_hand"}); }, "neither a position nor an orientation");
  says([&] { frame_looks_at(scene, "panda_hand", zero, zero); }, "expected a direction");
  says([&] { weighted(frame_position(scene, "panda_hand", zero), -1); }, "expected zero or more");
  says(
      [&] {
        inverse_kinematics(scene, {"panda_hand", zero}, VectorXd::Zero(3));
      },
      "starts from 3 values, expected 7");
}

TEST(RotationOf, IsYawAfterPitchAfterRoll) {
  const Matrix3d R = rotation_of(0.3, -0.7, 1.9);
  const double cr = std::cos(0.3), sr = std::sin(0.3), cp = std::cos(-0.7), sp = std::sin(-0.7),
               cy = std::cos(1.9), sy = std::sin(1.9);
  Matrix3d expected;  // of the URDF's convention, written out
  expected << cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, sy * cp, sy * sp * sr + cy * cr,
      sy * sp * cr - cy * sr, -sp, cp * sr, cp * cr;
  EXPECT_LT((R - expected).norm(), 1e-15);
}

class Reaching : public ::testing::TestWithParam<std::pair<std::string, std::string>> {};

INSTANTIATE_TEST_SUITE_P(Arms, Reaching,
                         ::testing::Values(std::pair("panda", "panda_hand"), std::pair("ur5", "tool0"),
                                           std::pair("iiwa14", "iiwa_link_ee")),
                         [](const auto& info) { return info.param.first; });

// Poses of random configurations within the limits, each from another random configuration.
TEST_P(Reaching, FindsWhatIsInReach) {
  const auto& [robot, frame] = GetParam();
  const RobotScene scene = scene_of(robot);
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> uniform(0, 1);
  const auto drawn = [&] {
    VectorXd q(scene.model.nv);
    for (int i = 0; i < scene.model.nv; ++i) {
      const auto& limits = scene.model.joints[std::size_t(i)].limits;
      q[i] = limits.lower + (limits.upper - limits.lower) * uniform(random);
    }
    return q;
  };
  int found = 0;
  constexpr int kPoses = 100;
  for (int k = 0; k < kPoses; ++k) {
    const Eigen::Isometry3d X = placement(scene.model, frame, drawn());
    const VectorXd from = drawn();
    const auto q = inverse_kinematics(scene, {frame, Vector3d(X.translation()), Matrix3d(X.linear())}, from);
    if (!q) continue;
    ++found;
    const Eigen::Isometry3d reached = placement(scene.model, frame, *q);
    EXPECT_LT((reached.matrix() - X.matrix()).cwiseAbs().maxCoeff(), 5e-9) << "pose " << k;
    for (int i = 0; i < scene.model.nv; ++i) {
      EXPECT_GE((*q)[i], scene.model.joints[std::size_t(i)].limits.lower) << "pose " << k;
      EXPECT_LE((*q)[i], scene.model.joints[std::size_t(i)].limits.upper) << "pose " << k;
    }
    EXPECT_EQ(*q, *inverse_kinematics(scene, {frame, Vector3d(X.translation()), Matrix3d(X.linear())}, from));
  }
  EXPECT_GE(found, kPoses - 2) << robot;
}

TEST_P(Reaching, FindsOnlyWhatIsAccepted) {
  const auto& [robot, frame] = GetParam();
  const RobotScene scene = scene_of(robot);
  const VectorXd from = VectorXd::Constant(scene.model.nv, -0.3);
  const Vector3d place = placement(scene.model, frame, from).translation();
  const auto first = inverse_kinematics(scene, {frame, place}, from);
  ASSERT_TRUE(first.has_value());
  const auto accept = [&](const VectorXd& q) { return (q - *first).cwiseAbs().maxCoeff() > 1; };
  const auto other = inverse_kinematics(scene, {frame, place}, from, {.accept = accept});
  ASSERT_TRUE(other.has_value());
  EXPECT_TRUE(accept(*other));
  EXPECT_LT((placement(scene.model, frame, *other).translation() - place).norm(), 5e-9);
  const auto never = [](const VectorXd&) { return false; };
  EXPECT_FALSE(inverse_kinematics(scene, {frame, place}, from, {.accept = never}).has_value());
}

TEST_P(Reaching, TakesNoStepFromWhereItIs) {
  const auto& [robot, frame] = GetParam();
  const RobotScene scene = scene_of(robot);
  VectorXd from(scene.model.nv);
  for (int i = 0; i < scene.model.nv; ++i) {
    const auto& limits = scene.model.joints[std::size_t(i)].limits;
    from[i] = (limits.lower + limits.upper) / 2 + 0.01;
  }
  const Vector3d place = placement(scene.model, frame, from).translation();
  const auto q = inverse_kinematics(scene, {frame, place}, from, {.starts = 1, .iterations = 0});
  ASSERT_TRUE(q.has_value());
  EXPECT_EQ(*q, from);
}

TEST_P(Reaching, FindsNothingOutOfReach) {
  const auto& [robot, frame] = GetParam();
  const RobotScene scene = scene_of(robot);
  EXPECT_FALSE(
      inverse_kinematics(scene, {frame, Vector3d(3, 0, 0)}, VectorXd::Zero(scene.model.nv)).has_value());
}

}  // namespace
}  // namespace dyntape::terms_test
