// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/scene/simulation_results.h>

namespace dyntape {

namespace {

using Eigen::MatrixXd;

// More samples than this cannot be told apart in a picture.
constexpr int kMostPoints = 1500;

std::vector<double> thinned(const std::vector<double>& values) {
  const std::size_t stride = 1 + values.size() / kMostPoints;
  std::vector<double> kept;
  for (std::size_t k = 0; k < values.size(); k += stride) kept.push_back(values[k]);
  return kept;
}

std::vector<double> row_of(const MatrixXd& curves, Eigen::Index i) {
  const Eigen::VectorXd row = curves.row(i);
  return {row.begin(), row.end()};
}

void add(io::Panel& panel, const std::string& name, const SimulatedMotion& motion,
         const std::vector<double>& y) {
  panel.series.push_back({.name = name, .x = thinned(motion.t), .y = thinned(y)});
}

io::Panel joint_panel(const Scene& scene, const SimulatedMotion& motion, const std::string& title,
                      const std::string& label, const MatrixXd& curves, bool is_q) {
  io::Panel panel{.title = title, .x_label = "time [s]", .y_label = label};
  for (const auto& joint : scene.robot.model.joints) {
    if (dynamics::is_single(joint.type))
      add(panel, joint.name, motion, row_of(curves, is_q ? joint.idx_q : joint.idx_v));
  }
  return panel;
}

bool floats(const Scene& scene) {
  return scene.robot.model.joints.front().type == dynamics::JointType::kFreeFlyer;
}

io::Panel base_panel(const SimulatedMotion& motion) {
  io::Panel panel{.title = "base", .x_label = "time [s]", .y_label = "position [m]"};
  for (int i = 0; i < 3; ++i) add(panel, std::string(1, "xyz"[i]), motion, row_of(motion.q, i));
  return panel;
}

io::Panel turning_panel(const SimulatedMotion& motion) {
  io::Panel panel{
      .title = "base, angular velocity in its own axes", .x_label = "time [s]", .y_label = "[rad/s]"};
  for (int i = 0; i < 3; ++i) add(panel, std::string(1, "xyz"[i]), motion, row_of(motion.v, 3 + i));
  return panel;
}

}  // namespace

io::Plot state_plot(const Scene& scene, const SimulatedMotion& motion) {
  io::Plot plot{.title = scene.name};
  if (floats(scene)) plot.panels = {base_panel(motion), turning_panel(motion)};
  io::Panel q = joint_panel(scene, motion, "position", "q [rad, m]", motion.q, true);
  io::Panel v = joint_panel(scene, motion, "velocity", "v [rad/s, m/s]", motion.v, false);
  if (!q.series.empty()) plot.panels.insert(plot.panels.end(), {std::move(q), std::move(v)});
  if (motion.drive.size() > 0 && !motion.drive.isZero(0)) {
    io::Panel drive{.title = "drive", .x_label = "time [s]", .y_label = "tau [N m, N]"};
    const std::vector<std::string> names = driven_names(scene.robot);
    for (std::size_t k = 0; k < names.size(); ++k)
      add(drive, names[k], motion, row_of(motion.drive, long(k)));
    plot.panels.push_back(std::move(drive));
  }
  return plot;
}

io::Plot energy_plot(const Scene& scene, const SimulatedMotion& motion) {
  io::Panel energy{.title = "energy", .x_label = "time [s]", .y_label = "[J]"};
  std::vector<double> sum;
  for (int k = 0; k < motion.samples(); ++k) sum.push_back(motion.energy(k));
  add(energy, "kinetic", motion, motion.kinetic);
  add(energy, "stored", motion, motion.stored);
  add(energy, "sum", motion, sum);
  io::Panel work{.title = "work done on the robot", .x_label = "time [s]", .y_label = "[J]"};
  for (const EnergyFlow& flow : motion.flows) {
    const bool any = std::any_of(flow.work.begin(), flow.work.end(), [](double w) { return w != 0; });
    if (any) add(work, flow.name, motion, flow.work);
  }
  io::Plot plot{.title = scene.name, .panels = {std::move(energy)}};
  if (!work.series.empty()) plot.panels.push_back(std::move(work));
  return plot;
}

}  // namespace dyntape
