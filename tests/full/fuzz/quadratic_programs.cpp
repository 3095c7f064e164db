// SPDX-License-Identifier: BSD-3-Clause
//
// quadratic_programs COUNT SEED: random small quadratic programs, each judged by exact arithmetic.  Prints the seed of each that fails.
#include <cstdlib>
#include <iostream>
#include <map>

#include "interface/control/sensitivity/judged_quadratic.h"

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: quadratic_programs COUNT SEED\n";
    return 2;
  }
  const auto count = std::strtoull(argv[1], nullptr, 10), first = std::strtoull(argv[2], nullptr, 10);
  std::map<std::string, int> kinds;
  int failures = 0;
  for (auto seed = first; seed < first + count; ++seed) {
    try {
      dyntape::testing::QuadraticJudge judge(seed);
      const bool is_solved = judge.outcome() == dyntape::QpStatus::kSolved;
      ++kinds[is_solved ? dyntape::to_string(judge.status()) : dyntape::to_string(judge.outcome())];
      const std::string complaint = judge.complaint();
      if (complaint.empty()) continue;
      ++failures;
      std::cout << "seed " << seed << ": " << complaint << "\n";
    } catch (const std::overflow_error&) {
      ++kinds["left out, as fractions overflow"];
    }
  }
  for (const auto& [kind, times] : kinds) std::cout << kind << ": " << times << "\n";
  std::cout << failures << " of " << count << " programs are wrong\n";
  return failures > 0;
}
