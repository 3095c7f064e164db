// SPDX-License-Identifier: BSD-3-Clause
#include <pinocchio/algorithm/center-of-mass.hpp>
#include <pinocchio/algorithm/centroidal-derivatives.hpp>
#include <pinocchio/algorithm/centroidal.hpp>
#include <pinocchio/algorithm/energy.hpp>
#include <pinocchio/algorithm/frames-derivatives.hpp>
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/kinematics-derivatives.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/rnea-derivatives.hpp>

#include "pinocchio_types.h"

namespace peer {

std::vector<Function> body_functions() {
  return {
      {"energy",
       [](Peer& p, const State& s) {
         pin::computeKineticEnergy(p.model, p.data, s.q, s.v);
         pin::computePotentialEnergy(p.model, p.data, s.q);
       },
       [](Peer& p, Writer& to) { to(p.data.kinetic_energy), to(p.data.potential_energy); }},
      {"gravity-derivatives",
       [](Peer& p, const State& s) {
         p.data.dtau_dq.setZero();
         pin::computeGeneralizedGravityDerivatives(p.model, p.data, s.q, p.data.dtau_dq);
       },
       [](Peer& p, Writer& to) { to.block(p.data.dtau_dq); }},
      {"frame-placement",
       [](Peer& p, const State& s) {
         pin::forwardKinematics(p.model, p.data, s.q);
         pin::updateFramePlacement(p.model, p.data, p.frame);
       },
       [](Peer& p, Writer& to) {
         to.block(p.data.oMf[p.frame].rotation());
         to.block(p.data.oMf[p.frame].translation());
       }},
      {"frame-velocity",
       [](Peer& p, const State& s) {
         pin::forwardKinematics(p.model, p.data, s.q, s.v);
         p.motion = pin::getFrameVelocity(p.model, p.data, p.frame, p.in);
       },
       [](Peer& p, Writer& to) { to.block(p.motion.toVector()); }},
      {"frame-acceleration",
       [](Peer& p, const State& s) {
         pin::forwardKinematics(p.model, p.data, s.q, s.v, s.w);
         p.motion = pin::getFrameAcceleration(p.model, p.data, p.frame, p.in);
         p.classical = pin::getFrameClassicalAcceleration(p.model, p.data, p.frame, p.in);
       },
       [](Peer& p, Writer& to) { to.block(p.motion.toVector()), to.block(p.classical.toVector()); }},
      {"frame-jacobian",
       [](Peer& p, const State& s) {
         p.J.setZero();
         pin::computeFrameJacobian(p.model, p.data, s.q, p.frame, p.in, p.J);
       },
       [](Peer& p, Writer& to) { to.block(p.J); }},
      {"frame-jacobian-rate",
       [](Peer& p, const State& s) {
         pin::computeJointJacobiansTimeVariation(p.model, p.data, s.q, s.v);
         p.J.setZero();
         pin::getFrameJacobianTimeVariation(p.model, p.data, p.frame, p.in, p.J);
       },
       [](Peer& p, Writer& to) { to.block(p.J); }},
      // In the world's axes at the frame its derivatives by q are wrong.
      {"frame-velocity-derivatives",
       [](Peer& p, const State& s) {
         pin::computeForwardKinematicsDerivatives(p.model, p.data, s.q, s.v, Vector::Zero(p.model.nv));
         p.dV_dq.setZero(), p.J.setZero();
         pin::getFrameVelocityDerivatives(p.model, p.data, p.frame, p.in, p.dV_dq, p.J);
       },
       [](Peer& p, Writer& to) { to.block(p.dV_dq), to.block(p.J); }},
      {"com", [](Peer& p, const State& s) { pin::centerOfMass(p.model, p.data, s.q, false); },
       [](Peer& p, Writer& to) { to.block(p.data.com[0]); }},
      {"com-jacobian",
       [](Peer& p, const State& s) { pin::jacobianCenterOfMass(p.model, p.data, s.q, false); },
       [](Peer& p, Writer& to) { to.block(p.data.Jcom); }},
      {"centroidal-momentum",
       [](Peer& p, const State& s) { pin::computeCentroidalMomentum(p.model, p.data, s.q, s.v); },
       [](Peer& p, Writer& to) { to.block(p.data.hg.toVector()); }},
      {"centroidal-momentum-rate",
       [](Peer& p, const State& s) {
         pin::computeCentroidalMomentumTimeVariation(p.model, p.data, s.q, s.v, s.w);
       },
       [](Peer& p, Writer& to) { to.block(p.data.dhg.toVector()); }},
      {"centroidal-matrix", [](Peer& p, const State& s) { pin::computeCentroidalMap(p.model, p.data, s.q); },
       [](Peer& p, Writer& to) { to.block(p.data.Ag); }},
      // Its computeCentroidalMapTimeVariation gives a matrix that only times v is right.
      {"centroidal-matrix-rate", [](Peer& p, const State& s) { pin::dccrba(p.model, p.data, s.q, s.v); },
       [](Peer& p, Writer& to) { to.block(p.data.dAg); }},
      {"centroidal-derivatives",
       [](Peer& p, const State& s) {
         pin::computeCentroidalDynamicsDerivatives(p.model, p.data, s.q, s.v, s.w, p.dh_dq, p.dh_dot_dq,
                                                   p.dh_dot_dv, p.dh_dot_da);
       },
       [](Peer& p, Writer& to) { to.block(p.dh_dot_dq), to.block(p.dh_dot_dv), to.block(p.dh_dot_da); }},
  };
}

}  // namespace peer
