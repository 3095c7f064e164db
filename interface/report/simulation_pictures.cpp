// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/report/simulation_results.h>

#include <algorithm>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/algorithms.h>

namespace dyntape {

namespace {

using Eigen::MatrixXd;

std::vector<double> row_of(const MatrixXd& curves, Eigen::Index i) {
  const Eigen::VectorXd row = curves.row(i);
  return {row.begin(), row.end()};
}

void add(io::Panel& panel, const std::string& name, const SimulatedMotion& motion,
         const std::vector<double>& y) {
  panel.series.push_back({.name = name, .x = io::thinned(motion.t), .y = io::thinned(y)});
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
  if (floats(scene.robot.model)) plot.panels = {base_panel(motion), turning_panel(motion)};
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

namespace {

// visit(body, r, law) of every effect that acts at points.
template <class Visit>
void for_each_point(const dynamics::Effects<double>& effects, const Visit& visit) {
  dynamics::for_each_chosen_effect(effects, [&](const auto& effect) {
    if constexpr (requires { effect.for_each_point(visit); }) effect.for_each_point(visit);
  });
}

// "contacts at FL_FOOT"; of points that are no frame's origin, their numbers.
std::vector<std::string> point_names(const Scene& scene) {
  std::vector<std::string> names;
  dynamics::for_each_chosen_effect(scene.robot.effects, [&](const auto& effect) {
    const auto add_name = [&](int body, const Eigen::Vector3d& r, const auto&) {
      if (body < 0) return;
      std::string place = "point " + std::to_string(names.size() + 1);
      for (const auto& frame : scene.robot.model.frames) {
        if (frame.body == body && frame.X_BF.p == r) place = frame.name;
      }
      names.push_back(std::string(dynamics::effect_name(effect)) + " at " + place);
    };
    if constexpr (requires { effect.for_each_point(add_name); }) effect.for_each_point(add_name);
  });
  for (const auto& contact : scene.robot.constraints.rigid.contacts)
    names.push_back("rigid contact at " + contact.name);
  return names;
}

// What rigid contacts carry in a sample, at the points where they touch.
void add_rigid_forces(const Scene& scene, const SimulatedMotion& motion, int k,
                      const dynamics::Data<double>& data, std::vector<PlayerContact>& forces) {
  Eigen::Index row = 0;
  for (const auto& contact : scene.robot.constraints.rigid.contacts) {
    Eigen::Matrix3d axes = dynamics::plane_axes(contact.normal);
    if (contact.plane_body >= 0) axes = data.X_WB[std::size_t(contact.plane_body)].R * axes;
    const Eigen::Index rows = contact.friction > 0 ? 3 : 1;
    const auto& X = data.X_WB[std::size_t(contact.body)];
    const Eigen::Vector3d point = X.R * contact.X_BF.p + X.p - contact.radius * axes.col(0);
    forces.push_back({point, axes.leftCols(rows) * motion.reactions.col(k).segment(row, rows)});
    row += rows;
  }
}

// The ground that an effect stands on, as the page draws it.
void add_ground(const dynamics::Effects<double>& effects, const Eigen::Vector2d& middle,
                PlayerInput& player) {
  dynamics::for_each_chosen_effect(effects, [&](const auto& effect) {
    if constexpr (requires { effect.ground; }) {
      const auto& ground = effect.ground;
      if (ground.kind == dynamics::GroundKind::kPlane) {
        player.plane = {ground.normal, ground.offset};
        return;
      }
      constexpr int kPoints = 81;
      constexpr double kSize = 8;
      PlayerHeights heights{middle - Eigen::Vector2d::Constant(kSize / 2),
                            {kSize / (kPoints - 1), kSize / (kPoints - 1)},
                            MatrixXd(kPoints, kPoints)};
      for (int i = 0; i < kPoints; ++i) {
        for (int j = 0; j < kPoints; ++j) {
          const Eigen::Vector3d p(heights.corner.x() + i * heights.step.x(),
                                  heights.corner.y() + j * heights.step.y(), 0);
          const auto below = ground.below(p);
          heights.heights(i, j) = -below.distance / below.normal.z();
        }
      }
      player.heights = std::move(heights);
    }
  });
}

dynamics::UrdfVisuals visuals_of(const Scene& scene, const std::stop_token& stop) {
  if (scene.urdf.empty()) return {};  // of a robot that came without a file
  try {
    return dynamics::read_visuals(scene.urdf, scene.robot.model, {.stop = stop});
  } catch (const Error& e) {
    dynamics::UrdfVisuals none;
    none.notes.push_back(e.what());
    return none;
  }
}

PlayerValue told(const std::string& name, const std::vector<double>& values) {
  return {name, "J", Eigen::Map<const Eigen::VectorXd>(values.data(), Eigen::Index(values.size()))};
}

}  // namespace

std::vector<std::vector<PlayerContact>> point_forces(const Scene& scene, const SimulatedMotion& motion) {
  const dynamics::Model<double>& model = scene.robot.model;
  dynamics::Data<double> data(model);
  std::vector<std::vector<PlayerContact>> forces(std::size_t(motion.samples()));
  for (int k = 0; k < motion.samples(); ++k) {
    dynamics::forward_kinematics<double>(model, data, motion.q.col(k), motion.v.col(k));
    for_each_point(scene.robot.effects, [&](int body, const Eigen::Vector3d& r, const auto& law) {
      if (body < 0) return;
      const dynamics::PointMotion<double> at = dynamics::point_motion<double>(data, body, r);
      forces[std::size_t(k)].push_back({at.p, law.force(at).linear});
    });
    add_rigid_forces(scene, motion, k, data, forces[std::size_t(k)]);
  }
  return forces;
}

io::Plot force_plot(const Scene& scene, const SimulatedMotion& motion) {
  const std::vector<std::vector<PlayerContact>> forces = point_forces(scene, motion);
  const std::vector<std::string> names = point_names(scene);
  io::Plot plot{.title = scene.name};
  if (forces.empty() || names.empty()) return plot;
  const auto panel = [&](const std::string& title, const auto& part) {
    io::Panel p{.title = title, .x_label = "time [s]", .y_label = "[N]"};
    for (std::size_t i = 0; i < names.size(); ++i) {
      std::vector<double> y;
      for (const auto& sample : forces) y.push_back(part(sample[i].force));
      add(p, names[i], motion, y);
    }
    return p;
  };
  plot.panels = {panel("forces at points, upwards", [](const Eigen::Vector3d& f) { return f.z(); }),
                 panel("sideways", [](const Eigen::Vector3d& f) { return std::hypot(f.x(), f.y()); })};
  return plot;
}

PlayerInput scene_player(const Scene& scene, const SimulatedMotion& motion, const std::stop_token& stop) {
  PlayerInput player{.title = scene.name, .model = scene.robot.model, .visuals = visuals_of(scene, stop)};
  player.t = Eigen::Map<const Eigen::VectorXd>(motion.t.data(), motion.samples());
  player.q = motion.q;
  player.contacts = point_forces(scene, motion);
  player.values = {told("kinetic energy", motion.kinetic), told("stored energy", motion.stored)};
  // A fixed base stands at the origin.
  const Eigen::Vector2d middle = floats(scene.robot.model)
                                     ? Eigen::Vector2d(motion.q.topRows<2>().rowwise().mean())
                                     : Eigen::Vector2d::Zero();
  add_ground(scene.robot.effects, middle, player);
  for (const auto& contact : scene.robot.constraints.rigid.contacts)
    if (contact.plane_body < 0) player.plane = {contact.normal, contact.offset};
  return player;
}

}  // namespace dyntape
