// SPDX-License-Identifier: BSD-3-Clause
//
// A robot as JSON, for peers in other languages (tests/bench/peers/casadi_robot.py reads it).
#pragma once

#include <nlohmann/json.hpp>

#include <dyntape/dynamics/model/model.h>

namespace dyntape::tools {

// {"name", "nq", "nv", "gravity", "joints": [{"type", "parent", "idx_q", "idx_v", "axis", "rotation" (by rows), "translation", "mass",
// "com", "inertia" (at the com), "armature"}]}; SI units.
nlohmann::json model_json(const dynamics::Model<double>& model);

}  // namespace dyntape::tools
