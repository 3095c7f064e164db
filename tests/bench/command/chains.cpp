// SPDX-License-Identifier: BSD-3-Clause
#include "chains.h"

#include <cmath>

namespace dyntape::tools {
namespace {

using dynamics::Model;

int add_body(Model<double>& model, int parent) {
  dynamics::Joint<double> joint;
  joint.name = "joint_" + std::to_string(model.njoints());
  joint.axis = Eigen::Vector3d::Unit(model.njoints() % 3);
  const dynamics::Placement<double> link{Eigen::Matrix3d::Identity(), {0.3, 0.1, -0.2}};
  return model.add_joint(parent, joint, link, {1, {0.1, 0.05, -0.1}, 0.01 * Eigen::Matrix3d::Identity()});
}

// Node `node` of a heap with that many nodes, and what hangs on it: each branch in one piece.
void add_branch(Model<double>& model, int parent, int node, int bodies) {
  if (node > bodies) return;
  const int here = add_body(model, parent);
  add_branch(model, here, 2 * node, bodies);
  add_branch(model, here, 2 * node + 1, bodies);
}

}  // namespace

Model<double> chain(int bodies) {
  Model<double> model;
  model.name = "chain";
  for (int i = 0; i < bodies; ++i) add_body(model, i - 1);
  return model;
}

Model<double> binary_tree(int bodies) {
  Model<double> model;
  model.name = "binary tree";
  add_branch(model, -1, 1, bodies);
  return model;
}

double fitted_slope(const std::vector<double>& x, const std::vector<double>& y, double first) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (x[i] < first) continue;
    const double u = std::log(x[i]), v = std::log(y[i]);
    n += 1, sx += u, sy += v, sxx += u * u, sxy += u * v;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

}  // namespace dyntape::tools
