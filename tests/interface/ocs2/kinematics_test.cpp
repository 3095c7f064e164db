// SPDX-License-Identifier: BSD-3-Clause
//
// End effectors, beside dyntape's own kinematics in doubles.
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/urdf/urdf.h>

#include "program.h"
#include "source_folder.h"

namespace {

using ocs2::ad_vector_t;
using ocs2::matrix_t;
using ocs2::vector3_t;
using ocs2::vector_t;

// A fixed base whose joints' velocities are the input.
struct Arm : ocs2::StateInputMapping {
  ad_vector_t getJointPosition(const ad_vector_t& state) const override { return state; }
  ad_vector_t getJointVelocity(const ad_vector_t&, const ad_vector_t& input) const override { return input; }
};

class Kinematics : public Program {
 protected:
  const dyntape::dynamics::Model<double> model =
      dyntape::dynamics::load_urdf(dyntape::test::source_folder() + "/config/robots/panda.urdf",
                                   {.lock = {"panda_finger_joint1", "panda_finger_joint2"}});
  const std::vector<std::string> ids = {"panda_hand", "panda_link4"};
  const ocs2::EndEffectorKinematicsCppAd hand{model, Arm(), ids, 7, 7, "hand", folder()};
  const vector_t q = (vector_t(7) << 0.1, -0.5, 0.3, -1.5, 0.2, 1.1, 0.4).finished(),
                 v = vector_t::LinSpaced(7, -1, 1);

  dyntape::dynamics::Placement<double> placed(const std::string& id, const vector_t& at) const {
    dyntape::dynamics::Data<double> data(model);
    dyntape::dynamics::forward_kinematics<double>(model, data, at);
    return frame_placement(model, data, model.frame_index(id));
  }
};

TEST_F(Kinematics, Positions) {
  EXPECT_EQ(hand.getIds(), ids);
  const std::vector<vector3_t> p = hand.getPosition(q);
  const auto linear = hand.getPositionLinearApproximation(q);
  for (std::size_t k = 0; k < ids.size(); ++k) {
    expect_near(p[k], placed(ids[k], q).p);
    expect_near(linear[k].f, p[k], 0);
    const auto f = [&](const vector_t& at) { return vector_t(placed(ids[k], at).p); };
    expect_near(linear[k].dfdx, ocs2::finiteDifferenceDerivative(f, q), 1e-9);
    EXPECT_EQ(linear[k].dfdu.size(), 0);
  }
}

TEST_F(Kinematics, Velocities) {
  const auto linear = hand.getVelocityLinearApproximation(q, v);
  const auto positions = hand.getPositionLinearApproximation(q);
  for (std::size_t k = 0; k < ids.size(); ++k) {
    expect_near(hand.getVelocity(q, v)[k], positions[k].dfdx * v, 1e-13);
    expect_near(linear[k].dfdu, positions[k].dfdx, 1e-13);
    const auto f = [&](const vector_t& at) { return vector_t(hand.getVelocity(at, v)[k]); };
    expect_near(linear[k].dfdx, ocs2::finiteDifferenceDerivative(f, q), 1e-9);
  }
}

TEST_F(Kinematics, OrientationErrors) {
  std::vector<ocs2::quaternion_t> own, turned;
  const vector3_t w(1e-4, -2e-4, 3e-4);
  for (const std::string& id : ids) {
    own.emplace_back(Eigen::Matrix3d(placed(id, q).R));
    turned.push_back(Eigen::AngleAxisd(w.norm(), w.normalized()) * own.back());
  }
  for (std::size_t k = 0; k < ids.size(); ++k) {
    EXPECT_LT(hand.getOrientationError(q, own)[k].norm(), 1e-15);
    expect_near(hand.getOrientationError(q, turned)[k].cwiseAbs(), (w / 2).cwiseAbs(), 1e-8);
    const auto f = [&](const vector_t& at) { return vector_t(hand.getOrientationError(at, turned)[k]); };
    expect_near(hand.getOrientationErrorLinearApproximation(q, turned)[k].dfdx,
                ocs2::finiteDifferenceDerivative(f, q), 1e-9);
  }
  EXPECT_THROW(hand.getOrientationError(q, {}), dyntape::ArgumentError);
}

TEST_F(Kinematics, ClonesAndNames) {
  const std::unique_ptr<ocs2::EndEffectorKinematics<ocs2::scalar_t>> clone(hand.clone());
  expect_near(clone->getPosition(q)[0], placed("panda_hand", q).p);
  const std::string said = dyntape::message_of<dyntape::ArgumentError>(
      [&] { ocs2::EndEffectorKinematicsCppAd(model, Arm(), {"panda_hnd"}, 7, 7, "hand", folder()); });
  EXPECT_NE(said.find("panda_hand"), std::string::npos) << said;
}

}  // namespace
