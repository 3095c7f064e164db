// SPDX-License-Identifier: BSD-3-Clause
//
// A task file: a robot, what acts on it, where it shall go, and what that shall cost.
//
//   robot
//   {
//     urdf ../robots/cart_pole.urdf        ; beside this file
//   }
//   actuated "slider"                       ; joints that are driven; absent: all
//   horizon { duration 2  intervals 40 }
//   start   { q { slider 0  pivot 0 } }     ; at rest
//   goal    { q { slider 1  pivot 3.14159 } }
//   costs   { control 1 }
//
//   const Task task = read_task("config/tasks/cart_pole_swing_up.info");
//   const SolveReport report = solve_task(task);                            // solve.h
//
// Keys (defaults in brackets; one a line in a real file; all with their meanings: dyntape check-config --keys).
// Vectors over the joints are written by joint name, as above, as one quoted list, one number for all, or with OCS2's
// indices.
//
//   name                                          of the task [name of the file]
//   scene           a scene file (interface/files/scene/scene.h) in place of robot, effects and actuated
//   robot           urdf, base [fixed] floating, lock [none: "joint joint"], rotation_tolerance [1e-8 rad],
//                   inertia [error] warn: of an inertia that no body has
//   effects         gravity and velocity products [on]; the others off unless given (interface/files/scene/effect_keys.h)
//   actuated        "joint joint" [all]
//   horizon         duration (s), intervals;
//                   min_duration, max_duration [0: it is given]: range of a duration to be found, `duration` being its guess
//   transcription   scheme [hermite-simpson] euler | trapezoid; dynamics [forward] inverse;
//                   hessian [exact] gauss_newton | limited_memory;
//                   controls [physical] fraction: the unit of u, N m or the fraction of the effort limit
//   evaluation      profile [strict] fast; lanes [none] native: points side by side in registers;
//                   route [automatic] interpreter; threads [1], 0: all, that share the points
//   thrusters       thruster NAME { frame, axis ["0 0 1"], lower [0], upper [inf] (N), moment [0] (m) }: forces along axes
//                   of frames, as many as there are (robot_problem.h)
//   contacts        floor [0]: height of the floor (m); a contact that is held elsewhere is an error where the file says
//                   floor, a note otherwise;
//                   points ["" : frames whose origins stay where they are at the start], friction [0.7]: each is held by a
//                   force within the friction cone of a floor with z upwards; the goal is to leave the joints free then;
//                   barrier [0: cones are limits], width [0.05]: weight of a logarithm that keeps forces within their cones, and the
//                   part of the robot's weight below which it is a parabola;
//                   foot LINK { from, to: opposite corners of a rectangle in the link's axes (m) }: as many as there are,
//                   each a foot that does not turn either (robot_problem.h)
//   contact_implicit  of a scene with rigid contacts, whose times and forces the solver finds (implicit_contacts.h); its scheme is radau-1:
//                   relaxation [1e-5] (m), slip [1e-3] (m/s): how far contacts are rounded at the end, the former a quarter of that with each
//                   refinement of the mesh; first_relaxation [0.1], first_slip [0.1]: at the beginning; solves [5]: from those to these
//   phases          phase NAME { duration, intervals, min_duration, max_duration [those of horizon]; contacts [all];
//                   impact [off]; foothold_offset { FRAME "dx dy dz" (m) }; goal [none: open] }, as many as there are, one after another
//                   (phases.h): what a phase holds and the one before does not is where it last stood, or so much beside
//                   it, and at rest when the phase begins, or with an impact is brought to rest by that; what is not held
//                   stays above where it stood.  Two rows of trajectory.csv have the time at which phases meet
//   gait            period, duty_factor [0.5], phase_offsets "0 0.5 0.5 0", velocity ["0 0"] (m/s), swing_height [0.05] (m),
//                   swing_weight [1e4]: contacts.points hold and leave the floor by a schedule (Gait); the goal's base goes on with the
//                   velocity
//   periodic        swap ["": "left_hip right_hip"], advance { JOINT (m, rad) or base "dx dy dz" (m) }, impact [off]: the
//                   motion goes on for ever (periodic_gait.h): the state at its end is that at its start, joints and contacts of each
//                   pair of `swap` having changed places, and positions having gained what they advance.  Contacts of the first
//                   phase stand as `start` has them; else that only says where the guess begins, and there is no goal.  What
//                   stands at the start and not at the end, under the other name, lands there at rest, or with an impact
//   start, goal     q, v [0]; free ["" : joints whose q and v are left open]; of a floating base also
//                   base { position, roll_pitch_yaw, velocity, angular_velocity: as in scenes [0] }, and of the goal's
//                   free ["" : those of the four that are left open]
//   goal            in place of q: frame LINK { position "x y z" (m), orientation "roll pitch yaw" (rad) }, one or both
//   goal            soft [off]: of method ddp, whose costs draw to the goal: it need not be met (verify.goal_error)
//   waypoints       waypoint NAME { at (share of the duration), and frame LINK { ... } as of the goal, or q VECTOR }: where the
//                   motion passes, as many as there are; the guess passes there too (waypoint_keys.h)
//   reference       file (a table with columns t, q.<joint>, v.<joint>, as solve writes it), q VECTOR [0], v VECTOR [0]:
//                   weights of the squared distance to a motion that is followed in time (waypoint_keys.h)
//   obstacles       sphere NAME ["sphere 1"] { center "x y z", radius }, capsule NAME { from, to, radius }: as many as there are
//   bodies          the same on the robot, each with its frame, in whose axes it stands: every body keeps clear of every
//                   obstacle (capsules.h), by clearance [0] (m); pair "hand base": so do two bodies of each other;
//                   barrier [0: a limit]: weight of a logarithm that keeps them away in place of a limit, and width [0.001]
//                   (m) below which it is a parabola
//   guess           positions [line]: from start to goal, or to a configuration in which the goal's frame is in place
//                   (inverse_kinematics.h); velocities [zero] slope, control [zero] gravity
//   costs           control, effort, acceleration [0]: weights of |u|^2, |u/limit|^2, |q''|^2, integrated;
//                   time [0]: weight of a duration that is to be found (s);
//                   tracking { q VECTOR [0]  v VECTOR [0]  position [0]  orientation [0]
//                   base_position [0]  base_orientation [0]  end { q VECTOR [0]  v VECTOR [0] } }: weights of the squared
//                   distance to the goal, the third and fourth to that of its frame, those of `end` at the end alone; what
//                   the goal leaves open weighs nothing; in every phase the goal is that of the whole motion
//   terms           term NAME { type, frame, in [aligned] world | local, axis ["0 0 1"], place, target [0], entries ["": all],
//                   role [cost] equality | inequality, where [running] start | end | at, at, lower, upper, weight [1],
//                   penalty [quadratic] huber | absolute | barrier, width [0.01] }: ready terms, as many as there are.  Types:
//                   frame_position, frame_orientation, frame_velocity, looks_at, com, momentum, joint_position,
//                   joint_velocity, torque, power (term_keys.h)
//   bounds          positions, velocities, efforts [robot] none | NUMBER: limits of the robot, or +-NUMBER; a velocity
//                   or effort limit of 0 in the robot's file is none
//   solver          method [ipopt] riccati (solver_options.h) | ddp (ddp.h: costs alone draw to the goal, of limits those of
//                   controls hold, no other is asked for unless verify.limits; steps of the classical Runge-Kutta
//                   scheme, or scheme euler), tolerance [1e-8], dual_tolerance [1],
//                   bound_relaxation [1e-8], max_iterations [3000], max_seconds [1e6], stop_at_acceptable [on],
//                   barrier_update [adaptive] monotone (barrier_parameter.h), print_level [0], check_derivatives [on],
//                   ipopt { options of Ipopt by name, but those that name files, print or warm-start }
//   verify          violation [1e-6]: most that the motion may break a constraint by, recomputed, relative to the
//                   nominal values of the program (staged_nlp.h);
//                   integration_error [1e-3]: most that an interval may differ from its re-simulation, as a part of how far
//                   the motion moves each state (verify.h); the simulation has to come to an end whatever is demanded;
//                   max_refinements [4]: times that the mesh is refined and the task solved again where it is more;
//                   between_nodes [5e-3]: most that an inequality of the task, as a friction cone, may be exceeded by between
//                   points of the mesh, as a part of how far its value moves; bounds of states and controls are exceeded from
//                   integration_error of their range on;
//                   goal_error [1e-2]: most that a motion by method ddp may end from a goal that is not soft, as a part of how far
//                   the motion moves it;
//                   simulation_error [0.05]: of rigid contacts, most that a position may be off when the motion's torques drive the
//                   scene's own simulation, as a part of how far it moves (contact_simulation.h), and most of the contacts' impulse that
//                   may act from a distance;
//                   servo_stiffness, servo_damping [0] (N m/rad, N m s/rad; N/m, N s/m): with which the driven joints follow their
//                   motion in it;
//                   limits [on]: a motion beyond a limit of the robot's file (limits.h), which then the task does not
//                   impose, or nearer to an obstacle between points of the mesh, is no success; off: it is reported only
//   expected        cost, tolerance: a known optimum to compare with
//   output          trace ["": frames whose paths are drawn], view [xz] xy | yz | oblique
//   mpc             the task as a controller (mpc_task.h)
//   model_settings  as OCS2 spells it: recompileLibrariesCppAd (or recompileLibraries) [off]: compile although the cache has
//                   the libraries, which unlike OCS2's do not go stale; modelFolderCppAd ["": the user's cache];
//                   verboseCppAd [off]: say what is compiled
//
// Errors: FileError listing every problem of the file with its place; those of reading the robot.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <dyntape/interface/control/solve/optimise.h>
#include <dyntape/interface/files/info/settings.h>
#include <dyntape/interface/motion/capsules.h>
#include <dyntape/interface/motion/implicit_contacts.h>
#include <dyntape/interface/motion/robot_problem.h>

namespace dyntape {

struct Scene;

enum class View { kXz, kXy, kYz, kOblique };

// What keeps clear of what.
struct Surroundings {
  std::vector<Capsule> obstacles, bodies;
  // Where it is above 0, mu and delta (m) of what keeps them apart in place of a limit (penalties.h).
  double barrier = 0, width = 1e-3;
  struct Pair {
    Capsule a, b;
    double least;  // clearance (m)
    std::string name() const { return a.name + " from " + b.name; }
  };
  std::vector<Pair> apart;
};

struct Task {
  std::string name, file, urdf;
  std::vector<std::string> inputs;  // paths of all files that it was read from
  std::vector<std::string>
      notes;  // what was odd in the robot's file or is left out of it, or odd with the guess
  std::vector<std::string> left_out;  // elements of the robot's file that nothing reads
  RobotScene scene;
  RobotProblemOptions robot;
  Problem problem;
  Surroundings around;
  std::vector<Capsule> passed;  // places of waypoints, for pictures
  std::optional<double> floor;  // m, height of what contacts stand on; none: the file does not say
  OptimiseOptions optimise;
  // Of rigid contacts, whose forces are found: how they are rounded, and what simulates the motion.  Null: there are none.
  ContactContinuation continuation;
  std::shared_ptr<const Scene> simulated;
  bool by_ddp = false;  // solved by differential dynamic programming (ddp.h), of `optimise` what that knows
  struct Expected {
    double cost, tolerance;
  };
  std::optional<Expected> expected;
  // Those of any solution (optimise.h), and what a task asks for besides.
  struct VerifyOptions : dyntape::VerifyOptions {
    // Each refinement of a trapezoid divides the defect by 8, of Hermite-Simpson by 32: what four do not cure is no
    // matter of the mesh.
    int refinements = 4;
    bool limits = true;
    // Most that an inequality along the path may be exceeded by between points of the mesh, as a part of how far its value
    // moves: forces that jump overshoot there by a part that no mesh takes away, for a time that every mesh shortens.
    double between = 5e-3;
    // Most that differential dynamic programming may end from the goal, as a part of how far the motion moves what the goal
    // gives; unless the goal is soft.
    double goal = 1e-2;
    // Most that a position of a motion with rigid contacts may be off from its simulation, as a part of how far it moves, and most of
    // the contacts' impulse that may act from a distance.
    double simulation = 0.05;
    double servo_stiffness = 0,
           servo_damping = 0;  // of joints that follow their positions in it (N m/rad, N m s/rad)
  };
  VerifyOptions demands;
  // No configuration was found in which a frame is where it shall be: costs draw it as near as it can get.
  bool is_out_of_reach = false;
  std::string unreachable = {};  // why lengths alone forbid it: a sentence; empty: they do not
  bool has_soft_goal = false;    // costs draw to it, and it need not be met
  std::vector<std::string> traces;
  View view = View::kXz;
  struct ModelSettings {
    bool recompile_libraries = false;
    std::string model_folder;  // empty: the default folder of the cache
    bool verbose = false;
  };
  ModelSettings models;
  // As a controller (mpc_task.h).
  struct Control {
    double seconds = 3, period = 0.02, delay = 0;  // s
    double feedback = 0;                           // s between corrections by the plan's gains; 0: none
    int iterations = 1;                            // of a step; 0: until it is solved
    double violation = 1e-2;                       // of a usable plan (receding_horizon.h)
    double late = 0.2;  // most of the later steps that may take longer than a period
    struct Disturbance {
      double at = 0;                                      // s
      Eigen::VectorXd v;                                  // (nv) added to the velocities
      Eigen::Vector3d impulse = Eigen::Vector3d::Zero();  // N s, world axes, at the origin of:
      std::string frame = {};                             // "": none
    };
    std::vector<Disturbance> disturbances;
    std::shared_ptr<const Scene> plant;  // null: the task's own dynamics
    double fallen = 0;                   // m, height of the base below which it is over; 0: never
  };
  Control control;
  // How far a state is from what a controller draws it to, for its report: the motion that is followed, the place of a frame, or the
  // goal, whichever the task has first.  Empty where it has none.
  struct Aim {
    std::string what, unit;  // "the goal of hand"; "m"
    std::function<double(double t, const Eigen::VectorXd& x)> off;
    // The same for pictures: the state (nq + nv, NaN where it is open), or a frame and its place (m); empty where there is none.
    std::function<Eigen::VectorXd(double t)> state = {};
    std::string frame = {};
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
  };
  Aim aim;
  Eigen::Vector2d travel = Eigen::Vector2d::Zero();  // m/s, by which a walking robot's goal moves on
  // The motion in phases, each a task of its own; empty: it has none.  The problem is then that of all contacts at once, and
  // only says what the controls are.
  std::vector<Task> phases;
  bool impact = false;  // of a phase: what lands at its beginning hits the floor
  StageFunction
      closing;  // the first state from the last one, where the motion goes on for ever (periodic_gait.h); else empty
  std::string effective;  // the file as it was understood, defaults included
};

// Settings stand in place of what the file says (settings.h).
Task read_task(const std::string& path, const std::vector<io::Setting>& settings = {});
// The same of text in memory; `path` stands for its place in messages, and its folder for where other files are looked
// for.
Task read_task_text(const std::string& text, const std::string& path,
                    const std::vector<io::Setting>& settings = {});

// The problem with a goal that costs of tracking draw to, which is not demanded: for controllers, and for methods that know no demands.
// ArgumentError where nothing draws.
Problem tracking_problem(const Task& task);

}  // namespace dyntape
