// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/report/joints/joint_panels.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include <dyntape/interface/report/plot/curves.h>

namespace dyntape {

namespace {

using dynamics::JointType;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using RobotModel = dynamics::Model<double>;

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

// Curves of a joint: rotations are drawn as angles (with_angles()).
int count_of(JointType type, bool of_q) {
  if (type == JointType::kFreeFlyer) return 6;
  if (of_q && (type == JointType::kPlanar || dynamics::is_single(type))) return dynamics::nv(type);
  return of_q ? dynamics::nq(type) : dynamics::nv(type);
}

// Curve k of a joint's position or velocity.
Quantity quantity_of(JointType type, int k, bool of_q) {
  const int linear = type == JointType::kFreeFlyer ? 3 : type == JointType::kPlanar ? 2 : 0;
  const std::string of = linear > 0 ? " of the base" : "", in_body = linear > 0 ? " (body axes)" : "";
  if (type == JointType::kPrismatic || k < linear)
    return of_q ? Quantity{"position" + of, "q [m]", linear > 0}
                : Quantity{"velocity" + of + in_body, "v [m/s]", linear > 0};
  if (!of_q)
    return linear > 0 ? Quantity{"angular velocity" + of + in_body, "v [rad/s]", true}
                      : Quantity{"joint velocity", "v [rad/s]"};
  if (dynamics::is_single(type)) return {"joint angle", "q [rad]"};
  if (linear > 0) return {"orientation of the base", "q [rad]", true};
  return {"orientation, quaternion", "q [-]"};
}

// Returns the first joint of the limb of each joint.  A limb begins at the world, at a floating base, and after a body with several
// joints.
std::vector<int> limbs_of(const RobotModel& model) {
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

bool is_split(const RobotModel& model) {
  const auto singles = std::count_if(model.joints.begin(), model.joints.end(),
                                     [](const auto& joint) { return dynamics::is_single(joint.type); });
  return std::size_t(singles) > kMostCurves;
}

std::string limb_name(const RobotModel& model, int first_joint) {
  return is_split(model) ? model.joints[std::size_t(first_joint)].name : "";
}

Groups groups_of(const RobotModel& model, bool of_q) {
  Groups groups;
  const std::vector<int> limbs = limbs_of(model);
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const auto& joint = model.joints[i];
    for (int k = 0; k < count_of(joint.type, of_q); ++k) {
      Quantity quantity = quantity_of(joint.type, k, of_q);
      if (!quantity.is_of_base) quantity.limb = limb_name(model, limbs[i]);
      groups.add(quantity, (of_q ? joint.idx_q : joint.idx_v) + k);
    }
  }
  return groups;
}

// (rad) Roll, pitch and yaw, R = Rz Ry Rx.  Of the two triples of angles of a rotation, that whose roll is next to `roll`; at a
// pitch of a quarter turn, where only roll and yaw together are determined, with this roll.
Eigen::Vector3d angles_of(const Eigen::Vector4d& quaternion, double roll) {
  const Eigen::Matrix3d R = Eigen::Quaterniond(quaternion).normalized().toRotationMatrix();
  if (std::hypot(R(2, 1), R(2, 2)) > 1e-9) {
    const double found = std::atan2(R(2, 1), R(2, 2));
    roll = found + M_PI * std::round((roll - found) / M_PI);
  }
  const Eigen::Matrix3d level = R * Eigen::AngleAxisd(-roll, Eigen::Vector3d::UnitX());
  return {roll, std::atan2(-level(2, 0), level(2, 2)), std::atan2(-level(0, 1), level(1, 1))};
}

// Angles (rad) at the first entries of each rotation that is drawn as such.  They have no jumps by full or half turns: each is next
// to the one before it, or if `near` has columns, next to the one there.
MatrixXd with_angles(const RobotModel& model, MatrixXd q, const MatrixXd& near = {}) {
  const auto wanted = [&](Eigen::Index i, Eigen::Index p) {
    const double next = near.cols() > 0 ? near(i, p) : p > 0 ? q(i, p - 1) : 0;
    return std::isfinite(next) ? next : 0;
  };
  const auto bring_near = [&](Eigen::Index i, Eigen::Index p) {
    q(i, p) += 2 * M_PI * std::round((wanted(i, p) - q(i, p)) / (2 * M_PI));
  };
  for (const auto& joint : model.joints) {
    const bool is_base = joint.type == JointType::kFreeFlyer;
    const bool is_pair = joint.type == JointType::kPlanar ||
                         (dynamics::is_single(joint.type) && dynamics::nq(joint.type) == 2);
    if (!is_base && !is_pair) continue;
    const Eigen::Index first = joint.idx_q + (is_base ? 3 : dynamics::nq(joint.type) - 2);
    for (Eigen::Index p = 0; p < q.cols(); ++p) {
      if (is_base) {
        q.col(p).segment<3>(first) = angles_of(q.col(p).segment<4>(first), wanted(first, p));
        bring_near(first + 1, p), bring_near(first + 2, p);
      } else {
        q(first, p) = std::atan2(q(first + 1, p), q(first, p));
        bring_near(first, p);
      }
    }
  }
  return q;
}

// Motors, then forces at contacts and of thrusters; adds the names of the curves.
Groups groups_of_efforts(const RobotModel& model, const std::vector<int>& driven,
                         const std::vector<std::string>& forces, std::vector<std::string>& names) {
  Groups groups;
  const std::vector<int> limbs = limbs_of(model);
  for (const int dof : driven) {
    const auto is_here = [dof](const auto& joint) { return joint.idx_v == dof; };
    const auto joint = std::find_if(model.joints.begin(), model.joints.end(), is_here);
    Quantity quantity = joint->type == JointType::kPrismatic ? Quantity{"force of the drives", "tau [N]"}
                                                             : Quantity{"torque of the drives", "tau [N m]"};
    quantity.limb = limb_name(model, limbs[std::size_t(joint - model.joints.begin())]);
    groups.add(quantity, Eigen::Index(names.size()));
    names.push_back(joint->name);
  }
  for (const std::string& name : forces) {
    const std::size_t first = name.find('.') + 1, last = name.rfind('.');
    const bool is_part = forces.size() > kMostCurves && last != name.npos && last > first;
    groups.add({"forces", "f [N]", false, is_part ? name.substr(first, last - first) : ""},
               Eigen::Index(names.size()));
    names.push_back(name.substr(first));
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
std::map<double, NearLimit> near_limits(const MatrixXd& curves, const VectorXd& all_lower,
                                        const VectorXd& all_upper) {
  std::map<double, NearLimit> near;
  const double share = curves.rows() > 3 ? 0.97 : 0.75;
  const double low = curves.minCoeff(), high = curves.maxCoeff(), beside = 0.25 * (high - low);
  for (Eigen::Index i = 0; i < curves.rows(); ++i) {
    const double lower = all_lower[i], upper = all_upper[i];
    if (!std::isfinite(lower) || !std::isfinite(upper)) continue;
    const double lowest = curves.row(i).minCoeff(), highest = curves.row(i).maxCoeff();
    if (highest > lower + share * (upper - lower) || (upper >= high && upper < highest + beside))
      near[upper].curves.insert(i);
    if (lowest < upper - share * (upper - lower) || (lower <= low && lower > lowest - beside))
      near[lower].curves.insert(i);
  }
  for (auto& [value, limit] : near)
    limit.is_of_all = (all_lower.array() == value || all_upper.array() == value).all();
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

// A panel a quantity.
void add_panels(io::Plot& plot, const Groups& groups, const std::vector<std::string>& names,
                const VectorXd& t, const JointCurves& of) {
  constexpr double kNothing = 1e-9;       // of the largest, below which a value is rounding
  constexpr double kRounding = 1e-11;     // in SI units, of values that are zero but for rounding
  std::map<std::string, double> largest;  // by unit
  for (const auto& [quantity, rows] : groups.all())
    largest[quantity.unit] =
        std::max(largest[quantity.unit], of.values(rows, Eigen::all).cwiseAbs().maxCoeff());
  for (const auto& [quantity, rows] : groups.all()) {
    const double least = std::max(kNothing * largest[quantity.unit], kRounding);
    const MatrixXd own =
        of.values(rows, Eigen::all).unaryExpr([&](double y) { return std::abs(y) < least ? 0 : y; });
    std::vector<std::string> own_names;
    for (const Eigen::Index row : rows) own_names.push_back(names[std::size_t(row)]);
    const std::string limb = quantity.limb.empty() ? "" : common_beginning(own_names);
    io::Panel p =
        io::over_time(quantity.title + (limb.empty() ? "" : ", " + limb), quantity.unit, own_names, t, own);
    if (of.lower.size() > 0)
      p.horizontal = limit_lines(near_limits(own, of.lower(rows), of.upper(rows)), own_names, own.minCoeff(),
                                 own.maxCoeff());
    p.y_limits = without_noise(own, largest[quantity.unit]);
    if (of.targets.rows() > 0) add_targets(p, own_names, t, of.targets(rows, Eigen::all));
    plot.panels.push_back(std::move(p));
  }
}

// Names of joints for each entry of q or v; of a base the axes.
std::vector<std::string> names_of(const RobotModel& model, bool of_q) {
  std::vector<std::string> names;
  for (const auto& joint : model.joints) {
    std::vector<std::string> of_base;
    if (joint.type == JointType::kFreeFlyer)
      of_base = {"x", "y", "z", of_q ? "roll" : "x", of_q ? "pitch" : "y", of_q ? "yaw" : "z"};
    if (joint.type == JointType::kPlanar) of_base = {"x", "y", of_q ? "angle" : "z"};
    const int count = of_q ? dynamics::nq(joint.type) : dynamics::nv(joint.type);
    for (int k = 0; k < count; ++k) {
      if (k < int(of_base.size()))
        names.push_back(of_base[std::size_t(k)]);
      else
        names.push_back(joint.name + (dynamics::is_single(joint.type) ? "" : "[" + std::to_string(k) + "]"));
    }
  }
  return names;
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

}  // namespace

void add_targets(io::Panel& panel, const std::vector<std::string>& names, const VectorXd& t,
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

void add_positions(io::Plot& plot, const RobotModel& model, const VectorXd& t, JointCurves q) {
  q.values = with_angles(model, std::move(q.values));
  if (q.targets.rows() > 0) q.targets = with_angles(model, std::move(q.targets), q.values);
  for (const auto& joint : model.joints) {
    if (dynamics::traits(joint.type).on_a_line || q.lower.size() == 0) continue;
    const int linear = joint.type == JointType::kFreeFlyer ? 3 : joint.type == JointType::kPlanar ? 2 : 0;
    const int first = joint.idx_q + linear, count = dynamics::nq(joint.type) - linear;
    q.lower.segment(first, count).setConstant(-HUGE_VAL);
    q.upper.segment(first, count).setConstant(HUGE_VAL);
  }
  add_panels(plot, groups_of(model, true), names_of(model, true), t, q);
}

void add_velocities(io::Plot& plot, const RobotModel& model, const VectorXd& t, const JointCurves& v) {
  add_panels(plot, groups_of(model, false), names_of(model, false), t, v);
}

void add_efforts(io::Plot& plot, const RobotModel& model, const std::vector<int>& driven, const VectorXd& t,
                 const JointCurves& tau, const std::vector<std::string>& forces) {
  std::vector<std::string> names;
  const Groups groups = groups_of_efforts(model, driven, forces, names);
  add_panels(plot, groups, names, t, tau);
}

void arrange_limbs(io::Plot& plot, const RobotModel& model) {
  if (is_split(model)) in_columns(plot);
}

}  // namespace dyntape
