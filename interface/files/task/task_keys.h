// SPDX-License-Identifier: BSD-3-Clause
//
// The keys of a task file: asked for here and nowhere else, each with what it means.
//
//   io::Section file = io::Section::parse(text, path);
//   Task task;
//   const bool known = read_task_scene(file, task);
//   const TaskKeys keys = read_task_keys(file, task, known ? &task.scene.model : nullptr);
//   file.finish();                                                // every problem
//
//   for (const io::Question& q : task_questions()) ...            // the list of all keys (dyntape check-config --keys)
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <dyntape/interface/files/info/section.h>
#include <dyntape/interface/files/task/limits.h>
#include <dyntape/interface/files/task/task.h>
#include <dyntape/interface/files/task/term_keys.h>
#include <dyntape/interface/files/task/waypoint_keys.h>
#include <dyntape/interface/motion/gait.h>
#include <dyntape/interface/motion/periodic_gait.h>
#include <dyntape/interface/motion/robot_terms.h>

namespace dyntape {

// The robot, what acts on it and where it is driven, of a scene file or as the task's own keys say; false if there is no
// such robot, which the file has noted.
bool read_task_scene(io::Section& file, Task& task);
std::string read_task_name(io::Section& file, const std::string& fallback);

// Where bounds come from: nothing, the robot, or one number for all.
struct Limit {
  bool robot = false;
  double value = std::numeric_limits<double>::infinity();
};

// What is wanted, before there is a problem to put it into.
struct TaskKeys {
  // (q, v); what is left open is Problem::kFree, an orientation with all its entries.
  Eigen::VectorXd start, goal;
  std::optional<FrameTarget> target;        // of the goal, whose positions then are free
  std::optional<Problem::Range> free_time;  // of the duration, where it is to be found
  std::vector<TaskWaypoint> waypoints;
  std::optional<ReferenceMotion> reference;
  std::vector<TaskTerm> terms;  // of the block `terms`
  struct Costs {
    std::vector<double> weights;  // of task_costs()
    Eigen::VectorXd tracking_q, tracking_v;
    double tracking_position = 0, tracking_orientation = 0;
    double tracking_base_position = 0, tracking_base_orientation = 0;
    Eigen::VectorXd end_q, end_v;
  } costs;
  struct Guess {
    bool slope = false, holding = false;
  } guess;
  struct Limits {
    Limit positions, velocities, efforts;
    RatedParts of_robot() const { return {positions.robot, velocities.robot, efforts.robot}; }
  } limits;
  struct Phase {
    std::string name;
    double duration = 0;
    int intervals = 0;
    std::optional<Problem::Range> free_time;
    std::vector<std::string> hold;  // frames of contacts
    bool impact = false;
    std::vector<std::pair<std::string, Eigen::Vector3d>> moved;  // contacts that land beside where they stood
    Eigen::VectorXd goal;                                        // (q, v); all of it open where there is none
    std::optional<FrameTarget> target;
  };
  std::vector<Phase> phases;  // empty: the motion has none
  struct Closed {
    PeriodicGait step;
    std::vector<std::pair<std::string, std::string>> contacts;  // that are swapped
    bool impact = false;
  };
  std::optional<Gait> gait;      // of points, in their order; none: all stand
  double swing = 0;              // weight of how feet in the air are off their height
  std::optional<Closed> closed;  // the motion goes on for ever; start and goal are open then
};

// The other keys; what belongs to the task itself goes there.  Without a model, keys over its joints are known but not
// read.
TaskKeys read_task_keys(io::Section& file, Task& task, const dynamics::Model<double>* model);

// What other files that are solved or controlled have as well: horizon.intervals and the mesh, the block mpc, whose disturbances differ.
enum class WithLimitedMemory { kNo, kYes };  // of Ipopt alone
MeshOptions read_mesh(io::Section& file, WithLimitedMemory with = WithLimitedMemory::kYes,
                      const std::string& scheme = "hermite-simpson");
using ReadPush = std::function<Task::Control::Disturbance(io::Section& push)>;  // but for its time
Task::Control read_control(io::Section& file, const ReadPush& read_push);

// The block `gait` of so many feet; none: all stand.
std::optional<Gait> read_gait(io::Section& file, Eigen::Index feet, const dynamics::Model<double>* model);

// The same of a task, when phases are known, and what of the block `mpc` is of robots with joints (control_keys.cpp).
void read_walk(io::Section& file, Task& task, TaskKeys& keys, const dynamics::Model<double>* model);
Task::Control::Disturbance read_hit(io::Section& push, const dynamics::Model<double>* model);
void read_plant(io::Section& file, Task& task, const dynamics::Model<double>* model);

// The block `contact_implicit`, and what a scene with rigid contacts does not go together with (method_keys.cpp).
void read_continuation(io::Section& file, Task& task, const dynamics::Model<double>* model);
constexpr const char* kRigidScheme = "radau-1";
void check_rigid_contacts(io::Section& file, const Task& task, const TaskKeys& keys);
// The scheme's motion is one at its points, and what it is off by, the simulation of the scene tells.
void judge_by_simulation(io::Section& verify, Task::VerifyOptions& demands);

// The block `closed`; when phases are known, notes what does not fit them and opens the goal (closed_motion.cpp).
std::optional<TaskKeys::Closed> read_closed(io::Section& file, const Task& task,
                                            const dynamics::Model<double>* model);
void settle_closed(io::Section& file, const Task& task, const dynamics::Model<double>& model, TaskKeys& keys);

// The block `costs` (cost_keys.cpp), when goal and phases are known.
void read_costs(io::Section& file, TaskKeys& keys, const dynamics::Model<double>* model);

// Notes what the method ddp does not know, where that is the task's (method_keys.cpp).
void check_ddp(io::Section& file, const Task& task, const TaskKeys& keys);

// Every key that a task file may have, in the order of reading.
std::vector<io::Question> task_questions();

}  // namespace dyntape
