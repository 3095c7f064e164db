// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/simulate/rigid_account.h>

namespace dyntape {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

int joint_with_dof(const dynamics::Model<double>& model, int dof) {
  int joint = 0;
  while (joint + 1 < model.njoints() && model.joints[std::size_t(joint + 1)].idx_v <= dof) ++joint;
  return joint;
}

}  // namespace

RigidAccount::RigidAccount(const Scene& scene, EnergyMeter& meter)
    : of_steps_(scene, meter), nq_(scene.robot.model.nq), flows_(Eigen::Index(meter.layout().flows.size())) {
  const SceneConstraints& constraints = scene.robot.constraints;
  const auto& [contacts, stops] = constraints.rigid;
  const std::vector<dynamics::ContactBlock> blocks = dynamics::blocks_of(constraints.rigid);
  const std::vector<int> place = mechanism_of_joints(meter.layout().mechanisms, scene.robot.model.njoints());
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const bool is_contact = i < contacts.size();
    const int joint =
        is_contact ? contacts[i].body : joint_with_dof(scene.robot.model, stops[i - contacts.size()].idx_v);
    const Eigen::Index flow = flows_ + (is_contact || contacts.empty() ? 0 : 1);
    for (int k = 0; k < blocks[i].rows; ++k) {
      row_flow_.push_back(flow);
      row_mechanism_.push_back(joint < 0 ? 0 : place[std::size_t(joint)]);
    }
  }
  const auto n = Eigen::Index(meter.layout().mechanisms.size());
  work_ = MatrixXd::Zero(flows_ + Eigen::Index(names(constraints).size()), n);
  reactions_ = VectorXd::Zero(Eigen::Index(row_flow_.size()));
}

std::vector<std::string> RigidAccount::names(const SceneConstraints& constraints) {
  std::vector<std::string> names;
  if (!constraints.rigid.contacts.empty()) names.emplace_back("rigid contacts");
  if (!constraints.rigid.stops.empty()) names.emplace_back("hard limits");
  return names;
}

// Of contacts, and of stops, to where their flows are.
void RigidAccount::add_rows(const VectorXd& products) {
  for (std::size_t i = 0; i < row_flow_.size(); ++i)
    work_(row_flow_[i], row_mechanism_[i]) += products[Eigen::Index(i)];
}

// Of the rows: those that the forces of a piece act along.
VectorXd RigidAccount::mean_velocities(RigidFunctions& functions, const RigidPiece& piece,
                                       const VectorXd& u) const {
  if (!of_steps_.has_stage()) {
    VectorXd mean = functions.near(piece.begin).u / 6;
    mean += 4 * functions.near(piece.middle).u / 6;
    return mean + functions.near(piece.end).u / 6;
  }
  auto [x, along] = of_steps_.stage_of(piece.begin, piece.end, u, piece.h);
  x.segment(nq_, along.size()) = along;
  return functions.near(x).u;
}

void RigidAccount::add(RigidStepper& rigid, const VectorXd& u, double h, const VectorXd& p) {
  reactions_.setZero();
  for (const RigidPiece& piece : rigid.pieces()) {
    work_.topRows(flows_) += of_steps_.between({piece.begin, piece.middle, piece.end}, u, piece.h, p);
    add_rows(piece.h * piece.forces.cwiseProduct(mean_velocities(rigid.functions(), piece, u)));
    reactions_ += piece.h / h * piece.forces;
  }
  for (const RigidImpact& impact : rigid.impacts()) {
    add_rows(impact.p.cwiseProduct(impact.u_sum) / 2);
    reactions_ += impact.p / h;
    impacts_ += long(impact.hit.size());
  }
}

}  // namespace dyntape
