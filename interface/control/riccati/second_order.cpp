// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/riccati/second_order.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/nlp/lifted_nlp.h>
#include <dyntape/interface/control/riccati/stage_kkt.h>

namespace dyntape {

namespace {

using Eigen::VectorXd;

constexpr std::size_t kMostOfStage = 500;  // variables: factors are dense
constexpr double kLeastCurvature = 1e-7;   // of the largest entry of W: curvature that says nothing
constexpr double kCurved = 1e-6;           // of what d . W d is summed up from: negative beyond rounding
constexpr double kNoCurvature =
    1e-6;  // of the largest entry of W, and of 1: a curvature that may be the barrier's
constexpr std::size_t kMostFlat = 24;     // directions
constexpr double kLeastDistance = 1e-12;  // from a bound, of max(1, |bound|)
constexpr double kMostRaised = 1e12;
constexpr int kBisections = 8, kInverseIterations = 12;

std::size_t largest_stage(const NlpShape& shape) {
  std::size_t most = 0;
  for (std::size_t k = 0; k < shape.stages.size(); ++k) {
    const std::size_t end = k + 1 < shape.stages.size() ? shape.stages[k + 1] : shape.n();
    most = std::max(most, end - shape.stages[k]);
  }
  return shape.stages.empty() ? shape.n() : most;
}

// multiplier / distance, of a bound that is there.
double barrier_curvature(double multiplier, double value, double bound) {
  if (!std::isfinite(bound)) return 0;
  return std::max(multiplier, 0.0) /
         std::max(std::abs(value - bound), kLeastDistance * std::max(1.0, std::abs(bound)));
}

// A program with the Hessian of its Lagrangian by central differences of first derivatives, for programs whose own is an
// approximation.  Stages share no entry of it, so a variable of each is moved at once.
class DifferencedHessian : public Nlp {
 public:
  explicit DifferencedHessian(Nlp& nlp) : nlp_(nlp), shape_(nlp.shape()) {
    shape_.hessian_kind = HessianKind::kExact;
    begins_ = shape_.stages.empty() ? std::vector<std::size_t>{0} : shape_.stages;
    begins_.push_back(shape_.n());
    std::vector<std::vector<std::uint32_t>> rows(shape_.n());
    for (std::size_t k = 0; k + 1 < begins_.size(); ++k) {
      for (std::size_t row = begins_[k]; row < begins_[k + 1]; ++row)
        for (std::size_t col = begins_[k]; col <= row; ++col) rows[row].push_back(std::uint32_t(col));
    }
    shape_.hessian = pattern_from_rows(rows, shape_.n());
  }

  const NlpShape& shape() const override { return shape_; }
  bool objective(const double* x, double& value) override { return nlp_.objective(x, value); }
  bool gradient(const double* x, double* gradient) override { return nlp_.gradient(x, gradient); }
  bool constraints(const double* x, double* g) override { return nlp_.constraints(x, g); }
  bool jacobian(const double* x, double* nonzeros) override { return nlp_.jacobian(x, nonzeros); }

  bool hessian(const double* x, double sigma, const double* lambda, double* nonzeros) override {
    constexpr double kStep = 1e-5;
    const std::size_t n = shape_.n(), most = largest_stage(shape_);
    std::vector<double> moved(n), above, below;
    std::fill_n(nonzeros, shape_.hessian.nnz(), 0.0);
    const auto step = [&](std::size_t i) { return kStep * std::max(1.0, std::abs(x[i])); };
    for (std::size_t local = 0; local < most; ++local) {
      const auto lagrangian = [&](double sign, std::vector<double>& slope) {
        std::copy(x, x + n, moved.begin());
        for (std::size_t k = 0; k + 1 < begins_.size(); ++k) {
          const std::size_t i = begins_[k] + local;
          if (i < begins_[k + 1]) moved[i] += sign * step(i);
        }
        return lagrangian_slope(moved, sigma, lambda, slope);
      };
      if (!lagrangian(1, above) || !lagrangian(-1, below)) return false;
      for (std::size_t e = 0; e < shape_.hessian.nnz(); ++e) {
        const std::size_t row = shape_.hessian.row[e], col = shape_.hessian.col[e];
        const auto is_moved = [&](std::size_t i) {
          return i - *std::prev(std::upper_bound(begins_.begin(), begins_.end(), i)) == local;
        };
        if (is_moved(col)) nonzeros[e] += (above[row] - below[row]) / (4 * step(col));
        if (is_moved(row)) nonzeros[e] += (above[col] - below[col]) / (4 * step(row));
      }
    }
    return true;
  }

 private:
  bool lagrangian_slope(const std::vector<double>& x, double sigma, const double* lambda,
                        std::vector<double>& slope) {
    slope.resize(shape_.n()), jacobian_.resize(shape_.jacobian.nnz());
    if (!nlp_.gradient(x.data(), slope.data()) || !nlp_.jacobian(x.data(), jacobian_.data())) return false;
    for (double& entry : slope) entry *= sigma;
    for (std::size_t e = 0; e < jacobian_.size(); ++e)
      slope[shape_.jacobian.col[e]] += lambda[shape_.jacobian.row[e]] * jacobian_[e];
    return true;
  }

  Nlp& nlp_;
  NlpShape shape_;
  std::vector<std::size_t> begins_;  // of stages, and the end
  std::vector<double> jacobian_;
};

// What is judged: the Hessian W of sigma f + lambda . g, on rows that hold, or with elastic rows, which add J^T J.
struct Curved {
  double sigma;
  std::vector<double> lambda;
  KktDiagonal diagonal;
};

class ReducedHessian {
 public:
  ReducedHessian(Nlp& nlp, const std::vector<double>& x, Curved curved)
      : nlp_(nlp), kkt_(nlp), shape_(nlp.shape()), x_(x), curved_(std::move(curved)) {}

  CurvatureCheck judge() {
    if (!set()) return {};
    if (is_positive(flat())) return {StationaryPoint::kMinimum, {}, flat_directions()};
    const std::optional<VectorXd> d = negative_direction();
    if (!d) return {};
    return {StationaryPoint::kNotMinimum, {d->begin(), d->end()}};
  }

 private:
  // False where the program has no derivatives here.
  bool set() {
    jacobian_.resize(shape_.jacobian.nnz()), hessian_.resize(shape_.hessian.nnz());
    if (!nlp_.hessian(x_.data(), curved_.sigma, curved_.lambda.data(), hessian_.data()) ||
        !nlp_.jacobian(x_.data(), jacobian_.data()))
      return false;
    kkt_.set(jacobian_.data(), hessian_.data());
    for (double entry : hessian_) largest_ = std::max(largest_, std::abs(entry));
    return std::isfinite(largest_);
  }

  bool is_positive(double shift) {
    curved_.diagonal.shift = shift;
    return kkt_.factor(curved_.diagonal);
  }
  double flat() const { return kLeastCurvature * std::max(largest_, kLeastCurvature); }

  // (n) of most negative curvature, its largest entry 1; none where none is negative beyond rounding.
  std::optional<VectorXd> negative_direction() {
    double below = flat(), above = below;
    do {
      below = above, above *= 10;
      if (above > kMostRaised * std::max(largest_, 1.0)) return {};
    } while (!is_positive(above));
    for (int i = 0; i < kBisections; ++i) {
      const double middle = std::sqrt(below * above);
      (is_positive(middle) ? above : below) = middle;
    }
    if (!is_positive(above)) return {};
    KktVector right, step;
    for (KktVector* v : {&right, &step}) {
      v->x.setZero(Eigen::Index(shape_.n()));
      v->s.setZero(Eigen::Index(shape_.m())), v->c.setZero(Eigen::Index(shape_.m()));
    }
    // Any start that is not orthogonal to the direction: entries of mixed signs and sizes.
    for (Eigen::Index i = 0; i < right.x.size(); ++i) right.x[i] = std::sin(1.0 + 2.3 * double(i));
    for (int i = 0; i < kInverseIterations; ++i) {
      kkt_.solve(right, step);
      const double size = step.x.cwiseAbs().maxCoeff();
      if (!(size > 0) || !step.x.allFinite()) return {};
      right.x = step.x / size;
    }
    if (!is_negative(right.x)) return {};
    return right.x;
  }

  // One for each variable of a stage: what the same change of it in all stages becomes, where rows allow it.
  std::vector<std::vector<double>> flat_directions() {
    std::vector<std::vector<double>> found;
    if (curved_.diagonal.elastic > 0) return found;
    const double shift = kNoCurvature * std::max(largest_, 1.0);
    if (is_positive(-shift) || !is_positive(shift)) return found;
    const std::size_t most = std::min(largest_stage(shape_), kMostFlat);
    KktVector right, step;
    for (KktVector* v : {&right, &step}) {
      v->x.setZero(Eigen::Index(shape_.n()));
      v->s.setZero(Eigen::Index(shape_.m())), v->c.setZero(Eigen::Index(shape_.m()));
    }
    for (std::size_t local = 0; local < most; ++local) {
      right.x.setZero();
      for (std::size_t k = 0; k < std::max<std::size_t>(shape_.stages.size(), 1); ++k) {
        const std::size_t begin = shape_.stages.empty() ? 0 : shape_.stages[k];
        const std::size_t end = k + 1 < shape_.stages.size() ? shape_.stages[k + 1] : shape_.n();
        if (begin + local < end) right.x[Eigen::Index(begin + local)] = 1;
      }
      for (int i = 0; i < 2; ++i) {
        kkt_.solve(right, step);
        const double size = step.x.cwiseAbs().maxCoeff();
        if (!(size > 0) || !step.x.allFinite()) break;
        right.x = step.x / size;
      }
      const double curvature = curvature_along(right.x);
      if (std::isfinite(curvature) && curvature <= 10 * shift * right.x.squaredNorm())
        found.emplace_back(right.x.begin(), right.x.end());
    }
    return found;
  }

  double curvature_along(const VectorXd& d) const {
    double curvature = curved_.diagonal.sigma_x.dot(d.cwiseAbs2());
    for (std::size_t e = 0; e < hessian_.size(); ++e) {
      const auto row = shape_.hessian.row[e], col = shape_.hessian.col[e];
      curvature += (row == col ? 1 : 2) * hessian_[e] * d[row] * d[col];
    }
    return curvature;
  }

  // d . (W + Sigma) d < 0 beyond rounding, along rows that do not change; or with what elastic rows add.
  bool is_negative(const VectorXd& d) const {
    const KktDiagonal& diagonal = curved_.diagonal;
    double curvature = diagonal.sigma_x.dot(d.cwiseAbs2()), size = curvature;
    for (std::size_t e = 0; e < hessian_.size(); ++e) {
      const auto row = shape_.hessian.row[e], col = shape_.hessian.col[e];
      const double term = (row == col ? 1 : 2) * hessian_[e] * d[row] * d[col];
      curvature += term, size += std::abs(term);
    }
    VectorXd moved = VectorXd::Zero(Eigen::Index(shape_.m())), most = moved;
    for (std::size_t e = 0; e < jacobian_.size(); ++e) {
      const double term = jacobian_[e] * d[shape_.jacobian.col[e]];
      moved[shape_.jacobian.row[e]] += term;
      most[shape_.jacobian.row[e]] = std::max(most[shape_.jacobian.row[e]], std::abs(term));
    }
    constexpr double kMoves = 1e-6;
    for (Eigen::Index j = 0; j < moved.size(); ++j) {
      const double square = moved[j] * moved[j], sigma = diagonal.sigma_s[j], elastic = diagonal.elastic;
      if (kkt_.kind(std::size_t(j)) == RowKind::kInequality) {
        curvature += sigma / (1 + elastic * sigma) * square;
      } else if (kkt_.kind(std::size_t(j)) == RowKind::kEquality && elastic > 0) {
        curvature += square / elastic;
      } else if (kkt_.kind(std::size_t(j)) == RowKind::kEquality &&
                 std::abs(moved[j]) > kMoves * (1 + most[j])) {
        return false;
      }
    }
    return curvature < -kCurved * size;
  }

  Nlp& nlp_;
  StagewiseKkt kkt_;
  const NlpShape& shape_;
  const std::vector<double> x_;
  Curved curved_;
  std::vector<double> jacobian_, hessian_;
  double largest_ = 0;
};

KktDiagonal diagonal_of(const NlpShape& shape) {
  KktDiagonal diagonal;
  diagonal.sigma_x.setZero(Eigen::Index(shape.n())), diagonal.sigma_s.setZero(Eigen::Index(shape.m()));
  return diagonal;
}

// Judged on a program whose rows tie neighbours alone (lifted_nlp.h); `curved` is of the program itself.
CurvatureCheck judge(Nlp& problem, const std::vector<double>& x, Curved curved) {
  const NlpShape& shape = problem.shape();
  if (largest_stage(shape) > kMostOfStage) return {};
  if (shape.hessian_kind != HessianKind::kExact) {
    DifferencedHessian differenced(problem);
    return judge(differenced, x, std::move(curved));
  }
  try {
    if (!LiftedNlp::is_needed(shape)) return ReducedHessian(problem, x, std::move(curved)).judge();
    LiftedNlp carried(problem, x);
    KktDiagonal diagonal = diagonal_of(carried.shape());
    diagonal.elastic = curved.diagonal.elastic;
    diagonal.sigma_s.head(curved.diagonal.sigma_s.size()) = curved.diagonal.sigma_s;
    for (std::size_t i = 0; i < shape.n(); ++i)
      diagonal.sigma_x[Eigen::Index(carried.place_of(i))] = curved.diagonal.sigma_x[Eigen::Index(i)];
    curved.diagonal = std::move(diagonal);
    CurvatureCheck check = ReducedHessian(carried, carried.start(x), std::move(curved)).judge();
    const auto own = [&](const std::vector<double>& direction) {
      std::vector<double> of_problem(direction.empty() ? 0 : shape.n());
      for (std::size_t i = 0; i < of_problem.size(); ++i) of_problem[i] = direction[carried.place_of(i)];
      return of_problem;
    };
    check.direction = own(check.direction);
    for (std::vector<double>& direction : check.flat) direction = own(direction);
    return check;
  } catch (const ArgumentError&) {  // rows that tie more than neighbours
    return {};
  }
}

}  // namespace

CurvatureCheck check_second_order(Nlp& problem, const NlpSolution& at) {
  const NlpShape& shape = problem.shape();
  if (at.lambda.size() != shape.m() || at.g.size() != shape.m() || at.lower_multiplier.size() != shape.n())
    return {};
  KktDiagonal diagonal = diagonal_of(shape);
  for (std::size_t i = 0; i < shape.n(); ++i)
    diagonal.sigma_x[Eigen::Index(i)] = barrier_curvature(at.lower_multiplier[i], at.x[i], shape.x_lower[i]) +
                                        barrier_curvature(at.upper_multiplier[i], at.x[i], shape.x_upper[i]);
  for (std::size_t j = 0; j < shape.m(); ++j)
    diagonal.sigma_s[Eigen::Index(j)] = barrier_curvature(at.lambda[j], at.g[j], shape.g_upper[j]) +
                                        barrier_curvature(-at.lambda[j], at.g[j], shape.g_lower[j]);
  return judge(problem, at.x, {1, at.lambda, std::move(diagonal)});
}

std::vector<double> falls_along(Nlp& problem, const NlpSolution& at,
                                const std::vector<std::vector<double>>& flat) {
  constexpr double kNear = 0.05, kFar = 0.1;  // lengths
  constexpr double kLeastFall = 1e-10;        // of the sum of all magnitudes
  constexpr double kHigherOrder =
      5;  // falls of order two or one grow by four or two from one length to the other
  const NlpShape& shape = problem.shape();
  std::vector<double> g(shape.m()), x, all;
  double size = 0;
  const auto lagrangian = [&](const std::vector<double>& d, double length) {
    x = at.x;
    for (std::size_t i = 0; i < d.size(); ++i)
      x[i] = std::clamp(x[i] + length * d[i], shape.x_lower[i], shape.x_upper[i]);
    double value = 0;
    if (!problem.objective(x.data(), value) || !problem.constraints(x.data(), g.data())) return std::nan("");
    size = std::abs(value);
    for (std::size_t j = 0; j < g.size(); ++j) {
      const double term = at.lambda[j] == 0 ? 0 : at.lambda[j] * (g[j] - at.g[j]);
      value += term, size += std::abs(term);
    }
    return value;
  };
  for (const std::vector<double>& d : flat) {
    for (const double sign : {1.0, -1.0}) {
      const double here = lagrangian(d, 0), near = lagrangian(d, sign * kNear) - here,
                   far = lagrangian(d, sign * kFar) - here;
      if (!(far < -kLeastFall * std::max(size, 1.0)) || !(near < 0) || !(far <= kHigherOrder * near))
        continue;
      all.resize(d.size(), 0.0);
      for (std::size_t i = 0; i < d.size(); ++i) all[i] += sign * d[i];
      break;
    }
  }
  return all;
}

CurvatureCheck check_violation(Nlp& problem, const std::vector<double>& x) {
  constexpr double kStiff = 1e8;  // of a violated inequality: as good as an equality
  const NlpShape& shape = problem.shape();
  std::vector<double> g(shape.m()), lacks(shape.m());
  if (!problem.constraints(x.data(), g.data())) return {};
  KktDiagonal diagonal = diagonal_of(shape);
  diagonal.elastic = 1;
  for (std::size_t j = 0; j < g.size(); ++j) {
    lacks[j] = std::max(0.0, g[j] - shape.g_upper[j]) - std::max(0.0, shape.g_lower[j] - g[j]);
    if (lacks[j] != 0) diagonal.sigma_s[Eigen::Index(j)] = kStiff;
  }
  return judge(problem, x, {0, std::move(lacks), std::move(diagonal)});
}

}  // namespace dyntape
