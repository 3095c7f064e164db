// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/batch/ddp_batch.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/run/threads.h>
#include <dyntape/interface/control/batch/lane_work.h>
#include <dyntape/interface/control/discretize/shooting_steps.h>
#include <dyntape/interface/control/solve/ddp_course.h>
#include <dyntape/interface/io/stopwatch.h>

namespace dyntape {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// What a problem of the batch is loaded with.
class BatchCases {
 public:
  BatchCases(const Problem& problem, const DdpOptions& options, const DdpBatchValues& values)
      : problem_(problem),
        values_(values),
        N_(options.intervals),
        is_at_nodes_(options.start == DdpStart::kNodes) {
    find_count();
    check_starts();
    const double h = problem.duration / N_;
    const Index n_p = problem.parameters.size();
    parameters_.resize(2 + 3 * n_p, N_), u_.resize(problem.n_u(), N_), x_.resize(problem.n_x(), N_ + 1);
    for (int k = 0; k < N_; ++k) {
      parameters_.col(k).head(2) << k * h, h;
      for (int part = 0; part < 3; ++part)
        parameters_.col(k).segment(2 + part * n_p, n_p) = problem.parameters.at((k + part / 2.0) * h);
    }
    at_end_ = parameters_of(problem, problem.duration);
    for (int k = 0; k <= N_; ++k) {
      const Stage<double> stage = problem.first_guess(k < N_ ? k * h : problem.duration);
      if (stage.x.size() != problem.n_x() || (k < N_ && stage.u.size() != problem.n_u()))
        refuse("the guess has other sizes than the problem");
      x_.col(k) = stage.x;
      if (k < N_) u_.col(k) = stage.u;
    }
  }

  std::size_t count() const { return std::size_t(count_); }

  Problem problem(std::size_t i) const {
    Problem own = problem_;
    own.start = start(Index(i));
    if (values_.parameters.cols() == 0) return own;
    const VectorXd p = values_.parameters.col(Index(i));
    own.parameters = {};
    const std::vector<std::string> names = problem_.parameters.entry_names();
    for (Index j = 0; j < p.size(); ++j) own.parameters.add(names[std::size_t(j)], p[j]);
    return own;
  }

  void load(LaneWork& work, int lane, std::size_t i) {
    const Index column = Index(i);
    if (values_.parameters.cols() > 0) {
      const auto p = values_.parameters.col(column);
      for (int part = 0; part < 3; ++part)
        parameters_.middleRows(2 + part * p.size(), p.size()).colwise() = VectorXd(p);
      at_end_.tail(p.size()) = p;
    }
    if (values_.controls.cols() > 0) u_ = values_.controls.col(column).reshaped(u_.rows(), u_.cols());
    const VectorXd first = start(column);
    if (is_at_nodes_ && !problem_.guess) x_ = first.replicate(1, N_ + 1);
    x_.col(0) = first;
    u_ = u_.cwiseMax(problem_.u.lower.replicate(1, N_)).cwiseMin(problem_.u.upper.replicate(1, N_));
    work.load(lane, parameters_, at_end_, x_, u_);
  }

 private:
  VectorXd start(Index i) const {
    if (values_.starts.cols() > 0) return values_.starts.col(i);
    return problem_.start;
  }

  [[noreturn]] void refuse(const std::string& what) const {
    throw ArgumentError("problem \"" + problem_.name + "\": " + what);
  }

  void find_count() {
    struct Block {
      const char* name;
      const MatrixXd& values;
      Index rows;
    };
    const Block blocks[] = {{"starts", values_.starts, problem_.n_x()},
                            {"parameters", values_.parameters, problem_.parameters.size()},
                            {"controls", values_.controls, Index(problem_.n_u()) * N_}};
    for (const Block& block : blocks) {
      const Index cols = block.values.cols();
      if (cols == 0) continue;
      if (block.values.rows() != block.rows)
        refuse(std::string(block.name) + " of " + std::to_string(block.values.rows()) + " rows, expected " +
               std::to_string(block.rows));
      if (count_ > 0 && cols != count_)
        refuse(std::string(block.name) + " of " + std::to_string(cols) + " columns, expected " +
               std::to_string(count_) + ", one a problem");
      count_ = cols;
      for (Index i = 0; i < cols; ++i)
        if (!block.values.col(i).allFinite())
          refuse(std::string(block.name) + ": column " + std::to_string(i) + " is not finite");
    }
  }

  void check_starts() const {
    if (values_.starts.cols() > 0 || problem_.start.allFinite()) return;
    refuse("its start is not finite, and no starts are given");
  }

  const Problem& problem_;
  const DdpBatchValues& values_;
  int N_;
  bool is_at_nodes_;
  Index count_ = 0;
  MatrixXd parameters_, x_, u_;
  VectorXd at_end_;
};

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

}  // namespace

struct DdpBatch::Made {
  DdpSolver solver;
  DdpOptions options;
  unsigned threads;
  LaneSetup setup;
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
  DdpOptions unwatched = options;
  unwatched.watch = nullptr;
  made_ = std::make_unique<Made>(Made{std::move(solver), std::move(unwatched),
                                      threads > 0 ? threads : codegen::thread_count(), std::move(setup)});
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
  const VectorXd t = VectorXd::LinSpaced(options.intervals + 1, 0, problem.duration);
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
