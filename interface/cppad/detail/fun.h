// SPDX-License-Identifier: BSD-3-Clause
//
// The implementation of ADFun for std::vector; the templates of ad_fun.h convert other vectors.  Compiled once for
// each base (fun.cpp).
#pragma once

#include <array>
#include <cstddef>
#include <iosfwd>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <dyntape/autodiff/graph/pattern.h>
#include <dyntape/interface/cppad/detail/entries.h>
#include <dyntape/interface/cppad/detail/recording.h>
#include <dyntape/interface/cppad/graph/hessian_products.h>

namespace CppAD::inline dyntape_names::detail {

template <class Base>
class Fun {
 public:
  using Values = std::vector<Base>;

  explicit Fun(std::shared_ptr<const Recording<Base>> recording);
  ~Fun();
  Fun(const Fun& other);
  Fun& operator=(const Fun&) = delete;

  const Recording<Base>& recording() const { return *recording_; }
  std::shared_ptr<const Recording<Base>> shared() const { return recording_; }
  std::size_t domain() const;
  std::size_t range() const { return recording_->range; }
  bool is_parameter(std::size_t i);  // a result that depends on no variable
  const RecordingSizes& sizes();
  void new_dynamic(const Values& p);
  const Values& dynamics() const { return dynamics_; }

  // --- Taylor coefficients ---
  Values forward(std::size_t q, const Values& xq, std::ostream& out);
  Values forward(std::size_t q, std::size_t r, const Values& xq);
  Values reverse(std::size_t q, const Values& w);
  void start_at(const Values& x);  // order zero, evaluated when somebody needs it
  std::size_t orders() const { return orders_; }
  std::size_t directions() const { return orders_ == 0 ? 0 : inputs_.size(); }
  void keep_orders(std::size_t n);
  std::size_t capacity() const { return capacity_; }

  // --- dense derivatives ---
  Values jacobian(const Values& x);
  Values hessian(const Values& x, const Values& w);
  Values for_one(const Values& x, std::size_t j);
  Values rev_one(const Values& x, std::size_t i);
  Values for_two(const Values& x, const std::vector<std::size_t>& j, const std::vector<std::size_t>& k);
  Values rev_two(const Values& x, const std::vector<std::size_t>& i, const std::vector<std::size_t>& j);

  // --- sparse ones: the values of the entries, and how many sweeps they took ---
  Pattern jacobian_pattern(bool dependency) const;
  Pattern hessian_pattern(const std::vector<bool>& of_range) const;  // both triangles
  // jacobian_pattern(), found once until forget_patterns().
  const Pattern& kept_pattern(bool dependency);
  std::size_t kept_bytes() const;
  void forget_patterns() { kept_patterns_ = {}; }
  // The pattern is read where colors are empty.
  std::size_t sparse_jacobian(const Values& x, const Entries& entries, const Pattern& pattern, bool forward,
                              Colors& colors, Values& values);
  std::size_t sparse_hessian(const Values& x, const Values& w, const Entries& entries, const Pattern& pattern,
                             bool use_symmetry, Colors& colors, Values& values);
  // The slopes of output i in the selected variables, their places ascending: by the nodes that it depends on.
  void subgraph_reverse(std::size_t q, std::size_t i, const std::vector<bool>& domain,
                        std::vector<std::size_t>& col, Values& dw);

  // --- branches ---
  void count_changes(std::size_t from) { change_count_ = from; }
  std::size_t changes() const;
  std::size_t change_op_index() const;
  std::size_t count_of(std::size_t guard) const;  // comparisons of the program that it stands for
  void check_for_nan(bool yes) { checks_nan_ = yes, told_nan_ = true; }
  bool checks_nan() const { return checks_nan_; }

  // --- the function ---
  void optimize(bool without_compare, bool without_print);
  bool& throws_on_change() { return throws_on_change_; }

 private:
  struct Run;  // Taylor sweeps, a direction each

  void check_size(const char* what, std::size_t got, std::size_t expected) const;
  void run_all();
  void after_order_zero(std::ostream& out);
  void check_numbers(const Values& y) const;
  Values slopes(const std::vector<Base>& direction);  // along it, at the present point
  // The gradient of w . (J direction), direction by direction.
  Values second_order(const Values& directions, const Values& w);

  std::shared_ptr<const Recording<Base>> recording_;
  std::vector<std::vector<Values>> inputs_;  // of each direction, order by order
  std::size_t orders_ = 0, capacity_ = 0;
  Values dynamics_;
  std::vector<std::unique_ptr<Run>> runs_;  // one a direction
  bool stale_ = true;                       // inputs have changed since they ran
  std::optional<RecordingSizes> sizes_;     // found when somebody asks, as the next two are
  std::optional<std::vector<bool>> is_parameter_;
  std::unique_ptr<HessianProducts> products_;            // and this one, which optimize() forgets
  std::size_t swept_ = 0;                                // directions, before it is made
  std::array<std::optional<Pattern>, 2> kept_patterns_;  // of slopes, of dependencies
  std::size_t change_count_ = 1;
  bool checks_nan_ = true, told_nan_ = false, throws_on_change_ = false;
};

// The same function of recorded values.
template <class Base>
std::shared_ptr<Fun<AD<Base>>> on_recorded(const Fun<Base>& fun);

}  // namespace CppAD::inline dyntape_names::detail
