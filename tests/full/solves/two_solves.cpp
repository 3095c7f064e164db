// SPDX-License-Identifier: BSD-3-Clause
//
// Two threads solve at once, a thousand times: the linear solver of Ipopt keeps static state, which its instances
// change as they begin and end, and solves take turns.
#include <cstdio>
#include <thread>

#include <dyntape/interface/control/discretize/staged_nlp.h>
#include <dyntape/interface/control/ipopt/ipopt.h>

namespace {

using namespace dyntape;

Problem block(double mass) {
  Problem p("block", {"p", "v"}, {"u"}, 1.0, [=](const auto& s) { return vector(s.x[1], s.u[0] / mass); });
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));
  p.start << 0, 0;
  p.goal << 1, 0;
  return p;
}

// How many of a thousand solves miss the optimum 12 m^2.
void solve(double mass, int* wrong) {
  StagedNlp nlp = discretize(block(mass), {.intervals = 40, .evaluation = {.route = Route::kInterpreter}});
  for (int k = 0; k < 1000; ++k) {
    const NlpSolution s = solve_with_ipopt(nlp, nlp.start());
    const double error = s.objective / (12 * mass * mass) - 1;
    *wrong += s.status != SolveStatus::kSolved || !(error < 1e-6 && error > -1e-6);
  }
}

}  // namespace

int main() {
  int wrong[2] = {};
  std::thread first(solve, 1.0, &wrong[0]), second(solve, 3.0, &wrong[1]);
  first.join();
  second.join();
  std::printf("%d and %d of 1000 solves went wrong\n", wrong[0], wrong[1]);
  return wrong[0] + wrong[1] == 0 ? 0 : 1;
}
