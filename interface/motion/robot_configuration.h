// SPDX-License-Identifier: BSD-3-Clause
//
// Configurations q (nq) of a robot as a part of a state: how they change, how far apart two are, where a motion begins
// and ends.  Orientations are quaternions (x y z w), continuous joints (cos, sin); v (nv) is as in dynamics/model/joints.h.
//
//   Problem p = robot_problem(scene, {.duration = 2});                       // state (q, v)
//   start_at(p, scene, q0, v0);
//   end_at(p, scene, q1, v1);                                                // orientations: by the way that is left
//   p.guess = ...between(scene.model, q0, q1, t / 2)...
//
// Rate.  configuration_rate() is N(q) v, exact: R v of a position, (1/2) u (w, 0) of a quaternion u, w (-s, c) of a pair;
// and on quaternions and pairs + k (1 - |u|^2) u, which is zero where |u| is 1.  Schemes leave that sphere by their error;
// the term brings |u|^2 - 1 back by a factor e in 1 / (2 k), so that it stays within (error of a step) / (2 k h), however
// long the motion.  k is kNormReturn = 1 /s: slower than robots move, so that it asks for no shorter steps than they do
// (an explicit step of order 4 takes it up to 1.4 s, of order 1 up to 1 s), and within a second where drift would build up.
// The length has no other effect: all that reads u reads its direction, whose rate does not know the length.
//
// Ends.  At the start all entries of u are given, with length one.  At the end the dynamics have told the length already,
// and giving all four entries would say one thing twice: end_at() demands that the rotation that is left, log(u_1^-1 u), be
// zero, an equality of three rows (one, of a pair), smooth up to half a turn.
//
// Differences.  By joint: of a number q - q_ref; of a position p - p_ref in the world's axes (m); of an orientation
// log(u_ref^-1 u), the rotation left in the frame's own axes (rad, up to half a turn); of a pair, the angle.
//
// Errors: ArgumentError for vectors of other sizes, for a start or goal whose quaternion is zero or given in part, for a
// start whose orientation is left open: nothing would tell its length.
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/control/problem/problem.h>
#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

inline constexpr double kNormReturn = 1;  // k (1/s), above

// Whether q is a vector of joint values.
bool is_on_lines(const dynamics::Model<double>& model);

// The entries in q of a joint's quaternion or pair (cos, sin): the first, and how many, 0 on a line.
struct DirectionEntries {
  int first, count;
};
DirectionEntries direction_entries(const dynamics::Joint<double>& joint);

// Names of the entries of q (of_q) or v: "q.elbow", "q.root_joint[0]", ... where a joint has several.
std::vector<std::string> entry_names_of(const dynamics::Model<double>& model, const std::string& prefix,
                                        bool of_q);

// (nq) N(q) v with the return to the sphere, above; of AD and double.
template <class T>
dynamics::VectorX<T> configuration_rate(const dynamics::Model<double>& model, const dynamics::VectorX<T>& q,
                                        const dynamics::VectorX<T>& v);

// (nv) how far q is from q_ref, above; of AD and double.
template <class T>
dynamics::VectorX<T> configuration_error(const dynamics::Model<double>& model, const Eigen::VectorXd& q_ref,
                                         const dynamics::VectorX<T>& q);
// The same of a stage, for terms: terminal_squares("end", weighted(configuration_error(scene, q1), 100)).
StageFunction configuration_error(const RobotScene& scene, const Eigen::VectorXd& q_ref);

// (n_x) how far a state (q, v) is from another, as changes of its entries (Problem::difference): of orientations N(q) times
// what is left between them.
Eigen::VectorXd state_difference(const dynamics::Model<double>& model, const Eigen::VectorXd& from,
                                 const Eigen::VectorXd& x);

// The state at an end; an entry Problem::kFree is left open, an orientation with all its entries.
void start_at(Problem& problem, const RobotScene& scene, const Eigen::VectorXd& q, const Eigen::VectorXd& v);
void end_at(Problem& problem, const RobotScene& scene, const Eigen::VectorXd& q, const Eigen::VectorXd& v);

// From q0 at s = 0 to q1 at s = 1, straight: positions on a line, orientations about one axis, by the shorter way.  And
// its velocity (nv) by s.
Eigen::VectorXd between(const dynamics::Model<double>& model, const Eigen::VectorXd& q0,
                        const Eigen::VectorXd& q1, double s);
Eigen::VectorXd velocity_between(const dynamics::Model<double>& model, const Eigen::VectorXd& q0,
                                 const Eigen::VectorXd& q1, double s);

// Configurations to guess with: entries that are free at one end are those of the other, of both: neutral.
void fill_free(const dynamics::Model<double>& model, Eigen::VectorXd& q0, Eigen::VectorXd& q1);

}  // namespace dyntape
