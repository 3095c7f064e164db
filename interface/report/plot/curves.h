// SPDX-License-Identifier: BSD-3-Clause
//
// Makes curves of motions for plots.
//
//   panel.series.push_back(curve("speed", t, v));
//   plot.panels = {over_time("velocity", "[m/s]", {"x", "y", "z"}, t, v)};      // one row of v per name
#pragma once

#include <Eigen/Core>

#include <dyntape/interface/report/plot/picture.h>

namespace dyntape::io {

// y over x.
inline Series curve(const std::string& name, const Eigen::VectorXd& x, const Eigen::VectorXd& y) {
  return {.name = name, .x = {x.begin(), x.end()}, .y = {y.begin(), y.end()}};
}

// One curve per row over t (s).
inline Panel over_time(const std::string& title, const std::string& y_label,
                       const std::vector<std::string>& names, const Eigen::VectorXd& t,
                       const Eigen::MatrixXd& rows) {
  Panel panel{.title = title, .x_label = "time [s]", .y_label = y_label};
  for (Eigen::Index i = 0; i < rows.rows(); ++i)
    panel.series.push_back(curve(names[std::size_t(i)], t, rows.row(i)));
  return panel;
}

}  // namespace dyntape::io
