// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/effects/check.h>

#include <algorithm>

#include <dyntape/autodiff/error.h>

#include <sstream>

namespace dyntape::dynamics {
namespace {

using RobotModel = Model<double>;

std::string as_text(double x) {
  std::ostringstream text;
  text.precision(12);
  text << x;
  return text.str();
}

std::string range_of(const ParameterInfo& info) {
  const bool has_most = info.most < ParameterInfo::kAny;
  if (info.least <= -ParameterInfo::kAny && !has_most) return "a finite number";
  std::string text = (info.above ? "above " : "at least ") + as_text(info.least);
  if (has_most) text += " and at most " + as_text(info.most);
  return text;
}

const Joint<double>& joint_of(const RobotModel& model, int entry, Length length) {
  const bool in_q = length == Length::kConfiguration;
  const auto holds = [&](const Joint<double>& joint) {
    return entry < (in_q ? joint.idx_q + nq(joint.type) : joint.idx_v + nv(joint.type));
  };
  return *std::find_if(model.joints.begin(), model.joints.end(), holds);
}

// The values of one effect, or of one item of its list.
struct Checker {
  const RobotModel& model;
  std::string where;

  [[noreturn]] void fail(const std::string& what) const {
    throw ArgumentError("effects: " + where + ": " + what);
  }

  void check_number(const ParameterInfo& info, double x, const std::string& of = "") const {
    const bool inside = info.above ? x > info.least : x >= info.least;
    if (inside && x <= info.most) return;
    fail(info.name + of + " is " + as_text(x) + " " + info.unit + ", expected " + range_of(info));
  }
  void operator()(const ParameterInfo& info, double x) const { check_number(info, x); }
  void operator()(const ParameterInfo& info, const Vector3<double>& x) const {
    for (int k = 0; k < 3; ++k) check_number(info, x[k], std::string(" along ") + "xyz"[k]);
  }
  void operator()(const ParameterInfo& info, const Eigen::VectorXd& x) const {
    const int expected = info.length == Length::kConfiguration ? model.nq : model.nv;
    if (x.size() != expected) {
      fail(std::string(info.name) + " has " + std::to_string(x.size()) + " entries, expected " +
           std::to_string(expected) + " for model \"" + model.name + "\"");
    }
    for (int k = 0; k < expected; ++k) {
      const Joint<double>& joint = joint_of(model, k, info.length);
      // Joints of several columns, a floating base among them, have a zero where no value is given.
      const bool is_said = is_single(joint.type) || x[k] != 0;
      if (is_said) check_number(info, x[k], " of joint \"" + joint.name + "\"");
    }
  }
  template <class X>
  void operator()(const ParameterInfo& info, const std::optional<X>& x) const {
    if (x) (*this)(info, *x);
  }
  template <class E>
  requires std::is_enum_v<E>
  void operator()(const ParameterInfo&, E) const {}

  template <class E>
  void check_effect(const E& effect) const {
    E::visit_parameters(effect, *this);
    if constexpr (requires { effect.ground; }) {
      if (effect.ground.kind == GroundKind::kPlane && effect.ground.normal.isZero(0))
        fail("the normal of its ground is zero, expected any other length");
    }
    if constexpr (requires { effect.missing(); }) {
      if (const char* name = effect.missing())
        fail(std::string(name) + " is not given, expected with the others");
    }
    if constexpr (requires { effect.X_BF; }) {
      if (effect.body < -1 || effect.body >= model.njoints()) {
        fail("acts on body " + std::to_string(effect.body) + ", expected one of the " +
             std::to_string(model.njoints()) + " of model \"" + model.name + "\", or -1 for the world");
      }
    }
  }
};

}  // namespace

void check(const Model<double>& model, const Effects<double>& effects) {
  for_each_chosen_effect(effects, [&]<class E>(const E& effect) {
    Checker{model, E::kName}.check_effect(effect);
    if constexpr (requires { typename E::Item; }) {
      int k = 0;
      for (const auto& item : effect) {
        Checker{model, std::string(E::kItem) + " " + std::to_string(k++) + " of " + E::kName}.check_effect(
            item);
      }
    }
  });
}

}  // namespace dyntape::dynamics
