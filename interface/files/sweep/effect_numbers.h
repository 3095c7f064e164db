// SPDX-License-Identifier: BSD-3-Clause
//
// The numbers of a scene's effects by name: lists them, says which can be parameters of a recorded step, and
// replaces them.  Uses the effects' own descriptions (dynamics/effects/parameters.h).
//
//   effect_numbers(scene)            // "effects.contacts.contact.friction", 4 items with one number each, ...
//   EffectPlace place{"effects.joint_damping.coefficient", EffectPlace::kAll, {0, 1}};      // of joints 0 and 1
//   put(effects, place, AD_or_double);
#pragma once

#include <string>
#include <vector>

#include <dyntape/dynamics/effects/effects.h>
#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

// A number, or group of numbers, of an effect.
struct EffectNumber {
  enum class Shape { kNumber, kVector3, kJoints };  // one; along x, y, z; one per joint
  // Why it cannot vary: the recording depends on it, it is a word, or the scene does not set it.
  enum class Use { kVaries, kRecorded, kWord, kNotGiven };

  std::string path;  // effects.<key>.<parameter>, effects.<key>.<item>.<parameter>
  dynamics::ParameterInfo info;
  Shape shape = Shape::kNumber;
  Use use = Use::kVaries;
  int items = 0;          // length of the list; 0: not in a list
  bool is_first = false;  // true: the first of its effect, also called effects.<key>
};

// The numbers of the chosen effects, in their order.
std::vector<EffectNumber> effect_numbers(const RobotScene& scene);

// effects.<key> of the effects that are not chosen.
std::vector<std::string> absent_effects(const RobotScene& scene);

// The address of a number.
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

// Calls visit(path, item, info, value) for each parameter of an effect; item -1: not in a list.
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
    } else {  // words, and numbers that the recording depends on
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
