// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/ipopt/ipopt.h>

#include <IpIpoptApplication.hpp>
#include <IpTNLP.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <ctime>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/ipopt/ipopt_options.h>
#include <dyntape/interface/control/ipopt/rounds.h>
#include <dyntape/interface/control/nlp/best_point.h>
#include <dyntape/interface/control/nlp/bound_widening.h>
#include <dyntape/interface/control/nlp/hessian_shift.h>
#include <dyntape/interface/control/nlp/settling.h>
#include <dyntape/interface/io/stopwatch.h>

namespace dyntape {

namespace {

using Clock = std::chrono::steady_clock;
using Ipopt::Number;

constexpr double kIpoptInfinity = 1e19;              // Ipopt's threshold for "no bound"
constexpr std::chrono::milliseconds kPatience{100};  // with an iteration, once a stop is requested

// Hands an Nlp to Ipopt.  Ipopt swallows exceptions that cross it, so the first one is kept for the caller.  Ipopt may
// run in a thread of its own, which touches nothing of the caller's once the caller has left.
class Adapter : public Ipopt::TNLP {
 public:
  Adapter(Nlp& nlp, const std::vector<double>& start, const SolverOptions& options, const NlpSolution* warm)
      : nlp_(nlp), shape_(nlp.shape()), start_(start), options_(options) {
    solution_.x = start;
    if (warm) warm_ = *warm;
  }

  // Of the solution that is gone on from: multipliers of bounds times distances, in the mean; 0: there is none.
  double barrier() const {
    constexpr double kFirst = 0.1;  // Ipopt's own
    if (!warm_) return 0;
    double sum = 0;
    int bounds = 0;
    const auto add = [&](double multiplier, double distance) {
      if (std::isfinite(distance)) sum += std::abs(multiplier * distance), ++bounds;
    };
    for (std::size_t i = 0; i < shape_.n(); ++i) {
      add(warm_->lower_multiplier[i], warm_->x[i] - shape_.x_lower[i]);
      add(warm_->upper_multiplier[i], shape_.x_upper[i] - warm_->x[i]);
    }
    return std::clamp(bounds > 0 ? sum / bounds : 0, options_.tolerance, kFirst);
  }

  // How far a start near a solution is moved inside its bounds: in proportion to its violation of the rows.
  double push() {
    constexpr double kLeast = 1e-9, kMost = 1e-2;
    if (!(options_.first_barrier > 0)) return kMost;
    std::vector<double> g(shape_.m());
    if (!nlp_.constraints(start_.data(), g.data())) return kMost;
    double violation = 0;
    for (std::size_t j = 0; j < g.size(); ++j)
      violation = std::max({violation, shape_.g_lower[j] - g[j], g[j] - shape_.g_upper[j]});
    return std::clamp(kMost * violation, kLeast, kMost);
  }

  void begin() {
    const std::lock_guard lock(mutex_);
    begin_ = Clock::now();
    processor_begin_ = std::clock();
  }

  // `thrown`: by Ipopt itself, or null.
  void end(SolveStatus status, std::exception_ptr thrown) {
    const std::lock_guard lock(mutex_);
    if (!exception_) exception_ = std::move(thrown);
    solution_.status = status;
    has_ended_ = true;
    ended_.notify_all();
  }

  // Until the solve has ended, or has not within kPatience of a request to stop: it is left then.
  bool wait() {
    std::unique_lock lock(mutex_);
    const auto over = [this] { return has_ended_; };
    if (!ended_.wait(lock, options_.stop, over)) ended_.wait_for(lock, kPatience, over);
    is_left_ = !has_ended_;
    return has_ended_;
  }

  // Once it has ended or is left.
  NlpSolution result() {
    const std::lock_guard lock(mutex_);
    if (exception_) std::rethrow_exception(exception_);
    solution_.times.total = seconds_since(begin_);
    solution_.times.processor = double(std::clock() - processor_begin_) / CLOCKS_PER_SEC;
    if (is_left_ || is_cut_short_) solution_.status = SolveStatus::kStopped;
    if (is_left_ && best_.x.empty()) note(start_);
    if (has_settled_ && solution_.status == SolveStatus::kStopped) {
      solution_.status = SolveStatus::kSettled;
    } else if (solution_.status == SolveStatus::kStopped && !best_.x.empty()) {
      best_.move_into(solution_);
    }
    return std::move(solution_);
  }

  bool get_nlp_info(Ipopt::Index& n, Ipopt::Index& m, Ipopt::Index& nnz_jac, Ipopt::Index& nnz_hess,
                    IndexStyleEnum& style) override {
    style = C_STYLE;
    return guarded([&] {
      n = static_cast<Ipopt::Index>(shape_.n());
      m = static_cast<Ipopt::Index>(shape_.m());
      nnz_jac = static_cast<Ipopt::Index>(shape_.jacobian.nnz());
      nnz_hess = static_cast<Ipopt::Index>(shape_.hessian.nnz() + shape_.n());
      return true;
    });
  }

  bool get_bounds_info(Ipopt::Index, Number* xl, Number* xu, Ipopt::Index, Number* gl, Number* gu) override {
    const auto clip = [](double b) { return std::clamp(b, -2 * kIpoptInfinity, 2 * kIpoptInfinity); };
    const auto widen = [&](const std::vector<double>& lower, const std::vector<double>& upper, Number* l,
                           Number* u) {
      for (std::size_t i = 0; i < lower.size(); ++i) {
        const bool is_equation = lower[i] == upper[i];
        const auto room = [&](double b) { return is_equation ? 0 : widening(options_.bound_relaxation, b); };
        l[i] = clip(lower[i] - room(lower[i])), u[i] = clip(upper[i] + room(upper[i]));
      }
    };
    return guarded([&] {
      widen(shape_.x_lower, shape_.x_upper, xl, xu);
      widen(shape_.g_lower, shape_.g_upper, gl, gu);
      return true;
    });
  }

  // There are no multipliers to start from; options that ask for them are refused ahead of this.
  bool get_starting_point(Ipopt::Index, bool, Number* x, bool has_z, Number* zl, Number* zu, Ipopt::Index,
                          bool has_lambda, Number* lambda) override {
    return guarded([&] {
      std::copy(start_.begin(), start_.end(), x);
      if (!warm_) return !has_z && !has_lambda;
      if (has_z) {
        std::copy(warm_->lower_multiplier.begin(), warm_->lower_multiplier.end(), zl);
        std::copy(warm_->upper_multiplier.begin(), warm_->upper_multiplier.end(), zu);
      }
      if (has_lambda) std::copy(warm_->lambda.begin(), warm_->lambda.end(), lambda);
      return true;
    });
  }

  bool eval_f(Ipopt::Index, const Number* x, bool, Number& value) override {
    return guarded([&] {
      const Stopwatch watch(solution_.times.functions, solution_.times.function_calls);
      return nlp_.objective(x, value);
    });
  }
  bool eval_g(Ipopt::Index, const Number* x, bool, Ipopt::Index, Number* g) override {
    return guarded([&] {
      const Stopwatch watch(solution_.times.functions, uncounted_);  // shares an evaluation with eval_f
      return nlp_.constraints(x, g);
    });
  }
  bool eval_grad_f(Ipopt::Index, const Number* x, bool, Number* gradient) override {
    return guarded([&] {
      const Stopwatch watch(solution_.times.jacobian, uncounted_);
      return nlp_.gradient(x, gradient);
    });
  }
  bool eval_jac_g(Ipopt::Index, const Number* x, bool, Ipopt::Index, Ipopt::Index, Ipopt::Index* row,
                  Ipopt::Index* col, Number* values) override {
    return guarded([&] {
      if (values == nullptr) return copy(shape_.jacobian, row, col);
      const Stopwatch watch(solution_.times.jacobian, solution_.times.jacobian_calls);
      current_.assign(x, x + shape_.n());
      return nlp_.jacobian(x, values);
    });
  }
  bool eval_h(Ipopt::Index, const Number* x, bool, Number sigma, Ipopt::Index, const Number* lambda, bool,
              Ipopt::Index, Ipopt::Index* row, Ipopt::Index* col, Number* values) override {
    return guarded([&] {
      const std::size_t nnz = shape_.hessian.nnz(), n = shape_.n();
      if (values == nullptr) {  // the damping's entries last: Ipopt adds what stands at one place
        for (std::size_t i = 0; i < n; ++i) row[nnz + i] = col[nnz + i] = static_cast<Ipopt::Index>(i);
        return copy(shape_.hessian, row, col);
      }
      std::fill_n(values + nnz, n, damping_.shift());
      const Stopwatch watch(solution_.times.hessian, solution_.times.hessian_calls);
      return nlp_.hessian(x, sigma, lambda, values);
    });
  }

  bool intermediate_callback(Ipopt::AlgorithmMode mode, Ipopt::Index iteration, Number objective,
                             Number primal, Number dual, Number mu, Number step, Number regularization,
                             Number alpha_dual, Number alpha_primal, Ipopt::Index trials,
                             const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override {
    return guarded([&] {
      solution_.log.push_back({iteration, objective, primal, dual, mu, step, regularization, alpha_dual,
                               alpha_primal, trials, mode == Ipopt::RestorationPhaseMode});
      if (options_.stop.stop_possible()) note(current_);
      damping_.note(trials, damping_.shift() + regularization);
      if (options_.watch) options_.watch(solution_.log.back());
      if (options_.stop_when_settled && settling_.note(solution_.log.back()))
        return has_settled_ = true, false;
      return !options_.stop.stop_requested();
    });
  }

  void finalize_solution(Ipopt::SolverReturn, Ipopt::Index n, const Number* x, const Number* zl,
                         const Number* zu, Ipopt::Index m, const Number* g, const Number* lambda,
                         Number objective, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {
    const std::lock_guard lock(mutex_);
    if (is_left_) return;
    solution_.objective = objective;
    solution_.x.resize(std::size_t(n));
    for (std::size_t i = 0; i < solution_.x.size(); ++i)
      solution_.x[i] = std::clamp(x[i], shape_.x_lower[i], shape_.x_upper[i]);
    solution_.lower_multiplier.assign(zl, zl + n);
    solution_.upper_multiplier.assign(zu, zu + n);
    solution_.g.assign(g, g + m);
    solution_.lambda.assign(lambda, lambda + m);
  }

 private:
  // Ipopt differentiates at the points that it goes to, and at no others: the last one is where it is.  What it says
  // of violation is, within a restoration, about another program.
  void note(const std::vector<double>& x) {
    std::vector<double> g(shape_.m());
    double objective = 0;
    if (x.empty() || !nlp_.constraints(x.data(), g.data()) || !nlp_.objective(x.data(), objective)) return;
    best_.consider(shape_, x.data(), g.data(), objective);
  }

  template <class F>
  bool guarded(const F& evaluate) {
    const std::lock_guard lock(mutex_);
    if (is_left_ || exception_ || is_over_patience()) return false;
    try {
      return evaluate();
    } catch (...) {
      exception_ = std::current_exception();
      return false;
    }
  }

  // Functions that take long end one after the other: once patience is over, none begins.
  bool is_over_patience() {
    if (!options_.stop.stop_requested()) return false;
    if (!stop_seen_) stop_seen_ = Clock::now();
    return is_cut_short_ = Clock::now() - *stop_seen_ > kPatience;
  }

  static bool copy(const Pattern& pattern, Ipopt::Index* row, Ipopt::Index* col) {
    std::copy(pattern.row.begin(), pattern.row.end(), row);
    std::copy(pattern.col.begin(), pattern.col.end(), col);
    return true;
  }

  Nlp& nlp_;
  const NlpShape& shape_;
  const std::vector<double>& start_;
  std::optional<NlpSolution> warm_ = {};  // to go on from
  const SolverOptions& options_;

  std::mutex mutex_;  // of all below, and of what is above
  std::condition_variable_any ended_;
  bool has_ended_ = false, is_left_ = false, is_cut_short_ = false, has_settled_ = false;
  std::optional<Clock::time_point> stop_seen_;
  Clock::time_point begin_ = Clock::now();
  std::clock_t processor_begin_ = std::clock();
  NlpSolution solution_;
  std::vector<double> current_;  // empty: nowhere yet
  BestPoint best_;
  Settling settling_;
  StepDamping damping_;
  int uncounted_ = 0;
  std::exception_ptr exception_;
};

SolveStatus translate(Ipopt::ApplicationReturnStatus status) {
  switch (status) {
    case Ipopt::Solve_Succeeded:
    case Ipopt::Feasible_Point_Found:
      return SolveStatus::kSolved;
    case Ipopt::Solved_To_Acceptable_Level:
      return SolveStatus::kAcceptable;
    case Ipopt::Infeasible_Problem_Detected:
      return SolveStatus::kLocallyInfeasible;
    case Ipopt::Search_Direction_Becomes_Too_Small:
      return SolveStatus::kStepTooSmall;
    case Ipopt::Diverging_Iterates:
      return SolveStatus::kDiverging;
    case Ipopt::User_Requested_Stop:
      return SolveStatus::kStopped;
    case Ipopt::Maximum_Iterations_Exceeded:
      return SolveStatus::kIterationLimit;
    case Ipopt::Maximum_CpuTime_Exceeded:
      return SolveStatus::kTimeLimit;
    case Ipopt::Restoration_Failed:
      return SolveStatus::kRestorationFailed;
    case Ipopt::Error_In_Step_Computation:
      return SolveStatus::kStepFailed;
    case Ipopt::Not_Enough_Degrees_Of_Freedom:
      return SolveStatus::kTooFewVariables;
    case Ipopt::Invalid_Problem_Definition:
    case Ipopt::Invalid_Option:
      return SolveStatus::kBadOption;
    case Ipopt::Invalid_Number_Detected:
      return SolveStatus::kNotFinite;
    default:
      return SolveStatus::kSolverError;
  }
}

// One solve at a time: MUMPS, the linear solver, keeps static state.
class Turn {
 public:
  Turn() : lock_(mutex()) { mine_ = true; }
  ~Turn() { mine_ = false; }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

  static void refuse_nested() {
    if (!mine_) return;
    throw ArgumentError(
        "solve_with_ipopt: called from the functions of a problem that is being solved; expected one solve "
        "at a time, as the linear solver cannot do two");
  }

  // What a solve that was left uses would be gone.
  static void wait_for_it_at_exit() {
    struct Wait {
      ~Wait() { const std::lock_guard lock(mutex()); }
    };
    static const Wait wait;
  }

 private:
  // Never destroyed: threads may still solve while static objects go.
  static std::mutex& mutex() {
    static std::mutex& mutex = *new std::mutex;
    return mutex;
  }
  static thread_local bool mine_;
  std::unique_lock<std::mutex> lock_;
};
thread_local bool Turn::mine_ = false;

// What a thread that was left behind still needs.
struct Run {
  Run(Nlp& problem, const std::vector<double>& start, SolverOptions o, const NlpSolution* warm)
      : options(std::move(o)), adapter(new Adapter(problem, start, options, warm)) {}

  const SolverOptions options;
  const Ipopt::SmartPtr<Adapter> adapter;

  void operator()() const {
    const Turn turn;
    adapter->begin();
    SolveStatus status = SolveStatus::kSolverError;
    std::exception_ptr thrown;
    try {
      status = optimize();
    } catch (...) {
      thrown = std::current_exception();
    }
    adapter->end(status, std::move(thrown));
  }

 private:
  // The application, and the linear solver in it, live within one turn: MUMPS's static state also changes as its
  // instances begin and end.
  SolveStatus optimize() const {
    const Ipopt::SmartPtr<Ipopt::IpoptApplication> application = new Ipopt::IpoptApplication(false);
    detail::configure(*application, options, adapter->barrier(), adapter->push());
    if (application->Initialize("") != Ipopt::Solve_Succeeded) {
      throw ArgumentError("Ipopt refuses its options");
    }
    application->RethrowNonIpoptException(true);
    if (options.print_level > 0) {
      application->Jnlst()->AddFileJournal("console", "stdout", Ipopt::EJournalLevel(options.print_level));
    }
    return translate(application->OptimizeTNLP(GetRawPtr(adapter)));
  }
};

NlpSolution solve(Nlp& problem, const std::vector<double>& start, SolverOptions options,
                  const NlpSolution* warm) {
  Turn::refuse_nested();
  options.limited_memory |= problem.shape().hessian_kind == HessianKind::kLimitedMemory;
  const auto run = std::make_shared<Run>(problem, start, std::move(options), warm);
  if (!run->options.stop.stop_possible()) {
    (*run)();
    return run->adapter->result();
  }
  std::thread thread([run] { (*run)(); });
  if (run->adapter->wait()) {
    thread.join();
  } else {
    thread.detach();
    Turn::wait_for_it_at_exit();
  }
  return run->adapter->result();
}

}  // namespace

NlpSolution solve_with_ipopt(Nlp& problem, const std::vector<double>& start, const SolverOptions& options) {
  const std::size_t n = problem.shape().n();
  if (start.size() != n) {
    throw ArgumentError("solve_with_ipopt: the start has " + std::to_string(start.size()) +
                        " entries, the problem has " + std::to_string(n) + " variables");
  }
  SolverOptions of_method = options;
  of_method.method = NlpMethod::kIpopt;
  return solve_in_rounds(problem, start, of_method, solve);
}

}  // namespace dyntape
