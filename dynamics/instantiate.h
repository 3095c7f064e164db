// SPDX-License-Identifier: BSD-3-Clause
//
// All algorithms for one more scalar, compiled once, in a unit of its own:
//
//   #include "my_scalar.h"                      // arithmetic, sqrt, sin, ..., select, Eigen's NumTraits
//   #include <dyntape/dynamics/instantiate.h>
//   DYNTAPE_INSTANTIATE_DYNAMICS(my::Scalar)    // at global scope
//
// Everybody else includes algorithms.h, configuration.h and effects.h, which only declare.
//
// dyntape's own scalars are instantiated part by part, each part and scalar a small unit that CMake writes
// (dynamics/CMakeLists.txt): a new part is a file in instantiate/ and a line here.
#pragma once

#include <dyntape/dynamics/instantiate/centroidal.h>
#include <dyntape/dynamics/instantiate/configuration.h>
#include <dyntape/dynamics/instantiate/constraints.h>
#include <dyntape/dynamics/instantiate/derivatives.h>
#include <dyntape/dynamics/instantiate/effects.h>
#include <dyntape/dynamics/instantiate/energy.h>
#include <dyntape/dynamics/instantiate/forward_dynamics.h>
#include <dyntape/dynamics/instantiate/inverse_dynamics.h>
#include <dyntape/dynamics/instantiate/kinematic_derivatives.h>
#include <dyntape/dynamics/instantiate/kinematics.h>
#include <dyntape/dynamics/instantiate/mimic.h>
#include <dyntape/dynamics/instantiate/operational_space.h>
#include <dyntape/dynamics/instantiate/regressor.h>
#include <dyntape/dynamics/instantiate/second_order.h>
#include <dyntape/dynamics/instantiate/wrenches.h>

#define DYNTAPE_INSTANTIATE_DYNAMICS(T)        \
  DYNTAPE_INSTANTIATE_CENTROIDAL(T)            \
  DYNTAPE_INSTANTIATE_CONFIGURATION(T)         \
  DYNTAPE_INSTANTIATE_CONSTRAINTS(T)           \
  DYNTAPE_INSTANTIATE_DERIVATIVES(T)           \
  DYNTAPE_INSTANTIATE_EFFECTS(T)               \
  DYNTAPE_INSTANTIATE_ENERGY(T)                \
  DYNTAPE_INSTANTIATE_FORWARD_DYNAMICS(T)      \
  DYNTAPE_INSTANTIATE_INVERSE_DYNAMICS(T)      \
  DYNTAPE_INSTANTIATE_KINEMATIC_DERIVATIVES(T) \
  DYNTAPE_INSTANTIATE_KINEMATICS(T)            \
  DYNTAPE_INSTANTIATE_MIMIC(T)                 \
  DYNTAPE_INSTANTIATE_OPERATIONAL_SPACE(T)     \
  DYNTAPE_INSTANTIATE_REGRESSOR(T)             \
  DYNTAPE_INSTANTIATE_SECOND_ORDER(T)          \
  DYNTAPE_INSTANTIATE_WRENCHES(T)
