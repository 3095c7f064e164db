// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/sensitivity/solution_sensitivities.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/nlp/kkt.h>
#include <dyntape/interface/control/nlp/scaled_nlp.h>
#include <dyntape/interface/control/riccati/stage_kkt.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

using Eigen::VectorXd;

// In the units of the solve, in which numbers are near one.
constexpr double kNothing = 1e-9;  // no bound multiplier, no distance
constexpr double kWeak = 1e-4;     // at most, of a weakly active bound
const std::string kUnclear = "active bounds cannot be distinguished from inactive ones: a Newton step ";
constexpr double kMostResidual = 1e-4;  // of the first-order conditions
constexpr double kLongest = 1e-3;       // of the Newton step, beside 1 + |x|
constexpr double kMostMissed = 1e-6;    // of rows that are not dependent, as a part of what was asked of them

NlpScaling units_of(Nlp& nlp, const NlpSolution& solution) {
  const NlpShape& shape = nlp.shape();
  const auto check_size = [&](const std::string& what, std::size_t found, std::size_t expected) {
    if (found != expected)
      throw ArgumentError("derivatives of a solution: " + what + " has " + std::to_string(found) +
                          " entries, the program has " + std::to_string(expected));
  };
  if (shape.hessian_kind != HessianKind::kExact)
    throw ArgumentError(
        "derivatives of a solution: the Hessian of the program is not exact, and derivatives would be wrong; "
        "expected "
        "HessianKind::kExact");
  check_size("x", solution.x.size(), shape.n());
  check_size("lambda", solution.lambda.size(), shape.m());
  check_size("lower_multiplier", solution.lower_multiplier.size(), shape.n());
  check_size("upper_multiplier", solution.upper_multiplier.size(), shape.n());
  return solution.units.x.empty() ? nlp.scaling(solution.x) : solution.units;
}

}  // namespace

// All of it in scaled units; along() and solve() translate.
class SolutionSensitivities::Held {
  // Only the shape of a program: what StagewiseKkt looks at.
  class ShapeOnly : public Nlp {
   public:
    explicit ShapeOnly(const Nlp& nlp) : nlp_(nlp), shape_(nlp.shape()) {}
    const NlpShape& shape() const override { return shape_; }
    NlpShape& shape() { return shape_; }
    bool objective(const double*, double&) override { return false; }
    bool gradient(const double*, double*) override { return false; }
    bool constraints(const double*, double*) override { return false; }
    bool jacobian(const double*, double*) override { return false; }
    bool hessian(const double*, double, const double*, double*) override { return false; }
    std::string constraint_name(std::size_t j) const override { return nlp_.constraint_name(j); }

   private:
    const Nlp& nlp_;  // while it is laid out
    NlpShape shape_;
  };

 public:
  Held(Nlp& nlp, const NlpSolution& solution)
      : scaled_(nlp, units_of(nlp, solution)),
        at_(scaled_.in_scaled_units(solution)),
        n_(Eigen::Index(nlp.shape().n())),
        m_(Eigen::Index(nlp.shape().m())),
        bounds_(scaled_.shape()),
        program_(nlp),
        of_x_(Eigen::Map<const VectorXd>(scaled_.units().x.data(), n_)),
        of_g_(Eigen::Map<const VectorXd>(scaled_.units().g.data(), m_)),
        of_f_(scaled_.units().objective) {
    zero_ = {VectorXd::Zero(n_), VectorXd::Zero(m_), VectorXd::Zero(n_), 0, 0, 0};
    correction_ = zero_;
    diagonal_.sigma_x.setZero(n_), diagonal_.sigma_s.setZero(m_);
    if (!evaluate()) return;
    judge();
    if (!factor(without_inactive_multipliers())) return;
    correct(nlp);
    if (is_smooth_) smooth();
  }

  // Of held variables by d, held rows by e; in scaled units.
  SolutionStep moved(const VectorXd& d, const VectorXd& e) {
    VectorXd a = VectorXd::Zero(n_), b = VectorXd::Zero(m_), shift = VectorXd::Zero(n_);
    for (Eigen::Index i = 0; i < n_; ++i) shift[i] = is_free(i) ? 0 : d[i];
    kkt_->add_hessian(shift, a), add_jacobian(shift, b);
    VectorXd of_barrier = VectorXd::Zero(n_);  // of bounds that move
    for (std::size_t i : held_variables_) {
      const auto at = Eigen::Index(i);
      of_barrier[at] = diagonal_.sigma_x[at] * d[at];
    }
    SolutionStep s = solved(of_barrier - a, e - b, shift);
    for (Eigen::Index i = 0; i < n_; ++i) {
      if (is_free(i)) s.bound_multiplier[i] -= of_barrier[i];
    }
    return s;
  }

  // `shift`: of variables that are not free.
  SolutionStep solved(const VectorXd& a, const VectorXd& b, const VectorXd& shift) {
    KktVector right{VectorXd::Zero(n_), VectorXd::Zero(m_), VectorXd::Zero(m_)}, step = right;
    for (Eigen::Index i = 0; i < n_; ++i) right.x[i] = is_free(i) ? a[i] : 0;
    for (Eigen::Index j = 0; j < m_; ++j) right.c[j] = has_multiplier(j) ? b[j] : 0;
    kkt_->solve(right, step);
    SolutionStep s{step.x + shift, step.c, VectorXd::Zero(n_), 0, -HUGE_VAL, HUGE_VAL};
    for (Eigen::Index j = 0; j < m_; ++j) {
      if (!has_multiplier(j)) s.lambda[j] = 0;
    }
    VectorXd slope = VectorXd::Zero(n_);  // of grad L
    kkt_->add_hessian(s.x, slope);
    kkt_->add_transposed(s.lambda, slope);
    for (Eigen::Index i = 0; i < n_; ++i)
      s.bound_multiplier[i] = is_free(i) ? diagonal_.sigma_x[i] * s.x[i] : -slope[i];
    return s;
  }

  double cost(const VectorXd& d, const VectorXd& e) const {
    double sum = 0;
    for (Eigen::Index i = 0; i < n_; ++i) {
      if (!is_free(i)) sum += slope_[i] * d[i];
    }
    for (std::size_t i : held_variables_) {
      const auto at = Eigen::Index(i);
      if (is_free(at)) sum += slope_[at] * d[at];  // by its barrier
    }
    for (Eigen::Index j = 0; j < m_; ++j) {
      if (has_multiplier(j)) sum -= lambda_[j] * e[j];
    }
    return sum;
  }

  // How far the step may go either way; `e`: by how much bounds of rows move on it.
  void measure(SolutionStep& s, const VectorXd& e) {
    if (is_smooth_) s.from = s.to = 0;
    if (is_smooth_) return;
    const auto reach = [&](double left, double change) {  // of what must stay positive
      if (change < 0) s.to = std::min(s.to, std::max(0.0, left) / -change);
      if (change > 0) s.from = std::max(s.from, -std::max(0.0, left) / change);
    };
    VectorXd change = -e;
    add_jacobian(s.x, change);
    for (const Limit& limit : limits_) {
      const Eigen::Index i = limit.place;
      if (limit.is_implied) continue;
      if (limit.of_row)
        limit.is_held ? reach(limit.bound_multiplier, limit.side * s.lambda[i])
                      : reach(limit.distance, -limit.side * change[i]);
      else
        limit.is_held ? reach(limit.bound_multiplier, limit.side * s.bound_multiplier[i])
                      : reach(limit.distance, -limit.side * s.x[i]);
    }
  }

  SolutionStep to_own(SolutionStep s) const {
    s.x.array() *= of_x_.array();
    s.lambda.array() *= of_f_ / of_g_.array();
    s.bound_multiplier.array() *= of_f_ / of_x_.array();
    s.cost *= of_f_;
    return s;
  }
  SolutionStep none() const {
    SolutionStep s = zero_;
    s.x.setConstant(NAN), s.lambda.setConstant(NAN), s.bound_multiplier.setConstant(NAN);
    s.cost = NAN;
    return s;
  }

  bool is_free(Eigen::Index i) const { return !kkt_->is_fixed(std::size_t(i)); }
  bool has_multiplier(Eigen::Index j) const { return kkt_->kind(std::size_t(j)) != RowKind::kFree; }
  bool has_slopes() const { return status_ <= SensitivityStatus::kDependentRows; }

  VectorXd in_x(const VectorXd& d) const { return d.cwiseQuotient(of_x_); }
  VectorXd in_g(const VectorXd& e) const { return e.cwiseQuotient(of_g_); }
  VectorXd in_slope(const VectorXd& a) const { return a.cwiseProduct(of_x_) / of_f_; }
  void check(const VectorXd& of_variables, const VectorXd& of_rows) const {
    if (of_variables.size() == n_ && of_rows.size() == m_) return;
    throw ArgumentError("derivatives of a solution: a direction has " + std::to_string(of_variables.size()) +
                        " variables and " + std::to_string(of_rows.size()) + " rows, the program has " +
                        std::to_string(n_) + " and " + std::to_string(m_));
  }

  SensitivityStatus status_ = SensitivityStatus::kGood;
  std::string why_;
  std::vector<std::size_t> weak_variables_, weak_rows_, held_variables_, held_rows_;
  SolutionStep correction_;

 private:
  // A bound of a variable or of an inequality: side -1 the lower one, 1 the upper one.
  struct Limit {
    Eigen::Index place;
    bool of_row;
    int side;
    double bound_multiplier, distance;        // at the solution that is approached
    double given_multiplier, given_distance;  // at the one that was given
    bool is_held;
    bool is_implied = false;  // by the rows, of another that is held
  };

  bool fail(SensitivityStatus status, std::string why) {
    if (status_ == SensitivityStatus::kGood || status > status_) status_ = status, why_ = std::move(why);
    return false;
  }

  bool is_finite() {
    g_.resize(m_), gradient_.resize(n_), J_.resize(Eigen::Index(bounds_.jacobian.nnz()));
    bool good = scaled_.constraints(at_.x.data(), g_.data()) &&
                scaled_.gradient(at_.x.data(), gradient_.data()) &&
                scaled_.jacobian(at_.x.data(), J_.data()) && g_.allFinite() && gradient_.allFinite() &&
                J_.allFinite();
    for (const std::vector<double>* part :
         {&at_.x, &at_.lambda, &at_.lower_multiplier, &at_.upper_multiplier})
      good = good && VectorXd::Map(part->data(), Eigen::Index(part->size())).allFinite();
    return good;
  }

  bool evaluate() {
    if (!is_finite())
      return fail(SensitivityStatus::kNotFinite, "the program has no finite values or derivatives there");
    const KktResiduals r = kkt_residuals(scaled_, at_);
    const double residual = std::max({r.stationarity, r.feasibility, r.complementarity});
    if (residual <= kMostResidual) return true;
    return fail(SensitivityStatus::kNotASolution,
                "it is no solution: the first-order conditions are off by " + io::with_digits(residual, 3) +
                    " in the units of the solve");
  }

  // y += J v
  void add_jacobian(const VectorXd& v, VectorXd& y) const {
    for (std::size_t e = 0; e < bounds_.jacobian.nnz(); ++e)
      y[bounds_.jacobian.row[e]] += J_[Eigen::Index(e)] * v[bounds_.jacobian.col[e]];
  }

  void smooth() {
    take_bounds();
    correction_ = zero_;
    held_variables_ = resting_;
    set_barrier();
    factor(VectorXd::Map(at_.lambda.data(), m_));
  }

  NlpShape& take_bounds() {
    NlpShape& shape = program_.shape();
    shape.x_lower = bounds_.x_lower, shape.x_upper = bounds_.x_upper;
    shape.g_lower = bounds_.g_lower, shape.g_upper = bounds_.g_upper;
    return shape;
  }

  void look(Eigen::Index i, bool of_row, double value, double& lower, double& upper, double lower_multiplier,
            double upper_multiplier) {
    if (lower == upper) return;
    Limit low{i, of_row, -1, lower_multiplier, value - lower, lower_multiplier, value - lower, false},
        high{i, of_row, 1, upper_multiplier, upper - value, upper_multiplier, upper - value, false};
    low.is_held = lower > -HUGE_VAL && !(low.distance > low.bound_multiplier);
    high.is_held = upper < HUGE_VAL && !(high.distance > high.bound_multiplier);
    if (low.is_held && high.is_held)
      (low.bound_multiplier < high.bound_multiplier ? low : high).is_held = false;
    if (lower > -HUGE_VAL) limits_.push_back(low);
    if (upper < HUGE_VAL) limits_.push_back(high);
    const double bound = low.is_held ? lower : upper;
    const bool is_held = low.is_held || high.is_held;
    if (is_held) (of_row ? held_rows_ : held_variables_).push_back(std::size_t(i));
    lower = is_held ? bound : -HUGE_VAL, upper = is_held ? bound : HUGE_VAL;
  }

  // Holds what rests on a bound: in program_ such variables have equal bounds, such rows are equalities, and nothing
  // else has bounds.
  void judge() {
    NlpShape& shape = take_bounds();
    for (std::size_t i = 0; i < shape.n(); ++i)
      look(Eigen::Index(i), false, at_.x[i], shape.x_lower[i], shape.x_upper[i], at_.lower_multiplier[i],
           at_.upper_multiplier[i]);
    for (std::size_t j = 0; j < shape.m(); ++j)
      look(Eigen::Index(j), true, g_[Eigen::Index(j)], shape.g_lower[j], shape.g_upper[j],
           std::max(0.0, -at_.lambda[j]), std::max(0.0, at_.lambda[j]));
    release_implied();
  }

  // An equality all of whose variables are held cannot move one of them and leave the others: as the rows that tie a free
  // duration, a variable of every point, where it rests on a bound.  What it follows from the others is left to the row,
  // which takes its bound multiplier over.  Of a row that says nothing new no variable is left: it depends on the others.
  void release_implied() {
    NlpShape& shape = program_.shape();
    resting_ = held_variables_;
    const std::set<std::size_t> resting(resting_.begin(), resting_.end());
    const auto is_held = [&](std::size_t i) { return shape.x_lower[i] == shape.x_upper[i]; };
    std::map<std::size_t, std::map<std::size_t, double>> rows, implied;  // coefficients by variable
    std::set<std::size_t> open;                                          // rows with a variable that is free
    for (std::size_t e = 0; e < bounds_.jacobian.nnz(); ++e) {
      const std::size_t j = bounds_.jacobian.row[e], i = bounds_.jacobian.col[e];
      if (J_[Eigen::Index(e)] == 0) continue;
      if (!is_held(i) || shape.g_lower[j] != shape.g_upper[j])
        open.insert(j);
      else if (resting.count(i))
        rows[j][i] += J_[Eigen::Index(e)];
    }
    for (const auto& [j, row] : rows) {
      if (open.count(j)) continue;
      std::map<std::size_t, double> left;  // without what rows before imply
      const auto add = [&](const auto& self, std::size_t i, double weight) -> void {
        const auto known = implied.find(i);
        if (known == implied.end())
          left[i] += weight;
        else
          for (const auto& [k, part] : known->second) self(self, k, weight * part);
      };
      for (const auto& [i, slope] : row) add(add, i, slope);
      double most = 0;
      for (const auto& [i, slope] : left) most = std::max(most, std::abs(slope));
      const auto last = std::find_if(left.rbegin(), left.rend(),
                                     [most](const auto& at) { return std::abs(at.second) >= 0.1 * most; });
      if (!(most > kNothing)) continue;
      std::map<std::size_t, double>& by = implied[last->first];
      for (const auto& [k, slope] : left) {
        if (k != last->first && std::abs(slope) > kNothing * most) by[k] = -slope / last->second;
      }
    }
    for (const auto& [i, by] : implied) shape.x_lower[i] = -HUGE_VAL, shape.x_upper[i] = HUGE_VAL;
    std::erase_if(held_variables_, [&](std::size_t i) { return implied.count(i) > 0; });
    for (Limit& limit : limits_)
      limit.is_implied = !limit.of_row && implied.count(std::size_t(limit.place)) > 0;
  }

  VectorXd without_inactive_multipliers() const {
    VectorXd lambda = VectorXd::Map(at_.lambda.data(), m_);
    for (std::size_t j = 0; j < program_.shape().m(); ++j) {
      if (program_.shape().g_lower[j] != program_.shape().g_upper[j]) lambda[Eigen::Index(j)] = 0;
    }
    return lambda;
  }

  // What each bound's bound multiplier and distance make of it, as in the solver (barrier.h).
  void set_barrier() {
    for (const Limit& limit : limits_) {
      double& sigma = (limit.of_row ? diagonal_.sigma_s : diagonal_.sigma_x)[limit.place];
      sigma += limit.given_multiplier / std::max(limit.given_distance, kNothing);
    }
  }

  // The matrix with these multipliers; slope_ is grad L.
  bool factor(const VectorXd& lambda) {
    lambda_ = lambda;
    VectorXd W(Eigen::Index(bounds_.hessian.nnz()));
    if (!scaled_.hessian(at_.x.data(), 1, lambda_.data(), W.data()) || !W.allFinite())
      return fail(SensitivityStatus::kNotFinite, "the program has no finite second derivatives there");
    kkt_.emplace(program_);
    kkt_->set(J_.data(), W.data());
    slope_ = gradient_;
    kkt_->add_transposed(lambda_, slope_);
    const bool good = kkt_->factor(diagonal_);
    if (!good)
      fail(SensitivityStatus::kNoStrictMinimum, "there is no strict minimum on what the rows leave free");
    return good;
  }

  // The Newton step to the bounds themselves, and what it says of the point and of its bounds.
  void correct(const Nlp& nlp) {
    const NlpShape& shape = program_.shape();
    VectorXd d = VectorXd::Zero(n_), e = VectorXd::Zero(m_), hessian = d, jacobian = e;
    for (Eigen::Index i = 0; i < n_; ++i) {
      if (!is_free(i)) d[i] = shape.x_lower[std::size_t(i)] - at_.x[std::size_t(i)];
    }
    for (Eigen::Index j = 0; j < m_; ++j) {
      if (has_multiplier(j)) e[j] = shape.g_lower[std::size_t(j)] - g_[j];
    }
    kkt_->add_hessian(d, hessian), add_jacobian(d, jacobian);
    correction_ = solved(-slope_ - hessian, e - jacobian, d);
    double length = 0;
    for (Eigen::Index i = 0; i < n_; ++i)
      length = std::max(length, std::abs(correction_.x[i]) / (1 + std::abs(at_.x[std::size_t(i)])));
    look_for_dependence();
    lambda_ += correction_.lambda;
    for (Eigen::Index i = 0; i < n_; ++i) slope_[i] -= correction_.bound_multiplier[i];
    weigh(nlp);
    if (!(length <= kLongest)) {
      fail(limits_.empty() ? SensitivityStatus::kNotASolution : SensitivityStatus::kWeaklyActive,
           (limits_.empty() ? "it is too far from a solution: a Newton step " : kUnclear) + "moves it by " +
               io::with_digits(length, 3) + ", in the units of the solve");
      is_smooth_ = true;
    }
    for (Eigen::Index i = 0; i < n_; ++i) {
      const auto at = std::size_t(i);
      correction_.bound_multiplier[i] =
          (is_free(i) ? 0 : -slope_[i]) - (at_.upper_multiplier[at] - at_.lower_multiplier[at]);
    }
    correction_.lambda = lambda_ - Eigen::Map<const VectorXd>(at_.lambda.data(), m_);
    correction_ = to_own(std::move(correction_));
  }

  void weigh(const Nlp& nlp) {
    VectorXd change = VectorXd::Zero(m_);
    add_jacobian(correction_.x, change);
    for (Limit& limit : limits_) {
      const Eigen::Index i = limit.place;
      if (limit.is_implied) continue;
      double& left = limit.is_held ? limit.bound_multiplier : limit.distance;
      const double before = left;
      if (limit.is_held)
        left = limit.side * (limit.of_row ? lambda_[i] : -slope_[i]);
      else
        left -= limit.side * (limit.of_row ? change[i] : correction_.x[i]);
      if (left > std::max(kNothing, before / 2)) continue;
      (limit.of_row ? weak_rows_ : weak_variables_).push_back(std::size_t(i));
      const std::string name = '"' + (limit.of_row ? nlp.constraint_name(i) : nlp.variable_name(i)) + '"';
      fail(SensitivityStatus::kWeaklyActive,
           before <= kWeak
               ? name + " rests on a bound that has no bound multiplier"
               : kUnclear + "takes more than half of the " +
                     (limit.is_held ? "bound multiplier of " : "distance to the bound of ") + name);
      is_smooth_ = true;
    }
  }

  // Rows that depend on each other cannot all move as they like.
  void look_for_dependence() {
    VectorXd asked(m_), found = VectorXd::Zero(m_);
    unsigned bits = 1;
    for (double& v : asked) {
      bits = bits * 1664525u + 1013904223u;
      v = (bits >> 31 ? 1 : -1) * (1 + double(bits & 0x7fffffffu) * 0x1p-31);  // within 1 .. 2
    }
    const SolutionStep s = solved(VectorXd::Zero(n_), asked, VectorXd::Zero(n_));
    add_jacobian(s.x, found);
    double missed = 0;
    for (Eigen::Index j = 0; j < m_; ++j) {
      if (has_multiplier(j)) missed = std::max(missed, std::abs(found[j] - asked[j]));
    }
    if (!(missed <= kMostMissed))
      fail(SensitivityStatus::kDependentRows,
           "the rows that are held depend on each other: their bound multipliers are not unique");
  }

  ScaledNlp scaled_;
  NlpSolution at_;
  Eigen::Index n_, m_;
  NlpShape bounds_;    // of the program, scaled
  ShapeOnly program_;  // with what is held
  VectorXd of_x_, of_g_;
  double of_f_;
  std::optional<StagewiseKkt> kkt_;
  SolutionStep zero_;
  std::vector<Limit> limits_;
  VectorXd g_, gradient_, J_, slope_,
      lambda_;  // rows, derivatives of the cost, of the rows; grad L; multipliers
  KktDiagonal diagonal_;
  bool is_smooth_ = false;            // bounds by their barrier
  std::vector<std::size_t> resting_;  // variables on a bound, those that rows imply among them
};

SolutionSensitivities::SolutionSensitivities(Nlp& nlp, const NlpSolution& solution)
    : held_(std::make_unique<Held>(nlp, solution)) {}
SolutionSensitivities::~SolutionSensitivities() = default;
SolutionSensitivities::SolutionSensitivities(SolutionSensitivities&&) noexcept = default;
SolutionSensitivities& SolutionSensitivities::operator=(SolutionSensitivities&&) noexcept = default;

SensitivityStatus SolutionSensitivities::status() const { return held_->status_; }
const std::string& SolutionSensitivities::why() const { return held_->why_; }
const std::vector<std::size_t>& SolutionSensitivities::weak_variables() const {
  return held_->weak_variables_;
}
const std::vector<std::size_t>& SolutionSensitivities::weak_rows() const { return held_->weak_rows_; }
const std::vector<std::size_t>& SolutionSensitivities::held_variables() const {
  return held_->held_variables_;
}
const std::vector<std::size_t>& SolutionSensitivities::held_rows() const { return held_->held_rows_; }

SolutionStep SolutionSensitivities::along(const Eigen::VectorXd& d, const Eigen::VectorXd& e) {
  held_->check(d, e);
  if (!held_->has_slopes()) return held_->none();
  const VectorXd x = held_->in_x(d), g = held_->in_g(e);
  SolutionStep s = held_->moved(x, g);
  s.cost = held_->cost(x, g);
  held_->measure(s, g);
  return held_->to_own(std::move(s));
}

SolutionStep SolutionSensitivities::solve(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  held_->check(a, b);
  if (!held_->has_slopes()) return held_->none();
  const VectorXd slope = held_->in_slope(a), g = held_->in_g(b);
  SolutionStep s = held_->solved(slope, g, VectorXd::Zero(a.size()));
  for (Eigen::Index i = 0; i < a.size(); ++i) {
    if (!held_->is_free(i)) s.bound_multiplier[i] += slope[i];
  }
  held_->measure(s, g);
  return held_->to_own(std::move(s));
}

const SolutionStep& SolutionSensitivities::correction() const { return held_->correction_; }

}  // namespace dyntape
