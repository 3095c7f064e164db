// SPDX-License-Identifier: BSD-3-Clause
//
// A target that moves: on a circle about a place, or as a table says.
//
//   moves circle  radius 0.1  period 4  normal "0 0 1"       ; once round in 4 s, from the side of x on, about `target`
//   moves file    file path.csv                              ; columns t and x, y, z, or roll, pitch, yaw; others as they like
//
//   const MovingTarget moves = CircularTarget{.radius = 0.1, .period = 4};      // or places_in("path.csv")
//   const TargetOverTime target = place_over_time(moves, center);
//   const Parameter now = problem.parameters.add("target", target);
//
// Time is that of the motion (s); a controller goes on in the plant's.  Between rows a place goes along straight lines and a
// turn about a fixed axis at constant speed; before the first row and behind the last it stays.
//
// Errors: FileError for a table without rows, columns that lack, times that do not increase.
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
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // of any length
};
struct TargetTable {
  std::vector<double> t;                // s, increasing
  std::vector<Eigen::Vector3d> values;  // m, or roll, pitch, yaw (rad)
};
using MovingTarget = std::variant<CircularTarget, TargetTable>;

// (3) m.  Seen against the normal the target goes round clockwise.
TargetOverTime circle(const Eigen::Vector3d& center, const Eigen::Vector3d& normal, double radius,
                      double period);
TargetOverTime place_over_time(const MovingTarget& moves, const Eigen::Vector3d& center);

// (9) The rotation row by row, of roll, pitch and yaw as in rotation_of (rad); of tables alone.
TargetOverTime turn_over_time(const MovingTarget& moves);

// Of the columns x, y, z, or roll, pitch, yaw.
TargetTable places_in(const std::string& path);
TargetTable turns_in(const std::string& path);

// The column t, increasing.
std::vector<double> times_in(const io::CsvTable& table, const std::string& path);

}  // namespace dyntape
