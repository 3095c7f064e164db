// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/mpc/centroidal_pictures.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <dyntape/interface/motion/standing.h>
#include <dyntape/interface/report/plot/curves.h>

namespace dyntape {

namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kFrames = 60, kLift = 0.04;  // a second; m, of a foot in the air

struct FootOverTime {
  MatrixXd place;  // (3 x points)
  VectorXd load;   // (points)
};

// As the schedule has it.
FootOverTime foot_over_time(const CentroidalTask& task, const std::string& name, const VectorXd& t) {
  const Parameter place = task.problem.parameters.find(name + " place"),
                  load = task.problem.parameters.find(name + " load");
  FootOverTime foot{MatrixXd(3, t.size()), VectorXd(t.size())};
  for (Eigen::Index p = 0; p < t.size(); ++p) {
    const Stage<double> s = task.problem.stage(t[p], {}, {}, {});
    foot.place.col(p) = place(s);
    foot.load[p] = load(s)[0];
  }
  return foot;
}

// In the air it goes from where it stood to where it will, in an arc: no more than a picture of a step.
void swing(FootOverTime& foot) {
  const Eigen::Index n = foot.load.size();
  for (Eigen::Index p = 0; p < n; ++p) {
    if (foot.load[p] > 0) continue;
    Eigen::Index from = p - 1, to = p;
    while (to < n && foot.load[to] == 0) ++to;
    const Vector3d left = foot.place.col(std::max<Eigen::Index>(from, 0));
    const Vector3d next = foot.place.col(std::min(to, n - 1));
    for (; p < to; ++p) {
      const double part = double(p - from) / double(to - from);
      foot.place.col(p) =
          left + part * (next - left) + Vector3d(0, 0, kLift * std::sin(std::numbers::pi * part));
    }
  }
}

io::Series path_of(const std::string& name, const MatrixXd& points) {
  return io::curve(name, points.row(0), points.row(1));
}

// Closed.
io::Series outline_of(const std::vector<Vector2d>& corners, const std::string& color) {
  MatrixXd points(2, Eigen::Index(corners.size()) + 1);
  for (Eigen::Index k = 0; k < points.cols(); ++k) points.col(k) = corners[std::size_t(k) % corners.size()];
  io::Series series = path_of("", points);
  series.color = color;
  series.mark = io::Mark::kBoth;
  return series;
}

// Light to dark as time goes on, each place once: of feet that come back to it, the first.
void add_supports(const std::vector<SupportPhase>& phases, io::Panel& above) {
  std::vector<const SupportPhase*> shown;
  for (const SupportPhase& phase : phases) {
    const auto is_there = [&](const SupportPhase* other) { return other->corners == phase.corners; };
    if (!phase.corners.empty() && std::none_of(shown.begin(), shown.end(), is_there)) shown.push_back(&phase);
  }
  for (std::size_t k = 0; k < shown.size(); ++k) {
    const double s = shown.size() > 1 ? double(k) / double(shown.size() - 1) : 0.5;
    above.series.push_back(outline_of(shown[k]->corners, io::shade("#c8c8c8", "#404040", s)));
    above.series.back().layer = -1;
    if (k == shown.size() / 2)
      above.series.back().name = shown.size() > 1 ? "supports, light to dark" : "support";
  }
}

// How far the supports reach along an axis while they last.
io::Series edges_of(const std::vector<SupportPhase>& phases, const VectorXd& t, int axis) {
  io::Series edges{.name = "edges of the support", .color = "#8a8a8a", .width = 1.2};
  for (const bool is_upper : {false, true}) {
    for (const SupportPhase& phase : phases) {
      if (phase.corners.empty()) continue;
      const auto [low, high] =
          std::minmax_element(phase.corners.begin(), phase.corners.end(),
                              [axis](const Vector2d& a, const Vector2d& b) { return a[axis] < b[axis]; });
      const double edge = is_upper ? (*high)[axis] : (*low)[axis];
      edges.x.insert(edges.x.end(), {t[phase.first], t[phase.last], std::nan("")});
      edges.y.insert(edges.y.end(), {edge, edge, std::nan("")});
    }
  }
  return edges;
}

// Points of a motion at so many frames a second.
std::vector<int> frames_of(const Trajectory& motion) {
  std::vector<int> frames;
  double next = 0;
  for (int p = 0; p < motion.points(); ++p) {
    const bool is_last = p + 1 == motion.points();
    if (motion.t[p] < next - 1e-9 && !is_last) continue;
    frames.push_back(p);
    next = motion.t[p] + 1 / kFrames;
  }
  return frames;
}

}  // namespace

MatrixXd forces_on_floor(const CentroidalTask& task, const Trajectory& motion) {
  MatrixXd forces = motion.u;
  for (std::size_t i = 0; i < task.body.feet.size(); ++i) {
    const FootOverTime foot = foot_over_time(task, task.body.feet[i].name, motion.t);
    forces.middleRows(3 * Eigen::Index(i), 3) *= foot.load.asDiagonal();
  }
  return forces;
}

std::vector<Vector2d> support_polygon(std::vector<Vector2d> points) {
  const auto comes_first = [](const Vector2d& a, const Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  };
  std::sort(points.begin(), points.end(), comes_first);
  std::vector<Vector2d> hull;
  // The lower side from left to right, then the upper one back: turns to the left alone.
  for (int side = 0; side < 2; ++side) {
    const std::size_t begin = hull.size();
    for (const Vector2d& p : points) {
      const auto turns_left = [&] {
        const Vector2d a = hull.back() - hull[hull.size() - 2], b = p - hull.back();
        return a.x() * b.y() - a.y() * b.x() > 0;
      };
      while (hull.size() >= begin + 2 && !turns_left()) hull.pop_back();
      hull.push_back(p);
    }
    if (!hull.empty()) hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull.empty() ? points : hull;  // a point alone has no sides
}

Vector2d capture_point(const CentroidalBody& body, const VectorXd& state) {
  double floor = 0;
  for (const CentroidalBody::Foot& foot : body.feet) floor += foot.place.z() / double(body.feet.size());
  const double omega = std::sqrt(-body.gravity.z() / (state[2] - floor));
  return state.head<2>() + state.segment<2>(3) / omega;
}

Vector3d wanted_mass(const CentroidalTask& task, double t) {
  return task.problem.parameters.find("com")(task.problem.stage(t, {}, {}, {}));
}

std::vector<SupportPhase> support_phases(const CentroidalTask& task, const VectorXd& t) {
  std::vector<FootOverTime> feet;
  for (const CentroidalBody::Foot& foot : task.body.feet) feet.push_back(foot_over_time(task, foot.name, t));
  std::vector<SupportPhase> phases;
  for (int p = 0; p < t.size(); ++p) {
    std::vector<Vector2d> places;
    for (const FootOverTime& foot : feet)
      if (foot.load[p] > 0) places.push_back(foot.place.col(p).head<2>());
    std::vector<Vector2d> corners = support_polygon(places);
    if (phases.empty() || phases.back().corners != corners) phases.push_back({p, p, std::move(corners)});
    phases.back().last = std::min(p + 1, int(t.size()) - 1);  // it holds until the next point
  }
  return phases;
}

io::Plot mass_plot(const CentroidalTask& task, const Trajectory& motion) {
  const MatrixXd forces = forces_on_floor(task, motion);
  const auto feet = Eigen::Index(task.body.feet.size());
  std::vector<std::string> names;
  MatrixXd upwards(feet, motion.points());
  for (Eigen::Index i = 0; i < feet; ++i) {
    names.push_back(task.body.feet[std::size_t(i)].name);
    upwards.row(i) = forces.row(3 * i + 2);
  }
  MatrixXd along(2, motion.points());
  for (int axis = 0; axis < 2; ++axis) {
    along.row(axis).setZero();
    for (Eigen::Index i = 0; i < feet; ++i) along.row(axis) += forces.row(3 * i + axis);
  }
  const MatrixXd moved = motion.x.topRows(3).colwise() - task.body.com;
  const std::vector<std::string> axes = {"x", "y", "z"};
  io::Plot plot;
  plot.title = task.name;
  plot.panels = {io::over_time("centre of mass, from where it starts", "[m]", axes, motion.t, moved),
                 io::over_time("its velocity", "[m/s]", axes, motion.t, motion.x.middleRows(3, 3)),
                 io::over_time("angular momentum", "[N m s]", axes, motion.t, motion.x.bottomRows(3)),
                 io::over_time("upward forces", "[N]", names, motion.t, upwards),
                 io::over_time("forces along the floor, of all feet", "[N]", {"x", "y"}, motion.t, along)};
  MatrixXd wanted(3, motion.points());
  for (int p = 0; p < motion.points(); ++p) wanted.col(p) = wanted_mass(task, motion.t[p]) - task.body.com;
  io::Panel targets = io::over_time("", "", {"", "", ""}, motion.t, wanted);
  for (std::size_t i = 0; i < axes.size(); ++i) {
    targets.series[i].target_of = axes[i];
    plot.panels[0].series.push_back(std::move(targets.series[i]));
  }
  plot.panels[0].title += ", dotted: its target";
  return plot;
}

io::Plot support_plot(const CentroidalTask& task, const Trajectory& motion) {
  const MatrixXd forces = forces_on_floor(task, motion);
  MatrixXd capture(2, motion.points()), pressure = MatrixXd::Zero(2, motion.points());
  VectorXd pressed = VectorXd::Zero(motion.points());
  for (std::size_t i = 0; i < task.body.feet.size(); ++i) {
    const FootOverTime foot = foot_over_time(task, task.body.feet[i].name, motion.t);
    for (int p = 0; p < motion.points(); ++p) {
      const double up = forces(3 * Eigen::Index(i) + 2, p);
      pressure.col(p) += up * foot.place.col(p).head<2>();
      pressed[p] += up;
    }
  }
  for (int p = 0; p < motion.points(); ++p) {
    capture.col(p) = capture_point(task.body, motion.x.col(p));
    pressure.col(p) /= pressed[p];  // none where nothing presses, which leaves a gap
  }
  const std::vector<SupportPhase> phases = support_phases(task, motion.t);
  const auto paths = [&](const MatrixXd& place, const MatrixXd& caught, const MatrixXd& pressed_on) {
    std::vector<io::Series> series = {path_of("centre of pressure", pressed_on),
                                      path_of("capture point", caught), path_of("centre of mass", place)};
    series[0].mark = io::Mark::kPoints;
    series[0].point = 0.5;
    return series;
  };
  io::Plot plot;
  plot.title = task.name + ": support";
  io::Panel above{
      .title = "from above", .x_label = "x [m]", .y_label = "y [m]", .equal_axes = true, .height = 380};
  above.series = paths(motion.x.topRows(2), capture, pressure);
  add_supports(phases, above);
  plot.panels.push_back(std::move(above));
  for (int axis = 0; axis < 2; ++axis) {
    const std::string name = axis == 0 ? "x" : "y";
    const auto over_time = [&](const MatrixXd& points) {
      MatrixXd curve(2, points.cols());
      curve << motion.t.transpose(), points.row(axis);
      return curve;
    };
    io::Panel panel{.title = "along " + name, .x_label = "time [s]", .y_label = name + " [m]"};
    panel.series = paths(over_time(motion.x), over_time(capture), over_time(pressure));
    panel.series.push_back(edges_of(phases, motion.t, axis));
    plot.panels.push_back(std::move(panel));
  }
  return plot;
}

PlayerInput mass_player(const CentroidalTask& task, const Trajectory& motion, const std::stop_token& stop) {
  const std::vector<int> frames = frames_of(motion);
  const auto n = Eigen::Index(frames.size());
  PlayerInput player{.title = task.name, .model = task.scene.model};
  player.visuals = dynamics::read_visuals(task.urdf, task.scene.model, {.stop = stop});
  player.t = motion.t(frames);
  player.q.resize(task.scene.model.nq, n);
  const MatrixXd forces = forces_on_floor(task, motion);
  std::vector<FootOverTime> feet;
  for (const CentroidalBody::Foot& foot : task.body.feet) {
    feet.push_back(foot_over_time(task, foot.name, player.t));
    swing(feet.back());
  }
  VectorXd off(n), speed(n), q = task.start.head(task.scene.model.nq);
  for (Eigen::Index k = 0; k < n; ++k) {
    const int p = frames[std::size_t(k)];
    Stand stand{motion.x.col(p).head<3>(), {}};
    std::vector<PlayerContact> pushes;
    for (std::size_t i = 0; i < feet.size(); ++i) {
      stand.feet.push_back({task.body.feet[i].name, feet[i].place.col(k)});
      if (feet[i].load[k] > 0)
        pushes.push_back({feet[i].place.col(k), forces.col(p).segment<3>(3 * Eigen::Index(i))});
    }
    const Posture pose = standing(task.scene, q, stand);
    q = player.q.col(k) = pose.q;
    off[k] = pose.off;
    speed[k] = motion.x.col(p).segment<3>(3).norm();
    player.contacts.push_back(std::move(pushes));
  }
  player.values = {{"speed of the centre of mass", "m/s", speed}, {"legs too short by", "m", off}};
  return player;
}

}  // namespace dyntape
