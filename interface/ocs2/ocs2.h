// SPDX-License-Identifier: BSD-3-Clause
//
// OCS2's names in dyntape, all in one header.  Use it to move code from OCS2 (docs/from_ocs2.md):
//
//   #include <dyntape/interface/ocs2/ocs2.h>
//   namespace ocs2 = dyntape::ocs2;
//   namespace CppAD = dyntape::ocs2::cppad_names;        // for code that spells CppAD::CondExpLt and the like
//
// Code inside `namespace ocs2 { ... }` includes ocs2_namespace.h instead and needs no alias.
#pragma once

#include <dyntape/interface/ocs2/classes/constraints.h>
#include <dyntape/interface/ocs2/classes/costs.h>
#include <dyntape/interface/ocs2/classes/end_effector_kinematics.h>
#include <dyntape/interface/ocs2/classes/finite_differences.h>
#include <dyntape/interface/ocs2/classes/linear_interpolation.h>
#include <dyntape/interface/ocs2/classes/pre_computation.h>
#include <dyntape/interface/ocs2/classes/system_dynamics.h>
#include <dyntape/interface/ocs2/cond_exp.h>
#include <dyntape/interface/ocs2/cpp_ad_interface.h>
#include <dyntape/interface/ocs2/model_settings.h>
