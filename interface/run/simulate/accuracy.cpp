// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/simulate/accuracy.h>

#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/run/simulate/scene_start.h>
#include <dyntape/interface/run/simulate/simulate.h>

namespace dyntape {

namespace {

using Eigen::VectorXd;

constexpr double kNearby = 1e-8;

// Each step in so many parts, with the commands of the whole step.
struct PartedSteps {
  bool step(const StepTime& s, const VectorXd& u) {
    const double h = s.h / parts;
    for (int part = 0; part < parts; ++part) {
      if (!motion.step({s.k, s.t + part * h, h}, u)) return false;
      motion.advance();
    }
    return true;
  }
  void advance() {}

  RobotStepper& motion;
  int parts;
};

// A motion without its energies: states halfway and at the end.
class BareRun {
 public:
  BareRun(const Scene& scene, const Tolerances& tolerances, const std::stop_token& stop)
      : scene_(scene),
        stop_(stop),
        motion_(scene.robot, scene.integrator, with_stop(scene.evaluation, stop), tolerances) {}

  struct States {
    VectorXd halfway, end;
  };
  // Each step in so many parts.  ArgumentError where one is not made.
  States from(const VectorXd& x, int parts) {
    motion_.start(x);
    halfway_.resize(0);
    PartedSteps parted{motion_, parts};
    const auto commands = [&](const StepTime& s) { return scene_.commands.at(s.t + s.h / 2, motion_.x()); };
    if (run(parted, {.to = scene_.steps(), .h = scene_.step}, commands, *this) < scene_.steps())
      throw ArgumentError(stop_.stop_requested() ? "interrupted" : motion_.why());
    return {halfway_, motion_.x()};
  }

  bool goes_on(const StepTime& s) {
    if (s.k == scene_.steps() / 2) halfway_ = motion_.x();
    return !stop_.stop_requested();
  }

 private:
  static CodegenOptions with_stop(CodegenOptions options, const std::stop_token& stop) {
    options.stop = stop;
    return options;
  }

  const Scene& scene_;
  std::stop_token stop_;
  RobotStepper motion_;
  VectorXd halfway_;
};

// (2 nv) increments from a to b: of q in its moving frame, and of v.
VectorXd apart(const Scene& scene, const VectorXd& a, const VectorXd& b) {
  const auto& model = scene.robot.model;
  VectorXd d(2 * model.nv);
  d << dynamics::difference<double>(model, VectorXd(a.head(model.nq)), VectorXd(b.head(model.nq))),
      b.segment(model.nq, model.nv) - a.segment(model.nq, model.nv);
  return d;
}

// A start nearby: every joint, by the same amount in positions and in velocities.
VectorXd nearby(const Scene& scene, const VectorXd& x) {
  const auto& model = scene.robot.model;
  VectorXd moved = x;
  moved.head(model.nq) = dynamics::integrate<double>(model, VectorXd(x.head(model.nq)),
                                                     VectorXd(VectorXd::Constant(model.nv, kNearby)));
  moved.segment(model.nq, model.nv).array() += kNearby;
  const Ties ties = ties_of(scene.robot);
  moved.head(model.nq) = ties.tied_q(VectorXd(moved.head(model.nq)));
  moved.segment(model.nq, model.nv) = ties.tied_v(VectorXd(moved.segment(model.nq, model.nv)));
  return moved;
}

// Whether increment k of a joint is a displacement: of sliders, and the first ones of joints that also slide.
bool slides(const dynamics::Joint<double>& joint, int k) {
  using dynamics::JointType;
  if (joint.type == JointType::kPrismatic) return true;
  if (joint.type == JointType::kPlanar) return k < 2;
  return joint.type == JointType::kFreeFlyer && k < 3;
}

EndError largest(const Scene& scene, const VectorXd& d, const char* per) {
  EndError most;
  for (const auto& joint : scene.robot.model.joints) {
    for (int k = 0; k < dynamics::nv(joint.type); ++k) {
      const double value = std::abs(d[joint.idx_v + k]);
      if (most.joint.empty() || value > most.value)
        most = {value, joint.name, (slides(joint, k) ? "m" : "rad") + std::string(per)};
    }
  }
  return most;
}

int order_of(const Scene& scene) {
  if (!scene.robot.constraints.rigid.empty()) return 1;
  switch (scene.integrator) {
    case Integrator::kSemiImplicitEuler:
    case Integrator::kImplicitVelocity:
      return 1;
    case Integrator::kImplicitMidpoint:
    case Integrator::kVariational:
      return 2;
    case Integrator::kRungeKutta4:
    case Integrator::kAdaptive:
    case Integrator::kAdaptiveStiff:
      break;
  }
  return 4;
}

}  // namespace

Accuracy accuracy_of(const Scene& scene, const std::stop_token& stop) {
  Accuracy accuracy;
  try {
    check_start(scene);
    BareRun run(scene, scene.tolerances, stop);
    const VectorXd start = start_of(scene).x;
    const BareRun::States as_it_is = run.from(start, 1);
    BareRun::States finer;
    if (is_adaptive(scene.integrator)) {
      constexpr double kTighter = 0.01;
      const Tolerances tight{std::max(kTighter * scene.tolerances.relative, Tolerances::kLeastRelative),
                             kTighter * scene.tolerances.absolute};
      finer = BareRun(scene, tight, stop).from(start, 1);
    } else {
      finer = run.from(start, 2);
    }
    const BareRun::States beside = run.from(nearby(scene, start), 1);
    const int nv = scene.robot.model.nv;
    const double p = std::pow(2.0, order_of(scene));
    const VectorXd off = p / (p - 1) * apart(scene, as_it_is.end, finer.end);
    accuracy.q = largest(scene, off.head(nv), "");
    accuracy.v = largest(scene, off.tail(nv), "/s");
    const double halfway = apart(scene, as_it_is.halfway, beside.halfway).cwiseAbs().maxCoeff() / kNearby;
    accuracy.apart = apart(scene, as_it_is.end, beside.end).cwiseAbs().maxCoeff() / kNearby;
    // In proportion to time it would be twice what it was halfway; what fills its room grows no more.
    constexpr double kMany = 1e3, kFaster = 8, kFull = 1e6;
    accuracy.parts = (accuracy.apart > kMany && accuracy.apart > kFaster * halfway) || accuracy.apart > kFull;
  } catch (const ArgumentError& e) {
    accuracy.trouble = e.what();
  }
  return accuracy;
}

std::string Accuracy::sentence() const {
  if (!trouble.empty()) return "there is no estimate of the error at the end: " + trouble;
  std::string text = "the end is off by about " + io::with_digits(q.value, 2) + " " + q.unit + " at '" +
                     q.joint + "' and " + io::with_digits(v.value, 2) + " " + v.unit + " at '" + v.joint +
                     "'";
  if (parts) {
    text += "; nearby motions part, by a factor of " + io::with_digits(apart, 2) +
            " until then: so does what steps and rounding are off by, and no step is short enough for long";
  }
  return text;
}

}  // namespace dyntape
