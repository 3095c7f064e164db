// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/system/rigid/rigid_functions.h>

#include <dyntape/autodiff/record/record.h>

namespace dyntape {

namespace {

using dynamics::Data;
using dynamics::Model;

Function record_near(const RobotScene& scene) {
  const int nq = scene.model.nq, nv = scene.model.nv;
  return record(scene.model.name + "_near", std::size_t(nq + nv), [&](const VectorXad& x) {
    const Model<AD> model = scene.model.cast<AD>();
    Data<AD> data(model);
    const auto rows = dynamics::unilateral_rows<AD>(model, data, scene.constraints.rigid, x.head(nq));
    const VectorXad v = x.tail(nv);
    VectorXad y(rows.gap.size() + rows.J.rows());
    y << rows.gap, VectorXad(rows.J * v);
    return y;
  });
}

// M^-1, or the part of it that leaves the loops closed.
MatrixXad response_to_torques(const RobotScene& scene, const Model<AD>& model, const VectorXad& q) {
  Data<AD> data(model);
  const dynamics::Effects<AD> effects = scene.effects.cast<AD>();
  if (scene.constraints.loops.empty()) return dynamics::minverse<AD>(model, data, q, effects.acting());
  dynamics::ConstraintData<AD> loops(model, loops_of<AD>(scene.constraints));
  const VectorXad still = VectorXad::Constant(model.nv, AD(0));
  dynamics::impulse_dynamics<AD>(model, data, loops, q, still, AD(0), effects.acting());
  MatrixXad W = data.Minv;
  for (Eigen::Index k = 0; k < W.cols(); ++k) {
    VectorXad held = loops.K.row(k).transpose();
    loops.delassus.solve(held);
    W.col(k) -= loops.K * held;
  }
  return W;
}

Function record_response(const RobotScene& scene) {
  return record(scene.model.name + "_response", std::size_t(scene.model.nq), [&](const VectorXad& q) {
    const Model<AD> model = scene.model.cast<AD>();
    Data<AD> data(model);
    const MatrixXad J = dynamics::unilateral_rows<AD>(model, data, scene.constraints.rigid, q).J;
    const MatrixXad W = response_to_torques(scene, model, q);
    VectorXad y(J.size() + W.size());
    y << J.reshaped(), W.reshaped();
    return y;
  });
}

CompiledFunction values_of(const Function& function, CodegenOptions options) {
  options.order = Order::kValue;
  return CompiledFunction::make(function, options);
}

}  // namespace

RigidFunctions::RigidFunctions(const RobotScene& scene, const CodegenOptions& options)
    : near_(values_of(record_near(scene), options)),
      response_(values_of(record_response(scene), options)),
      of_near_(near_),
      of_response_(response_),
      y_near_(Eigen::Index(near_.n_y())),
      y_response_(Eigen::Index(response_.n_y())) {
  const Eigen::Index n = Eigen::Index(scene.constraints.rigid.size()), m = y_near_.size() - n;
  nearness_ = {Eigen::VectorXd(n), Eigen::VectorXd(m)};
  responses_ = {Eigen::MatrixXd(m, scene.model.nv), Eigen::MatrixXd(scene.model.nv, scene.model.nv)};
}

const Nearness& RigidFunctions::near(const Eigen::VectorXd& x) {
  near_.value(x.data(), nullptr, y_near_.data(), of_near_);
  nearness_.gap = y_near_.head(nearness_.gap.size());
  nearness_.u = y_near_.tail(nearness_.u.size());
  return nearness_;
}

const RigidResponse& RigidFunctions::response(const Eigen::VectorXd& x) {
  response_.value(x.data(), nullptr, y_response_.data(), of_response_);
  responses_.J.reshaped() = y_response_.head(responses_.J.size());
  responses_.W.reshaped() = y_response_.tail(responses_.W.size());
  return responses_;
}

}  // namespace dyntape
