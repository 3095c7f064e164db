// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/ocs2/classes/constraints.h>
#include <dyntape/interface/ocs2/classes/system_dynamics.h>

namespace dyntape::ocs2 {
namespace {

constexpr const char* kDynamics = "SystemDynamicsBaseAD";

vector_t value_of(const detail::TermModel& term, scalar_t time, const vector_t& state, const vector_t& input,
                  const vector_t& p) {
  return term.of(kDynamics).getFunctionValue(term.variables(kDynamics, time, state, input), p);
}

vector_t by_time(const detail::TermModel& term, scalar_t time, const vector_t& state, const vector_t& input,
                 const vector_t& p) {
  return term.of(kDynamics).getJacobian(term.variables(kDynamics, time, state, input), p).col(0);
}

}  // namespace

void SystemDynamicsBaseAD::initialize(std::size_t stateDim, std::size_t inputDim,
                                      const std::string& modelName, const std::string& modelFolder,
                                      bool recompileLibraries, bool verbose, const char* file, int line) {
  flow_map_.make([this](ad_scalar_t t, const ad_vector_t& x, const ad_vector_t& u,
                        const ad_vector_t& p) { return systemFlowMap(t, x, u, p); },
                 {stateDim, inputDim, getNumFlowMapParameters()}, modelName + "_flow_map", modelFolder,
                 CppAdInterface::ApproximationOrder::First, recompileLibraries, verbose, {file, line});
  how_ = {modelName, modelFolder, recompileLibraries, verbose, {file, line}};
}

const detail::TermModel& SystemDynamicsBaseAD::jump_map() {
  flow_map_.of(kDynamics);
  if (!jump_map_.is_made()) {
    jump_map_.make([this](ad_scalar_t t, const ad_vector_t& x, const ad_vector_t&,
                          const ad_vector_t& p) { return systemJumpMap(t, x, p); },
                   {flow_map_.sizes().state, 0, getNumJumpMapParameters()}, how_.name + "_jump_map",
                   how_.folder, CppAdInterface::ApproximationOrder::First, how_.recompile, how_.verbose,
                   how_.place);
  }
  return jump_map_;
}

const detail::TermModel& SystemDynamicsBaseAD::guard_surfaces() {
  flow_map_.of(kDynamics);
  if (!guard_surfaces_.is_made()) {
    guard_surfaces_.make([this](ad_scalar_t t, const ad_vector_t& x, const ad_vector_t&,
                                const ad_vector_t& p) { return systemGuardSurfaces(t, x, p); },
                         {flow_map_.sizes().state, 0, getNumGuardSurfacesParameters()},
                         how_.name + "_guard_surfaces", how_.folder,
                         CppAdInterface::ApproximationOrder::First, how_.recompile, how_.verbose, how_.place);
  }
  return guard_surfaces_;
}

vector_t SystemDynamicsBaseAD::computeFlowMap(scalar_t time, const vector_t& state, const vector_t& input,
                                              const PreComputation& preComp) {
  return value_of(flow_map_, time, state, input, getFlowMapParameters(time, preComp));
}

vector_t SystemDynamicsBaseAD::computeJumpMap(scalar_t time, const vector_t& state,
                                              const PreComputation& preComp) {
  return value_of(jump_map(), time, state, {}, getJumpMapParameters(time, preComp));
}

vector_t SystemDynamicsBaseAD::computeGuardSurfaces(scalar_t time, const vector_t& state) {
  return value_of(guard_surfaces(), time, state, {}, getGuardSurfacesParameters(time));
}

VectorFunctionLinearApproximation SystemDynamicsBaseAD::linearApproximation(scalar_t time,
                                                                            const vector_t& state,
                                                                            const vector_t& input,
                                                                            const PreComputation& preComp) {
  return detail::linear(flow_map_, kDynamics, time, state, input, getFlowMapParameters(time, preComp));
}

VectorFunctionLinearApproximation SystemDynamicsBaseAD::jumpMapLinearApproximation(
    scalar_t time, const vector_t& state, const PreComputation& preComp) {
  return detail::linear(jump_map(), kDynamics, time, state, {}, getJumpMapParameters(time, preComp));
}

VectorFunctionLinearApproximation SystemDynamicsBaseAD::guardSurfacesLinearApproximation(
    scalar_t time, const vector_t& state, const vector_t& input) {
  auto a = detail::linear(guard_surfaces(), kDynamics, time, state, {}, getGuardSurfacesParameters(time));
  a.dfdu = matrix_t::Zero(a.f.size(), input.size());
  return a;
}

vector_t SystemDynamicsBaseAD::flowMapDerivativeTime(scalar_t time, const vector_t& state,
                                                     const vector_t& input) {
  return by_time(flow_map_, time, state, input, getFlowMapParameters(time, PreComputation()));
}

vector_t SystemDynamicsBaseAD::jumpMapDerivativeTime(scalar_t time, const vector_t& state, const vector_t&) {
  return by_time(jump_map(), time, state, {}, getJumpMapParameters(time, PreComputation()));
}

vector_t SystemDynamicsBaseAD::guardSurfacesDerivativeTime(scalar_t time, const vector_t& state,
                                                           const vector_t&) {
  return by_time(guard_surfaces(), time, state, {}, getGuardSurfacesParameters(time));
}

}  // namespace dyntape::ocs2
