// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/simulate/step_work.h>

#include <cmath>

#include <dyntape/dynamics/model/configuration.h>

namespace dyntape {

using Eigen::MatrixXd;
using Eigen::VectorXd;

Eigen::Vector3d moments_of_decay(double z) {
  Eigen::Vector3d moments;
  if (z >= 1) {
    const double e = std::exp(-z);
    moments[0] = (1 - e) / z;
    for (int n = 1; n < 3; ++n) moments[n] = (n * moments[n - 1] - e) / z;
    return moments;
  }
  // The recurrence loses digits; the series has them after 20 terms.
  moments.setZero();
  double term = 1;
  for (int k = 0; k < 20; ++k) {
    for (int n = 0; n < 3; ++n) moments[n] += term / (n + k + 1);
    term *= -z / (k + 1);
  }
  return moments;
}

StepWork::StepWork(const Scene& scene, EnergyMeter& meter)
    : scene_(scene), meter_(meter), has_stage_(work_rule(scene) == WorkRule::kStage) {
  const auto& model = scene.robot.model;
  const std::vector<int> place = mechanism_of_joints(meter.layout().mechanisms, model.njoints());
  std::vector<int> of_dof(std::size_t(model.nv), 0);
  for (int i = 0; i < model.njoints(); ++i) {
    const auto& joint = model.joints[std::size_t(i)];
    for (int k = 0; k < dynamics::nv(joint.type); ++k)
      of_dof[std::size_t(joint.idx_v + k)] = place[std::size_t(i)];
  }
  Eigen::Index m = model.nq + model.nv;
  Eigen::Index k = 0;
  for (const int dof : actuated_dofs(scene.robot)) {
    const double lag = scene.robot.lag.size() > 0 ? scene.robot.lag[k++] : 0;
    motors_.push_back({dof, of_dof[std::size_t(dof)], lag, m});
    m += lag > 0;
  }
}

// moved: the end's configuration less the beginning's.
double StepWork::of_motor(std::size_t k, const States& x, const VectorXd& moved, double u, double h) const {
  const Motor& motor = motors_[k];
  const double of_command = u * moved[motor.dof];
  if (motor.lag == 0) return of_command;
  const Eigen::Index v = scene_.robot.model.nq + motor.dof;
  const double v_0 = x.begin[v], v_1 = x.middle[v], v_2 = x.end[v];
  const Eigen::Vector3d parabola(v_0, -3 * v_0 + 4 * v_1 - v_2, 2 * (v_0 - 2 * v_1 + v_2));
  return of_command + (x.begin[motor.in_x] - u) * h * parabola.dot(moments_of_decay(h / motor.lag));
}

StepWork::Stage StepWork::stage_of(const VectorXd& begin, const VectorXd& end, const VectorXd& u,
                                   double h) const {
  const auto& model = scene_.robot.model;
  const int nq = model.nq, nv = model.nv;
  const VectorXd mean = (begin.segment(nq, nv) + end.segment(nq, nv)) / 2;
  Stage stage{end, mean};  // motors are those at the end of the step
  if (scene_.integrator == Integrator::kImplicitVelocity) return stage;
  if (scene_.integrator == Integrator::kSemiImplicitEuler) {
    stage.x.head(nq + nv) = begin.head(nq + nv);
    return stage;
  }
  const VectorXd q = begin.head(nq), xi = dynamics::difference<double>(model, q, VectorXd(end.head(nq)));
  stage.along = xi / h;
  stage.x.head(nq) = dynamics::integrate<double>(model, q, VectorXd(xi / 2));
  stage.x.segment(nq, nv) = stage.along;
  for (std::size_t k = 0; k < motors_.size(); ++k) {
    const auto& [dof, mechanism, lag, in_x] = motors_[k];
    const double told = u[Eigen::Index(k)];
    if (lag > 0) stage.x[in_x] = told + (begin[in_x] - told) * std::exp(-h / 2 / lag);
  }
  return stage;
}

MatrixXd StepWork::between(const States& x, const VectorXd& u, double h, const VectorXd& p) {
  if (has_stage_) {
    const Stage stage = stage_of(x.begin, x.end, u, h);
    return h * meter_.along(stage.along, stage.x, u, p).unstored;
  }
  MatrixXd work = h / 6 * meter_.at(x.begin, u, p).unstored;
  work += 4 * h / 6 * meter_.at(x.middle, u, p).unstored;
  work += h / 6 * meter_.at(x.end, u, p).unstored;
  put_motors(x, u, h, work);
  return work;
}

void StepWork::put_motors(const States& x, const VectorXd& u, double h, MatrixXd& work) const {
  work.row(0).setZero();
  const auto& model = scene_.robot.model;
  const VectorXd moved =
      dynamics::difference<double>(model, VectorXd(x.begin.head(model.nq)), VectorXd(x.end.head(model.nq)));
  for (std::size_t k = 0; k < motors_.size(); ++k)
    work(0, motors_[k].mechanism) += of_motor(k, x, moved, u[Eigen::Index(k)], h);
}

MotionWork::MotionWork(const Scene& scene, EnergyMeter& meter, Stepper& stepper)
    : scene_(scene),
      stepper_(stepper),
      of_steps_(scene, meter),
      middle_(stepper.nx()),
      of_step_(MatrixXd::Zero(Eigen::Index(meter.layout().flows.size()),
                              Eigen::Index(meter.layout().mechanisms.size()))) {
  if (work_rule(scene) != WorkRule::kGauss) return;
  stepper.watch([this, &meter](const double* x, double weight) {
    middle_ = Eigen::Map<const VectorXd>(x, middle_.size());
    of_step_ += weight * meter.at(middle_, u_, p_).unstored;
  });
}

void MotionWork::before_step(const VectorXd& u, const VectorXd& p) {
  u_ = u, p_ = p;
  of_step_.setZero();
}

const MatrixXd& MotionWork::after_step(double t, const VectorXd& x, const VectorXd& next) {
  const double h = scene_.step;
  const bool has_middle = work_rule(scene_) == WorkRule::kSimpson;
  if (has_middle && !stepper_.step(t, h / 2, x.data(), u_.data(), p_.data(), middle_.data())) middle_ = next;
  if (has_middle || of_steps_.has_stage()) of_step_ = of_steps_.between({x, middle_, next}, u_, h, p_);
  return of_step_;
}

}  // namespace dyntape
