// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/sweep/value_keys.h>

#include <algorithm>
#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/suggest.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/files/joint_values.h>
#include <dyntape/interface/files/lists.h>
#include <dyntape/interface/files/scene/effect_keys.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/robot/model_parameters.h>

namespace dyntape {

namespace {

using io::Section;

struct FoundPlace {
  ValuePlace place;
  io::Range range = {};  // of the number
  std::string name;      // of its column
};

struct BaseKey {
  const char* path;
  Eigen::Vector3d BaseStart::*part;
};
constexpr BaseKey kBaseKeys[] = {{"start.base.position", &BaseStart::position},
                                 {"start.base.roll_pitch_yaw", &BaseStart::roll_pitch_yaw},
                                 {"start.base.velocity", &BaseStart::velocity},
                                 {"start.base.angular_velocity", &BaseStart::angular_velocity}};
constexpr const char *kPositions = "start.q", *kVelocities = "start.v", *kTorques = "commands.torque";

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : "+") + name;
  return text;
}

// Finds what a block `value` is about, and reads the keys that say where in it.
class PlaceReader {
 public:
  PlaceReader(Section& block, const Scene& scene)
      : block_(block), scene_(scene), model_(scene.robot.model), numbers_(effect_numbers(scene.robot)) {}

  std::optional<FoundPlace> find(const std::string& of) {
    for (const EffectNumber& number : numbers_) {
      const bool is_short = number.is_first && number.path.starts_with(of + ".") &&
                            number.path.find('.', of.size() + 1) == std::string::npos;
      if (of == number.path || is_short) return in_effect(number);
    }
    for (const BaseKey& key : kBaseKeys) {
      if (of == key.path && floats(model_))
        return FoundPlace{BasePlace{key.part, axis()}, {}, of + "." + "xyz"[axis()]};
    }
    if (of == kPositions) return of_joints(of, StartPlace::Block::kPosition);
    if (of == kVelocities) return of_joints(of, StartPlace::Block::kVelocity);
    if (of == kTorques) return of_torques(of);
    if (of.starts_with("robot.")) return of_robot(of);
    return nothing(of);
  }

 private:
  std::nullopt_t refuse(const std::string& sentence) {
    block_.problem("parameter", sentence);
    return std::nullopt;
  }

  std::nullopt_t nothing(const std::string& of) {
    for (const std::string& effect : absent_effects(scene_.robot)) {
      if (of == effect || of.starts_with(effect + "."))
        return refuse("'" + effect + "' does not act in the scene, and what does not act cannot vary");
    }
    return refuse("nothing in the scene is called '" + of + "'" + suggestion(of, valid()));
  }

  std::vector<std::string> valid() const {
    std::vector<std::string> names;
    for (const EffectNumber& number : numbers_) {
      if (number.use == EffectNumber::Use::kVaries) names.push_back(number.path);
    }
    names.insert(names.end(), {kPositions, kVelocities, kTorques, "robot.mass:LINK", "robot.comx:LINK",
                               "robot.comy:LINK", "robot.comz:LINK", "robot.length:JOINT"});
    if (floats(model_)) {
      for (const BaseKey& key : kBaseKeys) names.emplace_back(key.path);
    }
    return names;
  }

  std::optional<FoundPlace> in_effect(const EffectNumber& number) {
    const std::string name = "'" + number.path + "'";
    switch (number.use) {
      case EffectNumber::Use::kRecorded:
        return refuse(name + " cannot vary: what is recorded depends on it; expected a scene for each");
      case EffectNumber::Use::kWord:
        return refuse(name + " is a word, expected a number of the scene");
      case EffectNumber::Use::kNotGiven:
        return refuse(name + " is not given in the scene; expected a number there, which then varies");
      case EffectNumber::Use::kVaries:
        break;
    }
    FoundPlace found{EffectPlace{number.path}, range_of(number.info), number.path};
    auto& place = std::get<EffectPlace>(found.place);
    if (number.items > 0) read_item(number, place, found.name);
    if (number.shape == EffectNumber::Shape::kVector3) {
      place.entries = {axis()};
      found.name += std::string(".") + "xyz"[axis()];
    }
    if (number.shape != EffectNumber::Shape::kJoints) return found;
    const bool is_q = number.info.length == dynamics::Length::kConfiguration;
    place.entries = entries_of(single_joint_names(model_), found.name,
                               [&](const auto& joint) { return is_q ? joint.idx_q : joint.idx_v; });
    return found;
  }

  void read_item(const EffectNumber& number, EffectPlace& place, std::string& name) {
    block_.about("which element of a list, counted from 1, with one element per frame; absent: all elements");
    if (!block_.has("item")) return;
    place.item = block_.get<int>("item", io::between(1, number.items)) - 1;
    name += "." + std::to_string(place.item + 1);
  }

  int axis() {
    block_.about("which of three numbers: x, y or z");
    if (!block_.has("axis")) (void)block_.get<std::string>("axis");  // notes that it is missing
    return block_.choice_or<int>("axis", "x", {{"x", 0}, {"y", 1}, {"z", 2}});
  }

  // All, or those that `joint` names; the name gets longer by them.
  template <class Entry>
  std::vector<int> entries_of(const std::vector<std::string>& joints, std::string& name, const Entry& entry) {
    block_.about(
        "joints whose number varies; absent: all joints of one degree of freedom, with the same number");
    std::vector<std::string> valid = joints;
    for (const std::string& joint : block_.strings_or("joint", {})) {
      const dynamics::MimicRule* rule = rule_of(scene_.robot, joint);
      if (!rule || contains(joints, joint)) continue;
      valid.push_back(joint);
      block_.problem("joint", "joint '" + joint + "' follows '" + rule->leader +
                                  "' and has no value of its own; expected '" + rule->leader + "'");
    }
    const std::vector<std::string> named = distinct_names(block_, "joint", valid);
    if (!named.empty()) name += "." + joined(named);
    std::vector<int> entries;
    for (const std::string& joint : named.empty() ? joints : named) {
      if (contains(joints, joint))
        entries.push_back(entry(model_.joints[std::size_t(model_.joint_index(joint))]));
    }
    return entries;
  }

  std::optional<FoundPlace> of_joints(const std::string& of, StartPlace::Block block) {
    const std::vector<std::string> joints = independent_joints(scene_.robot);
    FoundPlace found{StartPlace{block, {}}, {}, of};
    const bool is_q = block == StartPlace::Block::kPosition;
    std::get<StartPlace>(found.place).entries =
        entries_of(joints, found.name, [&](const auto& joint) { return is_q ? joint.idx_q : joint.idx_v; });
    return found;
  }

  std::optional<FoundPlace> of_torques(const std::string& of) {
    if (scene_.commands.t.size() > 1)
      return refuse("'commands.torque' cannot vary: the scene's commands are a table");
    const std::vector<std::string> driven = driven_names(scene_.robot);
    const std::vector<int> dofs = actuated_dofs(scene_.robot);
    FoundPlace found{StartPlace{StartPlace::Block::kTorque, {}}, {}, of};
    std::get<StartPlace>(found.place).entries = entries_of(driven, found.name, [&](const auto& joint) {
      return int(std::find(dofs.begin(), dofs.end(), joint.idx_v) - dofs.begin());
    });
    return found;
  }

  // Masses, centres of mass and lengths; of single inertias not any number belongs to a body.
  std::optional<FoundPlace> of_robot(const std::string& of) {
    const std::string name = of.substr(std::string("robot.").size());
    const std::string what = name.substr(0, name.find(':'));
    const std::vector<std::string> kinds = {"mass", "comx", "comy", "comz", "length"};
    if (!contains(kinds, what))
      return refuse("'robot." + what + "' is nothing that varies" + suggestion(what, kinds));
    try {
      ModelParameters(model_, {name});
    } catch (const ArgumentError& e) {
      return refuse(e.what());
    }
    const bool is_any = what.starts_with("com");
    return FoundPlace{RobotPlace{name}, is_any ? io::Range{} : io::positive(), of};
  }

  Section& block_;
  const Scene& scene_;
  const dynamics::Model<double>& model_;
  std::vector<EffectNumber> numbers_;
};

const std::vector<std::pair<std::string, Spread>> kSpreads = {{"uniform", Spread::kUniform},
                                                              {"log-uniform", Spread::kLogUniform},
                                                              {"normal", Spread::kNormal},
                                                              {"grid", Spread::kGrid}};

// The part of a normal distribution between two numbers.
double probability(const SweptValue& value) {
  const auto below = [&](double x) {
    return 0.5 * std::erfc((value.mean - x) / (value.deviation * std::sqrt(2)));
  };
  return below(value.to) - below(value.from);
}

void read_normal(Section& block, const io::Range& range, SweptValue& value) {
  value.mean = block.about("mean of a normal distribution").get<double>("mean", range);
  value.deviation = block.about("standard deviation of a normal distribution")
                        .get<double>("standard_deviation", io::positive());
  block.about("smallest and largest value of a normal distribution; numbers outside are drawn again");
  const auto end = [&](const char* key, double limit) {
    return block.has(key) ? block.get<double>(key, range) : limit;
  };
  value.from = end("from", range.low), value.to = end("to", range.high);
  if (range.low_open && value.from == range.low) value.from = std::nextafter(range.low, HUGE_VAL);
  constexpr double kLikely = 0.01;
  if (value.deviation > 0 && probability(value) < kLikely) {
    block.problem("mean", "of these normal numbers " + io::with_digits(100 * probability(value), 2) +
                              " % lie between their limits; expected 1 % or more");
  }
}

void read_numbers(Section& block, const io::Range& range, SweptValue& value) {
  value.spread = block.about("spacing or distribution between `from` and `to`")
                     .choice_or<Spread>("distribution", "uniform", kSpreads);
  if (value.spread == Spread::kNormal) return read_normal(block, range, value);
  value.from = block.about("smallest value, or first value of a grid").get<double>("from", range);
  value.to = block.about("largest value, or last value of a grid").get<double>("to", range);
  if (value.spread == Spread::kGrid)
    value.steps =
        block.about("of a grid: number of values").get<long>("steps", io::between(1, double(kMostRows)));
  if (value.spread != Spread::kGrid && !(value.from <= value.to))
    block.problem("to", "'to' is less than 'from', expected as much or more");
  if (!std::isfinite(value.to - value.from))
    block.problem("to", "'from' and 'to' are farther apart than a double can hold");
  if (value.spread == Spread::kLogUniform && !(value.from > 0))
    block.problem("from",
                  "'from' of log-uniform numbers must be positive, got '" + io::shortest(value.from) + "'");
  if (value.spread == Spread::kGrid && value.steps == 1 && value.from != value.to)
    block.problem("steps", "a grid of one step has no place for 'to', expected 2 or more");
}

// Every key, whatever its value means.
void read_nothing(Section& block) {
  block.about("which of three numbers: x, y or z").defer("axis", "x | y | z", "");
  block.about("joints whose number varies; absent: all joints of one degree of freedom, with the same number")
      .defer("joint", "names", "");
  block.about("which element of a list, counted from 1, with one element per frame; absent: all elements")
      .defer("item", "a whole number", "");
  block.about("spacing or distribution between `from` and `to`")
      .choice_or<Spread>("distribution", "uniform", kSpreads);
  block.about("smallest value, or first value of a grid").defer("from", "a number", "");
  block.about("largest value, or last value of a grid").defer("to", "a number", "");
  block.about("of a grid: number of values").defer("steps", "a whole number", "");
  block.about("mean of a normal distribution; `from` and `to` may truncate it").defer("mean", "a number", "");
  block.about("standard deviation of a normal distribution")
      .defer("standard_deviation", "a number, positive", "");
  block.about("name of the column in the results; absent: made from `parameter`").defer("name", "text", "");
}

std::string read_column_name(Section& block, const std::string& fallback) {
  const std::string name = block.about("name of the column in the results; absent: made from `parameter`")
                               .get_or<std::string>("name", fallback);
  if (const std::string fault = fault_of_name(name); !fault.empty()) block.problem("name", "'name' " + fault);
  if (name.find_first_of(",\" \t") != std::string::npos || name.empty())
    block.problem("name", "'name' must be a word without blanks, commas and quotes, got '" + name + "'");
  return name;
}

}  // namespace

std::optional<SweptValue> read_value(Section& block, const Scene* scene) {
  block.about(
      "the key that varies: effects.joint_damping, effects.contacts.contact.friction, start.q, "
      "commands.torque, start.base.position, robot.mass:LINK, ...");
  const std::string of = block.get<std::string>("parameter");
  std::optional<FoundPlace> found;
  if (scene && !of.empty()) found = PlaceReader(block, *scene).find(of);
  if (!found) {
    read_nothing(block);
    return {};
  }
  SweptValue value;
  value.place = std::move(found->place);
  read_numbers(block, found->range, value);
  value.name = read_column_name(block, found->name);
  return value;
}

bool overlap(const ValuePlace& a, const ValuePlace& b) {
  if (a.index() != b.index()) return false;
  if (const auto* x = std::get_if<EffectPlace>(&a)) return x->overlaps(std::get<EffectPlace>(b));
  if (const auto* x = std::get_if<RobotPlace>(&a)) return x->name == std::get<RobotPlace>(b).name;
  if (const auto* x = std::get_if<BasePlace>(&a)) {
    const auto& y = std::get<BasePlace>(b);
    return x->part == y.part && x->axis == y.axis;
  }
  const auto &x = std::get<StartPlace>(a), &y = std::get<StartPlace>(b);
  return x.block == y.block && std::any_of(x.entries.begin(), x.entries.end(),
                                           [&](int entry) { return contains(y.entries, entry); });
}

}  // namespace dyntape
