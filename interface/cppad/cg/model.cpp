// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/cg/model.h>

#include <algorithm>
#include <map>
#include <mutex>

#include <dyntape/interface/cppad/cg/detail/model.hxx>

namespace CppAD::inline dyntape_names::cg {

using Doubles = std::vector<double>;
using Sizes = std::vector<std::size_t>;

namespace {

// Memory lent to a call.
class LentWork {
 public:
  explicit LentWork(const ModelState& state) : state_(state) {
    is_first_ = !state.is_first_taken.exchange(true, std::memory_order_acquire);
    if (is_first_) {
      if (!state.first) state.first = std::make_unique<ModelState::Work>(state.function);
      work_ = state.first.get();
      return;
    }
    const std::scoped_lock lock(state.mutex);
    if (!state.others.empty()) other_ = std::move(state.others.back()), state.others.pop_back();
    if (!other_) other_ = std::make_unique<ModelState::Work>(state.function);
    work_ = other_.get();
  }
  ~LentWork() {
    if (is_first_) {
      state_.is_first_taken.store(false, std::memory_order_release);
    } else {
      const std::scoped_lock lock(state_.mutex);
      state_.others.push_back(std::move(other_));
    }
  }
  LentWork(const LentWork&) = delete;
  LentWork& operator=(const LentWork&) = delete;
  ModelState::Work& operator*() const { return *work_; }

 private:
  const ModelState& state_;
  bool is_first_ = false;
  std::unique_ptr<ModelState::Work> other_;
  ModelState::Work* work_ = nullptr;
};

struct ModelResults {
  Doubles y, jacobian, hessian;
};

void require_created(const ModelState& state, bool created, const char* what) {
  if (!created)
    detail::refuse(std::string(what) + " of model \"" + state.name + "\" was not created; setCreate" + what +
                   "(true) does that");
}

void require_size(const ModelState& state, const char* what, std::size_t got, std::size_t expected) {
  if (got != expected)
    detail::refuse("model \"" + state.name + "\": " + what + " has " + std::to_string(got) +
                   " entries, expected " + std::to_string(expected));
}

// Results that are null are not computed.
void evaluate_model(const ModelState& state, ModelState::Work& work, const double* x, const double* w,
                    double* y, double* jacobian, double* hessian) {
  const CompiledFunction& f = state.function;
  const double* const p = state.recording->dynamics.data();
  if (hessian)
    f.second_order(x, p, w, y, jacobian, hessian, work.workspace);
  else if (jacobian)
    f.first_order(x, p, y, jacobian, work.workspace);
  else
    f.value(x, p, y, work.workspace);
}

ModelResults evaluate_model(const ModelState& state, Order order, const Doubles& x, const Doubles& w = {}) {
  const CompiledFunction& f = state.function;
  require_size(state, "x", x.size(), f.n_x());
  ModelResults r;
  r.y.resize(f.n_y());
  if (order >= Order::kFirst) r.jacobian.resize(f.jacobian_pattern().nnz());
  if (order == Order::kSecond) {
    require_size(state, "w", w.size(), f.n_y());
    r.hessian.resize(f.hessian_pattern().nnz());
  }
  const LentWork work(state);
  evaluate_model(state, *work, x.data(), w.data(), r.y.data(),
                 order >= Order::kFirst ? r.jacobian.data() : nullptr,
                 order == Order::kSecond ? r.hessian.data() : nullptr);
  return r;
}

// The elements that were asked for, into the caller's memory; compute() fills the non-zeros of the pattern.
template <class Compute>
void fill_elements(const ModelState& state, const ModelState::Elements& elements, std::size_t nonzeros,
                   ArrayView<double> values, Compute compute) {
  require_size(state, "the array of values", values.size(), elements.place.size());
  const LentWork work(state);
  if (elements.is_pattern && nonzeros > 0) return compute(*work, values.data());
  (*work).values.resize(std::max<std::size_t>(nonzeros, 1));
  const double* const all = (*work).values.data();
  compute(*work, (*work).values.data());
  for (std::size_t k = 0; k < values.size(); ++k)
    values.data()[k] = elements.place[k] == SIZE_MAX ? 0 : all[elements.place[k]];
}

// From the non-zeros of a pattern to the elements that were asked for.
Doubles elements_of(const Doubles& values, const std::vector<std::size_t>& places) {
  Doubles elements;
  for (std::size_t place : places) elements.push_back(place == SIZE_MAX ? 0 : values[place]);
  return elements;
}

Doubles spread_elements(const Doubles& values, const Sizes& row, const Sizes& col, std::size_t rows,
                        std::size_t cols) {
  Doubles dense(rows * cols, 0.0);
  for (std::size_t k = 0; k < values.size(); ++k) dense[row[k] * cols + col[k]] = values[k];
  return dense;
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

Doubles half(const Doubles& t, std::size_t k) {
  Doubles x;
  for (std::size_t j = k; j < t.size(); j += 2) x.push_back(t[j]);
  return x;
}

// px += J^T py
Doubles transposed_product(const Pattern& pattern, const Doubles& jacobian, const Doubles& py) {
  Doubles px(pattern.cols, 0.0);
  for (std::size_t k = 0; k < pattern.nnz(); ++k) px[pattern.col[k]] += jacobian[k] * py[pattern.row[k]];
  return px;
}

}  // namespace

ModelState::ModelState(std::string n, ModelChoice c, CompiledFunction f,
                       std::shared_ptr<const detail::Recording<double>> r)
    : name(std::move(n)), choice(std::move(c)), function(std::move(f)), recording(std::move(r)) {
  if (function.order() >= Order::kFirst)
    choose_elements(function.jacobian_pattern(), false, choice.jacobian_rows, choice.jacobian_cols, jacobian);
  if (function.order() == Order::kSecond)
    choose_elements(function.hessian_pattern(), true, choice.hessian_rows, choice.hessian_cols, hessian);
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
  return state_->function.n_x();
}
template <class Base>
std::size_t GenericModel<Base>::Range() const {
  return state_->function.n_y();
}
template <class Base>
const ModelChoice& GenericModel<Base>::choice() const {
  return state_->choice;
}

template <class Base>
Doubles GenericModel<Base>::zero(const Doubles& x) const {
  require_created(*state_, choice().forward_zero, "ForwardZero");
  return evaluate_model(*state_, Order::kValue, x).y;
}
template <class Base>
void GenericModel<Base>::write_zero(ArrayView<const double> x, ArrayView<double> y) const {
  require_created(*state_, choice().forward_zero, "ForwardZero");
  require_size(*state_, "x", x.size(), Domain());
  require_size(*state_, "y", y.size(), Range());
  const LentWork work(*state_);
  evaluate_model(*state_, *work, x.data(), nullptr, y.data(), nullptr, nullptr);
}
template <class Base>
void GenericModel<Base>::write_jacobian(ArrayView<const double> x, ArrayView<double> values) const {
  require_created(*state_, choice().sparse_jacobian, "SparseJacobian");
  require_size(*state_, "x", x.size(), Domain());
  fill_elements(*state_, state_->jacobian, state_->function.jacobian_pattern().nnz(), values,
                [&](ModelState::Work& work, double* nonzeros) {
                  evaluate_model(*state_, work, x.data(), nullptr, nullptr, nonzeros, nullptr);
                });
}
template <class Base>
void GenericModel<Base>::write_hessian(ArrayView<const double> x, ArrayView<const double> w,
                                       ArrayView<double> values) const {
  require_created(*state_, choice().sparse_hessian, "SparseHessian");
  require_size(*state_, "x", x.size(), Domain());
  require_size(*state_, "w", w.size(), Range());
  fill_elements(*state_, state_->hessian, state_->function.hessian_pattern().nnz(), values,
                [&](ModelState::Work& work, double* nonzeros) {
                  evaluate_model(*state_, work, x.data(), w.data(), nullptr, nullptr, nonzeros);
                });
}
template <class Base>
Doubles GenericModel<Base>::dense_jacobian(const Doubles& x) const {
  require_created(*state_, choice().jacobian, "Jacobian");
  const Pattern& p = state_->function.jacobian_pattern();
  const Doubles values = evaluate_model(*state_, Order::kFirst, x).jacobian;
  Doubles J(p.rows * p.cols, 0.0);
  for (std::size_t k = 0; k < p.nnz(); ++k) J[p.row[k] * p.cols + p.col[k]] = values[k];
  return J;
}
template <class Base>
Doubles GenericModel<Base>::dense_hessian(const Doubles& x, const Doubles& w) const {
  require_created(*state_, choice().hessian, "Hessian");
  const Pattern& p = state_->function.hessian_pattern();
  const Doubles values = evaluate_model(*state_, Order::kSecond, x, w).hessian;
  Doubles H(p.rows * p.cols, 0.0);
  for (std::size_t k = 0; k < p.nnz(); ++k)
    H[p.row[k] * p.cols + p.col[k]] = H[p.col[k] * p.cols + p.row[k]] = values[k];
  return H;
}
template <class Base>
Doubles GenericModel<Base>::first_order(const Doubles& tx) const {
  require_created(*state_, choice().forward_one, "ForwardOne");
  require_size(*state_, "tx", tx.size(), 2 * Domain());
  const Doubles jacobian = evaluate_model(*state_, Order::kFirst, half(tx, 0)).jacobian, dx = half(tx, 1);
  const Pattern& p = state_->function.jacobian_pattern();
  Doubles dy(p.rows, 0.0);
  for (std::size_t k = 0; k < p.nnz(); ++k) dy[p.row[k]] += jacobian[k] * dx[p.col[k]];
  return dy;
}
template <class Base>
Doubles GenericModel<Base>::adjoint(const Doubles& x, const Doubles& py) const {
  require_created(*state_, choice().reverse_one, "ReverseOne");
  require_size(*state_, "py", py.size(), Range());
  const Doubles jacobian = evaluate_model(*state_, Order::kFirst, x).jacobian;
  return transposed_product(state_->function.jacobian_pattern(), jacobian, py);
}
template <class Base>
Doubles GenericModel<Base>::adjoint_two(const Doubles& tx, const Doubles& py) const {
  require_created(*state_, choice().reverse_two, "ReverseTwo");
  require_size(*state_, "tx", tx.size(), 2 * Domain());
  require_size(*state_, "py", py.size(), 2 * Range());
  const Doubles w = half(py, 1), dx = half(tx, 1);
  const ModelResults r = evaluate_model(*state_, Order::kSecond, half(tx, 0), w);
  const Pattern &J = state_->function.jacobian_pattern(), &H = state_->function.hessian_pattern();
  const Doubles first = transposed_product(J, r.jacobian, w);
  Doubles zeroth = transposed_product(J, r.jacobian, half(py, 0)), px;
  for (std::size_t k = 0; k < H.nnz(); ++k) {
    zeroth[H.row[k]] += r.hessian[k] * dx[H.col[k]];
    if (H.row[k] != H.col[k]) zeroth[H.col[k]] += r.hessian[k] * dx[H.row[k]];
  }
  for (std::size_t j = 0; j < first.size(); ++j) px.insert(px.end(), {zeroth[j], first[j]});
  return px;
}
template <class Base>
Doubles GenericModel<Base>::jacobian_values(const Doubles& x) const {
  require_created(*state_, choice().sparse_jacobian, "SparseJacobian");
  return elements_of(evaluate_model(*state_, Order::kFirst, x).jacobian, state_->jacobian.place);
}
template <class Base>
Doubles GenericModel<Base>::hessian_values(const Doubles& x, const Doubles& w) const {
  require_created(*state_, choice().sparse_hessian, "SparseHessian");
  return elements_of(evaluate_model(*state_, Order::kSecond, x, w).hessian, state_->hessian.place);
}
template <class Base>
Doubles GenericModel<Base>::spread_jacobian(const Doubles& x) const {
  return spread_elements(jacobian_values(x), jacobian_rows(), jacobian_cols(), Range(), Domain());
}
template <class Base>
Doubles GenericModel<Base>::spread_hessian(const Doubles& x, const Doubles& w) const {
  return spread_elements(hessian_values(x, w), hessian_rows(), hessian_cols(), Domain(), Domain());
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
