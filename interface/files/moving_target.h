// SPDX-License-Identifier: BSD-3-Clause
//
// A target that moves: on a circle about a place, or as a table says.
//
//   moves circle  radius 0.1  period 4  normal "0 0 1"       ; once round in 4 s, from the side of x on, about `target`
//   moves file    file path.csv                              ; columns t and x, y, z, or roll, pitch, yaw; others as they like
//
//   const TargetOverTime target = circle(center, normal, radius, period);
//   const Parameter now = problem.parameters.add("target", target);
//
// Time is that of the motion (s); a controller goes on in the plant's.  Between rows a place goes along straight lines and a
// turn about a fixed axis at constant speed; before the first row and behind the last it stays.
//
// Errors: FileError for a table without rows, columns that lack, times that do not increase.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <dyntape/interface/io/csv.h>

namespace dyntape {

using TargetOverTime = std::function<Eigen::VectorXd(double t)>;

// (3) m.  The normal of any length; seen against it the target goes round clockwise.
TargetOverTime circle(const Eigen::Vector3d& center, const Eigen::Vector3d& normal, double radius,
                      double period);

// (3) m, of the columns x, y, z.
TargetOverTime places_in(const std::string& path);

// (9) The rotation row by row, of roll, pitch and yaw as in rotation_of (rad).
TargetOverTime turns_in(const std::string& path);

// The column t, increasing.
std::vector<double> times_in(const io::CsvTable& table, const std::string& path);

}  // namespace dyntape
