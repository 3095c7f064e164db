// SPDX-License-Identifier: BSD-3-Clause
//
// Reads the positions of planar joints in files:
//
//   start { planar { joint base  position "1 2"  angle 0.3  velocity "0 0"  angular_velocity 0 } }
//
//   const std::vector<std::string> placed = read_planar(start, &model, q, v);      // their names
#pragma once

#include <string>
#include <vector>

#include <dyntape/dynamics/model/model.h>
#include <dyntape/interface/files/info/section.h>

namespace dyntape {

std::vector<std::string> planar_names(const dynamics::Model<double>& model);

// Reads every block `planar` of a state into (nq) and (nv).  Without a robot only asks for its keys.
std::vector<std::string> read_planar(io::Section& state, const dynamics::Model<double>* model,
                                     Eigen::VectorXd& q, Eigen::VectorXd& v);

}  // namespace dyntape
