// SPDX-License-Identifier: BSD-3-Clause
//
// OCS2's EndEffectorKinematics: positions, velocities and orientations of end effectors, with derivatives from
// generated code.
//
//   struct Mapping : ocs2::StateInputMapping {                                  // q and v of the robot
//     ocs2::ad_vector_t getJointPosition(const ocs2::ad_vector_t& state) const override { return state; }
//     ocs2::ad_vector_t getJointVelocity(const ocs2::ad_vector_t&, const ocs2::ad_vector_t& u) const override { return u; }
//   };
//   ocs2::EndEffectorKinematicsCppAd hand(dynamics::load_urdf("panda.urdf"), Mapping(), {"panda_hand"}, 7, 7, "hand");
//   ocs2::vector3_t p = hand.getPosition(state)[0];                             // m, in the world's axes
//   auto J = hand.getPositionLinearApproximation(state)[0];                     // f (3), dfdx (3 x nx)
//
// The robot is a dynamics::Model (dynamics/model/model.h); its q and v are those of Pinocchio.  Velocities are those
// of the frame's origin, in world axes.  The reference of an orientation is a parameter.  Orientation error of unit
// quaternions, end effector q and reference r: q_w r_v - r_w q_v + q_v x r_v.  If q and r are close, this is half
// the rotation vector from q to r.
//
// All end effectors of one object share a library for each of position, velocity and orientation.  Each library is
// made at its first use, by one thread at a time.  ArgumentError: a frame that the robot does not have; the message
// has the nearest name.  Other errors: those of CppAdInterface.
#pragma once

#include <memory>
#include <mutex>

#include <dyntape/dynamics/model/model.h>
#include <dyntape/interface/ocs2/classes/costs.h>

namespace dyntape::ocs2 {

class StateInputMapping {
 public:
  virtual ~StateInputMapping() = default;
  virtual ad_vector_t getJointPosition(const ad_vector_t& state) const = 0;                            // (nq)
  virtual ad_vector_t getJointVelocity(const ad_vector_t& state, const ad_vector_t& input) const = 0;  // (nv)
};

template <class SCALAR_T>
class EndEffectorKinematics {
 public:
  using vector3_t = Eigen::Matrix<SCALAR_T, 3, 1>;
  using vector_t = Eigen::Matrix<SCALAR_T, Eigen::Dynamic, 1>;
  using quaternion_t = Eigen::Quaternion<SCALAR_T>;

  EndEffectorKinematics() = default;
  virtual ~EndEffectorKinematics() = default;
  virtual EndEffectorKinematics* clone() const = 0;
  virtual const std::vector<std::string>& getIds() const = 0;
  virtual std::vector<vector3_t> getPosition(const vector_t& state) const = 0;
  virtual std::vector<vector3_t> getVelocity(const vector_t& state, const vector_t& input) const = 0;
  virtual std::vector<vector3_t> getOrientationError(
      const vector_t& state, const std::vector<quaternion_t>& referenceOrientations) const = 0;
  virtual std::vector<VectorFunctionLinearApproximation> getPositionLinearApproximation(
      const vector_t& state) const = 0;
  virtual std::vector<VectorFunctionLinearApproximation> getVelocityLinearApproximation(
      const vector_t& state, const vector_t& input) const = 0;
  virtual std::vector<VectorFunctionLinearApproximation> getOrientationErrorLinearApproximation(
      const vector_t& state, const std::vector<quaternion_t>& referenceOrientations) const = 0;

 protected:
  EndEffectorKinematics(const EndEffectorKinematics&) = default;
};

class EndEffectorKinematicsCppAd : public EndEffectorKinematics<scalar_t> {
 public:
  template <class Mapping>
  EndEffectorKinematicsCppAd(dynamics::Model<double> robot, const Mapping& mapping,
                             std::vector<std::string> endEffectorIds, std::size_t stateDim,
                             std::size_t inputDim, std::string modelName, std::string modelFolder = "",
                             bool recompileLibraries = true, bool verbose = false)
      : EndEffectorKinematicsCppAd(std::move(robot), std::make_shared<const Mapping>(mapping),
                                   std::move(endEffectorIds), stateDim, inputDim, std::move(modelName),
                                   std::move(modelFolder), recompileLibraries, verbose, 0) {}

  EndEffectorKinematicsCppAd* clone() const override { return new EndEffectorKinematicsCppAd(*this); }
  const std::vector<std::string>& getIds() const override { return shared_->ids; }
  std::vector<vector3_t> getPosition(const vector_t& state) const override;
  std::vector<vector3_t> getVelocity(const vector_t& state, const vector_t& input) const override;
  std::vector<vector3_t> getOrientationError(
      const vector_t& state, const std::vector<quaternion_t>& referenceOrientations) const override;
  std::vector<VectorFunctionLinearApproximation> getPositionLinearApproximation(
      const vector_t& state) const override;
  std::vector<VectorFunctionLinearApproximation> getVelocityLinearApproximation(
      const vector_t& state, const vector_t& input) const override;
  std::vector<VectorFunctionLinearApproximation> getOrientationErrorLinearApproximation(
      const vector_t& state, const std::vector<quaternion_t>& referenceOrientations) const override;

 private:
  // The part that copies share.
  struct Shared {
    dynamics::Model<double> robot;
    std::shared_ptr<const StateInputMapping> mapping;
    std::vector<std::string> ids;
    std::vector<int> frames;
    std::size_t state_dim, input_dim;
    std::string name, folder;
    bool recompile, verbose;
    std::once_flag position_once, velocity_once, orientation_once;
    std::unique_ptr<const CppAdInterface> position, velocity, orientation;
  };

  EndEffectorKinematicsCppAd(dynamics::Model<double> robot, std::shared_ptr<const StateInputMapping> mapping,
                             std::vector<std::string> endEffectorIds, std::size_t stateDim,
                             std::size_t inputDim, std::string modelName, std::string modelFolder,
                             bool recompileLibraries, bool verbose, int);

  std::unique_ptr<const CppAdInterface> made(CppAdInterface::ad_parameterized_function_t function,
                                             std::size_t n, std::size_t n_p, const char* suffix) const;
  const CppAdInterface& position() const;
  const CppAdInterface& velocity() const;
  const CppAdInterface& orientation() const;
  vector_t references(const std::vector<quaternion_t>& of) const;

  std::shared_ptr<Shared> shared_;
};

}  // namespace dyntape::ocs2
