// SPDX-License-Identifier: BSD-3-Clause
//
// Checks, from states stored along a motion, whether the steps were short enough.
//
//   std::vector<Look> looks;                                  // {step k, state x there}
//   const std::string warning = doubt_of_steps(scene, stepper, looks);      // "" or a sentence
//
// If friction is too stiff for the step, the motion trembles; neither the energy nor the final state shows this.
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/files/scene/scene.h>

namespace dyntape {

// A place of a motion where the steps are checked.  Places are evenly spaced in time, independent of the samples.
struct Look {
  long step;
  Eigen::VectorXd x;
  Eigen::VectorXd forces = {};  // of rigid contacts and stops, the parameters of the step; or empty
};

bool is_look(const Scene& scene, long step);

// The reason why a motion ends at t: too long steps at that time, or else the message of the step.
std::string trouble_of_step(const Scene& scene, double t, const Eigen::VectorXd& x, const std::string& why);

std::string doubt_of_steps(const Scene& scene, Stepper& stepper, const std::vector<Look>& looks);

// Checks the stiffness at places of a motion, also where joints change direction within the step.
std::string doubt_of_stiffness(const Scene& scene, const std::vector<Look>& looks);

// Compares two half steps with a whole step at a few places of a motion.
class HalfSteps {
 public:
  // Two half steps with u held, of parameters p, and the whole step from x.
  void try_at(const Scene& scene, Stepper& stepper, const Look& look, const Eigen::VectorXd& u,
              const Eigen::VectorXd& p, const Eigen::VectorXd& whole);
  // The ends of these steps.
  void note(const Scene& scene, const Look& look, const Eigen::VectorXd& whole, const Eigen::VectorXd& twice);

  const std::vector<Look>& looks() const { return looks_; }
  // A sentence if the ends differ repeatedly: trembling friction, or forces that begin and end within a step.
  std::string warning() const;

 private:
  std::vector<Look> looks_;
  std::vector<Eigen::VectorXd> errors_;  // (nv) of v, |.|
  Eigen::VectorXd most_;                 // change of v in a step
};

// The motors' torques at a state: motors with a lag have a state; the others give u.
Eigen::VectorXd drive_in(const Scene& scene, const Eigen::VectorXd& x, const Eigen::VectorXd& u);

}  // namespace dyntape
