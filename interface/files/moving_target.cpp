// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/moving_target.h>

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

// The row before a time, the one after it, and the share of the way.
struct RowsAround {
  std::size_t before, after;
  double share;
};
RowsAround rows_at(const std::vector<double>& t, double time) {
  const auto next = std::size_t(std::upper_bound(t.begin(), t.end(), time) - t.begin());
  if (next == 0) return {0, 0, 0};
  if (next == t.size()) return {next - 1, next - 1, 0};
  return {next - 1, next, (time - t[next - 1]) / (t[next] - t[next - 1])};
}

TargetTable rows_in(const std::string& path, const char* first, const char* second, const char* third) {
  const io::CsvTable table = io::read_csv(path);
  TargetTable rows{times_in(table, path), {}};
  const std::vector<double> x = table.column(first), y = table.column(second), z = table.column(third);
  for (std::size_t k = 0; k < x.size(); ++k) rows.values.emplace_back(x[k], y[k], z[k]);
  return rows;
}

// Rz(yaw) Ry(pitch) Rx(roll).
Eigen::Quaterniond turn_of(const Vector3d& angles) {
  return Eigen::AngleAxisd(angles[2], Vector3d::UnitZ()) * Eigen::AngleAxisd(angles[1], Vector3d::UnitY()) *
         Eigen::AngleAxisd(angles[0], Vector3d::UnitX());
}

}  // namespace

std::vector<double> times_in(const io::CsvTable& table, const std::string& path) {
  if (table.rows() == 0) throw FileError(path + ": there are no rows, expected a motion");
  const std::vector<double> t = table.column("t");
  for (std::size_t k = 1; k < t.size(); ++k) {
    if (t[k] > t[k - 1]) continue;
    throw FileError(path + ": the time of row " + std::to_string(k + 1) + " is " + io::shortest(t[k]) +
                    " s, expected more than " + io::shortest(t[k - 1]) + " s, that of the row before");
  }
  return t;
}

TargetOverTime circle(const Vector3d& center, const Vector3d& normal, double radius, double period) {
  const Vector3d n = normal.stableNormalized();
  // Towards x as far as the plane allows, else towards y.
  const Vector3d along = std::abs(n.x()) < 0.9 ? Vector3d::UnitX() : Vector3d::UnitY();
  const Vector3d first = (along - along.dot(n) * n).normalized(), second = n.cross(first);
  return [=](double t) -> VectorXd {
    const double angle = 2 * std::acos(-1.0) * t / period;
    return center + radius * (std::cos(angle) * first + std::sin(angle) * second);
  };
}

TargetOverTime place_over_time(const MovingTarget& moves, const Vector3d& center) {
  if (const auto* round = std::get_if<CircularTarget>(&moves))
    return circle(center, round->normal, round->radius, round->period);
  return [rows = std::get<TargetTable>(moves)](double t) -> VectorXd {
    const RowsAround at = rows_at(rows.t, t);
    return (1 - at.share) * rows.values[at.before] + at.share * rows.values[at.after];
  };
}

TargetTable places_in(const std::string& path) { return rows_in(path, "x", "y", "z"); }
TargetTable turns_in(const std::string& path) { return rows_in(path, "roll", "pitch", "yaw"); }

TargetOverTime turn_over_time(const MovingTarget& moves) {
  const TargetTable& rows = std::get<TargetTable>(moves);
  std::vector<Eigen::Quaterniond> turns;
  for (const Vector3d& angles : rows.values) turns.push_back(turn_of(angles));
  return [t = rows.t, turns](double time) -> VectorXd {
    const RowsAround at = rows_at(t, time);
    const Eigen::Matrix3d back =
        turns[at.before].slerp(at.share, turns[at.after]).toRotationMatrix().transpose();
    return Eigen::Map<const VectorXd>(back.data(), 9);  // columns of the transpose
  };
}

}  // namespace dyntape
