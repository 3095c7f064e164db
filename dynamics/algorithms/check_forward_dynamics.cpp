// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algebra/float128.h>
#include <dyntape/dynamics/algorithms/check_forward_dynamics.h>
#include <dyntape/dynamics/model/configuration.h>

#include <dyntape/dynamics/algorithms/detail/checks.hxx>
#include <string>

namespace dyntape::dynamics {
namespace {

using Real = Float128;

// Inertia along one column: of everything beyond the joint held stiff, and with the joints beyond it free.
struct AlongJoint {
  Real stiff, free, about_any_axis;
};

bool is_zero(const AlongJoint& along) {
  const Real rounding_of_a_file(1e-15), rounding_of_real(1e-24);
  return along.stiff <= rounding_of_a_file * along.about_any_axis ||
         along.free <= rounding_of_real * along.stiff || along.stiff <= 0;
}

AlongJoint along_column(const Dof& S, const Composite<Real>& stiff, const Articulated<Real>& free,
                        const Real& armature) {
  const Real any = S.angular ? Real(stiff.I_o.trace()) : stiff.mass;
  return {dot(S, stiff * S) + armature, dot(S, free * S) + armature, any};
}

// A free-flyer's six directions by elimination, the mass first.
bool free_flyer_is_zero(const Composite<Real>& stiff, const Articulated<Real>& free) {
  if (stiff.mass <= 0) return true;
  Matrix6<Real> A;
  A << free.M, free.H, free.H.transpose(), free.J;
  const Vector3<Real> c = stiff.h / stiff.mass;
  const Matrix3<Real> about_com = stiff.I_o - unit_point_inertia(c) * stiff.mass;
  const Vector6<Real> pivots = Ldlt6<Real>(A).D_inverse.cwiseInverse();
  for (int k = 0; k < 6; ++k) {
    const Real any = k < 3 ? stiff.mass : Real(about_com.trace());
    const Real rounding = k < 3 ? Real(0) : Real(stiff.I_o.trace()) * Real(1e-24);
    if (!(pivots[k] > Real(1e-15) * any + rounding)) return true;
  }
  return false;
}

// Counts, per joint, at how many configurations it moves nothing.  A joint that does is held, so that the ones
// before it are judged by themselves.
void judge(const Model<Real>& model, Data<Real>& data, const DynamicsTerms<Real>& acting,
           std::vector<int>& zero_count) {
  for (int i = 0; i < model.njoints(); ++i) {
    data.composites[i] = composite(model.inertias[i]);
    data.articulated[i] = articulated(model.inertias[i]);
  }
  for (int i = model.njoints() - 1; i >= 0; --i) {
    const int p = model.parent[i];
    Articulated<Real> felt = data.articulated[i];
    if (data.tree.is_free(i)) {
      zero_count[i] += free_flyer_is_zero(data.composites[i], felt);
      felt = {};
    } else {
      const Real armature = detail::armature_at(model, acting, i);
      bool zero = false;
      for (int k = data.tree.first[i] + data.tree.count[i] - 1; k >= data.tree.first[i]; --k) {
        const Dof& S = data.tree.dofs[k];
        const AlongJoint along = along_column(S, data.composites[i], felt, armature);
        if (is_zero(along)) {
          zero = true;
        } else {
          felt = without(felt, S, felt * S, Real(1 / along.free), armature);
        }
      }
      zero_count[i] += zero;
    }
    if (p < 0) continue;
    accumulate(data.X_PB[i], data.composites[i], data.composites[p]);
    accumulate(data.X_PB[i], felt, data.articulated[p]);
  }
}

}  // namespace

void check_forward_dynamics(const Model<double>& model, const DynamicsTerms<double>& acting) {
  constexpr int kConfigurations = 3;
  const Model<Real> exact = model.cast<Real>();
  Data<Real> data(exact);
  detail::check_acting("check_forward_dynamics", model, acting);
  VectorX<Real> armature = VectorX<Real>::Zero(model.nv);
  for (int i = 0; i < model.njoints(); ++i) {
    if (is_single(model.joints[i].type))
      armature[model.joints[i].idx_v] = detail::armature_at(model, acting, i);
  }
  DynamicsTerms<Real> acting_exact;
  acting_exact.armature_values = &armature;
  std::mt19937_64 random(1);
  std::vector<int> zero_count(model.njoints(), 0);
  for (int n = 0; n < kConfigurations; ++n) {
    const VectorX<Real> q = random_configuration(model, random).cast<Real>();
    detail::place_joints<Real>(exact, data, q);
    judge(exact, data, acting_exact, zero_count);
  }
  for (int i = model.njoints() - 1; i >= 0; --i) {
    if (zero_count[i] < kConfigurations) continue;
    throw NumericalError(std::string("forward dynamics: ") + to_string(model.joints[i].type) + " joint \"" +
                         model.joints[i].name + "\" of model \"" + model.name +
                         "\" moves no inertia, so that a torque at it has no finite acceleration; give its "
                         "link an inertia along the joint, or the joint an armature");
  }
}

}  // namespace dyntape::dynamics
