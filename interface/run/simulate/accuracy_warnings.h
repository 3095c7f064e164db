// SPDX-License-Identifier: BSD-3-Clause
//
// Whether the steps of a motion were short enough to be trusted, from states noted along it.
//
//   std::vector<Look> looks;                                  // {step k, state x there}
//   const std::string warning = doubt_of_steps(scene, stepper, looks);      // "" or a sentence
//
// A friction that is too stiff for the step makes the motion tremble, which neither its energy nor its end shows.
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/files/scene/scene.h>

namespace dyntape {

// A place of a motion where steps are looked at for being too long, evenly in time, whatever is sampled.
struct Look {
  long step;
  Eigen::VectorXd x;
  Eigen::VectorXd forces = {};  // of rigid contacts and stops, the parameters of the step; or empty
};

bool is_look(const Scene& scene, long step);

// Squared: m, rad, m/s, rad/s of a state that nothing real is in, and whose energy is still a number; what is said of it.
constexpr double kBeyond = 1e100;
constexpr const char* kUnbounded = "the motion grows without bound; take shorter steps";

// Why a motion ends at t: steps that are too long there, or else what its step says.
std::string trouble_of_step(const Scene& scene, double t, const Eigen::VectorXd& x, const std::string& why);

std::string doubt_of_steps(const Scene& scene, Stepper& stepper, const std::vector<Look>& looks);

// Of the stiffness at places of a motion, where joints turn round within the step as well.
std::string doubt_of_stiffness(const Scene& scene, const std::vector<Look>& looks);

// At a few places of a motion, how far two half steps lead from a whole one.
class HalfSteps {
 public:
  // Two half steps with u held, of parameters p, beside the whole one from x.
  void try_at(const Scene& scene, Stepper& stepper, const Look& look, const Eigen::VectorXd& u,
              const Eigen::VectorXd& p, const Eigen::VectorXd& whole);
  // Their ends.
  void note(const Scene& scene, const Look& look, const Eigen::VectorXd& whole, const Eigen::VectorXd& twice);

  const std::vector<Look>& looks() const { return looks_; }
  // Where they lead elsewhere again and again: friction that trembles, forces that come and go within a step.
  std::string warning() const;

 private:
  std::vector<Look> looks_;
  std::vector<Eigen::VectorXd> errors_;  // (nv) of v, |.|
  Eigen::VectorXd most_;                 // change of v in a step
};

// What the motors give at a state: those with a lag have a state of their own, the others follow u.
Eigen::VectorXd drive_in(const Scene& scene, const Eigen::VectorXd& x, const Eigen::VectorXd& u);

}  // namespace dyntape
