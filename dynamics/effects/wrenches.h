// SPDX-License-Identifier: BSD-3-Clause
//
// External wrenches on the bodies of a robot, constant in the body or in the world, and their derivatives.
//
//   std::vector<Wrench<double>> wrenches = {
//       wrench_at_frame(model, model.frame_index("tool"), FixedIn::kWorld, {{0, 0, -20}, {0, 0, 0}})};
//   WrenchTorques<double> w(model);                              // results and working memory, beside Data
//   VectorX<double> tau = wrench_torques(model, data, w, wrenches, q);    // sum of J^T F
//
// A wrench acts at the origin of a frame F on a body: (force, moment about that origin), constant in
//   kBody    the axes of F: a thruster, a propeller
//   kWorld   the axes of the world: wind, a rope, a weight, a contact force
// Both have the same torques if the axes agree, but different derivatives.  For column S of joint j, with S the same
// motion in F:
//   d(J^T F) of F in its own axes: 0 (kBody),   - (s x f, s x n), s the angular part of S (kWorld);
//   for the joints before j also the change of the lever arms: + S x* F.
// dtau/dq of inverse dynamics with wrenches is that without, minus the derivative of sum J^T F.  The results depend
// on rotations of the robot, not on its position.  Source: docs/math.md (C.19 to C.25).
#pragma once

#include <dyntape/dynamics/algorithms/data.h>
#include <dyntape/dynamics/effects/parameters.h>

#include <vector>

namespace dyntape::dynamics {

enum class FixedIn { kBody, kWorld };

template <class T>
struct Wrench {
  int body = -1;      // joint index of the body; -1: the world, which does not move
  Placement<T> X_BF;  // the frame F in the body
  FixedIn fixed_in = FixedIn::kBody;
  Force<T> value;  // N, N m

  template <class Self, class Visit>
  static void visit_parameters(Self& self, Visit&& visit) {
    visit(ParameterInfo{.name = "fixed_in",
                        .unit = "",
                        .what = "axes of force and moment: the link's, or the world's",
                        .choices = "body world"},
          self.fixed_in);
    visit(ParameterInfo{.name = "force", .unit = "N", .what = "force at the link's origin", .fallback = 0},
          self.value.linear);
    visit(
        ParameterInfo{
            .name = "moment", .unit = "N m", .what = "moment about the link's origin", .fallback = 0},
        self.value.angular);
  }
  template <class S>
  Wrench<S> cast() const {
    return detail::cast_effect<S>(*this);
  }
};

// Places a wrench at a frame of the model; ArgumentError if the frame does not exist.
template <class T>
Wrench<T> wrench_at_frame(const Model<T>& model, int frame, FixedIn fixed_in,
                          const std::type_identity_t<Force<T>>& value);

// The sum of the wrenches on some bodies, and its change if these bodies turn, for wrenches fixed in the world: f,
// n, and P = sum of r f^T with points r.
template <class T>
struct WrenchSum {
  Force<T> all;
  Vector3<T> f = Vector3<T>::Zero(), n = Vector3<T>::Zero();
  Matrix3<T> P = Matrix3<T>::Zero();
};

template <class T>
struct WrenchTorques {
  explicit WrenchTorques(const Model<T>& model)
      : tau(VectorX<T>::Zero(model.nv)),
        dtau_dq(MatrixX<T>::Zero(model.nv, model.nv)),
        sums(model.njoints()) {}

  VectorX<T> tau;      // (nv) sum of J^T F
  MatrixX<T> dtau_dq;  // (nv x nv) its derivative

  // Working memory.
  std::vector<WrenchSum<T>> sums;  // of body i and all bodies beyond it, in frame i
};

// After forward_kinematics: adds to w.sums, which must be zero before the first call.
template <class T>
void add_wrench(const Data<T>& data, WrenchTorques<T>& w, const Wrench<T>& wrench);

// Wrenches as an effect (effects.h).  Supply or dissipate energy.
template <class T>
struct Wrenches : EffectList<Wrench<T>> {
  static constexpr const char *kName = "wrenches", *kKey = "wrenches", *kItem = "wrench";
  using EffectList<Wrench<T>>::EffectList;

  template <class Self, class Visit>
  static void visit_parameters(Self&, Visit&&) {}
  // After forward_kinematics.
  void add_wrenches(const Data<T>& data, WrenchTorques<T>& w) const {
    for (const Wrench<T>& wrench : *this) add_wrench(data, w, wrench);
  }
};

// Computes w.tau; also data.X_WB.
template <class T>
const VectorX<T>& wrench_torques(const Model<T>& model, Data<T>& data, WrenchTorques<T>& w,
                                 const std::vector<Wrench<T>>& wrenches, const VectorRef<T>& q);
// Computes w.dtau_dq and w.tau; also data.X_WB.
template <class T>
const MatrixX<T>& wrench_torque_derivatives(const Model<T>& model, Data<T>& data, WrenchTorques<T>& w,
                                            const std::vector<Wrench<T>>& wrenches, const VectorRef<T>& q);

}  // namespace dyntape::dynamics
