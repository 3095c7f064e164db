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
  if (!file.about("walking pattern; without this block all feet stand").has("gait")) return {};
  Section block = file.child("gait");
  Gait gait;
  gait.period = block.about("time of one step cycle of a foot [s]").get<double>("period", io::positive());
  gait.duty = block.about("fraction of the period during which a foot stands")
                  .get_or("duty_factor", gait.duty, io::between(1e-3, 1));
  const auto numbers = [&](const char* key, const std::string& text, Eigen::Index n, const std::string& has,
                           const io::Range& range = {}) {
    return numbers_in(block, key, text, n, range, has, false);
  };
  block.about(
      "for each foot of contacts.points: delay of its touchdown as a fraction of the period, between -1 and "
      "1");
  if (model) {
    const VectorXd phases = numbers("phase_offsets", block.get<std::string>("phase_offsets"), feet,
                                    "there are " + std::to_string(feet) + " feet", io::between(-1, 1));
    gait.phases.assign(phases.begin(), phases.end());
  } else {
    block.defer("phase_offsets", "a number per foot");
  }
  block.about("walking velocity of the body, along the floor [m/s]");
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
  task.gait->lift = block.about("largest height of a foot in the air [m]")
                        .get_or("swing_height", task.gait->lift, io::not_negative());
  task.swing_weight = block.about("weight of the squared height error of feet in the air [1/m^2]")
                          .get_or("swing_weight", task.swing_weight, io::positive());
}

// What hits a robot: a change of its joints' velocities, or an impulse at a link.
TaskSpec::Control::Disturbance read_hit(Section& push, const TaskSpec& task, const RobotModel* model) {
  TaskSpec::Control::Disturbance hit;
  push.about("jump of the velocities [rad/s or m/s]");
  hit.v = read_joint_values(push, "v", model, {.fallback = 0.0, .followers = task.scene.mimics});
  if (model) hit.v = ties_of(task.scene).tied_v(hit.v);
  if (!push.about("impulse at the origin of 'frame', in world axes [N s]; velocities change according to the "
                  "robot's inertia")
           .has("impulse"))
    return hit;
  hit.impulse = read_vector3(push, "impulse", std::nullopt);
  hit.frame = read_link(push.about("link on which the impulse acts"), "frame", model);
  if (model && !hit.frame.empty() && model->frames[std::size_t(model->frame_index(hit.frame))].body < 0)
    push.problem("frame", "'" + hit.frame + "' is fixed to the world and is not moved by an impulse");
  return hit;
}

// The scene whose simulation is the plant.
void read_plant(Section& file, TaskSpec& task, const RobotModel* model) {
  Section block = file.child_or_empty("mpc");
  block.about(
      "path of a scene of the same robot that is simulated as the plant (the scene's start is ignored); "
      "\"\": the dynamics of the task");
  const std::string name = block.get_or("plant", "");
  block.about(
      "height of the floating base below which the robot counts as fallen and the loop ends [m]; 0: never");
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
  Section block = file.about("model predictive control, for `dyntape mpc`").child_or_empty("mpc");
  TaskSpec::Control control;
  control.seconds =
      block.about("duration of the closed loop [s]").get_or("duration", control.seconds, io::positive());
  control.period = block.about("time between plans [s]").get_or("period", control.period, io::positive());
  control.delay = block.about("time between measurement and control [s], less than a period")
                      .get_or("delay", control.delay, io::not_negative());
  const bool has_period = control.period > 0;  // else it is wrong already
  if (has_period && control.delay >= control.period)
    block.problem("delay", "'mpc.delay' must be less than the period, " + io::shortest(control.period) +
                               " s, got " + io::shortest(control.delay));
  control.feedback = block.about("time between corrections by the plan's feedback gains [s]; 0: no feedback")
                         .get_or("feedback_period", control.feedback, io::not_negative());
  if (has_period && control.feedback >= control.period)
    block.problem("feedback_period", "'mpc.feedback_period' must be less than the period, " +
                                         io::shortest(control.period) + " s, got " +
                                         io::shortest(control.feedback));
  control.iterations =
      block.about("steps of sequential quadratic programming per plan; 0: until the plan is solved")
          .get_or("iterations", control.iterations, io::between(0, 1000));
  control.violation =
      block
          .about(
              "largest violation of a constraint by a usable plan, relative to the program's nominal values")
          .get_or("max_violation", control.violation, io::positive());
  control.late = block.about("largest fraction of steps after the first that may take longer than a period")
                     .get_or("max_late", control.late, io::between(0.0, 1.0));
  if (!block.about("a disturbance of the robot; repeat the block for more").has("disturbance"))
    return control;
  for (Section& push : block.each("disturbance")) {
    const double at = push.about("time of the disturbance [s]").get<double>("at", io::not_negative());
    control.disturbances.push_back(read_push(push));
    control.disturbances.back().at = at;
  }
  return control;
}

}  // namespace dyntape
