// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/system/energy.h>

#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/model/configuration.h>

namespace dyntape {

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

// The state and what drives it with all else than a mechanism at rest, where its joints are neutral.
struct AloneState {
  VectorXad q, v, tau;
};
AloneState alone_in(const RobotScene& scene, const std::vector<int>& joints, const VectorXad& q,
                    const VectorXad& v, const VectorXad& tau) {
  const auto& model = scene.model;
  if (int(joints.size()) == model.njoints()) return {q, v, tau};
  AloneState alone{dynamics::neutral<double>(model).cast<AD>(), VectorXad::Zero(model.nv),
                   VectorXad::Zero(model.nv)};
  for (const int i : joints) {
    const auto& joint = model.joints[std::size_t(i)];
    const int n_q = dynamics::nq(joint.type), n_v = dynamics::nv(joint.type);
    alone.q.segment(joint.idx_q, n_q) = q.segment(joint.idx_q, n_q);
    alone.v.segment(joint.idx_v, n_v) = v.segment(joint.idx_v, n_v);
    alone.tau.segment(joint.idx_v, n_v) = tau.segment(joint.idx_v, n_v);
  }
  return alone;
}

// Powers of motors and effects, their names with the first of them, and last what is released.
class PowerRecorder {
 public:
  PowerRecorder(const dynamics::Model<AD>& model, const Effects<AD>& all)
      : model_(model), all_(all), data_(model), torques_(model) {}

  std::vector<std::string> names() const {
    std::vector<std::string> names = {"motors"};
    for (const auto& [name, is_there] : suppliers_) {
      if (is_there) names.push_back(name);
    }
    return names;
  }

  // Of every effect, those that supply nothing too.
  std::vector<AD> operator()(const AloneState& s) {
    std::vector<AD> powers = {s.v.dot(s.tau)};
    AD released = 0;
    std::size_t k = 0;
    const auto note = [&](const char* name, const AD& power) {
      if (k == suppliers_.size()) suppliers_.emplace_back(name, false);
      suppliers_[k++].second |= power.is_recorded();  // what only changes the inertia supplies nothing
      powers.push_back(power);
    };
    dynamics::for_each_effect_alone(all_, [&](const char* name, const Effects<AD>& alone) {
      const AD power = dynamics::effect_power<AD>(model_, data_, torques_, alone, s.q, s.v, s.tau);
      note(name, power);
      if (power.is_recorded()) released += released_power(model_, data_, torques_, alone, power, s.q, s.v);
    });
    // d/dt T = v . tau holds with them: M' = C + C^T.
    if (dynamics::DynamicsTerms<AD> products = all_.acting(); !products.coriolis) {
      products.coriolis = true, products.gravity = false;
      note("velocity products, which are off",
           s.v.dot(dynamics::nonlinear_effects<AD>(model_, data_, s.q, s.v, products)));
    }
    powers.push_back(released);
    return powers;
  }

  // Without those that supply nothing.
  void append(const std::vector<AD>& powers, std::vector<AD>& y) const {
    y.push_back(powers.front());
    for (std::size_t k = 0; k < suppliers_.size(); ++k) {
      if (suppliers_[k].second) y.push_back(powers[k + 1]);
    }
    y.push_back(powers.back());
  }

 private:
  const dynamics::Model<AD>& model_;
  const Effects<AD>& all_;
  dynamics::Data<AD> data_;
  dynamics::EffectTorques<AD> torques_;
  std::vector<std::pair<const char*, bool>> suppliers_;
};

// What an EnergyLayout describes, of the motors' torques tau (nv).
VectorXad energies_of(const RobotScene& scene, const RecordedScene& now, const VectorXad& q,
                      const VectorXad& v, const VectorXad& tau, EnergyLayout& layout) {
  const auto& [model, effects] = now;
  dynamics::Data<AD> data(model);
  PowerRecorder powers_of(model, effects);
  std::vector<AD> y = {dynamics::kinetic_energy<AD>(model, data, q, v, effects.acting()),
                       dynamics::stored_energy<AD>(model, data, effects, q)};
  std::vector<std::vector<AD>> powers;
  layout.mechanisms = mechanisms_of(scene);
  for (const Mechanism& mechanism : layout.mechanisms) {
    const AloneState alone = alone_in(scene, mechanism.joints, q, v, tau);
    y.push_back(dynamics::kinetic_energy<AD>(model, data, alone.q, alone.v, effects.acting()));
    y.push_back(dynamics::stored_energy<AD>(model, data, effects, alone.q));
    powers.push_back(powers_of(alone));
  }
  for (const std::vector<AD>& each : powers) powers_of.append(each, y);
  layout.flows = powers_of.names();
  return Eigen::Map<VectorXad>(y.data(), Eigen::Index(y.size()));
}

Function record_energy(const RobotScene& scene, int n_p, const SceneEdit& edit, EnergyLayout& layout) {
  const std::vector<int> dofs = actuated_dofs(scene);
  const int nq = scene.model.nq, nv = scene.model.nv, n_u = int(dofs.size());
  const auto lagged = (scene.lag.array() > 0).count();
  return record(scene.model.name + "_energy", std::size_t(nq + nv + lagged), std::size_t(2 + n_u + n_p),
                [&](const VectorXad& x, const VectorXad& arguments) {
                  RecordedScene now = recorded(scene);
                  if (edit) edit(now, arguments.tail(n_p));
                  VectorXad drive = arguments.segment(2, n_u);
                  for (Eigen::Index k = 0, m = nq + nv; k < scene.lag.size(); ++k) {
                    if (scene.lag[k] > 0) drive[k] = x[m++];
                  }
                  return energies_of(scene, now, x.head(nq), x.segment(nq, nv), torques_at(dofs, drive, nv),
                                     layout);
                });
}

CodegenOptions without_derivatives(CodegenOptions options) {
  options.order = Order::kValue;
  return options;
}

}  // namespace

EnergyMeter::EnergyMeter(const RobotScene& scene, const CodegenOptions& options, int n_p,
                         const SceneEdit& edit)
    : function_(
          CompiledFunction::make(record_energy(scene, n_p, edit, layout_), without_derivatives(options))),
      workspace_(function_),
      arguments_(Eigen::VectorXd::Zero(Eigen::Index(function_.n_p()))),
      output_(Eigen::Index(function_.n_y())) {}

EnergyMeter::EnergyMeter(const EnergyMeter& other)
    : layout_(other.layout_),
      function_(other.function_),
      workspace_(function_),
      arguments_(other.arguments_),
      output_(other.output_) {}

const Energy& EnergyMeter::at(const Eigen::VectorXd& x, const Eigen::VectorXd& u, const Eigen::VectorXd& p) {
  arguments_.segment(2, u.size()) = u;
  arguments_.tail(p.size()) = p;
  function_.value(x.data(), arguments_.data(), output_.data(), workspace_);
  layout_.read(output_.data(), 1, energy_);
  return energy_;
}

void EnergyMeter::side_by_side(std::size_t count, std::size_t width, const double* x, const double* arguments,
                               double* y, std::uint32_t* status) {
  (void)function_.run(
      Order::kValue,
      {.count = count, .x = x, .p = arguments, .y = y, .status = status, .side_by_side = width}, workspace_);
}

void EnergyLayout::read(const double* y, Eigen::Index stride, Energy& energy) const {
  const auto n = Eigen::Index(mechanisms.size()), rows = Eigen::Index(flows.size()) + 1;
  energy.kinetic_of.resize(n), energy.stored_of.resize(n), energy.power.resize(rows, n);
  energy.kinetic = y[0], energy.stored = y[stride];
  for (Eigen::Index m = 0; m < n; ++m) {
    energy.kinetic_of[m] = y[(2 + 2 * m) * stride], energy.stored_of[m] = y[(3 + 2 * m) * stride];
    for (Eigen::Index i = 0; i < rows; ++i) energy.power(i, m) = y[(2 + 2 * n + rows * m + i) * stride];
  }
}

}  // namespace dyntape
