// SPDX-License-Identifier: BSD-3-Clause
//
// How long a task's program takes to be solved, by Ipopt and from stage to stage, in turn, on the task's own mesh.
//
//   bench_solves TASK.info [TIMES]        one JSON object; seconds, the quickest of TIMES
//
// tests/bench/peers/arm_problem.py runs it beside CasADi.
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/discretize/staged_nlp.h>
#include <dyntape/interface/control/nlp/solver_options.h>
#include <dyntape/interface/files/task/task.h>

namespace {

using namespace dyntape;
using Clock = std::chrono::steady_clock;

double seconds_since_start(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

struct Best {
  NlpMethod method;
  const char* name;
  NlpSolution solution;
};

void run(const std::string& file, int times) {
  const auto start = Clock::now();
  Task task = read_task(file);
  StagedNlp program = discretize(task.problem, task.optimise.mesh);
  const double ready = seconds_since_start(start);
  const std::vector<double> x = program.start();
  Best all[] = {{NlpMethod::kIpopt, "ipopt", {}}, {NlpMethod::kRiccati, "stages", {}}};
  for (int i = 0; i < times; ++i) {
    for (Best& best : all) {
      SolverOptions options = task.optimise.solver;
      options.method = best.method;
      NlpSolution s = solve_nlp(program, x, options);
      if (i == 0 || s.times.total < best.solution.times.total) best.solution = std::move(s);
    }
  }
  std::printf("{\"ready_s\": %.6g, \"intervals\": %d", ready, task.optimise.mesh.intervals);
  for (const Best& best : all) {
    const SolveTimes& t = best.solution.times;
    std::printf(
        ", \"%s\": {\"status\": \"%s\", \"cost\": %.12g, \"iterations\": %d, \"seconds\": %.6g, "
        "\"functions_s\": %.6g}",
        best.name, to_string(best.solution.status), best.solution.objective, best.solution.iterations(),
        t.total, t.functions + t.jacobian + t.hessian);
  }
  std::printf("}\n");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    std::fprintf(stderr, "usage: bench_solves TASK.info [TIMES]\n");
    return 2;
  }
  try {
    run(argv[1], argc == 3 ? std::max(1, std::atoi(argv[2])) : 20);
  } catch (const dyntape::Error& e) {
    std::fprintf(stderr, "bench_solves: %s\n", e.what());
    return 1;
  }
  return 0;
}
