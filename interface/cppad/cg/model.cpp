// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/cg/model.h>

#include <algorithm>
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
  detail::refuse("model \"" + state.name + "\": " + what + " has " + std::to_string(got) +
                 " entries, expected " + std::to_string(expected));
}
inline void require_created(const ModelState& state, bool created, const char* what) {
  if (!created) refuse_missing(state, what);
}
inline void require_size(const ModelState& state, const char* what, std::size_t got, std::size_t expected) {
  if (got != expected) refuse_size(state, what, got, expected);
}

// Results that are null are not computed.
void evaluate_model(const ModelState& state, const double* x, const double* w, double* y, double* jacobian,
                    double* hessian) {
  const Order order = hessian ? Order::kSecond : jacobian ? Order::kFirst : Order::kValue;
  if (order == Order::kSecond && !jacobian && state.hessian_is_zero) return;
  const Points point{.x = x,
                     .p = state.recording->dynamics.data(),
                     .w = w,
                     .y = y,
                     .jacobian = jacobian,
                     .hessian = hessian};
  Violation violation;
  if (!state.function.run_without_workspace(order, point, violation)) {
    const auto workspace =
        state.workspaces.take([&] { return std::make_unique<CompiledFunction::Workspace>(state.function); });
    violation = state.function.run(order, point, *workspace);
  }
  if (violation) state.function.check(violation);
}

// From the non-zeros of a pattern to the elements that were asked for.
void gather(const ModelState::Elements& elements, const double* nonzeros, double* values) {
  for (std::size_t k = 0; k < elements.place.size(); ++k)
    values[k] = elements.place[k] == SIZE_MAX ? 0 : nonzeros[elements.place[k]];
}
void spread(const ModelState::Elements& elements, const double* nonzeros, std::size_t cols,
            ArrayView<double> dense) {
  std::fill(dense.begin(), dense.end(), 0.0);
  for (std::size_t k = 0; k < elements.place.size(); ++k) {
    if (elements.place[k] != SIZE_MAX)
      dense[elements.row[k] * cols + elements.col[k]] = nonzeros[elements.place[k]];
  }
}

std::vector<std::size_t> places_in(const Pattern& pattern, const Sizes& row, const Sizes& col,
                                   bool symmetric) {
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> known;
  for (std::size_t k = 0; k < pattern.nnz(); ++k) {
    known[{pattern.row[k], pattern.col[k]}] = k;
    if (symmetric) known[{pattern.col[k], pattern.row[k]}] = k;
  }
  std::vector<std::size_t> places;
  for (std::size_t k = 0; k < row.size(); ++k) {
    if (row[k] >= pattern.rows || col[k] >= pattern.cols)
      detail::refuse("element (" + std::to_string(row[k]) + ", " + std::to_string(col[k]) +
                     ") of a matrix of " + std::to_string(pattern.rows) + " x " +
                     std::to_string(pattern.cols));
    const auto found = known.find({row[k], col[k]});
    places.push_back(found == known.end() ? SIZE_MAX : found->second);
  }
  return places;
}

void choose_elements(const Pattern& pattern, bool symmetric, const Sizes& rows, const Sizes& cols,
                     ModelState::Elements& elements) {
  elements.row = rows, elements.col = cols;
  if (rows.empty()) {
    for (std::size_t i = 0; i < pattern.rows; ++i) {  // row by row, both triangles
      std::vector<std::size_t> in_row;
      for (std::size_t k = 0; k < pattern.nnz(); ++k) {
        if (pattern.row[k] == i) in_row.push_back(pattern.col[k]);
        if (symmetric && pattern.col[k] == i && pattern.row[k] != i) in_row.push_back(pattern.row[k]);
      }
      std::sort(in_row.begin(), in_row.end());
      for (std::size_t j : in_row) elements.row.push_back(i), elements.col.push_back(j);
    }
  }
  elements.place = places_in(pattern, elements.row, elements.col, symmetric);
  elements.is_pattern = elements.place.size() == pattern.nnz();
  for (std::size_t k = 0; k < elements.place.size(); ++k)
    elements.is_pattern = elements.is_pattern && elements.place[k] == k;
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
  require_created(*state_, choice().forward_zero, "ForwardZero");
  require_size(*state_, "x", x.size(), Domain());
  require_size(*state_, "y", y.size(), Range());
  evaluate_model(*state_, x.data(), nullptr, y.data(), nullptr, nullptr);
}
template <class Base>
void GenericModel<Base>::dense_jacobian(In x, Out J) const {
  require_created(*state_, choice().jacobian, "Jacobian");
  require_size(*state_, "x", x.size(), Domain());
  require_size(*state_, "the Jacobian", J.size(), Range() * Domain());
  const Pattern& p = state_->jacobian_pattern;
  if (J.size() == p.nnz() && p.nnz() > 0)  // row by row, as the pattern
    return evaluate_model(*state_, x.data(), nullptr, nullptr, J.data(), nullptr);
  StackDoubles values(p.nnz());
  evaluate_model(*state_, x.data(), nullptr, nullptr, values.data(), nullptr);
  std::fill(J.begin(), J.end(), 0.0);
  for (std::size_t k = 0; k < p.nnz(); ++k) J[p.row[k] * p.cols + p.col[k]] = values.data()[k];
}
template <class Base>
void GenericModel<Base>::dense_hessian(In x, In w, Out H) const {
  require_created(*state_, choice().hessian, "Hessian");
  require_size(*state_, "x", x.size(), Domain());
  require_size(*state_, "w", w.size(), Range());
  require_size(*state_, "the Hessian", H.size(), Domain() * Domain());
  const Pattern& p = state_->hessian_pattern;
  StackDoubles values(p.nnz());
  evaluate_model(*state_, x.data(), w.data(), nullptr, nullptr, values.data());
  if (2 * p.nnz() != p.rows * (p.rows + 1)) std::fill(H.begin(), H.end(), 0.0);
  for (std::size_t k = 0; k < p.nnz(); ++k)
    H[p.row[k] * p.cols + p.col[k]] = H[p.col[k] * p.cols + p.row[k]] = values.data()[k];
}
template <class Base>
void GenericModel<Base>::first_order(In tx, Out dy) const {
  require_created(*state_, choice().forward_one, "ForwardOne");
  require_size(*state_, "tx", tx.size(), 2 * Domain());
  require_size(*state_, "dy", dy.size(), Range());
  const Pattern& p = state_->jacobian_pattern;
  StackDoubles values(p.nnz());
  evaluate_model(*state_, half(tx, 0).data(), nullptr, nullptr, values.data(), nullptr);
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
  evaluate_model(*state_, x.data(), nullptr, nullptr, values.data(), nullptr);
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
  evaluate_model(*state_, x.data(), w.data(), nullptr, first.data(), second.data());
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
  require_created(*state_, choice().sparse_jacobian, "SparseJacobian");
  require_size(*state_, "x", x.size(), Domain());
  require_size(*state_, "the array of values", values.size(), jacobian_rows().size());
  if (state_->jacobian.is_pattern && values.size() > 0)
    return evaluate_model(*state_, x.data(), nullptr, nullptr, values.data(), nullptr);
  StackDoubles all(state_->jacobian_pattern.nnz());
  evaluate_model(*state_, x.data(), nullptr, nullptr, all.data(), nullptr);
  gather(state_->jacobian, all.data(), values.data());
}
template <class Base>
void GenericModel<Base>::hessian_values(In x, In w, Out values) const {
  require_created(*state_, choice().sparse_hessian, "SparseHessian");
  require_size(*state_, "x", x.size(), Domain());
  require_size(*state_, "w", w.size(), Range());
  require_size(*state_, "the array of values", values.size(), hessian_rows().size());
  if (state_->hessian.is_pattern && values.size() > 0)
    return evaluate_model(*state_, x.data(), w.data(), nullptr, nullptr, values.data());
  StackDoubles all(state_->hessian_pattern.nnz());
  evaluate_model(*state_, x.data(), w.data(), nullptr, nullptr, all.data());
  gather(state_->hessian, all.data(), values.data());
}
template <class Base>
void GenericModel<Base>::spread_jacobian(In x, Out J) const {
  require_created(*state_, choice().sparse_jacobian, "SparseJacobian");
  require_size(*state_, "x", x.size(), Domain());
  require_size(*state_, "the Jacobian", J.size(), Range() * Domain());
  StackDoubles all(state_->jacobian_pattern.nnz());
  evaluate_model(*state_, x.data(), nullptr, nullptr, all.data(), nullptr);
  spread(state_->jacobian, all.data(), Domain(), J);
}
template <class Base>
void GenericModel<Base>::spread_hessian(In x, In w, Out H) const {
  require_created(*state_, choice().sparse_hessian, "SparseHessian");
  require_size(*state_, "x", x.size(), Domain());
  require_size(*state_, "w", w.size(), Range());
  require_size(*state_, "the Hessian", H.size(), Domain() * Domain());
  StackDoubles all(state_->hessian_pattern.nnz());
  evaluate_model(*state_, x.data(), w.data(), nullptr, nullptr, all.data());
  spread(state_->hessian, all.data(), Domain(), H);
}
template <class Base>
Doubles GenericModel<Base>::weight(std::size_t i) const {
  if (i >= Range())
    detail::refuse("model \"" + state_->name + "\": result " + std::to_string(i) +
                   " does not exist; there are " + std::to_string(Range()));
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
