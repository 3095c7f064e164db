// SPDX-License-Identifier: BSD-3-Clause
//
// Steps in time of a robot with rigid contacts and hard limits: the steps of a Stepper, the forces of closed contacts that
// they need, and impacts as events.
//
//   Stepper stepper(system_of(scene), integrator, options, RigidStepper::needs_jacobians(integrator));
//   RigidStepper rigid(scene, stepper, integrator, options);
//   rigid.start(x);                                          // ArgumentError where something is below its ground
//   std::string why;
//   if (!rigid.step(t, h, x, u, next, &why)) ...
//   for (const RigidPiece& piece : rigid.pieces()) ...       // what the step was made of
//   for (const RigidImpact& impact : rigid.impacts()) ...
//
// Closed contacts.  Over a step they push with constant forces lambda (fixed in the world, as parameters of the system), so
// that the end x' = step(x; lambda) obeys, with gap the one at the beginning and beta = 0.2:
//   0 <= u_n   perpendicular to   lambda_n >= 0,      Coulomb's friction of lambda_t against u_t,      u = J (v' + v_gap)
// v_gap = J^+ (beta gap / h) the least motion that makes gaps decay, by a fifth in a step.
// Solved by Newton's method: with the derivatives D = du'/dlambda (h J M^-1 J^T of explicit schemes, the exact Jacobian of
// implicit ones) a ContactProblem a round.  What rests is a fixed point of the step: it neither sinks nor creeps, and what
// is left of gaps by curved motions decays instead of adding up.  Where Newton's method does not get there, the step is
// made in parts.  Order 1 while a contact is closed.
//
// Impacts.  Where the gap of an open contact becomes negative within a step, the step is shortened to the moment when it
// is zero, found as a root over the length of the step (Alefeld, Potra and Shi's algorithm 748) to rounding; there the law of
// impact.h acts on all that touches; the rest of the step goes on.  What rebounds is open again.  A contact that had
// kMostImpacts of them within one step (Zeno) is closed from then on: its restitution is over.  So is what comes back before
// it is 1e-8 m away, or nears with less than a fall from there gives: it rests, and its velocity ends at once, by an impulse
// without restitution that is not counted among impacts.
// A dip below ground and out again within one step is found where a cubic through gaps and rates shows it (rigid_dips.h).
// Where an open gap turns nearer to its ground than gaps are known, by what the cubic has been off by so far, whether it
// touches is not known.  If it may be passed by more than 1e-6 m or rad, undecided() says so.
//
// Not decided here: of several solutions (Painleve's paradox, several impacts at once) one is taken, the same each time.
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
  Eigen::VectorXd forces;  // (m) of the rows, zero where open
};

struct RigidImpact {
  double t = 0;            // s
  Eigen::VectorXd p;       // (m) impulses of the rows
  Eigen::VectorXd u_sum;   // (m) velocities before and after, added: the work is p . u_sum / 2 (J)
  std::vector<int> hit;    // contacts and stops that were open and hit
  double restitution = 1;  // the share of it that was taken (impact.h)
};

class RigidStepper {
 public:
  static constexpr int kMostImpacts = 8;

  // Keeps references to the scene and the stepper.
  RigidStepper(const RobotScene& scene, Stepper& stepper, Integrator integrator,
               const CodegenOptions& options);

  // Implicit schemes answer to forces by their Jacobian.
  static bool needs_jacobians(Integrator integrator);

  // What touches at x = (q, v, ...) is closed.  ArgumentError where a gap is below -1e-6 m or rad, with by how much.
  void start(const Eigen::VectorXd& x);

  // False where there is no step, and *why says what happened.
  bool step(double t, double h, const Eigen::VectorXd& x, const Eigen::VectorXd& u, Eigen::VectorXd& next,
            std::string* why);

  const std::vector<RigidPiece>& pieces() const { return pieces_; }
  const std::vector<RigidImpact>& impacts() const { return impacts_; }
  const Eigen::VectorXd& forces() const { return forces_; }  // (m) at the end of the last step
  RigidFunctions& functions() { return functions_; }
  // "", or where a gap turned so near to its ground that steps of this length do not tell whether it touches.
  const std::string& undecided() const { return undecided_; }

 private:
  struct Piece;
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
  int hit_ = -1;  // the contact or stop whose gap ends the piece, -1: none
  Eigen::VectorXd forces_;
  // Of the forces looked at for a piece: how far off they are, by the numbers that they answer to.
  struct Forces {
    double off = HUGE_VAL;
    Eigen::VectorXd forces;
  };
  Forces closest_;
  Eigen::MatrixXd slopes_;  // dv'/dlambda of the piece that is taken; empty: not known yet
  std::vector<RigidPiece> pieces_;
  std::vector<RigidImpact> impacts_;
  Eigen::VectorXd unsure_;  // (n) how far gaps may be off, since the start
  std::string undecided_;
};

}  // namespace dyntape
