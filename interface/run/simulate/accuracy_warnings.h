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

struct Look {
  long step;
  Eigen::VectorXd x;
  Eigen::VectorXd forces = {};  // of rigid contacts and stops, the parameters of the step; or empty
};

// Squared: m, rad, m/s, rad/s of a state that nothing real is in, and whose energy is still a number; what is said of it.
constexpr double kBeyond = 1e100;
constexpr const char* kUnbounded = "the motion grows without bound; take shorter steps";

std::string doubt_of_steps(const Scene& scene, Stepper& stepper, const std::vector<Look>& looks);

// Of the stiffness at one place, where joints turn round within the step as well.
std::string doubt_at(const Scene& scene, const Look& look);

// The same of half steps alone: how far two of them lead from a whole one (nv) at each place, |.|, and the largest change
// of v in a step.
std::string doubt_of_half_steps(const std::vector<Eigen::VectorXd>& errors, const Eigen::VectorXd& most);

// What the motors give at a state: those with a lag have a state of their own, the others follow u.
Eigen::VectorXd drive_in(const Scene& scene, const Eigen::VectorXd& x, const Eigen::VectorXd& u);

std::string at_time(double t);  // "at t = 1.25 s: "

}  // namespace dyntape
