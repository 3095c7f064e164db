// SPDX-License-Identifier: BSD-3-Clause
//
// What differential dynamic programming (ddp.h) is told, and what it ends with:
//
//   DdpOptions options{.intervals = 100, .hessian = DdpHessian::kGaussNewton};
//   if (s.success()) use(s.u, s.policy[k].K);             // u = u_k + K_k (x - x_k) at node k
#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <stop_token>
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
  double cost, gap, slope;  // at its beginning: largest gap, largest projected slope by a control
  double shift, length;     // that its step needed
};

struct DdpOptions {
  int intervals = 100;
  ShootingScheme scheme = ShootingScheme::kRungeKutta4;
  DdpHessian hessian = DdpHessian::kExact;
  DdpStart start = DdpStart::kRollOut;
  double tolerance = 1e-9;
  int max_iterations = 500;
  CodegenOptions evaluation = {.lanes = Lanes::kNative};  // stages are linearised side by side
  bool verify = true;  // finds integration_error, which may take longer than the solve
  SensitivitiesOf sensitivities = SensitivitiesOf::kNothing;  // by parameters and start (DdpSensitivities)
  double max_seconds = 1e6;                                   // of processor time of this thread
  std::stop_token stop = {};
  std::function<void(const DdpIteration&)> watch = {};  // told of each iteration when it is over
};

// What a solution changes by, to first order.  Column j: by what entry j is changed by, the entries of the parameters in the order
// of Parameters::entry_names(), or the states at the start.  Units: those of the row over those of the column.
struct MotionDerivatives {
  Eigen::MatrixXd x, u;  // (n_x (N + 1) x count), (n_u N x count): of node after node; empty of kCost
  Eigen::VectorXd cost;  // (count)
};

// A parameter is changed by the same number at all times; one that is a function of time is shifted.  NaN where the status says that
// there are no derivatives (ddp_sensitivities.h).
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
  std::vector<LqrPolicy> policy;   // (N), its k the last step's; zero before there was one
  Eigen::MatrixXd slope, adjoint;  // (n_x x N + 1); NaN before there was one
  bool is_minimum =
      false;  // solved, and every stage has a minimum: of the second order as well, as kExact alone knows
  bool is_saddle = false;  // the cost falls along some change of the controls all the same
  std::vector<DdpIteration> iterations;
  DdpSensitivities sensitivities;  // empty where they were not asked for
  // Of a converged solve, if options.verify: the motion re-simulated with its held controls (verify.h).
  std::optional<Verification> verification = {};
  double integration_error = std::numeric_limits<double>::quiet_NaN();  // its worst_defect
  double build_seconds = 0, seconds = 0;  // of recording and compiling; of the iterations

  bool converged() const { return status == SolveStatus::kSolved && !is_saddle; }
  // The verdict of all methods (solution.h): converged, and the motion is what its controls do and costs what the steps say.
  // Without options.verify the same as converged().
  bool success() const { return converged() && (!verification || is_accurate(*verification, demands)); }
  VerifyOptions demands = {};
};

}  // namespace dyntape
