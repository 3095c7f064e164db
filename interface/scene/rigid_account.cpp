// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/scene/rigid_account.h>

#include <dyntape/interface/scene/step_doubts.h>

namespace dyntape {

using Eigen::VectorXd;

RigidAccount::RigidAccount(const Scene& scene, EnergyMeter& meter) : scene_(scene), meter_(meter) {
  const SceneConstraints& constraints = scene.robot.constraints;
  const std::vector<dynamics::ContactBlock> blocks = dynamics::blocks_of(constraints.rigid);
  Eigen::Index rows = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    rows += blocks[i].rows;
    if (i < constraints.rigid.contacts.size()) contact_rows_ = rows;
  }
  work_ = VectorXd::Zero(meter.flows() + Eigen::Index(names(constraints).size()));
  reactions_ = VectorXd::Zero(rows);
}

std::vector<std::string> RigidAccount::names(const SceneConstraints& constraints) {
  std::vector<std::string> names;
  if (!constraints.rigid.contacts.empty()) names.emplace_back("rigid contacts");
  if (!constraints.rigid.stops.empty()) names.emplace_back("hard limits");
  return names;
}

// Of contacts, and of stops, to where their flows are.
void RigidAccount::add_rows(const VectorXd& products, Eigen::Ref<VectorXd> sums) const {
  Eigen::Index flow = meter_.flows();
  const Eigen::Index stops = products.size() - contact_rows_;
  if (contact_rows_ > 0) sums[flow++] += products.head(contact_rows_).sum();
  if (stops > 0) sums[flow] += products.tail(stops).sum();
}

void RigidAccount::add_powers(RigidStepper& rigid, const VectorXd& x, const VectorXd& u,
                              const VectorXd& forces, double weight) {
  const Energy& energy = meter_.at(x, drive_in(scene_, x, u));
  work_.head(meter_.flows()) += weight * energy.power;
  released_ += weight * energy.released;
  add_rows(weight * forces.cwiseProduct(rigid.functions().near(x).u), work_);
}

void RigidAccount::add(RigidStepper& rigid, const VectorXd& u, double h) {
  reactions_.setZero();
  for (const RigidPiece& piece : rigid.pieces()) {
    const double sixth = piece.h / 6;
    add_powers(rigid, piece.begin, u, piece.forces, sixth);
    add_powers(rigid, piece.middle, u, piece.forces, 4 * sixth);
    add_powers(rigid, piece.end, u, piece.forces, sixth);
    reactions_ += piece.h / h * piece.forces;
  }
  for (const RigidImpact& impact : rigid.impacts()) {
    add_rows(impact.p.cwiseProduct(impact.u_sum) / 2, work_);
    reactions_ += impact.p / h;
    impacts_ += long(impact.hit.size());
  }
}

}  // namespace dyntape
