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
  if (recompileLibraries)
    made->createModels(order, verbose);
  else
    made->loadModelsIfAvailable(order, verbose);
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

template <class Base, class... Input>
void RecordedCost<Base, Input...>::initialize(std::size_t stateDim, InPlaceOf<Input, std::size_t>... inputDim,
                                              std::size_t parameterDim, const std::string& modelName,
                                              const std::string& modelFolder, bool recompileLibraries,
                                              bool verbose, const char* file, int line) {
  const auto recorded = [this](ad_scalar_t t, const ad_vector_t& x, const ad_vector_t& u,
                               const ad_vector_t& p) {
    if constexpr (sizeof...(Input) == 0) {
      return values(t, x, p);
    } else {
      return values(t, x, u, p);
    }
  };
  model_.make(recorded, {stateDim, (std::size_t(0) + ... + inputDim), parameterDim}, modelName, modelFolder,
              is_gauss_newton() ? ApproximationOrder::First : ApproximationOrder::Second, recompileLibraries,
              verbose, {file, line});
}

template <class Base, class... Input>
scalar_t RecordedCost<Base, Input...>::getValue(scalar_t time, const vector_t& state, const Input&... input,
                                                const TargetTrajectories& targetTrajectories,
                                                const PreComputation& preComp) const {
  const vector_t x = model_.variables(kind(), time, state, input...);
  const vector_t y = model_.of(kind()).getFunctionValue(x, getParameters(time, targetTrajectories, preComp));
  return is_gauss_newton() ? 0.5 * y.squaredNorm() : y[0];
}

template <class Base, class... Input>
ScalarFunctionQuadraticApproximation RecordedCost<Base, Input...>::getQuadraticApproximation(
    scalar_t time, const vector_t& state, const Input&... input, const TargetTrajectories& targetTrajectories,
    const PreComputation& preComp) const {
  const vector_t x = model_.variables(kind(), time, state, input...);
  const vector_t p = getParameters(time, targetTrajectories, preComp);
  if (is_gauss_newton()) {
    const ScalarFunctionQuadraticApproximation whole = model_.of(kind()).getGaussNewtonApproximation(x, p);
    return scalar_blocks(model_.sizes(), whole.f, whole.dfdx, whole.dfdxx);
  }
  const CppAdEvaluation all = model_.of(kind()).getAll(x, p);
  return scalar_blocks(model_.sizes(), all.value[0], all.jacobian.row(0), all.hessian);
}

template class RecordedCost<StateCost>;
template class RecordedCost<StateInputCost, vector_t>;

}  // namespace detail
}  // namespace dyntape::ocs2
