// SPDX-License-Identifier: BSD-3-Clause
//
// The blocks `gait` and `mpc` of task files.
#include <dyntape/autodiff/error.h>
#include <dyntape/interface/files/joint_values.h>
#include <dyntape/interface/files/lists.h>
#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/files/scene/scene_keys.h>
#include <dyntape/interface/files/task/place_keys.h>
#include <dyntape/interface/files/task/task_keys.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

using Eigen::VectorXd;
using io::Section;
using RobotModel = dynamics::Model<double>;

std::optional<Gait> read_gait(Section& file, Eigen::Index feet, const dynamics::Model<double>* model) {
  if (!file.about("walking; without this block all feet stand").has("gait")) return {};
  Section block = file.child("gait");
  Gait gait;
  gait.period = block.about("of a foot's steps [s]").get<double>("period", io::positive());
  gait.duty = block.about("part of the period for which a foot stands, up to 1")
                  .get_or("duty_factor", gait.duty, io::between(1e-3, 1));
  const auto numbers = [&](const char* key, const std::string& text, Eigen::Index n, const std::string& has,
                           const io::Range& range = {}) {
    return numbers_in(block, key, text, n, range, has, false);
  };
  block.about(
      "of each foot of contacts.points: parts of a period by which it steps down later, within one either "
      "way");
  if (model) {
    const VectorXd phases = numbers("phase_offsets", block.get<std::string>("phase_offsets"), feet,
                                    "there are " + std::to_string(feet) + " feet", io::between(-1, 1));
    gait.phases.assign(phases.begin(), phases.end());
  } else {
    block.defer("phase_offsets", "a number a foot");
  }
  block.about("of the body, along the floor [m/s]");
  if (model)
    gait.velocity = numbers("velocity", block.get_or("velocity", "0 0"), 2, "the floor has 2 axes");
  else
    block.defer("velocity", "two numbers \"x y\"", "0 0");
  return gait;
}

void read_walk(Section& file, TaskSpec& task, const RobotModel* model) {
  task.gait = read_gait(file, Eigen::Index(task.robot.contacts.size()), model);
  if (!task.gait) return;
  Section block = file.child("gait");
  task.gait->lift = block.about("of feet in the air, at most [m]")
                        .get_or("swing_height", task.gait->lift, io::not_negative());
  task.swing_weight =
      block.about("weight of the squared distance of feet in the air from that height [1/m^2]")
          .get_or("swing_weight", task.swing_weight, io::positive());
}

// What hits a robot: a change of its joints' velocities, or an impulse at a link.
TaskSpec::Control::Disturbance read_hit(Section& push, const RobotModel* model) {
  TaskSpec::Control::Disturbance hit;
  push.about("added to the velocities [rad/s or m/s]");
  hit.v = read_joint_values(push, "v", model, 0.0);
  if (!push.about("at the origin of 'frame', world axes; the robot's inertia says what it changes [N s]")
           .has("impulse"))
    return hit;
  hit.impulse = read_vector3(push, "impulse", std::nullopt);
  hit.frame = read_link(push.about("the link that the impulse acts on"), "frame", model);
  if (model && !hit.frame.empty() && model->frames[std::size_t(model->frame_index(hit.frame))].body < 0)
    push.problem("frame", "'" + hit.frame + "' is fixed to the world and is not moved by an impulse");
  return hit;
}

// The scene whose simulation is the plant.
void read_plant(Section& file, TaskSpec& task, const RobotModel* model) {
  Section block = file.child_or_empty("mpc");
  block.about(
      "a scene file of the same robot, simulated as the plant; its start does not count; \"\": the task's "
      "own dynamics");
  const std::string name = block.get_or("plant", "");
  block.about(
      "height of the floating base below which the robot has fallen, and the loop ends [m]; 0: never");
  task.control.fallen = block.get_or("min_height", 0.0, io::not_negative());
  if (model && task.control.fallen > 0 && !floats(*model))
    block.problem("min_height", "'mpc.min_height' is of a floating base; this robot's base is fixed");
  if (name.empty() || !model) return;
  try {
    const std::string path = path_beside(task.file, block, "plant", name);
    task.control.plant = std::make_shared<const Scene>(read_scene(path));
    task.inputs.insert(task.inputs.end(), task.control.plant->inputs.begin(),
                       task.control.plant->inputs.end());
  } catch (const Error& e) {
    block.problem("plant", e.what());
    return;
  }
  const RobotScene& plant = task.control.plant->robot;
  if (joint_names(plant.model) != joint_names(*model) || plant.model.nq != model->nq ||
      driven_names(plant) != driven_names(task.scene))
    block.problem("plant",
                  "the robot of '" + name +
                      "' has other joints, or other driven ones, than the task's; expected the same robot");
}

TaskSpec::Control read_control(Section& file, const ReadPush& read_push) {
  Section block = file.about("the task as a controller, for `dyntape mpc`").child_or_empty("mpc");
  TaskSpec::Control control;
  control.seconds = block.about("of the closed loop [s]").get_or("duration", control.seconds, io::positive());
  control.period =
      block.about("from one plan to the next [s]").get_or("period", control.period, io::positive());
  control.delay = block.about("from measuring to acting [s], less than a period")
                      .get_or("delay", control.delay, io::not_negative());
  if (control.delay >= control.period)
    block.problem("delay", "'mpc.delay' must be less than the period, " + io::shortest(control.period) +
                               " s, got " + io::shortest(control.delay));
  control.feedback = block.about("from one correction by the plan's gains to the next [s]; 0: none")
                         .get_or("feedback_period", control.feedback, io::not_negative());
  if (control.feedback >= control.period)
    block.problem("feedback_period", "'mpc.feedback_period' must be less than the period, " +
                                         io::shortest(control.period) + " s, got " +
                                         io::shortest(control.feedback));
  control.iterations = block.about("steps of sequential quadratic programming a plan; 0: until it is solved")
                           .get_or("iterations", control.iterations, io::between(0, 1000));
  control.violation =
      block.about("most that a usable plan breaks a constraint by, relative to the program's nominal values")
          .get_or("max_violation", control.violation, io::positive());
  control.late = block.about("most of the later steps that may take longer than a period, as a part of all")
                     .get_or("max_late", control.late, io::between(0.0, 1.0));
  if (!block.about("something that hits the robot").has("disturbance")) return control;
  for (Section& push : block.each("disturbance")) {
    const double at = push.about("when [s]").get<double>("at", io::not_negative());
    control.disturbances.push_back(read_push(push));
    control.disturbances.back().at = at;
  }
  return control;
}

}  // namespace dyntape
