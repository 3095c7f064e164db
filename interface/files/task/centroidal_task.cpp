// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/task/centroidal_task.h>

#include <filesystem>

#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/files/file_kind.h>
#include <dyntape/interface/files/joint_values.h>
#include <dyntape/interface/files/lists.h>
#include <dyntape/interface/files/old_names.h>
#include <dyntape/interface/files/scene/left_out.h>
#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/files/scene/scene_keys.h>
#include <dyntape/interface/files/task/place_keys.h>
#include <dyntape/interface/files/task/task_keys.h>

namespace dyntape {

namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using io::Section;

void read_stand(Section& file, TaskSpec& task, const dynamics::Model<double>* model) {
  Section start = file.about("initial state of the robot").child("start");
  const std::optional<double> fallback =
      model && single_joint_names(*model).empty() ? std::optional(0.0) : std::nullopt;
  const std::vector<dynamics::MimicRule>& mimics = task.scene.mimics;
  const VectorXd joints = read_joint_values(start.about("joint positions [rad or m]"), "q", model,
                                            {.fallback = fallback, .followers = mimics});
  VectorXd v = read_joint_values(start.about("joint velocities [rad/s or m/s]"), "v", model,
                                 {.fallback = 0.0, .followers = mimics});
  const BaseStart base = read_base(start);
  task.robot.contacts = read_contacts(file, model, Cones::kLimits);
  if (!model) return;
  if (!floats(*model)) {
    file.child("robot").problem("base", "'robot.base' must be floating: a robot that stands on its feet");
    return;
  }
  VectorXd q = configuration_of(*model, joints);
  place_base(base, q, v);
  task.start.resize(q.size() + v.size());
  const Ties ties = ties_of(task.scene);
  task.start << ties.tied_q(q), ties.tied_v(v);
  if (task.robot.contacts.empty())
    file.child_or_empty("contacts")
        .problem("points", "'contacts.points' is missing; expected the links that stand on the floor");
}

void read_demands_of_mass(Section& file, CentroidalOptions& options) {
  Section block =
      file.about("the robot as a single mass on its feet (centroidal dynamics)").child("centroidal");
  options.is_level = block.about("keeps the height of the centre of mass constant")
                         .get_or("constant_height", options.is_level);
  options.zero_angular_momentum = block.about("keeps the angular momentum zero")
                                      .get_or("zero_angular_momentum", options.zero_angular_momentum);
  options.ends_at_rest = block.about("each plan ends at rest, in a stand that the feet can hold")
                             .get_or("end_at_rest", options.ends_at_rest);
  options.most_force = block.about("largest upward force of a foot [N]")
                           .get_or("max_force", options.most_force, io::or_infinite(io::positive()));
  Section costs = file.about("weights of the integrated costs").child_or_empty("costs");
  CentroidalOptions::Weights& w = options.weights;
  w.com = costs.about("weight of the squared distance from the target [1/m^2]")
              .get_or("com", w.com, io::not_negative());
  w.velocity = costs.about("weight of the squared velocity [s^2/m^2]")
                   .get_or("velocity", w.velocity, io::not_negative());
  w.angular = costs.about("weight of the squared angular momentum [1/(N m s)^2]")
                  .get_or("angular_momentum", w.angular, io::not_negative());
  w.force = costs
                .about(
                    "weight of the squared difference of each foot's force from its share of the robot's "
                    "weight [1/N^2]")
                .get_or("force", w.force, io::not_negative());
}

void read_keys(Section& file, TaskSpec& task, CentroidalOptions& options,
               const dynamics::Model<double>* model) {
  read_stand(file, task, model);
  read_demands_of_mass(file, options);
  task.gait = read_gait(file, Eigen::Index(task.robot.contacts.size()), model);
  Section horizon = file.about("horizon of a plan").child("horizon");
  options.duration = horizon.about("duration of a plan [s]").get<double>("duration", seconds());
  file.about("discretisation: how the motion becomes a nonlinear program").child_or_empty("transcription");
  task.optimise.mesh = read_mesh(file, WithLimitedMemory::kNo);
  const EvaluationKeys evaluation = read_evaluation(file, PointsAtOnce::kMany);
  task.optimise.mesh.evaluation = evaluation.options;
  task.optimise.mesh.threads = evaluation.threads;
  Section solver = file.about("options of the stage-wise solver of a plan").child_or_empty("solver");
  task.optimise.solver.tolerance =
      solver.about("tolerance of the scaled optimality error").get_or("tolerance", 1e-6, io::positive());
  task.optimise.solver.max_iterations = solver.about("largest number of iterations of a plan")
                                            .get_or("max_iterations", 300, io::not_negative());
  task.control = read_control(file, [](Section& push) {
    push.about("impulse at the centre of mass, in world axes [N s]");
    TaskSpec::Control::Disturbance hit;
    hit.impulse = read_vector3(push, "impulse", std::nullopt);
    return hit;
  });
}

}  // namespace

CentroidalTask read_centroidal_task(const std::string& path, const std::vector<io::Setting>& settings) {
  return read_centroidal_task_text(read_file(path), path, settings);
}

CentroidalTask read_centroidal_task_text(const std::string& text, const std::string& path,
                                         const std::vector<io::Setting>& settings) {
  check_is_no_robot(text, path, "an .info file that names its robot, as those in config/control do");
  check_file_kind(text, path, FileKind::kCentroidal);
  Section file = Section::parse(text, path, old_names(), settings);
  TaskSpec task;
  CentroidalOptions options;
  task.file = path;
  task.name = read_task_name(file, std::filesystem::path(path).stem().string());
  const bool known = take_robot(read_scene_robot(file, path, Floating::kAllowed), task, task.scene);
  read_keys(file, task, options, known ? &task.scene.model : nullptr);
  file.finish();
  note_left_out(task.notes, task.urdf, task.left_out, task.scene, LimitsOfFile::kHeld);
  note_old_names(task.notes, file);
  task.effective = file.effective_values();
  task.inputs = file.files();
  return build_centroidal_task(std::move(task), options);
}

CentroidalTask build_centroidal_task(TaskSpec spec, const CentroidalOptions& options) {
  CentroidalTask task{std::move(spec), options};
  const VectorXd q = task.start.head(task.scene.model.nq), v = task.start.tail(task.scene.model.nv);
  task.body = centroidal_body(task.scene, q, task.robot.contacts);
  task.problem = centroidal_problem(task.body, options);
  task.problem.name = task.name;
  task.problem.start = centroidal_state(task.scene, q, v);
  if (task.gait) walk(task.problem, task.body, *task.gait);
  return task;
}

std::vector<io::Question> centroidal_questions() {
  Section file = Section::catalogue();
  TaskSpec task;
  CentroidalOptions options;
  read_task_name(file, "its file's");
  read_scene_robot(file, "", Floating::kAllowed);
  read_keys(file, task, options, nullptr);
  return file.questions();
}

}  // namespace dyntape
