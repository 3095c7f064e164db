// SPDX-License-Identifier: BSD-3-Clause
//
// Records a function with CppAD's calls, and evaluates the function and its derivatives.
//
//   std::vector<AD<double>> ax{1.0, 2.0}, ay(1);
//   Independent(ax);
//   ay[0] = ax[0] * sin(ax[1]);
//   ADFun<double> f(ax, ay);
//   f.Forward(0, x);  f.Forward(1, dx);  f.Reverse(2, w);     // any order, by autodiff/evaluate/taylor.h
//   f.Jacobian(x);    f.Hessian(x, 0);                         // dense, row by row
//
// Vectors: any class with value_type, size(), [] and resize().  Coefficients are Taylor coefficients: derivatives
// divided by factorials.  ArgumentError: wrong sizes or orders.  RecordingError: calls that a recording forbids.
// Both are checked in every build.
//
// An ADFun stores the coefficients of its last evaluation: use one object for each thread, or to_library()
// (library.h).
#pragma once

#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <dyntape/interface/cppad/ad.h>
#include <dyntape/interface/cppad/detail/fun.h>
#include <dyntape/interface/cppad/graph/cpp_graph.h>
#include <dyntape/interface/cppad/sparse_calls.h>

namespace CppAD::inline dyntape_names {

namespace detail {

// The place of a call, for error messages.
struct Place {
  const char* file;
  int line;
  Place(const char* f = __builtin_FILE(), int l = __builtin_LINE()) : file(f), line(l) {}  // NOLINT
};

template <class Vector>
using Entry = std::remove_cvref_t<decltype(std::declval<Vector&>()[0])>;

template <class Vector>
std::vector<Entry<Vector>> entries_of(const Vector& v) {
  return copied<std::vector<Entry<Vector>>>(v);
}

template <class ADVector, class DynamicVector>
void begin_recording_of(ADVector& x, DynamicVector& dynamic, const Begin& begin) {
  auto of_x = entries_of(x);
  auto of_dynamic = entries_of(dynamic);
  begin_recording(of_x.data(), of_x.size(), of_dynamic.data(), of_dynamic.size(), begin);
  for (std::size_t i = 0; i < of_x.size(); ++i) x[i] = of_x[i];
  for (std::size_t i = 0; i < of_dynamic.size(); ++i) dynamic[i] = of_dynamic[i];
}

}  // namespace detail

// Begins a recording in this thread.
//   x                the entries become variables
//   dynamic          the entries become parameters; new_dynamic() changes their values
//   abort_op_index   if not 0, the recording throws at this operation
//   record_compare   if false, comparisons leave no guards
template <class ADVector>
void Independent(ADVector& x, detail::Place place = {}) {
  std::vector<detail::Entry<ADVector>> none;
  detail::begin_recording_of(x, none, {0, true, place.file, place.line});
}
template <class ADVector>
requires(!std::is_arithmetic_v<ADVector>) void Independent(ADVector& x, ADVector& dynamic,
                                                           detail::Place place = {}) {
  detail::begin_recording_of(x, dynamic, {0, true, place.file, place.line});
}
template <class ADVector>
void Independent(ADVector& x, std::size_t abort_op_index, bool record_compare = true,
                 detail::Place place = {}) {
  std::vector<detail::Entry<ADVector>> none;
  detail::begin_recording_of(x, none, {abort_op_index, record_compare, place.file, place.line});
}
template <class ADVector>
void Independent(ADVector& x, std::size_t abort_op_index, bool record_compare, ADVector& dynamic,
                 detail::Place place = {}) {
  detail::begin_recording_of(x, dynamic, {abort_op_index, record_compare, place.file, place.line});
}

// Records a print: if flag is not positive, order-zero Forward prints `before`, the value and `after`.
template <class Base>
void PrintFor(const AD<Base>& flag, const char* before, const AD<Base>& value, const char* after) {
  detail::record_print(flag, before, value, after);
}
template <class Base>
void PrintFor(const char* before, const AD<Base>& value) {
  detail::record_print(AD<Base>(0), before, value, "");
}

// Reads the variables with which a result was NaN.  `file` is the name in the message that the error handler got.
template <class Base>
void get_check_for_nan(vector<Base>& vec, const std::string& file) {
  detail::read_temporary(file, vec.data(), vec.size() * sizeof(Base));
}

template <class Base, class RecBase = Base>
class ADFun : public detail::SparseCalls<ADFun<Base, RecBase>, Base> {
 public:
  using value_type = Base;
  using Size = std::size_t;

  ADFun() = default;
  // Ends the recording that Independent(x) began, with results y; order zero of Forward is available.
  template <class ADVector>
  ADFun(const ADVector& x, const ADVector& y) {
    Dependent(x, y);
    fun_->start_at(fun_->recording().variables);
  }
  explicit ADFun(std::shared_ptr<detail::Fun<Base>> fun) : fun_(std::move(fun)) {}
  ADFun(ADFun&&) noexcept = default;
  ADFun& operator=(ADFun&&) noexcept = default;
  ADFun(const ADFun&) = delete;  // as in CppAD; assignment copies
  ADFun& operator=(const ADFun& other) {
    if (this == &other) return *this;
    Sparse::operator=(other);
    fun_ = other.fun_ ? std::make_shared<detail::Fun<Base>>(*other.fun_) : nullptr;
    name_ = other.name_;
    return *this;
  }
  void swap(ADFun& other) { std::swap(*this, other); }

  template <class ADVector>
  void Dependent(const ADVector& x, const ADVector& y) {
    const auto of_x = detail::entries_of(x), of_y = detail::entries_of(y);
    fun_ = std::make_shared<detail::Fun<Base>>(
        detail::end_recording(of_x.data(), of_x.size(), of_y.data(), of_y.size()));
  }
  template <class ADVector>
  void Dependent(const ADVector& y) {
    const auto of_y = detail::entries_of(y);
    const AD<Base>* const any = nullptr;
    fun_ = std::make_shared<detail::Fun<Base>>(detail::end_recording(any, 0, of_y.data(), of_y.size()));
  }

  // --- names and sizes ---
  Size Domain() const { return fun_ ? fun_->domain() : 0; }
  Size Range() const { return fun_ ? fun_->range() : 0; }
  bool Parameter(Size i) const {
    detail::check_index("Parameter: result", i, Range());
    return core().is_parameter(i);
  }
  void function_name_set(const std::string& name) { name_ = name; }
  const std::string& function_name_get() const { return name_; }
  // Numbers of nodes of this project's graph without unused nodes; CppAD's numbers differ.
  Size size_var() const { return sizes().variables; }
  Size size_op() const { return sizes().operations; }
  Size size_op_arg() const { return sizes().arguments; }
  Size size_par() const { return sizes().constants + sizes().dynamics; }
  Size size_dyn_ind() const { return fun_ ? fun_->dynamics().size() : 0; }
  Size size_dyn_par() const { return sizes().dynamics; }
  Size size_dyn_arg() const { return sizes().dynamic_arguments; }
  Size size_text() const { return sizes().text; }
  // Arrays with recorded indices are recorded as conditions on elements.
  bool use_VecAD() const { return false; }
  Size size_VecAD() const { return 0; }
  Size size_op_seq() const { return sizes().operations * 16 + sizes().constants * sizeof(Base); }
  Size number_skip() const { return 0; }
  bool exceed_collision_limit() const { return false; }

  // --- Taylor coefficients ---
  // xq (n): order q alone; (n (q + 1)): all orders to q, [j (q + 1) + k].  PrintFor prints to s.
  template <class Vector>
  Vector Forward(Size q, const Vector& xq, std::ostream& s = std::cout) {
    return made<Vector>(core().forward(q, values(xq), s));
  }
  // r directions: xq (n r), [r j + l].
  template <class Vector>
  Vector Forward(Size q, Size r, const Vector& xq) {
    return made<Vector>(core().forward(q, r, values(xq)));
  }
  // Differentiates a weighted sum W of coefficients by the coefficients x_j^(k) of the variables; returns dw (n q).
  // Needs Forward up to order q - 1.
  //   w (m)            W = sum of w[i] y_i^(q - 1), dw[j q + q - 1 - k] = dW/dx_j^(k).  After Forward(1, dx) and with
  //                    q = 2, dw[2 j] is dW/dx_j^(1), and dw[2 j + 1] is entry j of the Hessian of w . y times dx
  //   w (m q), q > 1   W = sum of w[i q + k] y_i^(k), dw[j q + k] = dW/dx_j^(k)
  template <class Vector>
  Vector Reverse(Size q, const Vector& w) {
    return made<Vector>(core().reverse(q, values(w)));
  }
  void capacity_order(Size c) { core().keep_orders(c); }
  void capacity_order(Size c, Size) { core().keep_orders(c); }
  Size capacity_order() const { return fun_ ? fun_->capacity() : 0; }
  Size size_order() const { return fun_ ? fun_->orders() : 0; }
  Size size_direction() const { return fun_ ? fun_->directions() : 0; }
  Size size_taylor() const { return size_order(); }
  Size Order() const { return size_order() - 1; }  // an older name
  template <class Vector>
  void new_dynamic(const Vector& dynamic) {
    core().new_dynamic(values(dynamic));
  }

  // --- dense derivatives ---
  template <class Vector>
  Vector Jacobian(const Vector& x) {
    return made<Vector>(core().jacobian(values(x)));
  }
  template <class Vector>
  Vector Hessian(const Vector& x, const Vector& w) {
    return made<Vector>(core().hessian(values(x), values(w)));
  }
  template <class Vector>
  Vector Hessian(const Vector& x, Size i) {
    detail::check_index("Hessian: result", i, Range());
    std::vector<Base> w(Range(), Base(0));
    w[i] = Base(1);
    return made<Vector>(core().hessian(values(x), w));
  }
  template <class Vector>
  Vector ForOne(const Vector& x, Size j) {
    return made<Vector>(core().for_one(values(x), j));
  }
  template <class Vector>
  Vector RevOne(const Vector& x, Size i) {
    return made<Vector>(core().rev_one(values(x), i));
  }
  template <class Vector, class SizeVector>
  Vector ForTwo(const Vector& x, const SizeVector& j, const SizeVector& k) {
    return made<Vector>(core().for_two(values(x), detail::sizes_of(j), detail::sizes_of(k)));
  }
  template <class Vector, class SizeVector>
  Vector RevTwo(const Vector& x, const SizeVector& i, const SizeVector& j) {
    return made<Vector>(core().rev_two(values(x), detail::sizes_of(i), detail::sizes_of(j)));
  }

  // --- branches and numbers ---
  void compare_change_count(Size count) { core().count_changes(count); }
  Size compare_change_number() const { return core().changes(); }
  Size compare_change_op_index() const { return core().change_op_index(); }  // 0 after optimize()
  Size CompareChange() const { return core().changes(); }
  // Not in CppAD: if set, Forward throws GuardViolation with the place of the comparison instead of counting.
  void check_branches(bool yes) { core().throws_on_change() = yes; }
  // If set, order-zero Forward throws NumericalError if a result is NaN, and names the operation.  If the program
  // installed an ErrorHandler, the handler gets CppAD's message with the file for get_check_for_nan() before.
  void check_for_nan(bool yes) { core().check_for_nan(yes); }
  bool check_for_nan() const { return core().checks_nan(); }

  // --- other functions ---
  // The graph is optimised during the recording.  This call only removes comparisons and prints, as the options say.
  void optimize(const std::string& options = "") {
    const bool without_compare = detail::read_optimize_options(options, "no_compare_op");
    core().optimize(without_compare, detail::read_optimize_options(options, "no_print_for_op"));
  }
  ADFun<AD<Base>, RecBase> base2ad() const requires(detail::IsBase<AD<Base>>) {
    return ADFun<AD<Base>, RecBase>(detail::on_recorded(core()));
  }

  // f(x) = y(x, a(x)) with a(x) the absolute values in f: g(x, u) is (y(x, u), z(x, u)), and a(x) = |z(x, a(x))|.
  void abs_normal_fun(ADFun& g, ADFun& a) const {
    check_graphs();
    const auto parts = detail::abs_normal_of(core().recording());
    g = ADFun(std::make_shared<detail::Fun<Base>>(parts.g));
    a = ADFun(std::make_shared<detail::Fun<Base>>(parts.a));
  }
  // Writes C of int cppad_jit_NAME(size_t nu, const double* u, size_t ny, double* y, size_t* compare_change).
  //   u                the dynamic parameters, then the variables
  //   compare_change   the function adds the number of comparisons with another result than at the recording point
  //   type             "double" or "float"
  // Atomic and discrete functions are calls of C functions of the user:
  //   int cppad_atomic_NAME(size_t call_id, size_t nx, const double* x, size_t ny, double* y, size_t* compare_change);
  //   double cppad_discrete_NAME(const double x);
  // to_library() (library.h) also compiles, caches and differentiates.
  void to_csrc(std::ostream& out, const std::string& type) const requires(std::is_floating_point_v<Base>) {
    const auto& recording = core().recording();
    detail::write_csrc(out, *recording.function, recording.kernels, recording.guard_counts, Range(), name_,
                       type);
  }

  // --- CppAD's formats (graph/cpp_graph.h): written by ADFun<double>, read by ADFun<double> and ADFun<AD<double>> ---
  void to_graph(cpp_graph& graph) const {
    check_graphs();
    detail::write_graph(*detail::recording_of_numbers(core().recording(), "to_graph"), graph);
    graph.function_name_set(name_);
  }
  // dyn2var, var2dyn: which parameters become variables, and which variables become parameters; empty: none.
  void from_graph(const cpp_graph& graph, const vector<bool>& dyn2var = {},
                  const vector<bool>& var2dyn = {}) {
    check_graphs();
    fun_ = std::make_shared<detail::Fun<Base>>(detail::read_graph<Base>(graph, dyn2var, var2dyn));
    name_ = graph.function_name_get();
  }
  std::string to_json() const {
    cpp_graph graph;
    to_graph(graph);
    return graph.to_json();
  }
  void from_json(const std::string& text) { from_graph(cpp_graph::from_json(text)); }

  // --- used by this layer ---
  bool has_function() const { return fun_ != nullptr; }
  detail::Fun<Base>& core() const {
    if (!fun_) detail::refuse_recording("ADFun: the function is empty; nothing has been recorded into it");
    return *fun_;
  }
  const std::shared_ptr<detail::Fun<Base>>& shared_core() const { return fun_; }
  template <class Vector>
  static std::vector<Base> values(const Vector& v) {
    return detail::copied<std::vector<Base>>(v);
  }
  template <class Vector>
  static Vector made(const std::vector<Base>& values) {
    return detail::copied<Vector>(values);
  }

 private:
  detail::RecordingSizes sizes() const { return fun_ ? fun_->sizes() : detail::RecordingSizes{}; }

  static void check_graphs() {
    static_assert(
        detail::kIsCompiled<Base> && detail::kIsReal<Base>,
        "to_graph, from_graph, to_json, from_json and abs_normal_fun: Base is float, double, AD<double> or "
        "AD<AD<double>>, because the constants of graphs are doubles");
  }

  using Sparse = detail::SparseCalls<ADFun<Base, RecBase>, Base>;
  std::shared_ptr<detail::Fun<Base>> fun_;
  std::string name_;
};

}  // namespace CppAD::inline dyntape_names
