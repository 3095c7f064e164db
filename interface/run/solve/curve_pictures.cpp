// SPDX-License-Identifier: BSD-3-Clause
//
// Curves of a motion over time, a panel for each quantity; of robots with many joints a panel for each limb.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include <dyntape/interface/motion/robot_configuration.h>
#include <dyntape/interface/report/plot/curves.h>
#include <dyntape/interface/run/solve/curves.h>
#include <dyntape/interface/run/solve/pictures.h>

namespace dyntape {

namespace {

using Eigen::MatrixXd;

// What one panel shows: curves of one unit, of a limb or a contact if the plot has many.
struct Quantity {
  std::string title, unit;
  bool is_of_base = false;
  std::string limb = {};
  bool operator==(const Quantity&) const = default;
};
struct Group {
  Quantity quantity;
  std::vector<Eigen::Index> rows;
};
constexpr std::size_t kMostCurves = 7;  // of a panel, before it is split by limbs

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
  const std::string of = linear > 0 ? " of the base" : "", in_body = linear > 0 ? " (body axes)" : "";
  if (type == JointType::kPrismatic || k < linear)
    return of_q ? Quantity{"position" + of, "q [m]", linear > 0}
                : Quantity{"velocity" + of + in_body, "v [m/s]", linear > 0};
  if (!of_q)
    return linear > 0 ? Quantity{"angular velocity" + of + in_body, "v [rad/s]", true}
                      : Quantity{"joint velocity", "v [rad/s]"};
  if (is_single && dynamics::nq(type) == 1) return {"joint angle", "q [rad]"};
  if (is_single) return {"cosine and sine of the joint angle", "q [-]"};
  if (type == JointType::kFreeFlyer) return {"orientation of the base", "q [rad]", true};
  return {type == JointType::kPlanar ? "cosine and sine of the base's angle" : "orientation, quaternion",
          "q [-]", linear > 0};
}

// Returns the first joint of the limb of each joint.  A limb begins at the world, at a floating base, and after a body with several
// joints.
std::vector<int> limbs_of(const dynamics::Model<double>& model) {
  std::vector<int> children(std::size_t(model.njoints()), 0), limbs;
  for (const int parent : model.parent)
    if (parent >= 0) ++children[std::size_t(parent)];
  for (int i = 0; i < model.njoints(); ++i) {
    const int parent = model.parent[std::size_t(i)];
    const bool begins = parent < 0 || children[std::size_t(parent)] > 1 ||
                        dynamics::nv(model.joints[std::size_t(parent)].type) == 6;
    limbs.push_back(begins ? i : limbs[std::size_t(parent)]);
  }
  return limbs;
}

bool is_split(const dynamics::Model<double>& model) {
  const auto singles = std::count_if(model.joints.begin(), model.joints.end(),
                                     [](const auto& joint) { return dynamics::is_single(joint.type); });
  return std::size_t(singles) > kMostCurves;
}

std::string limb_name(const dynamics::Model<double>& model, int first_joint) {
  return is_split(model) ? model.joints[std::size_t(first_joint)].name : "";
}

// `of_q`: of q with the quaternion of a floating base as roll, pitch and yaw (with_angles()).
Groups groups_of(const dynamics::Model<double>& model, bool of_q) {
  Groups groups;
  const std::vector<int> limbs = limbs_of(model);
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const auto& joint = model.joints[i];
    const bool is_base = joint.type == dynamics::JointType::kFreeFlyer;
    const int count = is_base ? 6 : of_q ? dynamics::nq(joint.type) : dynamics::nv(joint.type);
    for (int k = 0; k < count; ++k) {
      Quantity quantity = quantity_of(joint.type, k, of_q);
      if (!quantity.is_of_base) quantity.limb = limb_name(model, limbs[i]);
      groups.add(quantity, (of_q ? joint.idx_q : joint.idx_v) + k);
    }
  }
  return groups;
}

// Roll, pitch and yaw (rad, R = Rz Ry Rx) in the place of the first three entries of each floating base's quaternion; without jumps
// by full turns.
MatrixXd with_angles(const dynamics::Model<double>& model, MatrixXd q) {
  for (const auto& joint : model.joints) {
    if (joint.type != dynamics::JointType::kFreeFlyer) continue;
    const Eigen::Index first = joint.idx_q + 3;
    for (Eigen::Index p = 0; p < q.cols(); ++p) {
      const Eigen::Matrix3d R =
          Eigen::Quaterniond(Eigen::Vector4d(q.col(p).segment<4>(first))).normalized().toRotationMatrix();
      q(first, p) = std::atan2(R(2, 1), R(2, 2));
      q(first + 1, p) = std::atan2(-R(2, 0), std::hypot(R(2, 1), R(2, 2)));
      q(first + 2, p) = std::atan2(R(1, 0), R(0, 0));
      for (const Eigen::Index i : {first, first + 2}) {
        if (p > 0) q(i, p) += 2 * M_PI * std::round((q(i, p - 1) - q(i, p)) / (2 * M_PI));
      }
    }
  }
  return q;
}

// Motors, then forces at contacts and of thrusters.
Groups groups_of_controls(const Task& task, Eigen::Index rows) {
  Groups groups;
  const auto& model = task.scene.model;
  const std::vector<int> driven = actuated_dofs(task.scene), limbs = limbs_of(model);
  const bool many_forces = std::size_t(rows) > driven.size() + kMostCurves;
  for (Eigen::Index row = 0; row < rows; ++row) {
    if (row >= Eigen::Index(driven.size())) {
      const std::string& name = task.problem.controls[std::size_t(row)];
      const std::size_t first = name.find('.') + 1, last = name.rfind('.');
      const bool is_part = many_forces && last != name.npos && last > first;
      groups.add({"forces", "f [N]", false, is_part ? name.substr(first, last - first) : ""}, row);
      continue;
    }
    for (std::size_t i = 0; i < model.joints.size(); ++i) {
      if (model.joints[i].idx_v != driven[std::size_t(row)]) continue;
      Quantity quantity = model.joints[i].type == dynamics::JointType::kPrismatic
                              ? Quantity{"force of the drives", "tau [N]"}
                              : Quantity{"torque of the drives", "tau [N m]"};
      quantity.limb = limb_name(model, limbs[i]);
      groups.add(quantity, row);
    }
  }
  return groups;
}

// A limit that is drawn, and the curves that come near it.
struct NearLimit {
  std::set<Eigen::Index> curves;
  bool is_of_all = true;  // every curve of the panel has this limit
};

// Returns the limits that their own curves come near: by three quarters of the range between the limits (97 % in panels of many
// curves), or within a quarter of the panel's height, if no curve is beyond them.
std::map<double, NearLimit> near_limits(const MatrixXd& curves, const Bounds& limits) {
  std::map<double, NearLimit> near;
  const double share = curves.rows() > 3 ? 0.97 : 0.75;
  const double low = curves.minCoeff(), high = curves.maxCoeff(), beside = 0.25 * (high - low);
  for (Eigen::Index i = 0; i < curves.rows(); ++i) {
    const double lower = limits.lower[i], upper = limits.upper[i];
    if (!std::isfinite(lower) || !std::isfinite(upper)) continue;
    const double lowest = curves.row(i).minCoeff(), highest = curves.row(i).maxCoeff();
    if (highest > lower + share * (upper - lower) || (upper >= high && upper < highest + beside))
      near[upper].curves.insert(i);
    if (lowest < upper - share * (upper - lower) || (lower <= low && lower > lowest - beside))
      near[lower].curves.insert(i);
  }
  for (auto& [value, limit] : near)
    limit.is_of_all = (limits.lower.array() == value || limits.upper.array() == value).all();
  return near;
}

// "limit of elbow, wrist +1".
std::string label_of(const NearLimit& limit, const std::vector<std::string>& names) {
  constexpr std::size_t kMostNames = 2;
  if (limit.is_of_all) return "limit of all";
  std::string text;
  std::size_t left = limit.curves.size();
  for (const Eigen::Index i : limit.curves) {
    if (limit.curves.size() - left == kMostNames) break;
    text += (text.empty() ? "limit of " : ", ") + names[std::size_t(i)];
    --left;
  }
  return left > 0 ? text + " +" + std::to_string(left) : text;
}

// Lines for these limits, in a panel of curves from `low` to `high`.  If all curves have the same limits, the first line is labelled
// "limit"; otherwise each line says whose limit it is, since other curves may cross it.
std::vector<io::ReferenceLine> limit_lines(const std::map<double, NearLimit>& limits,
                                           const std::vector<std::string>& names, double low, double high) {
  constexpr double kOneLabel = 0.08;  // of the panel's height: labels that are closer overlap
  if (limits.empty()) return {};
  const double height = std::max(high, limits.rbegin()->first) - std::min(low, limits.begin()->first);
  const bool are_of_all =
      std::all_of(limits.begin(), limits.end(), [](const auto& limit) { return limit.second.is_of_all; });
  std::vector<io::ReferenceLine> lines;
  for (const auto& [value, limit] : limits) {
    std::string text = are_of_all ? lines.empty() ? "limit" : "" : label_of(limit, names);
    if (!are_of_all && !lines.empty() && value - lines.back().value < kOneLabel * height)
      text = std::exchange(lines.back().text, "") + "; " + text;
    lines.push_back({value, text});
  }
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

// Returns the range of the y axis.  If all values of a panel are below 1e-4 of the largest value of the same unit, the range is fixed,
// so that noise looks flat; otherwise it is automatic.
io::Limits without_noise(const MatrixXd& own, double largest) {
  constexpr double kNoise = 1e-4;
  const double size = own.cwiseAbs().maxCoeff();
  if (!(size < kNoise * largest)) return {};
  return {-10 * kNoise * largest, 10 * kNoise * largest};
}

// Returns the first words that all names share: "FL" of FL_HAA and FL_KFE.
std::string common_beginning(const std::vector<std::string>& names) {
  std::string common = names.empty() ? "" : names[0];
  for (const std::string& name : names) {
    while (!name.starts_with(common)) common.pop_back();
  }
  const auto end = common.find_last_of("_.-");
  return end == common.npos ? "" : common.substr(0, end);
}

// A panel a quantity; `targets` has no rows, or those of the curves.
void add_panels(io::Plot& plot, const Groups& groups, const std::vector<std::string>& names,
                const Trajectory& motion, const MatrixXd& curves, const Bounds& limits,
                const MatrixXd& targets = {}) {
  constexpr double kNothing = 1e-9;       // of the largest, below which a value is rounding
  std::map<std::string, double> largest;  // by unit
  for (const auto& [quantity, rows] : groups.all())
    largest[quantity.unit] = std::max(largest[quantity.unit], curves(rows, Eigen::all).cwiseAbs().maxCoeff());
  for (const auto& [quantity, rows] : groups.all()) {
    const double least = kNothing * largest[quantity.unit];
    const MatrixXd own =
        curves(rows, Eigen::all).unaryExpr([&](double y) { return std::abs(y) < least ? 0 : y; });
    std::vector<std::string> own_names;
    for (const Eigen::Index row : rows) own_names.push_back(names[std::size_t(row)]);
    const std::string limb = quantity.limb.empty() ? "" : common_beginning(own_names);
    io::Panel p = io::over_time(quantity.title + (limb.empty() ? "" : ", " + limb), quantity.unit, own_names,
                                motion.t, own);
    p.horizontal = limit_lines(near_limits(own, {limits.lower(rows), limits.upper(rows)}), own_names,
                               own.minCoeff(), own.maxCoeff());
    p.y_limits = without_noise(own, largest[quantity.unit]);
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
        joint.type == JointType::kFreeFlyer ? std::vector<std::string>{"x",
                                                                       "y",
                                                                       "z",
                                                                       of_q ? "roll" : "x",
                                                                       of_q ? "pitch" : "y",
                                                                       of_q ? "yaw" : "z",
                                                                       "w"}
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

// Panels of one quantity side by side, those of the base first.
void in_columns(io::Plot& plot) {
  constexpr int kMostColumns = 4, kColumnWidth = 430;
  const auto kind = [](const io::Panel& panel) { return panel.title.substr(0, panel.title.find(',')); };
  const auto is_of_base = [](const io::Panel& panel) {
    return panel.title.find("of the base") != std::string::npos;
  };
  const auto joints = std::stable_partition(plot.panels.begin(), plot.panels.end(), is_of_base);
  if (joints == plot.panels.end()) return;
  int columns = int(joints - plot.panels.begin()), in_row = 0;
  for (auto panel = joints; panel != plot.panels.end(); ++panel) {
    panel->starts_row = panel == joints || kind(*panel) != kind(*(panel - 1));
    in_row = panel->starts_row ? 1 : in_row + 1;
    for (std::size_t k = 0; k < panel->series.size(); ++k)
      if (panel->series[k].target_of.empty()) panel->series[k].style = int(k);
    columns = std::max(columns, in_row);
  }
  plot.columns = std::min(columns, kMostColumns);
  plot.width = std::max(plot.width, kColumnWidth * plot.columns);
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
  Bounds q{x.lower.head(model.nq), x.upper.head(model.nq)};
  for (const auto& joint : model.joints) {  // of angles, not of quaternions
    if (joint.type != dynamics::JointType::kFreeFlyer) continue;
    q.lower.segment(joint.idx_q + 3, 4).setConstant(-HUGE_VAL);
    q.upper.segment(joint.idx_q + 3, 4).setConstant(HUGE_VAL);
  }
  add_panels(plot, groups_of(model, true), names_of(model, true), motion, with_angles(model, c.q), q,
             with_angles(model, targets.topRows(targets.rows() > 0 ? model.nq : 0)));
  add_panels(plot, groups_of(model, false), names_of(model, false), motion, c.v,
             {x.lower.tail(model.nv), x.upper.tail(model.nv)},
             targets.bottomRows(targets.rows() > 0 ? model.nv : 0));
  add_panels(plot, groups_of_controls(task, c.tau.rows()), plain_names(task.problem.controls), motion, c.tau,
             u);
  if (is_split(model)) in_columns(plot);
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

}  // namespace dyntape
