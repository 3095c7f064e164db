// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/solve/ddp_sensitivities.h>

#include <cmath>

#include <dyntape/autodiff/factorisations.h>
#include <dyntape/interface/control/discretize/end_cost.h>
#include <dyntape/interface/control/solve/shooting_steps.h>

namespace dyntape {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNotStrict = 1e-10;  // of the largest curvature by controls: no strict minimum

// f of a stage whose last states are what its parameters are changed by.
StageFunction of_offsets(const StageFunction& f, Index n_x) {
  if (f.empty()) return {};
  return [f, n_x](const auto& s) {
    auto told = s;
    told.x = s.x.head(n_x);
    told.p = s.p + s.x.tail(s.x.size() - n_x);
    return f(told);
  };
}

VectorXd followed_by(const VectorXd& first, Index count, double value) {
  VectorXd all(first.size() + count);
  all << first, VectorXd::Constant(count, value);
  return all;
}

// The problem of states (x, d).
Problem with_offsets(const Problem& problem) {
  const Index n_x = problem.n_x(), n_p = problem.parameters.size();
  Problem result = problem;
  for (const std::string& name : problem.parameters.entry_names())
    result.states.push_back("change of " + name);
  const StageFunction rate = of_offsets(problem.rate, n_x);
  result.rate = [rate, n_p](const auto& s) {
    auto values = rate(s);
    const Index n = values.size();
    values.conservativeResize(n + n_p);
    for (Index i = n; i < n + n_p; ++i) values[i] = 0;
    return values;
  };
  result.ode = {};
  for (Term& term : result.terms) {
    term.function = of_offsets(term.function, n_x);
    term.curvature = of_offsets(term.curvature, n_x);
  }
  result.x = {followed_by(problem.x.lower, n_p, -HUGE_VAL), followed_by(problem.x.upper, n_p, HUGE_VAL)};
  result.start = followed_by(problem.start, n_p, 0);
  result.goal = followed_by(problem.goal, n_p, Problem::kFree);
  if (problem.typical.size() > 0) result.typical = followed_by(problem.typical, n_p, 0);
  if (problem.most_typical.size() > 0) result.most_typical = followed_by(problem.most_typical, n_p, 0);
  result.guess = [problem, n_p](double t) {
    Stage<double> stage = problem.first_guess(t);
    stage.x = followed_by(stage.x, n_p, 0);
    return stage;
  };
  return result;
}

CodegenOptions to_order(Order order, CodegenOptions options) {
  options.order = order;
  return options;
}

// One linearisation and one recursion at a solution.
class PassAtSolution {
 public:
  PassAtSolution(const CompiledFunction& step, const CompiledFunction& end, const Problem& now,
                 const DdpSolution& solution)
      : wide_(with_offsets(now)),
        n_(wide_.n_x()),
        m_(wide_.n_u()),
        N_(solution.u.cols()),
        u_(solution.u),
        is_limited_((wide_.u.lower.array().abs() < HUGE_VAL).any() ||
                    (wide_.u.upper.array().abs() < HUGE_VAL).any()),
        x_(MatrixXd::Zero(n_, N_ + 1)),
        steps_(step, wide_, int(N_)) {
    x_.topRows(solution.x.rows()) = solution.x;
    is_finite_ = steps_.linearise(x_, u_);
    EndCost(end).expand(x_.col(N_), parameters_of(wide_, wide_.duration), g_end_, H_end_);
    find_adjoint();
  }

  bool is_finite() const { return is_finite_; }
  VectorXd cost_slopes() const { return adjoint_.col(0); }  // by (x, d) at the start
  bool is_weak() const { return is_weak_; }

  // dw of all nodes and du, a column an entry of dw_0; false where a stage has no minimum.
  bool find_changes(MatrixXd& x, MatrixXd& u) {
    std::vector<MatrixXd> gains(static_cast<std::size_t>(N_));
    Riccati riccati;
    riccati.begin(H_end_, g_end_);
    VectorXd weights(n_ + 1);
    for (Index k = N_ - 1; k >= 0; --k) {
      StageColumns& s = steps_.stages()[std::size_t(k)];
      if (is_limited_) s.lower = wide_.u.lower - u_.col(k), s.upper = wide_.u.upper - u_.col(k);
      weights << riccati.p(), 1;
      steps_.curve(int(k), weights);
      if (!riccati.push(s, 0)) return false;
      look_for_flat(k, riccati.input_curvature());
      gains[std::size_t(k)] = riccati.policy().K;
    }
    if (least_curvature_ <= kNotStrict * most_curvature_) return false;
    x.resize(n_ * (N_ + 1), n_), u.resize(m_ * N_, n_);
    x.topRows(n_).setIdentity();
    for (Index k = 0; k < N_; ++k) {
      const auto F = steps_.stages()[std::size_t(k)].Ft.topRows(n_ + m_).transpose();
      u.middleRows(k * m_, m_).noalias() = gains[std::size_t(k)] * x.middleRows(k * n_, n_);
      x.middleRows((k + 1) * n_, n_) =
          F.leftCols(n_) * x.middleRows(k * n_, n_) + F.rightCols(m_) * u.middleRows(k * m_, m_);
    }
    return true;
  }

 private:
  void find_adjoint() {
    adjoint_.resize(n_, N_ + 1), adjoint_.col(N_) = g_end_;
    MatrixXd slopes(m_, N_);
    VectorXd of_stage(steps_.stages()[0].g.size()), sizes = VectorXd::Zero(m_);
    for (Index k = N_ - 1; k >= 0; --k) {
      const StageColumns& s = steps_.stages()[std::size_t(k)];
      of_stage.setZero();
      add_slope(s, adjoint_.col(k + 1).data(), of_stage.data());
      sizes = sizes.cwiseMax(of_stage.segment(n_, m_).cwiseAbs() + s.g.segment(n_, m_).cwiseAbs());
      of_stage += s.g;
      slopes.col(k) = of_stage.segment(n_, m_), adjoint_.col(k) = of_stage.head(n_);
    }
    is_finite_ = is_finite_ && adjoint_.allFinite() && H_end_.allFinite();
    look_for_weak(slopes, sizes);
  }

  // The least and the largest curvature by controls that are at no limit.
  void look_for_flat(Index k, const MatrixXd& curvature) {
    std::vector<Index> free;
    for (Index i = 0; i < m_; ++i)
      if (u_(i, k) > wide_.u.lower[i] && u_(i, k) < wide_.u.upper[i]) free.push_back(i);
    if (free.empty()) return;
    const VectorXd values = symmetric_eigen(MatrixXd(curvature(free, free))).values;
    least_curvature_ = std::min(least_curvature_, values.minCoeff());
    most_curvature_ = std::max(most_curvature_, values.maxCoeff());
  }

  void look_for_weak(const MatrixXd& slopes, const VectorXd& sizes) {
    const double near = kWeaklyHeld * u_.cwiseAbs().maxCoeff();
    for (Index k = 0; k < N_; ++k) {
      for (Index i = 0; i < m_; ++i) {
        const double u = u_(i, k), lower = wide_.u.lower[i], upper = wide_.u.upper[i];
        if (lower >= upper) continue;
        const bool is_held = u <= lower || u >= upper;
        is_weak_ = is_weak_ || (is_held ? std::abs(slopes(i, k)) <= kWeaklyHeld * sizes[i]
                                        : std::min(u - lower, upper - u) <= near);
      }
    }
  }

  Problem wide_;
  Index n_, m_, N_;
  const MatrixXd& u_;
  bool is_limited_;
  MatrixXd x_, H_end_, adjoint_;
  VectorXd g_end_;
  ShootingSteps steps_;
  bool is_finite_ = false, is_weak_ = false;
  double least_curvature_ = HUGE_VAL, most_curvature_ = 0;
};

}  // namespace

ChangesOfMotion::ChangesOfMotion(Index n_w, Index n_u, Index intervals, bool with_motion)
    : cost(VectorXd::Constant(n_w, std::nan(""))) {
  if (!with_motion) return;
  x.setConstant(n_w * (intervals + 1), n_w, std::nan(""));
  u.setConstant(n_u * intervals, n_w, std::nan(""));
}

DdpSensitivities sensitivities_of(SensitivityStatus status, const ChangesOfMotion& changes, Index n_x) {
  DdpSensitivities result;
  result.status = status;
  const Index n_w = changes.cost.size(), nodes = changes.x.rows() / n_w;
  for (MotionDerivatives* by : {&result.start, &result.parameters}) {
    const Index first = by == &result.start ? 0 : n_x, count = by == &result.start ? n_x : n_w - n_x;
    by->cost = changes.cost.segment(first, count);
    if (nodes == 0) continue;
    by->u = changes.u.middleCols(first, count);
    by->x.resize(n_x * nodes, count);
    for (Index k = 0; k < nodes; ++k)
      by->x.middleRows(k * n_x, n_x) = changes.x.block(k * n_w, first, n_x, count);
  }
  return result;
}

DdpDerivatives::DdpDerivatives(const Problem& problem, const DdpOptions& options)
    : DdpDerivatives(record_shooting(with_offsets(problem), options.scheme), options) {}

DdpDerivatives::DdpDerivatives(const RecordedShooting& recorded, const DdpOptions& options)
    : is_of_motion_(options.sensitivities == SensitivitiesOf::kMotion),
      step_(CompiledFunction::make(
          recorded.step, to_order(is_of_motion_ ? Order::kSecond : Order::kFirst, options.evaluation))),
      end_(CompiledFunction::make(recorded.end, to_order(Order::kSecond, options.evaluation))) {}

DdpSensitivities DdpDerivatives::at(const Problem& now, const DdpSolution& solution) const {
  const Index n_x = now.n_x();
  ChangesOfMotion changes(n_x + now.parameters.size(), now.n_u(), solution.u.cols(), is_of_motion_);
  if (!solution.converged()) return sensitivities_of(SensitivityStatus::kNotASolution, changes, n_x);
  PassAtSolution pass(step_, end_, now, solution);
  if (!pass.is_finite()) return sensitivities_of(SensitivityStatus::kNotFinite, changes, n_x);
  changes.cost = pass.cost_slopes();
  if (is_of_motion_ && !pass.find_changes(changes.x, changes.u))
    return sensitivities_of(SensitivityStatus::kNoStrictMinimum, changes, n_x);
  const bool is_weak = is_of_motion_ && pass.is_weak();
  return sensitivities_of(is_weak ? SensitivityStatus::kWeaklyActive : SensitivityStatus::kGood, changes,
                          n_x);
}

}  // namespace dyntape
