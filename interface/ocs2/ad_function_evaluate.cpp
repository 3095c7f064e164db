// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/codegen/run/stack_doubles.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/ocs2/ad_function.h>
#include <dyntape/interface/ocs2/ad_function_model.h>

namespace dyntape {
namespace detail {

void check_size(const char* asked, const std::string& name, const char* what, Eigen::Index got,
                std::size_t expected) {
  if (static_cast<std::size_t>(got) == expected) return;
  throw ArgumentError(std::string(asked) + ": " + what + " has " + std::to_string(got) +
                      " entries, function \"" + name + "\" expects " + std::to_string(expected));
}

matrix_t dense(const Pattern& pattern, const double* values, bool symmetric) {
  matrix_t m =
      matrix_t::Zero(static_cast<Eigen::Index>(pattern.rows), static_cast<Eigen::Index>(pattern.cols));
  for (std::size_t k = 0; k < pattern.nnz(); ++k) {
    m(pattern.row[k], pattern.col[k]) = values[k];
    if (symmetric) m(pattern.col[k], pattern.row[k]) = values[k];
  }
  return m;
}

std::ptrdiff_t first_not_finite(const double* values, std::size_t count) {
  const double* bad = std::find_if(values, values + count, [](double v) { return !std::isfinite(v); });
  return bad == values + count ? -1 : bad - values;
}

}  // namespace detail

namespace {

using VectorRef = AdFunction::VectorRef;
using codegen::StackDoubles;

// One call of a compatible method.
struct Call {
  const char* asked;
  const std::string& name;
  bool check_finite;
  const VectorRef& x;
  const VectorRef& p;
  const double* weights = nullptr;
};

// `x[3] = nan` where an input is not finite, empty otherwise.
std::string bad_input(const char* what, const VectorRef& v) {
  for (Eigen::Index i = 0; i < v.size(); ++i) {
    if (!std::isfinite(v[i]))
      return std::string(what) + "[" + std::to_string(i) + "] = " + io::shortest(v[i]);
  }
  return "";
}

// The first operation, of the recording and then of its derivatives, that made something not finite.
std::string culprit(const CompiledFunction& f, Order highest, const Call& call) {
  for (int order = 0; order <= static_cast<int>(highest); ++order) {
    const Function derived = derive(f.function(), static_cast<Order>(order)).function;
    const std::string first = first_not_finite(derived, call.x.data(), call.p.data(), call.weights);
    if (!first.empty()) return (order == 0 ? "" : "in the derivative, ") + first;
  }
  return "";
}

// Throws unless all values are finite; `entry` names the place of a value.
template <class Entry>
void check_finite(const Call& call, const CompiledFunction& f, Order order, const double* values,
                  std::size_t count, Entry entry) {
  const std::ptrdiff_t k = call.check_finite ? detail::first_not_finite(values, count) : -1;
  if (k < 0) return;
  std::string reason = bad_input("x", call.x);
  if (reason.empty()) reason = bad_input("p", call.p);
  if (reason.empty()) reason = culprit(f, order, call);
  throw NumericalError(std::string(call.asked) + " of \"" + call.name + "\": entry " +
                       entry(static_cast<std::size_t>(k)) + " is " + io::shortest(values[k]) +
                       (reason.empty() ? "" : "; first cause: " + reason));
}

auto place_in(const Pattern& pattern) {
  return [&pattern](std::size_t k) {
    return "(" + std::to_string(pattern.row[k]) + ", " + std::to_string(pattern.col[k]) + ")";
  };
}

void check_values(const Call& call, const CompiledFunction& f, const double* y) {
  check_finite(call, f, Order::kValue, y, f.n_y(), [](std::size_t k) { return std::to_string(k); });
}

// The value into y unless that is null.
StackDoubles jacobian_of(const Call& call, const detail::SharedFunction& shared, double* y) {
  const CompiledFunction& f = shared.f;
  StackDoubles values(f.jacobian_pattern().nnz());
  shared.evaluate(Order::kFirst, {.x = call.x.data(), .p = call.p.data(), .y = y, .jacobian = values.data()});
  if (y) check_values(call, f, y);
  check_finite(call, f, Order::kFirst, values.data(), values.size(), place_in(f.jacobian_pattern()));
  return values;
}

StackDoubles hessian_of(const Call& call, const detail::SharedFunction& shared) {
  const CompiledFunction& f = shared.f;
  StackDoubles values(f.hessian_pattern().nnz());
  shared.evaluate(Order::kSecond,
                  {.x = call.x.data(), .p = call.p.data(), .w = call.weights, .hessian = values.data()});
  check_finite(call, f, Order::kSecond, values.data(), values.size(), place_in(f.hessian_pattern()));
  return values;
}

// Products of finite values may overflow.
void check_blocks(const Call& call, const CompiledFunction& f,
                  const ScalarFunctionQuadraticApproximation& a) {
  const auto check = [&](const char* block, const double* values, Eigen::Index size) {
    check_finite(call, f, Order::kFirst, values, static_cast<std::size_t>(size),
                 [&](std::size_t k) { return block + ("[" + std::to_string(k)) + "]"; });
  };
  check("f", &a.f, 1);
  check("dfdx", a.dfdx.data(), a.dfdx.size());
  check("dfdxx", a.dfdxx.data(), a.dfdxx.size());
}

Eigen::SparseMatrix<double> sparse(const Pattern& pattern, const double* values, bool symmetric) {
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t k = 0; k < pattern.nnz(); ++k) {
    const auto i = static_cast<int>(pattern.row[k]), j = static_cast<int>(pattern.col[k]);
    entries.emplace_back(i, j, values[k]);
    if (symmetric && i != j) entries.emplace_back(j, i, values[k]);
  }
  Eigen::SparseMatrix<double> matrix(static_cast<int>(pattern.rows), static_cast<int>(pattern.cols));
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

}  // namespace

void AdFunction::check_inputs(const char* asked, const VectorRef& x, const VectorRef& p) const {
  detail::check_size(asked, name(), "x", x.size(), variable_dim_);
  detail::check_size(asked, name(), "p", p.size(), parameter_dim_);
}

vector_t AdFunction::getFunctionValue(const VectorRef& x, const VectorRef& p) const {
  const Model& m = model("getFunctionValue");
  check_inputs("getFunctionValue", x, p);
  vector_t y(static_cast<Eigen::Index>(m.compiled().n_y()));
  m.shared.evaluate(Order::kValue, {.x = x.data(), .p = p.data(), .y = y.data()});
  check_values({"getFunctionValue", name(), settings_.checkFinite, x, p}, m.compiled(), y.data());
  return y;
}

matrix_t AdFunction::getJacobian(const VectorRef& x, const VectorRef& p) const {
  const Model& m = model("getJacobian", Order::kFirst);
  check_inputs("getJacobian", x, p);
  const StackDoubles J = jacobian_of({"getJacobian", name(), settings_.checkFinite, x, p}, m.shared, nullptr);
  return detail::dense(m.compiled().jacobian_pattern(), J.data(), false);
}

Eigen::SparseMatrix<double> AdFunction::getSparseJacobian(const VectorRef& x, const VectorRef& p) const {
  const Model& m = model("getSparseJacobian", Order::kFirst);
  check_inputs("getSparseJacobian", x, p);
  const StackDoubles J =
      jacobian_of({"getSparseJacobian", name(), settings_.checkFinite, x, p}, m.shared, nullptr);
  return sparse(m.compiled().jacobian_pattern(), J.data(), false);
}

ScalarFunctionQuadraticApproximation AdFunction::getGaussNewtonApproximation(const VectorRef& x,
                                                                             const VectorRef& p) const {
  constexpr const char* kAsked = "getGaussNewtonApproximation";
  const Model& m = model(kAsked, Order::kFirst);
  check_inputs(kAsked, x, p);
  vector_t y(static_cast<Eigen::Index>(m.compiled().n_y()));
  const Call call{kAsked, name(), settings_.checkFinite, x, p};
  const StackDoubles nonzeros = jacobian_of(call, m.shared, y.data());

  const auto n = static_cast<Eigen::Index>(variable_dim_);
  ScalarFunctionQuadraticApproximation result;
  result.f = 0.5 * y.squaredNorm();
  result.dfdx = vector_t::Zero(n);
  result.dfdxx = matrix_t::Zero(n, n);
  const Pattern& pattern = m.compiled().jacobian_pattern();
  const double* const J = nonzeros.data();
  for (std::size_t k = 0; k < pattern.nnz(); ++k) {
    result.dfdx[pattern.col[k]] += J[k] * y[pattern.row[k]];
    // The entries of a row follow each other: this one times itself and those before it in its row.
    for (std::size_t l = k + 1; l-- > 0 && pattern.row[l] == pattern.row[k];) {
      result.dfdxx(pattern.col[k], pattern.col[l]) += J[k] * J[l];
    }
  }
  result.dfdxx.triangularView<Eigen::StrictlyUpper>() = result.dfdxx.transpose();
  check_blocks(call, m.compiled(), result);
  return result;
}

matrix_t AdFunction::getHessian(std::size_t outputIndex, const VectorRef& x, const VectorRef& p) const {
  const std::size_t m = model("getHessian", Order::kSecond).compiled().n_y();
  if (outputIndex >= m)
    throw ArgumentError("getHessian: output " + std::to_string(outputIndex) + " does not exist, function \"" +
                        name() + "\" has " + std::to_string(m) + " outputs, counted from 0");
  return getHessian(vector_t::Unit(static_cast<Eigen::Index>(m), static_cast<Eigen::Index>(outputIndex)), x,
                    p);
}

matrix_t AdFunction::getHessian(const VectorRef& weights, const VectorRef& x, const VectorRef& p) const {
  const Model& m = model("getHessian", Order::kSecond);
  detail::check_size("getHessian", name(), "weights", weights.size(), m.compiled().n_y());
  check_inputs("getHessian", x, p);
  const StackDoubles H =
      hessian_of({"getHessian", name(), settings_.checkFinite, x, p, weights.data()}, m.shared);
  return detail::dense(m.compiled().hessian_pattern(), H.data(), true);
}

Eigen::SparseMatrix<double> AdFunction::getSparseHessian(const VectorRef& weights, const VectorRef& x,
                                                         const VectorRef& p) const {
  const Model& m = model("getSparseHessian", Order::kSecond);
  detail::check_size("getSparseHessian", name(), "weights", weights.size(), m.compiled().n_y());
  check_inputs("getSparseHessian", x, p);
  const StackDoubles H =
      hessian_of({"getSparseHessian", name(), settings_.checkFinite, x, p, weights.data()}, m.shared);
  return sparse(m.compiled().hessian_pattern(), H.data(), true);
}

}  // namespace dyntape
