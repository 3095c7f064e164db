// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/ocs2/classes/constraints.h>

#include <dyntape/autodiff/error.h>

namespace dyntape::ocs2 {
namespace {

using ApproximationOrder = CppAdInterface::ApproximationOrder;

ApproximationOrder needed(ConstraintOrder order) {
  return order == ConstraintOrder::Linear ? ApproximationOrder::First : ApproximationOrder::Second;
}

void check_quadratic(const char* name, ConstraintOrder order) {
  if (order == ConstraintOrder::Quadratic) return;
  throw ArgumentError(std::string(name) +
                      ": a constraint of order Linear has no quadratic approximation; construct it with "
                      "ConstraintOrder::Quadratic");
}

[[noreturn]] void refuse(const char* what) {
  throw ArgumentError(std::string("this constraint does not implement ") + what);
}

}  // namespace

namespace detail {

VectorFunctionLinearApproximation linear(const TermModel& term, const char* name, scalar_t time,
                                         const vector_t& state, const vector_t& input, const vector_t& p) {
  const vector_t x = term.variables(name, time, state, input);
  const CppAdInterface& model = term.of(name);
  VectorFunctionLinearApproximation a;
  a.f = model.getFunctionValue(x, p);
  const matrix_t jacobian = model.getJacobian(x, p);
  a.dfdx = jacobian.middleCols(1, state.size());
  if (input.size() > 0) a.dfdu = jacobian.rightCols(input.size());
  return a;
}

VectorFunctionQuadraticApproximation quadratic_rows(const TermModel& term, const char* name, scalar_t time,
                                                    const vector_t& state, const vector_t& input,
                                                    const vector_t& p) {
  const VectorFunctionLinearApproximation first = linear(term, name, time, state, input, p);
  const vector_t x = term.variables(name, time, state, input);
  VectorFunctionQuadraticApproximation a;
  a.f = first.f, a.dfdx = first.dfdx, a.dfdu = first.dfdu;
  for (Eigen::Index i = 0; i < a.f.size(); ++i) {
    const matrix_t hessian = term.of(name).getHessian(static_cast<std::size_t>(i), x, p);
    const auto row = scalar_blocks(term.sizes(), 0, vector_t::Zero(x.size()), hessian);
    a.dfdxx.push_back(row.dfdxx);
    if (input.size() == 0) continue;
    a.dfdux.push_back(row.dfdux);
    a.dfduu.push_back(row.dfduu);
  }
  return a;
}

}  // namespace detail

VectorFunctionLinearApproximation StateConstraint::getLinearApproximation(scalar_t, const vector_t&,
                                                                          const PreComputation&) const {
  refuse("getLinearApproximation");
}
VectorFunctionQuadraticApproximation StateConstraint::getQuadraticApproximation(scalar_t, const vector_t&,
                                                                                const PreComputation&) const {
  refuse("getQuadraticApproximation");
}
VectorFunctionLinearApproximation StateInputConstraint::getLinearApproximation(scalar_t, const vector_t&,
                                                                               const vector_t&,
                                                                               const PreComputation&) const {
  refuse("getLinearApproximation");
}
VectorFunctionQuadraticApproximation StateInputConstraint::getQuadraticApproximation(
    scalar_t, const vector_t&, const vector_t&, const PreComputation&) const {
  refuse("getQuadraticApproximation");
}

// --- Of states --------------------------------------------------------------------------------------------

void StateConstraintCppAd::initialize(std::size_t stateDim, std::size_t parameterDim,
                                      const std::string& modelName, const std::string& modelFolder,
                                      bool recompileLibraries, bool verbose, const char* file, int line) {
  model_.make([this](ad_scalar_t t, const ad_vector_t& x, const ad_vector_t&,
                     const ad_vector_t& p) { return constraintFunction(t, x, p); },
              {stateDim, 0, parameterDim}, modelName, modelFolder, needed(getOrder()), recompileLibraries,
              verbose, {file, line});
}

vector_t StateConstraintCppAd::getValue(scalar_t time, const vector_t& state,
                                        const PreComputation& preComp) const {
  const vector_t x = model_.variables("StateConstraintCppAd", time, state);
  return model_.of("StateConstraintCppAd").getFunctionValue(x, getParameters(time, preComp));
}

VectorFunctionLinearApproximation StateConstraintCppAd::getLinearApproximation(
    scalar_t time, const vector_t& state, const PreComputation& preComp) const {
  return detail::linear(model_, "StateConstraintCppAd", time, state, {}, getParameters(time, preComp));
}

VectorFunctionQuadraticApproximation StateConstraintCppAd::getQuadraticApproximation(
    scalar_t time, const vector_t& state, const PreComputation& preComp) const {
  check_quadratic("StateConstraintCppAd", getOrder());
  return detail::quadratic_rows(model_, "StateConstraintCppAd", time, state, {},
                                getParameters(time, preComp));
}

// --- Of states and inputs ---------------------------------------------------------------------------------

void StateInputConstraintCppAd::initialize(std::size_t stateDim, std::size_t inputDim,
                                           std::size_t parameterDim, const std::string& modelName,
                                           const std::string& modelFolder, bool recompileLibraries,
                                           bool verbose, const char* file, int line) {
  model_.make([this](ad_scalar_t t, const ad_vector_t& x, const ad_vector_t& u,
                     const ad_vector_t& p) { return constraintFunction(t, x, u, p); },
              {stateDim, inputDim, parameterDim}, modelName, modelFolder, needed(getOrder()),
              recompileLibraries, verbose, {file, line});
}

vector_t StateInputConstraintCppAd::getValue(scalar_t time, const vector_t& state, const vector_t& input,
                                             const PreComputation& preComp) const {
  const vector_t x = model_.variables("StateInputConstraintCppAd", time, state, input);
  return model_.of("StateInputConstraintCppAd").getFunctionValue(x, getParameters(time, preComp));
}

VectorFunctionLinearApproximation StateInputConstraintCppAd::getLinearApproximation(
    scalar_t time, const vector_t& state, const vector_t& input, const PreComputation& preComp) const {
  return detail::linear(model_, "StateInputConstraintCppAd", time, state, input,
                        getParameters(time, preComp));
}

VectorFunctionQuadraticApproximation StateInputConstraintCppAd::getQuadraticApproximation(
    scalar_t time, const vector_t& state, const vector_t& input, const PreComputation& preComp) const {
  check_quadratic("StateInputConstraintCppAd", getOrder());
  return detail::quadratic_rows(model_, "StateInputConstraintCppAd", time, state, input,
                                getParameters(time, preComp));
}

}  // namespace dyntape::ocs2
