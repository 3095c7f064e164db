// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/batch/ddp_batch.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <optional>
#include <utility>

#include <dyntape/codegen/run/threads.h>
#include <dyntape/interface/control/batch/batch_cases.h>
#include <dyntape/interface/control/solve/ddp.h>
#include <dyntape/interface/control/solve/ddp_course.h>
#include <dyntape/interface/control/solve/ddp_sensitivities.h>
#include <dyntape/interface/control/solve/shooting_steps.h>
#include <dyntape/interface/io/stopwatch.h>

namespace dyntape {

namespace {

constexpr int kSlotsALane = 3;  // problems in flight, so that lanes find work while others wait

// One thread's slots, which take problem after problem.
class BatchRun {
 public:
  BatchRun(const LaneSetup& setup, const DdpOptions& options, const BatchCases& cases,
           std::atomic<std::size_t>& next, std::vector<DdpSolution>& solutions)
      : options_(options),
        cases_(cases),
        next_(next),
        solutions_(solutions),
        work_(make_lane_work(setup, kSlotsALane)),
        lanes_(work_->lanes()),
        slots_(work_->slots()),
        courses_(std::size_t(slots_)),
        numbers_(std::size_t(slots_)),
        kinds_(std::size_t(slots_), kNone) {
    counts_[kNone] = slots_;
  }

  void run() {
    for (int s = 0; s < slots_; ++s) refill(s);
    for (;;) {
      const Kind kind = next_kind();
      if (kind == kNone) return;
      const std::vector<int> wanted = slots_of(kind);
      if (kind == kRollOut) {
        roll_out(wanted);
      } else if (kind == kBackward) {
        backward(wanted);
      } else {
        if (kind == kLinearise) work_->linearise(wanted);
        if (kind == kPredict) work_->predict(wanted);
        go_on(wanted);
      }
    }
  }

 private:
  enum Kind { kPredict, kRollOut, kLinearise, kBackward, kNone };

  void set_kind(int slot, Kind kind) {
    Kind& now = kinds_[std::size_t(slot)];
    --counts_[now], ++counts_[kind];
    now = kind;
  }
  static Kind kind_of(DdpWish wish) {
    if (wish == DdpWish::kNothing) return kNone;
    if (wish == DdpWish::kRollOut) return kRollOut;
    return wish == DdpWish::kLinearise ? kLinearise : kBackward;
  }

  // What all lanes have work of, the cheapest first; else what most have.
  Kind next_kind() const {
    Kind most = kNone;
    for (const Kind kind : {kPredict, kRollOut, kLinearise, kBackward}) {
      if (counts_[kind] >= lanes_) return kind;
      if (counts_[kind] > (most == kNone ? 0 : counts_[most])) most = kind;
    }
    return most;
  }

  // A lane each; all that go backwards, since some are on their way.
  std::vector<int> slots_of(Kind kind) const {
    std::vector<int> slots;
    for (int s = 0; s < slots_; ++s) {
      if (kinds_[std::size_t(s)] != kind) continue;
      slots.push_back(s);
      if (kind != kBackward && int(slots.size()) == lanes_) break;
    }
    return slots;
  }

  // Lanes that are left run what would be tried next.
  void roll_out(const std::vector<int>& wanted) {
    std::vector<LaneTrial> trials;
    std::vector<std::vector<int>> places(wanted.size());  // of each slot's trials
    for (bool is_added = true; is_added;) {
      is_added = false;
      for (std::size_t i = 0; i < wanted.size() && int(trials.size()) < lanes_; ++i) {
        const std::vector<double>& lengths = courses_[std::size_t(wanted[i])]->lengths();
        if (places[i].size() >= lengths.size()) continue;
        trials.push_back({wanted[i], lengths[places[i].size()]});
        places[i].push_back(int(trials.size()) - 1);
        is_added = true;
      }
    }
    work_->roll_out(trials);
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      DdpCourse& course = *courses_[std::size_t(wanted[i])];
      std::vector<double> costs;
      for (const int at : places[i]) costs.push_back(trials[std::size_t(at)].cost);
      course.set_costs(std::move(costs));
      course.go_on();
      if (course.accepted() >= 0) work_->accept(wanted[i], places[i][std::size_t(course.accepted())]);
    }
    take_solutions(wanted);
  }

  // Those without a minimum may begin again at once.
  void backward(const std::vector<int>& wanted) {
    std::vector<int> failed;
    for (const int s : work_->backward(wanted)) {
      if (work_->at(s).is_convex)
        set_kind(s, kPredict);
      else
        failed.push_back(s);
    }
    go_on(failed);
  }

  void go_on(const std::vector<int>& slots) {
    for (const int s : slots) courses_[std::size_t(s)]->go_on();
    take_solutions(slots);
  }

  void take_solutions(const std::vector<int>& slots) {
    for (const int s : slots) {
      std::optional<DdpCourse>& course = courses_[std::size_t(s)];
      set_kind(s, kind_of(course->wish()));
      if (course->wish() != DdpWish::kNothing) continue;
      solutions_[numbers_[std::size_t(s)]] = course->solution();
      refill(s);
    }
  }

  void refill(int slot) {
    std::optional<DdpCourse>& course = courses_[std::size_t(slot)];
    course.reset();
    const std::size_t number = next_++;
    if (number >= cases_.count()) return;
    numbers_[std::size_t(slot)] = number;
    cases_.load(*work_, slot, number);
    course.emplace(options_, *work_, slot);
    set_kind(slot, kind_of(course->wish()));
  }

  const DdpOptions& options_;
  BatchCases cases_;  // own room to load from
  std::atomic<std::size_t>& next_;
  std::vector<DdpSolution>& solutions_;
  std::unique_ptr<LaneWork> work_;
  int lanes_, slots_;
  std::vector<std::optional<DdpCourse>> courses_;
  std::vector<std::size_t> numbers_;
  std::vector<Kind> kinds_;     // of work that each slot waits for; kPredict: it is back at the start
  int counts_[kNone + 1] = {};  // of each kind
};

// One thread's lanes at solutions, which take block after block of them.
void add_sensitivities(const LaneSetup& setup, int n_x, BatchCases cases, std::atomic<std::size_t>& next,
                       std::vector<DdpSolution>& solutions) {
  using S = SensitivityStatus;
  const std::unique_ptr<LaneWork> work = make_lane_work(setup, 1);
  const auto lanes = std::size_t(work->lanes());
  const bool with_motion = setup.is_exact;
  for (std::size_t first; (first = next.fetch_add(lanes)) < cases.count();) {
    std::vector<int> solved;
    const auto number = [&](int slot) { return first + std::size_t(slot); };
    const ChangesOfMotion none(setup.n_x, setup.n_u, setup.intervals, with_motion);
    for (int s = 0; s < int(lanes) && number(s) < cases.count(); ++s) {
      solutions[number(s)].sensitivities = sensitivities_of(S::kNotASolution, none, n_x);
      if (!solutions[number(s)].converged()) continue;
      cases.load_solution(*work, s, number(s), solutions[number(s)]);
      work->at(s) = {};
      solved.push_back(s);
    }
    if (solved.empty()) continue;
    work->linearise(solved);
    if (with_motion) {
      for (std::vector<int> left = solved; !left.empty();)
        for (const int over : work->backward(left)) std::erase(left, over);
      work->find_changes(solved);
    }
    for (std::size_t lane = 0; lane < solved.size(); ++lane) {
      const DdpState& s = work->at(solved[lane]);
      ChangesOfMotion changes = none;
      S status = S::kNotFinite;
      if (s.is_finite) {
        changes.cost = work->cost_slopes(solved[lane]);
        const bool has_motion = with_motion && s.is_convex && !work->is_flat(solved[lane]);
        if (has_motion) work->take_changes(int(lane), changes);
        status = has_motion && work->is_weakly_held(int(lane)) ? S::kWeaklyActive
                 : with_motion && !has_motion                  ? S::kNoStrictMinimum
                                                               : S::kGood;
      }
      solutions[number(solved[lane])].sensitivities = sensitivities_of(status, changes, n_x);
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
int DdpBatch::lanes() const { return make_lane_work(made_->setup, 1)->lanes(); }

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
      if (s.converged()) add_verification(cases.problem(i), s, options.stop);
    }
  });
  return solutions;
}

}  // namespace dyntape
