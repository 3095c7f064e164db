// SPDX-License-Identifier: BSD-3-Clause
//
// Contact-implicit optimal control: the solver finds times and places of rigid contacts.
//
//   RobotScene scene{...};                                        // with scene.constraints.rigid (rigid_contacts.h)
//   Problem p = robot_problem(scene, {.duration = 1, .form = DynamicsForm::kInverse});
//   StagedNlp nlp = discretize(p, {.scheme = radau(1), .intervals = 50});
//   for (const Parameters& now : contact_continuation(p, {})) ...  // nlp.set_parameters(now), from the last solution
//
// Forces are controls in the contact's axes, f.<contact>.n, .t1, .t2 (N; plane_axes).  With gap phi (m), velocity
// (v_n, v_t) of the touching point (m/s), the robot's weight W (N), coefficient mu, and two parameters of the
// problem, at every point:
//   <contact> gap               phi >= 0,  f_n >= 0
//   <contact> complementarity   relaxation - (f_n / W) phi >= 0                     "contact relaxation" (m)
//   <contact> friction          f_t sqrt(|v_t|^2 + slip^2) + mu f_n v_t = 0         "contact slip" (m/s)
//
// Relaxation.  Without it a force acts only at a closed contact, and the program has no interior.  With it a force
// f_n acts up to the distance relaxation W / f_n: the weight up to the relaxation, a hundredth of the weight up to a
// hundred times that.  So the program is solved several times with decreasing relaxation.  A landing body is slowed
// before it touches, by the energy W relaxation ln(ratio of distances), which must be small relative to the moving
// energy.  A body without gravity has W = 1 N.
//
// Friction is Coulomb's, smoothed at zero sliding: |f_t| < mu f_n always, and a load of the fraction r of the cone
// creeps with slip r / sqrt(1 - r^2).  Axes of a moving plane are those of its body.
//
// The scheme must be radau-1 (implicit Euler): q+ = q + h v+, and the forces at the end of a step hold for the whole
// step.  So a landing body loses its speed within one step, by a force of any size, and no impact must be known in
// advance.  The method is a time-stepping simulation with unknown forces.
//
// Sources: D. Stewart, J. Trinkle, An implicit time-stepping scheme for rigid body dynamics with inelastic
// collisions and Coulomb friction, Int. J. Numer. Meth. Eng. 39, 1996; M. Posa, C. Cantu, R. Tedrake, A direct
// method for trajectory optimization of rigid bodies through contact, Int. J. Robotics Research 33(1), 2014; S.
// Scholtes, Convergence properties of a regularization scheme for mathematical programs with complementarity
// constraints, SIAM J. Optim. 11(4), 2001.
//
// Errors.  ArgumentError: loops, hard limits, contacts with restitution.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <dyntape/dynamics/contact/rigid_contacts.h>
#include <dyntape/interface/control/problem/problem.h>
#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

// Names of the parameters.
constexpr const char *kContactRelaxation = "contact relaxation", *kContactSlip = "contact slip";

struct ContactRounding {
  double relaxation = 1e-5;  // m
  double slip = 1e-3;        // m/s
};

// From a first, coarse value to the last one, in this number of solves with equal ratios.
struct ContactContinuation {
  ContactRounding first{0.1, 0.1}, last;
  int solves = 5;
};

void check_implicit_contacts(const RobotScene& scene);

// "f.foot.n", "f.foot.t1", "f.foot.t2" for every contact.
std::vector<std::string> force_names(const dynamics::UnilateralConstraints& rigid);

// The rows of the contacts at a stage, for both scalars.
struct TouchingFunction {
  std::function<dynamics::UnilateralRows<AD>(const Stage<AD>&, const dynamics::UnilateralConstraints&)>
      recorded;
  std::function<dynamics::UnilateralRows<double>(const Stage<double>&,
                                                 const dynamics::UnilateralConstraints&)>
      plain;

  template <class F>
  TouchingFunction(F f) : recorded(f), plain(f) {}  // NOLINT: converts any callable
  auto operator()(const Stage<AD>& s, const dynamics::UnilateralConstraints& rigid) const {
    return recorded(s, rigid);
  }
  auto operator()(const Stage<double>& s, const dynamics::UnilateralConstraints& rigid) const {
    return plain(s, rigid);
  }
};

// Adds terms, bounds and parameters of contacts whose forces are the last controls; `weight` (N).
void add_implicit_contacts(Problem& problem, const dynamics::UnilateralConstraints& rigid, double weight,
                           const TouchingFunction& touching);

// The problem's parameters for each solve.
std::vector<Parameters> contact_continuation(const Problem& problem, const ContactContinuation& continuation);

}  // namespace dyntape
