// SPDX-License-Identifier: BSD-3-Clause
//
// What an iteration of differential dynamic programming takes: the problem of tests/bench/ilqr_problem.py, which runs it
// beside Crocoddyl.
//
//   bench_ilqr URDF [INTERVALS [TIMES]]        one JSON object a line; seconds, the quickest of TIMES
#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/ocp/robot_problem.h>
#include <dyntape/interface/transcription/ddp.h>

namespace {

using namespace dyntape;
using Eigen::VectorXd;

constexpr double kAngle = 10, kRate = 0.1, kTorque = 1e-3, kEnd = 100;  // weights

Problem arm(const std::string& urdf) {
  const RobotScene scene{dynamics::load_urdf(urdf, {.lock = {"panda_finger_joint1", "panda_finger_joint2"}})};
  Problem p = robot_problem(scene, {.duration = 1});
  VectorXd goal = VectorXd::Zero(14);
  goal.head(7) << 1, 0.5, -0.5, -1.2, 0.5, 2, -0.5;
  const auto misses = [goal](const auto& s) {
    auto r = (s.x - goal).eval();
    r.head(7) *= std::sqrt(kAngle), r.tail(7) *= std::sqrt(kRate);
    return r;
  };
  p.add(running_squares("misses", misses));
  p.add(running_squares("torques", [](const auto& s) { return (std::sqrt(kTorque) * s.u).eval(); }));
  p.add(terminal_squares("end", [misses](const auto& s) { return (std::sqrt(kEnd) * misses(s)).eval(); }));
  p.start.setZero();
  p.start.head(7) << 0, -0.5, 0, -2, 0, 1.5, 0.5;
  p.goal.setConstant(Problem::kFree);
  const VectorXd hold = holding_torque(scene, p.start.head(7)), start = p.start;
  p.guess = [=](double t) { return Stage<double>{t, start, {}, hold}; };
  return p;
}

void run(const std::string& urdf, ShootingScheme scheme, int intervals, int times) {
  DdpSolver solver(
      arm(urdf),
      {.intervals = intervals, .scheme = scheme, .hessian = DdpHessian::kGaussNewton, .verify = false});
  DdpSolution best;
  for (int i = 0; i < times; ++i) {
    DdpSolution s = solver.solve();
    if (i == 0 || s.seconds < best.seconds) best = std::move(s);
  }
  std::printf(
      "{\"scheme\": \"%s\", \"status\": \"%s\", \"iterations\": %zu, \"cost\": %.15g, \"seconds\": %.6g, "
      "\"ready_s\": %.4g}\n",
      scheme == ShootingScheme::kEuler ? "euler" : "rk4", to_string(best.status), best.iterations.size(),
      best.cost, best.seconds, best.build_seconds);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 4) {
    std::fprintf(stderr, "usage: bench_ilqr URDF [INTERVALS [TIMES]]\n");
    return 2;
  }
  try {
    for (const ShootingScheme scheme : {ShootingScheme::kEuler, ShootingScheme::kRungeKutta4})
      run(argv[1], scheme, argc > 2 ? std::max(1, std::atoi(argv[2])) : 100,
          argc > 3 ? std::max(1, std::atoi(argv[3])) : 10);
  } catch (const dyntape::Error& e) {
    std::fprintf(stderr, "bench_ilqr: %s\n", e.what());
    return 1;
  }
  return 0;
}
