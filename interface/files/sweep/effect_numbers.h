// SPDX-License-Identifier: BSD-3-Clause
//
// The numbers of the effects of a scene, by name: which there are, which of them a recorded step can have as parameters, and
// other values in their places.  Found by walking the effects (dynamics/effects/parameters.h).
//
//   effect_numbers(scene)                          // "effects.contacts.contact.friction", 4 items, each a number ...
//   EffectPlace place{"effects.joint_damping.coefficient", EffectPlace::kAll, {0, 1}};      // of joints 0 and 1
//   put(effects, place, AD_or_double);
#pragma once

#include <string>
#include <vector>

#include <dyntape/dynamics/effects/effects.h>
#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

// One kind of number that an effect has.
struct EffectNumber {
  enum class Shape { kNumber, kVector3, kJoints };  // one; along x, y, z; one a joint
  // Why it cannot vary: what is recorded depends on it, a word, or nothing that the scene gives.
  enum class Use { kVaries, kRecorded, kWord, kNotGiven };

  std::string path;  // effects.<key>.<parameter>, effects.<key>.<item>.<parameter>
  dynamics::ParameterInfo info;
  Shape shape = Shape::kNumber;
  Use use = Use::kVaries;
  int items = 0;          // how many a list has; 0: none of a list
  bool is_first = false;  // of its effect: effects.<key> means it
};

// Of the effects that act, in their order.
std::vector<EffectNumber> effect_numbers(const RobotScene& scene);

// effects.<key> of those that do not act.
std::vector<std::string> absent_effects(const RobotScene& scene);

// Where a number stands.
struct EffectPlace {
  static constexpr int kAll = -1;
  std::string path;
  int item = kAll;                 // of a list
  std::vector<int> entries = {0};  // of v (nv) or q (nq), or 0, 1, 2 along x, y, z

  bool overlaps(const EffectPlace& other) const;
};

namespace detail {

inline std::string number_path(const char* effect, const char* item, const char* parameter) {
  return std::string("effects.") + effect + (*item ? std::string(".") + item : "") + "." + parameter;
}

// visit(path, item, info, value) of each parameter of an effect; item -1: of none.
template <class E, class Visit>
void for_each_parameter_of(E& effect, const Visit& visit) {
  using Effect = std::remove_const_t<E>;
  Effect::visit_parameters(effect, [&](const dynamics::ParameterInfo& info, auto& value) {
    visit(number_path(Effect::kKey, "", info.name), -1, info, value);
  });
  if constexpr (requires { typename Effect::Item; }) {
    int k = 0;
    for (auto& item : effect) {
      Effect::Item::visit_parameters(item, [&](const dynamics::ParameterInfo& info, auto& value) {
        visit(number_path(Effect::kKey, Effect::kItem, info.name), k, info, value);
      });
      ++k;
    }
  }
}

template <class T>
struct PutNumber {
  const EffectPlace& place;
  const T& number;

  template <class Value>
  void into(std::optional<Value>& value) const {
    if (value) into(*value);
  }
  template <class Value>
  void into(Value& value) const {
    if constexpr (std::is_same_v<Value, T>) {
      value = number;
    } else if constexpr (requires { requires std::is_same_v<typename Value::Scalar, T>; }) {
      for (int entry : place.entries) value[entry] = number;
    } else {  // words, and numbers that what is recorded depends on
      static_assert(std::is_enum_v<Value> || std::is_same_v<Value, double> ||
                    std::is_same_v<Value, Eigen::VectorXd>);
    }
  }

  template <class Value>
  void operator()(const std::string& path, int item, const dynamics::ParameterInfo&, Value& value) const {
    if (path == place.path && (item < 0 || place.item == EffectPlace::kAll || item == place.item))
      into(value);
  }
};

}  // namespace detail

template <class T>
void put(dynamics::Effects<T>& effects, const EffectPlace& place, const T& number) {
  dynamics::for_each_chosen_effect(effects, [&](auto& effect) {
    detail::for_each_parameter_of(effect, detail::PutNumber<T>{place, number});
  });
}

}  // namespace dyntape
