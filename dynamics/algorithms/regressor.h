// SPDX-License-Identifier: BSD-3-Clause
//
// Regressors: inverse dynamics and energy as linear functions of the inertial parameters.
//
//   RegressorData<double> regressor(model);
//   const VectorXd theta = inertial_parameters(model);                          // (10 njoints)
//   const MatrixXd& Y = torque_regressor(model, data, regressor, q, v, a);      // (nv x 10 njoints)
//   Y * theta;                                                                  // rnea without armature
//
// Ten parameters per body, about the origin of its frame (torques are not linear in those about the centre of mass),
// in Pinocchio's order:
//   theta_i = (m, m cx, m cy, m cz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz),     I = I_c + m (|c|^2 1 - c c^T)
// in kg, kg m, kg m^2.  Armature and friction are linear too; their columns are optional:
//   tau = Y theta + diag(a) armature + diag(v) viscous + diag(tanh(v / w)) coulomb              (effects.h)
//
// Formulas (docs/math.md, I.1 to I.8).  With the velocity (l, w) of body i, its angular acceleration e and the
// classical acceleration d of its origin minus gravity, h = m c:
//   force   f = d m + ([e] + [w]^2) h
//   moment  n = -[d] h + I e + w x I w
// A row of Y is the power of these along the joint's axis, in the frame of body i.
//   kinetic energy    1/2 |l|^2 m + (l x w).h + 1/2 w.I w
//   potential energy  -(g.p) m - (R^T g).h            R, p the placement of the body in the world
#pragma once

#include <dyntape/dynamics/algorithms/data.h>

#include <string>
#include <vector>

namespace dyntape::dynamics {

template <class T>
using Vector10 = Eigen::Matrix<T, 10, 1>;
template <class T>
using RowVectorX = Eigen::Matrix<T, 1, Eigen::Dynamic>;

// theta of one body.
template <class T>
Vector10<T> inertial_parameters(const Inertia<T>& inertia);
// Its inverse.  A massless body has its centre of mass at the origin.
template <class T>
Inertia<T> inertia_from(const Vector10<T>& theta);

// Of all bodies, (10 njoints); the second function writes them into the model.
template <class T>
VectorX<T> inertial_parameters(const Model<T>& model);
template <class T>
void set_inertial_parameters(Model<T>& model, const VectorRef<T>& theta);

// "m1", "mcx1", ..., "Izz1", "m2", ...: bodies are numbered from one, as in the literature.
std::vector<std::string> inertial_parameter_names(int njoints);

// Columns after those of the bodies: one for every joint with a single degree of freedom.
struct JointColumns {
  bool armature = false, viscous = false, coulomb = false;
  double smoothing = 0.01;  // w above (rad/s or m/s), > 0

  int per_dof() const { return armature + viscous + coulomb; }
};

// Results and working memory.
template <class T>
struct RegressorData {
  explicit RegressorData(const Model<T>& model, const JointColumns& joint_columns = {});

  JointColumns columns;
  std::vector<int> single;           // entries of v of the joints with their own columns
  MatrixX<T> Y;                      // (nv x 10 njoints + columns.per_dof() * single.size())
  RowVectorX<T> kinetic, potential;  // (10 njoints)
};

// Y, then armature, viscous and Coulomb columns if selected, in this order.  Entries of bodies that a joint does not
// carry are zero.
template <class T>
const MatrixX<T>& torque_regressor(const Model<T>& model, Data<T>& data, RegressorData<T>& regressor,
                                   const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& a);

// Rows with kinetic theta = kinetic_energy without armature, potential theta = potential_energy (J).
template <class T>
const RowVectorX<T>& kinetic_energy_regressor(const Model<T>& model, Data<T>& data,
                                              RegressorData<T>& regressor, const VectorRef<T>& q,
                                              const VectorRef<T>& v);
template <class T>
const RowVectorX<T>& potential_energy_regressor(const Model<T>& model, Data<T>& data,
                                                RegressorData<T>& regressor, const VectorRef<T>& q);

}  // namespace dyntape::dynamics
