// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/batch/ddp_batch.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <optional>
#include <utility>

#include <dyntape/codegen/run/threads.h>
#include <dyntape/interface/control/batch/batch_cases.h>
#include <dyntape/interface/control/discretize/shooting_steps.h>
#include <dyntape/interface/control/solve/ddp_course.h>
#include <dyntape/interface/control/solve/ddp_sensitivities.h>
#include <dyntape/interface/io/stopwatch.h>

namespace dyntape {

namespace {

// One thread's lanes, which take problem after problem.
class BatchRun {
 public:
  BatchRun(const LaneSetup& setup, const DdpOptions& options, const BatchCases& cases,
           std::atomic<std::size_t>& next, std::vector<DdpSolution>& solutions)
      : options_(options),
        cases_(cases),
        next_(next),
        solutions_(solutions),
        work_(make_lane_work(setup)),
        lanes_(work_->lanes()),
        courses_(std::size_t(lanes_)),
        numbers_(std::size_t(lanes_)) {}

  void run() {
    for (int l = 0; l < lanes_; ++l) refill(l);
    for (;;) {
      const DdpWish wish = most_wanted();
      if (wish == DdpWish::kNothing) return;
      std::vector<bool> wanted(std::size_t(lanes_), false);
      for (int l = 0; l < lanes_; ++l) wanted[std::size_t(l)] = wants(l, wish);
      if (wish == DdpWish::kRollOut)
        roll_out(wanted);
      else if (wish == DdpWish::kLinearise)
        work_->linearise(wanted);
      else
        work_->backward(wanted);
      go_on(wanted);
    }
  }

 private:
  bool wants(int lane, DdpWish wish) const {
    const std::optional<DdpCourse>& course = courses_[std::size_t(lane)];
    return course && course->wish() == wish;
  }

  DdpWish most_wanted() const {
    // Cheap work first, so that what is dear finds more lanes that want it.
    struct Kind {
      DdpWish wish;
      int weight;
    };
    DdpWish best = DdpWish::kNothing;
    int most = 0;
    for (const Kind& kind :
         {Kind{DdpWish::kRollOut, 4}, Kind{DdpWish::kLinearise, 3}, Kind{DdpWish::kBackward, 2}}) {
      int count = 0;
      for (int l = 0; l < lanes_; ++l) count += wants(l, kind.wish);
      if (kind.weight * count > most) most = kind.weight * count, best = kind.wish;
    }
    return best;
  }

  // Lanes that are left run what would be tried next.
  void roll_out(const std::vector<bool>& wanted) {
    std::vector<LaneTrial> trials(static_cast<std::size_t>(lanes_));
    std::vector<bool> is_taken(wanted);
    places_.assign(std::size_t(lanes_), {});
    for (int l = 0; l < lanes_; ++l) {
      trials[std::size_t(l)] = {l, 0};
      if (wanted[std::size_t(l)]) add_trial(trials, l, l);
    }
    int place = 0;
    for (bool is_added = true; is_added;) {
      is_added = false;
      for (int l = 0; l < lanes_; ++l) {
        while (place < lanes_ && is_taken[std::size_t(place)]) ++place;
        if (place == lanes_) break;
        if (!wanted[std::size_t(l)] ||
            places_[std::size_t(l)].size() >= courses_[std::size_t(l)]->lengths().size())
          continue;
        add_trial(trials, l, place);
        is_taken[std::size_t(place)] = is_added = true;
      }
    }
    work_->roll_out(trials);
    for (int l = 0; l < lanes_; ++l) {
      if (!wanted[std::size_t(l)]) continue;
      std::vector<double> costs;
      for (const int at : places_[std::size_t(l)]) costs.push_back(trials[std::size_t(at)].cost);
      courses_[std::size_t(l)]->set_costs(std::move(costs));
    }
  }
  void add_trial(std::vector<LaneTrial>& trials, int lane, int place) {
    std::vector<int>& own = places_[std::size_t(lane)];
    trials[std::size_t(place)] = {lane, courses_[std::size_t(lane)]->lengths()[own.size()]};
    own.push_back(place);
  }

  void go_on(const std::vector<bool>& wanted) {
    std::vector<int> trial_of(std::size_t(lanes_), -1);
    bool any = false;
    for (int l = 0; l < lanes_; ++l) {
      if (!wanted[std::size_t(l)]) continue;
      DdpCourse& course = *courses_[std::size_t(l)];
      course.go_on();
      if (course.accepted() < 0) continue;
      trial_of[std::size_t(l)] = places_[std::size_t(l)][std::size_t(course.accepted())];
      any = true;
    }
    if (any) work_->accept(trial_of);
    for (int l = 0; l < lanes_; ++l) {
      if (!wants(l, DdpWish::kNothing)) continue;
      solutions_[numbers_[std::size_t(l)]] = courses_[std::size_t(l)]->solution();
      refill(l);
    }
  }

  void refill(int lane) {
    std::optional<DdpCourse>& course = courses_[std::size_t(lane)];
    course.reset();
    const std::size_t number = next_++;
    if (number >= cases_.count()) return;
    numbers_[std::size_t(lane)] = number;
    cases_.load(*work_, lane, number);
    course.emplace(options_, *work_, lane);
  }

  const DdpOptions& options_;
  BatchCases cases_;  // own room to load from
  std::atomic<std::size_t>& next_;
  std::vector<DdpSolution>& solutions_;
  std::unique_ptr<LaneWork> work_;
  int lanes_;
  std::vector<std::optional<DdpCourse>> courses_;
  std::vector<std::size_t> numbers_;
  std::vector<std::vector<int>> places_;  // of each lane's trials
};

// One thread's lanes at solutions, which take block after block of them.
void add_sensitivities(const LaneSetup& setup, int n_x, BatchCases cases, std::atomic<std::size_t>& next,
                       std::vector<DdpSolution>& solutions) {
  const std::unique_ptr<LaneWork> work = make_lane_work(setup);
  const auto lanes = std::size_t(work->lanes());
  const bool with_motion = setup.is_exact;
  const ChangesOfMotion none(setup.n_x, setup.n_u, setup.intervals, with_motion);
  for (std::size_t first; (first = next.fetch_add(lanes)) < cases.count();) {
    const std::size_t count = std::min(lanes, cases.count() - first);
    std::vector<bool> is_solved(lanes, false);
    for (std::size_t l = 0; l < count; ++l) {
      is_solved[l] = solutions[first + l].success();
      if (!is_solved[l]) continue;
      cases.load_solution(*work, int(l), first + l, solutions[first + l]);
      work->at(int(l)) = {};
    }
    work->linearise(is_solved);
    if (with_motion) work->backward(is_solved), work->find_changes();
    for (std::size_t l = 0; l < count; ++l) {
      using S = SensitivityStatus;
      const DdpState& s = work->at(int(l));
      const auto found = [&](S status, const ChangesOfMotion& changes) {
        solutions[first + l].sensitivities = sensitivities_of(status, changes, n_x);
      };
      if (!is_solved[l] || !s.is_finite)
        found(is_solved[l] ? S::kNotFinite : S::kNotASolution, none);
      else if (!with_motion || s.is_convex)
        found(with_motion && work->is_weakly_held(int(l)) ? S::kWeaklyActive : S::kGood,
              work->changes(int(l), with_motion));
      else {
        ChangesOfMotion of_cost = none;
        of_cost.cost = work->changes(int(l), false).cost;
        found(S::kNoStrictMinimum, of_cost);
      }
    }
  }
}

}  // namespace

struct DdpBatch::Made {
  DdpSolver solver;
  DdpOptions options;
  unsigned threads;
  LaneSetup setup;
  std::optional<LaneSetup> at_solutions;  // of sensitivities
};

DdpBatch::DdpBatch(const Problem& problem, const DdpOptions& options, unsigned threads) {
  DdpSolver solver(problem, options);
  LaneSetup setup{solver.step(),
                  solver.end(),
                  options.intervals,
                  problem.n_x(),
                  problem.n_u(),
                  problem.u.lower,
                  problem.u.upper,
                  options.hessian == DdpHessian::kExact,
                  options.start == DdpStart::kNodes};
  std::optional<LaneSetup> at_solutions;
  if (const DdpDerivatives* const derivatives = solver.derivatives())
    at_solutions = LaneSetup{derivatives->step(),
                             derivatives->end(),
                             options.intervals,
                             problem.n_x() + int(problem.parameters.size()),
                             problem.n_u(),
                             problem.u.lower,
                             problem.u.upper,
                             derivatives->is_of_motion(),
                             false};
  DdpOptions unwatched = options;
  unwatched.watch = nullptr;
  made_ = std::make_unique<Made>(Made{std::move(solver), std::move(unwatched),
                                      threads > 0 ? threads : codegen::thread_count(), std::move(setup),
                                      std::move(at_solutions)});
}

DdpBatch::DdpBatch(DdpBatch&&) noexcept = default;
DdpBatch& DdpBatch::operator=(DdpBatch&&) noexcept = default;
DdpBatch::~DdpBatch() = default;

DdpSolver& DdpBatch::solver() { return made_->solver; }
const DdpSolver& DdpBatch::solver() const { return made_->solver; }
int DdpBatch::lanes() const { return make_lane_work(made_->setup)->lanes(); }

std::vector<DdpSolution> DdpBatch::solve(const DdpBatchValues& values, const std::stop_token& stop) const {
  const auto begin = std::chrono::steady_clock::now();
  const Problem& problem = made_->solver.problem();
  DdpOptions options = made_->options;
  if (stop.stop_possible()) options.stop = stop;
  LaneSetup setup = made_->setup;
  setup.lower = problem.u.lower, setup.upper = problem.u.upper;
  const BatchCases cases(problem, options, values);
  std::vector<DdpSolution> solutions(cases.count());
  std::atomic<std::size_t> next = 0;
  const std::size_t threads = std::min<std::size_t>(made_->threads, cases.count());
  codegen::run_tasks(threads, [&](std::size_t) { BatchRun(setup, options, cases, next, solutions).run(); });
  if (made_->at_solutions) {
    LaneSetup at_solutions = *made_->at_solutions;
    at_solutions.lower = problem.u.lower, at_solutions.upper = problem.u.upper;
    next = 0;
    codegen::run_tasks(threads, [&](std::size_t) {
      add_sensitivities(at_solutions, problem.n_x(), cases, next, solutions);
    });
  }
  const Eigen::VectorXd t = Eigen::VectorXd::LinSpaced(options.intervals + 1, 0, problem.duration);
  const double share = seconds_since(begin) / double(std::max<std::size_t>(1, cases.count()));
  for (DdpSolution& s : solutions) s.t = t, s.seconds = share;
  if (!options.verify) return solutions;
  codegen::run_tasks(threads, [&](std::size_t first) {
    for (std::size_t i = first; i < solutions.size(); i += threads) {
      DdpSolution& s = solutions[i];
      if (s.success()) s.integration_error = error_of_steps(cases.problem(i), s.t, s.x, s.u, options.stop);
    }
  });
  return solutions;
}

}  // namespace dyntape
