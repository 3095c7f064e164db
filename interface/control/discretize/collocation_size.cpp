// SPDX-License-Identifier: BSD-3-Clause
//
// A program that is too large is refused before memory is spent on it.
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <climits>
#include <cstdio>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/discretize/collocation.h>

namespace dyntape {

namespace {

// What a solve asks the system for, by variable, constraint and non-zero; measured on meshes of 3000 to 100 000
// intervals.  A quarter is used, the rest is room that the linear solver keeps for fill-in.
constexpr double kBytesOfNumber = 700;
constexpr double kMostNumbers = INT_MAX;  // the solver counts with int

// Bytes that this process may ever have.
double memory() {
  const double machine = double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGE_SIZE));
  struct rlimit limit {};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return machine;
  return std::min(machine, double(limit.rlim_cur));
}

std::string rounded(double number) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g", number);
  return text;
}

}  // namespace

// Variables, constraints and non-zeros of an interval.
double Collocation::numbers_of_interval() const {
  const auto terms = [](const Eigen::MatrixXd& weights) { return double((weights.array() != 0).count()); };
  double of_point = double(n_z_ + stage_.path_rows.size()), of_rates = 0;
  const CompiledFunction& node = functions_->node();
  for (std::size_t row : node.jacobian_pattern().row) (row < n_x_ ? of_rates : of_point) += 1;
  if (node.order() == Order::kSecond) of_point += double(node.hessian_pattern().nnz());
  return double(stride_) * of_point + double(rows_ * n_x_) + terms(scheme_.alpha) * double(n_x_) +
         terms(scheme_.beta) * of_rates;
}

void Collocation::check_size() const {
  const double each = numbers_of_interval(), numbers = double(intervals_) * each;
  const double memory = dyntape::memory(), most = std::min(kMostNumbers, memory / kBytesOfNumber);
  if (numbers <= most) return;
  throw ArgumentError(
      "problem \"" + problem_.name + "\": " + std::to_string(intervals_) + " intervals make " +
      rounded(numbers) + " variables, constraints and non-zeros, for which a solve asks for " +
      rounded(numbers * kBytesOfNumber / 1e9) + " GB of memory, where there are " + rounded(memory / 1e9) +
      "; expected at most " + std::to_string(static_cast<long>(most / each)) + " intervals");
}

}  // namespace dyntape
