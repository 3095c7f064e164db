// SPDX-License-Identifier: BSD-3-Clause
#include <pinocchio/algorithm/aba-derivatives.hpp>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/regressor.hpp>
#include <pinocchio/algorithm/rnea-derivatives.hpp>
#include <pinocchio/algorithm/rnea-second-order-derivatives.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include "pinocchio_types.h"

namespace peer {

std::vector<Function> dynamics_functions() {
  return {
      {"rnea", [](Peer& p, const State& s) { pin::rnea(p.model, p.data, s.q, s.v, s.w); },
       [](Peer& p, Writer& to) { to.block(p.data.tau); }},
      {"nonlinear-effects", [](Peer& p, const State& s) { pin::nonLinearEffects(p.model, p.data, s.q, s.v); },
       [](Peer& p, Writer& to) { to.block(p.data.nle); }},
      {"gravity", [](Peer& p, const State& s) { pin::computeGeneralizedGravity(p.model, p.data, s.q); },
       [](Peer& p, Writer& to) { to.block(p.data.g); }},
      {"crba", [](Peer& p, const State& s) { pin::crba(p.model, p.data, s.q, pin::Convention::LOCAL); },
       [](Peer& p, Writer& to) { to.symmetric(p.data.M); }},
      {"crba@world", [](Peer& p, const State& s) { pin::crba(p.model, p.data, s.q, pin::Convention::WORLD); },
       [](Peer& p, Writer& to) { to.symmetric(p.data.M); }},
      {"aba",
       [](Peer& p, const State& s) { pin::aba(p.model, p.data, s.q, s.v, s.w, pin::Convention::LOCAL); },
       [](Peer& p, Writer& to) { to.block(p.data.ddq); }},
      {"aba@world",
       [](Peer& p, const State& s) { pin::aba(p.model, p.data, s.q, s.v, s.w, pin::Convention::WORLD); },
       [](Peer& p, Writer& to) { to.block(p.data.ddq); }},
      {"minverse", [](Peer& p, const State& s) { pin::computeMinverse(p.model, p.data, s.q); },
       [](Peer& p, Writer& to) { to.symmetric(p.data.Minv); }},
      {"id-derivatives",
       [](Peer& p, const State& s) { pin::computeRNEADerivatives(p.model, p.data, s.q, s.v, s.w); },
       [](Peer& p, Writer& to) {
         to.block(p.data.dtau_dq);
         to.block(p.data.dtau_dv);
         to.symmetric(p.data.M);
       }},
      {"fd-derivatives",
       [](Peer& p, const State& s) { pin::computeABADerivatives(p.model, p.data, s.q, s.v, s.w); },
       [](Peer& p, Writer& to) {
         to.block(p.data.ddq_dq);
         to.block(p.data.ddq_dv);
         to.symmetric(p.data.Minv);
       }},
      // The tensors are zeroed by the constructor of Data; entries that are zero by structure stay so.
      {"id-second-derivatives",
       [](Peer& p, const State& s) {
         pin::ComputeRNEASecondOrderDerivatives(p.model, p.data, s.q, s.v, s.w, p.data.d2tau_dqdq,
                                                p.data.d2tau_dvdv, p.data.d2tau_dqdv, p.data.d2tau_dadq);
       },
       [](Peer& p, Writer& to) {
         to.tensor(p.data.d2tau_dqdq);
         to.tensor(p.data.d2tau_dqdv);
         to.tensor(p.data.d2tau_dvdv);
         to.tensor(p.data.d2tau_dadq);
       }},
      {"torque-regressor",
       [](Peer& p, const State& s) { pin::computeJointTorqueRegressor(p.model, p.data, s.q, s.v, s.w); },
       [](Peer& p, Writer& to) { to.block(p.data.jointTorqueRegressor); }},
  };
}

}  // namespace peer
