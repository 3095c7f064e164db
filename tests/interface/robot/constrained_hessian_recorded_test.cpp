// SPDX-License-Identifier: BSD-3-Clause
//
// Second derivatives of constrained dynamics on the tape: the analytic ones against those of the recorded value, which
// share nothing with them, and constrained dynamics as a callee.
#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/eigen.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/dynamics/contact/constrained_hessian.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/robot_callee.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <map>

#include "autodiff/random.h"
#include "dynamics/random_robots.h"
#include "dynamics/robot_files.h"

namespace dyntape::constrained_hessian_recorded_test {
namespace {

using dynamics::Base;
using dynamics::Constraint;
using dynamics::ConstraintData;
using dynamics::Data;
using dynamics::Model;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Constraints = std::vector<Constraint<double>>;

std::vector<double> list(const VectorXd& x) { return {x.begin(), x.end()}; }

RecordOptions without_branches() {
  RecordOptions options;
  options.branches = RecordOptions::Branches::kError;
  return options;
}

// A robot and what holds it.
struct Held {
  const char* name;
  Model<double> model;
  Constraints constraints;
};

// Constrained dynamics on the tape at q = q0 (+) d.
struct Taped {
  Taped(const Held& held, const VectorXd& q0)
      : model(held.model.cast<AD>()), data(model), c(model, cast(held)) {
    c.independent = true;
    q = q0.cast<AD>();
  }
  static std::vector<Constraint<AD>> cast(const Held& held) {
    std::vector<Constraint<AD>> all;
    for (const auto& constraint : held.constraints) all.push_back(constraint.cast<AD>());
    return all;
  }
  VectorXad at(const VectorXad& d) const { return dynamics::integrate<AD>(model, q, d); }

  Model<AD> model;
  Data<AD> data;
  ConstraintData<AD> c;
  VectorXad q;
};

// (d, v, tau) -> (ddq, lambda)
Function record_value(const Held& held, const VectorXd& q) {
  const long n = held.model.nv;
  return record(
      "value", static_cast<std::size_t>(3 * n),
      [&](const VectorXad& x) {
        Taped t(held, q);
        dynamics::constrained_dynamics<AD>(t.model, t.data, t.c, t.at(x.head(n)), x.segment(n, n), x.tail(n));
        VectorXad y(n + t.c.lambda.size());
        y << t.c.ddq, t.c.lambda;
        return y;
      },
      without_branches());
}

// (d, v, tau, mu, nu) -> the slopes of mu^T ddq + nu^T lambda
Function record_gradient(const Held& held, const VectorXd& q, long rows) {
  const long n = held.model.nv;
  return record(
      "gradient", static_cast<std::size_t>(4 * n + rows),
      [&](const VectorXad& x) {
        Taped t(held, q);
        dynamics::constrained_dynamics_derivatives<AD>(t.model, t.data, t.c, t.at(x.head(n)), x.segment(n, n),
                                                       x.segment(2 * n, n));
        const VectorXad mu = x.segment(3 * n, n), nu = x.tail(rows);
        VectorXad g(3 * n);
        g << t.c.ddq_dq.transpose() * mu + t.c.lambda_dq.transpose() * nu,
            t.c.ddq_dv.transpose() * mu + t.c.lambda_dv.transpose() * nu,
            t.c.ddq_dtau.transpose() * mu + t.c.lambda_dtau.transpose() * nu;
        return g;
      },
      without_branches());
}

// (q, v, tau, mu, nu) -> H
Function record_hessian(const Held& held, long rows) {
  const long nq = held.model.nq, n = held.model.nv;
  return record(
      "hessian", static_cast<std::size_t>(nq + 3 * n + rows),
      [&](const VectorXad& x) {
        Taped t(held, VectorXd::Zero(nq));
        dynamics::ConstrainedHessian<AD> second(t.model, t.c);
        const VectorXad q = x.head(nq), v = x.segment(nq, n), tau = x.segment(nq + n, n),
                        mu = x.segment(nq + 2 * n, n), nu = x.tail(rows);
        return VectorXad(
            dynamics::constrained_hessian<AD>(t.model, t.data, t.c, second, q, v, tau, mu, nu).reshaped());
      },
      without_branches());
}

long rows_of(const Held& held) {
  long rows = 0;
  for (const auto& constraint : held.constraints) rows += constraint.rows;
  return rows;
}

Constraints at_frames(const Model<double>& model, const std::vector<const char*>& frames, int rows) {
  Constraints all;
  for (const char* name : frames) {
    const int frame = model.frame_index(name);
    all.push_back(rows == 3 ? dynamics::point_constraint(model, frame, {0.1, 0.2, -0.1})
                            : dynamics::frame_constraint(model, frame, {}));
  }
  return all;
}

Held held_robot(const std::string& name) {
  const auto load = [](const char* file, Base base) {
    return dynamics::load_urdf(dynamics::robot_file(file), {.base = base});
  };
  if (name == "ur5_tip") {
    const Model<double> arm = load("ur5", Base::kFixed);
    return {"ur5, tip", arm, at_frames(arm, {"tool0"}, 3)};
  }
  if (name == "panda_weld") {
    const Model<double> arm = load("panda", Base::kFixed);
    return {"panda, welded", arm, at_frames(arm, {"panda_link8"}, 6)};
  }
  const Model<double> dog = load("solo12", Base::kFloating);
  if (name == "solo12_two") return {"solo12, two feet", dog, at_frames(dog, {"FL_FOOT", "HR_FOOT"}, 3)};
  return {"solo12, four feet", dog, at_frames(dog, {"FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"}, 3)};
}

class RecordedConstrainedHessian : public ::testing::TestWithParam<const char*> {
 protected:
  RecordedConstrainedHessian() : held(held_robot(GetParam())), random(3) {
    const dynamics::State s = dynamics::random_state(held.model, random);
    q = s.q, v = s.v, tau = s.tau;
    mu = random.vector(held.model.nv), nu = random.vector(rows_of(held));
  }

  MatrixXd plain() const {
    Data<double> data(held.model);
    ConstraintData<double> c(held.model, held.constraints);
    dynamics::ConstrainedHessian<double> second(held.model, c);
    return dynamics::constrained_hessian(held.model, data, c, second, q, v, tau, mu, nu);
  }

  Held held;
  dynamics::Random random;
  VectorXd q, v, tau, mu, nu;
};

double error(const MatrixXd& got, const MatrixXd& expected) {
  return (got - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff();
}

TEST_P(RecordedConstrainedHessian, AgreesWithTheTapesOwn) {
  const long n = held.model.nv;
  VectorXd x(3 * n), w(n + nu.size());
  x << VectorXd::Zero(n), v, tau;
  w << mu, nu;
  const SparseFunction h = sparse_hessian(record_value(held, q));
  const std::vector<double> entries = evaluate(h.function, list(x), {}, list(w));
  MatrixXd tape = MatrixXd::Zero(3 * n, 3 * n);
  for (std::size_t k = 0; k < entries.size(); ++k) {
    tape(h.pattern.row[k], h.pattern.col[k]) = tape(h.pattern.col[k], h.pattern.row[k]) = entries[k];
  }
  EXPECT_LE(error(plain(), tape), 1e-10);
}

TEST_P(RecordedConstrainedHessian, IsRecordable) {
  const Function f = record_hessian(held, nu.size());
  VectorXd x(q.size() + 3 * v.size() + nu.size());
  x << q, v, tau, mu, nu;
  const std::vector<double> y = evaluate(f, list(x));
  const MatrixXd H = plain();
  EXPECT_LE(error(Eigen::Map<const MatrixXd>(y.data(), H.rows(), H.cols()), H), 1e-10);
}

// Of the three ways to a contracted Hessian.
TEST_P(RecordedConstrainedHessian, TakesFewerOperations) {
  const std::size_t analytic = total_operations(record_hessian(held, nu.size())),
                    slopes = total_operations(sparse_jacobian(record_gradient(held, q, nu.size())).function),
                    twice = total_operations(sparse_hessian(record_value(held, q)).function);
  std::printf("%-18s analytic %zu, slopes of the first derivatives %zu, value derived twice %zu\n", held.name,
              analytic, slopes, twice);
  EXPECT_LT(analytic, twice);
  EXPECT_LT(analytic, slopes);
}

INSTANTIATE_TEST_SUITE_P(Robots, RecordedConstrainedHessian,
                         ::testing::Values("ur5_tip", "panda_weld", "solo12_two", "solo12_four"));

}  // namespace
}  // namespace dyntape::constrained_hessian_recorded_test
