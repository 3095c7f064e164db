// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/simulate/stability.h>

#include <cmath>

#include <dyntape/autodiff/factorisations.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/run/simulate/servo_trouble.h>

namespace dyntape {

namespace {

using Complex = std::complex<double>;

// Along a ray into the left half plane the region of stability is met once: where it ends.
double runge_kutta_4_reach(const Complex& direction) {
  const auto grows = [&](double r) {
    const Complex z = r * direction;
    return std::abs(1. + z * (1. + z / 2. * (1. + z / 3. * (1. + z / 4.)))) > 1 + 1e-12;
  };
  double inside = 0, outside = 4;
  for (int i = 0; i < 50; ++i) {
    const double middle = (inside + outside) / 2;
    (grows(middle) ? outside : inside) = middle;
  }
  return inside;
}

// The longest step for modes of 1 rad/s or 1/s whatever their direction, a little less.
double longest_step_of_any(Integrator integrator) {
  constexpr int kDirections = 180;
  double least = HUGE_VAL;
  for (int k = 0; k <= kDirections; ++k)
    least =
        std::min(least, longest_step(integrator, std::polar(1.0, M_PI / 2 * (1 + double(k) / kDirections))));
  return 0.98 * least;
}

// By |A^n|^(1/n), which the spectral radius never exceeds (Gelfand), for n = 1, 2, 4, ... until it tells; at 32 it is within a
// tenth mostly.  False: perhaps not.
bool follows_every_mode(const Scene& scene, Eigen::MatrixXd A) {
  static const double euler = longest_step_of_any(Integrator::kSemiImplicitEuler),
                      runge_kutta = longest_step_of_any(Integrator::kRungeKutta4);
  const double longest = scene.integrator == Integrator::kRungeKutta4 ? runge_kutta : euler;
  const double size = A.norm();
  if (size == 0) return true;
  A /= size;
  double logarithm = 0;  // of the norm of (A / size)^n
  for (int n = 1;; n *= 2) {
    if (scene.step * size * std::exp(logarithm / n) <= longest) return true;
    if (n == 32) return false;
    A = (A * A).eval();
    const double norm = A.norm();
    if (norm == 0) return true;
    A /= norm;
    logarithm = 2 * logarithm + std::log(norm);
  }
}

// "" where the steps of the scene follow all of them.
std::string too_fast_mode(const Scene& scene, const Eigen::MatrixXd& A) {
  double longest = HUGE_VAL;
  Complex fastest = 0;
  for (const Complex& mode : eigenvalues(A)) {
    const double step = longest_step(scene.integrator, mode);
    if (step < longest) longest = step, fastest = mode;
  }
  if (scene.step <= longest) return "";
  const bool oscillates = std::abs(fastest.imag()) > std::abs(fastest.real());
  return std::string("the fastest motion ") + (oscillates ? "oscillates at " : "decays at ") +
         io::with_digits(std::abs(fastest), 3) + (oscillates ? " rad/s" : " 1/s") + ", which " +
         to_string(scene.integrator) + " follows in steps of at most " + io::with_digits(longest, 3) +
         " s; got steps of " + io::shortest(scene.step) +
         " s (implicit-midpoint and implicit-velocity take longer ones)";
}

}  // namespace

LinearMotion linear_motion(const RobotScene& scene, const Eigen::VectorXd& q, const Eigen::VectorXd& v) {
  dynamics::Data<double> data(scene.model);
  data.following = ties_of(scene).following<double>();
  dynamics::EffectTorques<double> torques(scene.model);
  const Eigen::Index n = scene.model.nv;
  const Eigen::VectorXd tau = Eigen::VectorXd::Zero(n);
  const std::vector<int> dofs = actuated_dofs(scene);
  LinearMotion motion{Eigen::MatrixXd(2 * n, 2 * n), Eigen::MatrixXd::Zero(2 * n, Eigen::Index(dofs.size()))};
  const auto set = [&](const auto& by_q, const auto& by_v, const auto& by_tau) {
    motion.A << Eigen::MatrixXd::Zero(n, n), Eigen::MatrixXd::Identity(n, n), by_q, by_v;
    const Eigen::VectorXd arrives = torques.driven_slope;
    for (std::size_t k = 0; k < dofs.size(); ++k)
      motion.B.col(Eigen::Index(k)).tail(n) = by_tau.col(dofs[k]) * arrives[dofs[k]];
  };
  dynamics::driving_torques<double>(scene.model, torques, scene.effects, tau);
  if (scene.constraints.loops.empty()) {
    dynamics::forward_dynamics_derivatives<double>(scene.model, data, torques, scene.effects, q, v, tau);
    set(data.ddq_dq, data.ddq_dv, data.Minv);
  } else {
    // Of what loops hold no stiffness is felt; that of the loops themselves is.
    dynamics::ConstraintData<double> loops(scene.model, scene.constraints.loops);
    dynamics::constrained_dynamics_derivatives<double>(scene.model, data, loops, torques, scene.effects, q, v,
                                                       tau);
    set(loops.ddq_dq, loops.ddq_dv, loops.ddq_dtau);
  }
  return motion;
}

double longest_step(Integrator integrator, Complex mode) {
  const double speed = std::abs(mode);
  // What grows, as a pendulum upside down does, is no matter of the step; rounding may push a pure oscillation there.
  if (speed == 0 || mode.real() > 1e-6 * speed) return HUGE_VAL;
  mode = {std::min(mode.real(), 0.0), mode.imag()};
  const double decay = -mode.real() / speed;
  if (integrator == Integrator::kSemiImplicitEuler)
    return (decay < 1 ? 2 * (std::hypot(1, decay) - decay) : 2) / speed;
  return integrator == Integrator::kRungeKutta4 ? runge_kutta_4_reach(mode / speed) / speed : HUGE_VAL;
}

std::string stability_trouble(const Scene& scene, const Eigen::VectorXd& q, const Eigen::VectorXd& v) {
  const bool follows_all = longest_step(scene.integrator, {-1, 0}) == HUGE_VAL;
  if (follows_all && !scene.commands.followed) return "";
  const LinearMotion motion = linear_motion(scene.robot, q, v);
  const Eigen::MatrixXd& A = motion.A;
  if (!A.allFinite())
    return follows_all ? "" : "the accelerations there, or their derivatives, are not finite";
  if (scene.commands.followed) {
    if (std::string trouble = servo_trouble(scene, A, motion.B); !trouble.empty()) return trouble;
  }
  if (follows_all) return "";
  if (follows_every_mode(scene, A)) return "";  // without its modes, which take ten times as long
  return too_fast_mode(scene, A);
}

}  // namespace dyntape
