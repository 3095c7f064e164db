// SPDX-License-Identifier: BSD-3-Clause
//
// Reads a file with a block `centroidal`: a robot on its feet as one mass (centroidal_problem.h) that the forces of
// the feet control.  The robot is pushed, stands or walks.
//
//   const CentroidalTask task = read_centroidal_task("config/control/solo12_pushed.info");
//   ControlReport report = control_task(task);                       // centroidal_control.h
//   const CentroidalTask other = build_centroidal_task(spec, {.duration = 0.5});     // of what a program fills in (task_spec.h)
//
// Keys (defaults in brackets; all with their meanings: dyntape check-config --centroidal-keys):
//
//   name            of the task [name of the file]
//   robot           as in tasks (task.h); base floating
//   start           q, v [0], base { position, roll_pitch_yaw, velocity, angular_velocity [0] }
//   contacts        points "foot foot ...", friction [0.7]
//   centroidal      constant_height, zero_angular_momentum, end_at_rest [off]: constraints of every plan;
//                   max_force [inf] (N) of a foot
//   costs           com [10], velocity [1], angular_momentum [1], force [1e-3]
//   gait            period, duty_factor [0.5], phase_offsets "0 0.5 0.5 0", velocity ["0 0"] (m/s): walking (Gait); absent: all feet stand
//   horizon         duration, intervals
//   transcription   scheme, hessian, as in tasks
//   solver          tolerance [1e-6], max_iterations [300] of a step
//   evaluation      as in tasks
//   mpc             as in tasks (mpc_task.h), but of a disturbance: impulse "x y z" (N s, world) at the centre of mass
//
// The plant is the same mass with the plan's forces; limits of the legs are not checked.  The goal of the centre of
// mass is its initial place, or with a gait the motion from this place with the gait's velocity.
//
// FileError: lists every problem of the file with its place.  Other errors: those of centroidal_problem.
#pragma once

#include <dyntape/interface/files/info/question.h>
#include <dyntape/interface/files/info/settings.h>
#include <dyntape/interface/files/task/task_spec.h>
#include <dyntape/interface/motion/centroidal_problem.h>

namespace dyntape {

// Uses these parts of the spec: the robot, its start, contacts and gait, mesh and solver, and the controller, whose
// disturbances are impulses at the centre of mass.
struct CentroidalTask : TaskSpec {
  CentroidalOptions options = {};
  CentroidalBody body = {};
  Problem problem = {};
};
CentroidalTask build_centroidal_task(TaskSpec spec, const CentroidalOptions& options);

// Settings replace the file's values (settings.h).
CentroidalTask read_centroidal_task(const std::string& path, const std::vector<io::Setting>& settings = {});
CentroidalTask read_centroidal_task_text(const std::string& text, const std::string& path,
                                         const std::vector<io::Setting>& settings = {});

// All keys of such a file, in the order of reading.
std::vector<io::Question> centroidal_questions();

}  // namespace dyntape
