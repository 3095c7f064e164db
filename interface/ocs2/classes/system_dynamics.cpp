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

// --- Of any kind ------------------------------------------------------------------------------------------

vector_t SystemDynamicsBase::computeFlowMap(scalar_t time, const vector_t& state, const vector_t& input) {
  preComputation_->request(Request::Dynamics, time, state, input);
  return computeFlowMap(time, state, input, *preComputation_);
}

VectorFunctionLinearApproximation SystemDynamicsBase::linearApproximation(scalar_t time,
                                                                          const vector_t& state,
                                                                          const vector_t& input) {
  preComputation_->request(Request::Dynamics + Request::Approximation, time, state, input);
  return linearApproximation(time, state, input, *preComputation_);
}

vector_t SystemDynamicsBase::computeJumpMap(scalar_t time, const vector_t& state) {
  preComputation_->requestPreJump(Request::Dynamics, time, state);
  return computeJumpMap(time, state, *preComputation_);
}

VectorFunctionLinearApproximation SystemDynamicsBase::jumpMapLinearApproximation(scalar_t time,
                                                                                 const vector_t& state) {
  preComputation_->requestPreJump(Request::Dynamics + Request::Approximation, time, state);
  return jumpMapLinearApproximation(time, state, *preComputation_);
}

vector_t SystemDynamicsBase::computeJumpMap(scalar_t, const vector_t& state, const PreComputation&) {
  return state;
}

vector_t SystemDynamicsBase::computeGuardSurfaces(scalar_t, const vector_t&) {
  return vector_t::Constant(1, -1);
}

VectorFunctionLinearApproximation SystemDynamicsBase::jumpMapLinearApproximation(
    scalar_t time, const vector_t& state, const PreComputation& preComp) {
  VectorFunctionLinearApproximation a;
  a.f = computeJumpMap(time, state, preComp);
  a.dfdx = matrix_t::Identity(state.size(), state.size());
  a.dfdu = matrix_t::Zero(a.f.size(), 0);
  return a;
}

VectorFunctionLinearApproximation SystemDynamicsBase::guardSurfacesLinearApproximation(
    scalar_t time, const vector_t& state, const vector_t& input) {
  VectorFunctionLinearApproximation a;
  a.f = computeGuardSurfaces(time, state);
  a.dfdx = matrix_t::Zero(a.f.size(), state.size());
  a.dfdu = matrix_t::Zero(a.f.size(), input.size());
  return a;
}

vector_t SystemDynamicsBase::flowMapDerivativeTime(scalar_t, const vector_t& state, const vector_t&) {
  return vector_t::Zero(state.size());
}
vector_t SystemDynamicsBase::jumpMapDerivativeTime(scalar_t, const vector_t& state, const vector_t&) {
  return vector_t::Zero(state.size());
}
vector_t SystemDynamicsBase::guardSurfacesDerivativeTime(scalar_t time, const vector_t& state,
                                                         const vector_t&) {
  return vector_t::Zero(computeGuardSurfaces(time, state).size());
}

// --- Recorded ---------------------------------------------------------------------------------------------

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
  return detail::linear(flow_map_, kDynamics, getFlowMapParameters(time, preComp), time, state, input);
}

VectorFunctionLinearApproximation SystemDynamicsBaseAD::jumpMapLinearApproximation(
    scalar_t time, const vector_t& state, const PreComputation& preComp) {
  auto a = detail::linear(jump_map(), kDynamics, getJumpMapParameters(time, preComp), time, state);
  a.dfdu = matrix_t::Zero(a.f.size(), 0);
  return a;
}

VectorFunctionLinearApproximation SystemDynamicsBaseAD::guardSurfacesLinearApproximation(
    scalar_t time, const vector_t& state, const vector_t& input) {
  auto a = detail::linear(guard_surfaces(), kDynamics, getGuardSurfacesParameters(time), time, state);
  a.dfdu = matrix_t::Zero(a.f.size(), input.size());
  return a;
}

vector_t SystemDynamicsBaseAD::flowMapDerivativeTime(scalar_t time, const vector_t& state,
                                                     const vector_t& input) {
  preComputation().request(Request::Dynamics + Request::Approximation, time, state, input);
  return by_time(flow_map_, time, state, input, getFlowMapParameters(time, preComputation()));
}

vector_t SystemDynamicsBaseAD::jumpMapDerivativeTime(scalar_t time, const vector_t& state, const vector_t&) {
  preComputation().requestPreJump(Request::Dynamics + Request::Approximation, time, state);
  return by_time(jump_map(), time, state, {}, getJumpMapParameters(time, preComputation()));
}

vector_t SystemDynamicsBaseAD::guardSurfacesDerivativeTime(scalar_t time, const vector_t& state,
                                                           const vector_t&) {
  return by_time(guard_surfaces(), time, state, {}, getGuardSurfacesParameters(time));
}

}  // namespace dyntape::ocs2
