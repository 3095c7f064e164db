// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/report/simulation_results.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/report/joints/joint_panels.h>
#include <dyntape/interface/report/plot/curves.h>

namespace dyntape {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd vector_of(const std::vector<double>& values) {
  return VectorXd::Map(values.data(), Eigen::Index(values.size()));
}

// No more points than can be told apart.
io::Plot with_fewer_points(io::Plot plot) {
  for (io::Panel& panel : plot.panels) {
    for (io::Series& series : panel.series)
      series.x = io::thinned(series.x), series.y = io::thinned(series.y);
  }
  return plot;
}

}  // namespace

io::Plot state_plot(const Scene& scene, const SimulatedMotion& motion) {
  const VectorXd t = vector_of(motion.t);
  const dynamics::Model<double>& model = scene.robot.model;
  io::Plot plot{.title = scene.name};
  add_positions(plot, model, t, {motion.q});
  add_velocities(plot, model, t, {motion.v});
  if (motion.drive.size() > 0 && !motion.drive.isZero(0))
    add_efforts(plot, model, actuated_dofs(scene.robot), t, {motion.drive});
  arrange_limbs(plot, model);
  return with_fewer_points(std::move(plot));
}

io::Plot energy_plot(const Scene& scene, const SimulatedMotion& motion) {
  const VectorXd t = vector_of(motion.t), kinetic = vector_of(motion.kinetic),
                 stored = vector_of(motion.stored);
  MatrixXd energies(3, t.size());
  energies << kinetic.transpose(), stored.transpose(), (kinetic + stored).transpose();
  io::Panel work{.title = "work done on the robot", .x_label = "time [s]", .y_label = "[J]"};
  for (const EnergyFlow& flow : motion.flows) {
    const VectorXd done = vector_of(flow.work);
    if (!done.isZero(0)) work.series.push_back(io::curve(flow.name, t, done));
  }
  io::Plot plot{.title = scene.name,
                .panels = {io::over_time("energy", "[J]", {"kinetic", "stored", "sum"}, t, energies)}};
  if (!work.series.empty()) plot.panels.push_back(std::move(work));
  return with_fewer_points(std::move(plot));
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
template <class Ground>
PlayerHeights heights_of(const Ground& ground, const Eigen::Vector2d& middle) {
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
  return heights;
}

void add_ground(const dynamics::Effects<double>& effects, const Eigen::Vector2d& middle,
                PlayerInput& player) {
  dynamics::for_each_chosen_effect(effects, [&](const auto& effect) {
    if constexpr (requires { effect.ground; }) {
      const auto& ground = effect.ground;
      if (ground.kind == dynamics::GroundKind::kPlane) {
        player.plane = {ground.normal, ground.offset};
        return;
      }
      player.heights = heights_of(ground, middle);
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
    MatrixXd parts(names.size(), forces.size());
    for (std::size_t i = 0; i < names.size(); ++i) {
      for (std::size_t k = 0; k < forces.size(); ++k) parts(i, k) = part(forces[k][i].force);
    }
    return io::over_time(title, "[N]", names, vector_of(motion.t), parts);
  };
  // An impact between two samples is in none.
  const std::string samples =
      scene.stride() > 1 ? ", at samples " + io::significant(1e3 * scene.sample, 3) + " ms apart" : "";
  plot.panels = {panel("forces at points, upwards" + samples, [](const Eigen::Vector3d& f) { return f.z(); }),
                 panel("sideways", [](const Eigen::Vector3d& f) { return std::hypot(f.x(), f.y()); })};
  plot.one_legend = true;
  return with_fewer_points(std::move(plot));
}

PlayerInput scene_player(const Scene& scene, const SimulatedMotion& motion, const std::stop_token& stop) {
  PlayerInput player{.title = scene.name, .model = scene.robot.model, .visuals = visuals_of(scene, stop)};
  player.t = vector_of(motion.t);
  player.q = motion.q;
  player.contacts = point_forces(scene, motion);
  player.values = {{"kinetic energy", "J", vector_of(motion.kinetic)},
                   {"stored energy", "J", vector_of(motion.stored)}};
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
