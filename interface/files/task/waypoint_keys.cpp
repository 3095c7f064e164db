// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/task/waypoint_keys.h>

#include <algorithm>
#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/files/joint_values.h>
#include <dyntape/interface/files/scene/scene_keys.h>
#include <dyntape/interface/files/task/place_keys.h>
#include <dyntape/interface/io/csv.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/motion/robot_configuration.h>

namespace dyntape {

using Eigen::VectorXd;
using io::Section;
using RobotModel = dynamics::Model<double>;

namespace {

const io::Range kOnTheWay{
    .low = 0, .high = 1, .low_open = true, .high_open = true, .text = "above 0 and below 1"};

// Of one instant: two configurations, a configuration and a place, or two places of one frame.
bool say_the_same(const TaskWaypoint& a, const TaskWaypoint& b) {
  if (std::abs(a.at - b.at) > 1e-9) return false;
  if (!a.target || !b.target) return true;
  const bool both =
      (a.target->position && b.target->position) || (a.target->orientation && b.target->orientation);
  return a.target->frame == b.target->frame && both;
}

// Columns that nothing weighs need not be there.
void take_table(const std::string& path, const RobotModel& model, ReferenceMotion& reference) {
  const io::CsvTable table = io::read_csv(path);
  reference.t = times_in(table, path);
  std::vector<std::string> names = entry_names(model, "q");
  const std::vector<std::string> velocities = entry_names(model, "v");
  names.insert(names.end(), velocities.begin(), velocities.end());
  reference.x = Eigen::MatrixXd::Zero(Eigen::Index(names.size()), table.rows());
  for (Eigen::Index i = 0; i < reference.x.rows(); ++i) {
    if (reference.weight[i] == 0) continue;
    const std::vector<double> values = table.column(names[std::size_t(i)]);
    reference.x.row(i) = Eigen::Map<const VectorXd>(values.data(), table.rows());
  }
}

}  // namespace

std::vector<TaskWaypoint> read_waypoints(Section& file, const RobotScene& scene, const RobotModel* model) {
  if (!file.about("states or poses that the motion passes").has("waypoints")) return {};
  Section list = file.child("waypoints");
  std::vector<TaskWaypoint> waypoints;
  if (!list.about("waypoint <name> { ... }").has("waypoint")) return {};
  for (Section& block : list.each("waypoint")) {
    TaskWaypoint w;
    w.name = block.value();
    if (w.name.empty()) w.name = std::to_string(waypoints.size() + 1);
    w.at = block.about("time, as a fraction of the duration").get<double>("at", kOnTheWay);
    const bool has_frame = block.has("frame");
    w.target = read_frame_target(block, model);
    block.about("joint positions, in place of frame [rad or m]");
    if (!model) {
      block.defer("q", "numbers by joint", "");
    } else if (!has_frame || block.has("q")) {
      w.q = read_joint_values(block, "q", model, {.followers = scene.mimics});
      if (has_frame)
        block.problem("q", "'" + block.path() + "' has both 'frame' and 'q', expected one of them");
    }
    for (const TaskWaypoint& other : waypoints) {
      if (model && other.name == w.name)
        block.problem("", "'" + w.name + "' names two of 'waypoints', expected one");
      if (model && say_the_same(w, other))
        block.problem("at", "'" + w.name + "' says where the motion passes at " + io::shortest(w.at) +
                                ", as '" + other.name +
                                "' does at that instant; expected one of them, or another 'at'");
    }
    waypoints.push_back(std::move(w));
  }
  std::stable_sort(waypoints.begin(), waypoints.end(),
                   [](const TaskWaypoint& a, const TaskWaypoint& b) { return a.at < b.at; });
  return waypoints;
}

Term term_of(const TaskWaypoint& waypoint, const RobotScene& scene) {
  const std::string name = "waypoint " + waypoint.name;
  if (waypoint.target)
    return at_fraction(waypoint.at, path_equality(name, frame_error(scene, *waypoint.target)));
  const StageFunction off = configuration_error(scene, configuration_of(scene.model, waypoint.q));
  std::vector<int> dofs;
  for (const std::string& joint : independent_joints(scene))
    dofs.push_back(scene.model.joints[std::size_t(scene.model.joint_index(joint))].idx_v);
  return at_fraction(waypoint.at, path_equality(name, entries_of(off, dofs)));
}

VectorXd ReferenceMotion::at(double time) const {
  const auto next = std::upper_bound(t.begin(), t.end(), time);
  if (next == t.begin()) return x.col(0);
  if (next == t.end()) return x.col(x.cols() - 1);
  const Eigen::Index k = next - t.begin();
  const double share = (time - t[std::size_t(k) - 1]) / (t[std::size_t(k)] - t[std::size_t(k) - 1]);
  return (1 - share) * x.col(k - 1) + share * x.col(k);
}

std::optional<ReferenceMotion> read_reference(Section& file, const std::string& task_file, bool is_free_time,
                                              const RobotScene& scene, const RobotModel* model) {
  if (!file.about("a motion to follow").has("reference")) return {};
  Section block = file.child("reference");
  ReferenceMotion reference;
  const std::string name = block
                               .about(
                                   "path of a table with columns t, q.<joint>, v.<joint>, as `dyntape solve` "
                                   "writes it; relative to the folder of this file")
                               .get<std::string>("file");
  const JointValues weights{.fallback = 0.0, .range = io::not_negative(), .followers = scene.mimics};
  const VectorXd w_q =
      read_joint_values(block.about("weights of the squared position errors"), "q", model, weights);
  const VectorXd w_v =
      read_joint_values(block.about("weights of the squared velocity errors"), "v", model, weights);
  if (!model || name.empty()) return {};
  if (!is_on_lines(*model)) {
    block.problem(
        "file", "a reference is followed by robots whose joints are all on a line, which this one's are not");
    return {};
  }
  if (is_free_time)
    block.problem(
        "file",
        "'reference' has times of its own, and 'horizon' leaves the duration free; expected a given one");
  if (w_q.isZero(0) && w_v.isZero(0))
    block.problem("", "'reference' weighs nothing; expected 'q', 'v' or both above zero");
  reference.weight.resize(w_q.size() + w_v.size());
  reference.weight << w_q, w_v;
  try {
    take_table(path_beside(task_file, block, "file", name), *model, reference);
  } catch (const Error& e) {
    block.problem("file", e.what());
    return {};
  }
  return reference;
}

void follow(Problem& problem, const ReferenceMotion& reference) {
  const Parameter wanted =
      problem.parameters.add("reference", [reference](double t) { return reference.at(t); });
  std::vector<Eigen::Index> counts;
  for (Eigen::Index i = 0; i < reference.weight.size(); ++i) {
    if (reference.weight[i] > 0) counts.push_back(i);
  }
  problem.add(running_squares("reference tracking",
                              [wanted, counts, root = VectorXd(reference.weight.cwiseSqrt())](const auto& s) {
                                const auto now = wanted(s);
                                auto off = s.x.head(Eigen::Index(counts.size())).eval();
                                for (std::size_t k = 0; k < counts.size(); ++k)
                                  off[Eigen::Index(k)] = (s.x[counts[k]] - now[counts[k]]) * root[counts[k]];
                                return off;
                              }));
}

}  // namespace dyntape
