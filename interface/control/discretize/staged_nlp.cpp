// SPDX-License-Identifier: BSD-3-Clause
//
// Evaluation, and the motions that variables are; patterns are in staged_layout.cpp, scaling is in staged_scaling.cpp.
#include <dyntape/interface/control/discretize/staged_nlp.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include <dyntape/interface/control/problem/scaled_time.h>

namespace dyntape {

namespace {

bool same(const std::vector<double>& a, const double* b) {
  return std::memcmp(a.data(), b, a.size() * sizeof(double)) == 0;
}

// to[0, n) += factor * from[0, n)
void add(double* to, double factor, const double* from, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) to[i] += factor * from[i];
}

}  // namespace

StagedNlp::StagedNlp(StagedProgram program)
    : program_(std::move(program)),
      values_(program_.evaluators, Order::kValue),
      first_(program_.evaluators,
             shape().hessian_kind == HessianKind::kExact ? Order::kSecond : Order::kFirst),
      squares_(program_.squares, Order::kFirst) {
  lay_out_jacobian();
  lay_out_gradient();
  program_.shape.hessian = {shape().n(), shape().n(), {}, {}};
  if (shape().hessian_kind == HessianKind::kExact) lay_out_exact_hessian();
  if (shape().hessian_kind == HessianKind::kGaussNewton) lay_out_gauss_newton();
  forget();
}

BuildReport StagedNlp::build() const {
  BuildReport report;
  for (const auto* evaluators : {&program_.evaluators, &program_.squares}) {
    for (const Evaluator& e : *evaluators) add_to(report, e.function);
  }
  report.seconds.record = program_.record_seconds;
  return report;
}

// What was evaluated last is that no more.  Asked at an x that is all NaN the answer is no.
void StagedNlp::forget() {
  values_good_ = first_good_ = false;
  x_values_.assign(shape().n(), std::nan(""));
  x_first_ = x_values_;
}

// Repeated questions about the same x cost nothing.
bool StagedNlp::evaluate_values(const double* x) {
  are_of_first_ = first_good_ && same(x_first_, x);
  if (are_of_first_) return true;
  if (same(x_values_, x)) return values_good_;
  std::copy(x, x + x_values_.size(), x_values_.begin());
  return values_good_ = values_.run(program_.evaluators, Order::kValue, x);
}

bool StagedNlp::evaluate_first(const double* x) {
  if (same(x_first_, x)) return first_good_;
  std::copy(x, x + x_first_.size(), x_first_.begin());
  return first_good_ = first_.run(program_.evaluators, Order::kFirst, x);
}

void StagedNlp::set_parameters(const Parameters& now) {
  Problem next = problem();
  next.parameters = now;
  set_values(next);
}

void StagedNlp::set_values(const Problem& now, std::size_t k) {
  StagedPhase& phase = program_.phases[k];
  Problem next = phase.asked;
  next.take_values(now);
  Problem taken = phase.scheme().taken_by(scaled_time(next), phase.length);
  // What throws, throws before anything has changed.
  for (double t : phase.t) taken.parameters.at(t);
  for (double t : {phase.t.front(), phase.t.back()}) static_cast<void>(taken.first_guess(t));
  phase.asked = std::move(next);
  phase.problem = std::move(taken);
  place_values(program_, k);
  forget();
}

void StagedNlp::start_at(const Eigen::VectorXd& x) {
  StagedPhase& phase = program_.phases.front();
  phase.asked.start = x, phase.problem.start.head(x.size()) = x;
  std::copy(x.begin(), x.end(), program_.shape.x_lower.begin());
  std::copy(x.begin(), x.end(), program_.shape.x_upper.begin());
  forget();
}

bool StagedNlp::objective(const double* x, double& value) {
  if (!evaluate_values(x)) return false;
  value = 0;
  for (std::size_t k = 0; k < phases(); ++k) {
    double own = 0;
    for (std::size_t c = phase(k).cost; c < program_.end_of_costs(k); ++c)
      own += program_.costs[c].factor * values()[program_.costs[c].output];
    value += own;
  }
  return true;
}

bool StagedNlp::gradient(const double* x, double* gradient) {
  if (!evaluate_first(x)) return false;
  std::fill(gradient, gradient + shape().n(), 0.0);
  for (const Contribution& c : of_gradient_) gradient[c.target] += c.factor * first_.jacobian[c.source];
  return true;
}

bool StagedNlp::constraints(const double* x, double* g) {
  if (!evaluate_values(x)) return false;
  std::fill(g, g + shape().m(), 0.0);
  const std::vector<double>& y = values();
  for (const RowBlock& block : program_.rows) {
    for (std::size_t t = block.first_term; t < block.last_term; ++t) {
      const LinearTerm& term = program_.terms[t];
      const double* from = term.evaluator == LinearTerm::kVariables ? x : y.data();
      add(g + block.row, term.factor, from + term.first, block.size);
    }
  }
  return true;
}

bool StagedNlp::jacobian(const double* x, double* nonzeros) {
  if (!evaluate_first(x)) return false;
  std::copy(constants_.begin(), constants_.end(), nonzeros);
  for (const Contribution& c : of_jacobian_) nonzeros[c.target] += c.factor * first_.jacobian[c.source];
  return true;
}

// What multiplies each output in sigma f + lambda . g.
void StagedNlp::collect_weights(double sigma, const double* lambda) {
  std::vector<double>& weights = first_.weights;
  std::fill(weights.begin(), weights.end(), 0.0);
  for (const RowBlock& block : program_.rows) {
    for (std::size_t t = block.first_term; t < block.last_term; ++t) {
      const LinearTerm& term = program_.terms[t];
      if (term.evaluator == LinearTerm::kVariables) continue;
      add(weights.data() + term.first, term.factor, lambda + block.row, block.size);
    }
  }
  for (const CostTerm& cost : program_.costs) weights[cost.output] += sigma * cost.factor;
}

bool StagedNlp::hessian(const double* x, double sigma, const double* lambda, double* nonzeros) {
  std::fill(nonzeros, nonzeros + shape().hessian.nnz(), 0.0);
  if (shape().hessian_kind != HessianKind::kExact) return gauss_newton(x, sigma, nonzeros);
  collect_weights(sigma, lambda);
  std::copy(x, x + x_first_.size(), x_first_.begin());  // values and Jacobian come along
  first_good_ = first_.run(program_.evaluators, Order::kSecond, x);
  if (!first_good_) return false;
  for (std::size_t e = 0; e < of_hessian_.size(); ++e) nonzeros[of_hessian_[e]] += first_.hessian[e];
  return true;
}

bool StagedNlp::gauss_newton(const double* x, double sigma, double* nonzeros) {
  if (program_.squares.empty()) return true;
  if (!squares_.run(program_.squares, Order::kFirst, x)) return false;
  for (const SquareEntry& e : of_squares_)
    nonzeros[e.target] += sigma * e.factor * squares_.jacobian[e.left] * squares_.jacobian[e.right];
  return true;
}

std::vector<double> StagedNlp::times(std::size_t k) const {
  std::vector<double> times = phase(k).t;
  if (problem(k).free_time) {
    for (double& t : times) t *= problem(k).duration;
  }
  return times;
}

std::vector<double> StagedNlp::start() const {
  std::vector<double> x;
  x.reserve(shape().n());
  for (const StagedPhase& phase : program_.phases) {
    for (double t : phase.t) {
      const Stage<double> stage = phase.problem.first_guess(t);
      for (const Eigen::VectorXd* part : {&stage.x, &stage.a, &stage.u})
        x.insert(x.end(), part->begin(), part->end());
    }
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (shape().x_lower[i] == shape().x_upper[i]) x[i] = shape().x_lower[i];
  }
  return x;
}

Trajectory StagedNlp::trajectory(const std::vector<double>& x, std::size_t k) const {
  const StagedPhase& own = phase(k);
  const Problem &asked = own.asked, &problem = own.problem;
  const auto points = static_cast<Eigen::Index>(own.points), n_z = static_cast<Eigen::Index>(own.n_z);
  const Eigen::Map<const Eigen::MatrixXd> z(x.data() + own.variable, n_z, points);
  const double duration = asked.free_time ? z(asked.n_x(), 0) : 1;
  Trajectory motion{duration * Eigen::Map<const Eigen::VectorXd>(own.t.data(), points),
                    z.topRows(asked.n_x()), z.middleRows(problem.n_x(), problem.n_a()),
                    z.bottomRows(problem.n_u()), own.scheme()};
  motion.limit_controls(problem.u.lower, problem.u.upper);
  motion.extend_to_unused();
  return motion;
}

std::vector<Trajectory> StagedNlp::trajectories(const std::vector<double>& x) const {
  std::vector<Trajectory> motions;
  for (std::size_t k = 0; k < phases(); ++k) motions.push_back(trajectory(x, k));
  return motions;
}

std::vector<double> StagedNlp::variables(const std::vector<Trajectory>& motions) const {
  std::vector<double> x;
  for (std::size_t k = 0; k < phases(); ++k) {
    const StagedPhase& own = phase(k);
    const Trajectory& motion = motions.at(k);
    Eigen::MatrixXd z(static_cast<Eigen::Index>(own.n_z), static_cast<Eigen::Index>(own.points));
    z.topRows(own.asked.n_x()) = motion.x;
    if (own.asked.free_time) z.row(own.asked.n_x()).setConstant(motion.t[motion.points() - 1]);
    z.middleRows(own.problem.n_x(), own.problem.n_a()) = motion.a;
    z.bottomRows(own.problem.n_u()) = motion.u;
    x.insert(x.end(), z.data(), z.data() + z.size());
  }
  return x;
}

void StagedNlp::make_earlier(NlpSolution& multipliers, int intervals) const {
  const StagedPhase& own = phase();
  const std::size_t by = std::min(std::size_t(std::max(intervals, 0)), own.intervals);
  const auto move = [](std::vector<double>& values, std::size_t first, std::size_t last, std::size_t by) {
    if (by < last - first)
      std::copy(values.begin() + long(first + by), values.begin() + long(last), values.begin() + long(first));
  };
  for (const RowBlock::Kind kind :
       {RowBlock::Kind::kDefect, RowBlock::Kind::kControl, RowBlock::Kind::kPath}) {
    const auto is_of = [&](const RowBlock& block) { return block.phase == 0 && block.kind == kind; };
    const auto first = std::find_if(program_.rows.begin(), program_.rows.end(), is_of);
    if (first == program_.rows.end()) continue;
    const auto last = std::find_if_not(first, program_.rows.end(), is_of);
    const auto later = std::find_if(first, last, [&](const RowBlock& block) {
      return block.place == first->place + by * (kind == RowBlock::Kind::kPath ? own.stride : 1);
    });
    if (later == last) continue;
    move(multipliers.lambda, first->row, (last - 1)->row + (last - 1)->size, later->row - first->row);
  }
  for (std::vector<double>* bound_multipliers :
       {&multipliers.lower_multiplier, &multipliers.upper_multiplier})
    move(*bound_multipliers, 0, own.variables(), by * own.stride * own.n_z);
}

NlpScaling StagedNlp::of_motion(const NlpScaling& scaling, std::size_t k) const {
  const StagedPhase& own = phase(k);
  const auto n = static_cast<std::size_t>(own.asked.n_x());  // the number of the duration among the states
  const bool is_free = own.asked.free_time.has_value();
  NlpScaling result{scaling.objective};
  for (std::size_t i = 0; i < own.variables() && !scaling.x.empty(); ++i) {
    if (!is_free || i % own.n_z != n) result.x.push_back(scaling.x[own.variable + i]);
  }
  for (const RowBlock& block : program_.rows) {
    if (block.phase != k || block.kind == RowBlock::Kind::kLink || scaling.g.empty()) continue;
    for (std::size_t i = 0; i < block.size; ++i) {
      if (!is_free || block.kind != RowBlock::Kind::kDefect || i != n)
        result.g.push_back(scaling.g[block.row + i]);
    }
  }
  return result;
}

}  // namespace dyntape
