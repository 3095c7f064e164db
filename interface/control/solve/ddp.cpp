// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/solve/ddp.h>

#include <chrono>
#include <optional>
#include <utility>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/control/solve/ddp_course.h>
#include <dyntape/interface/control/solve/ddp_motion.h>
#include <dyntape/interface/control/solve/ddp_sensitivities.h>
#include <dyntape/interface/control/solve/shooting_steps.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/stopwatch.h>

namespace dyntape {

namespace {

CodegenOptions of_order(Order order, CodegenOptions options) {
  options.order = order;
  return options;
}

void run(DdpCourse& course, DdpMotionWork& work) {
  for (DdpWish wish; (wish = course.wish()) != DdpWish::kNothing;) {
    if (wish == DdpWish::kLinearise)
      work.linearise();
    else if (wish == DdpWish::kBackward)
      work.backward();
    else
      course.set_costs({work.roll_out(course.lengths()[0]).value_or(HUGE_VAL)});
    course.go_on();
    if (course.accepted() >= 0) work.accept();
  }
}

void check_options(const Problem& problem, const DdpOptions& options) {
  constexpr int kMostIntervals = 10000000;
  const auto refuse = [&](const std::string& what) { dyntape::refuse(problem, what); };
  if (options.intervals < 1 || options.intervals > kMostIntervals)
    refuse(std::to_string(options.intervals) + " intervals, expected 1 to " + std::to_string(kMostIntervals));
  if (!(options.tolerance > 0 && options.tolerance < 1))
    refuse("a tolerance of " + io::shortest(options.tolerance) + ", expected a number between 0 and 1");
  if (options.max_iterations < 0)
    refuse("at most " + std::to_string(options.max_iterations) + " iterations, expected 0 or more");
}

}  // namespace

struct DdpSolver::Made {
  Problem problem;
  DdpOptions options;
  CompiledFunction step, end;
  double record_seconds, build_seconds;
  std::optional<DdpDerivatives> derivatives;
};

DdpSolver::DdpSolver(const Problem& problem, const DdpOptions& options) {
  check_options(problem, options);
  const auto begin = std::chrono::steady_clock::now();
  const bool is_exact = options.hessian == DdpHessian::kExact;
  const RecordedShooting recorded = record_shooting(problem, options.scheme, !is_exact);
  const Order order = is_exact ? Order::kSecond : Order::kFirst;
  const double record_seconds = seconds_since(begin);
  made_ = std::make_unique<Made>(
      Made{problem,
           options,
           CompiledFunction::make(recorded.step, of_order(order, options.evaluation)),
           CompiledFunction::make(recorded.end, of_order(Order::kSecond, options.evaluation)),
           record_seconds,
           0,
           {}});
  if (options.sensitivities != SensitivitiesOf::kNothing) made_->derivatives.emplace(problem, options);
  made_->build_seconds = seconds_since(begin);
}

DdpSolver::DdpSolver(DdpSolver&&) noexcept = default;
DdpSolver& DdpSolver::operator=(DdpSolver&&) noexcept = default;
DdpSolver::~DdpSolver() = default;

const Problem& DdpSolver::problem() const { return made_->problem; }
const CompiledFunction& DdpSolver::step() const { return made_->step; }
const CompiledFunction& DdpSolver::end() const { return made_->end; }
const DdpDerivatives* DdpSolver::derivatives() const {
  return made_->derivatives ? &*made_->derivatives : nullptr;
}

void DdpSolver::set_values(const Problem& now) {
  Problem next = made_->problem;
  next.take_values(now);
  check_shooting(next);
  // Throws, if it does, before anything has changed.
  const double h = next.duration / made_->options.intervals;
  for (int k = 0; k <= 2 * made_->options.intervals; ++k) next.parameters.at(k / 2.0 * h);
  made_->problem = std::move(next);
}

BuildReport DdpSolver::build() const {
  BuildReport report;
  for (const CompiledFunction* f : {&made_->step, &made_->end}) add_to(report, *f);
  if (made_->derivatives)
    for (const CompiledFunction* f : {&made_->derivatives->step(), &made_->derivatives->end()})
      add_to(report, *f);
  report.seconds.record = made_->record_seconds;
  return report;
}

DdpSolution DdpSolver::solve(const std::stop_token& stop) {
  const Problem& problem = made_->problem;
  DdpOptions options = made_->options;
  if (stop.stop_possible()) options.stop = stop;
  const auto begin = std::chrono::steady_clock::now();
  DdpMotionWork work(problem, options, made_->step, made_->end);
  DdpCourse course(options, work, 0, work.start());
  run(course, work);
  DdpSolution solution = course.solution();
  solution.t = Eigen::VectorXd::LinSpaced(options.intervals + 1, 0, problem.duration);
  solution.build_seconds = made_->build_seconds;
  if (made_->derivatives) solution.sensitivities = made_->derivatives->at(problem, solution);
  solution.seconds = seconds_since(begin);
  if (solution.converged() && options.verify) add_verification(problem, solution, options.stop);
  return solution;
}

void add_verification(const Problem& problem, DdpSolution& s, const std::stop_token& stop) {
  s.verification = verify_steps(problem, held_motion(problem, s.t, s.x, s.u), s.cost, stop);
  s.integration_error = s.verification->worst_defect;
}

DdpSolution solve_with_ddp(const Problem& problem, const DdpOptions& options) {
  return DdpSolver(problem, options).solve();
}

std::string DdpSolution::verdict() const {
  if (status == SolveStatus::kSolved && is_saddle)
    return "The motion is stationary, but it is not a minimum: the cost falls along some change of the "
           "controls; expected another guess.";
  if (converged() && !verification) return "A local optimum was found; nothing was verified.";
  Solution solution;
  solution.nlp.status = status, solution.demands = demands;
  if (verification) solution.verification = *verification;
  return solution.verdict();
}

}  // namespace dyntape
