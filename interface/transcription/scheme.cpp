// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/transcription/scheme.h>

#include <dyntape/autodiff/error.h>

namespace dyntape {

bool Scheme::uses_last_point() const { return !beta.col(points() - 1).isZero(0) || gamma[points() - 1] != 0; }

Eigen::VectorXd Scheme::control_weights(double fraction) const {
  const int used = uses_last_point() ? points() : points() - 1;
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(points());
  for (int i = 0; i < used; ++i) {
    weights[i] = 1;
    for (int j = 0; j < used; ++j) {
      if (j != i) weights[i] *= (fraction - c[j]) / (c[i] - c[j]);
    }
  }
  return weights;
}

Scheme euler() {
  return {"euler",
          Eigen::Vector2d(0, 1),
          Eigen::RowVector2d(-1, 1),
          Eigen::RowVector2d(-1, 0),
          Eigen::Vector2d(1, 0),
          1};
}

Scheme trapezoid() {
  return {"trapezoid",
          Eigen::Vector2d(0, 1),
          Eigen::RowVector2d(-1, 1),
          Eigen::RowVector2d(-0.5, -0.5),
          Eigen::Vector2d(0.5, 0.5),
          2};
}

Scheme hermite_simpson() {
  Scheme s{"hermite-simpson",
           Eigen::Vector3d(0, 0.5, 1),
           Eigen::MatrixXd(2, 3),
           Eigen::MatrixXd(2, 3),
           Eigen::Vector3d(1. / 6, 4. / 6, 1. / 6),
           4};
  s.alpha << -0.5, 1, -0.5, -1, 0, 1;
  s.beta << -0.125, 0, 0.125, -1. / 6, -4. / 6, -1. / 6;
  return s;
}

std::vector<std::string> scheme_names() { return {"euler", "trapezoid", "hermite-simpson"}; }

Scheme scheme_by_name(const std::string& name) {
  for (const Scheme& s : {euler(), trapezoid(), hermite_simpson()}) {
    if (s.name == name) return s;
  }
  throw ArgumentError("there is no scheme \"" + name +
                      "\"; the schemes are euler, trapezoid, hermite-simpson");
}

}  // namespace dyntape
