// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/scene/energy.h>

#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/algorithms/algorithms.h>

namespace dyntape {

namespace {

using dynamics::Effects;

// The scene with one effect at a time, of those that add torques.
template <class Visit>
void for_each_alone(const Effects<double>& effects, const Visit& visit) {
  Effects<double> left = effects;
  dynamics::for_each_effect(left, [&](auto& chosen) {
    if (!chosen) return;
    Effects<double> alone;
    dynamics::for_each_effect(alone, [](auto& effect) { effect.reset(); });
    dynamics::for_each_effect(alone, [&](auto& effect) {
      if constexpr (std::is_same_v<decltype(effect), decltype(chosen)>) effect = chosen;
    });
    if (dynamics::adds_torques(alone)) visit(dynamics::effect_name(chosen), alone);
  });
}

std::vector<std::string> flows_of(const RobotScene& scene) {
  std::vector<std::string> names = {"motors"};
  for_each_alone(scene.effects, [&](const char* name, const auto&) { names.push_back(name); });
  return names;
}

Function record_energy(const RobotScene& scene, std::size_t flows) {
  const std::vector<int> dofs = actuated_dofs(scene);
  const int nq = scene.model.nq, nv = scene.model.nv;
  return record(scene.model.name + "_energy", std::size_t(nq + nv) + dofs.size(), [&](const VectorXad& x) {
    const dynamics::Model<AD> model = scene.model.cast<AD>();
    dynamics::Data<AD> data(model);
    dynamics::EffectTorques<AD> torques(model);
    const VectorXad q = x.head(nq), v = x.segment(nq, nv);
    const Effects<AD> all = scene.effects.cast<AD>();
    VectorXad tau = VectorXad::Constant(nv, AD(0));
    for (std::size_t k = 0; k < dofs.size(); ++k) tau[dofs[k]] = x[nq + nv + Eigen::Index(k)];
    VectorXad y(2 + Eigen::Index(flows));
    y[0] = dynamics::kinetic_energy<AD>(model, data, q, v, all.acting());
    y[1] = all.gravity ? dynamics::potential_energy<AD>(model, data, q) : AD(0);
    y[2] = v.dot(tau);
    Eigen::Index k = 3;
    for_each_alone(scene.effects, [&](const char*, const Effects<double>& alone) {
      const Effects<AD> effect = alone.cast<AD>();
      y[k++] = v.dot(dynamics::effect_torques<AD>(model, data, torques, effect, q, v));
    });
    return y;
  });
}

CodegenOptions values_only(CodegenOptions options) {
  options.order = Order::kValue;
  return options;
}

}  // namespace

EnergyMeter::EnergyMeter(const RobotScene& scene, const CodegenOptions& options)
    : names_(flows_of(scene)),
      n_state_(scene.model.nq + scene.model.nv),
      function_(CompiledFunction::make(record_energy(scene, names_.size()), values_only(options))),
      workspace_(function_),
      input_(Eigen::Index(function_.n_x())),
      output_(Eigen::Index(function_.n_y())) {
  energy_.power.resize(flows());
}

const Energy& EnergyMeter::at(const Eigen::VectorXd& x, const Eigen::VectorXd& drive) {
  input_ << x.head(n_state_), drive;
  function_.value(input_.data(), nullptr, output_.data(), workspace_);
  energy_.kinetic = output_[0];
  energy_.potential = output_[1];
  energy_.power = output_.tail(flows());
  return energy_;
}

}  // namespace dyntape
