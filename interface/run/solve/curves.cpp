// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/solve/curves.h>

#include <algorithm>

namespace dyntape {

using Eigen::MatrixXd;

double effort_limit(const dynamics::Model<double>& model, int dof) {
  const auto has = [dof](const dynamics::Joint<double>& joint) { return joint.idx_v == dof; };
  return std::find_if(model.joints.begin(), model.joints.end(), has)->limits.effort;
}

std::vector<std::string> control_columns(const Task& task) {
  std::vector<std::string> names = task.problem.controls;
  for (std::string& name : names)
    if (name.starts_with("u.")) name = "tau." + name.substr(2);
  return names;
}

Curves curves_of(const Task& task, const Trajectory& motion) {
  const int n = task.scene.model.nv, nq = task.scene.model.nq;
  Curves c{motion.x.topRows(nq), motion.x.middleRows(nq, n), MatrixXd(n, motion.points()), motion.u};
  for (int p = 0; p < motion.points(); ++p) {
    c.a.col(p) =
        task.problem.ode(task.problem.stage(motion.t[p], motion.x.col(p), {}, motion.u.col(p))).tail(n);
  }
  if (task.robot.unit == ControlUnit::kPhysical) return c;
  const std::vector<int> dofs = actuated_dofs(task.scene);
  for (std::size_t k = 0; k < dofs.size(); ++k) c.tau.row(long(k)) *= effort_limit(task.scene.model, dofs[k]);
  return c;
}

}  // namespace dyntape
