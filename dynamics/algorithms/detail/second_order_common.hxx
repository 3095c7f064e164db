// SPDX-License-Identifier: BSD-3-Clause
//
// What both forms of second derivatives start from: docs/math.md (H.1) to (H.4).
#pragma once

#include <dyntape/dynamics/algorithms/second_order_common.h>
#include <dyntape/dynamics/algorithms/detail/checks.hxx>
#include <dyntape/dynamics/algorithms/detail/columns.hxx>

#include <algorithm>

namespace dyntape::dynamics {
namespace detail {

// Three entries of one group of columns.
template <class T>
struct ThreeLanes {
  using Vector = typename Lanes<T>::Vector;
  Vector x, y, z;

  template <class Group>
  DYNTAPE_INLINE ThreeLanes(const T* from, std::ptrdiff_t stride, const Group& lanes)
      : x(lanes.load(from)), y(lanes.load(from + stride)), z(lanes.load(from + 2 * stride)) {}
  DYNTAPE_INLINE Vector dot(const Vector3<T>& a) const { return x * a.at(0) + y * a.at(1) + z * a.at(2); }
};

// S x of joint i.
template <class T>
Motion<T> along_columns(const Tree& tree, const VectorRef<T>& x, int i) {
  Motion<T> m;
  for (int k = tree.first[i]; k < tree.first[i] + tree.count[i]; ++k) add_along(tree.dofs[k], x[k], m);
  return m;
}

// From the roots: motions of the bodies and what they make of each column.
template <class T>
void move_columns(const Model<T>& model, const Data<T>& data, MovingBodies<T>& b, const VectorRef<T>& v,
                  const VectorRef<T>& a, const DynamicsTerms<T>& acting) {
  const Tree& tree = data.tree;
  for (int i = 0; i < model.njoints(); ++i) {
    const int p = model.parent[i];
    Motion<T> a_p;
    if (p >= 0) {
      b.v_p[i] = act_inverse(data.X_PB[i], b.v[p]);
      a_p = act_inverse(data.X_PB[i], b.a[p]);
    } else {
      a_p = root_acceleration(model, data, acting, i);
    }
    const Motion<T> own = along_columns<T>(tree, v, i);
    b.v[i] = b.v_p[i] + own;
    b.a[i] = a_p + cross(b.v[i], own) + along_columns<T>(tree, a, i);
    for (int k = tree.first[i]; k < tree.first[i] + tree.count[i]; ++k) {
      const Dof& S = tree.dofs[k];
      b.S_dot[k] = cross(b.v_p[i], S);
      b.S_ddot[k] = cross(a_p, S) + cross(b.v_p[i], b.S_dot[k]);
      b.S_v[k] = b.S_dot[k] + cross(b.v[i], S);
    }
  }
}

// From the leaves: inertia, velocity products and force of all that is beyond each joint.
template <class T>
void gather_bodies(const Model<T>& model, const Data<T>& data, MovingBodies<T>& b,
                   const DynamicsTerms<T>& acting) {
  for (int i = 0; i < model.njoints(); ++i) {
    const Inertia<T>& I = model.inertias[i];
    b.composites[i] = composite(I);
    b.products[i] = velocity_product(b.composites[i], b.v[i]);
    b.f[i] = I * b.a[i] + cross(b.v[i], I * b.v[i]);
    if (acting.external) b.f[i] = b.f[i] - (*acting.external)[i];
  }
  for (int i = model.njoints() - 1; i >= 0; --i) {
    const int p = model.parent[i];
    if (p < 0) continue;
    accumulate(data.X_PB[i], b.composites[i], b.composites[p]);
    accumulate(data.X_PB[i], b.products[i], b.products[p]);
    b.f[p] = b.f[p] + act(data.X_PB[i], b.f[i]);
  }
}

template <class T>
void move_and_gather(const Model<T>& model, Data<T>& data, MovingBodies<T>& b, const VectorRef<T>& q,
                     const VectorRef<T>& v, const VectorRef<T>& a, const DynamicsTerms<T>& acting) {
  place_joints(model, data, q);
  if (!acting.coriolis) {
    throw ArgumentError("second order: velocity products do not act on model \"" + model.name +
                        "\", expected them to");
  }
  if (acting.added.count > 0) {
    throw ArgumentError("second order: added inertias act on model \"" + model.name + "\", expected none");
  }
  move_columns(model, data, b, v, a, acting);
  gather_bodies(model, data, b, acting);
}

// --- Moments: integrals over the mass beyond a joint ------------------------------------------------------

// int x x^T dm
template <class T>
Matrix3<T> second_moment(const Composite<T>& I) {
  Matrix3<T> m = -I.I_o;
  const T half_trace = (I.I_o(0, 0) + I.I_o(1, 1) + I.I_o(2, 2)) * T(0.5);
  for (int k = 0; k < 3; ++k) m(k, k) += half_trace;
  return m;
}

// int v(x) x m(x) dm, v the velocities of the bodies.
template <class T>
Vector3<T> couple_with(const VelocityProduct<T>& b, const Motion<T>& m) {
  const T trace = b.U(0, 0) + b.U(1, 1) + b.U(2, 2);
  const Vector3<T>& w = m.angular;
  Vector3<T> turned;  // U^T w
  for (int k = 0; k < 3; ++k) turned[k] = b.U(0, k) * w[0] + b.U(1, k) * w[1] + b.U(2, k) * w[2];
  return b.p.cross(m.linear) + (w * trace - turned);
}

// A motion m feels a force in each point of a mass that moves with v: I S_a + 2 B S_b.
template <class T>
Force<T> slope_of_force(const Composite<T>& I, const VelocityProduct<T>& b, const Motion<T>& a,
                        const Vector3<T>& w) {
  return I * a + twice_b(b, w);
}

// C += A B for A (n x n), column by column, four of A at a time; no memory is taken.
template <class T>
void add_product(const T* A, const T* B, int n, int columns, T* C) {
  for (int j = 0; j < columns; ++j, B += n, C += n) {
    T* __restrict c = C;
    int k = 0;
    for (; k + 4 <= n; k += 4) {
      const T *a0 = A + k * n, *a1 = a0 + n, *a2 = a1 + n, *a3 = a2 + n;
      const T b0 = B[k], b1 = B[k + 1], b2 = B[k + 2], b3 = B[k + 3];
      for (int i = 0; i < n; ++i) c[i] += (a0[i] * b0 + a1[i] * b1) + (a2[i] * b2 + a3[i] * b3);
    }
    for (; k < n; ++k) {
      const T* a = A + k * n;
      const T b = B[k];
      for (int i = 0; i < n; ++i) c[i] += a[i] * b;
    }
  }
}

template <class MA, class MB, class T>
void add_product(const MA& A, const MB& B, MatrixX<T>& C) {
  add_product(A.data(), B.data(), static_cast<int>(A.rows()), static_cast<int>(B.cols()), C.data());
}

}  // namespace detail

template <class T>
MovingBodies<T>::MovingBodies(const Model<T>& model) : shape(tree_shape_of(model)) {
  const int n = model.njoints(), nv = model.nv;
  for (auto* x : {&v_p, &this->v, &a}) x->resize(n);
  for (auto* x : {&S, &S_dot, &S_ddot, &S_v}) x->resize(nv);
  composites.resize(n);
  products.resize(n);
  f.resize(n);
  const Tree tree = tree_of(model);
  for (int k = 0; k < nv; ++k) S[k] = motion<T>(tree.dofs[k]);
  for (int i = 0; i < n; ++i) {
    const int p = model.parent[i];
    above.push_back(p < 0 ? 0 : above[p] + tree.count[p]);
    levels = std::max(levels, tree.depth[i] + 1);
    longest_path = std::max(longest_path, above[i] + tree.count[i]);
  }
}

}  // namespace dyntape::dynamics
