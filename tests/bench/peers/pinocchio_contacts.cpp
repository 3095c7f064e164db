// SPDX-License-Identifier: BSD-3-Clause
#include <pinocchio/algorithm/constrained-dynamics-derivatives.hpp>
#include <pinocchio/algorithm/constrained-dynamics.hpp>

#include "pinocchio_types.h"

namespace peer {
namespace {

void solve(Peer& p, const State& s) {
  pin::constraintDynamics(p.model, p.data, s.q, s.v, s.w, p.contacts, p.contact_data, p.settings);
}

}  // namespace

void prepare_contacts(Peer& p) {
  p.contact_data.clear();
  for (const auto& contact : p.contacts) p.contact_data.push_back(contact.createData());
  pin::initConstraintDynamics(p.model, p.data, p.contacts, p.contact_data);
}

std::vector<Function> contact_functions() {
  return {
      {"constrained-dynamics", solve,
       [](Peer& p, Writer& to) { to.block(p.data.ddq), to.block(p.data.lambda_c); }},
      {"constrained-derivatives",
       [](Peer& p, const State& s) {
         solve(p, s);
         pin::computeConstraintDynamicsDerivatives(p.model, p.data, p.contacts, p.contact_data, p.settings);
       },
       [](Peer& p, Writer& to) {
         to.block(p.data.ddq_dq), to.block(p.data.ddq_dv), to.block(p.data.ddq_dtau);
         to.block(p.data.dlambda_dq), to.block(p.data.dlambda_dv), to.block(p.data.dlambda_dtau);
       }},
  };
}

}  // namespace peer
