// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/solve/ddp_motion.h>

#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

using Eigen::MatrixXd;
using Eigen::VectorXd;

DdpMotionWork::DdpMotionWork(const Problem& problem, const DdpOptions& options, const CompiledFunction& step,
                             const CompiledFunction& end)
    : problem_(problem),
      options_(options),
      N_(options.intervals),
      n_(problem.n_x()),
      m_(problem.n_u()),
      h_(problem.duration / options.intervals),
      steps_(step, problem, options.intervals),
      end_(end),
      is_limited_((problem.u.lower.array().abs() < HUGE_VAL).any() ||
                  (problem.u.upper.array().abs() < HUGE_VAL).any()),
      stages_(steps_.stages()),
      has_secants_(std::size_t(N_)),
      policy_(std::size_t(N_), {MatrixXd::Zero(m_, n_), VectorXd::Zero(m_)}),
      at_end_(parameters_of(problem, problem.duration)),
      weights_(n_ + 1),
      of_stage_(stages_[0].g),
      gap_(MatrixXd::Zero(n_, N_)) {
  slope_ = adjoint_ = MatrixXd::Constant(n_, N_ + 1, std::nan(""));
  now_ = trial_ = {MatrixXd(n_, N_ + 1), MatrixXd(m_, N_)};
}

VectorXd DdpMotionWork::limited(const VectorXd& u) const {
  return u.cwiseMax(problem_.u.lower).cwiseMin(problem_.u.upper);
}

void DdpMotionWork::take_guess() {
  for (int k = 0; k < N_; ++k) {
    const Stage<double> stage = problem_.first_guess(k * h_);
    if (stage.x.size() != n_ || stage.u.size() != m_)
      refuse(problem_, "the guess at t = " + io::shortest(k * h_) + " s has other sizes than the problem");
    now_.x.col(k) = stage.x;
    now_.u.col(k) = limited(stage.u);
  }
  now_.x.col(N_) = problem_.first_guess(problem_.duration).x;
  now_.x.col(0) = problem_.start;
}

double DdpMotionWork::start() {
  take_guess();
  double sum = 0;
  VectorXd next(n_);
  for (int k = 0; k < N_; ++k) {
    const double cost = steps_.run(k, now_.x.col(k), now_.u.col(k), next);
    if (options_.start == DdpStart::kRollOut) now_.x.col(k + 1) = next;
    sum += cost;
    if (next.allFinite() && std::isfinite(cost)) continue;
    throw NumericalError("problem \"" + problem_.name + "\": the step from t = " + io::shortest(k * h_) +
                         " s is not finite at the start: " + not_finite(next, cost));
  }
  sum += end_.value(now_.x.col(N_), at_end_);
  if (now_.x.allFinite() && now_.u.allFinite() && std::isfinite(sum)) return sum;
  throw NumericalError("problem \"" + problem_.name + "\": the guess, or the cost of its end, is not finite");
}

std::string DdpMotionWork::not_finite(const VectorXd& next, double cost) const {
  for (int i = 0; i < n_; ++i) {
    if (!std::isfinite(next[i]))
      return "it gives the state \"" + problem_.states[std::size_t(i)] + "\" as " + io::shortest(next[i]);
  }
  return "its cost is " + io::shortest(cost);
}

// A, B, c, g of all stages, and the end; the adjoint, and how far from a solution it is.
void DdpMotionWork::linearise() {
  state_.is_finite = steps_.linearise(now_.x, now_.u);
  gap_ = steps_.ends() - now_.x.rightCols(N_);
  for (int k = 0; k < N_; ++k) {
    StageColumns& s = stages_[std::size_t(k)];
    s.c = gap_.col(k);
    if (!is_limited_) continue;
    s.lower = problem_.u.lower - now_.u.col(k);
    s.upper = problem_.u.upper - now_.u.col(k);
  }
  end_.expand(now_.x.col(N_), at_end_, g_end_, H_end_);
  adjoint_.col(N_) = g_end_;
  state_.gap = gap_.cwiseAbs().maxCoeff(), state_.gaps = gap_.cwiseAbs().sum();
  state_.largest_x = now_.x.cwiseAbs().maxCoeff(), state_.largest_u = now_.u.cwiseAbs().maxCoeff();
  state_.is_finite = state_.is_finite && g_end_.allFinite() && H_end_.allFinite() && find_adjoint();
  if (!state_.is_finite || is_exact()) return;
  secants_.learn(stages_, steps_.before(), now_.x, now_.u, adjoint_);
  state_.help = secants_.help();
}

// lambda_k = L_x + A^T lambda_{k+1}, and the slopes by the controls; whether they are finite.
bool DdpMotionWork::find_adjoint() {
  state_.slopes = state_.sizes = VectorXd::Zero(m_);
  for (int k = N_ - 1; k >= 0; --k) {
    const StageColumns& s = stages_[std::size_t(k)];
    of_stage_.setZero();
    add_slope(s, adjoint_.col(k + 1).data(), of_stage_.data());
    state_.sizes =
        state_.sizes.cwiseMax(of_stage_.segment(n_, m_).cwiseAbs() + s.g.segment(n_, m_).cwiseAbs());
    of_stage_ += s.g;
    add_projected(k, of_stage_.data() + n_);
    adjoint_.col(k) = of_stage_.head(n_);
  }
  return adjoint_.allFinite() && state_.sizes.allFinite();
}

// Of the entries of a slope those that a control can still follow downwards.
void DdpMotionWork::add_projected(int k, const double* slope) {
  for (int i = 0; i < m_; ++i) {
    const double u = now_.u(i, k), lower = problem_.u.lower[i], upper = problem_.u.upper[i];
    if (lower >= upper || (u <= lower && slope[i] > 0) || (u >= upper && slope[i] < 0)) continue;
    state_.slopes[i] = std::max(state_.slopes[i], std::abs(slope[i]));
  }
}

// Secants that leave a stage without a minimum are left out there.
bool DdpMotionWork::push(int k) {
  StageColumns& s = stages_[std::size_t(k)];
  if (is_exact()) {
    weights_ << riccati_.p() + riccati_.P() * s.c, 1;
    steps_.curve(k, weights_);
    return riccati_.push(s, state_.shift);
  }
  has_secants_[std::size_t(k)] =
      state_.with_secants && riccati_.push(s, state_.shift, &secants_.of_stage(std::size_t(k)));
  return has_secants_[std::size_t(k)] || riccati_.push(s, state_.shift);
}

void DdpMotionWork::backward() {
  riccati_.begin(H_end_, g_end_);
  slope_.col(N_) = g_end_;
  for (int k = N_ - 1; k >= 0; --k) {
    state_.is_convex = push(k);
    if (!state_.is_convex) {
      state_.failed_stage = k, state_.failed = riccati_.input_curvature();
      return;
    }
    policy_[std::size_t(k)] = riccati_.policy();
    slope_.col(k) = riccati_.p();
  }
  predict();
}

// Of a step of the quadratic problem: its size, what the cost changes by to first order, and by its curvature.
void DdpMotionWork::predict() {
  VectorXd dx = VectorXd::Zero(n_), &dz = of_stage_;
  double linear = 0, curved = 0, size = 0;
  dz.setZero();
  for (int k = 0; k < N_; ++k) {
    const StageColumns& s = stages_[std::size_t(k)];
    const LqrPolicy& policy = policy_[std::size_t(k)];
    size = std::max(size, policy.k.cwiseAbs().maxCoeff());
    dz.head(n_) = dx, dz.segment(n_, m_) = policy.k;
    dz.segment(n_, m_).noalias() += policy.K * dx;
    linear += s.g.dot(dz);
    curved += curvature(s.H, dz.data(), work_) / 2;
    if (has_secants_[std::size_t(k)])
      curved += curvature(secants_.of_stage(std::size_t(k)), dz.data(), work_) / 2;
    take_step(s, dz.data(), dx.data());
  }
  state_.linear = linear + g_end_.dot(dx), state_.curved = curved + dx.dot(H_end_ * dx) / 2;
  state_.step_size = size;
}

std::optional<double> DdpMotionWork::roll_out(double length) {
  double sum = 0;
  trial_.x.col(0) = problem_.start;
  for (int k = 0; k < N_; ++k) {
    const LqrPolicy& policy = policy_[std::size_t(k)];
    trial_.u.col(k) =
        limited(now_.u.col(k) + length * policy.k + policy.K * (trial_.x.col(k) - now_.x.col(k)));
    sum += steps_.run(k, trial_.x.col(k), trial_.u.col(k), trial_.x.col(k + 1));
    if (!trial_.x.col(k + 1).allFinite() || !std::isfinite(sum)) return {};
    trial_.x.col(k + 1) -= (1 - length) * gap_.col(k);
  }
  sum += end_.value(trial_.x.col(N_), at_end_);
  if (!std::isfinite(sum)) return {};
  return sum;
}

DdpMotion DdpMotionWork::motion(int) const { return {now_.x, now_.u, slope_, adjoint_, policy_}; }

void DdpMotionWork::set_policy(int, int last, const MatrixXd& k) {
  for (int i = 0; i < N_; ++i) policy_[std::size_t(i)].k = k.col(i);
  for (int i = 0; i <= std::min(last, N_ - 1); ++i) policy_[std::size_t(i)].K.setZero();
  gap_.setZero();
}

std::vector<double> DdpMotionWork::costs_of(int, const std::vector<MatrixXd>& changes) {
  const auto count = Eigen::Index(2 * changes.size());
  MatrixXd x = problem_.start.replicate(1, count);
  VectorXd costs = steps_.run_side_by_side(x, [&](int k, MatrixXd& u) {
    u = now_.u.col(k).replicate(1, count);
    for (std::size_t i = 0; i < changes.size(); ++i)
      u.col(Eigen::Index(2 * i)) += changes[i].col(k), u.col(Eigen::Index(2 * i + 1)) -= changes[i].col(k);
    if (!is_limited_) return;
    for (auto one : u.colwise()) one = limited(one);
  });
  for (Eigen::Index i = 0; i < count; ++i) costs[i] += end_.value(x.col(i), at_end_);
  return {costs.begin(), costs.end()};
}

}  // namespace dyntape
