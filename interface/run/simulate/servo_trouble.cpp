// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/simulate/servo_trouble.h>

#include <cmath>

#include <dyntape/autodiff/factorisations.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

using Eigen::MatrixXd;

// x = (increments of q and v, torques of lagged motors), and what the motors are told of them.
class SampledServo {
 public:
  SampledServo(const Scene& scene, const MatrixXd& A, const MatrixXd& B) : duration_(scene.duration) {
    const Eigen::VectorXd& lag = scene.robot.lag;
    const auto n = A.rows(), n_u = B.cols(), n_m = Eigen::Index((lag.array() > 0).count());
    n_x_ = n + n_m;
    rates_ = MatrixXd::Zero(n_x_ + n_u, n_x_ + n_u);
    rates_.topLeftCorner(n, n) = A;
    told_ = MatrixXd::Zero(n_u, n_x_);
    const std::vector<int> dofs = actuated_dofs(scene.robot);
    for (Eigen::Index k = 0, m = n; k < n_u; ++k) {
      const Eigen::Index u = n_x_ + k;
      const bool lags = lag.size() > 0 && lag[k] > 0;
      rates_.col(lags ? m : u).head(n) = B.col(k);
      if (lags) rates_(m, m) = -1 / lag[k], rates_(m, u) = 1 / lag[k], ++m;
      told_(k, dofs[std::size_t(k)]) = -scene.commands.followed->stiffness[k];
      told_(k, n / 2 + dofs[std::size_t(k)]) = -scene.commands.followed->damping[k];
    }
  }

  struct Growth {
    int modes = 0;    // that are trouble
    double rate = 0;  // of the fastest (1/s)
  };
  Growth at(double h) const {
    constexpr double kHundredfold = 4.605170185988091, kRounded = 1e-9;
    const MatrixXd step = matrix_exponential(rates_ * h);
    const MatrixXd closed = step.topLeftCorner(n_x_, n_x_) + step.topRightCorner(n_x_, told_.rows()) * told_;
    Growth growth;
    if (!closed.allFinite()) return {int(n_x_), HUGE_VAL};
    for (const std::complex<double>& mode : eigenvalues(closed)) {
      const double rate = std::log(std::abs(mode)) / h;
      const bool alternates = mode.real() < 0 && std::abs(mode) > 1 + kRounded;
      if (!alternates && !(rate * duration_ > kHundredfold)) continue;
      ++growth.modes;
      growth.rate = std::max(growth.rate, rate);
    }
    return growth;
  }

 private:
  double duration_;
  Eigen::Index n_x_ = 0;
  MatrixXd rates_, told_;
};

}  // namespace

std::string servo_trouble(const Scene& scene, const MatrixXd& A, const MatrixXd& B) {
  constexpr double kShort = 1e-6;
  constexpr int kHalvings = 40;
  const SampledServo servo(scene, A, B);
  const SampledServo::Growth growth = servo.at(scene.step);
  const int own = growth.modes > 0 ? servo.at(kShort * scene.step).modes : 0;
  if (growth.modes <= own) return "";
  double holds = kShort * scene.step, grows = scene.step;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = std::sqrt(holds * grows);
    (servo.at(middle).modes > own ? grows : holds) = middle;
  }
  return "motors that follow a table get one command per step; with this stiffness and damping the error "
         "then grows at " +
         io::with_digits(growth.rate, 3) + " 1/s; they hold the robot in steps of at most " +
         io::with_digits(holds, 3) + " s; got steps of " + io::shortest(scene.step) + " s";
}

}  // namespace dyntape
