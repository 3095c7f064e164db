// SPDX-License-Identifier: BSD-3-Clause
//
// A task as data: what a task file says, or a program fills in, before there is a problem to solve.
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
// Fields have the meanings, units and defaults of keys of task files (docs/reference/task_keys.md).  States are (q, v), with Problem::kFree where
// they are left open; an empty state is open in all entries.  Weights of joints have an entry a velocity (nv); empty ones are
// zero.
//
// Errors: none here; build_task (task.h) refuses what does not go together (task_faults.h).
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <dyntape/interface/control/problem/penalties.h>
#include <dyntape/interface/control/solve/optimise.h>
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

// Where the motion passes on its way.
struct TaskWaypoint {
  std::string name;
  double at = 0;                      // share of the duration
  std::optional<FrameTarget> target;  // or
  Eigen::VectorXd q;                  // (nv) of the joints that have one value each
};

// A motion that is followed in time; between rows along straight lines, before the first and behind the last it stays.
struct ReferenceMotion {
  std::vector<double> t;
  Eigen::MatrixXd x;       // (nq + nv x rows)
  Eigen::VectorXd weight;  // (nq + nv) of squares
  Eigen::VectorXd at(double time) const;
};

// A ready term (term_keys.h has the types and what each asks for).
struct TermSpec {
  std::string name, type;  // "upright", "frame_orientation"
  std::string frame = {};  // of a link
  dynamics::ReferenceFrame in = dynamics::ReferenceFrame::kLocalWorldAligned;        // of a velocity
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ(), place = Eigen::Vector3d::Zero();  // of looks_at; m
  Eigen::VectorXd target = {};             // an entry each, what is subtracted; empty: zero
  std::optional<MovingTarget> moves = {};  // none: the target stands still
  std::vector<std::string> entries = {};   // those that count; empty: all
  Role role = Role::kCost;                 // or kEquality, kInequality
  Eigen::VectorXd lower = {}, upper = {};  // an entry each that counts; empty: none
  std::optional<double> at = {};           // share of the duration; none: all along
  Penalty penalty = Quadratic{};           // of a cost
};

// Where bounds come from: the robot, or one number for all; an infinite one is none.
struct Limit {
  bool robot = true;
  double value = std::numeric_limits<double>::infinity();
};
// Of which the robot's limits are bounds.
struct RatedParts {
  bool positions, velocities, efforts;
};

struct TaskSpec {
  std::string name, urdf;
  std::string file;                   // which messages name; empty: the task itself
  std::vector<std::string> inputs;    // paths of all files that it was read from
  std::vector<std::string> notes;     // what was odd in the robot's file, or is left out of it
  std::vector<std::string> left_out;  // elements of the robot's file that nothing reads
  std::string effective;              // the file as it was understood, defaults included

  RobotScene scene;
  RobotProblemOptions robot;    // duration, dynamics, thrusters, contacts
  std::optional<double> floor;  // m, height of what contacts stand on; none: it is not said
  // Of rigid contacts, whose forces are found: how they are rounded, and what simulates the motion.  Null: there are none.
  ContactContinuation continuation;
  std::shared_ptr<const Scene> simulated;

  Eigen::VectorXd start, goal;
  std::optional<FrameTarget> target;        // of the goal, whose positions then are free
  bool has_soft_goal = false;               // costs draw to it, and it need not be met
  std::optional<Problem::Range> free_time;  // of the duration, where it is to be found

  // A part of the motion; what does not hold over the whole of it.
  struct Phase {
    std::string name;
    double duration = 0;  // s; 0: the task's
    int intervals = 0;    // 0: the task's
    std::optional<Problem::Range> free_time;
    std::vector<std::string> hold;                               // frames of contacts
    bool impact = false;                                         // what lands at its beginning hits the floor
    std::vector<std::pair<std::string, Eigen::Vector3d>> moved;  // contacts that land beside where they stood
    Eigen::VectorXd goal;
    std::optional<FrameTarget> target;
  };
  std::vector<Phase> phases;  // empty: the motion has none
  // The motion goes on for ever; `goal` is open then.
  struct Periodic {
    PeriodicGait step;
    std::vector<std::pair<std::string, std::string>> contacts;  // that are swapped
    bool impact = false;
  };
  std::optional<Periodic> periodic;
  std::optional<Gait> gait;   // of contacts, in their order; none: all stand
  double swing_weight = 1e4;  // of how feet in the air are off their height (1/m^2)

  std::vector<TaskWaypoint> waypoints;  // in the order of time
  std::optional<ReferenceMotion> reference;
  Surroundings around;
  struct Guess {
    bool slope = false, holding = false;  // velocities of the line; controls against gravity
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
  bool by_ddp = false;  // solved by differential dynamic programming (ddp.h), of `optimise` what that knows
  // Those of any solution (optimise.h), and what a task asks for besides.
  struct VerifyOptions : dyntape::VerifyOptions {
    // Each refinement of a trapezoid divides the defect by 8, of Hermite-Simpson by 32: what four do not cure is no
    // matter of the mesh.
    int refinements = 4;
    bool limits = true;
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
  struct Expected {
    double cost, tolerance;
  };
  std::optional<Expected> expected;
  std::vector<std::string> traces;  // frames whose paths are drawn
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
};

// What does not go together, with the key that says it: "costs.tracking.position"; "phases.phase#1.impact" of the second phase.
struct SpecFault {
  std::string key, message;
};

}  // namespace dyntape
