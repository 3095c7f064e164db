// SPDX-License-Identifier: BSD-3-Clause
//
// Every effect on the tape: the same numbers, derivatives that share no line with the analytic ones, and no trace of
// what is not chosen.
#include <gtest/gtest.h>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/interface/robot/robot_functions.h>

#include "dynamics/all_effects.h"

namespace dyntape::effects_recorded_test {
namespace {

using namespace dynamics;  // NOLINT: the tests speak its language
using Eigen::MatrixXd;
using Eigen::VectorXd;

std::vector<double> joined(const VectorXd& a, const VectorXd& b, const VectorXd& c) {
  std::vector<double> x(a.begin(), a.end());
  x.insert(x.end(), b.begin(), b.end());
  x.insert(x.end(), c.begin(), c.end());
  return x;
}

VectorXd vector_of(const std::vector<double>& x) {
  return VectorXd::Map(x.data(), static_cast<long>(x.size()));
}

class RecordedEffects : public ::testing::TestWithParam<unsigned long> {
 protected:
  RecordedEffects() : random(GetParam()) {
    model = random_tree(random, {4, GetParam() % 2 ? Base::kFloating : Base::kFixed});
    effects = all_effects(model, random);
    // Along an axis: Eigen adds a tilted one's products in another order than a recording.
    effects.gravity.vector = Vector3<double>(0, 0, -1.62);
    if (GetParam() % 3 == 0) effects.saturation->kind = SaturationKind::kHard;
    s = random_state(model, random);
  }

  // d ddq / d(v, command) of the recording; seeds along a tangent of q are left to the analytic tests.
  MatrixXd slopes_by_tape(const Function& f, const VectorXd& v) const {
    const Function slope = jvp(f);
    const int n = model.nq + 2 * model.nv;
    MatrixXd J(model.nv, 2 * model.nv);
    for (int k = 0; k < 2 * model.nv; ++k) {
      std::vector<double> seed(static_cast<std::size_t>(n), 0);
      seed[static_cast<std::size_t>(model.nq + k)] = 1;
      J.col(k) = vector_of(evaluate(slope, joined(s.q, v, s.tau), {}, seed));
    }
    return J;
  }

  Random random;
  Model<double> model;
  Effects<double> effects;
  State s;
};

TEST_P(RecordedEffects, AreTheEffects) {
  Data<double> data(model);
  EffectTorques<double> torques(model);
  for_each_effect_alone(effects, [&](const char* name, const Effects<double>& alone) {
    SCOPED_TRACE(name);
    const VectorXd forward = forward_dynamics(model, data, torques, alone, s.q, s.v, s.tau),
                   recorded =
                       vector_of(evaluate(record_forward_dynamics(model, alone), joined(s.q, s.v, s.tau)));
    EXPECT_EQ(recorded, forward);
    const VectorXd inverse = inverse_dynamics(model, data, torques, alone, s.q, s.v, s.a),
                   needed = vector_of(evaluate(record_inverse_dynamics(model, alone), joined(s.q, s.v, s.a)));
    EXPECT_EQ(needed, inverse);
  });
}

// At rest as well, where roots and quotients of drag and friction could be infinite.
TEST_P(RecordedEffects, HaveTheSlopesOfTheTape) {
  Data<double> data(model);
  EffectTorques<double> torques(model);
  const Function f = record_forward_dynamics(model, effects);
  for (const VectorXd& v : {s.v, VectorXd::Zero(model.nv).eval()}) {
    const MatrixXd J = slopes_by_tape(f, v);
    forward_dynamics_derivatives(model, data, torques, effects, s.q, v, s.tau);
    EXPECT_LE(relative_error(data.ddq_dv, J.leftCols(model.nv)), 1e-11);
    const MatrixXd by_command = data.Minv * torques.driven_slope.asDiagonal();
    EXPECT_LE(relative_error(by_command, J.rightCols(model.nv)), 1e-11);
  }
}

// Chosen and taken away again, each leaves the recording of a scene that never had it.
TEST_P(RecordedEffects, LeaveNothingWhereTheyAreNotChosen) {
  const Effects<double> none;
  const Function bare = record_forward_dynamics(model, none);
  Effects<double> emptied = effects;
  for_each_effect(emptied, [](auto& effect) { effect.reset(); });
  emptied.gravity = true, emptied.gravity.vector.reset(), emptied.coriolis = true;
  EXPECT_EQ(content_hash(record_forward_dynamics(model, emptied)), content_hash(bare));
  EXPECT_EQ(total_operations(record_forward_dynamics(model, emptied)), total_operations(bare));
  const std::size_t all = total_operations(record_forward_dynamics(model, effects));
  for_each_effect(effects, [&](auto& effect) {
    const auto kept = effect;
    effect.reset();
    EXPECT_LE(total_operations(record_forward_dynamics(model, effects)), all) << effect_name(effect);
    effect = kept;
  });
}

// Without velocity products the recording is that of a robot at rest.
TEST_P(RecordedEffects, VelocityProductsFoldAway) {
  Effects<double> linear;
  linear.coriolis = false;
  const Model<AD> taped = model.cast<AD>();
  const auto at_rest =
      record("at rest", static_cast<std::size_t>(model.nq + 2 * model.nv), [&](const VectorXad& x) {
        Data<AD> data(taped);
        DynamicsTerms<AD> acting;
        acting.armature = false;
        const VectorXad q = x.head(model.nq), v = VectorXad::Constant(model.nv, AD(0)), w = x.tail(model.nv);
        return VectorXad(aba<AD>(taped, data, q, v, w, acting));
      });
  EXPECT_EQ(content_hash(record_forward_dynamics(model, linear)), content_hash(at_rest));
}

INSTANTIATE_TEST_SUITE_P(Seeds, RecordedEffects, ::testing::Range(1UL, 7UL));

}  // namespace
}  // namespace dyntape::effects_recorded_test
