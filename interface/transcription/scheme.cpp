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

const std::vector<Scheme>& schemes() {
  static const std::vector<Scheme> all = {
      {"euler", Eigen::VectorXd{{0, 1}}, Eigen::MatrixXd{{-1, 1}}, Eigen::MatrixXd{{-1, 0}},
       Eigen::VectorXd{{1, 0}}, 1},
      {"trapezoid", Eigen::VectorXd{{0, 1}}, Eigen::MatrixXd{{-1, 1}}, Eigen::MatrixXd{{-0.5, -0.5}},
       Eigen::VectorXd{{0.5, 0.5}}, 2},
      {"hermite-simpson", Eigen::VectorXd{{0, 0.5, 1}}, Eigen::MatrixXd{{-0.5, 1, -0.5}, {-1, 0, 1}},
       Eigen::MatrixXd{{-0.125, 0, 0.125}, {-1. / 6, -4. / 6, -1. / 6}},
       Eigen::VectorXd{{1. / 6, 4. / 6, 1. / 6}}, 4}};
  return all;
}

Scheme euler() { return scheme_by_name("euler"); }
Scheme trapezoid() { return scheme_by_name("trapezoid"); }
Scheme hermite_simpson() { return scheme_by_name("hermite-simpson"); }

Scheme scheme_by_name(const std::string& name) {
  std::string names;
  for (const Scheme& s : schemes()) {
    if (s.name == name) return s;
    names += (names.empty() ? "" : ", ") + s.name;
  }
  throw ArgumentError("there is no scheme \"" + name + "\"; the schemes are " + names);
}

}  // namespace dyntape
