// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/scene/energy.h>

#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/algorithms/algorithms.h>

namespace dyntape {

struct RecordedEnergy {
  Function function;               // (q, v, drive) -> kinetic, stored, released, powers
  std::vector<std::string> flows;  // what the powers are of
};

namespace {

using dynamics::Effects;

// The power of what an effect stores: of its forces without velocity.
AD released_power(const dynamics::Model<AD>& model, dynamics::Data<AD>& data,
                  dynamics::EffectTorques<AD>& torques, const Effects<AD>& alone, const AD& power,
                  const VectorXad& q, const VectorXad& v) {
  if (!dynamics::stored_energy<AD>(model, data, alone, q).is_recorded()) return 0;
  if (alone.acting().gravity) return power;
  const VectorXad at_rest = VectorXad::Zero(v.size());
  return v.dot(dynamics::effect_torques<AD>(model, data, torques, alone, q, at_rest));
}

RecordedEnergy record_energy(const RobotScene& scene) {
  const std::vector<int> dofs = actuated_dofs(scene);
  const int nq = scene.model.nq, nv = scene.model.nv;
  std::vector<std::string> flows;
  Function function =
      record(scene.model.name + "_energy", std::size_t(nq + nv) + dofs.size(), [&](const VectorXad& x) {
        const dynamics::Model<AD> model = scene.model.cast<AD>();
        const Effects<AD> all = scene.effects.cast<AD>();
        dynamics::Data<AD> data(model);
        dynamics::EffectTorques<AD> torques(model);
        const VectorXad q = x.head(nq), v = x.segment(nq, nv);
        const VectorXad tau = torques_at(dofs, x.tail(Eigen::Index(dofs.size())), nv);
        std::vector<AD> y = {dynamics::kinetic_energy<AD>(model, data, q, v, all.acting()),
                             dynamics::stored_energy<AD>(model, data, all, q), 0, v.dot(tau)};
        flows = {"motors"};
        dynamics::for_each_effect_alone(all, [&](const char* name, const Effects<AD>& alone) {
          const AD power = dynamics::effect_power<AD>(model, data, torques, alone, q, v, tau);
          if (!power.is_recorded()) return;  // what only changes the inertia supplies nothing
          flows.push_back(name);
          y.push_back(power);
          y[2] += released_power(model, data, torques, alone, power, q, v);
        });
        // d/dt T = v . tau holds with them: M' = C + C^T.
        if (dynamics::Acting<AD> products = all.acting(); !products.coriolis) {
          products.coriolis = true, products.gravity = false;
          flows.emplace_back("velocity products, which are off");
          y.push_back(v.dot(dynamics::nonlinear_effects<AD>(model, data, q, v, products)));
        }
        return VectorXad(Eigen::Map<VectorXad>(y.data(), Eigen::Index(y.size())));
      });
  return {std::move(function), std::move(flows)};
}

CodegenOptions without_derivatives(CodegenOptions options) {
  options.order = Order::kValue;
  return options;
}

}  // namespace

EnergyMeter::EnergyMeter(const RobotScene& scene, const CodegenOptions& options)
    : EnergyMeter(record_energy(scene), scene, options) {}

EnergyMeter::EnergyMeter(const RecordedEnergy& recorded, const RobotScene& scene,
                         const CodegenOptions& options)
    : names_(recorded.flows),
      n_state_(scene.model.nq + scene.model.nv),
      function_(CompiledFunction::make(recorded.function, without_derivatives(options))),
      workspace_(function_),
      input_(Eigen::Index(function_.n_x())),
      output_(Eigen::Index(function_.n_y())) {
  energy_.power.resize(flows());
}

const Energy& EnergyMeter::at(const Eigen::VectorXd& x, const Eigen::VectorXd& drive) {
  input_ << x.head(n_state_), drive;
  function_.value(input_.data(), nullptr, output_.data(), workspace_);
  energy_.kinetic = output_[0];
  energy_.stored = output_[1];
  energy_.released = output_[2];
  energy_.power = output_.tail(flows());
  return energy_;
}

}  // namespace dyntape
