// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <ostream>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/taylor.h>
#include <dyntape/autodiff/graph/function.h>
#include <dyntape/interface/cppad/bases/any_base.h>
#include <dyntape/interface/cppad/conditions.h>
#include <dyntape/interface/cppad/detail/fun.h>
#include <dyntape/interface/cppad/detail/patterns.h>

namespace dyntape {

// Coefficients that are recorded themselves.
template <class Base>
struct SeriesNumber<CppAD::AD<Base>> {
  using T = CppAD::AD<Base>;
  static constexpr bool kKnown = false;
  static T evaluate(Op op, const T& x, const T& y, const T& z) {
    return CppAD::detail::apply(static_cast<CppAD::detail::Row>(op), x, y, z);
  }
  static bool is_zero(const T& x) { return SeriesNumber<Base>::is_zero(x.value()); }
};

}  // namespace dyntape

namespace CppAD::inline dyntape_names::detail {

template <class Base>
struct Fun<Base>::Run {
  explicit Run(const Recording<Base>& recording)
      : taylor(recording.function, [kernels = recording.kernels](const Callee& callee) {
          const auto found = kernels.find(&callee);
          const auto* const kernel =
              found == kernels.end() ? nullptr : dynamic_cast<const KernelOver<Base>*>(found->second.get());
          return kernel ? kernel->series(nullptr) : nullptr;
        }) {}
  Taylor<Base> taylor;
};

template <class Base>
std::vector<Series<Base>> constants_of(const std::vector<Base>& values) {
  std::vector<Series<Base>> series;
  series.reserve(values.size());
  for (const Base& value : values) series.push_back(Series<Base>::constant(value));
  return series;
}

template <class Base>
Fun<Base>::Fun(std::shared_ptr<const Recording<Base>> recording)
    : recording_(std::move(recording)), dynamics_(recording_->dynamics) {}

template <class Base>
Fun<Base>::~Fun() = default;

template <class Base>
Fun<Base>::Fun(const Fun& other)
    : recording_(other.recording_),
      inputs_(other.inputs_),
      orders_(other.orders_),
      capacity_(other.capacity_),
      dynamics_(other.dynamics_),
      change_count_(other.change_count_),
      checks_nan_(other.checks_nan_),
      told_nan_(other.told_nan_),
      throws_on_change_(other.throws_on_change_) {}

template <class Base>
std::size_t Fun<Base>::domain() const {
  return recording_->function->n_x();
}

template <class Base>
void Fun<Base>::check_size(const char* what, std::size_t got, std::size_t expected) const {
  if (got == expected) return;
  refuse(std::string(what) + " has " + std::to_string(got) + " entries, expected " +
         std::to_string(expected) + " for a function of " + std::to_string(domain()) + " variables with " +
         std::to_string(range()) + " results");
}

template <class Base>
bool Fun<Base>::is_parameter(std::size_t i) {
  if (!is_parameter_) is_parameter_ = parameters_of(*recording_->function, range());
  return (*is_parameter_)[i];
}

template <class Base>
const RecordingSizes& Fun<Base>::sizes() {
  if (!sizes_) sizes_ = count_sizes(*recording_->function, recording_->prints);
  return *sizes_;
}

template <class Base>
void Fun<Base>::new_dynamic(const Values& p) {
  check_size("new_dynamic: the vector of dynamic parameters", p.size(), recording_->function->n_p());
  dynamics_ = p;
  orders_ = 0;
  stale_ = true;
}

template <class Base>
void Fun<Base>::keep_orders(std::size_t n) {
  capacity_ = n;
  if (n < orders_) orders_ = n, stale_ = true;
}

template <class Base>
void Fun<Base>::start_at(const Values& x) {
  inputs_.assign(1, {x});
  orders_ = 1;
  capacity_ = std::max(capacity_, orders_);
  stale_ = true;
}

// All orders that there are, in every direction.
template <class Base>
void Fun<Base>::run_all() {
  if (!stale_ && runs_.size() == inputs_.size()) return;
  while (runs_.size() < inputs_.size()) runs_.push_back(std::make_unique<Run>(*recording_));
  runs_.resize(inputs_.size());
  for (std::size_t l = 0; l < inputs_.size(); ++l) {
    const auto& coefficients = inputs_[l];
    if (orders_ == 1) {
      runs_[l]->taylor.forward_at(coefficients[0], dynamics_, recording_->captured);
      continue;
    }
    std::vector<Series<Base>> x(domain());
    for (std::size_t j = 0; j < x.size(); ++j) {
      std::size_t n = orders_;
      while (n > 1 && IdenticalZero(given(coefficients[n - 1][j]))) --n;
      if (n > 1) n = orders_;
      x[j].resize(n);
      for (std::size_t k = 0; k < n; ++k) x[j][k] = coefficients[k][j];
    }
    runs_[l]->taylor.forward(x, constants_of(dynamics_), constants_of(recording_->captured));
  }
  stale_ = false;
}

template <class Base>
std::vector<Base> Fun<Base>::forward(std::size_t q, const Values& xq, std::ostream& out) {
  const std::size_t n = domain(), m = range();
  const bool all = q > 0 && xq.size() == n * (q + 1);
  if (!all) check_size("Forward: x", xq.size(), n);
  if (!all && orders_ < q) {
    refuse("Forward: order " + std::to_string(q) + " alone needs the orders below it, and there are " +
           std::to_string(orders_));
  }
  if (inputs_.size() != 1) {
    if (!all && q > 1)
      refuse("Forward: order " + std::to_string(q) + " of one direction, and the orders below are of " +
             std::to_string(inputs_.size()));
    inputs_.resize(1);
  }
  auto& coefficients = inputs_[0];
  coefficients.resize(q + 1, Values(n));
  for (std::size_t k = all ? 0 : q; k <= q; ++k) {
    for (std::size_t j = 0; j < n; ++j) coefficients[k][j] = all ? xq[j * (q + 1) + k] : xq[j];
  }
  orders_ = q + 1;
  capacity_ = std::max(capacity_, orders_);
  stale_ = true;
  run_all();
  if (q == 0 || all) after_order_zero(out);
  Values y;
  y.reserve(all ? m * (q + 1) : m);
  for (std::size_t i = 0; i < m; ++i) {
    const Series<Base> series = runs_[0]->taylor.output(i);
    for (std::size_t k = all ? 0 : q; k <= q; ++k) y.push_back(series.at(k));
  }
  if (q == 0) check_numbers(y);
  return y;
}

template <class Base>
std::vector<Base> Fun<Base>::forward(std::size_t q, std::size_t r, const Values& xq) {
  const std::size_t n = domain(), m = range();
  if (q == 0 || r == 0) refuse("Forward: several directions begin at order 1, with at least one");
  check_size("Forward: x of several directions", xq.size(), n * r);
  if (orders_ < q)
    refuse("Forward: order " + std::to_string(q) + " needs the orders below it, and there are " +
           std::to_string(orders_));
  if (q > 1 && inputs_.size() != r) {
    refuse("Forward: order " + std::to_string(q) + " of " + std::to_string(r) +
           " directions, and the orders below are of " + std::to_string(inputs_.size()));
  }
  if (inputs_.size() != r) inputs_.assign(r, std::vector<Values>(inputs_[0]));
  for (std::size_t l = 0; l < r; ++l) {
    inputs_[l].resize(q + 1, Values(n));
    for (std::size_t j = 0; j < n; ++j) inputs_[l][q][j] = xq[r * j + l];
  }
  orders_ = q + 1;
  capacity_ = std::max(capacity_, orders_);
  stale_ = true;
  run_all();
  Values y(m * r);
  for (std::size_t i = 0; i < m; ++i) {
    for (std::size_t l = 0; l < r; ++l) y[r * i + l] = runs_[l]->taylor.output(i).at(q);
  }
  return y;
}

template <class Base>
std::vector<Base> Fun<Base>::reverse(std::size_t q, const Values& w) {
  const std::size_t n = domain(), m = range();
  if (q == 0) refuse("Reverse: the order is 0, expected at least 1");
  if (orders_ < q)
    refuse("Reverse: order " + std::to_string(q) + " needs Forward to order " + std::to_string(q - 1) +
           " first, and there are " + std::to_string(orders_) + " orders");
  if (inputs_.size() > 1)
    refuse("Reverse: after Forward in " + std::to_string(inputs_.size()) + " directions, expected one");
  const bool all = q > 1 && w.size() == m * q;
  if (!all) check_size("Reverse: w", w.size(), m);
  run_all();
  std::vector<Series<Base>> adjoints(recording_->function->n_y());
  for (std::size_t i = 0; i < m; ++i) {
    std::size_t last = all ? q : 1;  // coefficients from the highest order down, without zeros at the end
    const auto weight = [&](std::size_t k) -> const Base& { return all ? w[i * q + q - 1 - k] : w[i]; };
    while (last > 0 && IdenticalZero(given(weight(last - 1)))) --last;
    if (last > 1) last = q;
    adjoints[i].resize(last);
    for (std::size_t k = 0; k < last; ++k) adjoints[i][k] = weight(k);
  }
  const auto found = runs_[0]->taylor.reverse(adjoints, q);
  Values dw(n * q);
  for (std::size_t j = 0; j < n;
       ++j) {  // found[j] begins with the highest order, and so does dw of weights (m)
    for (std::size_t k = 0; k < q; ++k) dw[j * q + k] = found[j].at(all ? q - 1 - k : k);
  }
  return dw;
}

template <class Base>
void Fun<Base>::after_order_zero(std::ostream& out) {
  const Taylor<Base>& run = runs_[0]->taylor;
  for (const Print& print : recording_->prints) {
    const Base flag = run.output(print.flag)[0], value = run.output(print.value)[0];
    if (!IdenticalZero(given(flag)) && GreaterThanZero(given(flag))) continue;
    out << print.before << given(value) << print.after;
  }
  if (!throws_on_change_) return;
  const std::size_t first = run.violated_guard(0);
  if (first != SIZE_MAX)
    throw GuardViolation(describe_guard(*recording_->function, static_cast<std::uint32_t>(first + 1)));
}

template <class Base>
void Fun<Base>::check_numbers(const Values& y) const {
  if (!told_nan_ || !checks_nan_ || !hasnan(y)) return;
  if constexpr (std::is_trivially_copyable_v<Base>) {
    if (has_handler()) {
      const Values& x = inputs_[0][0];
      std::size_t i = 0;
      while (!isnan(y[i])) ++i;
      call_handler("Forward: a result is not a number.\nvector_size = " + std::to_string(x.size()) +
                   "\nfile_name = " + write_temporary(x.data(), x.size() * sizeof(Base)) +
                   "\nindex = " + std::to_string(i) + "\n");
    }
  }
  std::string where;
  if constexpr (std::is_same_v<Base, double>) {
    where = first_not_finite(*recording_->function, inputs_[0][0].data(), dynamics_.data(),
                             recording_->captured.data());
  }
  throw NumericalError("Forward: a result of \"" + recording_->function->name + "\" is not a number" +
                       (where.empty() ? "" : "; " + where));
}

template <class Base>
std::size_t Fun<Base>::count_of(std::size_t guard) const {
  return recording_->guard_counts.empty() ? 1 : recording_->guard_counts[guard];
}

template <class Base>
std::size_t Fun<Base>::changes() const {
  if (change_count_ == 0 || runs_.empty() || stale_) return 0;
  const Taylor<Base>& run = runs_[0]->taylor;
  std::size_t count = 0;
  for (std::size_t i = run.violated_guard(0); i != SIZE_MAX; i = run.violated_guard(i + 1))
    count += count_of(i);
  return count;
}

template <class Base>
std::size_t Fun<Base>::change_op_index() const {
  if (change_count_ == 0 || runs_.empty() || stale_ || recording_->guard_places.empty()) return 0;
  const Taylor<Base>& run = runs_[0]->taylor;
  std::size_t guard = run.violated_guard(0);
  for (std::size_t count = 0; guard != SIZE_MAX; guard = run.violated_guard(guard + 1)) {
    count += count_of(guard);
    if (count >= change_count_) return recording_->guard_places[guard];
  }
  return 0;
}

}  // namespace CppAD::inline dyntape_names::detail

#include <dyntape/interface/cppad/detail/fun_derivatives.hxx>
