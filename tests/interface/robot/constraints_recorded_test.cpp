// SPDX-License-Identifier: BSD-3-Clause
//
// Constrained dynamics on the tape: the recorded value differentiated through the solve, and the recorded
// analytic derivatives, against the analytic ones in plain double.
#include <gtest/gtest.h>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/eigen.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/contact/constraints.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>

#include <random>

#include "source_folder.h"

namespace dyntape::constraints_recorded_test {
namespace {

using dynamics::Constraint;
using dynamics::ConstraintData;
using dynamics::Data;
using dynamics::Model;
using Eigen::MatrixXd;
using Eigen::VectorXd;

std::vector<double> list(const VectorXd& x) { return {x.begin(), x.end()}; }

struct Quadruped {
  Quadruped() {
    model = dynamics::load_urdf(test::source_folder() + "/config/robots/solo12.urdf",
                                {.base = dynamics::Base::kFloating});
    std::mt19937_64 random(4);
    const auto uniform = [&](long n, double size) {
      return VectorXd(VectorXd::NullaryExpr(
          n, [&] { return size * (static_cast<double>(random() >> 11) * 0x1p-52 - 1); }));
    };
    q = dynamics::random_configuration(model, random);
    v = uniform(model.nv, 1);
    tau = uniform(model.nv, 3);
    for (const char* name : {"FL_FOOT", "HR_FOOT"}) {
      feet.push_back(dynamics::point_constraint(model, model.frame_index(name), uniform(3, 1)));
    }
    feet.push_back(
        dynamics::loop_constraint(model, model.frame_index("FR_FOOT"), model.frame_index("HL_FOOT"), 3));
  }

  // (ddq, lambda) along (dq, v, tau), q = q0 (+) dq.
  VectorXad value(const VectorXad& x, bool independent) const {
    const Model<AD> taped = model.cast<AD>();
    Data<AD> data(taped);
    std::vector<Constraint<AD>> constraints;
    for (const auto& foot : feet) constraints.push_back(foot.cast<AD>());
    ConstraintData<AD> c(taped, constraints);
    c.independent = independent;
    const long n = model.nv;
    const VectorXad q_x = dynamics::integrate<AD>(taped, q.cast<AD>(), x.head(n));
    dynamics::constrained_dynamics<AD>(taped, data, c, q_x, x.segment(n, n), x.tail(n));
    VectorXad y(n + c.lambda.size());
    y << c.ddq, c.lambda;
    return y;
  }

  VectorXd at() const {
    VectorXd x(3 * model.nv);
    x << VectorXd::Zero(model.nv), v, tau;
    return x;
  }

  // d(ddq, lambda)/d(q, v, tau), analytic.
  MatrixXd analytic() const {
    Data<double> data(model);
    ConstraintData<double> c(model, feet);
    dynamics::constrained_dynamics_derivatives(model, data, c, q, v, tau);
    const long n = model.nv, m = c.lambda.size();
    MatrixXd all(n + m, 3 * n);
    all << c.ddq_dq, c.ddq_dv, c.ddq_dtau, c.lambda_dq, c.lambda_dv, c.lambda_dtau;
    return all;
  }

  Model<double> model;
  std::vector<Constraint<double>> feet;
  VectorXd q, v, tau;
};

RecordOptions without_branches() {
  RecordOptions options;
  options.branches = RecordOptions::Branches::kError;
  return options;
}

MatrixXd recorded_jacobian(const Quadruped& robot, bool independent) {
  const VectorXd x = robot.at();
  const Function f = record(
      "constrained", static_cast<std::size_t>(x.size()),
      [&](const VectorXad& input) { return robot.value(input, independent); }, without_branches());
  const Derivatives d = derive(f, Order::kFirst);
  const std::vector<double> all = evaluate(d.function, list(x));
  MatrixXd j = MatrixXd::Zero(static_cast<long>(f.n_y()), x.size());
  for (std::size_t k = 0; k < d.jacobian.nnz(); ++k) j(d.jacobian.row[k], d.jacobian.col[k]) = all[d.n_y + k];
  return j;
}

double error(const MatrixXd& got, const MatrixXd& expected) {
  return (got - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff();
}

TEST(RecordedConstraints, DerivativeThroughTheSolve) {
  Quadruped robot;
  EXPECT_LE(error(recorded_jacobian(robot, true), robot.analytic()), 1e-10);
}

// With a foot written twice the acceleration, and the force of least norm, have the same derivatives.
TEST(RecordedConstraints, DerivativeThroughADependentSolve) {
  Quadruped robot;
  robot.feet = {robot.feet[0], robot.feet[2], robot.feet[0]};
  EXPECT_LE(error(recorded_jacobian(robot, false), robot.analytic()), 1e-10);
}

TEST(RecordedConstraints, AnalyticDerivatives) {
  const Quadruped robot;
  const VectorXd x = robot.at();
  const long n = robot.model.nv;
  const Function f = record(
      "constrained derivatives", static_cast<std::size_t>(x.size()),
      [&](const VectorXad& input) {
        const Model<AD> taped = robot.model.cast<AD>();
        Data<AD> data(taped);
        std::vector<Constraint<AD>> constraints;
        for (const auto& foot : robot.feet) constraints.push_back(foot.cast<AD>());
        ConstraintData<AD> c(taped, constraints);
        const VectorXad q = dynamics::integrate<AD>(taped, robot.q.cast<AD>(), input.head(n));
        dynamics::constrained_dynamics_derivatives<AD>(taped, data, c, q, input.segment(n, n), input.tail(n));
        return VectorXad(c.ddq_dq.reshaped());
      },
      without_branches());
  const std::vector<double> y = evaluate(f, list(x));
  const MatrixXd got = Eigen::Map<const MatrixXd>(y.data(), n, n);
  EXPECT_LE(error(got, robot.analytic().topLeftCorner(n, n)), 1e-11);
}

}  // namespace
}  // namespace dyntape::constraints_recorded_test
