// SPDX-License-Identifier: BSD-3-Clause
//
// The hash of what is recorded of a small robot with each set of effects, a line a set: keys, content hash, operations.
// Built once with all effects and once without each (-DDYNTAPE_WITHOUT_DRAG, effects.def), the lines must be the same:
// an effect that a scene does not call for leaves nothing (effect_absence.sh).  Effects are turned on by what they say of
// their own values, so that none is named here.
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/contact/constraints.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/dynamics/effects/detail/effects.hxx>

using namespace dyntape;
using namespace dyntape::dynamics;

namespace {

// Within its range, and its own for each parameter.
struct Strengthen {
  const Model<double>& model;
  double next = 0.37;

  double within(const ParameterInfo& info) {
    next += 0.01;
    return info.least >= 0 ? next : -next;
  }
  void operator()(const ParameterInfo& info, double& value) { value = within(info); }
  void operator()(const ParameterInfo& info, Vector3<double>& value) { value = {within(info), 0.2, 0.9}; }
  void operator()(const ParameterInfo& info, VectorX<double>& value) {
    value = VectorX<double>::Constant(info.length == Length::kJoints ? model.nv : model.nq, within(info));
  }
  template <class X>
  void operator()(const ParameterInfo& info, std::optional<X>& value) {
    value.emplace();
    (*this)(info, *value);
  }
  template <class E>
  requires std::is_enum_v<E>
  void operator()(const ParameterInfo&, E&) {}
};

template <class E>
void fill(const Model<double>& model, E& effect) {
  E::visit_parameters(effect, Strengthen{model});
  if constexpr (requires { typename E::Item; }) {
    typename E::Item item;
    fill(model, item);
    if constexpr (requires { item.X_BF; }) place_at_frame(model, model.frames.back().name, item);
    effect.push_back(item);
  }
}
template <class E>
void turn_on(const Model<double>& model, E& effect) {
  if constexpr (requires { effect.acts; }) effect.acts = true;
  fill(model, effect);
}
template <class E>
void turn_on(const Model<double>& model, std::optional<E>& effect) {
  effect.emplace();
  fill(model, *effect);
}

struct Line {
  std::string hash;
  std::size_t operations;
};

Line record_with(const Model<double>& model, const Effects<double>& effects) {
  const int nq = model.nq, nv = model.nv;
  const Function f = record("dynamics", std::size_t(nq + 2 * nv), [&](const VectorXad& x) {
    const Model<AD> taped = model.cast<AD>();
    const Effects<AD> taped_effects = effects.cast<AD>();
    Data<AD> data(taped);
    EffectTorques<AD> torques(taped);
    return VectorXad(
        forward_dynamics<AD>(taped, data, torques, taped_effects, x.head(nq), x.segment(nq, nv), x.tail(nv)));
  });
  return {content_hash(f, 1), total_operations(f)};
}

}  // namespace

int main(int argc, char** argv) {
  const Model<double> model = load_urdf(argc > 1 ? argv[1] : "config/robots/double_pendulum.urdf");
  std::vector<std::string> keys;
  std::vector<bool> is_list;
  Effects<double> none;
  for_each_effect(none, [&](auto& effect) {
    effect.reset();
    keys.push_back(effect_key(effect));
    is_list.push_back(requires { typename std::decay_t<decltype(effect)>::Item; });
  });
  for (unsigned long set = 0; set < 1ul << keys.size(); ++set) {
    std::string name;
    std::size_t chosen = 0, lists = 0;
    for (std::size_t k = 0; k < keys.size(); ++k) {
      if (!(set >> k & 1)) continue;
      name += " " + keys[k];
      ++chosen;
      lists += is_list[k];
    }
    // All sets of the effects at joints; the others alone and in pairs.
    if (lists > 0 && chosen > 2) continue;
    Effects<double> effects = none;
    std::size_t k = 0;
    for_each_effect(effects, [&](auto& effect) {
      if (set >> k++ & 1) turn_on(model, effect);
    });
    const Line line = record_with(model, effects);
    std::printf("%s %zu%s\n", line.hash.c_str(), line.operations, name.c_str());
  }
}
