// SPDX-License-Identifier: BSD-3-Clause
//
// Mimic joints in the full model's vectors: v = G w with one entry in each row of G.
//
//   MimicModel<double> hand(model, rules);         // mimic.h
//   Data<double> data(model);
//   data.following = following(hand);
//   aba(model, data, q, v, tau);                   // data.ddq = G a: mimic joints keep their rules
//
// If Data::following is set, forward dynamics is that of the joints without followers:
//   Minv = G (G^T M G)^-1 G^T        ddq = Minv (tau - h)
// replace M^-1 and M^-1 (tau - h) in aba, minverse and fd_derivatives, and through these in second order,
// constraints, impacts, operational space and effects.  Only G^T tau matters of the torques.  q and v must satisfy
// the rules (expand_configuration, expand_tangent).  G^T M G is factorised directly: unlike articulated inertias
// this loses digits if it is badly conditioned (inertia_condition.h).  Derivatives are with respect to the full
// coordinates with G fixed; their columns times G are derivatives by w.  Source: docs/math.md (J.16).
#pragma once

#include <dyntape/dynamics/algebra/scalar.h>
#include <dyntape/dynamics/model/joints.h>

#include <cmath>
#include <tuple>
#include <utility>
#include <vector>

namespace dyntape::dynamics {

// The rule of an entry of a full vector.
struct FollowedEntry {
  enum class Is {
    kNumber,       // factor x[index] + offset
    kPairOfAngle,  // with the next entry (cos, sin) of factor x[index] + offset
    kPairOfPair,  // with the next entry (cos, sin) of factor angle + offset, (cos, sin) of the angle, of any length, at
                  // x[index]; the factor is whole, so that turns of the angle do not matter
    kSecondOfPair
  };
  int index = 0;
  double factor = 1, offset = 0;
  Is is = Is::kNumber;
};

template <class T>
struct Following {
  // entries (nv of the full model), n: entries of w.
  Following(std::vector<FollowedEntry> entries, int n)
      : entries(std::move(entries)),
        L(MatrixX<T>::Zero(n, n)),
        inverse(MatrixX<T>::Zero(n, n)),
        D_inverse(VectorX<T>::Zero(n)),
        x(VectorX<T>::Zero(n)) {}

  std::vector<FollowedEntry> entries;  // the rows of G

  // Working memory.
  MatrixX<T> L, inverse;    // (n x n) unit lower triangle of G^T M G = L^T D L; its inverse
  VectorX<T> D_inverse, x;  // (n)
};

namespace detail {

// The structure is decided on plain numbers: a factor of one adds no product.
template <class T>
T scaled(const T& x, double factor) {
  return factor == 1 ? x : T(x * T(factor));
}

// factor x[index] + offset.
template <class T>
T followed(const FollowedEntry& entry, const VectorRef<T>& x) {
  T value = scaled<T>(x[entry.index], entry.factor);
  if (entry.offset != 0) value += T(entry.offset);
  return value;
}

// (cos, sin) of factor angle + offset by repeated products of the pair: no angle is computed, so nothing jumps.
template <class T>
std::pair<T, T> followed_pair(const FollowedEntry& entry, const VectorRef<T>& x) {
  const auto [cos_angle, sin_angle] = direction<T>(x[entry.index], x[entry.index + 1]);
  const T step = entry.factor < 0 ? T(-sin_angle) : sin_angle;
  T c(std::cos(entry.offset)), s(std::sin(entry.offset));
  for (double turned = 0; turned < std::abs(entry.factor); ++turned) {
    const T before = c;
    c = before * cos_angle - s * step;
    s = s * cos_angle + before * step;
  }
  return {c, s};
}

// G x plus offsets.
template <class T>
void expand(const std::vector<FollowedEntry>& entries, const VectorRef<T>& x, VectorX<T>& full) {
  for (size_t k = 0; k < entries.size(); ++k) {
    switch (entries[k].is) {
      case FollowedEntry::Is::kNumber:
        full[k] = followed<T>(entries[k], x);
        break;
      case FollowedEntry::Is::kPairOfAngle:
        sincos(followed<T>(entries[k], x), full[k + 1], full[k]);
        break;
      case FollowedEntry::Is::kPairOfPair:
        std::tie(full[k], full[k + 1]) = followed_pair<T>(entries[k], x);
        break;
      case FollowedEntry::Is::kSecondOfPair:
        break;
    }
  }
}

}  // namespace detail

}  // namespace dyntape::dynamics
