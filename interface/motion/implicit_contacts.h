// SPDX-License-Identifier: BSD-3-Clause
//
// Rigid contacts whose times and places the solver finds: contact-implicit optimal control.
//
//   RobotScene scene{...};                                        // with scene.constraints.rigid (rigid_contacts.h)
//   Problem p = robot_problem(scene, {.duration = 1, .form = DynamicsForm::kInverse});
//   StagedNlp nlp = discretize(p, {.scheme = radau(1), .intervals = 50});
//   for (const Parameters& now : contact_continuation(p, {})) ...  // nlp.set_parameters(now), from the last solution
//
// Forces are controls in the contact's axes, f.<contact>.n, .t1, .t2 (N; plane_axes).  With gap phi (m), velocity (v_n, v_t) of
// the touching point (m/s), the robot's weight W (N), coefficient mu, and two parameters of the problem at every point:
//   <contact> gap               phi >= 0,  f_n >= 0
//   <contact> complementarity   relaxation - (f_n / W) phi >= 0                     "contact relaxation" (m)
//   <contact> friction          f_t sqrt(|v_t|^2 + slip^2) + mu f_n v_t = 0         "contact slip" (m/s)
// Without a relaxation a force would act only where bodies touch, and the program had no interior.  With one, a force f_n acts up to
// the distance relaxation W / f_n: the weight from the relaxation itself, a hundredth of it from a hundred times that.  So it is solved
// again and again while the relaxation shrinks.  What lands is slowed before it touches, by the energy W relaxation ln(distances'
// ratio): small beside what moves, or the landing is wrong.  A body without gravity counts as 1 N.  Friction is Coulomb's, rounded where
// nothing slides: |f_t| < mu f_n always, and what is pushed by the share r of the cone creeps with slip r / sqrt(1 - r^2).
//
// Axes of a plane that moves are those of its body.  The scheme has to be radau-1, the implicit Euler scheme: positions at the end of a
// step are those that its velocities there lead to, q+ = q + h v+, and forces at its end are those of the whole step.  So a body that lands
// gives up its speed within one step, by a force of any size, and no impact has to be known beforehand: it is a time-stepping simulation
// whose forces are unknowns.
//
// Sources: D. Stewart, J. Trinkle, An implicit time-stepping scheme for rigid body dynamics with inelastic collisions and
// Coulomb friction, Int. J. Numer. Meth. Eng. 39, 1996; M. Posa, C. Cantu, R. Tedrake, A direct method for trajectory optimization
// of rigid bodies through contact, Int. J. Robotics Research 33(1), 2014; S. Scholtes, Convergence properties of a
// regularization scheme for mathematical programs with complementarity constraints, SIAM J. Optim. 11(4), 2001.
//
// Errors: ArgumentError for loops, hard limits, and contacts that rebound.
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

// From the first, coarse one to the last in so many solves, by equal ratios.
struct ContactContinuation {
  ContactRounding first{0.1, 0.1}, last;
  int solves = 5;
};

void check_implicit_contacts(const RobotScene& scene);

// "f.foot.n", "f.foot.t1", "f.foot.t2", of every contact.
std::vector<std::string> force_names(const dynamics::UnilateralConstraints& rigid);

// Rows of the contacts at a stage, in both scalars.
struct TouchingFunction {
  std::function<dynamics::UnilateralRows<AD>(const Stage<AD>&, const dynamics::UnilateralConstraints&)>
      recorded;
  std::function<dynamics::UnilateralRows<double>(const Stage<double>&,
                                                 const dynamics::UnilateralConstraints&)>
      plain;

  template <class F>
  TouchingFunction(F f) : recorded(f), plain(f) {}  // NOLINT: a generic callable is one
  auto operator()(const Stage<AD>& s, const dynamics::UnilateralConstraints& rigid) const {
    return recorded(s, rigid);
  }
  auto operator()(const Stage<double>& s, const dynamics::UnilateralConstraints& rigid) const {
    return plain(s, rigid);
  }
};

// Terms, bounds and parameters of contacts whose forces are the last controls; `weight` (N).
void add_implicit_contacts(Problem& problem, const dynamics::UnilateralConstraints& rigid, double weight,
                           const TouchingFunction& touching);

// The problem's parameters, solve by solve.
std::vector<Parameters> contact_continuation(const Problem& problem, const ContactContinuation& continuation);

}  // namespace dyntape
