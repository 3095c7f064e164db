// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/solve/pictures.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>
#include <stop_token>

#include <dyntape/interface/files/task/task_phases.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/motion/robot_configuration.h>
#include <dyntape/interface/motion/standing.h>
#include <dyntape/interface/report/player/shapes.h>
#include <dyntape/interface/run/solve/hidden_parts.h>

namespace dyntape {

namespace {

using Eigen::MatrixXd;

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

Eigen::Vector2d vector_of(const std::array<double, 2>& p) { return {p[0], p[1]}; }

// The boxes of the robot's file that stand in the world, slide on it or float in it; other bodies are drawn by their bones.
std::vector<dynamics::Visual> boxes_of(const Task& task) {
  const auto& model = task.scene.model;
  std::vector<dynamics::Visual> boxes;
  if (task.urdf.empty()) return boxes;
  std::stop_source without_meshes;
  without_meshes.request_stop();
  for (dynamics::Visual& shape :
       dynamics::read_visuals(task.urdf, model, {.stop = without_meshes.get_token()}).shapes) {
    const bool is_free =
        shape.body < 0 || slides_on_world(model, shape.body) || floats_in_world(model, shape.body);
    if (shape.shape == dynamics::Shape::kBox && is_free) boxes.push_back(std::move(shape));
  }
  return boxes;
}

// The outline of a box in the picture: the convex hull of its corners, by their turns from left to right and back.
io::Polyline outline(View view, const dynamics::Visual& box, const dynamics::Data<double>& data) {
  std::vector<Eigen::Vector2d> corners;
  for (int k = 0; k < 8; ++k) {
    const Eigen::Vector3d corner =
        0.5 * box.scale.cwiseProduct(Eigen::Vector3d(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1));
    Eigen::Vector3d p = box.X_BV.R * corner + box.X_BV.p;
    if (box.body >= 0) p = data.X_WB[std::size_t(box.body)].R * p + data.X_WB[std::size_t(box.body)].p;
    corners.push_back(vector_of(project(view, p)));
  }
  std::sort(corners.begin(), corners.end(),
            [](const auto& p, const auto& q) { return std::pair(p.x(), p.y()) < std::pair(q.x(), q.y()); });
  std::vector<Eigen::Vector2d> hull;
  const auto turns_left = [&](const Eigen::Vector2d& p) {
    const Eigen::Vector2d a = hull.back() - hull[hull.size() - 2], b = p - hull.back();
    return a.x() * b.y() - a.y() * b.x() > 1e-12 * a.norm() * b.norm();
  };
  const auto walk = [&](auto begin, auto end) {
    const std::size_t first = hull.size();
    for (auto p = begin; p != end; ++p) {
      while (hull.size() > first + 1 && !turns_left(*p)) hull.pop_back();
      hull.push_back(*p);
    }
    hull.pop_back();  // the first of the way back
  };
  walk(corners.begin(), corners.end());
  walk(corners.rbegin(), corners.rend());
  io::Polyline line;
  for (const Eigen::Vector2d& p : hull) line.push_back({p.x(), p.y()});
  line.push_back(line.front());
  return line;
}

// Sliders on the world without a box in their file are drawn as boxes on rails: paths of their origins, in the picture.
struct Slider {
  std::vector<Eigen::Vector2d> path;
  bool has_box;
};

double extent(const io::Motion& picture, const std::vector<Slider>& sliders) {
  Eigen::AlignedBox2d box;
  for (const io::MotionFrame& frame : picture.frames) {
    for (const auto* parts : {&frame.parts, &frame.behind})
      for (const io::Polyline& part : *parts)
        for (const auto& p : part) box.extend(vector_of(p));
  }
  for (const Slider& slider : sliders) {
    for (const Eigen::Vector2d& p : slider.path) box.extend(p);
  }
  return box.isEmpty() ? 0 : box.sizes().maxCoeff();
}

void add_sliders(io::Motion& picture, const std::vector<Slider>& sliders) {
  if (sliders.empty()) return;
  double size = extent(picture, sliders);
  if (size < kShortBone) size = 1;  // it stands still: boxes as of a motion of a metre
  const double a = 0.05 * size, b = 0.03 * size;
  for (const auto& [path, has_box] : sliders) {
    for (std::size_t k = 0; k < path.size() && !has_box; ++k) {
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

// The ground that feet stand on at other heights than the floor.  A task says where feet land, not how large the
// ground there is: a box reaches a little beyond the footholds of its height, and at most halfway to those of other
// heights.
struct GroundStep {
  std::string name;
  dynamics::Visual box;  // of the world, from the floor to the feet
};

constexpr double kSameHeight = 1e-3;      // m
constexpr double kBeyondFoothold = 0.15;  // of a limb's length, from a foothold to the edge

struct Level {
  double z;
  std::vector<Eigen::Vector2d> footholds;
};

// The footholds of all phases by their heights.
std::vector<Level> levels_of(const Task& task) {
  std::vector<Level> levels;
  for (const Task& part : task.parts) {
    for (const HeldContact& contact : part.robot.contacts) {
      if (!contact.place) continue;
      const double z = contact.place->z();
      const auto is_here = [z](const Level& level) { return std::abs(level.z - z) <= kSameHeight; };
      auto level = std::find_if(levels.begin(), levels.end(), is_here);
      if (level == levels.end()) level = levels.insert(level, {z, {}});
      level->footholds.push_back(contact.place->head<2>());
    }
  }
  return levels;
}

double margin_of(const Task& task, const Level& level, const std::vector<Level>& levels) {
  double margin = kBeyondFoothold * limb_length(task.scene.model, task.robot.contacts.front().frame);
  for (const Level& other : levels) {
    if (&other == &level) continue;
    for (const Eigen::Vector2d& here : level.footholds)
      for (const Eigen::Vector2d& there : other.footholds)
        margin = std::min(margin, std::max((here - there).cwiseAbs().maxCoeff() / 2, kSameHeight));
  }
  return margin;
}

// In the order in which feet land on them; none for a task without phases.
std::vector<GroundStep> steps_of_ground(const Task& task) {
  const std::optional<double> found = floor_of(task);
  if (!found) return {};
  const double floor = *found;
  const std::vector<Level> levels = levels_of(task);
  std::vector<GroundStep> steps;
  for (const Level& level : levels) {
    if (!(std::abs(level.z - floor) > kSameHeight)) continue;
    Eigen::AlignedBox2d box;
    for (const Eigen::Vector2d& foothold : level.footholds) box.extend(foothold);
    const Eigen::Vector2d middle = box.center(),
                          size = box.sizes().array() + 2 * margin_of(task, level, levels);
    dynamics::Visual visual;
    visual.X_BV.p << middle, (level.z + floor) / 2;
    visual.scale << size, std::abs(level.z - floor);
    visual.color = Eigen::Vector4d(0.72, 0.72, 0.70, 1);
    steps.push_back({"ground at z = " + io::with_digits(level.z, 3) + " m", visual});
  }
  return steps;
}

// The part of a plane of the world below the picture's paths, as its outline: in a side view a line.
void add_floor(View view, const Eigen::Vector3d& normal, double offset, const Eigen::AlignedBox3d& over,
               io::Motion& picture) {
  if (std::abs(normal.z()) < 1e-6 || view == View::kXy) return;
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(0.1 * over.sizes().maxCoeff());
  const Eigen::Vector3d low = over.min() - margin, high = over.max() + margin;
  io::Polyline outline;
  for (const auto& [x, y] : {std::pair(low.x(), low.y()),
                             {high.x(), low.y()},
                             {high.x(), high.y()},
                             {low.x(), high.y()},
                             {low.x(), low.y()}}) {
    const double z = (offset - normal.x() * x - normal.y() * y) / normal.z();
    outline.push_back(project(view, {x, y, z}));
  }
  picture.scenery.push_back(std::move(outline));
}

// The floors of a task: that on which held contacts stand, and planes of rigid contacts of the scene.
void add_floors(const Task& task, const Eigen::AlignedBox3d& over, io::Motion& picture) {
  if (over.isEmpty()) return;
  if (const std::optional<double> floor = floor_of(task))
    add_floor(task.view, Eigen::Vector3d::UnitZ(), *floor, over, picture);
  std::set<std::array<double, 4>> drawn;
  for (const auto& contact : task.scene.constraints.rigid.contacts) {
    const Eigen::Vector3d n = contact.normal.stableNormalized();
    if (contact.plane_body >= 0 || !drawn.insert({n.x(), n.y(), n.z(), contact.offset}).second) continue;
    add_floor(task.view, n, contact.offset, over, picture);
  }
}

}  // namespace

io::Plot motion_plot(const Task& task, const Trajectory& motion) {
  const auto& model = task.scene.model;
  dynamics::Data<double> data(model);
  constexpr std::pair<const char*, const char*> kAxes[] = {
      {"x [m]", "z [m]"}, {"x [m]", "y [m]"}, {"y [m]", "z [m]"}, {"x + 0.35 y [m]", "z + 0.35 y [m]"}};
  io::Motion picture{.title = task.name};
  picture.x_label = kAxes[int(task.view)].first;
  picture.y_label = kAxes[int(task.view)].second;
  for (const std::string& name : task.traces) picture.traces.push_back({name, {}});
  std::vector<int> sliding;
  for (int i = 0; i < model.njoints(); ++i) {
    if (slides_on_world(model, i)) sliding.push_back(i);
  }
  const std::vector<dynamics::Visual> boxes = boxes_of(task);
  std::vector<Slider> sliders;
  for (int i : sliding)
    sliders.push_back(
        {{}, std::any_of(boxes.begin(), boxes.end(), [&](const auto& box) { return box.body == i; })});
  Eigen::AlignedBox3d over;  // of all bones
  for (int p = 0; p < motion.points(); ++p) {
    dynamics::forward_kinematics(model, data, Eigen::VectorXd(motion.x.col(p).head(model.nq)));
    const std::vector<Bone> parts = bones(task, data);
    for (const auto& [from, to] : parts) over.extend(from), over.extend(to);
    picture.frames.push_back(frame_of(task.view, task.around.obstacles, motion.t[p], parts));
    for (std::size_t k = 0; k < sliding.size(); ++k) {
      sliders[k].path.push_back(vector_of(project(task.view, data.X_WB[std::size_t(sliding[k])].p)));
    }
    for (const dynamics::Visual& box : boxes) {
      if (box.body >= 0)
        picture.frames.back().parts.push_back(outline(task.view, box, data));
      else if (p == 0)
        picture.scenery.push_back(outline(task.view, box, data));
    }
    for (io::Trace& trace : picture.traces) {
      const int frame = model.frame_index(trace.name);
      trace.points.push_back(project(task.view, frame_placement(model, data, frame).p));
    }
  }
  constexpr std::size_t kManyBones = 12;  // of which few instants are enough to see the motion
  const io::MotionFrame& first = picture.frames.front();
  if (first.parts.size() + first.behind.size() > kManyBones + boxes.size()) picture.most_frames = 5;
  add_sliders(picture, sliders);
  add_floors(task, over, picture);
  for (const Capsule& thing : task.around.obstacles)
    picture.obstacles.push_back(
        {thing.name + ", r = " + io::shortest(thing.radius) + " m", outline(task.view, thing)});
  for (const GroundStep& step : steps_of_ground(task))
    picture.obstacles.push_back({step.name, outline(task.view, step.box, data)});
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
  for (GroundStep& step : steps_of_ground(task)) player.surroundings.push_back(std::move(step.box));
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
