// SPDX-License-Identifier: BSD-3-Clause
//
// Robot configurations in optimal control: rate, difference, start and goal of q (nq).  Needed if q has
// orientations: quaternions (x y z w), or (cos, sin) of continuous joints.  v (nv) is as in dynamics/model/joints.h.
//
//   Problem p = robot_problem(scene, {.duration = 2});                       // state (q, v)
//   start_at(p, scene, q0, v0);
//   end_at(p, scene, q1, v1);                                                // orientations: rotation error zero
//   p.guess = ...between(scene.model, q0, q1, t / 2)...
//
// Rate.  configuration_rate() is N(q) v, exactly: R v for a position, (1/2) u (w, 0) for a quaternion u, w (-s, c)
// for a pair.  Quaternions and pairs have an additional term + k (1 - |u|^2) u, which is zero at |u| = 1.
// Integration schemes leave the unit sphere by their error.  The term reduces |u|^2 - 1 by a factor e in 1 / (2 k),
// so that it stays below (error of a step) / (2 k h) for motions of any length.  k is kNormReturn = 1 /s: slower
// than robots move, so that it does not limit the step (explicit steps of order 4 allow 1.4 s, of order 1 allow 1
// s), and fast enough against drift.  |u| has no other effect: all functions use the direction of u only, and its
// rate does not depend on |u|.
//
// Ends.  At the start all entries of u are given, with norm one.  At the end the dynamics already determine the
// norm, so four values would be redundant.  end_at() therefore demands that the rotation error log(u_1^-1 u) is
// zero: an equality of three rows (one for a pair), smooth up to half a turn.
//
// Differences per joint: q - q_ref; for a position p - p_ref in world axes (m); for an orientation log(u_ref^-1 u)
// in the frame's own axes (rad, up to half a turn); for a pair the angle.
//
// Errors.  ArgumentError: vectors of wrong size, a quaternion of start or goal that is zero or given in part, a free
// orientation at the start (its norm would be undetermined).
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/control/problem/problem.h>
#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

inline constexpr double kNormReturn = 1;  // k (1/s), above

// Returns true if all joints are on lines, i.e. q has no quaternions or pairs.
bool is_on_lines(const dynamics::Model<double>& model);

// The entries in q of a joint's quaternion or (cos, sin) pair: the first entry and their number; 0 for joints on a
// line.
struct DirectionEntries {
  int first, count;
};
DirectionEntries direction_entries(const dynamics::Joint<double>& joint);

// Names of the entries of q (of_q) or v: "q.elbow", or "q.root_joint[0]", ... if a joint has several.
std::vector<std::string> entry_names_of(const dynamics::Model<double>& model, const std::string& prefix,
                                        bool of_q);

// (nq) N(q) v with the norm term, see above; for AD and double.
template <class T>
dynamics::VectorX<T> configuration_rate(const dynamics::Model<double>& model, const dynamics::VectorX<T>& q,
                                        const dynamics::VectorX<T>& v);

// (nv) The difference of q and q_ref, see above; for AD and double.
template <class T>
dynamics::VectorX<T> configuration_error(const dynamics::Model<double>& model, const Eigen::VectorXd& q_ref,
                                         const dynamics::VectorX<T>& q);
// The difference as a stage function, for terms: terminal_squares("end", weighted(configuration_error(scene, q1),
// 100)).
StageFunction configuration_error(const RobotScene& scene, const Eigen::VectorXd& q_ref);

// (n_x) The difference of two states (q, v) as changes of their entries (Problem::difference); for orientations N(q)
// times the rotation error.
Eigen::VectorXd state_difference(const dynamics::Model<double>& model, const Eigen::VectorXd& from,
                                 const Eigen::VectorXd& x);

// Sets start or goal.  An entry Problem::kFree is free; an orientation is free if all its entries are.
void start_at(Problem& problem, const RobotScene& scene, const Eigen::VectorXd& q, const Eigen::VectorXd& v);
void end_at(Problem& problem, const RobotScene& scene, const Eigen::VectorXd& q, const Eigen::VectorXd& v);

// Interpolates from q0 (s = 0) to q1 (s = 1): linear for positions, about a fixed axis, the shorter way, for
// orientations.  velocity_between is the derivative (nv) with respect to s.
Eigen::VectorXd between(const dynamics::Model<double>& model, const Eigen::VectorXd& q0,
                        const Eigen::VectorXd& q1, double s);
Eigen::VectorXd velocity_between(const dynamics::Model<double>& model, const Eigen::VectorXd& q0,
                                 const Eigen::VectorXd& q1, double s);

// Fills free entries for an initial guess: from the other end if it is given there, else from the neutral
// configuration.
void fill_free(const dynamics::Model<double>& model, Eigen::VectorXd& q0, Eigen::VectorXd& q1);

}  // namespace dyntape
