// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/solve/stage_secants.h>

#include <cmath>
#include <limits>

namespace dyntape {

using Eigen::MatrixXd;
using Eigen::VectorXd;

void StageSecants::learn(const std::vector<LqrStage>& stages, const MatrixXd& x, const MatrixXd& u,
                         const MatrixXd& adjoint) {
  constexpr double kFarOff = 0.2;
  const Eigen::Index N = u.cols();
  MatrixXd z(x.rows() + u.rows(), N);
  z << x.leftCols(N), u;
  const bool is_first = past_.empty();
  past_.resize(stages.size());
  Curvatures along;
  if (!is_first) {
    z_ = z - z_;
    size_ = z_.cwiseAbs().rowwise().maxCoeff().cwiseMax(std::numeric_limits<double>::min());
  }
  for (std::size_t k = 0; k < stages.size(); ++k) {
    const LqrStage& now = stages[k];
    Past& past = past_[k];
    const auto at = Eigen::Index(k);
    if (!is_first) change(past, now, z_.col(at), adjoint.col(at + 1), along);
    past.A = now.A, past.B = now.B, past.H = now.H, past.g = now.g;
    if (is_first) past.S.setZero(now.H.rows(), now.H.cols());
  }
  z_ = std::move(z);
  help_ = std::abs(along.left) < std::abs(along.missing) && std::abs(along.missing) > kFarOff * along.known;
}

void StageSecants::change(Past& past, const LqrStage& now, const VectorXd& s, const VectorXd& adjoint,
                          Curvatures& along) {
  constexpr double kWorse = 2, kSkipped = 1e-2, kRounding = 1e-13;
  const Eigen::Index n = adjoint.size(), m = s.size() - n;
  y_ = now.g - past.g;
  y_.head(n) += (now.A - past.A).transpose() * adjoint;
  y_.tail(m) += (now.B - past.B).transpose() * adjoint;
  w_ = now.H.selfadjointView<Eigen::Lower>() * s;
  along.known += s.dot(w_);
  y_ -= w_;
  r_ = y_ - past.S * s;
  along.missing += s.dot(y_), along.left += s.dot(r_);
  const double noise = kRounding * (now.g.norm() + (now.A.norm() + now.B.norm()) * adjoint.norm());
  if (!(r_.norm() > noise)) return;
  const auto scaled = [&](const VectorXd& slope) { return slope.cwiseProduct(size_).norm(); };
  if (scaled(r_) > kWorse * scaled(y_)) past.S.setZero(), r_ = y_;
  const double curvature = r_.dot(s);
  if (!(std::abs(curvature) > kSkipped * scaled(r_) * s.cwiseQuotient(size_).norm())) return;
  w_ = r_ / curvature;
  past.S += r_ * w_.transpose();
}

MatrixXd StageSecants::hessian(std::size_t k, bool with_secants) const {
  const Past& past = past_[k];
  return with_secants ? past.H + past.S : past.H;
}

}  // namespace dyntape
