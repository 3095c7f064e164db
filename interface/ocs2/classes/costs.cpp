// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/ocs2/classes/costs.h>

#include <dyntape/interface/ocs2/ad_function_model.h>

namespace dyntape::ocs2 {

using ApproximationOrder = CppAdInterface::ApproximationOrder;

namespace detail {

void TermModel::make(Function function, Sizes sizes, const std::string& modelName,
                     const std::string& modelFolder, ApproximationOrder order, bool recompileLibraries,
                     bool verbose, Place place) {
  const auto nx = static_cast<Eigen::Index>(sizes.state), nu = static_cast<Eigen::Index>(sizes.input);
  const auto recorded = [=, f = std::move(function)](const ad_vector_t& x, const ad_vector_t& p,
                                                     ad_vector_t& y) {
    y = f(x[0], x.segment(1, nx), x.tail(nu), p);
  };
  auto made = std::make_shared<CppAdInterface>(recorded, 1 + sizes.state + sizes.input, sizes.parameters,
                                               modelName, modelFolder, AdFunction::defaultCompileFlags(),
                                               place.file, place.line);
  if (recompileLibraries) {
    made->createModels(order, verbose);
  } else {
    made->loadModelsIfAvailable(order, verbose);
  }
  sizes_ = sizes;
  model_ = std::move(made);
}

const CppAdInterface& TermModel::of(const char* name) const {
  if (!model_)
    throw ArgumentError(std::string(name) + ": there is no model; initialize() has to be called before");
  return *model_;
}

vector_t TermModel::variables(const char* name, scalar_t time, const vector_t& state,
                              const vector_t& input) const {
  const std::string& model = of(name).getModelName();
  dyntape::detail::check_size(name, model, "state", state.size(), sizes_.state);
  dyntape::detail::check_size(name, model, "input", input.size(), sizes_.input);
  vector_t x(1 + state.size() + input.size());
  x << time, state, input;
  return x;
}

ScalarFunctionQuadraticApproximation scalar_blocks(const TermModel::Sizes& sizes, scalar_t value,
                                                   const vector_t& gradient, const matrix_t& hessian) {
  const auto nx = static_cast<Eigen::Index>(sizes.state), nu = static_cast<Eigen::Index>(sizes.input);
  ScalarFunctionQuadraticApproximation a;
  a.f = value;
  a.dfdx = gradient.segment(1, nx);
  a.dfdxx = hessian.block(1, 1, nx, nx);
  if (nu > 0) {
    a.dfdu = gradient.tail(nu);
    a.dfdux = hessian.block(1 + nx, 1, nu, nx);
    a.dfduu = hessian.bottomRightCorner(nu, nu);
  }
  return a;
}

namespace {

ScalarFunctionQuadraticApproximation quadratic(const TermModel& term, const char* name, scalar_t time,
                                               const vector_t& state, const vector_t& input,
                                               const vector_t& p) {
  const CppAdEvaluation all = term.of(name).getAll(term.variables(name, time, state, input), p);
  return scalar_blocks(term.sizes(), all.value[0], all.jacobian.row(0), all.hessian);
}

ad_vector_t one(const ad_scalar_t& value) { return ad_vector_t::Constant(1, value); }

}  // namespace
}  // namespace detail

// --- Of states --------------------------------------------------------------------------------------------

void StateCostCppAd::initialize(std::size_t stateDim, std::size_t parameterDim, const std::string& modelName,
                                const std::string& modelFolder, bool recompileLibraries, bool verbose,
                                const char* file, int line) {
  model_.make([this](ad_scalar_t t, const ad_vector_t& x, const ad_vector_t&,
                     const ad_vector_t& p) { return detail::one(costFunction(t, x, p)); },
              {stateDim, 0, parameterDim}, modelName, modelFolder, ApproximationOrder::Second,
              recompileLibraries, verbose, {file, line});
}

scalar_t StateCostCppAd::getValue(scalar_t time, const vector_t& state,
                                  const TargetTrajectories& targetTrajectories,
                                  const PreComputation& preComp) const {
  const vector_t x = model_.variables("StateCostCppAd", time, state);
  return model_.of("StateCostCppAd").getFunctionValue(x, getParameters(time, targetTrajectories, preComp))[0];
}

ScalarFunctionQuadraticApproximation StateCostCppAd::getQuadraticApproximation(
    scalar_t time, const vector_t& state, const TargetTrajectories& targetTrajectories,
    const PreComputation& preComp) const {
  return detail::quadratic(model_, "StateCostCppAd", time, state, {},
                           getParameters(time, targetTrajectories, preComp));
}

// --- Of states and inputs ---------------------------------------------------------------------------------

void StateInputCostCppAd::initialize(std::size_t stateDim, std::size_t inputDim, std::size_t parameterDim,
                                     const std::string& modelName, const std::string& modelFolder,
                                     bool recompileLibraries, bool verbose, const char* file, int line) {
  model_.make([this](ad_scalar_t t, const ad_vector_t& x, const ad_vector_t& u,
                     const ad_vector_t& p) { return detail::one(costFunction(t, x, u, p)); },
              {stateDim, inputDim, parameterDim}, modelName, modelFolder, ApproximationOrder::Second,
              recompileLibraries, verbose, {file, line});
}

scalar_t StateInputCostCppAd::getValue(scalar_t time, const vector_t& state, const vector_t& input,
                                       const TargetTrajectories& targetTrajectories,
                                       const PreComputation& preComp) const {
  const vector_t x = model_.variables("StateInputCostCppAd", time, state, input);
  return model_.of("StateInputCostCppAd")
      .getFunctionValue(x, getParameters(time, targetTrajectories, preComp))[0];
}

ScalarFunctionQuadraticApproximation StateInputCostCppAd::getQuadraticApproximation(
    scalar_t time, const vector_t& state, const vector_t& input, const TargetTrajectories& targetTrajectories,
    const PreComputation& preComp) const {
  return detail::quadratic(model_, "StateInputCostCppAd", time, state, input,
                           getParameters(time, targetTrajectories, preComp));
}

// --- Gauss-Newton -----------------------------------------------------------------------------------------

void StateInputCostGaussNewtonAd::initialize(std::size_t stateDim, std::size_t inputDim,
                                             std::size_t parameterDim, const std::string& modelName,
                                             const std::string& modelFolder, bool recompileLibraries,
                                             bool verbose, const char* file, int line) {
  model_.make([this](ad_scalar_t t, const ad_vector_t& x, const ad_vector_t& u,
                     const ad_vector_t& p) { return costVectorFunction(t, x, u, p); },
              {stateDim, inputDim, parameterDim}, modelName, modelFolder, ApproximationOrder::First,
              recompileLibraries, verbose, {file, line});
}

scalar_t StateInputCostGaussNewtonAd::getValue(scalar_t time, const vector_t& state, const vector_t& input,
                                               const TargetTrajectories& targetTrajectories,
                                               const PreComputation& preComp) const {
  const char* const name = "StateInputCostGaussNewtonAd";
  const vector_t p = getParameters(time, targetTrajectories, preComp);
  return 0.5 * model_.of(name).getFunctionValue(model_.variables(name, time, state, input), p).squaredNorm();
}

ScalarFunctionQuadraticApproximation StateInputCostGaussNewtonAd::getQuadraticApproximation(
    scalar_t time, const vector_t& state, const vector_t& input, const TargetTrajectories& targetTrajectories,
    const PreComputation& preComp) const {
  const char* const name = "StateInputCostGaussNewtonAd";
  const vector_t p = getParameters(time, targetTrajectories, preComp);
  const auto whole =
      model_.of(name).getGaussNewtonApproximation(model_.variables(name, time, state, input), p);
  return detail::scalar_blocks(model_.sizes(), whole.f, whole.dfdx, whole.dfdxx);
}

}  // namespace dyntape::ocs2
