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

// What a kind of term may ask for.
struct TermAsked {
  std::string frame;
  ReferenceFrame in = ReferenceFrame::kLocalWorldAligned;
  Eigen::Vector3d axis, place;
  VectorXd target;
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
    {"frame_orientation", "the turn of a link away from roll, pitch and yaw in target [rad]", true, false,
     false, xyz,
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
    {"looks_at", "how far an axis of a link points past a place, tan(angle / 2)", true, false, true, aside,
     [](const RobotScene& scene, ControlUnit, const TermAsked& a) {
       return frame_looks_at(scene, a.frame, a.axis, a.place);
     }},
    {"com", "the centre of mass [m]", false, false, false, xyz,
     [](const RobotScene& scene, ControlUnit, const TermAsked& a) {
       return away(a, [&](const Eigen::Vector3d& p) { return com_position(scene, p); });
     },
     Moves::kPlace},
    {"momentum", "of the whole robot, linear and about its centre of mass [kg m/s, kg m^2/s]", false, false,
     false, linear_angular,
     [](const RobotScene& scene, ControlUnit, const TermAsked& a) {
       return centroidal_momentum(scene, Eigen::Matrix<double, 6, 1>(a.target));
     }},
    {"joint_position", "of joints [rad or m]", false, false, false, joints,
     [](const RobotScene& scene, ControlUnit, const TermAsked& a) { return joints_off(scene, a.target); }},
    {"joint_velocity", "of joints [rad/s or m/s]", false, false, false, joints,
     [](const RobotScene& scene, ControlUnit, const TermAsked& a) {
       return less(joint_velocities(scene), a.target);
     }},
    {"torque", "of driven joints [N m or N]", false, false, false, driven,
     [](const RobotScene& scene, ControlUnit unit, const TermAsked& a) {
       return less(joint_torque(scene, unit), a.target);
     }},
    {"power", "of driven joints, torque times velocity [W]", false, false, false, driven,
     [](const RobotScene& scene, ControlUnit unit, const TermAsked& a) {
       return less(joint_power(scene, unit), a.target);
     }},
};

std::string kinds_with_meanings() {
  std::string text = "what it is a function of, less target:";
  for (const TermKind& kind : kTermKinds)
    text += std::string(&kind == kTermKinds ? " " : "; ") + kind.name + ", " + kind.meaning;
  return text;
}

struct TermKey {
  const char *key, *takes, *fallback, *meaning;
};
constexpr TermKey kTermKeys[] = {
    {"frame", "name of a link", "", "of the frame_ kinds and looks_at"},
    {"in", "world | local | aligned", "aligned",
     "point and axes of frame_velocity: the world's, the link's, or the link's origin in the world's axes"},
    {"axis", "three numbers \"x y z\"", "0 0 1",
     "of looks_at: the direction in the link's axes, of any length"},
    {"place", "three numbers \"x y z\"", "", "of looks_at: where it looks, in the world [m]"},
    {"target", "numbers", "0", "what is subtracted, one number an entry, or one for all"},
    {"moves", "still | circle | file", "still",
     "how the target goes with time, of frame_position, frame_orientation and com: on a circle about target, "
     "or by a table"},
    {"radius", "a number, positive", "0.1", "of the circle [m]"},
    {"period", "a number, positive", "", "of the circle, once round [s]"},
    {"normal", "three numbers \"x y z\"", "0 0 1", "of the circle's plane, of any length"},
    {"file", "name of a table", "",
     "of the target: columns t [s] and x, y, z [m], or roll, pitch, yaw [rad]; a path from here"},
    {"entries", "names", "",
     "those that count, x y z of places, turn_x ... of what turns, else names of joints; none named: all"},
    {"role", "cost | equality | inequality", "cost", "a weight, zero, or between lower and upper"},
    {"where", "running | start | end | at", "running",
     "all along, costs integrated over time; or at one instant"},
    {"at", "a number, between 0 and 1", "", "that instant, a share of the duration"},
    {"lower", "numbers", "",
     "least value, one number an entry, or one for all; of a cost: beyond it, it costs"},
    {"upper", "numbers", "", "likewise the most"},
    {"weight", "a number, positive", "1", "of a cost; of the penalty barrier its mu"},
    {"penalty", "quadratic | huber | absolute | barrier", "quadratic",
     "how a cost grows with what is lacking: squares; squares, then straight on; straight on; or away from "
     "lower and upper before they are reached, by a logarithm"},
    {"width", "a number, positive", "0.01",
     "where huber and absolute turn straight; where the barrier becomes a parabola"},
};

Section& about_term(Section& block, const char* key) {
  const auto row = std::find_if(std::begin(kTermKeys), std::end(kTermKeys),
                                [&](const TermKey& k) { return k.key == std::string_view(key); });
  return block.about(row->meaning);
}

class TermReader {
 public:
  TermReader(Section& block, const Task& task, const TermKind& kind)
      : block_(block), task_(task), kind_(kind) {}

  TaskTerm read(const std::string& name) {
    TermAsked asked = read_asked();
    const Names names = kind_.entries(task_.scene);
    read_entries(names);
    const auto n = Eigen::Index(names.size());
    asked.target = VectorXd::Zero(n);
    if (!kind_.looks) asked.target = read_numbers("target", n, "0");
    const TargetOverTime moving = read_moving(asked);
    const Role role = about("role").choice_or<Role>(
        "role", "cost",
        {{"cost", Role::kCost}, {"equality", Role::kEquality}, {"inequality", Role::kInequality}});
    Term term{name, Where::kRunning, Role::kEquality, {}};
    if (role != Role::kEquality) read_bounds(role, term);
    const bool is_known = !asked.frame.empty() || !kind_.has_frame;
    if (is_known) term.function = chosen_of(asked);
    place(term);
    const std::function<Term(const Term&)> priced =
        role == Role::kCost ? penalised(term.role == Role::kInequality) : nullptr;
    const auto finished = [priced](const Term& t) { return priced ? priced(t) : t; };
    if (!moving || !is_known || !block_.sound()) return {finished(term), {}, {}};
    return {term, moving,
            [=, kind = kind_, scene = task_.scene, unit = task_.robot.unit,
             entries = entries_](const StageFunction& target) {
              TermAsked now = asked;
              now.moving = target;
              Term with = term;
              with.function = entries_of(kind.function(scene, unit, now), entries);
              return finished(with);
            },
            kind_.moves == Moves::kTurn ? "" : asked.frame};
  }

 private:
  Section& about(const char* key) { return about_term(block_, key); }

  TermAsked read_asked() {
    TermAsked asked;
    if (kind_.has_frame) asked.frame = read_link(about("frame"), "frame", &task_.scene.model);
    if (kind_.has_axes)
      asked.in = about("in").choice_or<ReferenceFrame>("in", "aligned",
                                                       {{"world", ReferenceFrame::kWorld},
                                                        {"local", ReferenceFrame::kLocal},
                                                        {"aligned", ReferenceFrame::kLocalWorldAligned}});
    if (!kind_.looks) return asked;
    asked.axis = read_vector3(about("axis"), "axis", Eigen::Vector3d::UnitZ());
    asked.place = read_vector3(about("place"), "place", std::nullopt);
    return asked;
  }

  // Empty where the target stands still.
  TargetOverTime read_moving(const TermAsked& asked) {
    if (kind_.moves == Moves::kNot) return {};
    enum { kStill, kCircle, kFile };
    const int how = about("moves").choice_or<int>("moves", "still",
                                                  {{"still", kStill}, {"circle", kCircle}, {"file", kFile}});
    if (how == kCircle) return read_circle(asked.target);
    if (how == kStill) return {};
    const std::string name = about("file").get<std::string>("file");
    if (name.empty()) return {};
    try {
      const std::string path = path_beside(task_.file, block_, "file", name);
      return kind_.moves == Moves::kTurn ? turns_in(path) : places_in(path);
    } catch (const Error& e) {
      block_.problem("file", e.what());
      return {};
    }
  }

  TargetOverTime read_circle(const VectorXd& center) {
    const double radius = about("radius").get_or("radius", 0.1, io::positive());
    const double period = about("period").get<double>("period", io::positive());
    const Eigen::Vector3d normal = read_vector3(about("normal"), "normal", Eigen::Vector3d::UnitZ());
    if (kind_.moves == Moves::kTurn)
      block_.problem("moves", "an orientation does not move on a circle; expected still or file");
    if (!(normal.norm() > 0)) block_.problem("normal", "'normal' is zero, expected a direction");
    if (kind_.moves == Moves::kTurn || !(normal.norm() > 0) || !(period > 0)) return {};
    return circle(center, normal, radius, period);
  }

  VectorXd read_numbers(const char* key, Eigen::Index n, const char* fallback) {
    const std::string text = fallback ? about(key).get_or(key, fallback) : about(key).get<std::string>(key);
    return numbers_in(block_, key, text, n, {}, "expected " + std::to_string(n) + ", or one for all", true);
  }

  void read_entries(const Names& names) {
    for (const std::string& entry : distinct_names(about("entries"), "entries", names))
      entries_.push_back(int(std::find(names.begin(), names.end(), entry) - names.begin()));
    if (!entries_.empty()) return;
    for (std::size_t i = 0; i < names.size(); ++i) entries_.push_back(int(i));
  }

  // An inequality, where there are bounds.
  void read_bounds(Role role, Term& term) {
    const auto n = Eigen::Index(entries_.size());
    term.lower = VectorXd::Constant(n, -HUGE_VAL), term.upper = -term.lower;
    const bool has_lower = about("lower").has("lower"), has_upper = about("upper").has("upper");
    if (has_lower) term.lower = read_numbers("lower", n, nullptr);
    if (has_upper) term.upper = read_numbers("upper", n, nullptr);
    if (has_lower || has_upper) term.role = Role::kInequality;
    if (role == Role::kInequality && term.role != role)
      block_.problem("role", "an inequality needs 'lower', 'upper' or both");
    if ((term.lower.array() > term.upper.array()).any())
      block_.problem("lower", "'lower' is above 'upper'; expected the least value");
  }

  StageFunction chosen_of(const TermAsked& asked) {
    try {
      return entries_of(kind_.function(task_.scene, task_.robot.unit, asked), entries_);
    } catch (const ArgumentError& e) {
      block_.problem(kind_.has_frame ? "frame" : "type", e.what());
      return {};
    }
  }

  void place(Term& term) {
    const int where = about("where").choice_or<int>("where", "running",
                                                    {{"running", 0}, {"start", 1}, {"end", 2}, {"at", 3}});
    double share = where == 2 ? 1 : 0;
    if (where == 3) share = about("at").get<double>("at", io::between(0, 1));
    if (where > 0) term = at_fraction(share, term);
  }

  std::function<Term(const Term&)> penalised(bool has_bounds) {
    enum Kind { kQuadratic, kHuber, kAbsolute, kBarrier };
    const double weight = about("weight").get_or("weight", 1.0, io::positive());
    const Kind kind = about("penalty").choice_or<Kind>(
        "penalty", "quadratic",
        {{"quadratic", kQuadratic}, {"huber", kHuber}, {"absolute", kAbsolute}, {"barrier", kBarrier}});
    double width = 1;
    if (kind != kQuadratic) width = about("width").get_or("width", 0.01, io::positive());
    if (kind == kBarrier && !has_bounds)
      block_.problem("penalty", "a barrier keeps away from bounds; expected 'lower', 'upper' or both");
    if (!block_.sound()) return {};
    switch (kind) {
      case kQuadratic:
        return [=](const Term& term) { return soft(term, Quadratic{weight}); };
      case kHuber:
        return [=](const Term& term) { return soft(term, Huber{weight, width}); };
      case kAbsolute:
        return [=](const Term& term) { return soft(term, SmoothAbsolute{weight, width}); };
      case kBarrier:
        return [=](const Term& term) { return soft(term, RelaxedBarrier{weight, width}); };
    }
    return {};
  }

  Section& block_;
  const Task& task_;
  const TermKind& kind_;
  std::vector<int> entries_;
};

// Null where the file names none that there is, which is noted.
const TermKind* read_kind(Section& block, const RobotModel* model) {
  const std::string wanted = block.about(kinds_with_meanings()).get<std::string>("type");
  Names valid;
  for (const TermKind& kind : kTermKinds) {
    if (kind.name == wanted) return &kind;
    valid.push_back(kind.name);
  }
  if (model && !wanted.empty())
    block.problem("type",
                  "'" + block.path() + ".what' cannot be '" + wanted + "'" + suggestion(wanted, valid));
  return nullptr;
}

}  // namespace

void add(const TaskTerm& term, Problem& problem) {
  if (!term.target) return problem.add(term.term);
  const Parameter now = problem.parameters.add(term.term.name + " target", term.target);
  problem.add(term.with_target(now));
}

std::vector<TaskTerm> read_terms(Section& file, const Task& task, const RobotModel* model) {
  if (!file.about("ready terms").has("terms")) return {};
  Section list = file.child("terms");
  std::vector<TaskTerm> terms;
  if (!list.about("one of them; its name behind the word").has("term")) return {};
  std::vector<Section> blocks = list.children("term");
  if (blocks.empty()) blocks.push_back(list.child("term"));
  for (Section& block : blocks) {
    std::string name = block.value();
    if (name.empty()) name = "term " + std::to_string(terms.size() + 1);
    const TermKind* kind = read_kind(block, model);
    if (!kind || !model) {
      for (const TermKey& key : kTermKeys) block.about(key.meaning).defer(key.key, key.takes, key.fallback);
      continue;
    }
    for (const TaskTerm& other : terms) {
      if (other.term.name == name) block.problem("", "'" + name + "' names two of 'terms', expected one");
    }
    terms.push_back(TermReader(block, task, *kind).read(name));
  }
  return terms;
}

}  // namespace dyntape
