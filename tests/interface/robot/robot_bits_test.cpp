// SPDX-License-Identifier: BSD-3-Clause
//
// One template, two scalars: what plain double computes and what the interpreter makes of the recording are the same
// numbers, to the last bit (the sign of zero apart), for every function that needs no decomposition of Eigen's.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <random>
#include <set>

#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/graph/nonzero_outputs.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/robot_functions.h>

#include "source_folder.h"

namespace dyntape::robot_bits_test {
namespace {

using dynamics::Base;

class RobotBits : public ::testing::TestWithParam<std::pair<const char*, Base>> {
 protected:
  static dynamics::Model<double> robot() {
    const auto [name, base] = GetParam();
    return dynamics::load_urdf(test::source_folder() + "/config/robots/" + name + ".urdf", {.base = base});
  }
};

TEST_P(RobotBits, plain_double_equals_the_recording) {
  const dynamics::Model<double> model = robot();
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (const char* name : {"rnea", "aba", "crba", "minverse", "nonlinear-effects", "gravity", "energy",
                           "energy-gradients", "id-derivatives", "fd-derivatives"}) {
    const RobotFunction function(name);
    const Function recorded = record_robot_function(model, function, RobotSource::kAnalytic);
    for (int k = 0; k < 5; ++k) {
      Eigen::VectorXd state = Eigen::VectorXd::NullaryExpr(
          static_cast<Eigen::Index>(input_names(model, function).size()), [&] { return uniform(random); });
      state.head(model.nq) = dynamics::random_configuration<double>(model, random);
      const Eigen::VectorXd plain = evaluate_analytic(model, function, state);
      const std::vector<double> tape = evaluate(recorded, state);
      ASSERT_EQ(static_cast<std::size_t>(plain.size()), tape.size());
      int different = 0;
      for (Eigen::Index i = 0; i < plain.size(); ++i)
        different += plain[i] != tape[static_cast<std::size_t>(i)];
      EXPECT_EQ(different, 0) << name << " of " << plain.size();
    }
  }
}

// Whoever takes the non-zeros has everything.
TEST_P(RobotBits, NonzerosAreAllThatIsWritten) {
  const dynamics::Model<double> model = robot();
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const std::size_t n = std::size_t(model.nv);
  for (const char* name : {"crba", "minverse", "id-derivatives", "fd-derivatives", "id-hessian"}) {
    const RobotFunction function(name);
    const Function whole = record_robot_function(model, function);
    const NonzeroOutputs nonzero = nonzero_outputs(whole);
    const bool is_symmetric = std::string(name) == "crba" || std::string(name) == "minverse";
    EXPECT_LE(nonzero.function.n_y(), is_symmetric ? n * (n + 1) / 2 : whole.n_y()) << name;
    Eigen::VectorXd state = Eigen::VectorXd::NullaryExpr(
        static_cast<Eigen::Index>(input_names(model, function).size()), [&] { return uniform(random); });
    state.head(model.nq) = dynamics::random_configuration<double>(model, random);
    const std::vector<double> x{state.begin(), state.end()}, expected = evaluate(whole, x);
    std::vector<double> expanded(expected.size(), 17.0);
    nonzero.expand(evaluate(nonzero.function, x).data(), expanded.data());
    EXPECT_EQ(std::memcmp(expanded.data(), expected.data(), expected.size() * sizeof(double)), 0) << name;
    ASSERT_EQ(nonzero.function.output_names.size(), nonzero.function.n_y());
    for (std::size_t i = 0; i < whole.n_y(); ++i) {  // a name is that of the first output that is this value
      const auto place = std::find(nonzero.place.begin(), nonzero.place.end(), nonzero.place[i]);
      if (nonzero.place[i] < 0) continue;
      EXPECT_EQ(nonzero.function.output_names[std::size_t(nonzero.place[i])],
                whole.output_names[std::size_t(place - nonzero.place.begin())]);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Robots, RobotBits,
                         ::testing::Values(std::pair{"cart_pole", Base::kFixed},
                                           std::pair{"ur5", Base::kFixed}, std::pair{"panda", Base::kFixed},
                                           std::pair{"iiwa14", Base::kFloating},
                                           std::pair{"solo12", Base::kFloating}));

}  // namespace
}  // namespace dyntape::robot_bits_test
