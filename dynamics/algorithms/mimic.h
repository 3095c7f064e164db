// SPDX-License-Identifier: BSD-3-Clause
//
// Mimic joints: q_follower = multiplier q_leader + offset.
//
//   UrdfRobot hand = read_urdf("hand.urdf", {.mimic = true});
//   MimicModel<double> model(hand.model, hand.mimics);         // nq, nv: without the followers
//   Data<double> data(model.full);
//   data.following = following(model);                         // for forward dynamics: following.h
//   VectorX<double> q = expand_configuration(model, q_short);  // and v, a by expand_tangent
//   VectorX<double> tau = gather(model, rnea(model.full, data, q, v, a));      // (nv)
//
// Every algorithm runs on the full model: expand its arguments, gather its results; accelerations are those of
// v_owners.  Short vectors hold the entries of all joints except followers, (nq) and (nv), in the order of the full
// model.  They are interchangeable with those of Pinocchio's models with mimic = True.
//
// With the constant matrix G (full.nv x nv) of the multipliers (docs/math.md J.3):
//   q_full = G q + offset   v_full = G v   a_full = G a        (on lines; angles of followers that turn)
//   tau = G^T tau_full      M = G^T M_full G                   (virtual work)
//   d tau/dx = G^T (d tau_full/dx) G                           (G is constant)
//   a = M^-1 (tau - h)      d a/dx = -M^-1 d tau/dx
// G has one entry per row and is stored as such.
//
// Followers and leaders are on a line (revolute, prismatic, helical) or rotate (continuous).  A continuous joint
// follows joints on a line, and other continuous joints with an integer multiplier.  A leader may follow another;
// chains are resolved to the first leader.
#pragma once

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/model/mimic_rules.h>

namespace dyntape::dynamics {

template <class T>
struct MimicModel {
  // ArgumentError for rules that check_mimic_rules refuses.
  MimicModel(const Model<T>& model, const std::vector<MimicRule>& rules);

  Model<T> full;
  std::vector<MimicRule> rules;  // each to the first leader of its chain
  std::string name;
  int nq = 0, nv = 0;
  std::vector<FollowedEntry> q_entries;  // (full.nq)
  std::vector<FollowedEntry> v_entries;  // (full.nv), offsets zero: the rows of G
  std::vector<int> q_owners, v_owners;   // (nq), (nv) the full entry of each short entry

  template <class S>
  MimicModel<S> cast() const {
    return {full.template cast<S>(), rules};
  }
};

// For Data::following of the full model; its forward dynamics are then those of the short vectors.
template <class T>
Following<T> following(const MimicModel<T>& model) {
  return {model.v_entries, model.nv};
}

// Converts between short and full vectors: expand applies G (plus offsets for a configuration), gather applies G^T.
template <class T>
VectorX<T> expand_configuration(const MimicModel<T>& model, const VectorRef<T>& q);
template <class T>
VectorX<T> expand_tangent(const MimicModel<T>& model, const VectorRef<T>& v);
template <class T>
VectorX<T> gather(const MimicModel<T>& model, const VectorRef<T>& tau_full);
template <class T>
MatrixX<T> gather_columns(const MimicModel<T>& model,
                          const MatrixX<T>& J_full);  // J G, for any number of rows
template <class T>
MatrixX<T> gather_both(const MimicModel<T>& model, const MatrixX<T>& D_full);  // G^T D G

// Like configuration.h.
template <class T>
VectorX<T> integrate(const MimicModel<T>& model, const VectorRef<T>& q, const VectorRef<T>& v);
// Leaders are within their own limits; limits of followers are ignored.
template <class T>
VectorX<T> random_configuration(const MimicModel<T>& model, std::mt19937_64& random);

}  // namespace dyntape::dynamics
