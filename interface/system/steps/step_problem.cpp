// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/system/steps/step_problem.h>

#include <algorithm>
#include <cmath>

namespace dyntape {

namespace {

using Eigen::Map;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Nothing farther from the centre is looked at (rad): the coordinates end at a whole turn.
constexpr double kFarthestTurn = 5;

VectorXd zeros(int n) { return VectorXd::Zero(n); }

}  // namespace

StepProblem::Part::Part(const Function& f, CodegenOptions options, Order order)
    : function([&] {
        options.order = order;
        return CompiledFunction::make(f, options);
      }()),
      workspace(function),
      y(zeros(int(function.n_y()))),
      non_zeros(zeros(order == Order::kFirst ? int(function.jacobian_pattern().nnz()) : 0)) {}

StepProblem::StepProblem(const System& system, Integrator integrator, const Tolerances& tolerances,
                         const CodegenOptions& options, bool with_jacobians)
    : StepProblem(system, integrator, tolerances, options, with_jacobians, record_rate(system, integrator)) {}

StepProblem::StepProblem(const System& system, Integrator integrator, const Tolerances& tolerances,
                         const CodegenOptions& options, bool with_jacobians, const RecordedRate& recorded)
    : nq_(recorded.nq),
      nv_(recorded.nv),
      n_m_(recorded.n_m),
      n_u_(system.n_u),
      n_p_(system.n_p),
      n_g_(recorded.n_g),
      nx_(nq_ + nv_ + n_m_),
      tolerances_(tolerances),
      lagged_(lagged_motors(system)),
      rate_(recorded.rate, options, integrator == Integrator::kAdaptiveStiff ? Order::kFirst : Order::kValue),
      state_(recorded.state, options, Order::kValue),
      v_(zeros(nv_)),
      given_(zeros(nq_ + n_m_ + n_u_ + n_p_ + 2)),
      of_state_(zeros(n_y() + int(given_.size()))),
      of_events_(zeros(nx_ + 1 + n_u_ + n_p_)) {
  for (const auto& joint : system.model.joints) append_groups(joint);
  if (n_g_ > 0) events_.emplace(recorded.events, options, Order::kValue);
  if (!with_jacobians) return;
  by_all_.emplace(recorded.by_all, options, Order::kFirst);
  frame_.emplace(recorded.frame, options, Order::kValue);
  of_all_ = zeros(n_w());
  fixed_of_all_ = zeros(nq_ + 2);
  of_frame_ = zeros(nv_ + 1);
  slopes_at_ = VectorXd::Constant(n_y() + 1, std::nan(""));
  slopes_ = MatrixXd::Zero(n_y(), n_w());
}

void StepProblem::append_groups(const dynamics::Joint<double>& joint) {
  using dynamics::JointType;
  const int first = joint.idx_v;
  switch (joint.type) {
    case JointType::kFreeFlyer:
      groups_.insert(groups_.end(), {{first, 3}, {first + 3, 3, true}});
      return;
    case JointType::kSpherical:
      groups_.push_back({first, 3, true});
      return;
    case JointType::kPlanar:
      groups_.insert(groups_.end(), {{first, 2}, {first + 2, 1, true}});
      return;
    case JointType::kPrismatic:
      groups_.push_back({first, 1, false, joint.idx_q});
      return;
    case JointType::kRevolute:
    case JointType::kContinuous:
    case JointType::kHelical:
      groups_.push_back({first, 1});
  }
}

void StepProblem::begin(const double* arguments) {
  const Map<const VectorXd> all(arguments, nx_ + 2 + n_u_ + n_p_);
  v_ = all.segment(nq_, nv_);
  given_ << all.head(nq_), all.segment(nx_ - n_m_, n_m_), all.tail(n_u_ + n_p_), all[nx_], 0;
  of_events_.tail(1 + n_u_ + n_p_) << all[nx_], all.tail(n_u_ + n_p_);
  slopes_at_.setConstant(std::nan(""));
  effort = {};
  refused_at_.reset();
  refused_slopes_ = false;
}

void StepProblem::move_centre(const double* q) {
  std::copy_n(q, nq_, given_.data());
  slopes_at_.setConstant(std::nan(""));
}

void StepProblem::start(double* y) const {
  std::fill_n(y, nv_, 0.0);
  std::copy_n(v_.data(), nv_, y + nv_);
}

bool StepProblem::run(Part& part, Order order, double s, const double* x, const double* p) {
  double* const non_zeros = order == Order::kFirst ? part.non_zeros.data() : nullptr;
  const Violation violation =
      part.function.run(order, {.x = x, .p = p, .y = part.y.data(), .jacobian = non_zeros}, part.workspace);
  if (!violation && part.y.allFinite() && (!non_zeros || part.non_zeros.allFinite())) return true;
  refused_at_ = s;
  refused_slopes_ = !violation && part.y.allFinite();
  violation_ = violation;
  left_ = violation ? &part.function : nullptr;
  return false;
}

bool StepProblem::rate(double s, const double* y, double* dy) {
  ++effort.rates;
  given_[given_.size() - 1] = s;
  if (!(longest_turn(y) <= kFarthestTurn) || !run(rate_, Order::kValue, s, y, given_.data())) return false;
  std::copy_n(rate_.y.data(), n_y(), dy);
  return true;
}

bool StepProblem::jacobian(double s, const double* y, double* J) {
  ++effort.jacobians;
  given_[given_.size() - 1] = s;
  if (!run(rate_, Order::kFirst, s, y, given_.data())) return false;
  const Pattern& pattern = rate_.function.jacobian_pattern();
  std::fill_n(J, n_y() * n_y(), 0.0);
  for (std::size_t k = 0; k < pattern.nnz(); ++k)
    J[pattern.row[k] + std::size_t(n_y()) * pattern.col[k]] = rate_.non_zeros[Eigen::Index(k)];
  return true;
}

// The solver asks several times at one place, with other S.
bool StepProblem::sensitivity_rate(double s, const double* y, const MatrixXd& S, MatrixXd& dS) {
  const int n = n_y();
  if (!(slopes_at_[n] == s && std::equal(y, y + n, slopes_at_.data()))) {
    ++effort.jacobians;
    slopes_at_[n] = std::nan("");  // until they are known
    of_all_ << Map<const VectorXd>(y, n), given_.segment(nq_, n_m_ + n_u_ + n_p_);
    fixed_of_all_ << given_.head(nq_), given_[given_.size() - 2], s;
    if (!(longest_turn(y) <= kFarthestTurn) ||
        !run(*by_all_, Order::kFirst, s, of_all_.data(), fixed_of_all_.data()))
      return false;
    const Pattern& pattern = by_all_->function.jacobian_pattern();
    for (std::size_t k = 0; k < pattern.nnz(); ++k)
      slopes_(pattern.row[k], pattern.col[k]) = by_all_->non_zeros[Eigen::Index(k)];
    std::copy_n(y, n, slopes_at_.data());
    slopes_at_[n] = s;
  }
  dS.noalias() = slopes_.leftCols(n) * S;
  dS.rightCols(n_w() - n) += slopes_.rightCols(n_w() - n);
  return true;
}

void StepProblem::allowed_errors(const double* y, double* errors) {
  for (const Group& group : groups_) {
    const double moved = y[group.first];
    const double size = group.slider < 0 ? 1 : std::abs(given_[group.slider] + moved);
    const double speed = Map<const VectorXd>(y + nv_ + group.first, group.count).norm();
    std::fill_n(errors + group.first, group.count, tolerances_.relative * size + tolerances_.absolute);
    std::fill_n(errors + nv_ + group.first, group.count, tolerances_.relative * speed + tolerances_.absolute);
  }
}

bool StepProblem::state(double s, const double* y, double* x) {
  given_[given_.size() - 1] = s;
  of_state_ << Map<const VectorXd>(y, n_y()), given_;
  if (!run(state_, Order::kValue, s, nullptr, of_state_.data())) return false;
  std::copy_n(state_.y.data(), nx_, x);
  return true;
}

bool StepProblem::events(double s, const double* x) {
  std::copy_n(x, nx_, of_events_.data());
  of_events_[nx_] = given_[given_.size() - 2] + s;
  return run(*events_, Order::kValue, s, nullptr, of_events_.data());
}

bool StepProblem::frame(double s, const double* y) {
  of_frame_ << Map<const VectorXd>(y, nv_), s;
  return run(*frame_, Order::kValue, s, nullptr, of_frame_.data());
}

void StepProblem::turn(MatrixXd& S) const { S.topRows(nv_) = (turned() * S.topRows(nv_)).eval(); }

void StepProblem::moved(const MatrixXd& S, MatrixXd& dx) const {
  dx.setZero(n_y() + n_m_, n_w());
  dx.topRows(nv_).noalias() = turned() * S.topRows(nv_);
  dx.middleRows(nv_, nv_) = S.bottomRows(nv_);
  for (int i = 0; i < n_m_; ++i) {
    const double kept = frame_->y[nv_ * nv_ + i];
    dx(n_y() + i, n_y() + i) = kept;
    dx(n_y() + i, n_y() + n_m_ + lagged_[std::size_t(i)]) = 1 - kept;
  }
}

double StepProblem::longest_turn(const double* y) const {
  double longest = 0;
  for (const Group& group : groups_)
    if (group.turns) longest = std::max(longest, Map<const VectorXd>(y + group.first, group.count).norm());
  return longest;
}

std::string StepProblem::left_branch() const {
  return left_ ? describe_guard(left_->function(), violation_.guard) : "";
}

std::vector<const CompiledFunction*> StepProblem::functions() const {
  std::vector<const CompiledFunction*> all = {&rate_.function, &state_.function};
  for (const std::optional<Part>* part : {&by_all_, &frame_, &events_})
    if (*part) all.push_back(&(*part)->function);
  return all;
}

std::size_t StepProblem::sensitivity_operations() const {
  return by_all_ ? by_all_->function.operations(Order::kFirst) : 0;
}

}  // namespace dyntape
