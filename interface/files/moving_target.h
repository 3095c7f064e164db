// SPDX-License-Identifier: BSD-3-Clause
//
// A moving target: on a circle about a place, or from a table.
//
//   moves circle  radius 0.1  period 4  normal "0 0 1"       ; one turn in 4 s about `target`, starting in direction x
//   moves file    file path.csv                              ; columns t and x, y, z, or roll, pitch, yaw; others are
//                 ignored
//
//   const MovingTarget moves = CircularTarget{.radius = 0.1, .period = 4};      // or places_in("path.csv")
//   const TargetOverTime target = place_over_time(moves, center);
//   const Parameter now = problem.parameters.add("target", target);
//
// Time is the motion's (s), for a controller the plant's.  Between rows positions are linear, and rotations have a
// fixed axis and constant speed.  Before the first row and after the last the target is constant.
//
// Errors.  FileError: a table without rows, missing columns, times that do not increase.
#pragma once

#include <functional>
#include <string>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include <dyntape/interface/io/csv.h>

namespace dyntape {

using TargetOverTime = std::function<Eigen::VectorXd(double t)>;

struct CircularTarget {
  double radius = 0.1, period = 0;                    // m, s
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // any nonzero length
};
struct TargetTable {
  std::vector<double> t;                // s, increasing
  std::vector<Eigen::Vector3d> values;  // m, or roll, pitch, yaw (rad)
};
using MovingTarget = std::variant<CircularTarget, TargetTable>;

// (3) m.  The target moves clockwise when seen against the normal.
TargetOverTime circle(const Eigen::Vector3d& center, const Eigen::Vector3d& normal, double radius,
                      double period);
TargetOverTime place_over_time(const MovingTarget& moves, const Eigen::Vector3d& center);

// (9) The rotation matrix row by row, from roll, pitch and yaw as in rotation_of (rad); for tables only.
TargetOverTime turn_over_time(const MovingTarget& moves);

// From the columns x, y, z, or roll, pitch, yaw.
TargetTable places_in(const std::string& path);
TargetTable turns_in(const std::string& path);

// The column t, increasing.
std::vector<double> times_in(const io::CsvTable& table, const std::string& path);

}  // namespace dyntape
