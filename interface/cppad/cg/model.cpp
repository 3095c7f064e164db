// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/cg/model.h>

#include <algorithm>
#include <cstring>
#include <map>

#include <dyntape/codegen/run/stack_doubles.h>
#include <dyntape/interface/cppad/cg/detail/model.hxx>

namespace CppAD::inline dyntape_names::cg {

using codegen::StackDoubles;
using Doubles = std::vector<double>;
using Sizes = std::vector<std::size_t>;

namespace {

[[noreturn, gnu::noinline, gnu::cold]] void refuse_missing(const ModelState& state, const char* what) {
  detail::refuse(std::string(what) + " of model \"" + state.name + "\" was not created; setCreate" + what +
                 "(true) does that");
}
[[noreturn, gnu::noinline, gnu::cold]] void refuse_size(const ModelState& state, const char* what,
                                                        std::size_t got, std::size_t expected) {
  detail::refuse_size("model \"" + state.name + "\": the size of " + what, got, expected);
}
inline void require_created(const ModelState& state, bool created, const char* what) {
  if (!created) refuse_missing(state, what);
}
inline void require_size(const ModelState& state, const char* what, std::size_t got, std::size_t expected) {
  if (got != expected) refuse_size(state, what, got, expected);
}

[[gnu::noinline]] Violation evaluate_with_workspace(const ModelState& state, Order order,
                                                    const Points& point) {
  const auto workspace =
      state.workspaces.take([&] { return std::make_unique<CompiledFunction::Workspace>(state.function); });
  return state.function.run(order, point, *workspace);
}

// Results that are null are not computed.  A value of a few operations takes nanoseconds, as does all that is done here.
[[gnu::always_inline]] inline void evaluate_model(const ModelState& state, Order order, const double* x,
                                                  const double* w, double* y, double* jacobian,
                                                  double* hessian) {
  const double* const p = state.recording->dynamics.data();
  if (const dyntape_run run = state.kernels[static_cast<std::size_t>(order)]) [[likely]] {
    double work[CompiledFunction::kStackDoubles];
    std::uint32_t guard = 0;
    run(x, p, w, y, jacobian, hessian, work, 1, nullptr, &guard);
    if (guard != 0) [[unlikely]]
      state.function.check({guard, 0});
  } else {
    const Violation violation = evaluate_with_workspace(
        state, order, {.x = x, .p = p, .w = w, .y = y, .jacobian = jacobian, .hessian = hessian});
    if (violation) state.function.check(violation);
  }
}

void carry_out(const ModelState::Moves& moves, const double* nonzeros, double* results) {
  if (moves.has_zeros) std::memset(results, 0, moves.size * sizeof(double));
  for (const auto& move : moves.moves) results[move.to] = nonzeros[move.from];
}
void jacobian_into(const ModelState& state, const ModelState::Moves& moves, const double* x,
                   double* results) {
  if (moves.is_pattern) return evaluate_model(state, Order::kFirst, x, nullptr, nullptr, results, nullptr);
  StackDoubles values(state.jacobian_pattern.nnz());
  evaluate_model(state, Order::kFirst, x, nullptr, nullptr, values.data(), nullptr);
  carry_out(moves, values.data(), results);
}
void hessian_into(const ModelState& state, const ModelState::Moves& moves, const double* x, const double* w,
                  double* results) {
  if (moves.is_pattern) return evaluate_model(state, Order::kSecond, x, w, nullptr, nullptr, results);
  StackDoubles values(state.hessian_pattern.nnz());
  if (!state.hessian_is_zero) evaluate_model(state, Order::kSecond, x, w, nullptr, nullptr, values.data());
  carry_out(moves, values.data(), results);
}

// --- which elements ---

using Places = std::map<std::pair<std::size_t, std::size_t>, std::size_t>;

Places places_in(const Pattern& pattern, bool symmetric) {
  Places places;
  for (std::size_t k = 0; k < pattern.nnz(); ++k) {
    places[{pattern.row[k], pattern.col[k]}] = k;
    if (symmetric) places[{pattern.col[k], pattern.row[k]}] = k;
  }
  return places;
}

void finish(ModelState::Moves& moves, std::size_t size, std::size_t nnz) {
  moves.size = size;
  moves.has_zeros = moves.moves.size() != size;
  moves.is_pattern = nnz > 0 && size == nnz && !moves.has_zeros;
  for (const auto& move : moves.moves) moves.is_pattern = moves.is_pattern && move.from == move.to;
}

void choose_elements(const Pattern& pattern, bool symmetric, const Sizes& rows, const Sizes& cols,
                     ModelState::Elements& elements) {
  const Places places = places_in(pattern, symmetric);
  const std::size_t entries = pattern.rows * pattern.cols;
  for (const auto& [element, k] : places)  // row by row
    elements.dense.moves.push_back({k, element.first * pattern.cols + element.second});
  elements.row = rows, elements.col = cols;
  if (rows.empty()) {
    for (const auto& [element, k] : places)
      elements.row.push_back(element.first), elements.col.push_back(element.second);
  }
  for (std::size_t k = 0; k < elements.row.size(); ++k) {
    const std::size_t i = elements.row[k], j = elements.col[k];
    if (i >= pattern.rows || j >= pattern.cols)
      detail::refuse("element (" + std::to_string(i) + ", " + std::to_string(j) + ") of a matrix of " +
                     std::to_string(pattern.rows) + " x " + std::to_string(pattern.cols));
    const auto found = places.find({i, j});
    if (found == places.end()) continue;
    elements.values.moves.push_back({found->second, k});
    elements.spread.moves.push_back({found->second, i * pattern.cols + j});
  }
  finish(elements.values, elements.row.size(), pattern.nnz());
  finish(elements.spread, entries, pattern.nnz());
  finish(elements.dense, entries, pattern.nnz());
}

// Entries k, k + 2, ... of Taylor coefficients.
Doubles half(ArrayView<const double> t, std::size_t k) {
  Doubles x(t.size() / 2);
  for (std::size_t j = 0; j < x.size(); ++j) x[j] = t[2 * j + k];
  return x;
}

// px[stride j] += (J^T py)[j]
void add_transposed_product(const Pattern& J, const double* values, const double* py, double* px,
                            std::size_t stride) {
  for (std::size_t k = 0; k < J.nnz(); ++k) px[stride * J.col[k]] += values[k] * py[J.row[k]];
}

}  // namespace

ModelState::ModelState(std::string n, ModelChoice c, CompiledFunction f,
                       std::shared_ptr<const detail::Recording<double>> r)
    : name(std::move(n)),
      choice(std::move(c)),
      function(std::move(f)),
      recording(std::move(r)),
      n_x(function.n_x()),
      n_y(function.n_y()),
      jacobian_pattern(function.order() >= Order::kFirst ? function.jacobian_pattern() : no_pattern),
      hessian_pattern(function.order() == Order::kSecond ? function.hessian_pattern() : no_pattern),
      hessian_is_zero(hessian_pattern.nnz() == 0 && function.function().guards.empty()) {
  for (const Order order : {Order::kValue, Order::kFirst, Order::kSecond}) {
    if (order <= function.order())
      kernels[static_cast<std::size_t>(order)] = function.kernel_without_workspace(order);
  }
  if (function.order() >= Order::kFirst)
    choose_elements(jacobian_pattern, false, choice.jacobian_rows, choice.jacobian_cols, jacobian);
  if (function.order() == Order::kSecond)
    choose_elements(hessian_pattern, true, choice.hessian_rows, choice.hessian_cols, hessian);
}

template <class Base>
std::shared_ptr<detail::Fun<Base>> GenericModel<Base>::recorded() const {
  return std::make_shared<detail::Fun<Base>>(state_->recording);
}
template <class Base>
const std::string& GenericModel<Base>::getName() const {
  return state_->name;
}
template <class Base>
std::size_t GenericModel<Base>::Domain() const {
  return state_->n_x;
}
template <class Base>
std::size_t GenericModel<Base>::Range() const {
  return state_->n_y;
}
template <class Base>
const ModelChoice& GenericModel<Base>::choice() const {
  return state_->choice;
}

template <class Base>
void GenericModel<Base>::zero(In x, Out y) const {
  const ModelState& state = *state_;
  require_created(state, state.choice.forward_zero, "ForwardZero");
  require_size(state, "x", x.size(), state.n_x);
  require_size(state, "y", y.size(), state.n_y);
  evaluate_model(state, Order::kValue, x.data(), nullptr, y.data(), nullptr, nullptr);
}
template <class Base>
void GenericModel<Base>::dense_jacobian(In x, Out J) const {
  const ModelState& state = *state_;
  require_created(state, state.choice.jacobian, "Jacobian");
  require_size(state, "x", x.size(), state.n_x);
  require_size(state, "the Jacobian", J.size(), state.n_y * state.n_x);
  jacobian_into(state, state.jacobian.dense, x.data(), J.data());
}
template <class Base>
void GenericModel<Base>::dense_hessian(In x, In w, Out H) const {
  const ModelState& state = *state_;
  require_created(state, state.choice.hessian, "Hessian");
  require_size(state, "x", x.size(), state.n_x);
  require_size(state, "w", w.size(), state.n_y);
  require_size(state, "the Hessian", H.size(), state.n_x * state.n_x);
  hessian_into(state, state.hessian.dense, x.data(), w.data(), H.data());
}
template <class Base>
void GenericModel<Base>::first_order(In tx, Out dy) const {
  require_created(*state_, choice().forward_one, "ForwardOne");
  require_size(*state_, "tx", tx.size(), 2 * Domain());
  require_size(*state_, "dy", dy.size(), Range());
  const Pattern& p = state_->jacobian_pattern;
  StackDoubles values(p.nnz());
  evaluate_model(*state_, Order::kFirst, half(tx, 0).data(), nullptr, nullptr, values.data(), nullptr);
  std::fill(dy.begin(), dy.end(), 0.0);
  for (std::size_t k = 0; k < p.nnz(); ++k) dy[p.row[k]] += values.data()[k] * tx[2 * p.col[k] + 1];
}
template <class Base>
void GenericModel<Base>::adjoint(In x, In py, Out px) const {
  require_created(*state_, choice().reverse_one, "ReverseOne");
  require_size(*state_, "x", x.size(), Domain());
  require_size(*state_, "py", py.size(), Range());
  require_size(*state_, "px", px.size(), Domain());
  StackDoubles values(state_->jacobian_pattern.nnz());
  evaluate_model(*state_, Order::kFirst, x.data(), nullptr, nullptr, values.data(), nullptr);
  std::fill(px.begin(), px.end(), 0.0);
  add_transposed_product(state_->jacobian_pattern, values.data(), py.data(), px.data(), 1);
}
template <class Base>
void GenericModel<Base>::adjoint_two(In tx, In py, Out px) const {
  require_created(*state_, choice().reverse_two, "ReverseTwo");
  require_size(*state_, "tx", tx.size(), 2 * Domain());
  require_size(*state_, "py", py.size(), 2 * Range());
  require_size(*state_, "px", px.size(), 2 * Domain());
  const Pattern &J = state_->jacobian_pattern, &H = state_->hessian_pattern;
  const Doubles x = half(tx, 0), w = half(py, 1), zeroth = half(py, 0);
  StackDoubles first(J.nnz()), second(H.nnz());
  evaluate_model(*state_, Order::kSecond, x.data(), w.data(), nullptr, first.data(), second.data());
  std::fill(px.begin(), px.end(), 0.0);
  add_transposed_product(J, first.data(), zeroth.data(), px.data(), 2);
  add_transposed_product(J, first.data(), w.data(), px.data() + 1, 2);
  for (std::size_t k = 0; k < H.nnz(); ++k) {
    px[2 * H.row[k]] += second.data()[k] * tx[2 * H.col[k] + 1];
    if (H.row[k] != H.col[k]) px[2 * H.col[k]] += second.data()[k] * tx[2 * H.row[k] + 1];
  }
}
template <class Base>
void GenericModel<Base>::jacobian_values(In x, Out values) const {
  const ModelState& state = *state_;
  require_created(state, state.choice.sparse_jacobian, "SparseJacobian");
  require_size(state, "x", x.size(), state.n_x);
  require_size(state, "the array of values", values.size(), state.jacobian.row.size());
  jacobian_into(state, state.jacobian.values, x.data(), values.data());
}
template <class Base>
void GenericModel<Base>::SparseJacobian(In x, Out values, const std::size_t** row,
                                        const std::size_t** col) const {
  jacobian_values(x, values);
  *row = state_->jacobian.row.data(), *col = state_->jacobian.col.data();
}
template <class Base>
void GenericModel<Base>::SparseHessian(In x, In w, Out values, const std::size_t** row,
                                       const std::size_t** col) const {
  hessian_values(x, w, values);
  *row = state_->hessian.row.data(), *col = state_->hessian.col.data();
}
template <class Base>
void GenericModel<Base>::hessian_values(In x, In w, Out values) const {
  const ModelState& state = *state_;
  require_created(state, state.choice.sparse_hessian, "SparseHessian");
  require_size(state, "x", x.size(), state.n_x);
  require_size(state, "w", w.size(), state.n_y);
  require_size(state, "the array of values", values.size(), state.hessian.row.size());
  hessian_into(state, state.hessian.values, x.data(), w.data(), values.data());
}
template <class Base>
void GenericModel<Base>::spread_jacobian(In x, Out J) const {
  require_created(*state_, choice().sparse_jacobian, "SparseJacobian");
  require_size(*state_, "x", x.size(), Domain());
  require_size(*state_, "the Jacobian", J.size(), Range() * Domain());
  jacobian_into(*state_, state_->jacobian.spread, x.data(), J.data());
}
template <class Base>
void GenericModel<Base>::spread_hessian(In x, In w, Out H) const {
  require_created(*state_, choice().sparse_hessian, "SparseHessian");
  require_size(*state_, "x", x.size(), Domain());
  require_size(*state_, "w", w.size(), Range());
  require_size(*state_, "the Hessian", H.size(), Domain() * Domain());
  hessian_into(*state_, state_->hessian.spread, x.data(), w.data(), H.data());
}
template <class Base>
Doubles GenericModel<Base>::weight(std::size_t i) const {
  if (i >= Range()) detail::refuse_index("model \"" + state_->name + "\": result", i, Range());
  Doubles w(Range(), 0.0);
  w[i] = 1;
  return w;
}
template <class Base>
const Sizes& GenericModel<Base>::jacobian_rows() const {
  return state_->jacobian.row;
}
template <class Base>
const Sizes& GenericModel<Base>::jacobian_cols() const {
  return state_->jacobian.col;
}
template <class Base>
const Sizes& GenericModel<Base>::hessian_rows() const {
  return state_->hessian.row;
}
template <class Base>
const Sizes& GenericModel<Base>::hessian_cols() const {
  return state_->hessian.col;
}

template class GenericModel<double>;

}  // namespace CppAD::inline dyntape_names::cg
