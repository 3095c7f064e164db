// SPDX-License-Identifier: BSD-3-Clause
//
// What the course of a solve by differential dynamic programming (ddp_course.h) is told by those who compute, and what it asks of
// them at once.  A lane is one of the problems that are solved side by side; lane 0 where there is one (ddp_motion.h).
//
//   DdpState& s = work.at(lane);
//   s.shift = 1e-3;                          // of the next backward pass
//   if (s.is_convex) use(s.linear, s.curved);
#pragma once

#include <Eigen/Core>
#include <vector>

#include <dyntape/interface/control/riccati/riccati.h>

namespace dyntape {

// What the next pass is told, and what the last one found.
struct DdpState {
  double shift = 0;           // backward pass: added to the curvature of the controls
  bool with_secants = false;  // backward pass
  bool is_first = true;       // linearisation: there is nothing yet that secants could be learnt from

  // Linearisation.
  bool is_finite = false, help = false;  // the secants' help (stage_secants.h)
  double cost = 0, gap = 0, gaps = 0;    // gap: the largest entry; gaps: the sum of all
  double largest_x = 0, largest_u = 0;
  Eigen::VectorXd slopes,
      sizes;  // (n_u) the largest that can be followed, and the largest of what they are made of
  // Backward pass.
  bool is_convex = false;
  double step_size = 0, linear = 0, curved = 0;  // the largest step; what the cost is predicted to change by
  int failed_stage = -1;
  Eigen::MatrixXd failed;  // (n_u x n_u) the curvature by the controls there
};

struct DdpMotion {
  Eigen::MatrixXd x, u, slope, adjoint;  // (n_x x N + 1), (n_u x N), (n_x x N + 1) twice
  std::vector<LqrPolicy> policy;         // (N)
};

class DdpWork {
 public:
  virtual ~DdpWork() = default;

  virtual DdpState& at(int lane) = 0;
  virtual DdpMotion motion(int lane) const = 0;
  // In place of the last step: no feedback up to stage `last`, no gaps, and these changes of the controls (n_u x N).
  virtual void set_policy(int lane, int last, const Eigen::MatrixXd& k) = 0;
  virtual void set_policy(int lane, const std::vector<LqrPolicy>& policy) = 0;
  // Costs of these changes of the controls (n_u x N each), where all of them can be run side by side at once; else none.
  virtual std::vector<double> costs_of(int lane, const std::vector<Eigen::MatrixXd>& changes) {
    return (void)lane, (void)changes, std::vector<double>();
  }
};

}  // namespace dyntape
