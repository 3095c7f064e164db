// SPDX-License-Identifier: BSD-3-Clause
//
// Every row of the table of a robot's functions, held against what knows nothing of it: derivatives against the
// derived recording of their value, everything against 113 bits, names against sizes.
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <random>
#include <set>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/dynamics/algebra/float128.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/packs/packed_robot.h>
#include <dyntape/interface/robot/robot_evaluator.h>
#include <dyntape/interface/robot/robot_rows.h>

#include "source_folder.h"

namespace dyntape::robot_table_test {
namespace {

using dynamics::Base;
using dynamics::Model;
using dynamics::ReferenceFrame;
using Eigen::VectorXd;

Model<double> load(const std::string& name, Base base = Base::kFixed) {
  const auto root = std::filesystem::path(test::source_folder());
  return dynamics::load_urdf((root / "config" / "robots" / (name + ".urdf")).string(), {.base = base});
}

std::vector<Model<double>> robots() {
  return {load("cart_pole"), load("ur5"), load("iiwa14", Base::kFloating)};
}

VectorXd random_state(const Model<double>& model, const RobotFunction& function, std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  VectorXd state = VectorXd::NullaryExpr(static_cast<Eigen::Index>(input_names(model, function).size()),
                                         [&] { return uniform(random); });
  state.head(model.nq) = dynamics::random_configuration<double>(model, random);
  return state;
}

// Largest difference over largest entry, block by block.
double error(const VectorXd& got, const VectorXd& expected, const std::vector<RobotBlock>& blocks) {
  double worst = 0;
  Eigen::Index first = 0;
  for (const RobotBlock& block : blocks) {
    const auto wanted = expected.segment(first, block.size());
    const double scale = wanted.cwiseAbs().maxCoeff();
    const double e =
        (got.segment(first, block.size()) - wanted).cwiseAbs().maxCoeff() / (scale > 0 ? scale : 1);
    worst = e <= worst ? worst : e;
    first += block.size();
  }
  EXPECT_EQ(first, expected.size());
  return worst;
}

template <class Check>
void for_every_row(Check check) {
  for (const Model<double>& model : robots()) {
    for (const RobotFunction& row : robot_functions()) {
      for (ReferenceFrame in :
           {ReferenceFrame::kLocal, ReferenceFrame::kWorld, ReferenceFrame::kLocalWorldAligned}) {
        RobotFunction function = row;
        // Dependent rows: forces are not unique, and of six directions of a frame some are damped alone.
        if (is_forward(function) && takes_frame(function) && model.nv < 6) continue;
        function.in = in;
        SCOPED_TRACE(model.name + " " + to_string(function) + ", frame " +
                     std::to_string(static_cast<int>(in)));
        check(model, function);
        if (!takes_frame(function)) break;
      }
    }
  }
}

TEST(RobotTable, NamesAndSizesFit) {
  std::set<std::string> names;
  for (const RobotFunction& function : robot_functions()) names.insert(to_string(function));
  EXPECT_EQ(names.size(), robot_functions().size());
  for_every_row([](const Model<double>& model, const RobotFunction& function) {
    const detail::RobotWorkspace<double> work(model, function);
    const auto in = input_names(model, function), out = output_names(model, function);
    EXPECT_EQ(in.size(), work.n_in());
    EXPECT_EQ(out.size(), work.n_out());
    EXPECT_EQ(std::set<std::string>(out.begin(), out.end()).size(), out.size());
    EXPECT_EQ(RobotFunction(to_string(function)).row(), function.row());
    if (is_derivative(function)) {
      EXPECT_EQ(input_names(model, value_of(function)), in);
      EXPECT_EQ(is_forward(function), is_forward(value_of(function)));
    }
  });
}

// Derivatives: the tape knows the value only.  Values: the recording of the same templates.
TEST(RobotTable, RecordingsAgreeWithPlainCode) {
  std::mt19937_64 random(1);
  for_every_row([&](const Model<double>& model, const RobotFunction& function) {
    RobotEvaluator plain(model, function, RobotRoute::kAnalytic), tape(model, function, RobotRoute::kTape);
    for (int i = 0; i < 3; ++i) {
      const VectorXd state = random_state(model, function, random);
      EXPECT_LE(error(tape(state), plain(state), outputs(model, function)), 1e-11) << "seed 1";
    }
  });
}

// Joints at random, many turns on, and beyond what the quick reduction of an angle reaches; a column a state.
Eigen::MatrixXd turned_states(const Model<double>& model, const RobotFunction& function,
                              std::mt19937_64& random) {
  constexpr int kStates = 13;  // whole registers and a rest
  Eigen::MatrixXd states(static_cast<Eigen::Index>(input_names(model, function).size()), kStates);
  for (int k = 0; k < kStates; ++k) {
    VectorXd state = random_state(model, function, random);
    const int base = model.nq == model.nv ? 0 : 7;
    state.segment(base, model.nq - base) *= std::array{1.0, 250.0, 1e5, 1e12}[std::size_t(k % 4)];
    states.col(k) = state;
  }
  return states;
}

// Plain double, packs, the interpreter, machine code and compiled C, one state at a time and in lanes; nothing is asked for.
TEST(RobotTable, EveryRouteHasTheBitsOfPlainCodeByDefault) {
  std::mt19937_64 random(4);
  for (const Model<double>& model : robots()) {
    for (const RobotFunction& function : {RobotFunction::kRnea, RobotFunction::kAba, RobotFunction::kCrba,
                                          RobotFunction::kIdDerivatives, RobotFunction::kFdDerivatives}) {
      SCOPED_TRACE(model.name + " " + to_string(function));
      const Function recorded = record_robot_function(model, function, RobotSource::kAnalytic);
      const Eigen::MatrixXd states = turned_states(model, function, random);
      const Eigen::Index n = states.cols();
      Eigen::MatrixXd plain(static_cast<Eigen::Index>(recorded.n_y()), n), found(plain);
      for (Eigen::Index k = 0; k < n; ++k) plain.col(k) = evaluate_analytic(model, function, states.col(k));

      PackedRobot packs(model, function);
      packs.evaluate(states.data(), std::size_t(n), found.data());
      EXPECT_TRUE(found == plain) << "packs, seed 4";
      for (const Route route : {Route::kInterpreter, Route::kMachineCode, Route::kCompiled}) {
        CodegenOptions options;
        options.order = Order::kValue;
        options.route = route;
        options.lanes = Lanes::kNative;
        const CompiledFunction f = CompiledFunction::make(recorded, options);
        CompiledFunction::Workspace room(f);
        for (Eigen::Index k = 0; k < n; ++k)
          f.value(states.col(k).data(), nullptr, found.col(k).data(), room);
        EXPECT_TRUE(found == plain) << to_string(route) << ", one by one, seed 4";
        found.setZero();
        f.check(f.run(Order::kValue, {.count = std::size_t(n), .x = states.data(), .y = found.data()}, room));
        EXPECT_TRUE(found == plain) << to_string(route) << ", many at once, seed 4";
      }
    }
  }
}

TEST(RobotTable, PlainCodeAgreesWith113Bits) {
  using Quad = dynamics::Float128;
  std::mt19937_64 random(2);
  for_every_row([&](const Model<double>& model, const RobotFunction& function) {
    const Model<Quad> exact = model.cast<Quad>();
    detail::RobotWorkspace<Quad> work(exact, function);
    const VectorXd state = random_state(model, function, random);
    const dynamics::VectorX<Quad> x = state.cast<Quad>();
    dynamics::VectorX<Quad> y(static_cast<Eigen::Index>(work.n_out()));
    work.evaluate(x.data(), y.data());
    // The inverse of J Minv J^T loses as many digits as that has in its condition: four in an arm at random.
    const double tolerance = to_string(function) == std::string("operational-space") ? 1e-11 : 1e-12;
    EXPECT_LE(error(evaluate_analytic(model, function, state), y.cast<double>(), outputs(model, function)),
              tolerance)
        << "seed 2";
  });
}

TEST(RobotTable, DifferencesAgreeWithDerivatives) {
  std::mt19937_64 random(3);
  for_every_row([&](const Model<double>& model, const RobotFunction& function) {
    if (!is_derivative(function)) return;
    RobotEvaluator plain(model, function, RobotRoute::kAnalytic),
        central(model, function, RobotRoute::kFdCentral);
    const VectorXd state = random_state(model, function, random);
    EXPECT_LE(error(central(state), plain(state), outputs(model, function)), 1e-6) << "seed 3";
  });
}

TEST(RobotTable, FramesAreChosenByName) {
  const Model<double> model = load("ur5");
  RobotFunction function("frame-jacobian");
  function.in = ReferenceFrame::kLocal;
  const VectorXd q = VectorXd::Constant(model.nq, 0.3);
  const VectorXd last = evaluate_analytic(model, function, q);
  function.frame = model.frames.back().name;
  EXPECT_EQ(evaluate_analytic(model, function, q), last);
  function.frame = model.frames[2].name;
  EXPECT_NE(evaluate_analytic(model, function, q), last);
  function.frame = "tol0";
  EXPECT_THROW(evaluate_analytic(model, function, q), ArgumentError);
}

}  // namespace
}  // namespace dyntape::robot_table_test
