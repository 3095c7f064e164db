// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/ocs2/cpp_ad_interface.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/ocs2/ad_function_model.h>

namespace dyntape::ocs2 {
namespace {

AdFunctionSettings settings_from(std::string name, const std::string& folder,
                                 std::vector<std::string> flags) {
  AdFunctionSettings settings;
  settings.name = std::move(name);
  if (!folder.empty()) settings.folder = std::filesystem::absolute(folder).lexically_normal().string();
  settings.flags = std::move(flags);
  return settings;
}

CppAdInterface::ad_parameterized_function_t with_no_parameters(CppAdInterface::ad_function_t function) {
  if (!function) return nullptr;
  return [f = std::move(function)](const ad_vector_t& x, const ad_vector_t&, ad_vector_t& y) { f(x, y); };
}

bool all_finite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

}  // namespace

CppAdInterface::CppAdInterface(ad_parameterized_function_t adFunction, std::size_t variableDim,
                               std::size_t parameterDim, AdFunctionSettings settings, const char* file,
                               int line)
    : recorded_(std::move(adFunction)),
      variableDim_(variableDim),
      parameterDim_(parameterDim),
      settings_(std::move(settings)),
      file_(file),
      line_(line),
      function_(made()) {}

CppAdInterface::CppAdInterface(ad_parameterized_function_t adFunction, std::size_t variableDim,
                               std::size_t parameterDim, std::string modelName, std::string folderName,
                               std::vector<std::string> compileFlags, const char* file, int line)
    : CppAdInterface(std::move(adFunction), variableDim, parameterDim,
                     settings_from(std::move(modelName), folderName, std::move(compileFlags)), file, line) {}

CppAdInterface::CppAdInterface(ad_function_t adFunction, std::size_t variableDim, std::string modelName,
                               std::string folderName, std::vector<std::string> compileFlags,
                               const char* file, int line)
    : CppAdInterface(with_no_parameters(std::move(adFunction)), variableDim, 0,
                     settings_from(std::move(modelName), folderName, std::move(compileFlags)), file, line) {}

AdFunction CppAdInterface::made() const {
  return {recorded_, variableDim_, parameterDim_, settings_, file_, line_};
}

void CppAdInterface::recordAtOnes() {
  settings_.variables = vector_t::Ones(static_cast<Eigen::Index>(variableDim_));
  settings_.parameters = vector_t::Ones(static_cast<Eigen::Index>(parameterDim_));
}

void CppAdInterface::createModels(ApproximationOrder approximationOrder, bool verbose) {
  if (!settings_.forceRebuild) {
    loadModelsIfAvailable(approximationOrder, verbose);
    return;
  }
  AdFunction next = made();
  next.createModels(approximationOrder, verbose);
  function_ = std::move(next);
}

void CppAdInterface::loadModels(bool verbose) {
  AdFunction next = made();
  next.loadModels(verbose);
  function_ = std::move(next);
}

void CppAdInterface::loadModelsIfAvailable(ApproximationOrder approximationOrder, bool verbose) {
  AdFunction next = made();
  next.loadModelsOfAtLeast(approximationOrder, verbose);
  function_ = std::move(next);
}

vector_t CppAdInterface::getFunctionValue(const VectorRef& x, const VectorRef& p) const {
  return function_.getFunctionValue(x, p);
}

matrix_t CppAdInterface::getJacobian(const VectorRef& x, const VectorRef& p) const {
  return function_.getJacobian(x, p);
}

ScalarFunctionQuadraticApproximation CppAdInterface::getGaussNewtonApproximation(const VectorRef& x,
                                                                                 const VectorRef& p) const {
  return function_.getGaussNewtonApproximation(x, p);
}

matrix_t CppAdInterface::getHessian(std::size_t outputIndex, const VectorRef& x, const VectorRef& p) const {
  return function_.getHessian(outputIndex, x, p);
}

matrix_t CppAdInterface::getHessian(const VectorRef& w, const VectorRef& x, const VectorRef& p) const {
  return function_.getHessian(w, x, p);
}

CppAdEvaluation CppAdInterface::getAll(const VectorRef& x, const VectorRef& p, const VectorRef& w) const {
  const std::string& name = getModelName();
  if (!hasModels())
    throw ArgumentError("getAll of \"" + name +
                        "\": there is no model yet; call createModels or loadModelsIfAvailable first");
  const ApproximationOrder order = function_.order();
  const std::size_t m = getRangeDim();
  dyntape::detail::check_size("getAll", name, "x", x.size(), variableDim_);
  dyntape::detail::check_size("getAll", name, "p", p.size(), parameterDim_);
  vector_t weights = w;
  if (w.size() == 0) weights = vector_t::Ones(static_cast<Eigen::Index>(m));
  dyntape::detail::check_size("getAll", name, "w", weights.size(), m);
  std::vector<double> y(m), jacobian, hessian;
  if (order >= ApproximationOrder::First) jacobian.resize(function_.jacobianPattern().nnz());
  if (order >= ApproximationOrder::Second) hessian.resize(function_.hessianPattern().nnz());
  const auto where = [](std::vector<double>& values, bool wanted) {
    return wanted ? values.data() : nullptr;
  };
  function_.evaluate(x.data(), p.data(), y.data(), where(jacobian, order >= ApproximationOrder::First),
                     weights.data(), where(hessian, order >= ApproximationOrder::Second));
  if (settings_.checkFinite &&
      !(all_finite(y) && all_finite(jacobian) && all_finite(hessian))) {  // says which, and why
    getFunctionValue(x, p);
    if (order >= ApproximationOrder::First) getJacobian(x, p);
    if (order >= ApproximationOrder::Second) getHessian(weights, x, p);
  }
  CppAdEvaluation all;
  all.value = vector_t::Map(y.data(), static_cast<Eigen::Index>(m));
  if (order >= ApproximationOrder::First)
    all.jacobian = dyntape::detail::dense(function_.jacobianPattern(), jacobian.data(), false);
  if (order >= ApproximationOrder::Second)
    all.hessian = dyntape::detail::dense(function_.hessianPattern(), hessian.data(), true);
  return all;
}

cppad_sparsity::SparsityPattern CppAdInterface::getJacobianSparsityPattern() const {
  return cppad_sparsity::fromPattern(function_.jacobianPattern());
}

cppad_sparsity::SparsityPattern CppAdInterface::getHessianSparsityPattern() const {
  return cppad_sparsity::fromPattern(function_.hessianPattern(), true);
}

}  // namespace dyntape::ocs2
