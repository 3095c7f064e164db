// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/discretize/mesh_size.h>

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <climits>
#include <cstdio>

#include <dyntape/autodiff/error.h>

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

void check_size(const std::string& problem, std::size_t intervals, double each) {
  const double numbers = double(intervals) * each;
  const double memory = dyntape::memory(), most = std::min(kMostNumbers, memory / kBytesOfNumber);
  if (numbers <= most) return;
  throw ArgumentError(
      "problem \"" + problem + "\": " + std::to_string(intervals) + " intervals make " + rounded(numbers) +
      " variables, constraints and non-zeros, for which a solve asks for " +
      rounded(numbers * kBytesOfNumber / 1e9) + " GB of memory, where there are " + rounded(memory / 1e9) +
      "; expected at most " + std::to_string(static_cast<long>(most / each)) + " intervals");
}

}  // namespace dyntape
