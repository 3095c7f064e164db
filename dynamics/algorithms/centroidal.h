// SPDX-License-Identifier: BSD-3-Clause
//
// Centroidal dynamics: centre of mass, momentum about it, and their derivatives.
//
//   Centroidal<double> c(model);                                 // results and working memory, beside Data
//   Force<double> h = centroidal_momentum(model, data, c, q, v); // kg m/s, kg m^2/s
//   centroidal_derivatives(model, data, c, q, v, a);             // c.dh_dq, c.dh_dot_dv, ...
//
// Frame G: origin at the centre of mass, world axes.  h is the momentum of all bodies about G,
//   h = A(q) v,   h_dot = A a + A_dot v = sum of the wrenches on the robot about G, including its weight.
// a is the derivative of v, without gravity.  Rotors (armature) have no momentum here.
//
// Only c.com depends on the robot's position; all else has the same bits at 1e8 m as at the origin.  Columns of
// derivatives with respect to q are increments in the moving frame of the joint.  Cost: a constant number of
// operations per body and column.
//
// Column S of joint j; quantities of the bodies beyond j (including j's) in frame j, then transformed to G:
//   A         = I S                                     I composite inertia, rate I_dot in a frame at rest
//   A_dot     = I_dot S + I (v_j x S) - (0, c_dot x A_linear)
//   dh_dq     = I S_dot + S x* h_j - (0, dc x h_linear)                     dc = A_linear / mass
//   dh_dot_dq = I S_ddot + 2 B S_dot + S x* f_j - (0, dc x h_dot_linear)
//   dh_dot_dv = I S_v + 2 B S
// with S_dot, S_ddot, S_v, B of algorithms.h (relative to free fall there, without gravity here).  Sources:
// docs/math.md (C.1 to C.12); D. Orin, A. Goswami, S.-H. Lee, Centroidal dynamics of a humanoid robot, Autonomous
// Robots 2013; P. Wensing, D. Orin, Improved computation of the humanoid centroidal dynamics, IJHR 2016.
#pragma once

#include <dyntape/dynamics/algorithms/data.h>

#include <vector>

namespace dyntape::dynamics {

template <class T>
using Matrix3X = Eigen::Matrix<T, 3, Eigen::Dynamic>;

// Each function names the fields that it writes; others keep their values.  One Centroidal per thread.
template <class T>
struct Centroidal {
  explicit Centroidal(const Model<T>& model) {
    const int n = model.njoints(), nv = model.nv;
    for (auto* x : {&subtree_com, &subtree_velocity, &subtree_acceleration}) x->resize(n, Vector3<T>::Zero());
    for (auto* x : {&momentum, &force}) x->resize(n);
    for (auto* x : {&S_dot, &S_ddot}) x->resize(nv);
    for (auto* x : {&A, &A_dot, &dh_dq, &dh_dot_dq, &dh_dot_dv}) *x = Matrix6X<T>::Zero(6, nv);
    J = Matrix3X<T>::Zero(3, nv);
    subtree_mass.resize(n, T(0));
    X_GB.resize(n);
    composites.resize(n);
    velocity_products.resize(n);
  }

  // Of the whole robot, in world axes.
  T mass = T(0);
  Vector3<T> com = Vector3<T>::Zero();  // in the world
  Vector3<T> velocity = Vector3<T>::Zero(), acceleration = Vector3<T>::Zero();
  Matrix3<T> I = Matrix3<T>::Zero();        // rotational inertia about G of the robot frozen at q
  Force<T> h, h_dot;                        // momentum and its rate, about G
  Matrix3X<T> J;                            // (3 x nv) velocity = J v
  Matrix6X<T> A, A_dot;                     // (6 x nv) A = dh_dv = dh_dot_da
  Matrix6X<T> dh_dq, dh_dot_dq, dh_dot_dv;  // (6 x nv)

  // Of body i and all bodies beyond it, in the axes of body i; positions from the origin of body i.  Zero if
  // massless.
  std::vector<T> subtree_mass;  // (njoints)
  std::vector<Vector3<T>> subtree_com, subtree_velocity, subtree_acceleration;

  // Working memory.
  std::vector<Placement<T>> X_GB;         // body in G
  std::vector<Force<T>> momentum, force;  // of body i and all beyond it, in frame i
  std::vector<Composite<T>> composites;
  std::vector<VelocityProduct<T>> velocity_products;
  std::vector<Motion<T>> S_dot, S_ddot;  // (nv)
};

// --- Centre of mass --------------------------------------------------------------------------------------
// Computes mass, com, subtree_mass, subtree_com; with v also velocity and subtree_velocity; with a also acceleration
// and subtree_acceleration.  Returns com.
template <class T>
const Vector3<T>& center_of_mass(const Model<T>& model, Data<T>& data, Centroidal<T>& c,
                                 const VectorRef<T>& q);
template <class T>
const Vector3<T>& center_of_mass(const Model<T>& model, Data<T>& data, Centroidal<T>& c,
                                 const VectorRef<T>& q, const VectorRef<T>& v);
template <class T>
const Vector3<T>& center_of_mass(const Model<T>& model, Data<T>& data, Centroidal<T>& c,
                                 const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& a);

// Computes c.J, which is also the derivative of com with respect to q; mass, com, subtree_mass, subtree_com.
template <class T>
const Matrix3X<T>& com_jacobian(const Model<T>& model, Data<T>& data, Centroidal<T>& c,
                                const VectorRef<T>& q);
// Computes c.J for the centre of mass of `body` and all bodies beyond it, world axes.
template <class T>
const Matrix3X<T>& subtree_com_jacobian(const Model<T>& model, Data<T>& data, Centroidal<T>& c,
                                        const VectorRef<T>& q, int body);

// --- Momentum --------------------------------------------------------------------------------------------
// Compute c.h, mass, com, velocity; the rate also c.h_dot, acceleration.
template <class T>
const Force<T>& centroidal_momentum(const Model<T>& model, Data<T>& data, Centroidal<T>& c,
                                    const VectorRef<T>& q, const VectorRef<T>& v);
template <class T>
const Force<T>& centroidal_momentum_rate(const Model<T>& model, Data<T>& data, Centroidal<T>& c,
                                         const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& a);

// Compute c.A, I, mass, com; the rate also c.A_dot, h, velocity.
template <class T>
const Matrix6X<T>& centroidal_matrix(const Model<T>& model, Data<T>& data, Centroidal<T>& c,
                                     const VectorRef<T>& q);
template <class T>
const Matrix6X<T>& centroidal_matrix_rate(const Model<T>& model, Data<T>& data, Centroidal<T>& c,
                                          const VectorRef<T>& q, const VectorRef<T>& v);

// --- Derivatives -----------------------------------------------------------------------------------------
// Computes c.dh_dq, A (= dh_dv = dh_dot_da), dh_dot_dq, dh_dot_dv, h, h_dot, I, mass, com, velocity, acceleration.
// Derivatives of velocity and acceleration of the centre of mass are the linear rows divided by the mass.
template <class T>
void centroidal_derivatives(const Model<T>& model, Data<T>& data, Centroidal<T>& c, const VectorRef<T>& q,
                            const VectorRef<T>& v, const VectorRef<T>& a);

}  // namespace dyntape::dynamics
