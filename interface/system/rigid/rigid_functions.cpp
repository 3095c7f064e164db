// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/system/rigid/rigid_functions.h>

#include <dyntape/autodiff/record/record.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

using dynamics::Data;
using dynamics::Model;

// The scene with its parameters in place.
struct EditedScene {
  const RobotScene& scene;
  int n_p;
  const SceneEdit& edit;

  RecordedScene at(const VectorXad& p) const {
    RecordedScene now = recorded(scene);
    if (edit) edit(now, p);
    return now;
  }
};

Function record_near(const EditedScene& edited) {
  const RobotScene& scene = edited.scene;
  const int nq = scene.model.nq, nv = scene.model.nv;
  const auto near = [&](const VectorXad& x, const VectorXad& p) {
    const Model<AD> model = edited.at(p).model;
    Data<AD> data(model);
    const auto rows = dynamics::unilateral_rows<AD>(model, data, scene.constraints.rigid, x.head(nq));
    const VectorXad v = x.tail(nv);
    VectorXad y(rows.gap.size() + rows.J.rows());
    y << rows.gap, VectorXad(rows.J * v);
    return y;
  };
  return record(scene.model.name + "_near", std::size_t(nq + nv), std::size_t(edited.n_p), near);
}

// M^-1, or the part of it that leaves the loops closed.
MatrixXad response_to_torques(const SceneConstraints& constraints, const Ties& ties, const RecordedScene& now,
                              const VectorXad& q) {
  const auto& [model, effects] = now;
  Data<AD> data(model);
  data.following = ties.following<AD>();
  if (constraints.loops.empty()) return dynamics::minverse<AD>(model, data, q, effects.acting());
  dynamics::ConstraintData<AD> loops(model, loops_of<AD>(constraints));
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

Function record_response(const EditedScene& edited) {
  const RobotScene& scene = edited.scene;
  const Ties ties = ties_of(scene);
  const auto response = [&](const VectorXad& q, const VectorXad& p) {
    const RecordedScene now = edited.at(p);
    Data<AD> data(now.model);
    const MatrixXad J = dynamics::unilateral_rows<AD>(now.model, data, scene.constraints.rigid, q).J;
    const MatrixXad W = response_to_torques(scene.constraints, ties, now, q);
    VectorXad y(J.size() + W.size());
    y << J.reshaped(), W.reshaped();
    return y;
  };
  return record(scene.model.name + "_response", std::size_t(scene.model.nq), std::size_t(edited.n_p),
                response);
}

CompiledFunction values_of(const Function& function, CodegenOptions options) {
  options.order = Order::kValue;
  return CompiledFunction::make(function, options);
}

}  // namespace

std::string contact_text(const dynamics::UnilateralConstraints& rigid, std::size_t i) {
  return (i < rigid.contacts.size() ? "the contact at '" : "joint '") + rigid.name(i) + "'";
}

std::string depth_text(const dynamics::UnilateralConstraints& rigid, std::size_t i, double depth,
                       int digits) {
  return contact_text(rigid, i) + " is " + io::with_digits(depth, digits) +
         (i < rigid.contacts.size() ? " m below its ground" : " beyond its limit");
}

RigidFunctions::RigidFunctions(const RobotScene& scene, const CodegenOptions& options, int n_p,
                               const SceneEdit& edit)
    : near_(values_of(record_near({scene, n_p, edit}), options)),
      response_(values_of(record_response({scene, n_p, edit}), options)),
      of_near_(near_),
      of_response_(response_),
      y_near_(Eigen::Index(near_.n_y())),
      y_response_(Eigen::Index(response_.n_y())) {
  const Eigen::Index n = Eigen::Index(scene.constraints.rigid.size()), m = y_near_.size() - n;
  nearness_ = {Eigen::VectorXd(n), Eigen::VectorXd(m)};
  responses_ = {Eigen::MatrixXd(m, scene.model.nv), Eigen::MatrixXd(scene.model.nv, scene.model.nv)};
}

RigidFunctions::RigidFunctions(const RigidFunctions& other)
    : near_(other.near_),
      response_(other.response_),
      of_near_(near_),
      of_response_(response_),
      nearness_(other.nearness_),
      responses_(other.responses_),
      y_near_(other.y_near_),
      y_response_(other.y_response_),
      p_(other.p_) {}

const Nearness& RigidFunctions::near(const Eigen::VectorXd& x) {
  near_.value(x.data(), p_.data(), y_near_.data(), of_near_);
  nearness_.gap = y_near_.head(nearness_.gap.size());
  nearness_.u = y_near_.tail(nearness_.u.size());
  return nearness_;
}

const RigidResponse& RigidFunctions::response(const Eigen::VectorXd& x) {
  response_.value(x.data(), p_.data(), y_response_.data(), of_response_);
  responses_.J.reshaped() = y_response_.head(responses_.J.size());
  responses_.W.reshaped() = y_response_.tail(responses_.W.size());
  return responses_;
}

}  // namespace dyntape
