// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/ocs2/classes/end_effector_kinematics.h>

#include <dyntape/dynamics/algebra/lie.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/interface/ocs2/ad_function_model.h>

namespace dyntape::ocs2 {
namespace {

using ADModel = dynamics::Model<AD>;

// The robot in a state, recorded.
struct MovedRobot {
  ADModel model;
  dynamics::Data<AD> data;

  MovedRobot(const dynamics::Model<double>& robot, const ad_vector_t& q, const ad_vector_t& v)
      : model(robot.cast<AD>()), data(model) {
    dyntape::detail::check_size("getJointPosition", robot.name, "q", q.size(),
                                static_cast<std::size_t>(robot.nq));
    if (v.size() == 0) {
      dynamics::forward_kinematics<AD>(model, data, q);
      return;
    }
    dyntape::detail::check_size("getJointVelocity", robot.name, "v", v.size(),
                                static_cast<std::size_t>(robot.nv));
    dynamics::forward_kinematics<AD>(model, data, q, v);
  }
};

std::vector<vector3_t> in_threes(const vector_t& y) {
  std::vector<vector3_t> all;
  for (Eigen::Index i = 0; i < y.size(); i += 3) all.push_back(y.segment<3>(i));
  return all;
}

std::vector<VectorFunctionLinearApproximation> linear_in_threes(const CppAdInterface& model,
                                                                const vector_t& x, const vector_t& p,
                                                                Eigen::Index nx) {
  const vector_t y = model.getFunctionValue(x, p);
  const matrix_t jacobian = model.getJacobian(x, p);
  std::vector<VectorFunctionLinearApproximation> all;
  for (Eigen::Index i = 0; i < y.size(); i += 3) {
    VectorFunctionLinearApproximation a;
    a.f = y.segment<3>(i);
    a.dfdx = jacobian.block(i, 0, 3, nx);
    if (x.size() > nx) a.dfdu = jacobian.block(i, nx, 3, x.size() - nx);
    all.push_back(a);
  }
  return all;
}

vector_t one_after_the_other(const vector_t& state, const vector_t& input) {
  vector_t x(state.size() + input.size());
  x << state, input;
  return x;
}

}  // namespace

EndEffectorKinematicsCppAd::EndEffectorKinematicsCppAd(dynamics::Model<double> robot,
                                                       std::shared_ptr<const StateInputMapping> mapping,
                                                       std::vector<std::string> endEffectorIds,
                                                       std::size_t stateDim, std::size_t inputDim,
                                                       std::string modelName, std::string modelFolder,
                                                       bool recompileLibraries, bool verbose, int)
    : shared_(std::make_shared<Shared>()) {
  for (const std::string& id : endEffectorIds) shared_->frames.push_back(robot.frame_index(id));
  shared_->robot = std::move(robot);
  shared_->mapping = std::move(mapping);
  shared_->ids = std::move(endEffectorIds);
  shared_->state_dim = stateDim;
  shared_->input_dim = inputDim;
  shared_->name = std::move(modelName);
  shared_->folder = std::move(modelFolder);
  shared_->recompile = recompileLibraries;
  shared_->verbose = verbose;
}

std::unique_ptr<const CppAdInterface> EndEffectorKinematicsCppAd::made(
    CppAdInterface::ad_parameterized_function_t function, std::size_t n, std::size_t n_p,
    const char* suffix) const {
  auto model =
      std::make_unique<CppAdInterface>(std::move(function), n, n_p, shared_->name + suffix, shared_->folder,
                                       AdFunction::defaultCompileFlags(), nullptr, 0);
  if (shared_->recompile) {
    model->createModels(CppAdInterface::ApproximationOrder::First, shared_->verbose);
  } else {
    model->loadModelsIfAvailable(CppAdInterface::ApproximationOrder::First, shared_->verbose);
  }
  return model;
}

const CppAdInterface& EndEffectorKinematicsCppAd::position() const {
  Shared& s = *shared_;
  std::call_once(s.position_once, [&] {
    const auto record = [&s](const ad_vector_t& x, const ad_vector_t&, ad_vector_t& y) {
      const MovedRobot moved(s.robot, s.mapping->getJointPosition(x), {});
      y.resize(3 * std::ssize(s.frames));
      for (std::size_t k = 0; k < s.frames.size(); ++k)
        y.segment<3>(3 * static_cast<Eigen::Index>(k)) =
            frame_placement(moved.model, moved.data, s.frames[k]).p;
    };
    s.position = made(record, s.state_dim, 0, "_position");
  });
  return *s.position;
}

const CppAdInterface& EndEffectorKinematicsCppAd::velocity() const {
  Shared& s = *shared_;
  std::call_once(s.velocity_once, [&] {
    const auto record = [&s](const ad_vector_t& x, const ad_vector_t&, ad_vector_t& y) {
      const ad_vector_t state = x.head(static_cast<Eigen::Index>(s.state_dim));
      const ad_vector_t input = x.tail(static_cast<Eigen::Index>(s.input_dim));
      const MovedRobot moved(s.robot, s.mapping->getJointPosition(state),
                             s.mapping->getJointVelocity(state, input));
      y.resize(3 * std::ssize(s.frames));
      for (std::size_t k = 0; k < s.frames.size(); ++k)
        y.segment<3>(3 * static_cast<Eigen::Index>(k)) =
            frame_velocity(moved.model, moved.data, s.frames[k], dynamics::ReferenceFrame::kLocalWorldAligned)
                .linear;
    };
    s.velocity = made(record, s.state_dim + s.input_dim, 0, "_velocity");
  });
  return *s.velocity;
}

const CppAdInterface& EndEffectorKinematicsCppAd::orientation() const {
  Shared& s = *shared_;
  std::call_once(s.orientation_once, [&] {
    const auto record = [&s](const ad_vector_t& x, const ad_vector_t& p, ad_vector_t& y) {
      const MovedRobot moved(s.robot, s.mapping->getJointPosition(x), {});
      y.resize(3 * std::ssize(s.frames));
      for (std::size_t k = 0; k < s.frames.size(); ++k) {
        const auto i = static_cast<Eigen::Index>(k);
        const auto q = dynamics::quaternion(frame_placement(moved.model, moved.data, s.frames[k]).R);
        const Eigen::Matrix<AD, 3, 1> v = q.template head<3>(), r = p.segment<3>(4 * i);
        y.segment<3>(3 * i) = q[3] * r - p[4 * i + 3] * v + v.cross(r);
      }
    };
    s.orientation = made(record, s.state_dim, 4 * s.frames.size(), "_orientation");
  });
  return *s.orientation;
}

// (4 a frame) x y z w.
vector_t EndEffectorKinematicsCppAd::references(const std::vector<quaternion_t>& of) const {
  if (of.size() != shared_->ids.size())
    throw ArgumentError("getOrientationError of \"" + shared_->name + "\": " + std::to_string(of.size()) +
                        " reference orientations, expected " + std::to_string(shared_->ids.size()));
  vector_t p(4 * std::ssize(of));
  for (std::size_t k = 0; k < of.size(); ++k) p.segment<4>(4 * static_cast<Eigen::Index>(k)) = of[k].coeffs();
  return p;
}

std::vector<vector3_t> EndEffectorKinematicsCppAd::getPosition(const vector_t& state) const {
  return in_threes(position().getFunctionValue(state));
}

std::vector<vector3_t> EndEffectorKinematicsCppAd::getVelocity(const vector_t& state,
                                                               const vector_t& input) const {
  return in_threes(velocity().getFunctionValue(one_after_the_other(state, input)));
}

std::vector<vector3_t> EndEffectorKinematicsCppAd::getOrientationError(
    const vector_t& state, const std::vector<quaternion_t>& referenceOrientations) const {
  return in_threes(orientation().getFunctionValue(state, references(referenceOrientations)));
}

std::vector<VectorFunctionLinearApproximation> EndEffectorKinematicsCppAd::getPositionLinearApproximation(
    const vector_t& state) const {
  return linear_in_threes(position(), state, {}, state.size());
}

std::vector<VectorFunctionLinearApproximation> EndEffectorKinematicsCppAd::getVelocityLinearApproximation(
    const vector_t& state, const vector_t& input) const {
  return linear_in_threes(velocity(), one_after_the_other(state, input), {}, state.size());
}

std::vector<VectorFunctionLinearApproximation>
EndEffectorKinematicsCppAd::getOrientationErrorLinearApproximation(
    const vector_t& state, const std::vector<quaternion_t>& referenceOrientations) const {
  return linear_in_threes(orientation(), state, references(referenceOrientations), state.size());
}

}  // namespace dyntape::ocs2
