// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/simulate/motion_work.h>

namespace dyntape {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MotionWork::MotionWork(const Scene& scene, EnergyMeter& meter, Stepper& stepper, Take take)
    : scene_(scene),
      stepper_(stepper),
      take_(std::move(take)),
      of_steps_(scene, meter),
      rule_(is_adaptive(scene.integrator)                            ? Rule::kGauss
            : scene.commands.t.size() > 1 || scene.commands.followed ? Rule::kSimpson
                                                                     : Rule::kCubic),
      cubic_(scene.step, (meter.flows() + 1) * Eigen::Index(meter.mechanisms().size())),
      flows_(meter.flows() + 1),
      mechanisms_(Eigen::Index(meter.mechanisms().size())),
      middle_(stepper.nx()),
      work_(MatrixXd::Zero(flows_, mechanisms_)),
      of_step_(work_) {
  if (rule_ != Rule::kGauss) return;
  stepper.watch([this](const double* x, double weight) {
    middle_ = Eigen::Map<const VectorXd>(x, middle_.size());
    of_step_ += weight * of_steps_.at(middle_, u_);
  });
}

void MotionWork::append(const VectorXd& x) {
  const MatrixXd& powers = of_steps_.at(x, u_);
  cubic_.append(powers.reshaped(),
                [this](const VectorXd& work) { take_(work.reshaped(flows_, mechanisms_)); });
}

void MotionWork::start(const VectorXd& x) {
  u_ = scene_.commands.at(0, x);
  if (rule_ == Rule::kCubic) return append(x);
  take_(work_);
}

void MotionWork::before_step(const VectorXd& u) {
  u_ = u;
  of_step_.setZero();
}

void MotionWork::after_step(double t, const VectorXd& x, const VectorXd& next) {
  const double h = scene_.step;
  if (rule_ == Rule::kCubic) return append(next);
  if (rule_ == Rule::kSimpson) {
    if (!stepper_.step(t, h / 2, x.data(), u_.data(), nullptr, middle_.data())) middle_ = next;
    of_step_ = of_steps_.between({x, middle_, next}, u_, h);
  }
  work_ += of_step_;
  take_(work_);
}

void MotionWork::finish() {
  if (rule_ != Rule::kCubic) return;
  cubic_.finish([this](const VectorXd& work) { take_(work.reshaped(flows_, mechanisms_)); });
}

}  // namespace dyntape
