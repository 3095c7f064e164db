// SPDX-License-Identifier: BSD-3-Clause
//
// How many digits are lost by who solves for accelerations from the entries of the inertia matrix.
//
//   double c = inertia_condition(model, data, q);       // one or more; 1e6: six digits
//   double worst = worst_inertia_condition(model);      // the largest of 32 configurations
//
// It is max_k M_kk (M^-1)_kk, a number without units.  M_kk is what a torque at dof k moves while the others are held,
// 1 / (M^-1)_kk what it moves while they are free: a factorisation of M finds the second by subtraction from the
// first, and loses as many digits as the condition has.  Two parallel joints a lever l apart, one body beyond them, have
// a condition near 1 / l^2; light bodies that carry heavy ones that of their masses.
//
// aba() and minverse() subtract body by body.  Short levers cost them nothing: the inverse is right to the last digits at
// a condition of 1e20.  Where heavy bodies hang on light ones they lose up to what the condition says, too.  So do the
// derivatives of accelerations, products with M^-1; those of the recorded aba() (RobotRoute::kTape) do not for short levers.
#pragma once

#include <dyntape/dynamics/algorithms/algorithms.h>

namespace dyntape::dynamics {

// Writes data.M and data.Minv.  Not finite where a joint moves no inertia.
double inertia_condition(const Model<double>& model, Data<double>& data, const VectorRef<double>& q);

// The largest at 16 random configurations, always the same, and where their joints are turned on to multiples of a right
// angle, since axes line up there.  Infinite where one of them is not finite; 1 for a robot without joints.
double worst_inertia_condition(const Model<double>& model);

}  // namespace dyntape::dynamics
