// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/task/term_keys.h>

#include <algorithm>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/suggest.h>
#include <dyntape/interface/control/problem/penalties.h>
#include <dyntape/interface/files/joint_values.h>
#include <dyntape/interface/files/lists.h>
#include <dyntape/interface/files/scene/scene_keys.h>
#include <dyntape/interface/files/task/place_keys.h>
#include <dyntape/interface/motion/robot_configuration.h>
#include <dyntape/interface/motion/robot_terms.h>

namespace dyntape {

namespace {

using dynamics::ReferenceFrame;
using Eigen::VectorXd;
using io::Section;
using RobotModel = dynamics::Model<double>;
using Names = std::vector<std::string>;

struct TermAsked : TermSpec {
  StageFunction moving = {};  // empty: `target` stands still
};

StageFunction less(const StageFunction& f, const VectorXd& target) {
  return [f, target](const auto& s) {
    using T = std::decay_t<decltype(s.t)>;
    return (f(s) - target.template cast<T>()).eval();
  };
}

// place: of a target, still or not.
template <class OfPlace>
StageFunction away(const TermAsked& asked, const OfPlace& of) {
  if (asked.moving.empty()) return of(Eigen::Vector3d(asked.target));
  return [f = of(Eigen::Vector3d::Zero()), target = asked.moving](const auto& s) {
    return (f(s) - target(s)).eval();
  };
}

// Of joints that have one velocity each: how far they are from `target`, an entry each, the shorter way of those that turn
// freely.
StageFunction joints_off(const RobotScene& scene, const VectorXd& target) {
  const std::vector<int> dofs = single_dofs(scene.model);
  VectorXd values = VectorXd::Zero(scene.model.nv);
  for (std::size_t k = 0; k < dofs.size(); ++k) values[dofs[k]] = target[Eigen::Index(k)];
  return entries_of(configuration_error(scene, configuration_of(scene.model, values)), dofs);
}

StageFunction joint_velocities(const RobotScene& scene) {
  const StageFunction v = [nq = scene.model.nq, nv = scene.model.nv](const auto& s) {
    return s.x.segment(nq, nv).eval();
  };
  return entries_of(v, single_dofs(scene.model));
}

Names xyz(const RobotScene&) { return {"x", "y", "z"}; }
Names linear_angular(const RobotScene&) { return {"x", "y", "z", "turn_x", "turn_y", "turn_z"}; }
Names aside(const RobotScene&) { return {"first", "second"}; }
Names joints(const RobotScene& scene) { return single_joint_names(scene.model); }
Names driven(const RobotScene& scene) { return driven_names(scene); }

// How the target of a kind may move.
enum class Moves { kNot, kPlace, kTurn };

// All there are: a new one is a row here.
struct TermKind {
  const char *name, *meaning;
  // Whether it asks for a frame; for the axes of a velocity; for axis and place, and then for no target.
  bool has_frame, has_axes, looks;
  Names (*entries)(const RobotScene& scene);
  StageFunction (*function)(const RobotScene& scene, ControlUnit unit, const TermAsked& asked);
  Moves moves = Moves::kNot;
};
constexpr TermKind kTermKinds[] = {
    {"frame_position", "the origin of a link [m]", true, false, false, xyz,
     [](const RobotScene& scene, ControlUnit, const TermAsked& a) {
       return away(a, [&](const Eigen::Vector3d& p) { return frame_position(scene, a.frame, p); });
     },
     Moves::kPlace},
    {"frame_orientation", "rotation of a link from roll, pitch and yaw in target, as a rotation vector [rad]",
     true, false, false, xyz,
     [](const RobotScene& scene, ControlUnit, const TermAsked& a) {
       if (!a.moving.empty()) return moving_frame_orientation(scene, a.frame, a.moving);
       return frame_orientation(scene, a.frame, rotation_of(a.target[0], a.target[1], a.target[2]));
     },
     Moves::kTurn},
    {"frame_velocity", "linear and angular velocity of a link [m/s, rad/s]", true, true, false,
     linear_angular,
     [](const RobotScene& scene, ControlUnit, const TermAsked& a) {
       return less(frame_velocity(scene, a.frame, a.in), a.target);
     }},
    {"looks_at", "direction error between an axis of a link and the line to a point, tan(angle / 2)", true,
     false, true, aside,
     [](const RobotScene& scene, ControlUnit, const TermAsked& a) {
       return frame_looks_at(scene, a.frame, a.axis, a.place);
     }},
    {"com", "the centre of mass [m]", false, false, false, xyz,
     [](const RobotScene& scene, ControlUnit, const TermAsked& a) {
       return away(a, [&](const Eigen::Vector3d& p) { return com_position(scene, p); });
     },
     Moves::kPlace},
    {"momentum", "momentum of the robot: linear, and angular about its centre of mass [kg m/s, kg m^2/s]",
     false, false, false, linear_angular,
     [](const RobotScene& scene, ControlUnit, const TermAsked& a) {
       return centroidal_momentum(scene, Eigen::Matrix<double, 6, 1>(a.target));
     }},
    {"joint_position", "positions of joints [rad or m]", false, false, false, joints,
     [](const RobotScene& scene, ControlUnit, const TermAsked& a) { return joints_off(scene, a.target); }},
    {"joint_velocity", "velocities of joints [rad/s or m/s]", false, false, false, joints,
     [](const RobotScene& scene, ControlUnit, const TermAsked& a) {
       return less(joint_velocities(scene), a.target);
     }},
    {"torque", "torques of driven joints [N m or N]", false, false, false, driven,
     [](const RobotScene& scene, ControlUnit unit, const TermAsked& a) {
       return less(joint_torque(scene, unit), a.target);
     }},
    {"power", "power of driven joints, torque times velocity [W]", false, false, false, driven,
     [](const RobotScene& scene, ControlUnit unit, const TermAsked& a) {
       return less(joint_power(scene, unit), a.target);
     }},
};

std::string kinds_with_meanings() {
  std::string text = "the function, from which target is subtracted:";
  for (const TermKind& kind : kTermKinds)
    text += std::string(&kind == kTermKinds ? " " : "; ") + kind.name + ", " + kind.meaning;
  return text;
}

struct TermKey {
  const char *key, *takes, *fallback, *meaning;
};
constexpr TermKey kTermKeys[] = {
    {"frame", "name of a link", "",
     "of frame_position, frame_orientation, frame_velocity and looks_at: the link"},
    {"in", "world | local | aligned", "aligned",
     "of frame_velocity: point and axes of the world, of the link, or the link's origin with the world's "
     "axes"},
    {"axis", "three numbers \"x y z\"", "0 0 1", "of looks_at: direction in the link's axes, of any length"},
    {"place", "three numbers \"x y z\"", "", "of looks_at: the point to look at, in the world [m]"},
    {"target", "numbers", "0",
     "the desired value, which is subtracted: one number per entry, or one for all"},
    {"moves", "still | circle | file", "still",
     "of frame_position, frame_orientation and com: the target is constant, moves on a circle about target, "
     "or is given by a table"},
    {"radius", "a number, positive", "0.1", "radius of the circle [m]"},
    {"period", "a number, positive", "", "time of one revolution [s]"},
    {"normal", "three numbers \"x y z\"", "0 0 1", "normal of the circle's plane, of any length"},
    {"file", "name of a table", "",
     "path of a table with columns t [s] and x, y, z [m], or roll, pitch, yaw [rad]; relative to the folder "
     "of this file"},
    {"entries", "names", "",
     "entries that are used: x y z of positions, turn_x ... of rotations, otherwise names of joints; absent: "
     "all"},
    {"role", "cost | equality | inequality", "cost",
     "cost: weighted; equality: equal to zero; inequality: between lower and upper"},
    {"where", "running | start | end | at", "running",
     "running: during the whole motion (costs are integrated over time); start, end, at: at one instant"},
    {"at", "a number, between 0 and 1", "", "the instant, as a fraction of the duration"},
    {"lower", "numbers", "",
     "lower bound, one number per entry or one for all; of a cost: only values below it cost"},
    {"upper", "numbers", "", "upper bound, likewise"},
    {"weight", "a number, positive", "1", "weight of a cost; of a barrier: its factor mu"},
    {"penalty", "quadratic | huber | absolute | barrier", "quadratic",
     "growth of a cost: quadratic; huber: quadratic, then linear; absolute: linear; barrier: logarithm of "
     "the distance to lower and upper"},
    {"width", "a number, positive", "0.01",
     "of huber and absolute: value from which the cost is linear; of a barrier: distance below which it "
     "becomes a parabola"},
};

Section& about_term(Section& block, const char* key) {
  const auto row = std::find_if(std::begin(kTermKeys), std::end(kTermKeys),
                                [&](const TermKey& k) { return k.key == std::string_view(key); });
  return block.about(row->meaning);
}

const TermKind* kind_named(const std::string& name) {
  const auto row = std::find_if(std::begin(kTermKinds), std::end(kTermKinds),
                                [&](const TermKind& kind) { return kind.name == name; });
  return row == std::end(kTermKinds) ? nullptr : row;
}

std::string suggested_kind(const std::string& name) {
  Names valid;
  for (const TermKind& kind : kTermKinds) valid.push_back(kind.name);
  return suggestion(name, valid);
}

std::vector<int> chosen_entries(const TermSpec& term, const Names& names) {
  std::vector<int> entries;
  for (const std::string& entry : term.entries)
    entries.push_back(int(std::find(names.begin(), names.end(), entry) - names.begin()));
  if (!entries.empty()) return entries;
  for (std::size_t i = 0; i < names.size(); ++i) entries.push_back(int(i));
  return entries;
}

StageFunction function_of(const TermSpec& term, const TaskSpec& task, const StageFunction& moving) {
  const TermKind& kind = *kind_named(term.type);
  const Names names = kind.entries(task.scene);
  TermAsked asked{term, moving};
  if (asked.target.size() == 0) asked.target = VectorXd::Zero(Eigen::Index(names.size()));
  return entries_of(kind.function(task.scene, task.robot.unit, asked), chosen_entries(term, names));
}

bool is_bounded(const TermSpec& term) { return term.lower.size() > 0 || term.upper.size() > 0; }

// Whatever the names are.
std::vector<SpecFault> faults_of_values(const TermSpec& term, const TermKind& kind) {
  std::vector<SpecFault> faults;
  const auto* round = term.moves ? std::get_if<CircularTarget>(&*term.moves) : nullptr;
  if (term.moves && kind.moves == Moves::kNot)
    faults.push_back({"moves", "the target of '" + term.type + "' does not move"});
  if (round && kind.moves == Moves::kTurn)
    faults.push_back({"moves", "an orientation does not move on a circle; expected still or file"});
  if (round && !(round->normal.norm() > 0))
    faults.push_back({"normal", "'normal' is zero, expected a direction"});
  if (term.role == Role::kInequality && !is_bounded(term))
    faults.push_back({"role", "an inequality needs 'lower', 'upper' or both"});
  if (term.lower.size() == term.upper.size() && (term.lower.array() > term.upper.array()).any())
    faults.push_back({"lower", "'lower' is above 'upper'; expected the least value"});
  if (term.role == Role::kCost && std::holds_alternative<RelaxedBarrier>(term.penalty) && !is_bounded(term))
    faults.push_back({"penalty", "a barrier keeps away from bounds; expected 'lower', 'upper' or both"});
  return faults;
}

class TermReader {
 public:
  TermReader(Section& block, const TaskSpec& task, const TermKind& kind)
      : block_(block), task_(task), kind_(kind) {}

  TermSpec read(const std::string& name) {
    term_.name = name, term_.type = kind_.name;
    read_asked();
    const Names names = kind_.entries(task_.scene);
    term_.entries = distinct_names(about("entries"), "entries", names);
    const auto n = Eigen::Index(names.size());
    if (!kind_.looks) term_.target = read_numbers("target", n, "0");
    if (kind_.moves != Moves::kNot) read_moving();
    term_.role = about("role").choice_or<Role>(
        "role", "cost",
        {{"cost", Role::kCost}, {"equality", Role::kEquality}, {"inequality", Role::kInequality}});
    if (term_.role != Role::kEquality) {
      const Eigen::Index counted = term_.entries.empty() ? n : Eigen::Index(term_.entries.size());
      if (about("lower").has("lower")) term_.lower = read_numbers("lower", counted, nullptr);
      if (about("upper").has("upper")) term_.upper = read_numbers("upper", counted, nullptr);
    }
    read_where();
    if (term_.role == Role::kCost) read_penalty();
    const auto is_known = [&](const std::string& entry) { return contains(names, entry); };
    // Unknown names are noted by now.
    const bool all_known = (!kind_.has_frame || !term_.frame.empty()) &&
                           std::all_of(term_.entries.begin(), term_.entries.end(), is_known);
    for (const SpecFault& fault : all_known ? faults_of(term_, task_) : faults_of_values(term_, kind_))
      block_.problem(fault.key, fault.message);
    return term_;
  }

 private:
  Section& about(const char* key) { return about_term(block_, key); }

  void read_asked() {
    if (kind_.has_frame) term_.frame = read_link(about("frame"), "frame", &task_.scene.model);
    if (kind_.has_axes)
      term_.in = about("in").choice_or<ReferenceFrame>("in", "aligned",
                                                       {{"world", ReferenceFrame::kWorld},
                                                        {"local", ReferenceFrame::kLocal},
                                                        {"aligned", ReferenceFrame::kLocalWorldAligned}});
    if (!kind_.looks) return;
    term_.axis = read_vector3(about("axis"), "axis", Eigen::Vector3d::UnitZ());
    term_.place = read_vector3(about("place"), "place", std::nullopt);
  }

  void read_moving() {
    enum { kStill, kCircle, kFile };
    const int how = about("moves").choice_or<int>("moves", "still",
                                                  {{"still", kStill}, {"circle", kCircle}, {"file", kFile}});
    if (how == kCircle) {
      CircularTarget round;
      round.radius = about("radius").get_or("radius", round.radius, io::positive());
      round.period = about("period").get<double>("period", io::positive());
      round.normal = read_vector3(about("normal"), "normal", Eigen::Vector3d::UnitZ());
      term_.moves = round;
    }
    if (how == kFile) read_moving_file(about("file").get<std::string>("file"));
  }

  void read_moving_file(const std::string& name) {
    if (name.empty()) return;
    try {
      const std::string path = path_beside(task_.file, block_, "file", name);
      term_.moves = kind_.moves == Moves::kTurn ? turns_in(path) : places_in(path);
    } catch (const Error& e) {
      block_.problem("file", e.what());
    }
  }

  VectorXd read_numbers(const char* key, Eigen::Index n, const char* fallback) {
    const std::string text = fallback ? about(key).get_or(key, fallback) : about(key).get<std::string>(key);
    return numbers_in(block_, key, text, n, {}, "expected " + std::to_string(n) + ", or one for all", true);
  }

  void read_where() {
    const int where = about("where").choice_or<int>("where", "running",
                                                    {{"running", 0}, {"start", 1}, {"end", 2}, {"at", 3}});
    if (where > 0) term_.at = where == 2 ? 1 : 0;
    if (where == 3) term_.at = about("at").get<double>("at", io::between(0, 1));
  }

  void read_penalty() {
    enum Kind { kQuadratic, kHuber, kAbsolute, kBarrier };
    const double weight = about("weight").get_or("weight", 1.0, io::positive());
    const Kind kind = about("penalty").choice_or<Kind>(
        "penalty", "quadratic",
        {{"quadratic", kQuadratic}, {"huber", kHuber}, {"absolute", kAbsolute}, {"barrier", kBarrier}});
    term_.penalty = Quadratic{weight};
    if (kind == kQuadratic) return;
    const double width = about("width").get_or("width", 0.01, io::positive());
    if (kind == kHuber) term_.penalty = Huber{weight, width};
    if (kind == kAbsolute) term_.penalty = SmoothAbsolute{weight, width};
    if (kind == kBarrier) term_.penalty = RelaxedBarrier{weight, width};
  }

  Section& block_;
  const TaskSpec& task_;
  const TermKind& kind_;
  TermSpec term_;
};

// Null where the file names none that there is, which is noted.
const TermKind* read_kind(Section& block, const RobotModel* model) {
  const std::string wanted = block.about(kinds_with_meanings()).get<std::string>("type");
  const TermKind* kind = kind_named(wanted);
  if (!kind && model && !wanted.empty())
    block.problem("type", "'" + block.path() + ".type' cannot be '" + wanted + "'" + suggested_kind(wanted));
  return kind;
}

// Of vectors that a program fills in.
void add_faults_of_sizes(const TermSpec& term, const Names& names, std::vector<SpecFault>& faults) {
  const auto check = [&](const char* key, const VectorXd& values, std::size_t n) {
    if (values.size() > 0 && values.size() != Eigen::Index(n))
      faults.push_back({key, "'" + std::string(key) + "' has " + std::to_string(values.size()) +
                                 " entries, expected " + std::to_string(n)});
  };
  const std::size_t counted = term.entries.empty() ? names.size() : term.entries.size();
  check("target", term.target, names.size()), check("lower", term.lower, counted),
      check("upper", term.upper, counted);
  for (const std::string& entry : term.entries)
    if (!contains(names, entry))
      faults.push_back(
          {"entries", "'" + entry + "' is no entry of '" + term.type + "'" + suggestion(entry, names)});
}

void read_term(Section& block, const TaskSpec& task, const RobotModel* model, std::vector<TermSpec>& terms) {
  std::string name = block.value();
  if (name.empty()) name = "term " + std::to_string(terms.size() + 1);
  const TermKind* kind = read_kind(block, model);
  if (!kind || !model) {
    for (const TermKey& key : kTermKeys) block.about(key.meaning).defer(key.key, key.takes, key.fallback);
    return;
  }
  for (const TermSpec& other : terms) {
    if (other.name == name) block.problem("", "'" + name + "' names two of 'terms', expected one");
  }
  terms.push_back(TermReader(block, task, *kind).read(name));
}

}  // namespace

std::vector<SpecFault> faults_of(const TermSpec& term, const TaskSpec& task) {
  const TermKind* kind = kind_named(term.type);
  if (!kind) return {{"type", "there is no '" + term.type + "'" + suggested_kind(term.type)}};
  std::vector<SpecFault> faults;
  add_faults_of_sizes(term, kind->entries(task.scene), faults);
  if (!faults.empty()) return faults;
  faults = faults_of_values(term, *kind);
  try {
    function_of(term, task, {});
  } catch (const ArgumentError& e) {
    faults.push_back({kind->has_frame ? "frame" : "type", e.what()});
  }
  return faults;
}

TargetOverTime target_over_time(const TermSpec& term) {
  if (kind_named(term.type)->moves == Moves::kTurn) return turn_over_time(*term.moves);
  return place_over_time(*term.moves,
                         term.target.size() > 0 ? Eigen::Vector3d(term.target) : Eigen::Vector3d::Zero());
}

const TermSpec* follower(const std::vector<TermSpec>& terms) {
  for (const TermSpec& term : terms)
    if (term.moves && !term.frame.empty() && kind_named(term.type)->moves == Moves::kPlace) return &term;
  return nullptr;
}

void add(const TermSpec& spec, const TaskSpec& task, Problem& problem) {
  StageFunction moving;
  if (spec.moves) moving = problem.parameters.add(spec.name + " target", target_over_time(spec));
  Term term{spec.name, Where::kRunning, Role::kEquality, function_of(spec, task, moving)};
  if (spec.role != Role::kEquality && is_bounded(spec)) {
    const Eigen::Index n = std::max(spec.lower.size(), spec.upper.size());
    const VectorXd none = VectorXd::Constant(n, HUGE_VAL);
    term.role = Role::kInequality;
    term.lower = spec.lower.size() > 0 ? spec.lower : -none;
    term.upper = spec.upper.size() > 0 ? spec.upper : none;
  }
  if (spec.at) term = at_fraction(*spec.at, term);
  problem.add(spec.role == Role::kCost ? soft(term, spec.penalty) : term);
}

std::vector<TermSpec> read_terms(Section& file, const TaskSpec& task, const RobotModel* model) {
  if (!file.about("costs and constraints by ready-made functions").has("terms")) return {};
  Section list = file.child("terms");
  std::vector<TermSpec> terms;
  if (!list.about("term <name> { ... }").has("term")) return {};
  for (Section& block : list.each("term")) read_term(block, task, model, terms);
  return terms;
}

}  // namespace dyntape
