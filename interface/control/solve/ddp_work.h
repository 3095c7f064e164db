// SPDX-License-Identifier: BSD-3-Clause
//
// The interface between the algorithm of differential dynamic programming (ddp_course.h) and its computations.  A
// lane is one of several problems that are solved together; a single problem is lane 0 (ddp_motion.h).
//
//   DdpState& s = work.at(lane);
//   s.shift = 1e-3;                          // of the next backward pass
//   if (s.is_convex) use(s.linear, s.curved);
#pragma once

#include <Eigen/Core>
#include <vector>

#include <dyntape/interface/control/riccati/riccati.h>

namespace dyntape {

// Inputs of the next pass, and results of the last one.
struct DdpState {
  double shift = 0;           // backward pass: regularization of the controls' curvature
  bool with_secants = false;  // backward pass
  bool is_first = true;       // linearisation: no data for secants yet

  // Linearisation.
  bool is_finite = false, help = false;  // true: secants help (stage_secants.h)
  double cost = 0, gap = 0, gaps = 0;    // gap: the largest entry; gaps: the sum
  double largest_x = 0, largest_u = 0;
  Eigen::VectorXd slopes,
      sizes;  // (n_u) the largest free gradient, and the largest of its terms
  // Backward pass.
  bool is_convex = false;
  double step_size = 0, linear = 0,
         curved = 0;  // the largest step; the predicted change of the cost, first and second order
  int failed_stage = -1;
  Eigen::MatrixXd failed;  // (n_u x n_u) the controls' curvature that failed
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
  // Replaces the last step: no feedback up to stage `last`, no gaps, and these changes of the controls (n_u x N).
  virtual void set_policy(int lane, int last, const Eigen::MatrixXd& k) = 0;
  virtual void set_policy(int lane, const std::vector<LqrPolicy>& policy) = 0;
  // Costs for these changes of the controls (n_u x N each), if all can be simulated in lanes; else empty.
  virtual std::vector<double> costs_of(int lane, const std::vector<Eigen::MatrixXd>& changes) {
    return (void)lane, (void)changes, std::vector<double>();
  }
};

}  // namespace dyntape
