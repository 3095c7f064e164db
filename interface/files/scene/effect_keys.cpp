// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/scene/effect_keys.h>

#include <cmath>
#include <sstream>

#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/interface/files/joint_values.h>
#include <dyntape/interface/files/lists.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

using dynamics::ParameterInfo;
using Eigen::Vector3d;
using Eigen::VectorXd;
using io::Section;
using RobotModel = dynamics::Model<double>;

template <class T>
struct IsOptional : std::false_type {};
template <class T>
struct IsOptional<std::optional<T>> : std::true_type {};

std::string in_brackets(const char* unit) {
  return *unit && std::string(unit) != "1" ? std::string(" [") + unit + "]" : "";
}

// Reads the parameters of one effect, or of one item of a list.
class ParameterReader {
 public:
  ParameterReader(Section& block, const RobotModel* model) : block_(block), model_(model) {}

  template <class Value>
  void operator()(const ParameterInfo& info, Value& value) {
    block_.about(info.what + in_brackets(info.unit));
    read(info, info.name, value);
  }

  // The value under another key than its own: joint_damping 0.1.
  void read(const ParameterInfo& info, const std::string& key, VectorXd& value) {
    const bool is_word = block_.has(key) && model_ && !block_.children(key).empty();
    const std::string word = is_word ? block_.children(key).front().value() : "";
    if (info.of_robot && (word == "robot" || word == "on")) {
      value = info.of_robot(*model_);
      return;
    }
    const VectorXd numbers =
        read_joint_values(block_, key, model_, {.fallback = info.fallback, .range = range_of(info)});
    if (!model_) return;
    value = info.length == dynamics::Length::kConfiguration ? configuration_of(*model_, numbers) : numbers;
  }

 private:
  void read(const ParameterInfo& info, const std::string& key, double& value) {
    value = info.fallback ? block_.get_or(key, *info.fallback, range_of(info))
                          : block_.get<double>(key, range_of(info));
  }
  void read(const ParameterInfo& info, const std::string& key, Vector3d& value) {
    value = read_vector3(block_, key, info.fallback ? std::optional<Vector3d>(value) : std::nullopt,
                         range_of(info));
  }
  template <class Value>
  void read(const ParameterInfo& info, const std::string& key, std::optional<Value>& value) {
    if (!block_.has(key)) return;
    Value given{};
    read(info, key, given);
    value = std::move(given);
  }
  template <class Value>
  requires std::is_enum_v<Value>
  void read(const ParameterInfo& info, const std::string& key, Value& value) {
    std::vector<std::pair<std::string, Value>> choices;
    std::istringstream words(info.choices);
    for (std::string word; words >> word;) choices.emplace_back(word, Value(int(choices.size())));
    value = block_.choice_or<Value>(key, choices[std::size_t(value)].first, choices);
  }

  Section& block_;
  const RobotModel* model_;
};

// What one key of the block `effects` makes of an effect.
template <class Effect>
class EffectReader {
 public:
  EffectReader(Section& effects, const KeyedRobot& robot)
      : effects_(effects), robot_(robot), model_(robot.model) {}

  // Unchanged where the key is absent.
  template <class Stored>
  void read(Stored& stored) {
    if (!effects_.about(what()).has(kKey)) return;
    std::vector<Section> given = effects_.children(kKey);
    if (given.size() > 1) effects_.problem(kKey, std::string("'") + kKey + "' is given twice, expected once");
    const std::string word = given.empty() ? "" : given.front().value();
    if (word == "off" || word == "false") return stored.reset();
    Effect effect = start(stored);
    if (word.empty() && !is_vector(given)) {
      Section block = effects_.child(kKey);
      read_block(block, effect);
    } else {
      read_word(word, effect);
    }
    stored = std::move(effect);
  }

 private:
  static constexpr const char* kKey = Effect::kKey;

  static std::string what() { return std::string(Effect::kName) + ": off, or a block with these keys"; }

  template <class Stored>
  static Effect start(const Stored& stored) {
    if constexpr (IsOptional<Stored>::value)
      return Effect{};
    else
      return stored;
  }

  // { elbow 0.1 ... }: of joints, not of parameters.
  bool is_vector(std::vector<Section>& given) {
    if (given.empty() || !model_) return false;
    Effect effect;
    bool names_parameter = false, has_vector = false;
    Effect::visit_parameters(effect, [&]<class Value>(const ParameterInfo& info, Value&) {
      names_parameter = names_parameter || given.front().has(info.name);
      has_vector = has_vector || std::is_same_v<Value, VectorXd>;
    });
    if constexpr (requires { typename Effect::Item; }) return false;
    bool names_joint = false;
    for (const std::string& joint : single_joint_names(*model_))
      names_joint = names_joint || (has_vector && !names_parameter && given.front().has(joint));
    return names_joint || (has_vector && !names_parameter && given.front().has("[0]"));
  }

  void read_block(Section& block, Effect& effect) {
    Effect::visit_parameters(effect, ParameterReader(block, model_));
    if constexpr (requires { effect.missing(); }) {
      if (const char* key = effect.missing())
        block.problem(key, std::string("'") + kKey + "' needs '" + key + "' as well");
    }
    if constexpr (requires { typename Effect::Item; }) read_items(block, effect);
  }

  // on, robot, or the first parameter alone where that is a vector; the others as they are where nothing is said.
  void read_word(const std::string& word, Effect& effect) {
    constexpr bool kIsList = requires { typename Effect::Item; };
    bool is_first = true, is_understood = !kIsList && (word == "on" || word == "true");
    Effect::visit_parameters(effect, [&]<class Value>(const ParameterInfo& info, Value& value) {
      if constexpr (std::is_same_v<Value, VectorXd>) {
        is_understood = is_understood || is_first;
        if (is_first) ParameterReader(effects_, model_).read(info, kKey, value);
        if (!is_first && model_) value = of_robot_or_fallback(info);
      } else if constexpr (std::is_same_v<Value, double>) {
        if (!info.fallback) {
          effects_.problem(kKey, std::string("'") + kKey + "' needs a block in which '" + info.name +
                                     "' stands, got '" + word + "'");
        }
        value = info.fallback.value_or(0);
      }
      is_first = false;
    });
    if (!is_understood)
      effects_.problem(kKey, std::string("'") + kKey + "' must be " + (kIsList ? "off" : "on, off") +
                                 " or a block, got '" + word + "'");
  }
  VectorXd of_robot_or_fallback(const ParameterInfo& info) const {
    if (!info.fallback && info.of_robot) return info.of_robot(*model_);
    if (info.length == dynamics::Length::kConfiguration)
      return configuration_of(*model_, VectorXd::Constant(model_->nv, info.fallback.value_or(0)));
    return VectorXd::Constant(model_->nv, info.fallback.value_or(0));
  }

  void read_items(Section& block, Effect& effect) {
    if (!block.about("one element; repeat the block for more").has(Effect::kItem))
      return effects_.problem(kKey, std::string("'") + kKey + "' needs at least one '" + Effect::kItem + "'");
    for (Section& item : block.each(Effect::kItem)) read_item(item, effect);
  }
  void read_item(Section& block, Effect& effect) {
    using Item = typename Effect::Item;
    Item item;
    if constexpr (std::is_same_v<Item, dynamics::ContactBody<double>>) {
      if (const auto spheres = read_collision_shapes(block, robot_))
        return push_spheres(block, *spheres, effect);
    }
    std::vector<std::string> frames = {""};
    if constexpr (requires { item.X_BF; })
      frames = read_frames(block, "links on which it acts, at the origin of each", model_);
    Item::visit_parameters(item, ParameterReader(block, model_));
    for (const std::string& frame : frames) {
      if constexpr (requires { item.X_BF; }) {
        if (!is_frame(frame)) continue;
        dynamics::place_at_frame(*model_, frame, item);
      }
      effect.push_back(item);
    }
  }

  void push_spheres(Section& block, const std::vector<dynamics::CollisionSphere>& spheres, Effect& effect) {
    typename Effect::Item item;
    Effect::Item::visit_parameters(item, ParameterReader(block, model_));
    for (const dynamics::CollisionSphere& sphere : spheres) {
      item.body = sphere.body;
      item.X_BF = {Eigen::Matrix3d::Identity(), sphere.center};
      item.radius = sphere.radius;
      effect.push_back(item);
    }
  }
  bool is_frame(const std::string& name) const {
    for (const auto& frame : model_->frames) {
      if (frame.name == name) return true;
    }
    return false;
  }

  Section& effects_;
  const KeyedRobot& robot_;
  const RobotModel* model_;
};

}  // namespace

io::Range range_of(const ParameterInfo& info) {
  const bool low = info.least > -ParameterInfo::kAny, high = info.most < ParameterInfo::kAny;
  io::Range range{info.least, info.most, info.above, false, std::isinf(info.most), ""};
  const std::string least = io::shortest(info.least), most = io::shortest(info.most);
  if (low && high) range.text = "between " + least + " and " + most;
  if (low && !high) range.text = (info.above ? "more than " : "at least ") + least;
  if (!low && high) range.text = "at most " + most;
  if (info.least == 0 && !high) range.text = info.above ? "positive" : "not negative";
  return range;
}

dynamics::Effects<double> read_effects(Section& file, const KeyedRobot& robot) {
  Section section = file.about("physical effects on the robot; an effect that is not chosen costs no time")
                        .child_or_empty("effects");
  dynamics::Effects<double> effects;
  dynamics::for_each_effect(effects, [&]<class Stored>(Stored& effect) {
    EffectReader<dynamics::effect_type<Stored>>(section, robot).read(effect);
  });
  return effects;
}

}  // namespace dyntape
