// SPDX-License-Identifier: BSD-3-Clause
//
// Descriptions of an effect's parameters, used by casts, checks, files and sweeps.
//
//   Springs<double>::visit_parameters(springs, [](const ParameterInfo& info, auto& value) {
//     std::cout << info.name << " [" << info.unit << "]: " << info.what << "\n";
//   });
//
// A value is one of
//   T                   a number
//   Vector3<T>          in world axes, or in those of the item's frame if the text says so
//   VectorX<T>          one number per joint, (nv), or a configuration (nq): ParameterInfo::length
//   double, VectorXd    the same, if the recording depends on the value
//   std::optional<...>  adds no operation unless given
//   an enumeration      a word of ParameterInfo::choices, in the order of the enumerators
// Effects that are lists (wrenches, contacts, ...) have parameters of the list, and each `Item` has its own.
#pragma once

#include <dyntape/dynamics/model/model.h>

#include <any>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace dyntape::dynamics {

enum class Length { kJoints, kConfiguration };  // nv; nq

// The joints' values in the robot's file (nv).
using RobotValues = VectorX<double> (*)(const Model<double>&);

struct ParameterInfo {
  static constexpr double kAny = std::numeric_limits<double>::max();  // any finite value

  const char* name;
  const char* unit;  // for revolute and for prismatic joints, "N m/rad or N/m"
  const char* what;
  double least = -kAny, most = kAny;    // range of each entry, including both ends
  bool above = false;                   // true: `least` itself is excluded
  std::optional<double> fallback = {};  // default of each entry; a Vector3 keeps its initial value
  RobotValues of_robot = nullptr;       // the robot's file's values, if it has any
  Length length = Length::kJoints;      // of vectors
  const char* choices = nullptr;        // of enumerations, separated by blanks
};

// The values of the model, (nv); zero for joints of several columns; limits are infinite if there are none.
template <class T>
VectorX<T> model_armature(const Model<T>& model);
template <class T>
VectorX<T> model_damping(const Model<T>& model);
template <class T>
VectorX<T> model_friction(const Model<T>& model);
template <class T>
VectorX<double> model_effort(const Model<T>& model);

// An effect that is a list of items; items on frames have `body` and `X_BF`.
template <class Entry>
struct EffectList : std::vector<Entry> {
  using Item = Entry;
  using std::vector<Entry>::vector;

  EffectList() = default;
  EffectList(std::vector<Entry> all) : std::vector<Entry>(std::move(all)) {}  // NOLINT
  explicit operator bool() const { return !this->empty(); }
  void reset() { this->clear(); }
};

// Places an item at a frame of the model; ArgumentError, with the nearest name, if the frame does not exist.
template <class T, class Item>
void place_at_frame(const Model<T>& model, const std::string& frame, Item& item) {
  const Frame<T>& F = model.frames[model.frame_index(frame)];
  item.body = F.body;
  item.X_BF = F.X_BF;
}

namespace detail {

template <class S, class T>
S in_scalar(const T& x, const S*) {
  return static_cast<S>(x);
}
template <class S, class T>
Vector3<S> in_scalar(const Vector3<T>& x, const Vector3<S>*) {
  return x.template cast<S>();
}
template <class S, class T>
VectorX<S> in_scalar(const VectorX<T>& x, const VectorX<S>*) {
  return x.template cast<S>();
}
template <class Y, class X>
std::optional<Y> in_scalar(const std::optional<X>& x, const std::optional<Y>*) {
  return x ? std::optional<Y>(in_scalar(*x, static_cast<const Y*>(nullptr))) : std::nullopt;
}

// The type with T instead of S.
template <class Y, class S, class T>
struct Rescaled {
  using type = Y;
};
template <class S, class T>
struct Rescaled<S, S, T> {
  using type = T;
};
template <class S, class T>
struct Rescaled<Vector3<S>, S, T> {
  using type = Vector3<T>;
};
template <class S, class T>
struct Rescaled<VectorX<S>, S, T> {
  using type = VectorX<T>;
};
template <class Y, class S, class T>
struct Rescaled<std::optional<Y>, S, T> {
  using type = std::optional<typename Rescaled<Y, S, T>::type>;
};

// `from` is a pointer: the same type, if the value does not depend on the scalar.
template <class S, class T, class Y>
void assign_parameter(const std::any& from, Y& to) {
  using X = typename Rescaled<Y, S, T>::type;
  if (const auto* same = std::any_cast<const Y*>(&from)) {
    to = **same;
  } else if constexpr (!std::is_same_v<X, Y>) {
    to = in_scalar(*std::any_cast<const X*>(from), static_cast<const Y*>(nullptr));
  }
}

// Casts all parameters of `from`, of scalar T, to those of `to`, of scalar S.
template <class S, class T, class From, class To>
void cast_parameters(const From& from, To& to) {
  std::vector<std::any> values;
  From::visit_parameters(from, [&](const ParameterInfo&, const auto& value) { values.emplace_back(&value); });
  std::size_t k = 0;
  To::visit_parameters(
      to, [&](const ParameterInfo&, auto& value) { assign_parameter<S, T>(values[k++], value); });
}

template <class S, template <class> class E, class T>
E<S> cast_effect(const E<T>& effect) {
  E<S> result;
  cast_parameters<S, T>(effect, result);
  if constexpr (requires { effect.acts; }) result.acts = effect.acts;
  if constexpr (requires { effect.X_BF; }) {
    result.body = effect.body;
    result.X_BF = effect.X_BF.template cast<S>();
  }
  if constexpr (requires { typename E<T>::Item; }) {
    for (const auto& item : effect) result.push_back(cast_effect<S>(item));
  }
  return result;
}
template <class S, template <class> class E, class T>
std::optional<E<S>> cast_effect(const std::optional<E<T>>& effect) {
  return effect ? std::optional<E<S>>(cast_effect<S>(*effect)) : std::nullopt;
}

}  // namespace detail

}  // namespace dyntape::dynamics
