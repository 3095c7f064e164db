// SPDX-License-Identifier: BSD-3-Clause
//
// A system to integrate: q' = v, v' = acceleration, and motors that follow their commands.
//
//   System pendulum;
//   pendulum.name = "pendulum";
//   pendulum.model = model;                                  // one revolute joint
//   pendulum.acceleration = [](const SystemPoint<AD>& s) {
//     return VectorXad(VectorXad::Constant(1, -9.81 * sin(s.q[0])));
//   };
//
// Commands u (n_u) are constant over a step.  A motor with lag (s) has a state m, m' = (u - m) / lag, which is
// integrated exactly, also inside a step: m(t + s) = u + (m - u) exp(-s / lag).  The drive of the system is m, or u
// without lag.  The callables may use parameters p (n_p).  The callables are recorded: use select instead of
// `if` on values (autodiff/record/scalar.h).
#pragma once

#include <dyntape/autodiff/record/eigen.h>
#include <dyntape/dynamics/model/model.h>

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

namespace dyntape {

template <class T>
struct SystemPoint {
  using Vector = Eigen::Matrix<T, Eigen::Dynamic, 1>;
  T t = T(0);    // s
  Vector q, v;   // (nq), (nv), as the model has them
  Vector drive;  // (n_u) output of the motors
  Vector p;      // (n_p)
};

struct System {
  std::string name;
  dynamics::Model<double> model = {};                                  // defines q and v
  int n_u = 0, n_p = 0;                                                // commands, parameters
  Eigen::VectorXd lag = {};                                            // (n_u) s, 0: none; or empty
  std::function<VectorXad(const SystemPoint<AD>&)> acceleration = {};  // (nv)

  // For Integrator::kVariational, which does not use the acceleration: kinetic minus potential energy (J), at most
  // quadratic in v; and the generalized forces (nv) that have no potential in the Lagrangian, or empty.
  std::function<AD(const VectorXad& q, const VectorXad& v, const VectorXad& p)> lagrangian = {};
  std::function<VectorXad(const SystemPoint<AD>&)> forces = {};

  // An adaptive step ends if an entry g falls to zero.  Normally g > 0, e.g. the height of a ball above the ground.
  std::function<VectorXad(const SystemPoint<AD>&)> events = {};
};

// The schemes of dynamics/simulation/, and adaptive schemes with variable order (adaptive_steps.h).
enum class Integrator {
  kSemiImplicitEuler,  // order 1, explicit: velocities first, then positions by the new ones
  kRungeKutta4,        // order 4, explicit
  kImplicitMidpoint,   // order 2, preserves quadratic invariants
  kImplicitVelocity,   // order 1, damps stiff parts: springs, friction, contact
  kVariational,        // order 2, preserves momenta; from the Lagrangian
  kAdaptive,           // CVODES, Adams methods: smooth motions
  kAdaptiveStiff       // CVODES, backward differentiation: motions with fast decaying parts
};

inline constexpr Integrator kIntegrators[] = {Integrator::kSemiImplicitEuler, Integrator::kRungeKutta4,
                                              Integrator::kImplicitMidpoint,  Integrator::kImplicitVelocity,
                                              Integrator::kVariational,       Integrator::kAdaptive,
                                              Integrator::kAdaptiveStiff};

const char* to_string(Integrator integrator);
bool is_adaptive(Integrator integrator);

// Indices of the motors with lag, in the order of u; their states m are the last entries of x = (q, v, m).
std::vector<int> lagged_motors(const System& system);

}  // namespace dyntape
