// SPDX-License-Identifier: BSD-3-Clause
//
// The function class: OCS2's vocabulary, and good behaviour where the original has none.
#include <gtest/gtest.h>
#include <xmmintrin.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/pipeline.h>

#include "ad_function_fixture.h"

namespace dyntape::ad_function_test {
namespace {

TEST_F(AdFunctionTest, ValueJacobianHessianAreThoseOfPaper) {
  const AdFunction f = created(sample, 3, 2);
  vector_t y(3);
  y << kP[0] * kX[0] * kX[0] + std::sin(kX[1]) * kX[2], kP[1] * std::exp(kX[0]) * kX[2], kX[1];
  EXPECT_TRUE(f.getFunctionValue(kX, kP).isApprox(y, 1e-15));
  EXPECT_TRUE(f.getJacobian(kX, kP).isApprox(sample_jacobian(kX, kP), 1e-15));
  for (std::size_t i = 0; i < 3; ++i) {
    const vector_t unit = vector_t::Unit(3, static_cast<Eigen::Index>(i));
    const matrix_t H = f.getHessian(i, kX, kP);
    EXPECT_TRUE((H - sample_hessian(unit, kX, kP)).isZero(1e-14)) << H;
    EXPECT_EQ(H, H.transpose());
    EXPECT_EQ(H, f.getHessian(unit, kX, kP));
  }
  const vector_t w = (vector_t(3) << 0.3, -2, 5).finished();
  EXPECT_TRUE(f.getHessian(w, kX, kP).isApprox(sample_hessian(w, kX, kP), 1e-14));
  EXPECT_EQ(f.rangeDim(), 3u);
}

TEST_F(AdFunctionTest, WithoutParametersAndWithFixedSizeArguments) {
  AdFunction f([](const ad_vector_t& x, ad_vector_t& y) { y = x.cwiseProduct(x); }, 2, "squares",
               cache_.path(), {"-O1"});
  f.createModels(ApproximationOrder::First, false);
  const Eigen::Vector2d x(3, -4);
  EXPECT_EQ(f.getFunctionValue(x), Eigen::Vector2d(9, 16));
  EXPECT_EQ(f.getJacobian(x), matrix_t(Eigen::Vector2d(6, -8).asDiagonal()));
  const vector_t longer = (vector_t(4) << 0, 3, -4, 0).finished();
  EXPECT_EQ(f.getFunctionValue(longer.segment(1, 2)), Eigen::Vector2d(9, 16));
}

// A value that outlives its recording is an error at the line that made the function, not at one of the library.
TEST_F(AdFunctionTest, MistakesInARecordingNameTheUsersLine) {
  ad_scalar_t kept = 0;
  const auto keeps = [&](const ad_vector_t& x, ad_vector_t& y) {
    y = ad_vector_t::Constant(1, kept = kept * x[0]);
  };
  const int line = __LINE__ + 1;
  AdFunction f(keeps, 1, "keeps", cache_.path(), {"-O1"});
  kept = 1;
  const auto create = [&] { f.createModels(ApproximationOrder::Zero, false); };
  create();
  try {
    create();
    FAIL() << "kept is of the first recording";
  } catch (const RecordingError& e) {
    const std::string what = e.what();
    EXPECT_NE(what.find("ad_function_test.cpp:" + std::to_string(line)), std::string::npos) << what;
    EXPECT_EQ(what.find("ad_function.cpp"), std::string::npos) << what;
  }
}

TEST_F(AdFunctionTest, GaussNewtonOverTheWholeVariableVector) {
  const AdFunction f = created(sample, 3, 2, ApproximationOrder::First);
  const vector_t y = f.getFunctionValue(kX, kP);
  const matrix_t J = sample_jacobian(kX, kP);
  const auto a = f.getGaussNewtonApproximation(kX, kP);
  EXPECT_DOUBLE_EQ(a.f, 0.5 * y.squaredNorm());
  EXPECT_TRUE(a.dfdx.isApprox(J.transpose() * y, 1e-14));
  EXPECT_TRUE(a.dfdxx.isApprox(J.transpose() * J, 1e-14));
  EXPECT_EQ(a.dfdxx, a.dfdxx.transpose());
  EXPECT_EQ(a.dfdu.size() + a.dfduu.size() + a.dfdux.size(), 0);
}

// The function is finite, its square is not.
TEST_F(AdFunctionTest, GaussNewtonIsFiniteOrAnError) {
  const AdFunction f =
      interpreted([](const ad_vector_t& x, const ad_vector_t&, ad_vector_t& y) { y = x * AD(1e160); }, 2, 0,
                  ApproximationOrder::First);
  EXPECT_EQ(message_of<NumericalError>([&] {
              f.getGaussNewtonApproximation(vector_t::Ones(2));
            }).find("getGaussNewtonApproximation of \"" + f.name() + "\": entry f[0] is inf"),
            0u);
}

// Empty rows, full rows, a row at the very end of the pattern: the product of a row with itself stays inside it.
TEST_F(AdFunctionTest, GaussNewtonOfAnyPattern) {
  std::mt19937_64 random(11);
  for (int trial = 0; trial < 50; ++trial) {
    const int n = 1 + static_cast<int>(random() % 6), m = static_cast<int>(random() % 6);
    const matrix_t A = matrix_t::NullaryExpr(
        m, n, [&] { return random() % 2 ? 0.0 : std::uniform_real_distribution<double>(-1, 1)(random); });
    const AdFunction f =
        interpreted([&](const ad_vector_t& x, const ad_vector_t&, ad_vector_t& y) { y = A.cast<AD>() * x; },
                    static_cast<std::size_t>(n), 0, ApproximationOrder::First);
    const vector_t x = vector_t::LinSpaced(n, -1, 2), y = A * x;
    const auto a = f.getGaussNewtonApproximation(x);
    EXPECT_TRUE((a.dfdxx - A.transpose() * A).isZero(1e-14)) << "seed 11, trial " << trial;
    EXPECT_TRUE((a.dfdx - A.transpose() * y).isZero(1e-14)) << "seed 11, trial " << trial;
  }
}

// --- sections 0.1 and 0.2 of what users of the original meet: flags, and the floating-point state ---

TEST_F(AdFunctionTest, MistakesAreExceptionsThatNameModelAndEntry) {
  AdFunction f = make(sample, 3, 2, "arm");
  EXPECT_EQ(
      message_of<ArgumentError>([&] { f.getJacobian(kX, kP); }),
      "getJacobian of \"arm\": there is no model yet; call createModels or loadModelsIfAvailable first");
  f.createModels(ApproximationOrder::First, false);
  EXPECT_EQ(message_of<ArgumentError>([&] { f.getHessian(0, kX, kP); }),
            "getHessian of \"arm\" needs order Second, the model was created with order First");
  EXPECT_EQ(message_of<ArgumentError>([&] { f.getJacobian(vector_t::Zero(4), kP); }),
            "getJacobian: x has 4 entries, function \"arm\" expects 3");
  EXPECT_EQ(message_of<ArgumentError>([&] { f.getFunctionValue(kX); }),
            "getFunctionValue: p has 0 entries, function \"arm\" expects 2");
  f.createModels(ApproximationOrder::Second, false);
  EXPECT_EQ(message_of<ArgumentError>([&] { f.getHessian(3, kX, kP); }),
            "getHessian: output 3 does not exist, function \"arm\" has 3 outputs, counted from 0");
  EXPECT_EQ(message_of<ArgumentError>([&] { f.getHessian(vector_t::Ones(2), kX, kP); }),
            "getHessian: weights has 2 entries, function \"arm\" expects 3");
  EXPECT_TRUE(contains(message_of<ArgumentError>([&] { AdFunction(nullptr, 3, 2, "none"); }), "\"none\""));
}

TEST_F(AdFunctionTest, AnExceptionOfTheUsersFunctionPassesAndLeavesNothingBehind) {
  AdFunction f = make(sample, 3, 2);
  f.createModels(ApproximationOrder::Zero, false);
  struct Mine {};
  bool fail = true;
  AdFunction g = make(
      [&fail](const ad_vector_t& x, const ad_vector_t& p, ad_vector_t& y) {
        sample(x, p, y);
        if (fail) throw Mine();
      },
      3, 2);
  EXPECT_THROW(g.createModels(ApproximationOrder::Zero, false), Mine);
  EXPECT_FALSE(g.hasModel());
  fail = false;
  g.createModels(ApproximationOrder::Zero, false);  // on the same thread
  EXPECT_EQ(g.getFunctionValue(kX, kP), f.getFunctionValue(kX, kP));
  fail = true;
  EXPECT_THROW(g.createModels(ApproximationOrder::Second, false), Mine);
  EXPECT_EQ(g.getFunctionValue(kX, kP), f.getFunctionValue(kX, kP));  // keeps the model it had
}

TEST_F(AdFunctionTest, NanWhileRecordingIsNoErrorAndTheRecordingPointIsTheUsers) {
  const auto arc = [](const ad_vector_t& x, const ad_vector_t&, ad_vector_t& y) {
    y.resize(1);
    y[0] = acos(2.0 * x[0]);  // cannot be evaluated at ones
  };
  const AdFunction f = interpreted(arc, 1, 0);
  EXPECT_DOUBLE_EQ(f.getFunctionValue(vector_t::Constant(1, 0.25))[0], std::acos(0.5));

  const auto branch = [](const ad_vector_t& x, const ad_vector_t&, ad_vector_t& y) {
    y.resize(1);
    if (x[0] > 10.0) {
      y[0] = x[0] * x[0];
    } else {
      y[0] = x[0];
    }
  };
  AdFunctionSettings settings;
  settings.name = "branch";
  settings.codegen.route = Route::kInterpreter;
  settings.variables = vector_t::Constant(1, 20);
  AdFunction g(branch, 1, 0, settings);
  g.createModels(ApproximationOrder::First, false);
  EXPECT_EQ(g.getFunctionValue(vector_t::Constant(1, 11))[0], 121);
  const std::string message =
      message_of<GuardViolation>([&] { g.getFunctionValue(vector_t::Constant(1, 9)); });
  EXPECT_TRUE(contains(message, "ad_function_test.cpp")) << message;
}

// --- 0.6: constants are exact ---

TEST_F(AdFunctionTest, ConstantsKeepEveryBit) {
  std::mt19937_64 random(12);
  vector_t c(64);
  for (auto& v : c)
    v = std::ldexp(std::uniform_real_distribution<double>(-1, 1)(random), int(random() % 200) - 100);
  c[0] = 1.0 / 3.0;
  c[1] = 0.1 + 0.2;
  c[2] = 4.9e-324;
  c[3] = 1.7976931348623157e308;
  const AdFunction f =
      created([&c](const ad_vector_t& x, const ad_vector_t&, ad_vector_t& y) { y = c.cast<AD>() * x[0]; }, 1,
              0, ApproximationOrder::Zero);
  EXPECT_EQ(f.statistics().route, "compiled");
  EXPECT_EQ(f.getFunctionValue(vector_t::Ones(1)), c) << "seed 12";
}

// --- 0.7: sparsity is kept ---

TEST_F(AdFunctionTest, SparseResultsAreTheDenseOnes) {
  const AdFunction f = created(sample, 3, 2);
  const vector_t w = (vector_t(3) << 0.3, -2, 5).finished();
  EXPECT_EQ(matrix_t(f.getSparseJacobian(kX, kP)), f.getJacobian(kX, kP));
  EXPECT_EQ(matrix_t(f.getSparseHessian(w, kX, kP)), f.getHessian(w, kX, kP));
  EXPECT_EQ(f.jacobianPattern().nnz(), 6u);
  EXPECT_EQ(f.hessianPattern().nnz(), 4u);  // (0,0) (1,1) (2,0) (2,1)
  EXPECT_EQ(f.getSparseJacobian(kX, kP).nonZeros(), 6);
  EXPECT_EQ(f.statistics().jacobianNonZeros, 6u);
  EXPECT_EQ(f.statistics().hessianNonZeros, 4u);
}

// --- 0.8: guarded singularities have finite derivatives ---

TEST_F(AdFunctionTest, AGuardedSingularityHasAFiniteDerivative) {
  const AdFunction f = created(
      [](const ad_vector_t& x, const ad_vector_t&, ad_vector_t& y) {
        const AD n = sqrt(x.dot(x));
        y.resize(1);
        y[0] = select(n > 1e-9, sin(n) / n, AD(1));
      },
      2, 0);
  EXPECT_EQ(f.getFunctionValue(vector_t::Zero(2))[0], 1);
  EXPECT_EQ(f.getJacobian(vector_t::Zero(2)), matrix_t::Zero(1, 2));
  EXPECT_EQ(f.getHessian(0, vector_t::Zero(2)), matrix_t::Zero(2, 2));
}

TEST_F(AdFunctionTest, WhatIsNotFiniteIsReportedWithEntryAndCause) {
  const auto roots = [](const ad_vector_t& x, const ad_vector_t&, ad_vector_t& y) { y = x.cwiseSqrt(); };
  const AdFunction f = interpreted(roots, 2, 0);
  const vector_t negative = (vector_t(2) << 1, -1).finished(), edge = (vector_t(2) << 1, 0).finished();
  const std::string value = message_of<NumericalError>([&] { f.getFunctionValue(negative); });
  EXPECT_TRUE(contains(value, "entry 1 is -nan") || contains(value, "entry 1 is nan")) << value;
  EXPECT_TRUE(contains(value, "Sqrt")) << value;
  const std::string slope = message_of<NumericalError>([&] { f.getJacobian(edge); });
  EXPECT_TRUE(contains(slope, "entry (1, 1) is inf; first cause: in the derivative")) << slope;
  vector_t poisoned = edge;
  poisoned[0] = std::nan("");
  const std::string input = message_of<NumericalError>([&] { f.getFunctionValue(poisoned); });
  EXPECT_TRUE(contains(input, "first cause: x[0] = nan")) << input;

  AdFunctionSettings settings;
  settings.codegen.route = Route::kInterpreter;
  settings.checkFinite = false;
  AdFunction g(roots, 2, 0, settings);
  g.createModels(ApproximationOrder::First, false);
  EXPECT_TRUE(std::isinf(g.getJacobian(edge)(1, 1)));
}

// --- names, copies, threads ---

TEST_F(AdFunctionTest, AnyNameWill) {
  for (const std::string name : {"left-foot", "7", "", "a b/../c", "\"quoted\" */ \\", "größe"}) {
    AdFunction f = make(sample, 3, 2, name);
    f.createModels(ApproximationOrder::Zero, false);
    EXPECT_EQ(f.statistics().route, "compiled") << name;
    EXPECT_EQ(f.name(), name);
    EXPECT_EQ(f.getFunctionValue(kX, kP)[2], kX[1]);
  }
}

TEST_F(AdFunctionTest, CopiesShareTheLibraryAndOutliveTheOriginal) {
  auto original = std::make_unique<AdFunction>(created(sample, 3, 2));
  const AdFunction copy = *original;
  AdFunction assigned = make([](const ad_vector_t& x, const ad_vector_t&, ad_vector_t& y) { y = x; }, 3, 2);
  assigned = *original;
  const matrix_t J = original->getJacobian(kX, kP);
  EXPECT_EQ(&copy.recorded(), &original->recorded());
  original->createModels(ApproximationOrder::Zero, false);  // the copy keeps what it has
  EXPECT_EQ(copy.order(), ApproximationOrder::Second);
  original.reset();
  std::filesystem::remove_all(cache_.path());  // what is loaded stays loaded
  EXPECT_EQ(copy.getJacobian(kX, kP), J);
  EXPECT_EQ(assigned.getJacobian(kX, kP), J);
}

TEST_F(AdFunctionTest, ManyThreadsOnOneObject) {
  const AdFunction f = created(sample, 3, 2);
  std::atomic<int> wrong{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < 24; ++t) {  // more than the pool holds
    threads.emplace_back([&f, &wrong, t] {
      std::mt19937_64 random(static_cast<std::uint64_t>(t));
      for (int i = 0; i < 300; ++i) {
        const vector_t x =
            vector_t::NullaryExpr(3, [&] { return std::uniform_real_distribution<>(-1, 1)(random); });
        const vector_t w = x.reverse();
        if (!f.getJacobian(x, kP).isApprox(sample_jacobian(x, kP), 1e-13)) ++wrong;
        if (!(f.getHessian(w, x, kP) - sample_hessian(w, x, kP)).isZero(1e-13)) ++wrong;
        if (i == 150 && !f.jvp(x, kP, w).isApprox(sample_jacobian(x, kP) * w, 1e-13)) ++wrong;
      }
    });
  }
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

TEST_F(AdFunctionTest, ManyThreadsCreateModelsAtOnce) {
  std::atomic<int> wrong{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([this, &wrong, t] {
      AdFunction f = make(
          [t](const ad_vector_t& x, const ad_vector_t&, ad_vector_t& y) { y = x * AD(1.0 + t / 2); }, 2, 0);
      f.createModels(ApproximationOrder::First, false);
      if (f.getJacobian(vector_t::Ones(2))(1, 1) != 1.0 + t / 2) ++wrong;
    });
  }
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

// --- what OCS2 lacks ---

TEST_F(AdFunctionTest, OneCallGivesAllAndABatchTheSame) {
  const AdFunction f = created(sample, 3, 2);
  const std::size_t n = 5, n_j = f.jacobianPattern().nnz(), n_h = f.hessianPattern().nnz();
  matrix_t x = matrix_t::Random(3, n), p = matrix_t::Random(2, n), w = matrix_t::Random(3, n);
  matrix_t y(3, n), J(n_j, n), H(n_h, n);
  f.evaluateBatch(n, x.data(), p.data(), y.data(), J.data(), w.data(), H.data());
  for (Eigen::Index i = 0; i < 5; ++i) {
    vector_t yi(3), Ji(n_j), Hi(n_h);
    f.evaluate(x.col(i).data(), p.col(i).data(), yi.data(), Ji.data(), w.col(i).data(), Hi.data());
    EXPECT_EQ(yi, y.col(i));
    EXPECT_EQ(Ji, J.col(i));
    EXPECT_EQ(Hi, H.col(i));
    EXPECT_EQ(yi, f.getFunctionValue(x.col(i), p.col(i)));
    const matrix_t dense = f.getJacobian(x.col(i), p.col(i)),
                   hessian = f.getHessian(w.col(i), x.col(i), p.col(i));
    for (std::size_t k = 0; k < n_j; ++k)
      EXPECT_EQ(Ji[k], dense(f.jacobianPattern().row[k], f.jacobianPattern().col[k]));
    for (std::size_t k = 0; k < n_h; ++k)
      EXPECT_EQ(Hi[k], hessian(f.hessianPattern().row[k], f.hessianPattern().col[k]));
  }
  EXPECT_THROW(f.evaluate(x.data(), p.data(), y.data(), J.data(), nullptr, H.data()), ArgumentError);
}

TEST_F(AdFunctionTest, ABatchInLanesAndThreadsAndTiersIsTheSame) {
  const Eigen::Index n = 43;
  const matrix_t x = matrix_t::Random(3, n), p = matrix_t::Random(2, n);
  const auto values = [&](Route route, Lanes lanes, unsigned threads) {
    AdFunctionSettings settings;
    settings.folder = cache_.path();
    settings.threads = threads;
    settings.codegen.route = route;
    settings.codegen.lanes = lanes;
    settings.codegen.functions = Functions::kPortable;
    AdFunction f(sample, 3, 2, settings);
    f.createModels(ApproximationOrder::First, false);
    matrix_t y(3, n);
    f.evaluateBatch(static_cast<std::size_t>(n), x.data(), p.data(), y.data());
    return y;
  };
  const matrix_t expected = values(Route::kInterpreter, Lanes::kNone, 1);
  EXPECT_EQ(values(Route::kInterpreter, Lanes::kNone, 3), expected);
  EXPECT_EQ(values(Route::kCompiled, Lanes::kNative, 3), expected);
  EXPECT_EQ(values(Route::kTiered, Lanes::kNative, 0), expected);
}

TEST_F(AdFunctionTest, DerivativesOnRequest) {
  const AdFunction f = created(sample, 3, 2, ApproximationOrder::Zero);
  matrix_t dydp(3, 2);
  dydp << kX[0] * kX[0], 0, 0, std::exp(kX[0]) * kX[2], 0, 0;
  EXPECT_TRUE(f.getParameterJacobian(kX, kP).isApprox(dydp, 1e-15));
  const vector_t d = (vector_t(3) << 1, -2, 0.5).finished();
  EXPECT_TRUE(f.jvp(kX, kP, d).isApprox(sample_jacobian(kX, kP) * d, 1e-14));
  EXPECT_TRUE(f.vjp(kX, kP, d).isApprox(sample_jacobian(kX, kP).transpose() * d, 1e-14));
  EXPECT_THROW(f.jvp(kX, kP, vector_t::Zero(2)), ArgumentError);
}

TEST_F(AdFunctionTest, StatisticsSayWhatWasMade) {
  const AdFunction f = created(sample, 3, 2);
  const AdFunctionStatistics s = f.statistics();
  EXPECT_EQ(s.route, "compiled");
  ASSERT_EQ(s.operations.size(), 3u);
  EXPECT_EQ(s.operations[0], 8u);  // p0 x0 x0 + sin(x1) x2: 5, p1 exp(x0) x2: 3
  EXPECT_LT(s.operations[0], s.operations[1]);
  EXPECT_LT(s.operations[1], s.operations[2]);
  EXPECT_TRUE(std::filesystem::exists(s.sourcePath));
}

TEST_F(AdFunctionTest, InterpreterAndCompilerAgreeToTheBit) {
  const AdFunction compiled = created(sample, 3, 2), tape = interpreted(sample, 3, 2);
  EXPECT_EQ(tape.statistics().route, "interpreter");
  const vector_t w = vector_t::Ones(3);
  EXPECT_EQ(compiled.getFunctionValue(kX, kP), tape.getFunctionValue(kX, kP));
  EXPECT_EQ(compiled.getJacobian(kX, kP), tape.getJacobian(kX, kP));
  EXPECT_EQ(compiled.getHessian(w, kX, kP), tape.getHessian(w, kX, kP));
}

TEST_F(AdFunctionTest, VerboseIsOneLine) {
  AdFunction f = make(sample, 3, 2, "told");
  ::testing::internal::CaptureStderr();
  f.createModels();
  const std::string first = ::testing::internal::GetCapturedStderr();
  EXPECT_TRUE(contains(first, "\"told\": compiled in ")) << first;
  EXPECT_EQ(std::count(first.begin(), first.end(), '\n'), 1) << first;
  ::testing::internal::CaptureStderr();
  f.loadModels();
  EXPECT_TRUE(contains(::testing::internal::GetCapturedStderr(), "loaded from the cache"));
}

TEST_F(AdFunctionTest, NoOutputsAndNoVariables) {
  const AdFunction none =
      created([](const ad_vector_t&, const ad_vector_t&, ad_vector_t& y) { y.resize(0); }, 2, 0);
  EXPECT_EQ(none.getJacobian(vector_t::Zero(2)).rows(), 0);
  EXPECT_EQ(none.getHessian(vector_t(), vector_t::Zero(2)), matrix_t::Zero(2, 2));
  const AdFunction fixed =
      created([](const ad_vector_t&, const ad_vector_t& p, ad_vector_t& y) { y = p; }, 0, 1);
  EXPECT_EQ(fixed.getFunctionValue(vector_t(), vector_t::Constant(1, 7))[0], 7);
  EXPECT_EQ(fixed.getJacobian(vector_t(), vector_t::Constant(1, 7)).cols(), 0);
}

}  // namespace
}  // namespace dyntape::ad_function_test
