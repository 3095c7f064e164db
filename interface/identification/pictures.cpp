// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/identification/pictures.h>

#include <dyntape/interface/report/plot/curves.h>

namespace dyntape {
void draw_excitation(const dynamics::Model<double>& model, const Excitation& excitation,
                     const std::string& path) {
  const Eigen::VectorXd times = times_of_period(excitation.series.period, 400);
  const Eigen::MatrixXd q = excitation.series.positions(times), v = excitation.series.velocities(times);
  io::Panel positions{.title = "positions", .x_label = "time [s]", .y_label = "q [rad or m]"};
  io::Panel velocities{.title = "velocities", .x_label = "time [s]", .y_label = "v [rad/s or m/s]"};
  for (const dynamics::Joint<double>& joint : model.joints) {
    positions.series.push_back(io::curve(joint.name, times, q.row(joint.idx_v)));
    velocities.series.push_back(io::curve("", times, v.row(joint.idx_v)));
  }
  io::Panel condition{.title = "condition of the base regressor",
                      .x_label = "gradient evaluation",
                      .y_label = "cond(Y_b)",
                      .horizontal = {{excitation.random_condition, "median of random series"}}};
  io::Panel error{.title = "mean semi-axis of the confidence ellipsoid",
                  .x_label = "gradient evaluation",
                  .y_label = "exp(-log det F / 2 r)"};
  std::vector<double> count;
  for (std::size_t k = 0; k < excitation.conditions.size(); ++k) count.push_back(static_cast<double>(k));
  condition.series.push_back({.x = count, .y = excitation.conditions});
  error.series.push_back({.x = count, .y = excitation.errors});
  io::draw({.title = "Excitation of " + model.name, .panels = {positions, velocities, error, condition}},
           path);
}

}  // namespace dyntape
