// SPDX-License-Identifier: BSD-3-Clause
//
// Options and solution of differential dynamic programming (ddp.h).
//
//   DdpOptions options{.intervals = 100, .hessian = DdpHessian::kGaussNewton};
//   if (s.success()) use(s.u, s.policy[k].K);             // u = u_k + K_k (x - x_k) at node k
#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include <dyntape/codegen/options/options.h>
#include <dyntape/interface/control/nlp/sensitivity_status.h>
#include <dyntape/interface/control/nlp/status.h>
#include <dyntape/interface/control/problem/record_stage.h>
#include <dyntape/interface/control/riccati/riccati.h>
#include <dyntape/interface/control/solve/solution.h>

namespace dyntape {

enum class DdpHessian { kExact, kGaussNewton };
enum class DdpStart { kRollOut, kNodes };
enum class SensitivitiesOf { kNothing, kCost, kMotion };

struct DdpIteration {
  double cost, gap,
      slope;  // at its beginning: largest gap, largest projected gradient with respect to a control
  double shift, length;  // regularization and length of its step
};

struct DdpOptions {
  int intervals = 100;
  ShootingScheme scheme = ShootingScheme::kRungeKutta4;
  DdpHessian hessian = DdpHessian::kExact;
  DdpStart start = DdpStart::kRollOut;
  double tolerance = 1e-9;
  int max_iterations = 500;
  CodegenOptions evaluation = {.lanes = Lanes::kNative};  // stages are linearised in SIMD lanes
  bool verify = true;  // compute integration_error, which may take longer than the solve
  SensitivitiesOf sensitivities =
      SensitivitiesOf::kNothing;  // derivatives with respect to parameters and start (DdpSensitivities)
  double max_seconds = 1e6;       // of processor time of this thread
  std::stop_token stop = {};
  std::function<void(const DdpIteration&)> watch = {};  // called after each iteration
};

// First-order derivatives of a solution.  Column j is with respect to entry j of the parameters
// (Parameters::entry_names()) or of the start.  Units: those of the row over those of the column.
struct MotionDerivatives {
  Eigen::MatrixXd x, u;  // (n_x (N + 1) x count), (n_u N x count): by nodes; empty with kCost
  Eigen::VectorXd cost;  // (count)
};

// A parameter changes by a constant at all times.  NaN if the status says that there are no derivatives
// (ddp_sensitivities.h).
struct DdpSensitivities {
  SensitivityStatus status = SensitivityStatus::kNotASolution;
  MotionDerivatives parameters, start;

  bool good() const { return status == SensitivityStatus::kGood; }
};

struct DdpSolution {
  SolveStatus status = SolveStatus::kSolverError;
  double cost = 0;
  Eigen::VectorXd t;               // (N + 1) s
  Eigen::MatrixXd x, u;            // (n_x x N + 1), (n_u x N)
  std::vector<LqrPolicy> policy;   // (N) gains K; k of the last step, zero before the first step
  Eigen::MatrixXd slope, adjoint;  // (n_x x N + 1); NaN before the first step
  bool is_minimum = false;  // solved, and every stage has a minimum (second order); true with kExact only
  bool is_saddle = false;   // true: the cost decreases along some trial change of the controls
  std::vector<DdpIteration> iterations;
  DdpSensitivities sensitivities;  // empty unless requested
  // For a converged solve with options.verify: the motion re-simulated with its constant controls (verify.h).
  std::optional<Verification> verification = {};
  double integration_error = std::numeric_limits<double>::quiet_NaN();  // worst_defect of the verification
  double build_seconds = 0, seconds = 0;                                // recording and compiling; iterations

  bool converged() const { return status == SolveStatus::kSolved && !is_saddle; }
  // The verdict of all methods (solution.h): converged, and re-simulation reproduces motion and cost.  Without
  // options.verify equal to converged().
  bool success() const { return converged() && (!verification || is_accurate(*verification, demands)); }
  std::string verdict() const;  // one sentence, that of Solution::verdict()
  VerifyOptions demands = {};
};

}  // namespace dyntape
