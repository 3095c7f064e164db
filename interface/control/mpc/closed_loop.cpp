// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/mpc/closed_loop.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/discretize/verify.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

using Eigen::VectorXd;

constexpr double kPlantTolerance = 1e-10;

void check_loop(const Problem& problem, const ClosedLoopOptions& options) {
  const auto refuse = [&](const std::string& what) { dyntape::refuse(problem, what); };
  const auto seconds = [](double value) { return io::shortest(value) + " s"; };
  if (!(options.seconds > 0 && std::isfinite(options.seconds)))
    refuse("a loop of " + seconds(options.seconds) + ", expected a positive time");
  if (!(options.period > 0 && options.period <= options.seconds))
    refuse("a period of " + seconds(options.period) + ", expected one above 0 and within the loop's " +
           seconds(options.seconds));
  if (!(options.delay >= 0 && options.delay < options.period))
    refuse("a delay of " + seconds(options.delay) + ", expected one from 0 to below the period of " +
           seconds(options.period));
  constexpr double kMostSteps = 1e7;
  const auto check_steps = [&](const char* what, double each) {
    if (!(options.seconds / each <= kMostSteps))
      refuse(seconds(options.seconds) + " in " + what + " of " + seconds(each) + ", expected at most " +
             io::shortest(kMostSteps) + " steps");
  };
  check_steps("periods", options.period);
  if (!(options.feedback >= 0 && options.feedback < options.period))
    refuse("feedback every " + seconds(options.feedback) + ", expected 0 (none) or less than the period of " +
           seconds(options.period));
  if (options.feedback > 0) check_steps("feedback", options.feedback);
  if (!(options.period < problem.duration))
    refuse("a period of " + seconds(options.period) + ", expected less than the horizon of " +
           seconds(problem.duration) + ", behind which no plan says what to do");
  for (const Disturbance& push : options.disturbances) {
    if (push.at >= options.seconds)
      refuse("a push at " + seconds(push.at) + ", expected one before the end at " +
             seconds(options.seconds));
    if (push.of_state && push.at >= 0) continue;
    if (push.change.size() != problem.n_x() || !push.change.allFinite() || !(push.at >= 0))
      refuse("a push at " + seconds(push.at) + " with " + std::to_string(push.change.size()) +
             " entries, expected a time from 0 on and " + std::to_string(problem.n_x()) + " numbers");
  }
}

// The problem's dynamics, moved by plans and disturbances.
class SteeredPlant {
 public:
  VectorXd x;           // where it is
  Plan plan;            // that it follows
  std::string trouble;  // why it cannot be simulated

  SteeredPlant(const Problem& problem, const ClosedLoopOptions& options)
      : x(problem.start),
        problem_(problem),
        feedback_(options.feedback),
        plant_(options.plant),
        disturbances_(options.disturbances),
        idle_(problem.first_guess(0).u) {
    std::sort(disturbances_.begin(), disturbances_.end(),
              [](const Disturbance& a, const Disturbance& b) { return a.at < b.at; });
  }

  // What acts at a time, measured then.
  VectorXd control(double t) const {
    if (plan.motion.points() == 0) return idle_;
    return feedback_ > 0 ? plan.control(t, x) : plan.control(t);
  }

  // From one time to another; false where it cannot be simulated.
  bool move(double from, double to) {
    double measures = from;
    VectorXd correction;
    while (from < to) {
      push_at(from);
      double until = next_ < disturbances_.size() ? std::min(to, disturbances_[next_].at) : to;
      if (feedback_ > 0) {
        if (from >= measures) {
          correction = plan.motion.points() > 0 ? plan.correction(from, x) : VectorXd();
          measures = from + feedback_;
        }
        constexpr double kRounding = 1e-9;  // no slices of time
        if (to - measures > kRounding * feedback_) until = std::min(until, measures);
      }
      const auto acting = [&](double t) {
        if (plan.motion.points() == 0) return idle_;
        return correction.size() > 0 ? plan.limited(plan.control(t) + correction) : plan.control(t);
      };
      if (plant_) {
        trouble = plant_(x, from, until, acting);
        if (!trouble.empty()) return false;
        from = until;
        continue;
      }
      const Simulation run = simulate(problem_, x, from, until, acting, kPlantTolerance);
      if (!run.x.allFinite()) {
        trouble = run.trouble;
        return false;
      }
      x = run.x, from = until;
    }
    return true;
  }

  // Where it will be later if nothing hits it; where it is, if that cannot be simulated.
  VectorXd foreseen(double from, double to) const {
    if (plant_ && to > from && plan.motion.points() > 0) return x + (plan.state(to) - plan.state(from));
    if (plant_) return x;
    SteeredPlant model = *this;
    model.disturbances_.clear(), model.next_ = 0;
    return model.move(from, to) ? model.x : x;
  }

 private:
  void push_at(double t) {
    for (; next_ < disturbances_.size() && disturbances_[next_].at <= t; ++next_)
      x += disturbances_[next_].of_state ? disturbances_[next_].of_state(x) : disturbances_[next_].change;
  }

  const Problem& problem_;
  double feedback_;
  SimulatedPlant plant_;
  std::vector<Disturbance> disturbances_;
  VectorXd idle_;
  std::size_t next_ = 0;
};

Trajectory motion_of(const std::vector<double>& t, const std::vector<VectorXd>& x,
                     const std::vector<VectorXd>& u, int n_a) {
  const auto points = Eigen::Index(t.size());
  Trajectory motion{Eigen::Map<const VectorXd>(t.data(), points), Eigen::MatrixXd(x.front().size(), points),
                    Eigen::MatrixXd::Zero(n_a, points), Eigen::MatrixXd(u.front().size(), points),
                    trapezoid()};
  for (Eigen::Index k = 0; k < points; ++k) {
    motion.x.col(k) = x[std::size_t(k)];
    motion.u.col(k) = u[std::size_t(k)];
  }
  return motion;
}

}  // namespace

ClosedLoop close_loop(const Problem& problem, const ClosedLoopOptions& options) {
  check_loop(problem, options);
  ClosedLoop loop;
  MpcOptions planning = options.mpc;
  planning.gains = planning.gains || options.feedback > 0;
  planning.mesh.evaluation.stop = options.stop;
  std::optional<RecedingHorizon> mpc;
  try {
    mpc.emplace(problem, planning);
  } catch (const ToolError&) {  // a compiler that was stopped
    if (!options.stop.stop_requested()) throw;
    loop.motion = motion_of({0}, {problem.start}, {VectorXd::Zero(problem.n_u())}, problem.n_a());
    return loop;
  }
  loop.build = mpc->build();
  SteeredPlant plant(problem, options);
  std::vector<double> times;
  std::vector<VectorXd> states, controls;
  const auto note = [&](double t) {
    times.push_back(t), states.push_back(plant.x), controls.push_back(plant.control(t));
  };
  const int periods =
      int(std::ceil(options.seconds / options.period * (1 - 1e-12)));  // the last one is whole
  for (int k = 0; k < periods && !options.stop.stop_requested(); ++k) {
    const double t = k * options.period, acts = t + options.delay, end = (k + 1) * options.period;
    if (options.watch) options.watch(t);
    if (options.is_over) loop.trouble = options.is_over(t, plant.x);
    if (!loop.trouble.empty()) {
      note(t);
      break;
    }
    const MpcStep& s = mpc->step(acts, plant.foreseen(t, acts));
    loop.steps.push_back(
        {t, s.seconds, s.gain_seconds, s.cost, s.violation, s.iterations, s.status, s.usable});
    if (k == 0 && !s.usable) {
      loop.trouble = std::string("there is no first plan: ") + describe(s.status);
      note(t);
      break;
    }
    if (options.delay == 0 && s.usable) plant.plan = s.plan;
    note(t);
    bool is_moved = options.delay == 0 || plant.move(t, acts);
    if (s.usable) plant.plan = s.plan;
    is_moved = is_moved && plant.move(acts, end);
    if (!is_moved) {
      loop.trouble = "the plant: " + plant.trouble;
      break;
    }
    if (k + 1 == periods) note(end);
  }
  if (times.empty()) note(0);
  loop.motion = motion_of(times, states, controls, problem.n_a());
  return loop;
}

double ClosedLoop::latency(double share) const {
  std::vector<double> seconds;
  for (std::size_t k = 1; k < steps.size(); ++k) seconds.push_back(steps[k].seconds);
  if (seconds.empty()) return 0;
  std::sort(seconds.begin(), seconds.end());
  const double place = std::clamp(share, 0.0, 1.0) * double(seconds.size() - 1);
  return seconds[std::size_t(std::ceil(place))];
}

int ClosedLoop::missed(double deadline) const {
  return int(std::count_if(steps.begin() + (steps.empty() ? 0 : 1), steps.end(),
                           [=](const Step& step) { return step.seconds > deadline; }));
}

int ClosedLoop::unusable() const {
  return int(std::count_if(steps.begin(), steps.end(), [](const Step& step) { return !step.usable; }));
}

}  // namespace dyntape
