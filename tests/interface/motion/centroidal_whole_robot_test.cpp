// SPDX-License-Identifier: BSD-3-Clause
//
// Plans of one mass followed by the whole simulated robot: joints and all, its trunk kept level by its legs, its feet held by
// rigid contacts, which could pull and shall not.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/QR>

#include <dyntape/dynamics/algebra/lie.h>
#include <dyntape/dynamics/algorithms/centroidal.h>
#include <dyntape/dynamics/contact/constraints.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/control/mpc/receding_horizon.h>
#include <dyntape/interface/motion/centroidal_problem.h>
#include "dynamics/robot_files.h"
#include "interface/control/ocp_problems.h"

namespace dyntape::centroidal_whole_robot_test {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kFriction = 1.2, kTick = 1e-3;  // s

class WholeDog {
 public:
  RobotScene scene{
      dynamics::load_urdf(dynamics::robot_file("solo12"), {.base = dynamics::Base::kFloating}), {}, {}};
  VectorXd q = dynamics::neutral(scene.model), v = VectorXd::Zero(18);
  CentroidalBody body;
  double pull = 0, slip = 0, turn = 0, torque = 0;  // most of each (N, N beyond the cone, rad, N m)

  WholeDog() {
    q.tail(12) << 0.1, 0.8, -1.6, -0.1, 0.8, -1.6, 0.1, -0.8, 1.6, -0.1, -0.8, 1.6;
    std::vector<HeldContact> contacts;
    for (const char* foot : {"FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"})
      contacts.push_back({.frame = foot, .friction = kFriction});
    body = centroidal_body(scene, q, contacts);
    std::vector<dynamics::Constraint<double>> held;
    for (const CentroidalBody::Foot& foot : body.feet) {
      frames_.push_back(scene.model.frame_index(foot.name));
      held.push_back(dynamics::point_constraint(scene.model, frames_.back(), foot.place));
    }
    feet_ = std::make_unique<dynamics::ConstraintData<double>>(scene.model, held);
  }

  // Feet, centre of mass and turns of the trunk: (18 x 18) their derivatives.
  MatrixXd tasks() {
    MatrixXd A = MatrixXd::Zero(18, 18);
    for (int i = 0; i < 4; ++i)
      A.middleRows(3 * i, 3) =
          dynamics::frame_jacobian<double>(scene.model, data_, q, frames_[std::size_t(i)], kAxes).topRows(3);
    A.middleRows(12, 3) = dynamics::com_jacobian<double>(scene.model, data_, whole_, q);
    A.block<3, 3>(15, 3).setIdentity();
    return A;
  }

  void push(const Vector3d& velocity) {
    VectorXd jump = VectorXd::Zero(18);
    jump.segment<3>(12) = velocity;
    v += tasks().partialPivLu().solve(jump);
  }

  // Torques by which the centre of mass accelerates as these forces say, feet stay, and the trunk stays level; forces of the feet
  // are these and the least besides that the legs' own motion asks for.
  void move(const VectorXd& forces) {
    const auto& model = scene.model;
    const VectorXd none = VectorXd::Zero(18);
    VectorXd wanted(18);
    dynamics::center_of_mass<double>(model, data_, whole_, q, v, none);
    Vector3d sum = body.mass * body.gravity;
    for (int i = 0; i < 4; ++i) sum += forces.segment<3>(3 * i);
    wanted.segment<3>(12) = sum / body.mass - whole_.acceleration;
    dynamics::forward_kinematics<double>(model, data_, q, v, none);
    for (int i = 0; i < 4; ++i) {
      const int frame = frames_[std::size_t(i)];
      const Vector3d bent = dynamics::frame_classical_acceleration(model, data_, frame, kAxes).linear,
                     moves = dynamics::frame_velocity(model, data_, frame, kAxes).linear,
                     is = dynamics::frame_placement(model, data_, frame).p;
      wanted.segment<3>(3 * i) = -bent - 20 * moves - 100 * (is - body.feet[std::size_t(i)].place);
    }
    const dynamics::Matrix3<double> R(Eigen::Quaterniond(q[6], q[3], q[4], q[5]).toRotationMatrix());
    const Vector3d off = dynamics::log(R);
    turn = std::max(turn, off.norm());
    wanted.tail<3>() = -100 * off - 20 * v.segment<3>(3);
    const MatrixXd A = tasks(), J = A.topRows(12), base = J.leftCols(6).transpose();
    const VectorXd a = A.partialPivLu().solve(wanted), needed = dynamics::rnea<double>(model, data_, q, v, a);
    const VectorXd miss = needed.head(6) - base * forces;
    const VectorXd held = forces + base.completeOrthogonalDecomposition().solve(miss);
    VectorXd tau = VectorXd::Zero(18);
    tau.tail(12) = needed.tail(12) - J.rightCols(12).transpose() * held;
    torque = std::max(torque, tau.cwiseAbs().maxCoeff());
    const VectorXd simulated = dynamics::constrained_dynamics<double>(model, data_, *feet_, q, v, tau);
    EXPECT_LT((simulated - a).norm(), 1e-9 * (1 + a.norm()));
    note_forces();
    v += kTick * simulated;
    q = dynamics::integrate<double>(model, q, VectorXd(kTick * v));
  }

 private:
  static constexpr auto kAxes = dynamics::ReferenceFrame::kLocalWorldAligned;

  void note_forces() {
    dynamics::forward_kinematics<double>(scene.model, data_, q);
    for (int i = 0; i < 4; ++i) {
      const auto R = dynamics::frame_placement(scene.model, data_, frames_[std::size_t(i)]).R;
      const Vector3d f = R * dynamics::Vector3<double>(feet_->lambda.segment<3>(3 * i));
      pull = std::max(pull, -f.z());
      slip = std::max(slip, f.head<2>().norm() - kFriction * f.z());
    }
  }

  dynamics::Data<double> data_{scene.model};
  dynamics::Centroidal<double> whole_{scene.model};
  std::vector<int> frames_;
  std::unique_ptr<dynamics::ConstraintData<double>> feet_;
};

// 0.9 of the limits, measured 2 ms late at most.  Angular momentum of the legs, which one mass does not know, takes 1 % of the
// weight from feet that bear none.  Sideways it does not stand 0.95.
TEST(CentroidalWholeRobot, StandsPushes) {
  for (int axis : {0, 1}) {
    WholeDog dog;
    const CentroidalOptions strictly{
        .duration = 0.5, .is_level = true, .zero_angular_momentum = true, .ends_at_rest = true};
    RecedingHorizon mpc(centroidal_problem(dog.body, strictly),
                        {.mesh = {.scheme = trapezoid(), .intervals = 10, .evaluation = test::kInterpreted},
                         .solver = {.tolerance = 1e-4, .max_iterations = 300}});
    const double height = dog.body.com.z() - dog.body.feet[0].place.z(),
                 limit =
                     std::sqrt(9.81 / height) * std::abs(dog.body.feet[0].place[axis] - dog.body.com[axis]);
    Plan plan;
    for (int k = 0; k < 2000; ++k) {
      if (k == 101) dog.push(0.9 * limit * Vector3d::Unit(axis));
      if (k % 2 == 0) {
        const MpcStep& s = mpc.step(k * kTick, centroidal_state(dog.scene, dog.q, dog.v));
        ASSERT_TRUE(s.usable) << k << " " << to_string(s.status);
        plan = s.plan;
      }
      dog.move(plan.control(k * kTick));
    }
    const VectorXd end = centroidal_state(dog.scene, dog.q, dog.v);
    std::printf(
        "axis %d: ends %.1f mm off; pulls %.3f N, slips %.3f N, trunk turns %.1e rad, %.2f N m at most\n",
        axis, 1e3 * (end.head(3) - dog.body.com).norm(), dog.pull, dog.slip, dog.turn, dog.torque);
    EXPECT_LT((end.head(3) - dog.body.com).norm(), 0.01);
    EXPECT_LT(end.segment(3, 3).norm(), 0.02);
    EXPECT_LT(dog.turn, 1e-3);
    EXPECT_LT(dog.pull, 0.01 * dog.body.weight());
    EXPECT_LT(dog.slip, 0.015 * dog.body.weight());
  }
}

}  // namespace
}  // namespace dyntape::centroidal_whole_robot_test
