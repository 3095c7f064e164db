// SPDX-License-Identifier: BSD-3-Clause
//
// A task as data: the content of a task file, before the problem is built.  Fill it in a program, or read it from a
// file.
//
//   TaskSpec spec;
//   spec.name = "swing-up";
//   spec.scene = {dynamics::load_urdf("cart_pole.urdf"), {}, {"slider"}};   // only the slider is driven
//   spec.robot.duration = 2;                                                // s
//   spec.start = Eigen::Vector4d(0, 0, 0, 0);                               // (q, v): m, rad, m/s, rad/s
//   spec.goal = Eigen::Vector4d(1, std::numbers::pi, 0, 0);
//   spec.costs.control = 1;                                                 // weight of |u|^2, integrated
//   const SolveReport report = solve_task(build_task(spec));                // task.h, run/solve/solve.h
//
// Fields have the meanings, units and defaults of the keys of task files (docs/reference/task_keys.md).  States are
// (q, v); an entry Problem::kFree is free, and an empty state is free.  Weights of joints have one entry per
// velocity (nv); empty weights are zero.
//
// Errors.  None here; build_task (task.h) refuses inconsistent data (task_faults.h).
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <dyntape/interface/control/problem/penalties.h>
#include <dyntape/interface/control/solve/optimise.h>
#include <dyntape/interface/files/info/places.h>
#include <dyntape/interface/files/moving_target.h>
#include <dyntape/interface/motion/capsules.h>
#include <dyntape/interface/motion/gait.h>
#include <dyntape/interface/motion/implicit_contacts.h>
#include <dyntape/interface/motion/periodic_gait.h>
#include <dyntape/interface/motion/robot_problem.h>
#include <dyntape/interface/motion/robot_terms.h>

namespace dyntape {

struct Scene;

enum class View { kXz, kXy, kYz, kOblique };

// Capsules of obstacles and of the robot, and the pairs that must not touch.
struct Surroundings {
  std::vector<Capsule> obstacles, bodies;
  // If above 0: mu and delta (m) of a barrier that replaces the constraint (penalties.h).
  double barrier = 0, width = 1e-3;
  struct Pair {
    Capsule a, b;
    double least;  // clearance (m)
    std::string name() const { return a.name + " from " + b.name; }
  };
  std::vector<Pair> apart;
};

// A configuration or pose that the motion passes.
struct TaskWaypoint {
  std::string name;
  double at = 0;                      // fraction of the duration
  std::optional<FrameTarget> target;  // or
  Eigen::VectorXd q;                  // (nv) for robots whose joints have one coordinate each
};

// A reference motion in time, linear between rows, constant before the first and after the last.
struct ReferenceMotion {
  std::vector<double> t;
  Eigen::MatrixXd x;       // (nq + nv x rows)
  Eigen::VectorXd weight;  // (nq + nv) of squares
  Eigen::VectorXd at(double time) const;
};

// A term of a given type (term_keys.h lists types and parameters).
struct TermSpec {
  std::string name, type;  // "upright", "frame_orientation"
  std::string frame = {};  // frame of a link
  dynamics::ReferenceFrame in = dynamics::ReferenceFrame::kLocalWorldAligned;        // for velocities
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ(), place = Eigen::Vector3d::Zero();  // for looks_at; m
  Eigen::VectorXd target = {};             // subtracted from each entry; empty: zero
  std::optional<MovingTarget> moves = {};  // none: the target is constant
  std::vector<std::string> entries = {};   // entries in use; empty: all
  Role role = Role::kCost;                 // or kEquality, kInequality
  Eigen::VectorXd lower = {}, upper = {};  // one per entry in use; empty: none
  std::optional<double> at = {};           // fraction of the duration; none: at all times
  Penalty penalty = Quadratic{};           // for a cost
};

// A bound from the robot, or one number for all; infinite: no bound.
struct Limit {
  bool robot = true;
  double value = std::numeric_limits<double>::infinity();
};
// The limits of the robot that become bounds.
struct RatedParts {
  bool positions, velocities, efforts;
};

struct TaskSpec {
  std::string name, urdf;
  std::string file;                   // named in messages; "": the task itself
  io::Places places;                  // of the file's keys
  std::vector<std::string> inputs;    // paths of all files read
  std::vector<std::string> notes;     // oddities and omissions of the robot's file
  std::vector<std::string> left_out;  // elements of the robot's file that are ignored
  std::string effective;              // the file with all defaults

  RobotScene scene;
  RobotProblemOptions robot;    // duration, dynamics, thrusters, contacts
  std::optional<double> floor;  // m, height of the floor; none: not given
  // For rigid contacts, whose forces are variables: their smoothing, and the scene that simulates the motion.  Null:
  // none.
  ContactContinuation continuation;
  std::shared_ptr<const Scene> simulated;

  Eigen::VectorXd start, goal;
  std::optional<FrameTarget> target;        // target of the goal; positions are then free
  bool has_soft_goal = false;               // true: the goal is a cost, not a constraint
  std::optional<Problem::Range> free_time;  // range of a free duration

  // One phase of the motion, with values that hold in this phase only.
  struct Phase {
    std::string name;
    double duration = 0;  // s; 0: the task's
    int intervals = 0;    // 0: the task's
    std::optional<Problem::Range> free_time;
    std::vector<std::string> hold;  // frames of held contacts
    bool impact = false;            // true: contacts that close at the beginning have an impact
    std::vector<std::pair<std::string, Eigen::Vector3d>>
        moved;  // contacts with another position than before, and the offset
    Eigen::VectorXd goal;
    std::optional<FrameTarget> target;
    double clearance = 0;  // m, of contacts in the air, above the straight line to where they land
  };
  std::vector<Phase> phases;  // empty: no phases
  // A periodic motion; `goal` is then free.
  struct Periodic {
    PeriodicGait step;
    std::vector<std::pair<std::string, std::string>> contacts;  // contacts that are swapped
    bool impact = false;
  };
  std::optional<Periodic> periodic;
  std::optional<Gait> gait;   // of the contacts, in their order; none: all are closed
  double swing_weight = 1e4;  // weight of the height error of feet in the air (1/m^2)

  std::vector<TaskWaypoint> waypoints;  // in order of time
  std::optional<ReferenceMotion> reference;
  Surroundings around;
  struct Guess {
    bool slope = false, holding = false;  // velocities of the straight line; controls against gravity
  } guess;
  // Weights.
  struct Costs {
    double control = 0, effort = 0, acceleration = 0, force = 0, time = 0;
    Eigen::VectorXd tracking_q, tracking_v;
    double tracking_position = 0, tracking_orientation = 0;
    double tracking_base_position = 0, tracking_base_orientation = 0;
    Eigen::VectorXd end_q, end_v;
  } costs;
  std::vector<TermSpec> terms;
  struct Limits {
    Limit positions, velocities, efforts;
    RatedParts of_robot() const { return {positions.robot, velocities.robot, efforts.robot}; }
  } bounds;

  OptimiseOptions optimise;
  bool by_ddp =
      false;  // true: differential dynamic programming (ddp.h), with the options of `optimise` that apply
  // The conditions of every solution (solution.h), with further conditions for tasks.
  struct VerifyOptions : dyntape::VerifyOptions {
    // Most refinements.  Each divides the defect by 8 (trapezoid) or 32 (Hermite-Simpson); defects that remain after
    // four have another cause than the mesh.
    int refinements = 4;
    bool limits = true;
    // For differential dynamic programming with a hard goal: the largest final error, relative to the range of the
    // states that the goal sets.
    double goal = 1e-2;
    // With rigid contacts: the largest difference of a position from the simulation, relative to its range, and the
    // largest fraction of the contacts' impulse that may act at a distance.
    double simulation = 0.05;
    double servo_stiffness = 0,
           servo_damping = 0;  // of the simulated joints' position control (N m/rad, N m s/rad)
  };
  VerifyOptions demands;
  struct Expected {
    double cost, tolerance;
  };
  std::optional<Expected> expected;
  std::vector<std::string> traces;  // frames whose paths are drawn
  View view = View::kXz;
  struct ModelSettings {
    bool recompile_libraries = false;
    std::string model_folder;  // "": the default folder of the cache
    bool verbose = false;
  };
  ModelSettings models;
  // Settings as a controller (mpc_task.h).
  struct Control {
    double seconds = 3, period = 0.02, delay = 0;  // s
    double feedback = 0;                           // s between corrections with the plan's gains; 0: none
    int iterations = 1;                            // per step; 0: until convergence
    double violation = 1e-2;                       // limit for usable plans (receding_horizon.h)
    double late = 0.2;  // largest fraction of steps, without the first, that may exceed a period
    struct Disturbance {
      double at = 0;                                      // s
      Eigen::VectorXd v;                                  // (nv) added to the velocities
      Eigen::Vector3d impulse = Eigen::Vector3d::Zero();  // N s, world axes, at the origin of `frame`
      std::string frame = {};                             // "": no impulse
    };
    std::vector<Disturbance> disturbances;
    std::shared_ptr<const Scene> plant;  // null: the task's own dynamics
    double fallen = 0;                   // m, the loop ends if the base is lower; 0: never
  };
  Control control;
};

// An inconsistency, with its key: "costs.tracking.position"; "phases.phase#1.impact" for the second phase.
struct SpecFault {
  std::string key, message;
};

}  // namespace dyntape
