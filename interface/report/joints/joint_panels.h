// SPDX-License-Identifier: BSD-3-Clause
//
// Panels of a robot's motion over time: one for each quantity and unit, so angles and lengths never share an axis.
//
//   io::Plot plot{.title = "arm"};
//   add_positions(plot, model, t, {q});                                // "joint angle" [rad], "position" [m]
//   add_velocities(plot, model, t, {v, lower, upper});                 // with lines at limits that curves come near
//   add_efforts(plot, model, dofs, t, {tau});
//   arrange_limbs(plot, model);
//
// Robots with more than seven joints of one degree of freedom get a panel for each limb.  Rotations of a base and of
// joints with (cos, sin) are drawn as angles, without jumps by full or half turns, so a pitch may exceed a quarter turn.
#pragma once

#include <string>
#include <vector>

#include <dyntape/dynamics/model/model.h>
#include <dyntape/interface/report/plot/picture.h>

namespace dyntape {

// Curves with one row per entry: (entries x times).
struct JointCurves {
  Eigen::MatrixXd values;
  Eigen::VectorXd lower = {}, upper = {};  // limits of each entry, infinite: none; or empty
  Eigen::MatrixXd targets = {};            // dotted, NaN: none; or without rows
};

void add_positions(io::Plot& plot, const dynamics::Model<double>& model, const Eigen::VectorXd& t,
                   JointCurves q);
void add_velocities(io::Plot& plot, const dynamics::Model<double>& model, const Eigen::VectorXd& t,
                    const JointCurves& v);
// Efforts of the driven degrees of freedom, then forces ("f.foot.z").
void add_efforts(io::Plot& plot, const dynamics::Model<double>& model, const std::vector<int>& driven,
                 const Eigen::VectorXd& t, const JointCurves& tau,
                 const std::vector<std::string>& forces = {});

// Panels of one quantity side by side, if the robot has a panel for each limb.
void arrange_limbs(io::Plot& plot, const dynamics::Model<double>& model);

// Targets of the curves of a panel, dotted; NaN: none.
void add_targets(io::Panel& panel, const std::vector<std::string>& names, const Eigen::VectorXd& t,
                 const Eigen::MatrixXd& targets);

}  // namespace dyntape
