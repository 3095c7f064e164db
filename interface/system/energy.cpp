// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/system/energy.h>

#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/model/configuration.h>

namespace dyntape {

namespace {

using dynamics::Effects;

// The state, what drives it, and the velocity that powers are along.
struct MeterState {
  VectorXad q, v, tau, along;
};

// With all else than a mechanism at rest, where its joints are neutral.
MeterState alone_in(const RobotScene& scene, const std::vector<int>& joints, const MeterState& all) {
  const auto& model = scene.model;
  if (int(joints.size()) == model.njoints()) return all;
  const VectorXad at_rest = VectorXad::Zero(model.nv);
  MeterState alone{dynamics::neutral<double>(model).cast<AD>(), at_rest, at_rest, at_rest};
  for (const int i : joints) {
    const auto& joint = model.joints[std::size_t(i)];
    const int n_q = dynamics::nq(joint.type), n_v = dynamics::nv(joint.type);
    alone.q.segment(joint.idx_q, n_q) = all.q.segment(joint.idx_q, n_q);
    for (auto part : {&MeterState::v, &MeterState::tau, &MeterState::along})
      (alone.*part).segment(joint.idx_v, n_v) = (all.*part).segment(joint.idx_v, n_v);
  }
  return alone;
}

// Without an operation where both are the same.
AD difference(const AD& a, const AD& b) { return a.id() == b.id() && a.is_recorded() ? AD(0) : a - b; }

// Of one flow.
struct FlowValues {
  AD power = 0, unstored = 0, stored = 0;
};

// Values of motors and effects, and their names with the motors first.
class FlowRecorder {
 public:
  FlowRecorder(const dynamics::Model<AD>& model, const Effects<AD>& all)
      : model_(model), all_(all), data_(model), torques_(model) {}

  std::vector<std::string> names() const {
    std::vector<std::string> names = {"motors"};
    for (const auto& [name, is_there] : suppliers_) {
      if (is_there) names.push_back(name);
    }
    return names;
  }

  // Of every effect, those that supply nothing too.
  std::vector<FlowValues> operator()(const MeterState& s) {
    const AD of_motors = s.along.dot(s.tau);
    std::vector<FlowValues> flows = {{of_motors, of_motors, 0}};
    std::size_t k = 0;
    const auto note = [&](const char* name, const FlowValues& flow) {
      if (k == suppliers_.size()) suppliers_.emplace_back(name, false);
      suppliers_[k++].second |= flow.power.is_recorded();  // what only changes the inertia supplies nothing
      flows.push_back(flow);
    };
    dynamics::for_each_effect_alone(
        all_, [&](const char* name, const Effects<AD>& alone) { note(name, of_effect(alone, s)); });
    // d/dt T = v . tau holds with them: M' = C + C^T.
    if (dynamics::DynamicsTerms<AD> products = all_.acting(); !products.coriolis) {
      products.coriolis = true, products.gravity = false;
      const AD power = s.along.dot(dynamics::nonlinear_effects<AD>(model_, data_, s.q, s.v, products));
      note("velocity products, which are off", {power, power, 0});
    }
    return flows;
  }

  // Without those that supply nothing.
  void append(const std::vector<FlowValues>& flows, AD FlowValues::*which, std::vector<AD>& y) const {
    y.push_back(flows.front().*which);
    for (std::size_t k = 0; k < suppliers_.size(); ++k) {
      if (suppliers_[k].second) y.push_back(flows[k + 1].*which);
    }
  }

 private:
  FlowValues of_effect(const Effects<AD>& alone, const MeterState& s) {
    FlowValues flow;
    flow.stored = dynamics::stored_energy<AD>(model_, data_, alone, s.q);
    AD of_potential = 0;
    if (dynamics::DynamicsTerms<AD> weight = alone.acting(); weight.gravity) {
      weight.coriolis = false, weight.added = {};
      of_potential = -s.along.dot(dynamics::nonlinear_effects<AD>(model_, data_, s.q, s.v, weight));
    } else if (flow.stored.is_recorded()) {  // forces without velocity
      const VectorXad at_rest = VectorXad::Zero(s.v.size());
      of_potential = s.along.dot(dynamics::effect_torques<AD>(model_, data_, torques_, alone, s.q, at_rest));
    }
    AD others = s.along.dot(dynamics::effect_torques<AD>(model_, data_, torques_, alone, s.q, s.v));
    const VectorXad driven = dynamics::driving_torques<AD>(model_, torques_, alone, s.tau);
    for (Eigen::Index i = 0; i < driven.size(); ++i) others += s.along[i] * difference(driven[i], s.tau[i]);
    const bool is_weight = alone.acting().gravity;
    flow.power = is_weight ? others + of_potential : others;
    flow.unstored = is_weight ? others : difference(others, of_potential);
    return flow;
  }

  const dynamics::Model<AD>& model_;
  const Effects<AD>& all_;
  dynamics::Data<AD> data_;
  dynamics::EffectTorques<AD> torques_;
  std::vector<std::pair<const char*, bool>> suppliers_;
};

// What an EnergyLayout describes.
VectorXad energies_of(const RobotScene& scene, const RecordedScene& now, const MeterState& all,
                      EnergyLayout& layout) {
  const auto& [model, effects] = now;
  dynamics::Data<AD> data(model);
  FlowRecorder flows_of(model, effects);
  std::vector<AD> y = {dynamics::kinetic_energy<AD>(model, data, all.q, all.v, effects.acting()),
                       dynamics::stored_energy<AD>(model, data, effects, all.q)};
  std::vector<std::vector<FlowValues>> flows;
  layout.mechanisms = mechanisms_of(scene);
  for (const Mechanism& mechanism : layout.mechanisms) {
    const MeterState alone = alone_in(scene, mechanism.joints, all);
    y.push_back(dynamics::kinetic_energy<AD>(model, data, alone.q, alone.v, effects.acting()));
    flows.push_back(flows_of(alone));
  }
  for (auto which : {&FlowValues::power, &FlowValues::unstored, &FlowValues::stored}) {
    for (const std::vector<FlowValues>& each : flows) flows_of.append(each, which, y);
  }
  layout.flows = flows_of.names();
  return Eigen::Map<VectorXad>(y.data(), Eigen::Index(y.size()));
}

Function record_energy(const RobotScene& scene, int n_p, const SceneEdit& edit, EnergyLayout& layout) {
  const std::vector<int> dofs = actuated_dofs(scene);
  const int nq = scene.model.nq, nv = scene.model.nv, n_u = int(dofs.size());
  const auto lagged = (scene.lag.array() > 0).count();
  return record(scene.model.name + "_energy", std::size_t(nq + nv + lagged), std::size_t(2 + n_u + n_p + nv),
                [&](const VectorXad& x, const VectorXad& arguments) {
                  RecordedScene now = recorded(scene);
                  if (edit) edit(now, arguments.segment(2 + n_u, n_p));
                  VectorXad drive = arguments.segment(2, n_u);
                  for (Eigen::Index k = 0, m = nq + nv; k < scene.lag.size(); ++k) {
                    if (scene.lag[k] > 0) drive[k] = x[m++];
                  }
                  return energies_of(
                      scene, now,
                      {x.head(nq), x.segment(nq, nv), torques_at(dofs, drive, nv), arguments.tail(nv)},
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
      nq_(scene.model.nq),
      nv_(scene.model.nv),
      arguments_(Eigen::VectorXd::Zero(Eigen::Index(function_.n_p()))),
      output_(Eigen::Index(function_.n_y())) {}

EnergyMeter::EnergyMeter(const EnergyMeter& other)
    : layout_(other.layout_),
      function_(other.function_),
      workspace_(function_),
      nq_(other.nq_),
      nv_(other.nv_),
      arguments_(other.arguments_),
      output_(other.output_) {}

const Energy& EnergyMeter::at(const Eigen::VectorXd& x, const Eigen::VectorXd& u, const Eigen::VectorXd& p) {
  return along(x.segment(nq_, nv_), x, u, p);
}

const Energy& EnergyMeter::along(const Eigen::VectorXd& velocity, const Eigen::VectorXd& x,
                                 const Eigen::VectorXd& u, const Eigen::VectorXd& p) {
  arguments_.segment(2, u.size()) = u;
  arguments_.segment(2 + u.size(), p.size()) = p;
  arguments_.tail(nv_) = velocity;
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
  const auto n = Eigen::Index(mechanisms.size()), rows = Eigen::Index(flows.size());
  energy.kinetic = y[0], energy.stored = y[stride];
  y += 2 * stride;
  energy.kinetic_of.resize(n);
  for (Eigen::Index m = 0; m < n; ++m, y += stride) energy.kinetic_of[m] = *y;
  for (Eigen::MatrixXd* values : {&energy.power, &energy.unstored, &energy.stored_of}) {
    values->resize(rows, n);
    for (double& value : values->reshaped()) value = *y, y += stride;
  }
}

}  // namespace dyntape
