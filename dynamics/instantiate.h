// SPDX-License-Identifier: BSD-3-Clause
//
// Compiles all dynamics algorithms for one more scalar type.  Put these lines into one .cpp file:
//
//   #include "my_scalar.h"                      // arithmetic, sqrt, sin, ..., select, Eigen's NumTraits
//   #include <dyntape/dynamics/instantiate.h>
//   DYNTAPE_INSTANTIATE_DYNAMICS(my::Scalar)    // at global scope
//
// All other files include algorithms.h, configuration.h and effects.h, which only declare.
//
// To add an algorithm, add a row at the end of the file that defines it.  To add a file, list it here.  CMake reads
// this list and writes small units for dyntape's own scalars: one scalar and a few parts each.
#pragma once

#include <dyntape/dynamics/algorithms/detail/centroidal.hxx>
#include <dyntape/dynamics/algorithms/detail/derivatives.hxx>
#include <dyntape/dynamics/algorithms/detail/energy.hxx>
#include <dyntape/dynamics/algorithms/detail/forward_dynamics.hxx>
#include <dyntape/dynamics/algorithms/detail/hessian.hxx>
#include <dyntape/dynamics/algorithms/detail/inverse_dynamics.hxx>
#include <dyntape/dynamics/algorithms/detail/kinematic_derivatives.hxx>
#include <dyntape/dynamics/algorithms/detail/kinematics.hxx>
#include <dyntape/dynamics/algorithms/detail/mimic.hxx>
#include <dyntape/dynamics/algorithms/detail/operational_space.hxx>
#include <dyntape/dynamics/algorithms/detail/regressor.hxx>
#include <dyntape/dynamics/algorithms/detail/second_order.hxx>
#include <dyntape/dynamics/contact/detail/constrained_hessian.hxx>
#include <dyntape/dynamics/contact/detail/constraint_derivatives.hxx>
#include <dyntape/dynamics/contact/detail/constraints.hxx>
#include <dyntape/dynamics/effects/detail/contacts.hxx>
#include <dyntape/dynamics/effects/detail/effects.hxx>
#include <dyntape/dynamics/effects/detail/point_forces.hxx>
#include <dyntape/dynamics/effects/detail/wrenches.hxx>
#include <dyntape/dynamics/model/detail/configuration.hxx>

#define DYNTAPE_INSTANTIATE_DYNAMICS(T)         \
  DYNTAPE_INSTANTIATE_CENTROIDAL(T)             \
  DYNTAPE_INSTANTIATE_DERIVATIVES(T)            \
  DYNTAPE_INSTANTIATE_ENERGY(T)                 \
  DYNTAPE_INSTANTIATE_FORWARD_DYNAMICS(T)       \
  DYNTAPE_INSTANTIATE_HESSIAN(T)                \
  DYNTAPE_INSTANTIATE_INVERSE_DYNAMICS(T)       \
  DYNTAPE_INSTANTIATE_KINEMATIC_DERIVATIVES(T)  \
  DYNTAPE_INSTANTIATE_KINEMATICS(T)             \
  DYNTAPE_INSTANTIATE_MIMIC(T)                  \
  DYNTAPE_INSTANTIATE_OPERATIONAL_SPACE(T)      \
  DYNTAPE_INSTANTIATE_REGRESSOR(T)              \
  DYNTAPE_INSTANTIATE_SECOND_ORDER(T)           \
  DYNTAPE_INSTANTIATE_CONSTRAINED_HESSIAN(T)    \
  DYNTAPE_INSTANTIATE_CONSTRAINT_DERIVATIVES(T) \
  DYNTAPE_INSTANTIATE_CONSTRAINTS(T)            \
  DYNTAPE_INSTANTIATE_CONTACTS(T)               \
  DYNTAPE_INSTANTIATE_EFFECTS(T)                \
  DYNTAPE_INSTANTIATE_POINT_FORCES(T)           \
  DYNTAPE_INSTANTIATE_WRENCHES(T)               \
  DYNTAPE_INSTANTIATE_CONFIGURATION(T)
