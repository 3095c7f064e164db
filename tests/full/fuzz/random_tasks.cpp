// SPDX-License-Identifier: BSD-3-Clause
//
// Random tasks for arms, swing-ups, a block on a rail and a quadrotor, among obstacles or without, by three methods:
//
//   random_tasks ROBOTS [count] [seed] [folder] [first]
//
// Each is written as a task file and read and solved as `dyntape solve` does it: from stage to stage ("riccati"), by Ipopt, and by
// differential dynamic programming where the task has no limits but those of its controls.  What is called solved is held against
// code of its own (random_task_judge.h).  A task need not have a solution within its limits and its time, though an arm's
// goal can be reached: a task that is refused, or called out of reach, is a wrong claim as well.
//
// Prints what was solved and how, medians of processor time included, and how the rest ended.  In `folder` the files of what is
// not solved stay, those of wrong claims in any case, to be solved again by hand.  Exit status 1 where a claim is wrong.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <map>

#include <unistd.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/run/solve/solve.h>

#include "random_task.h"
#include "random_task_judge.h"

namespace dyntape::testing {
namespace {

namespace fs = std::filesystem;

const char* const kMethods[] = {"riccati", "ipopt", "ddp"};

struct Outcome {
  std::string ending;  // "solved", or how it ended otherwise
  std::string wrong;   // what is wrong with what it says; "": nothing
  bool is_by_other = false;
  int iterations = 0;
  double milliseconds = 0, cost = 0;  // of processor time, from reading to the verdict
  bool is_solved() const { return ending == "solved"; }
};

// Why it is not called solved, in a few words.
std::string ending_of(const SolveReport& report) {
  if (report.success()) return "solved";
  if (!report.solution.converged()) return to_string(report.solution.nlp.status);
  if (!report.feasible()) return "violates a constraint";
  if (!report.optimal()) return "no minimum";
  if (!report.true_enough()) return "mesh too coarse";
  if (!report.reaches_goal()) return "misses the goal";
  return "beyond a limit";
}

// Whether the judge takes a motion for what it is no longer: its controls are changed by a hundredth, or its states by a thousandth.
bool is_blind(const RandomTask& random, SolveReport report, bool by_ddp) {
  Trajectory& motion = report.solution.motion;
  const Eigen::MatrixXd u = motion.u;
  motion.u *= 0.99;
  if (fault_of(random, report, by_ddp).empty()) return true;
  motion.u = u;
  motion.x.col(motion.node(motion.intervals() / 2)).array() += 1e-3 * motion.x.cwiseAbs().maxCoeff();
  return fault_of(random, report, by_ddp).empty();
}

Outcome solve(const RandomTask& random, const std::string& method, const std::string& path) {
  write_file_atomically(path, file_text(random, method));
  Outcome outcome;
  const std::clock_t begin = std::clock();
  try {
    const SolveReport report = solve_task(read_task(path));
    outcome.milliseconds = 1e3 * double(std::clock() - begin) / CLOCKS_PER_SEC;
    outcome.ending = ending_of(report);
    outcome.iterations = report.iterations();
    outcome.cost = report.solution.cost();
    outcome.is_by_other = report.solution.nlp.is_by_other_method;
    if (report.success()) outcome.wrong = fault_of(random, report, method == "ddp");
    if (report.success() && is_blind(random, report, method == "ddp"))
      outcome.wrong = "could be changed without being noticed";
    if (!report.unreachable.empty()) outcome.wrong = "is called out of reach: " + report.unreachable;
  } catch (const NumericalError&) {  // as of an arm without limits that falls from its start
    outcome.ending = "not finite at the start";
  } catch (const std::exception& e) {
    outcome.ending = "refused", outcome.wrong = std::string("is refused: ") + e.what();
  }
  return outcome;
}

template <class T>
T median(std::vector<T> values) {
  if (values.empty()) return 0;
  std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(values.size() / 2), values.end());
  return values[values.size() / 2];
}

struct Tally {
  int tried = 0, solved = 0, by_other = 0, verified = 0, wrong = 0;
  std::vector<int> iterations;
  std::vector<double> milliseconds;
  std::map<std::string, int> endings;  // of what is not solved

  void add(const Outcome& outcome) {
    ++tried, wrong += !outcome.wrong.empty();
    if (!outcome.is_solved()) {
      ++endings[outcome.ending];
      return;
    }
    ++solved, by_other += outcome.is_by_other, verified += outcome.wrong.empty();
    iterations.push_back(outcome.iterations), milliseconds.push_back(outcome.milliseconds);
  }
};

// Of tasks that two methods solve, whose cost is lower: other optima are allowed.
struct Comparison {
  int both = 0, first_lower = 0, second_lower = 0;
  void add(const Outcome& a, const Outcome& b, double same) {
    if (!a.is_solved() || !b.is_solved()) return;
    ++both;
    const double apart = same * std::max({1e-3, std::abs(a.cost), std::abs(b.cost)});
    first_lower += a.cost < b.cost - apart, second_lower += b.cost < a.cost - apart;
  }
  void print(const char* first, const char* second, double same) const {
    std::printf(
        "%s and %s both solve %d: to %g the same cost in %d, lower by the first in %d, by the second in %d\n",
        first, second, both, same, both - first_lower - second_lower, first_lower, second_lower);
  }
};

class Run {
 public:
  explicit Run(std::string folder) : folder_(std::move(folder)) {}

  void take(const RandomTask& random, int index) {
    ++tasks_[random.robot];
    Outcome of[3];
    bool is_solved = false;
    for (int m = 0; m < (random.is_for_ddp ? 3 : 2); ++m) {
      const std::string path = folder_ + "/task_" + std::to_string(index) + "_" + kMethods[m] + ".info";
      of[m] = solve(random, kMethods[m], path);
      tallies_[m].add(of[m]);
      is_solved |= of[m].is_solved();
      if (!of[m].wrong.empty())
        std::printf("WRONG: task %d (%s, %s) by %s %s: %s\n", index, random.robot.c_str(),
                    random.kind.c_str(), kMethods[m], of[m].is_solved() ? "called solved" : "not solved",
                    of[m].wrong.c_str());
      else if (!of[m].is_solved())
        std::printf("task %d (%s, %s) by %s: %s\n", index, random.robot.c_str(), random.kind.c_str(),
                    kMethods[m], of[m].ending.c_str());
      if (of[m].is_solved() && of[m].wrong.empty()) fs::remove(path);
      std::fflush(stdout);
    }
    solved_[random.robot] += is_solved;
    methods_.add(of[0], of[1], kSame);
    if (random.is_for_ddp) steps_.add(of[0], of[2], kNear);
  }

  int wrong() const { return tallies_[0].wrong + tallies_[1].wrong + tallies_[2].wrong; }

  void print() const {
    std::printf("\nrobot            tasks  solved by a method\n");
    for (const auto& [robot, tasks] : tasks_)
      std::printf("%-16s %5d  %d\n", robot.c_str(), tasks, solved_.at(robot));
    std::printf(
        "\nmethod   tried  solved  share  of these by another  verified  wrong  iterations  ms (medians)\n");
    for (int m = 0; m < 3; ++m) {
      const Tally& t = tallies_[m];
      std::printf("%-8s %5d  %6d  %4.1f%%  %19d  %8d  %5d  %10d  %.0f\n", kMethods[m], t.tried, t.solved,
                  100. * t.solved / std::max(t.tried, 1), t.by_other, t.verified, t.wrong,
                  median(t.iterations), median(t.milliseconds));
    }
    for (int m = 0; m < 3; ++m)
      for (const auto& [ending, count] : tallies_[m].endings)
        std::printf("not solved by %-8s %-24s %d\n", kMethods[m], ending.c_str(), count);
    methods_.print(kMethods[0], kMethods[1], kSame);
    steps_.print(kMethods[0], kMethods[2], kNear);
  }

 private:
  // Of costs, as parts; by ddp a motion ends near its goal only, and is another discretisation's.
  static constexpr double kSame = 1e-3, kNear = 1e-2;

  std::string folder_;
  std::map<std::string, int> tasks_, solved_;
  Tally tallies_[3];
  Comparison methods_, steps_;
};

int run(const std::string& robots, int count, unsigned seed, std::string folder, int first) {
  const bool keeps = !folder.empty();
  if (!keeps)
    folder = (fs::temp_directory_path() / ("dyntape-random-tasks-" + std::to_string(getpid()))).string();
  fs::create_directories(folder);
  std::printf("%d tasks from number %d of seed %u\n", count, first, seed);
  Run tasks(folder);
  for (int index = first; index < first + count; ++index)
    tasks.take(draw_task(fs::absolute(robots).string(), seed, index), index);
  tasks.print();
  if (tasks.wrong() > 0) {
    std::printf("%d claims are wrong; their tasks are in %s\n", tasks.wrong(), folder.c_str());
    return 1;
  }
  if (!keeps) fs::remove_all(folder);
  return 0;
}

}  // namespace
}  // namespace dyntape::testing

int main(int argc, char** argv) try {
  if (argc < 2)
    throw dyntape::ArgumentError(
        "expected a folder of robots, then a count, a seed, a folder, a first number");
  const auto number = [&](int at, int otherwise) { return argc > at ? std::atoi(argv[at]) : otherwise; };
  return dyntape::testing::run(argv[1], number(2, 200), unsigned(number(3, 1)), argc > 4 ? argv[4] : "",
                               number(5, 0));
} catch (const std::exception& e) {
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
