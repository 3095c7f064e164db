// SPDX-License-Identifier: BSD-3-Clause
//
// The condition of the inertia matrix: how many digits a solve for accelerations loses.  Use it to decide whether
// accelerations may be solved from the entries of M.
//
//   double c = inertia_condition(model, data, q);       // at least 1; 1e6: six digits are lost
//   double worst = worst_inertia_condition(model);      // the largest of 32 configurations
//
// Definition: max_k M_kk (M^-1)_kk, without units.  M_kk is the inertia at dof k while all other joints are held; 1
// / (M^-1)_kk is the inertia at dof k while all other joints are free.  A factorisation of M computes the second
// from the first by subtraction, and loses as many digits as the condition has.  Two cases have a large condition:
//
// - two parallel joints at a distance l, with one body beyond both: about 1 / l^2
// - a light body that carries a heavy one: about the ratio of the masses
//
// aba() and minverse() subtract body by body:
//
// - Short distances l cost no digits: the inverse is accurate to the last digits at a condition of 1e20.
// - Heavy bodies on light ones cost up to as many digits as the condition has.
// - Derivatives of accelerations lose digits in both cases, since they are products with M^-1.
// - Derivatives of the recorded aba() (RobotRoute::kTape) lose none for short distances.
#pragma once

#include <dyntape/dynamics/algorithms/algorithms.h>

namespace dyntape::dynamics {

// Overwrites data.M and data.Minv.  Infinite or NaN if a joint moves no inertia.
double inertia_condition(const Model<double>& model, Data<double>& data, const VectorRef<double>& q);

// Returns the largest condition of 32 configurations, the same in every call: 16 random ones, each also with its
// angles set to multiples of a right angle, where axes are often parallel.  Infinite if any of them is not finite; 1
// for a robot without joints.
double worst_inertia_condition(const Model<double>& model);

}  // namespace dyntape::dynamics
