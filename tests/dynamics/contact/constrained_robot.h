// SPDX-License-Identifier: BSD-3-Clause
//
// Random robots under random constraints, the same from one seed on every machine.
//
//   ConstrainedRobot robot(seed);
//   ConstraintData<double> c(robot.model, robot.list);
#pragma once

#include <dyntape/dynamics/algebra/float128.h>
#include <dyntape/dynamics/contact/constraints.h>

#include <Eigen/SVD>
#include <vector>

#include "dynamics/random_robots.h"

namespace dyntape::dynamics {

using Constraints = std::vector<Constraint<double>>;

// A robot and constraints whose rows are well independent, and that leave it at least two degrees of freedom.
struct ConstrainedRobot {
  explicit ConstrainedRobot(unsigned long seed) : random(seed) {
    model = random_tree(random, {5 + random.below(4), seed % 2 ? Base::kFloating : Base::kFixed,
                                 seed % 3 == 0, seed % 7 == 0});
    s = random_state(model, random);
    for (int tries = 0; tries < 30 && list.size() < 3; ++tries) {
      Constraints more = list;
      more.push_back(random_constraint(random.below(2) ? 6 : 3));
      if (more.back().body_1 != more.back().body_2 && independent(more)) list = more;
    }
  }

  bool independent(const Constraints& more) {
    Data<double> data(model);
    ConstraintData<double> c(model, more);
    if (c.J.rows() + 2 > model.nv) return false;
    constraint_kinematics(model, data, c, s.q, s.v);
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(c.J);
    return svd.singularValues().minCoeff() > 0.05 * svd.singularValues().maxCoeff();
  }

  Constraint<double> random_constraint(int rows) {
    return {rows,
            random.below(model.njoints()),
            random_placement(random),
            random.below(2) ? -1 : random.below(model.njoints()),
            random_placement(random),
            random.uniform(0, 30),
            random.uniform(0, 10)};
  }

  Random random;
  Model<double> model;
  State s;
  Constraints list;
};

inline std::vector<Constraint<Float128>> exact(const Constraints& list) {
  std::vector<Constraint<Float128>> result;
  for (const auto& c : list) result.push_back(c.cast<Float128>());
  return result;
}

}  // namespace dyntape::dynamics
