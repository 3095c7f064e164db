// SPDX-License-Identifier: BSD-3-Clause
//
// Hard cases of rigid bodies through what users run: the interpreter, and generated C at -O0 and at -O3, with
// derivatives of first and second order.  The same cases in plain double are in tests/dynamics.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <numbers>

#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/dynamics/algebra/float128.h>
#include <dyntape/dynamics/algebra/lie.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/robot_functions.h>
#include <dyntape/interface/robot/robot_rows.h>

namespace dyntape {
namespace {

using dynamics::Model;
using Values = std::vector<double>;

::testing::AssertionResult same_bits(const Values& a, const Values& b) {
  if (a.size() != b.size()) return ::testing::AssertionFailure() << a.size() << " values and " << b.size();
  for (std::size_t i = 0; i < a.size(); ++i) {
    const bool both_nan = std::isnan(a[i]) && std::isnan(b[i]);
    if (!both_nan && std::bit_cast<std::uint64_t>(a[i]) != std::bit_cast<std::uint64_t>(b[i])) {
      return ::testing::AssertionFailure()
             << std::hexfloat << a[i] << " and " << b[i] << " at " << i << " of " << a.size();
    }
  }
  return ::testing::AssertionSuccess();
}

// A function by every route: interpreter, C at -O0, C at -O3.
class EveryRoute {
 public:
  EveryRoute(const Function& function, Order order, const std::vector<std::string>& levels = {"-O0", "-O3"})
      : order_(order), weights_(order == Order::kSecond ? function.n_y() : 0, 1.0) {
    CodegenOptions options;
    options.order = order;
    options.use_cache = false;
    options.route = Route::kInterpreter;
    routes_.push_back(CompiledFunction::make(function, options));
    options.route = Route::kCompiled;
    for (const std::string& level : levels) {
      options.flags = {level};
      routes_.push_back(CompiledFunction::make(function, options));
    }
  }

  // Values, Jacobian and Hessian non-zeros one after the other; the routes must agree bit for bit.
  Values operator()(const Values& x) const {
    Values expected;
    for (std::size_t i = 0; i < routes_.size(); ++i) {
      const auto r = routes_[i].evaluate(order_, x, {}, weights_);
      Values all = r.y;
      all.insert(all.end(), r.jacobian.begin(), r.jacobian.end());
      all.insert(all.end(), r.hessian.begin(), r.hessian.end());
      if (i == 0) expected = all;
      EXPECT_TRUE(same_bits(all, expected)) << "route " << i << " of " << routes_[i].name();
    }
    return expected;
  }

 private:
  Order order_;
  Values weights_;
  std::vector<CompiledFunction> routes_;
};

TEST(HardRotations, ThereAndBackAtEveryAngle) {
  // log(exp(w)) = w: value w, Jacobian the identity, Hessian zero, from no rotation to nearly half a turn.
  const Function f = record("there_and_back", 3, [](const VectorXad& w) -> VectorXad {
    return dynamics::log(dynamics::exp<AD>(w));
  });
  const EveryRoute routes(f, Order::kSecond);
  const Eigen::Vector3d axis = Eigen::Vector3d(1, -2, 0.5).normalized();
  for (double angle : {0.0, 1e-200, 1e-12, 1e-8, 1e-4, 1e-3, 0.1, 1.0, 2.0, 3.0, std::numbers::pi - 1e-3}) {
    const Eigen::Vector3d w = angle * axis;
    const Values r = routes({w[0], w[1], w[2]});
    const double sharp = angle > 3 ? 1e-9 : 1e-13;  // the derivatives' condition grows towards half a turn
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(r[i], w[i], 4e-15 * std::max(1.0, angle)) << angle;
    ASSERT_EQ(r.size(), 3 + 9 + 6u);
    for (int k = 0; k < 9; ++k) EXPECT_NEAR(r[3 + k], k % 4 == 0 ? 1 : 0, sharp) << angle << ", entry " << k;
    for (int k = 0; k < 6; ++k) EXPECT_NEAR(r[12 + k], 0, 1e3 * sharp) << angle << ", entry " << k;
  }
}

Model<double> quadruped() {
  return dynamics::load_urdf(DYNTAPE_SOURCE_DIR "/config/robots/solo12.urdf",
                             {.base = dynamics::Base::kFloating});
}

Values standing(const Model<double>& model, const RobotFunction& function) {
  Values state(input_names(model, function).size());
  for (std::size_t i = 0; i < state.size(); ++i) state[i] = std::sin(1.0 + 2.0 * static_cast<double>(i));
  return state;
}

class HardBase : public ::testing::TestWithParam<RobotFunction> {};

TEST_P(HardBase, FarAwayAndOnBothSheetsTheBitsAreTheSame) {
  const Model<double> model = quadruped();
  const Function f = record_robot_function(model, GetParam());
  const EveryRoute routes(f, Order::kValue);
  Values state = standing(model, GetParam());
  const Values here = routes(state);
  for (double distance : {1e2, 1e4, 1e8}) {
    Values there = state;
    for (int i = 0; i < 3; ++i) there[i] += distance;
    EXPECT_TRUE(same_bits(routes(there), here)) << distance;
  }
  for (int i = 3; i < 7; ++i) state[i] = -state[i];
  EXPECT_TRUE(same_bits(routes(state), here));
}

INSTANTIATE_TEST_SUITE_P(Functions, HardBase, ::testing::ValuesIn(kCoreFunctions), [](const auto& info) {
  std::string name = to_string(info.param);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

// A chain of revolute joints about alternating axes; body i has the given mass.
Model<double> chain(const std::vector<double>& masses) {
  Model<double> model;
  model.name = "chain";
  for (std::size_t i = 0; i < masses.size(); ++i) {
    dynamics::Joint<double> joint;
    joint.name = "joint_" + std::to_string(i);
    joint.axis = Eigen::Vector3d::Unit(static_cast<int>(i) % 3);
    const dynamics::Placement<double> link{Eigen::Matrix3d::Identity(), {0.3, 0.1, i ? -0.2 : 0.0}};
    model.add_joint(static_cast<int>(i) - 1, joint, link,
                    {masses[i], {0.1, 0.05, -0.1}, 0.01 * masses[i] * Eigen::Matrix3d::Identity()});
  }
  return model;
}

// Largest error against 113 bits over the largest entry.
double error_against_quad(const Model<double>& model, const RobotFunction& function, const Values& state,
                          const Values& got) {
  using Quad = dynamics::Float128;
  const Model<Quad> exact = model.cast<Quad>();
  detail::RobotWorkspace<Quad> work(exact, function);
  const dynamics::VectorX<Quad> x =
      Eigen::Map<const Eigen::VectorXd>(state.data(), static_cast<long>(state.size())).cast<Quad>();
  std::vector<Quad> expected(got.size());
  work.evaluate(x.data(), expected.data());
  double error = 0, scale = 0;
  for (std::size_t i = 0; i < got.size(); ++i) {
    error = std::max(error, std::abs(static_cast<double>(Quad(got[i]) - expected[i])));
    scale = std::max(scale, std::abs(static_cast<double>(expected[i])));
  }
  return error / scale;
}

TEST(HardMasses, RatiosOfABillion) {
  for (const Values& masses : {Values{1, 1, 1, 1e9}, Values{1, 1, 1, 1e-9}, Values{1e6, 1, 1e6, 1}}) {
    const Model<double> model = chain(masses);
    const Values state = standing(model, RobotFunction::kAba);
    for (const RobotFunction& function : {RobotFunction::kAba, RobotFunction::kFdDerivatives}) {
      const EveryRoute routes(record_robot_function(model, function), Order::kValue);
      EXPECT_LE(error_against_quad(model, function, state, routes(state)), 1e-12) << to_string(function);
    }
  }
}

TEST(HardChains, ThreeHundredJoints) {
  const Model<double> model = chain(Values(300, 1.0));
  const Values state = standing(model, RobotFunction::kAba);
  const EveryRoute routes(record_robot_function(model, RobotFunction::kAba), Order::kValue);
  EXPECT_LE(error_against_quad(model, RobotFunction::kAba, state, routes(state)), 1e-12);
}

}  // namespace
}  // namespace dyntape
