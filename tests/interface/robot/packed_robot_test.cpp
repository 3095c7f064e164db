// SPDX-License-Identifier: BSD-3-Clause
//
// Algorithms on packs: every lane has the bits of one lane alone, on random robots and whatever other lanes hold.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/scalars/pack_eigen.h>
#include <dyntape/dynamics/effects/effects.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/interface/robot/robot_rows.h>
#include "dynamics/random_robots.h"
#include "packed.h"

namespace dyntape::packed_robot_test {
namespace {

using namespace dynamics;  // NOLINT: the tests speak its language
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Pack1 = Pack<double, 1>;  // one_lane.cpp instantiates the algorithms for it

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) ||
         (std::isnan(a) && std::isnan(b));
}

const dyntape::detail::RobotRow<Pack1>& row_of(const RobotFunction& function) {
  return dyntape::detail::robot_rows<Pack1>()[static_cast<std::size_t>(function.row())];
}

MatrixXd random_states(const Model<double>& model, const RobotFunction& function, int count, Random& random) {
  const int behind = dyntape::detail::inputs_behind_q(row_of(function).inputs);
  MatrixXd states(model.nq + behind * model.nv, count);
  for (int k = 0; k < count; ++k) {
    states.col(k) << random_configuration(model, random.engine), random.vector(behind * model.nv, 3);
  }
  return states;
}

std::vector<Model<double>> robots(Random& random) {
  std::vector<Model<double>> all;
  for (int k = 0; k < 3; ++k) {
    all.push_back(random_tree(random, {.joints = 7, .base = k % 2 ? Base::kFloating : Base::kFixed}));
  }
  all.push_back(random_tree(random, {.joints = 9, .base = Base::kFloating, .inner_free_flyers = true}));
  all.push_back(random_tree(random, {.joints = 1}));
  return all;
}

// One state in one lane, through the same templates.
VectorXd alone(const Model<double>& model, const RobotFunction& function, const VectorXd& state) {
  const Model<Pack1> m = model.cast<Pack1>();
  dyntape::detail::RobotWorkspace<Pack1> work(m, function);
  const VectorX<Pack1> x = state.cast<Pack1>();
  std::vector<Pack1> y(work.n_out());
  work.evaluate(x.data(), y.data());
  VectorXd result(static_cast<Eigen::Index>(y.size()));
  for (std::size_t i = 0; i < y.size(); ++i) result[static_cast<Eigen::Index>(i)] = y[i][0];
  return result;
}

void expect_same_bits(const VectorXd& a, const VectorXd& b, const char* what) {
  ASSERT_EQ(a.size(), b.size());
  for (Eigen::Index i = 0; i < a.size(); ++i) {
    ASSERT_TRUE(same_bits(a[i], b[i])) << what << " entry " << i << ": " << a[i] << " and " << b[i];
  }
}

TEST(PackedRobot, EveryLaneHasTheBitsOfOneLaneForAnyCountAndWidth) {
  Random random(1);
  for (const Model<double>& model : robots(random)) {
    for (const RobotFunction& function : robot_functions()) {
      SCOPED_TRACE(to_string(function));
      const MatrixXd states = random_states(model, function, 11, random);
      std::vector<VectorXd> expected;
      for (int k = 0; k < 11; ++k) expected.push_back(alone(model, function, states.col(k)));
      for (int lanes : {4, 8}) {
        PackedRobot packed(model, function, lanes);
        ASSERT_EQ(packed.n_in(), static_cast<std::size_t>(states.rows()));
        for (int count : {1, 11}) {
          MatrixXd results = MatrixXd::Constant(static_cast<Eigen::Index>(packed.n_out()), 12, -7);
          packed.evaluate(states.data(), static_cast<std::size_t>(count), results.data());
          for (int k = 0; k < count; ++k) expect_same_bits(results.col(k), expected[k], to_string(function));
          EXPECT_TRUE((results.rightCols(12 - count).array() == -7).all()) << "written beyond the last state";
        }
      }
    }
  }
}

TEST(PackedRobot, AgreesWithPlainDouble) {
  Random random(2);
  for (const Model<double>& model : robots(random)) {
    for (const RobotFunction& function : robot_functions()) {
      const MatrixXd states = random_states(model, function, 5, random);
      const MatrixXd results = evaluate_packed(model, function, states);
      for (int k = 0; k < 5; ++k) {
        EXPECT_LT(relative_error(results.col(k), evaluate_analytic(model, function, states.col(k))), 1e-12)
            << to_string(function);
      }
    }
  }
}

TEST(PackedRobot, ANanStaysInItsLane) {
  Random random(3);
  int spoilt_results = 0;  // not all: matrices of a single joint do not depend on its state
  for (const Model<double>& model : robots(random)) {
    for (const RobotFunction& function : robot_functions()) {
      const MatrixXd states = random_states(model, function, 8, random);
      const MatrixXd clean = evaluate_packed(model, function, states);
      MatrixXd spoilt = states;
      for (int k : {2, 5}) spoilt.col(k).setConstant(std::numeric_limits<double>::quiet_NaN());
      const MatrixXd results = evaluate_packed(model, function, spoilt);
      spoilt_results += results.col(2).hasNaN();
      for (int k : {0, 1, 3, 4, 6, 7}) expect_same_bits(results.col(k), clean.col(k), to_string(function));
    }
  }
  EXPECT_GT(spoilt_results, 100);
}

// What PackedRobot does not reach: tangents with their selections, effects, kinematics.
TEST(PackedRobot, ConfigurationsEffectsAndKinematicsHaveTheBitsOfOneLane) {
  Random random(4);
  for (const Model<double>& model : robots(random)) {
    Effects<double> plain;
    plain.damping = model_damping(model);
    plain.friction = CoulombFriction<double>{model_friction(model), 0.01};
    const int frame = static_cast<int>(model.frames.size()) - 1;
    const auto all = [&](auto zero, const std::vector<State>& states) {
      using P = decltype(zero);
      const Model<P> m = model.cast<P>();
      Data<P> data(m);
      EffectTorques<P> torques(m);
      VectorX<P> q(model.nq), q1(model.nq), v(model.nv), a(model.nv);
      for (int k = 0; k < P::kLanes; ++k) {
        for (int i = 0; i < model.nq; ++i) q[i].set(k, states[k].q[i]), q1[i].set(k, states[k + 8].q[i]);
        for (int i = 0; i < model.nv; ++i) v[i].set(k, states[k].v[i]), a[i].set(k, states[k].a[i]);
      }
      v[0] *= P(1e-9);  // both sides of the series
      const Effects<P> effects = plain.cast<P>();
      std::vector<P> out;
      const auto keep = [&](const auto& x) {
        for (Eigen::Index j = 0; j < x.cols(); ++j) {
          for (Eigen::Index i = 0; i < x.rows(); ++i) out.push_back(x(i, j));
        }
      };
      keep(integrate<P>(m, q, v));
      keep(difference<P>(m, q, q1));
      keep(integrate_jacobians<P>(m, v).second);
      keep(difference_jacobians<P>(m, v).second);
      keep(forward_dynamics<P>(m, data, torques, effects, q, v, a));
      forward_dynamics_derivatives<P>(m, data, torques, effects, q, v, a);
      keep(data.ddq_dq);
      keep(data.ddq_dv);
      forward_kinematics<P>(m, data, q, v, a);
      keep(frame_velocity<P>(m, data, frame, ReferenceFrame::kWorld).vector());
      keep(frame_classical_acceleration<P>(m, data, frame, ReferenceFrame::kLocalWorldAligned).vector());
      keep(frame_jacobian<P>(m, data, q, frame, ReferenceFrame::kLocal));
      keep(generalized_gravity<P>(m, data, q));
      out.push_back(kinetic_energy<P>(m, data, q, v));
      out.push_back(potential_energy<P>(m, data, q));
      return out;
    };
    std::vector<State> states;
    for (int k = 0; k < 16; ++k) states.push_back(random_state(model, random));
    const auto eight = all(Pack8(), states);
    const auto four = all(Pack4(), states);
    for (int k = 0; k < 8; ++k) {
      std::vector<State> one(states.begin() + k, states.end());
      one.resize(9);
      one[8] = states[k + 8];
      const auto single = all(Pack1(), one);
      ASSERT_EQ(single.size(), eight.size());
      for (std::size_t i = 0; i < single.size(); ++i) {
        ASSERT_TRUE(same_bits(single[i][0], eight[i][k])) << "entry " << i << " lane " << k;
        if (k < 4) {
          ASSERT_TRUE(same_bits(single[i][0], four[i][k])) << "entry " << i << " lane " << k;
        }
      }
    }
  }
}

TEST(PackedRobot, RefusesWhatItCannotDo) {
  Random random(5);
  const Model<double> model = random_tree(random, {.joints = 3});
  EXPECT_THROW(PackedRobot(model, RobotFunction::kRnea, 3), ArgumentError);
  EXPECT_EQ(
      evaluate_packed(model, RobotFunction::kRnea, random_states(model, RobotFunction::kRnea, 0, random))
          .cols(),
      0);
}

}  // namespace
}  // namespace dyntape::packed_robot_test
