// SPDX-License-Identifier: BSD-3-Clause
//
// What an iteration of differential dynamic programming takes: the problem of tests/bench/peers/ilqr_problem.py, which runs it
// beside Crocoddyl.
//
//   bench_ilqr arm|quadruped|cart-pole URDF [INTERVALS [TIMES]]     one JSON object a line; seconds of processor time, the
//                                                                   quickest of TIMES
//
// A cart-pole swings up with its force within 12 N; control_peers.py runs that beside others, stage by stage as well.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/contact/constraints.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/control/discretize/staged_nlp.h>
#include <dyntape/interface/control/nlp/solver_options.h>
#include <dyntape/interface/control/solve/ddp.h>
#include <dyntape/interface/io/stopwatch.h>
#include <dyntape/interface/motion/robot_configuration.h>
#include <dyntape/interface/motion/robot_problem.h>
#include <dyntape/interface/motion/robot_terms.h>
#include <dyntape/interface/robot/robot_callee.h>

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

// A quadruped whose four feet are held by constraints of its dynamics (constraints.h), led to another pose of its trunk.
Problem quadruped(const std::string& urdf) {
  const RobotScene scene{dynamics::load_urdf(urdf, {.base = dynamics::Base::kFloating})};
  const dynamics::Model<double>& model = scene.model;
  const int nq = model.nq, nv = model.nv, n_u = nv - 6;
  VectorXd q = VectorXd::Zero(nq), x = VectorXd::Zero(nq + nv), goal;
  q << 0, 0, 0.24, 0, 0, 0, 1, 0, 0.8, -1.6, 0, 0.8, -1.6, 0, -0.8, 1.6, 0, -0.8, 1.6;
  x.head(nq) = q, goal = q, goal[0] += 0.02, goal[2] -= 0.04;
  std::vector<dynamics::Constraint<double>> feet;
  for (const char* foot : {"FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"}) {
    const VectorXd place = frame_position(scene, foot, Eigen::Vector3d::Zero())(Stage<double>{0, x, {}, {}});
    feet.push_back(dynamics::point_constraint(model, model.frame_index(foot), Eigen::Vector3d(place)));
  }
  // Recorded with its analytic derivatives.
  const auto held = constrained_dynamics_callee(model, feet, true);
  const auto rate = [=](const auto& s) {
    using T = std::decay_t<decltype(s.t)>;
    const dynamics::VectorX<T> at = s.x.head(nq), v = s.x.tail(nv);
    dynamics::VectorX<T> tau = dynamics::VectorX<T>::Zero(nv), ddq, change(nq + nv);
    tau.tail(n_u) = s.u;
    if constexpr (std::is_same_v<T, AD>) {
      VectorXad in(nq + 2 * nv);
      in << at, v, tau;
      ddq = call(held, in).head(nv);
    } else {
      dynamics::Data<T> data(model);
      dynamics::ConstraintData<T> c(model, feet);
      c.independent = true;
      ddq = dynamics::constrained_dynamics<T>(model, data, c, at, v, tau);
    }
    change << configuration_rate<T>(model, at, v), ddq;
    return change;
  };
  std::vector<std::string> states(std::size_t(nq + nv), "x"), controls(std::size_t(n_u), "u");
  Problem p("quadruped", states, controls, 1, rate);
  p.positions = nq;
  const VectorXd ones = VectorXd::Ones(nv), zero = VectorXd::Zero(nv);
  p.add(joint_tracking(scene, kAngle * ones, goal, kRate * ones, zero));
  p.add(running_squares("torques", [](const auto& s) { return (std::sqrt(kTorque) * s.u).eval(); }));
  Term end = joint_tracking(scene, kEnd * kAngle * ones, goal, kEnd * kRate * ones, zero);
  end.where = Where::kTerminal;
  p.add(end);
  p.start = x;
  p.goal.setConstant(Problem::kFree);
  const RobotProblemOptions standing{.contacts = {{"FL_FOOT"}, {"FR_FOOT"}, {"HL_FOOT"}, {"HR_FOOT"}}};
  const VectorXd hold = holding_controls(scene, standing, q).head(n_u);
  p.guess = [=](double t) { return Stage<double>{t, x, {}, hold}; };
  return p;
}

Problem cart_pole(const std::string& urdf) {
  const RobotScene scene{dynamics::load_urdf(urdf), {}, {"slider"}};
  Problem p = robot_problem(scene, {.duration = 2});
  p.add(running_squares("forces", [](const auto& s) { return s.u; }));
  VectorXd goal = VectorXd::Zero(4);
  goal.head(2) << 1, 3.14159265358979323846;
  p.add(terminal_squares("end", [goal](const auto& s) {
    auto r = (s.x - goal).eval();
    r.head(2) *= 100, r.tail(2) *= std::sqrt(1e3);
    return r;
  }));
  p.start.setZero();
  p.goal.setConstant(Problem::kFree);
  p.u.lower.setConstant(-12), p.u.upper.setConstant(12);
  return p;
}

// Of so many solves the last solution, and the least processor time of this thread: others on the machine do not count.
template <class Solve>
auto quickest(int times, const Solve& solve) {
  double begin = thread_seconds();
  auto solution = solve();
  double seconds = thread_seconds() - begin;
  for (int i = 1; i < times; ++i) {
    begin = thread_seconds();
    solution = solve();
    seconds = std::min(seconds, thread_seconds() - begin);
  }
  return std::pair{std::move(solution), seconds};
}

void run_stages(const Problem& problem, ShootingScheme scheme, int intervals, int times) {
  const bool is_euler = scheme == ShootingScheme::kEuler;
  MeshOptions mesh;
  mesh.scheme = scheme_by_name(is_euler ? "semi-implicit-euler" : "runge-kutta-4");
  mesh.intervals = intervals;
  mesh.evaluation.lanes = Lanes::kNative;
  StagedNlp program = discretize(problem, mesh);
  const std::vector<double> x = program.start();
  const auto [best, seconds] =
      quickest(times, [&] { return solve_nlp(program, x, {.method = NlpMethod::kRiccati}); });
  std::printf(
      "{\"scheme\": \"%s\", \"solver\": \"stages\", \"status\": \"%s\", \"iterations\": %d, \"cost\": "
      "%.15g, \"seconds\": %.6g}\n",
      is_euler ? "euler" : "rk4", to_string(best.status), best.iterations(), best.objective, seconds);
}

void run(const Problem& problem, ShootingScheme scheme, int intervals, int times, DdpHessian hessian,
         double tolerance) {
  DdpSolver solver(problem, {.intervals = intervals,
                             .scheme = scheme,
                             .hessian = hessian,
                             .tolerance = tolerance,
                             .evaluation = {.functions = Functions::kPortable, .lanes = Lanes::kNative},
                             .verify = false});
  const auto [best, seconds] = quickest(times, [&] { return solver.solve(); });
  std::printf(
      "{\"scheme\": \"%s\", \"status\": \"%s\", \"iterations\": %zu, \"cost\": %.15g, \"seconds\": %.6g, "
      "\"ready_s\": %.4g}\n",
      scheme == ShootingScheme::kEuler ? "euler" : "rk4", to_string(best.status), best.iterations.size(),
      best.cost, seconds, best.build_seconds);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3 || argc > 5) {
    std::fprintf(stderr, "usage: bench_ilqr arm|quadruped|cart-pole URDF [INTERVALS [TIMES]]\n");
    return 2;
  }
  try {
    const std::string which = argv[1];
    const bool has_limits = which == "cart-pole";
    const Problem problem = which == "arm" ? arm(argv[2])
                            : has_limits   ? cart_pole(argv[2])
                                           : quadruped(argv[2]);
    const int intervals = argc > 3 ? std::max(1, std::atoi(argv[3])) : 100,
              times = argc > 4 ? std::max(1, std::atoi(argv[4])) : 10;
    for (const ShootingScheme scheme : {ShootingScheme::kEuler, ShootingScheme::kRungeKutta4}) {
      if (scheme == ShootingScheme::kRungeKutta4 && which == "quadruped") continue;
      const auto hessian = has_limits ? DdpHessian::kExact : DdpHessian::kGaussNewton;
      run(problem, scheme, intervals, times, hessian, has_limits ? 1e-9 : 1e-5);
      if (has_limits) run_stages(problem, scheme, intervals, times);
    }
  } catch (const dyntape::Error& e) {
    std::fprintf(stderr, "bench_ilqr: %s\n", e.what());
    return 1;
  }
  return 0;
}
