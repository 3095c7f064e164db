// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/solve/pictures.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include <dyntape/interface/io/number.h>
#include <dyntape/interface/motion/robot_configuration.h>
#include <dyntape/interface/report/player/shapes.h>
#include <dyntape/interface/report/plot/curves.h>
#include <dyntape/interface/run/solve/hidden_parts.h>

namespace dyntape {

namespace {

using Eigen::MatrixXd;

// What one panel shows: curves of one unit.
struct Quantity {
  std::string title, unit;
  bool operator==(const Quantity&) const = default;
};
struct Group {
  Quantity quantity;
  std::vector<Eigen::Index> rows;
};

// Rows of one quantity together, in the order in which they come.
class Groups {
 public:
  void add(const Quantity& quantity, Eigen::Index row) {
    const auto is_same = [&](const Group& group) { return group.quantity == quantity; };
    auto group = std::find_if(groups_.begin(), groups_.end(), is_same);
    if (group == groups_.end()) group = groups_.insert(groups_.end(), {quantity, {}});
    group->rows.push_back(row);
  }
  const std::vector<Group>& all() const { return groups_; }

 private:
  std::vector<Group> groups_;
};

// Entry k of a joint's velocity, or of its position where that has as many, or one of a rotation's numbers.
Quantity quantity_of(dynamics::JointType type, int k, bool of_q) {
  using dynamics::JointType;
  const bool is_single = dynamics::is_single(type);
  const int linear = type == JointType::kFreeFlyer ? 3 : type == JointType::kPlanar ? 2 : 0;
  const std::string of = linear > 0 ? " of the base" : "";
  if (type == JointType::kPrismatic || k < linear)
    return of_q ? Quantity{"position" + of, "q [m]"} : Quantity{"velocity" + of, "v [m/s]"};
  if (!of_q)
    return linear > 0 ? Quantity{"angular velocity" + of, "v [rad/s]"}
                      : Quantity{"joint velocity", "v [rad/s]"};
  if (is_single && dynamics::nq(type) == 1) return {"joint angle", "q [rad]"};
  if (is_single) return {"cosine and sine of the joint angle", "q [-]"};
  return {type == JointType::kPlanar ? "cosine and sine of the base's angle"
                                     : "orientation" + of + ", quaternion",
          "q [-]"};
}

Groups groups_of(const dynamics::Model<double>& model, bool of_q) {
  Groups groups;
  for (const auto& joint : model.joints) {
    const int count = of_q ? dynamics::nq(joint.type) : dynamics::nv(joint.type);
    for (int k = 0; k < count; ++k)
      groups.add(quantity_of(joint.type, k, of_q), (of_q ? joint.idx_q : joint.idx_v) + k);
  }
  return groups;
}

// Motors, then forces at contacts and of thrusters.
Groups groups_of_controls(const Task& task, Eigen::Index rows) {
  Groups groups;
  const std::vector<int> driven = actuated_dofs(task.scene);
  for (Eigen::Index row = 0; row < rows; ++row) {
    const bool is_motor = row < Eigen::Index(driven.size());
    bool slides = !is_motor;
    for (const auto& joint : task.scene.model.joints)
      slides = slides || (is_motor && joint.idx_v == driven[std::size_t(row)] &&
                          joint.type == dynamics::JointType::kPrismatic);
    groups.add(!is_motor ? Quantity{"forces", "f [N]"}
               : slides  ? Quantity{"force of the drives", "tau [N]"}
                         : Quantity{"torque of the drives", "tau [N m]"},
               row);
  }
  return groups;
}

// Limits that a curve comes near to, by three quarters of its range; of many curves, only those that it all but
// meets.  The others would only squeeze the picture.
std::vector<io::ReferenceLine> near_limits(const MatrixXd& curves, const Bounds& limits) {
  std::set<double> shown;
  const double near = curves.rows() > 3 ? 0.97 : 0.75;
  for (Eigen::Index i = 0; i < curves.rows(); ++i) {
    const double lower = limits.lower[i], upper = limits.upper[i];
    if (!std::isfinite(lower) || !std::isfinite(upper)) continue;
    if (curves.row(i).maxCoeff() > lower + near * (upper - lower)) shown.insert(upper);
    if (curves.row(i).minCoeff() < upper - near * (upper - lower)) shown.insert(lower);
  }
  std::vector<io::ReferenceLine> lines;
  for (double value : shown) lines.push_back({value, lines.empty() ? "limit" : ""});
  return lines;
}

// Where the task bounds something, its bounds; elsewhere the robot's.
Bounds or_else(const Bounds& bounds, const Bounds& robot) {
  const auto choose = [](const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
    return Eigen::VectorXd(a.array().isFinite().select(a, b));
  };
  return {choose(bounds.lower, robot.lower), choose(bounds.upper, robot.upper)};
}

// What curves shall be, where a task says it (NaN: where it does not).
void add_targets(io::Panel& panel, const std::vector<std::string>& names, const Eigen::VectorXd& t,
                 const MatrixXd& targets) {
  bool any = false;
  for (Eigen::Index i = 0; i < targets.rows(); ++i) {
    if (!targets.row(i).array().isFinite().any()) continue;
    io::Series series = io::curve("", t, targets.row(i));
    series.target_of = names[std::size_t(i)];
    panel.series.push_back(std::move(series));
    any = true;
  }
  if (any) panel.title += ", dotted: its target";
}

// A panel a quantity; `targets` has no rows, or those of the curves.
void add_panels(io::Plot& plot, const Groups& groups, const std::vector<std::string>& names,
                const Trajectory& motion, const MatrixXd& curves, const Bounds& limits,
                const MatrixXd& targets = {}) {
  for (const auto& [quantity, rows] : groups.all()) {
    const MatrixXd own = curves(rows, Eigen::all);
    std::vector<std::string> own_names;
    for (const Eigen::Index row : rows) own_names.push_back(names[std::size_t(row)]);
    io::Panel p = io::over_time(quantity.title, quantity.unit, own_names, motion.t, own);
    p.horizontal = near_limits(own, {limits.lower(rows), limits.upper(rows)});
    if (targets.rows() > 0) add_targets(p, own_names, motion.t, targets(rows, Eigen::all));
    plot.panels.push_back(std::move(p));
  }
}

// Without the letter of their block: of joints "elbow".
std::vector<std::string> plain_names(std::vector<std::string> names) {
  for (std::string& name : names) name.erase(0, name.find('.') + 1);
  return names;
}

// Likewise, and of a base the axes.
std::vector<std::string> names_of(const dynamics::Model<double>& model, bool of_q) {
  using dynamics::JointType;
  std::vector<std::string> names = plain_names(entry_names_of(model, of_q ? "q." : "v.", of_q));
  for (const auto& joint : model.joints) {
    const auto first = names.begin() + (of_q ? joint.idx_q : joint.idx_v);
    const std::vector<std::string> of_base =
        joint.type == JointType::kFreeFlyer ? std::vector<std::string>{"x", "y", "z", "x", "y", "z", "w"}
        : joint.type == JointType::kPlanar  ? std::vector<std::string>{"x", "y", of_q ? "cos" : "z", "sin"}
                                            : std::vector<std::string>{};
    const int count = of_q ? dynamics::nq(joint.type) : dynamics::nv(joint.type);
    if (!of_base.empty()) std::copy_n(of_base.begin(), count, first);
  }
  return names;
}

}  // namespace

namespace {

// (nq + nv x points) What a controller draws states to, NaN where it does not; without rows where it knows none.
MatrixXd targets_of(const Task& task, const Eigen::VectorXd& t) {
  if (!task.aim.state) return {};
  MatrixXd targets(task.scene.model.nq + task.scene.model.nv, t.size());
  for (Eigen::Index p = 0; p < t.size(); ++p) targets.col(p) = task.aim.state(t[p]);
  return targets;
}

// Of the frame that a controller draws to a place.
io::Panel place_panel(const Task& task, const Trajectory& motion) {
  const auto& model = task.scene.model;
  dynamics::Data<double> data(model);
  MatrixXd place(3, motion.points());
  for (int p = 0; p < motion.points(); ++p) {
    dynamics::forward_kinematics(model, data, Eigen::VectorXd(motion.x.col(p).head(model.nq)));
    place.col(p) = frame_placement(model, data, model.frame_index(task.aim.frame)).p;
  }
  std::vector<std::string> names;
  for (const char* axis : {"x", "y", "z"}) names.push_back(axis + (" of " + task.aim.frame));
  io::Panel panel = io::over_time("place of " + task.aim.frame, "[m]", names, motion.t, place);
  add_targets(panel, names, motion.t, task.aim.place.replicate(1, motion.points()));
  return panel;
}

io::Plot plot_of_curves(const Task& task, const Trajectory& motion, const MatrixXd& targets) {
  const Curves c = curves_of(task, motion);
  const auto& model = task.scene.model;
  const std::vector<int> driven = actuated_dofs(task.scene);
  Problem robot = task.problem;  // with the robot's limits for bounds
  limit_positions(robot, task.scene);
  limit_velocities(robot, task.scene);
  limit_efforts(robot, task.scene, task.robot.unit);
  const Bounds x = or_else(task.problem.x, robot.x);
  Bounds u = or_else(task.problem.u, robot.u);
  if (task.robot.unit == ControlUnit::kFraction) {
    for (std::size_t k = 0; k < driven.size(); ++k) {
      const double limit = effort_limit(model, driven[k]);
      u.lower[long(k)] *= limit;
      u.upper[long(k)] *= limit;
    }
  }
  io::Plot plot;
  plot.title = task.name;
  add_panels(plot, groups_of(model, true), names_of(model, true), motion, c.q,
             {x.lower.head(model.nq), x.upper.head(model.nq)},
             targets.topRows(targets.rows() > 0 ? model.nq : 0));
  add_panels(plot, groups_of(model, false), names_of(model, false), motion, c.v,
             {x.lower.tail(model.nv), x.upper.tail(model.nv)},
             targets.bottomRows(targets.rows() > 0 ? model.nv : 0));
  add_panels(plot, groups_of_controls(task, c.tau.rows()), plain_names(task.problem.controls), motion, c.tau,
             u);
  return plot;
}

}  // namespace

io::Plot trajectory_plot(const Task& task, const Trajectory& motion) {
  return plot_of_curves(task, motion, {});
}

io::Plot tracking_plot(const Task& task, const Trajectory& motion) {
  io::Plot plot = plot_of_curves(task, motion, targets_of(task, motion.t));
  if (!task.aim.frame.empty()) plot.panels.insert(plot.panels.begin(), place_panel(task, motion));
  return plot;
}

namespace {

// The outline of a ball or bar that stands in the world.  The picture of a point p is M p; seen from afar in the direction n
// of the picture, a ball's edge is at M (c + r M^T n / |M^T n|), a bar's at that of the end that lies further out.
io::Polyline outline(View view, const Capsule& capsule) {
  Eigen::Matrix<double, 2, 3> M;
  for (int k = 0; k < 3; ++k) {
    const auto [x, y] = project(view, Eigen::Vector3d::Unit(k));
    M.col(k) << x, y;
  }
  constexpr int kSides = 64;
  io::Polyline line;
  for (int i = 0; i <= kSides; ++i) {
    const double angle = 2 * std::numbers::pi * (i % kSides) / kSides;
    const Eigen::Vector3d out = M.transpose() * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    const Eigen::Vector3d& end = out.dot(capsule.to - capsule.from) > 0 ? capsule.to : capsule.from;
    const Eigen::Vector2d p = M * (end + capsule.radius * out.normalized());
    line.push_back({p.x(), p.y()});
  }
  return line;
}

// Its shapes in a page: a ball an end, and what lies between.
void add_capsule(const Capsule& capsule, std::vector<dynamics::Visual>& shapes) {
  using dynamics::Shape;
  const Eigen::Vector4d color(0.80, 0.36, 0.30, 1);
  const auto add = [&](Shape shape, const dynamics::Placement<double>& X, const Eigen::Vector3d& scale) {
    shapes.push_back({.link = "", .body = -1, .X_BV = X, .shape = shape, .scale = scale, .color = color});
  };
  const double r = capsule.radius;
  const Eigen::Vector3d along = capsule.to - capsule.from;
  add(Shape::kSphere, {Eigen::Matrix3d::Identity(), capsule.from}, Eigen::Vector3d::Constant(r));
  if (capsule.is_ball()) return;
  const Eigen::Matrix3d R = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), along).matrix();
  add(Shape::kCylinder, {R, (capsule.from + capsule.to) / 2}, {r, r, along.norm()});
  add(Shape::kSphere, {R, capsule.to}, Eigen::Vector3d::Constant(r));
}

bool slides_on_world(const dynamics::Model<double>& model, int joint) {
  return model.parent[std::size_t(joint)] < 0 && !only_places(model, joint) &&
         model.joints[std::size_t(joint)].type == dynamics::JointType::kPrismatic;
}

bool floats_in_world(const dynamics::Model<double>& model, int joint) {
  return model.parent[std::size_t(joint)] < 0 && dynamics::nv(model.joints[std::size_t(joint)].type) > 1;
}

constexpr double kShortBone = 1e-6;  // m

// Bones of the robot: from each body's origin to the joints and frames that it carries; of a robot that has none its bodies.
std::vector<Bone> bones(const Task& task, const dynamics::Data<double>& data) {
  const auto& model = task.scene.model;
  std::vector<Bone> parts;
  const auto add = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    if ((to - from).norm() > kShortBone) parts.push_back({from, to});
  };
  for (int i = 0; i < model.njoints(); ++i) {
    if (slides_on_world(model, i) || floats_in_world(model, i)) continue;  // nothing, or a rail, lies between
    const int parent = model.parent[std::size_t(i)];
    if (only_places(model, i) || (parent >= 0 && only_places(model, parent))) continue;
    const Eigen::Vector3d origin = data.X_WB[std::size_t(i)].p;
    add(parent < 0 ? Eigen::Vector3d::Zero() : data.X_WB[std::size_t(parent)].p, origin);
  }
  for (std::size_t f = 0; f < model.frames.size(); ++f) {
    const int body = model.frames[f].body;
    if (body < 0) continue;
    add(data.X_WB[std::size_t(body)].p, frame_placement(model, data, int(f)).p);
  }
  if (!parts.empty()) return parts;
  for (int i = 0; i < model.njoints(); ++i) {
    const Eigen::Vector3d at = data.X_WB[std::size_t(i)].p;
    if (!slides_on_world(model, i)) parts.push_back({at, at});
  }
  return parts;
}

// Sliders on the world are drawn as boxes on rails: paths of their origins, in the picture.
using Path = std::vector<Eigen::Vector2d>;

Eigen::Vector2d vector_of(const std::array<double, 2>& p) { return {p[0], p[1]}; }

double extent(const io::Motion& picture, const std::vector<Path>& sliders) {
  Eigen::AlignedBox2d box;
  for (const io::MotionFrame& frame : picture.frames) {
    for (const auto* parts : {&frame.parts, &frame.behind})
      for (const io::Polyline& part : *parts)
        for (const auto& p : part) box.extend(vector_of(p));
  }
  for (const Path& path : sliders) {
    for (const Eigen::Vector2d& p : path) box.extend(p);
  }
  return box.isEmpty() ? 0 : box.sizes().maxCoeff();
}

void add_sliders(io::Motion& picture, const std::vector<Path>& sliders) {
  if (sliders.empty()) return;
  double size = extent(picture, sliders);
  if (size < kShortBone) size = 1;  // it stands still: boxes as of a motion of a metre
  const double a = 0.05 * size, b = 0.03 * size;
  for (const Path& path : sliders) {
    for (std::size_t k = 0; k < path.size(); ++k) {
      const double x = path[k].x(), y = path[k].y();
      picture.frames[k].parts.push_back(
          {{x - a, y - b}, {x + a, y - b}, {x + a, y + b}, {x - a, y + b}, {x - a, y - b}});
    }
    const auto order = [](const Eigen::Vector2d& p, const Eigen::Vector2d& q) { return p.sum() < q.sum(); };
    const auto [low, high] = std::minmax_element(path.begin(), path.end(), order);
    const Eigen::Vector2d margin = 0.12 * size * (*high - *low).stableNormalized();
    const Eigen::Vector2d from = *low - margin, to = *high + margin;
    picture.scenery.push_back({{from.x(), from.y()}, {to.x(), to.y()}});
  }
}

}  // namespace

io::Plot motion_plot(const Task& task, const Trajectory& motion) {
  const auto& model = task.scene.model;
  dynamics::Data<double> data(model);
  constexpr std::pair<const char*, const char*> kAxes[] = {
      {"x [m]", "z [m]"}, {"x [m]", "y [m]"}, {"y [m]", "z [m]"}, {"x, y aslant [m]", "z [m]"}};
  io::Motion picture{.title = task.name};
  picture.x_label = kAxes[int(task.view)].first;
  picture.y_label = kAxes[int(task.view)].second;
  for (const std::string& name : task.traces) picture.traces.push_back({name, {}});
  std::vector<int> sliding;
  for (int i = 0; i < model.njoints(); ++i) {
    if (slides_on_world(model, i)) sliding.push_back(i);
  }
  std::vector<Path> sliders(sliding.size());
  for (int p = 0; p < motion.points(); ++p) {
    dynamics::forward_kinematics(model, data, Eigen::VectorXd(motion.x.col(p).head(model.nq)));
    picture.frames.push_back(frame_of(task.view, task.around.obstacles, motion.t[p], bones(task, data)));
    for (std::size_t k = 0; k < sliding.size(); ++k) {
      sliders[k].push_back(vector_of(project(task.view, data.X_WB[std::size_t(sliding[k])].p)));
    }
    for (io::Trace& trace : picture.traces) {
      const int frame = model.frame_index(trace.name);
      trace.points.push_back(project(task.view, frame_placement(model, data, frame).p));
    }
  }
  constexpr std::size_t kManyBones = 12;  // of which few instants are enough to see the motion
  const io::MotionFrame& first = picture.frames.front();
  if (first.parts.size() + first.behind.size() > kManyBones) picture.most_frames = 5;
  add_sliders(picture, sliders);
  for (const Capsule& thing : task.around.obstacles)
    picture.obstacles.push_back(
        {thing.name + ", r = " + io::shortest(thing.radius) + " m", outline(task.view, thing)});
  for (const Capsule& place : task.passed)
    picture.obstacles.push_back({place.name, outline(task.view, place), false});
  io::Plot plot;
  plot.panels = {io::motion_panel(picture)};
  return plot;
}

PlayerInput motion_player(const Task& task, const Trajectory& motion, const std::stop_token& stop) {
  const auto& model = task.scene.model;
  const Curves c = curves_of(task, motion);
  const std::vector<int> driven = actuated_dofs(task.scene);
  PlayerInput player{.title = task.name, .model = model, .t = motion.t, .q = c.q, .traces = task.traces};
  player.visuals = dynamics::read_visuals(task.urdf, model, {.stop = stop});
  for (const std::vector<Capsule>* things : {&task.around.obstacles, &task.passed}) {
    for (const Capsule& thing : *things) add_capsule(thing, player.surroundings);
  }
  dynamics::Data<double> data(model);
  Eigen::VectorXd power = Eigen::VectorXd::Zero(motion.points()), potential = power;
  for (int p = 0; p < motion.points(); ++p) {
    for (std::size_t k = 0; k < driven.size(); ++k) power[p] += c.tau(long(k), p) * c.v(driven[k], p);
    potential[p] = dynamics::potential_energy<double>(model, data, c.q.col(p));
  }
  player.values = {{"power of the drives", "W", power}, {"potential energy", "J", potential}};
  return player;
}

}  // namespace dyntape
