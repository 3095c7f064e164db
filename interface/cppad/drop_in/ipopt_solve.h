// SPDX-License-Identifier: BSD-3-Clause
//
// The content of <cppad/ipopt/solve.hpp>: minimises fg[0] with Ipopt, subject to bounds on x and on fg[1], fg[2], ...
//
//   struct FgEval {
//     using ADvector = CppAD::vector<CppAD::AD<double>>;
//     void operator()(ADvector& fg, const ADvector& x);
//   };
//   CppAD::ipopt::solve_result<CppAD::vector<double>> solution;
//   CppAD::ipopt::solve("Integer print_level 0\nNumeric tol 1e-9\n", xi, xl, xu, gl, gu, fg_eval, solution);
//
// A line of options is `Integer`, `Numeric` or `String` with the name and the value of an option of Ipopt,
// `Retape true` or `false`, or `Sparse true forward`, `Sparse true reverse` or `Sparse false`.  With
// `Retape true` each point is recorded, with dense derivatives.  Otherwise the recording at xi is used for all points,
// always with sparse derivatives.  ArgumentError: sizes differ, or an option does not exist.  Exceptions of fg_eval
// are passed on.
//
// A program that includes this header links dyntape::cppad_ipopt, or Ipopt by itself.  New code uses
// interface/control/ipopt/ipopt.h.
#pragma once

#ifndef HAVE_CSTDDEF
#define HAVE_CSTDDEF  // Ipopt's headers before 3.13 need it
#endif
#if __has_include(<IpTNLP.hpp>)
#include <IpIpoptApplication.hpp>
#include <IpTNLP.hpp>
#elif __has_include(<coin-or/IpTNLP.hpp>)
#include <coin-or/IpIpoptApplication.hpp>
#include <coin-or/IpTNLP.hpp>
#else
#include <coin/IpIpoptApplication.hpp>
#include <coin/IpTNLP.hpp>
#endif

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include <dyntape/interface/cppad/drop_in/drop_in.h>

namespace CppAD::inline dyntape_names::ipopt {

template <class Dvector>
class solve_result {
 public:
  enum status_type {
    not_defined,
    success,
    maxiter_exceeded,
    stop_at_tiny_step,
    stop_at_acceptable_point,
    local_infeasibility,
    user_requested_stop,
    feasible_point_found,
    diverging_iterates,
    restoration_failure,
    error_in_step_computation,
    invalid_number_detected,
    too_few_degrees_of_freedom,
    internal_error,
    unknown
  };

  status_type status = not_defined;
  Dvector x, zl, zu;  // the variables, and the multipliers of their lower and upper bounds
  Dvector g, lambda;  // the constraints, and their multipliers
  double obj_value = 0;
};

namespace detail {

using Sizes = vector<std::size_t>;
using Doubles = vector<double>;
using CppAD::detail::refuse;

// Sets the options of Ipopt, and returns whether each point is recorded.
inline bool read_options(const std::string& text, Ipopt::OptionsList& options) {
  bool retape = false, sparse = false;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string kind, name, value;
    if (!(words >> kind)) continue;
    words >> name >> value;
    bool known = false;
    if (kind == "Retape" || kind == "Sparse") {
      known = name == "true" || name == "false";
      (kind == "Retape" ? retape : sparse) = name == "true";
      if (kind == "Sparse" && sparse) known = value == "forward" || value == "reverse";
    } else if (kind == "String") {
      known = options.SetStringValue(name, value);
    } else if (kind == "Numeric") {
      known = options.SetNumericValue(name, std::atof(value.c_str()));
    } else if (kind == "Integer") {
      known = options.SetIntegerValue(name, std::atoi(value.c_str()));
    }
    if (!known) refuse("ipopt::solve: the option \"" + line + "\" does not exist or has a wrong value");
  }
  if (retape && sparse) refuse("ipopt::solve: Retape and Sparse are both true, expected at most one");
  return retape;
}

inline sparse_rc<Sizes> dense_pattern(std::size_t nr, std::size_t nc) {
  sparse_rc<Sizes> pattern(nr, nc, nr * nc);
  for (std::size_t k = 0; k < nr * nc; ++k) pattern.set(k, k / nc, k % nc);
  return pattern;
}

// The entries of a pattern from this row on, without the upper triangle if `lower`.
inline sparse_rcv<Sizes, Doubles> part_of(const sparse_rc<Sizes>& pattern, std::size_t first_row,
                                          bool lower) {
  std::vector<std::size_t> chosen;
  for (std::size_t k = 0; k < pattern.nnz(); ++k) {
    if (pattern.row()[k] >= first_row && !(lower && pattern.col()[k] > pattern.row()[k])) chosen.push_back(k);
  }
  sparse_rc<Sizes> part(pattern.nr(), pattern.nc(), chosen.size());
  for (std::size_t k = 0; k < chosen.size(); ++k)
    part.set(k, pattern.row()[chosen[k]], pattern.col()[chosen[k]]);
  return sparse_rcv<Sizes, Doubles>(part);
}

// The problem as Ipopt asks for it.
template <class Dvector, class FgEval>
class Problem : public Ipopt::TNLP {
 public:
  using Number = Ipopt::Number;
  using Index = Ipopt::Index;

  Problem(const Dvector& xi, const Dvector& xl, const Dvector& xu, const Dvector& gl, const Dvector& gu,
          FgEval& fg_eval, bool retape, solve_result<Dvector>& solution)
      : xi_(xi), xl_(xl), xu_(xu), gl_(gl), gu_(gu), fg_eval_(fg_eval), retape_(retape), solution_(solution) {
    for (std::size_t j = 0; j < n(); ++j) x_.push_back(xi[j]);
    record();
    if (retape_) {
      jacobian_pattern_ = dense_pattern(1 + m(), n());
      hessian_pattern_ = dense_pattern(n(), n());
    } else {
      const vector<bool> all_x(n(), true), all_fg(1 + m(), true);
      fg_.subgraph_jac_rev(all_x, all_fg, x_, jacobian_);
      jacobian_pattern_ = jacobian_.pat();
      fg_.for_hes_sparsity(all_x, all_fg, false, hessian_pattern_);
    }
    jacobian_ = part_of(jacobian_pattern_, 1, false);
    hessian_ = part_of(hessian_pattern_, 0, true);
  }

  bool get_nlp_info(Index& n_x, Index& n_g, Index& n_jacobian, Index& n_hessian,
                    IndexStyleEnum& style) override {
    n_x = Index(n()), n_g = Index(m());
    n_jacobian = Index(jacobian_.nnz()), n_hessian = Index(hessian_.nnz());
    style = C_STYLE;
    return true;
  }
  bool get_bounds_info(Index, Number* xl, Number* xu, Index, Number* gl, Number* gu) override {
    for (std::size_t j = 0; j < n(); ++j) xl[j] = xl_[j], xu[j] = xu_[j];
    for (std::size_t i = 0; i < m(); ++i) gl[i] = gl_[i], gu[i] = gu_[i];
    return true;
  }
  bool get_starting_point(Index, bool needs_x, Number* x, bool needs_z, Number*, Number*, Index,
                          bool needs_lambda, Number*) override {
    for (std::size_t j = 0; needs_x && j < n(); ++j) x[j] = xi_[j];
    return !needs_z && !needs_lambda;
  }
  bool eval_f(Index, const Number* x, bool, Number& f) override {
    go_to(x);
    f = values_[0];
    return true;
  }
  bool eval_grad_f(Index, const Number* x, bool, Number* gradient) override {
    go_to(x);
    const Doubles slopes = fg_.RevOne(x_, 0);
    std::copy_n(slopes.data(), n(), gradient);
    return true;
  }
  bool eval_g(Index, const Number* x, bool, Index, Number* g) override {
    go_to(x);
    std::copy_n(values_.data() + 1, m(), g);
    return true;
  }
  bool eval_jac_g(Index, const Number* x, bool, Index, Index, Index* row, Index* col,
                  Number* values) override {
    if (!values) return write_pattern(jacobian_, 1, row, col);
    go_to(x);
    if (retape_) {
      const Doubles dense = fg_.Jacobian(x_);
      std::copy_n(dense.data() + n(), m() * n(), values);
    } else {
      fg_.sparse_jac_rev(x_, jacobian_, jacobian_pattern_, "cppad", jacobian_work_);
      std::copy_n(jacobian_.val().data(), jacobian_.nnz(), values);
    }
    return true;
  }
  bool eval_h(Index, const Number* x, bool, Number factor, Index, const Number* lambda, bool, Index,
              Index* row, Index* col, Number* values) override {
    if (!values) return write_pattern(hessian_, 0, row, col);
    go_to(x);
    Doubles w(1 + m());
    w[0] = factor;
    std::copy_n(lambda, m(), w.data() + 1);
    if (retape_) {
      const Doubles dense = fg_.Hessian(x_, w);
      for (std::size_t k = 0; k < hessian_.nnz(); ++k)
        values[k] = dense[hessian_.row()[k] * n() + hessian_.col()[k]];
    } else {
      fg_.sparse_hes(x_, w, hessian_, hessian_pattern_, "cppad.symmetric", hessian_work_);
      std::copy_n(hessian_.val().data(), hessian_.nnz(), values);
    }
    return true;
  }
  void finalize_solution(Ipopt::SolverReturn status, Index, const Number* x, const Number* zl,
                         const Number* zu, Index, const Number* g, const Number* lambda, Number f,
                         const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override {
    solution_.status = status_of(status);
    solution_.obj_value = f;
    const auto copy = [](const Number* from, std::size_t count, Dvector& to) {
      to.resize(count);
      for (std::size_t i = 0; i < count; ++i) to[i] = from[i];
    };
    copy(x, n(), solution_.x), copy(zl, n(), solution_.zl), copy(zu, n(), solution_.zu);
    copy(g, m(), solution_.g), copy(lambda, m(), solution_.lambda);
  }

 private:
  std::size_t n() const { return xi_.size(); }
  std::size_t m() const { return gl_.size(); }

  void record() {
    typename FgEval::ADvector x(n()), fg(1 + m());
    for (std::size_t j = 0; j < n(); ++j) x[j] = x_[j];
    Independent(x);
    try {
      fg_eval_(fg, x);
      fg_.Dependent(x, fg);
    } catch (...) {
      AD<double>::abort_recording();
      throw;
    }
    fg_.optimize("no_compare_op");
    values_ = fg_.Forward(0, x_);
  }
  void go_to(const Number* x) {
    if (std::equal(x_.begin(), x_.end(), x)) return;
    std::copy_n(x, n(), x_.data());
    if (retape_)
      record();
    else
      values_ = fg_.Forward(0, x_);
  }
  static bool write_pattern(const sparse_rcv<Sizes, Doubles>& matrix, std::size_t first_row, Index* row,
                            Index* col) {
    for (std::size_t k = 0; k < matrix.nnz(); ++k)
      row[k] = Index(matrix.row()[k] - first_row), col[k] = Index(matrix.col()[k]);
    return true;
  }
  static typename solve_result<Dvector>::status_type status_of(Ipopt::SolverReturn status) {
    using Result = solve_result<Dvector>;
    static constexpr std::pair<Ipopt::SolverReturn, typename Result::status_type> kKnown[] = {
        {Ipopt::SUCCESS, Result::success},
        {Ipopt::MAXITER_EXCEEDED, Result::maxiter_exceeded},
        {Ipopt::STOP_AT_TINY_STEP, Result::stop_at_tiny_step},
        {Ipopt::STOP_AT_ACCEPTABLE_POINT, Result::stop_at_acceptable_point},
        {Ipopt::LOCAL_INFEASIBILITY, Result::local_infeasibility},
        {Ipopt::USER_REQUESTED_STOP, Result::user_requested_stop},
        {Ipopt::FEASIBLE_POINT_FOUND, Result::feasible_point_found},
        {Ipopt::DIVERGING_ITERATES, Result::diverging_iterates},
        {Ipopt::RESTORATION_FAILURE, Result::restoration_failure},
        {Ipopt::ERROR_IN_STEP_COMPUTATION, Result::error_in_step_computation},
        {Ipopt::INVALID_NUMBER_DETECTED, Result::invalid_number_detected},
        {Ipopt::TOO_FEW_DEGREES_OF_FREEDOM, Result::too_few_degrees_of_freedom},
        {Ipopt::INTERNAL_ERROR, Result::internal_error}};
    for (const auto& [theirs, ours] : kKnown) {
      if (theirs == status) return ours;
    }
    return Result::unknown;
  }

  const Dvector &xi_, &xl_, &xu_, &gl_, &gu_;
  FgEval& fg_eval_;
  const bool retape_;
  solve_result<Dvector>& solution_;

  ADFun<double> fg_;
  Doubles x_, values_;  // the last point, and fg there
  sparse_rc<Sizes> jacobian_pattern_, hessian_pattern_;
  sparse_rcv<Sizes, Doubles> jacobian_, hessian_;
  sparse_jac_work jacobian_work_;
  sparse_hes_work hessian_work_;
};

}  // namespace detail

template <class Dvector, class FgEval>
void solve(const std::string& options, const Dvector& xi, const Dvector& xl, const Dvector& xu,
           const Dvector& gl, const Dvector& gu, FgEval& fg_eval, solve_result<Dvector>& solution) {
  if (xi.size() == 0 || xl.size() != xi.size() || xu.size() != xi.size() || gu.size() != gl.size())
    detail::refuse("ipopt::solve: xi, xl and xu have " + std::to_string(xi.size()) + ", " +
                   std::to_string(xl.size()) + " and " + std::to_string(xu.size()) + " entries, gl and gu " +
                   std::to_string(gl.size()) + " and " + std::to_string(gu.size()) +
                   ", expected the same sizes");
  Ipopt::SmartPtr<Ipopt::IpoptApplication> application = new Ipopt::IpoptApplication();
  application->RethrowNonIpoptException(true);
  solution.status = solve_result<Dvector>::not_defined;
  const bool retape = detail::read_options(options, *application->Options());
  if (application->Initialize() != Ipopt::Solve_Succeeded)
    detail::refuse("ipopt::solve: Ipopt does not start with these options");
  application->OptimizeTNLP(
      new detail::Problem<Dvector, FgEval>(xi, xl, xu, gl, gu, fg_eval, retape, solution));
}

}  // namespace CppAD::inline dyntape_names::ipopt
