// SPDX-License-Identifier: BSD-3-Clause
//
// Integrates a robot with rigid contacts and hard limits: calls a Stepper, solves for the contact forces, and
// handles impacts as events.
//
//   Stepper stepper(system_of(scene), integrator, options, RigidStepper::needs_jacobians(integrator));
//   RigidStepper rigid(scene, stepper, integrator, options);
//   rigid.start(x);                                          // ArgumentError if a contact penetrates
//   std::string why;
//   if (!rigid.step(t, h, x, u, next, &why)) ...
//   for (const RigidPiece& piece : rigid.pieces()) ...       // the parts of the step
//   for (const RigidImpact& impact : rigid.impacts()) ...
//
// Closed contacts.  Over a step the contact forces lambda are constant (fixed in the world, parameters of the
// system).  The end x' = step(x; lambda) satisfies, with the gap at the beginning and beta = 0.2:
//   0 <= u_n   perpendicular to   lambda_n >= 0,   Coulomb's friction of lambda_t against u_t,   u = J (v' + v_gap)
// v_gap = J^+ (beta gap / h) is the smallest motion that reduces the gaps by a fifth per step.
//
// - Solver: Newton's method; each iteration solves a ContactProblem with D = du'/dlambda (h J M^-1 J^T for explicit
// schemes, the exact Jacobian for implicit ones).
// - A robot at rest is a fixed point of the step: no sinking, no creeping.  Gaps from curved motions decay.
// - If Newton's method does not converge, the step is divided.
// - Order 1 while a contact is closed.
//
// Impacts.  If the gap of an open contact becomes negative within a step, the step is shortened to the time at which
// the gap is zero.  This time is found to rounding as a root over the length of the step (algorithm 748 of Alefeld,
// Potra and Shi).  The law of impact.h then applies to all closed contacts, and the remaining step follows.
//
// - A contact that rebounds is open again.
// - A contact with kMostImpacts impacts in one step (Zeno) is closed from then on, without restitution.
// - A contact also closes if it returns before it was 1e-8 m away.  The same holds if forces press it on and it
// approaches more slowly than a fall from 1e-8 m.  An impulse without restitution then ends its velocity; this impulse
// is not listed among the impacts.
// - A contact that penetrates and opens again within one step is found by a cubic through gaps and rates
// (rigid_dips.h).
// - If a gap has its minimum closer to zero than the accuracy of this cubic so far, the contact is undecided.  If
// the penetration may exceed 1e-6 m or rad, undecided() says so.
//
// If there are several solutions (Painleve's paradox, simultaneous impacts), one is chosen, the same in every run.
//
// Sources: contact_problem.h, impact.h; D. Stewart, J. Trinkle, Int. J. Numer. Methods Eng. 39, 1996; M. Anitescu,
// F. Potra, Nonlinear Dynamics 14, 1997 (time stepping); V. Acary, B. Brogliato, 2008, chapters 8 and 10.
#pragma once

#include <cmath>

#include <dyntape/dynamics/contact/impact.h>
#include <dyntape/interface/system/rigid/rigid_functions.h>
#include <dyntape/interface/system/steps/stepper.h>

namespace dyntape {

// A part of a step between two events, with the states at its beginning, middle and end.
struct RigidPiece {
  double t = 0, h = 0;  // s
  Eigen::VectorXd begin, middle, end;
  Eigen::VectorXd forces;  // (m) of the rows; zero for open contacts
};

struct RigidImpact {
  double t = 0;            // s
  Eigen::VectorXd p;       // (m) impulses of the rows
  Eigen::VectorXd u_sum;   // (m) sum of the velocities before and after; the work is p . u_sum / 2 (J)
  std::vector<int> hit;    // contacts and stops that were open and closed in this impact
  double restitution = 1;  // the factor s of the restitution (impact.h)
};

class RigidStepper {
 public:
  static constexpr int kMostImpacts = 8;

  // Keeps references to the scene and the stepper.
  RigidStepper(const RobotScene& scene, Stepper& stepper, Integrator integrator,
               const CodegenOptions& options)
      : RigidStepper(scene, stepper, integrator, RigidFunctions(scene, options)) {}
  RigidStepper(const RobotScene& scene, Stepper& stepper, Integrator integrator, RigidFunctions functions);

  // True for implicit schemes: their response to forces needs the Jacobian.
  static bool needs_jacobians(Integrator integrator);

  // Begins a motion: closes all contacts that touch at x = (q, v, ...).  `p`: parameters of the scene, if any.
  // ArgumentError, with the value, if a gap is below -1e-6 m or rad.
  void start(const Eigen::VectorXd& x, const Eigen::VectorXd& p = {});

  // Returns false if the step failed; *why is then the reason.
  bool step(double t, double h, const Eigen::VectorXd& x, const Eigen::VectorXd& u, Eigen::VectorXd& next,
            std::string* why);

  const std::vector<RigidPiece>& pieces() const { return pieces_; }
  const std::vector<RigidImpact>& impacts() const { return impacts_; }
  const Eigen::VectorXd& forces() const { return forces_; }  // (m) at the end of the last step
  RigidFunctions& functions() { return functions_; }
  const RigidFunctions& functions() const { return functions_; }
  // "", or which gap came so close to zero that steps of this length do not decide whether it closed.
  const std::string& undecided() const { return undecided_; }

 private:
  struct Piece;
  const double* parameters();
  double go_on(const Piece& piece, double rest, Eigen::VectorXd& end);
  void run(double t, double h, Eigen::VectorXd x, const Eigen::VectorXd& u, Eigen::VectorXd& next);
  void take(const Piece& piece, double h, Eigen::VectorXd& end);
  void take_free(const Piece& piece, double h, Eigen::VectorXd& end);
  Eigen::VectorXd demanded_by_gaps(const Piece& piece) const;
  bool balance(const Piece& piece, double h, const Eigen::VectorXd& end, double& last);
  double gap_after(const Piece& piece, double h, int contact);
  double first_impact(const Piece& piece, double h, Eigen::VectorXd& end);
  double impact_of(const Piece& piece, double h, const Eigen::VectorXd& end, int contact);
  int lowest_open(const Piece& piece, const Eigen::VectorXd& end);
  double lowest_dip(const Piece& piece, double h, const Eigen::VectorXd& end, int& contact);
  double dip(const Piece& piece, double h, int contact, double gap, double rate) const;
  void look_at_turns(const Piece& piece, double h, const Eigen::VectorXd& middle, const Eigen::VectorXd& end);
  void close_what_rests(double t, double h, Eigen::VectorXd& x, const Eigen::VectorXd& u);
  void stop(double t, Eigen::VectorXd& x, int contact);
  void settle(double t, Eigen::VectorXd& x);
  RigidImpact& note_impact(double t);
  dynamics::ImpactImpulses push(double t, Eigen::VectorXd& x, const std::vector<int>& contacts,
                                const std::vector<double>& restitution, std::vector<int> hit);
  bool hits(const Eigen::VectorXd& x);
  void collide(double t, Eigen::VectorXd& x);
  void open_what_left(const Eigen::VectorXd& x);
  std::vector<int> rows_of(const std::vector<int>& contacts) const;
  std::vector<int> closed() const;
  dynamics::ContactProblem problem_of(const std::vector<int>& contacts, const Eigen::MatrixXd& D) const;

  const RobotScene& scene_;
  Stepper& stepper_;
  bool is_implicit_;
  RigidFunctions functions_;
  dynamics::ContactSolver solver_;
  std::vector<dynamics::ContactBlock> blocks_;
  std::vector<int> first_row_;
  std::vector<bool> is_closed_;
  std::vector<int> impacts_in_step_;
  double whole_step_ = 0;
  int hit_ = -1;                         // the contact or stop whose gap ends the piece; -1: none
  Eigen::VectorXd forces_, parameters_;  // (m); (n_p + m), ends with the forces
  // The best forces so far for a piece, and their error relative to the quantities that they balance.
  struct Forces {
    double off = HUGE_VAL;
    Eigen::VectorXd forces;
  };
  Forces closest_;
  Eigen::MatrixXd slopes_;  // dv'/dlambda of the current piece; empty: not computed
  std::vector<RigidPiece> pieces_;
  std::vector<RigidImpact> impacts_;
  Eigen::VectorXd unsure_;  // (n) bound of the error of the gaps, since the start
  std::string undecided_;
};

}  // namespace dyntape
