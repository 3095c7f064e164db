// SPDX-License-Identifier: BSD-3-Clause
//
// Kinematic derivatives against the derivative of the recorded motion, and their own recordings, in all three
// frames on robots of config/.
#include <gtest/gtest.h>

#include <filesystem>
#include <random>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/algorithms/kinematic_derivatives.h>
#include <dyntape/dynamics/algorithms/operational_space.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>

#include "source_folder.h"

namespace dyntape::kinematic_derivatives_recorded_test {
namespace {

using dynamics::Base;
using dynamics::Data;
using dynamics::KinematicDerivatives;
using dynamics::Model;
using dynamics::ReferenceFrame;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr ReferenceFrame kFrames[] = {ReferenceFrame::kLocal, ReferenceFrame::kWorld,
                                      ReferenceFrame::kLocalWorldAligned};

struct Robot {
  const char* name;
  Base base;
};

class RecordedKinematics : public ::testing::TestWithParam<Robot> {
 protected:
  RecordedKinematics() {
    const std::filesystem::path robots = std::filesystem::path(test::source_folder()) / "config" / "robots";
    model = dynamics::load_urdf((robots / (std::string(GetParam().name) + ".urdf")).string(),
                                {.base = GetParam().base});
    taped = model.cast<AD>();
    frame = static_cast<int>(model.frames.size()) - 1;
    std::mt19937_64 random(7);
    q = dynamics::random_configuration(model, random);
    const auto number = [&] { return std::uniform_real_distribution<double>(-1, 1)(random); };
    v = VectorXd::NullaryExpr(model.nv, number);
    a = VectorXd::NullaryExpr(model.nv, number) * 3;
  }

  static std::vector<double> joined(std::initializer_list<VectorXd> parts) {
    std::vector<double> all;
    for (const VectorXd& part : parts) all.insert(all.end(), part.begin(), part.end());
    return all;
  }

  Model<double> model;
  Model<AD> taped;
  int frame = 0;
  VectorXd q, v, a;
};

// max |a - b| / max |b|.
double error(const MatrixXd& got, const MatrixXd& expected) {
  return (got - expected).cwiseAbs().maxCoeff() / std::max(1e-300, expected.cwiseAbs().maxCoeff());
}

TEST_P(RecordedKinematics, SlopesAreThoseOfTheRecordedMotion) {
  const int nv = model.nv;
  for (const ReferenceFrame in : kFrames) {
    // (V, A, C) of (d, v, a) with parameters q.
    const auto motion = [&](const VectorXad& x, const VectorXad& at) {
      Data<AD> data(taped);
      const VectorXad d = x.head(nv), vel = x.segment(nv, nv), acc = x.tail(nv);
      dynamics::forward_kinematics<AD>(taped, data, dynamics::integrate<AD>(taped, at, d), vel, acc);
      VectorXad y(18);
      y << dynamics::frame_velocity(taped, data, frame, in).vector(),
          dynamics::frame_acceleration(taped, data, frame, in).vector(),
          dynamics::frame_classical_acceleration(taped, data, frame, in).vector();
      return y;
    };
    const SparseFunction derivatives = sparse_jacobian(
        record("motion", static_cast<std::size_t>(3 * nv), static_cast<std::size_t>(model.nq), motion));
    const std::vector<double> entries =
        evaluate(derivatives.function, joined({VectorXd::Zero(nv), v, a}), joined({q}));
    MatrixXd expected = MatrixXd::Zero(18, 3 * nv);
    for (std::size_t k = 0; k < entries.size(); ++k) {
      expected(derivatives.pattern.row[k], derivatives.pattern.col[k]) = entries[k];
    }
    Data<double> data(model);
    KinematicDerivatives<double> K(model);
    dynamics::forward_kinematics(model, data, q, v, a);
    dynamics::frame_acceleration_derivatives(model, data, K, frame, in);
    const MatrixXd zero = MatrixXd::Zero(6, nv);
    EXPECT_LE(error(K.dV_dq, expected.block(0, 0, 6, nv)), 1e-13);
    EXPECT_LE(error(K.J, expected.block(0, nv, 6, nv)), 1e-13);
    EXPECT_EQ(expected.block(0, 2 * nv, 6, nv), zero);
    EXPECT_LE(error(K.dA_dq, expected.block(6, 0, 6, nv)), 1e-13);
    EXPECT_LE(error(K.dA_dv, expected.block(6, nv, 6, nv)), 1e-13);
    EXPECT_LE(error(K.J, expected.block(6, 2 * nv, 6, nv)), 1e-13);
    EXPECT_LE(error(K.dC_dq, expected.block(12, 0, 6, nv)), 1e-13);
    EXPECT_LE(error(K.dC_dv, expected.block(12, nv, 6, nv)), 1e-13);
    EXPECT_LE(error(K.J, expected.block(12, 2 * nv, 6, nv)), 1e-13);
  }
}

// The analytic algorithms on a tape, away from where they were recorded: no branch, the same numbers.
TEST_P(RecordedKinematics, AlgorithmsRunOnATape) {
  const auto n = static_cast<std::size_t>(model.nq + 2 * model.nv);
  for (const ReferenceFrame in : kFrames) {
    const auto all = [&]<class T>(const Model<T>& robot, const dynamics::VectorX<T>& x) {
      const dynamics::VectorX<T> at = x.head(robot.nq), vel = x.segment(robot.nq, robot.nv),
                                 acc = x.tail(robot.nv);
      Data<T> data(robot);
      KinematicDerivatives<T> K(robot);
      dynamics::KinematicHessian<T> H(robot);
      dynamics::forward_kinematics<T>(robot, data, at, vel, acc);
      dynamics::frame_acceleration_derivatives(robot, data, K, frame, in);
      dynamics::frame_hessian(robot, data, H, frame, in);
      dynamics::frame_weighted_hessian(robot, data, K, frame, in, {K.C.linear, K.C.angular});
      dynamics::VectorX<T> y(6 * 4 * robot.nv + H.H.size() + K.fH.size());
      y << K.J_dot.reshaped(), K.dV_dq.reshaped(), K.dC_dq.reshaped(), K.dC_dv.reshaped(), H.H.reshaped(),
          K.fH.reshaped();
      return y;
    };
    const Function f = record("kinematics", n, [&](const VectorXad& x) { return all(taped, x); });
    EXPECT_TRUE(f.guards.empty());
    const std::vector<double> x = joined({q, v, a}), y = evaluate(f, x);
    const VectorXd expected = all(model, VectorXd(VectorXd::Map(x.data(), static_cast<long>(n))));
    EXPECT_LE(error(VectorXd::Map(y.data(), static_cast<long>(y.size())), expected), 1e-14);
  }
}

TEST_P(RecordedKinematics, OperationalSpaceRunsOnATape) {
  const auto n = static_cast<std::size_t>(model.nq + model.nv + 6);
  const auto torque = [&]<class T>(const Model<T>& robot, const dynamics::VectorX<T>& x) {
    const dynamics::VectorX<T> at = x.head(robot.nq), vel = x.segment(robot.nq, robot.nv), x_dd = x.tail(6);
    Data<T> data(robot);
    dynamics::OperationalSpace<T> space(robot);
    dynamics::operational_space<T>(robot, data, space, at, vel, frame, ReferenceFrame::kLocalWorldAligned,
                                   {.damping = 1e-2});
    return dynamics::VectorX<T>(dynamics::operational_torque<T>(robot, data, space, at, vel, x_dd));
  };
  const Function f = record("operational", n, [&](const VectorXad& x) { return torque(taped, x); });
  EXPECT_TRUE(f.guards.empty());
  const std::vector<double> x = joined({q, v, a.head(6)}), y = evaluate(f, x);
  const VectorXd expected = torque(model, VectorXd(VectorXd::Map(x.data(), static_cast<long>(n))));
  EXPECT_LE(error(VectorXd::Map(y.data(), static_cast<long>(y.size())), expected), 1e-10);
}

INSTANTIATE_TEST_SUITE_P(Robots, RecordedKinematics,
                         ::testing::Values(Robot{"ur5", Base::kFixed}, Robot{"panda", Base::kFixed},
                                           Robot{"solo12", Base::kFloating},
                                           Robot{"iiwa14", Base::kFloating}),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace dyntape::kinematic_derivatives_recorded_test
