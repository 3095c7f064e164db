// SPDX-License-Identifier: BSD-3-Clause
//
// A quadruped jumps within its torque limits: feet push off inside their friction cones, fly, and land at their old
// positions without impact.  Three phases with different contacts, from a guess that stands still; with a file, the
// motion plays in 3D:
//   example_quadruped_jump [jump.html]
#include <cstdio>

#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/control/solve/optimise.h>
#include <dyntape/interface/motion/contact_changes.h>
#include <dyntape/interface/motion/robot_configuration.h>
#include <dyntape/interface/motion/robot_problem.h>
#include <dyntape/interface/motion/robot_terms.h>
#include <dyntape/interface/report/player/player.h>

using namespace dyntape;
using Eigen::VectorXd;
constexpr double kTorque = 2.5;                   // N m
constexpr double kOnGround = 0.3, kInAir = 0.25;  // s
constexpr const char* kRobot = "config/robots/solo12.urdf";

// A phase with free start and end; its guess stands still.
Problem phase(const RobotScene& scene, const VectorXd& q, double duration,
              const std::vector<HeldContact>& contacts) {
  const RobotProblemOptions options{duration, DynamicsForm::kInverse, ControlUnit::kPhysical, {}, contacts};
  Problem p = robot_problem(scene, options);
  p.add(squared_controls(1e-2));
  p.add(squared_accelerations(p, 1e-4));
  p.u.lower.head(12).setConstant(-kTorque), p.u.upper.head(12).setConstant(kTorque);
  VectorXd hold = VectorXd::Zero(p.n_u());
  if (!contacts.empty()) hold = holding_controls(scene, options, q);
  VectorXd x = VectorXd::Zero(p.n_x());
  x.head(q.size()) = q;
  p.guess = [=, nv = scene.model.nv](double t) { return Stage<double>{t, x, VectorXd::Zero(nv), hold}; };
  p.start.setConstant(Problem::kFree), p.goal.setConstant(Problem::kFree);
  return p;
}

int main(int argc, char** argv) try {
  const RobotScene scene{dynamics::load_urdf(kRobot, {.base = dynamics::Base::kFloating})};
  const int nq = scene.model.nq, nv = scene.model.nv;
  VectorXd q = VectorXd::Zero(nq), x = VectorXd::Zero(nq + nv);
  q << 0, 0, 0.24, 0, 0, 0, 1, 0, 0.8, -1.6, 0, 0.8, -1.6, 0, -0.8, 1.6, 0, -0.8, 1.6;
  x.head(nq) = q;
  std::vector<HeldContact> feet;
  for (const char* foot : {"FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"}) {
    const VectorXd place = frame_position(scene, foot, Eigen::Vector3d::Zero())(Stage<double>{0, x, {}, {}});
    feet.push_back({foot, 0.6, Eigen::Vector3d(place)});
  }

  Problem push_off = phase(scene, q, kOnGround, feet), flight = phase(scene, q, kInAir, {}),
          settling = phase(scene, q, kOnGround, feet);
  start_at(push_off, scene, q, VectorXd::Zero(nv));
  for (const HeldContact& foot : feet) {
    for (const Term& term : landing(scene, foot, Landing::kAtRest)) flight.add(term);
    flight.add(stays_above(scene, foot));
  }
  settling.goal.head(6) = q.head(6);       // of the base: at its first position, level,
  settling.goal.segment(nq, 6).setZero();  // at rest; the feet hold the joints

  Phases jump("jump");
  jump.add("push-off", push_off), jump.add("flight", flight), jump.add("landing", settling);
  const SolverOptions solver{.method = NlpMethod::kRiccati};
  const Solution s = optimise(jump, {.meshes = {{.intervals = 10}}, .solver = solver});
  const Eigen::MatrixXd& states = s.motion.x;
  const double rise = states.row(2).maxCoeff() - q[2];
  const double defect = s.verification.worst_relative;
  std::printf("%s: %d iterations, %.1f s, cost %.4f, trunk rises by %.3f m, true defect %.1e\n",
              to_string(s.nlp.status), s.nlp.iterations(), s.nlp.times.total, s.cost(), rise, defect);
  const auto visuals = dynamics::read_visuals(kRobot, scene.model);
  if (argc > 1)
    write_player(
        {.title = "jump", .model = scene.model, .visuals = visuals, .t = s.motion.t, .q = states.topRows(nq)},
        argv[1]);
  // A mesh for display: 40 intervals per phase reduce all defects to a thousandth, and then s.success() holds.
  return s.converged() && rise > 0.07 && defect < 0.05 ? 0 : 1;
} catch (const Error& e) {
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
