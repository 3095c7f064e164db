// SPDX-License-Identifier: BSD-3-Clause
//
// CppAdInterface as its users call it.
#include <cmath>
#include <filesystem>
#include <thread>

#include "program.h"

namespace {

using ocs2::CppAdInterface;
using ocs2::matrix_t;
using ocs2::vector_t;
using ad_scalar_t = CppAdInterface::ad_scalar_t;
using ad_vector_t = CppAdInterface::ad_vector_t;
using Order = CppAdInterface::ApproximationOrder;
using dyntape::message_of;

void with_parameters(const ad_vector_t& x, const ad_vector_t& p, ad_vector_t& y) {
  y.resize(2);
  y(0) = p(0) * x(0) * x(0) + sin(x(1));
  y(1) = x(0) * x(1) * x(2) + p(1);
}

const vector_t kX = (vector_t(3) << 0.4, -0.7, 1.3).finished(), kP = (vector_t(2) << 2.5, -0.3).finished();

vector_t value() {
  return (vector_t(2) << kP[0] * kX[0] * kX[0] + std::sin(kX[1]), kX.prod() + kP[1]).finished();
}
matrix_t jacobian() {
  matrix_t J(2, 3);
  J << 2 * kP[0] * kX[0], std::cos(kX[1]), 0, kX[1] * kX[2], kX[0] * kX[2], kX[0] * kX[1];
  return J;
}
matrix_t hessian(double w0, double w1) {
  matrix_t H(3, 3);
  H << w0 * 2 * kP[0], w1 * kX[2], w1 * kX[1],        //
      w1 * kX[2], -w0 * std::sin(kX[1]), w1 * kX[0],  //
      w1 * kX[1], w1 * kX[0], 0;
  return H;
}

class Interface : public Program {};

TEST_F(Interface, ValueJacobianHessianOfAParameterizedFunction) {
  CppAdInterface f(with_parameters, 3, 2, "sample", folder(), {"-O1"});
  f.createModels(Order::Second, false);
  expect_near(f.getFunctionValue(kX, kP), value());
  expect_near(f.getJacobian(kX, kP), jacobian());
  expect_near(f.getHessian(0, kX, kP), hessian(1, 0));
  expect_near(f.getHessian(1, kX, kP), hessian(0, 1));
  const vector_t w = (vector_t(2) << 0.3, -2).finished();
  expect_near(f.getHessian(w, kX, kP), hessian(0.3, -2));
}

TEST_F(Interface, WithoutParameters) {
  const auto f = [](const ad_vector_t& x, ad_vector_t& y) { y = ad_vector_t::Constant(1, x.squaredNorm()); };
  CppAdInterface norm(f, 3, "norm", folder());
  norm.createModels(Order::Second, false);
  EXPECT_EQ(norm.getFunctionValue(kX)[0], kX.squaredNorm());
  expect_near(norm.getJacobian(kX), 2 * kX.transpose());
  expect_near(norm.getHessian(0, kX), 2 * matrix_t::Identity(3, 3));
  // Eigen's vectors of a fixed size go in as they are.
  EXPECT_EQ(norm.getFunctionValue(Eigen::Vector3d(1, 2, 2))[0], 9);
}

TEST_F(Interface, GaussNewton) {
  CppAdInterface f(with_parameters, 3, 2, "sample", folder());
  f.createModels(Order::First, false);
  const ocs2::ScalarFunctionQuadraticApproximation a = f.getGaussNewtonApproximation(kX, kP);
  EXPECT_NEAR(a.f, 0.5 * value().squaredNorm(), 1e-15);
  expect_near(a.dfdx, jacobian().transpose() * value());
  expect_near(a.dfdxx, jacobian().transpose() * jacobian());
  EXPECT_EQ(a.dfdu.size() + a.dfdux.size() + a.dfduu.size(), 0);
}

TEST_F(Interface, OneCallForAll) {
  CppAdInterface f(with_parameters, 3, 2, "sample", folder());
  f.createModels(Order::Second, false);
  const vector_t w = (vector_t(2) << 0.3, -2).finished();
  const ocs2::CppAdEvaluation all = f.getAll(kX, kP, w);
  expect_near(all.value, f.getFunctionValue(kX, kP), 0);
  expect_near(all.jacobian, f.getJacobian(kX, kP), 0);
  expect_near(all.hessian, f.getHessian(w, kX, kP), 0);
}

TEST_F(Interface, CopiesShareTheModel) {
  std::unique_ptr<CppAdInterface> copy;
  {
    CppAdInterface f(with_parameters, 3, 2, "sample", folder());
    f.createModels(Order::First, false);
    copy = std::make_unique<CppAdInterface>(f);
  }
  expect_near(copy->getJacobian(kX, kP), jacobian());
}

TEST_F(Interface, ALibraryOfAHigherOrderServes) {
  {
    CppAdInterface f(with_parameters, 3, 2, "sample", folder());
    EXPECT_NE(message_of<dyntape::NotCached>([&] { f.loadModels(false); }).find("sample"), std::string::npos);
    f.loadModelsIfAvailable(Order::Second, false);
    EXPECT_FALSE(f.function().statistics().timings.cache_hit);
  }
  CppAdInterface again(with_parameters, 3, 2, "sample", folder());
  again.createModels(Order::First, false);
  EXPECT_TRUE(again.function().statistics().timings.cache_hit);
  expect_near(again.getHessian(0, kX, kP), hessian(1, 0));
  CppAdInterface loaded(with_parameters, 3, 2, "sample", folder());
  loaded.loadModels(false);
  expect_near(loaded.getHessian(0, kX, kP), hessian(1, 0));
  CppAdInterface anew(with_parameters, 3, 2, "sample", folder());
  anew.settings().forceRebuild = true;  // OCS2's createModels
  anew.createModels(Order::First, false);
  EXPECT_FALSE(anew.function().statistics().timings.cache_hit);
}

TEST_F(Interface, AFolderIsRelativeToWhereTheProgramIs) {
  const auto here = std::filesystem::current_path();
  std::filesystem::current_path(folder());
  CppAdInterface f(with_parameters, 3, 2, "sample", "models");
  std::filesystem::current_path(here);
  f.createModels(Order::First, false);
  EXPECT_EQ(f.function().statistics().sourcePath.rfind(folder() + "/models/", 0), 0u)
      << f.function().statistics().sourcePath;
}

TEST_F(Interface, AChangedFunctionOfTheSameNameIsNotStale) {
  for (const double factor : {2.0, 14.0}) {
    const auto f = [factor](const ad_vector_t& x, ad_vector_t& y) {
      y = ad_vector_t::Constant(1, factor * x(0));
    };
    CppAdInterface model(f, 1, "same", folder());
    model.loadModelsIfAvailable(Order::First, false);
    EXPECT_EQ(model.getFunctionValue(vector_t::Ones(1))[0], factor);
  }
}

TEST_F(Interface, WhatAbortsThereIsAnExceptionHere) {
  CppAdInterface f(with_parameters, 3, 2, "leg-1 \"left\"", folder());  // a hyphen aborts there
  EXPECT_NE(message_of<dyntape::ArgumentError>([&] { f.getFunctionValue(kX, kP); }).find("no model yet"),
            std::string::npos);
  f.createModels(Order::First, false);
  EXPECT_NE(message_of<dyntape::ArgumentError>([&] { f.getHessian(0, kX, kP); }).find("needs order Second"),
            std::string::npos);
  EXPECT_NE(message_of<dyntape::ArgumentError>([&] { f.getJacobian(kP, kP); }).find("x has 2 entries"),
            std::string::npos);
  struct Theirs {};
  CppAdInterface throwing([](const ad_vector_t&, ad_vector_t&) { throw Theirs(); }, 1, "throwing", folder());
  EXPECT_THROW(throwing.createModels(Order::First, false), Theirs);
  f.createModels(Order::Second, false);  // the thread is as it was
  expect_near(f.getHessian(0, kX, kP), hessian(1, 0));
}

TEST_F(Interface, ResultsThatAreNotFinite) {
  const auto root = [](const ad_vector_t& x, ad_vector_t& y) { y = ad_vector_t::Constant(1, sqrt(x(0))); };
  CppAdInterface f(root, 1, "root", folder());
  f.createModels(Order::First, false);
  const vector_t at = vector_t::Constant(1, -1);
  const std::string said = message_of<dyntape::NumericalError>([&] { f.getFunctionValue(at); });
  EXPECT_NE(said.find("Sqrt"), std::string::npos) << said;
  EXPECT_THROW(f.getAll(at), dyntape::NumericalError);
  f.settings().checkFinite = false;  // OCS2 in a release build
  f.createModels(Order::First, false);
  EXPECT_TRUE(std::isnan(f.getFunctionValue(at)[0]));
}

TEST_F(Interface, RecordingAtOnes) {
  const auto branch = [](const ad_vector_t& x, ad_vector_t& y) {
    y = ad_vector_t::Constant(1, x(0) >= 1.0 ? x(0) : -x(0));
  };
  CppAdInterface f(branch, 1, "branch", folder());
  f.recordAtOnes();
  f.createModels(Order::First, false);
  EXPECT_EQ(f.getFunctionValue(vector_t::Constant(1, 3))[0], 3);
  // There the value is frozen to the branch of the tape; here leaving it is an error with the place of the comparison.
  const std::string said =
      message_of<dyntape::GuardViolation>([&] { f.getFunctionValue(vector_t::Constant(1, 0.5)); });
  EXPECT_NE(said.find("interface_test.cpp"), std::string::npos) << said;
}

TEST_F(Interface, ConstantsAreExact) {
  const auto third = [](const ad_vector_t& x, ad_vector_t& y) {
    y = ad_vector_t::Constant(1, x(0) * (1.0 / 3.0) + (0.1 + 0.2));
  };
  CppAdInterface f(third, 1, "third", folder());
  f.createModels(Order::First, false);
  EXPECT_EQ(f.getFunctionValue(vector_t::Ones(1))[0], 1.0 / 3.0 + (0.1 + 0.2));
  EXPECT_EQ(f.getJacobian(vector_t::Ones(1))(0, 0), 1.0 / 3.0);
}

TEST_F(Interface, ManyThreadsCallOneObject) {
  CppAdInterface f(with_parameters, 3, 2, "sample", folder());
  f.createModels(Order::First, false);
  std::vector<matrix_t> found(4);
  {
    std::vector<std::jthread> threads;
    for (matrix_t& J : found)
      threads.emplace_back([&] {
        for (int k = 0; k < 200; ++k) J = f.getJacobian(kX, kP);
      });
  }
  for (const matrix_t& J : found) expect_near(J, jacobian());
}

TEST_F(Interface, Patterns) {
  CppAdInterface f(with_parameters, 3, 2, "sample", folder());
  f.createModels(Order::Second, false);
  using Pattern = ocs2::cppad_sparsity::SparsityPattern;
  EXPECT_EQ(f.getJacobianSparsityPattern(), (Pattern{{0, 1}, {0, 1, 2}}));
  EXPECT_EQ(f.getHessianSparsityPattern(), (Pattern{{0, 1, 2}, {0, 1, 2}, {0, 1}}));
}

TEST(Sparsity, OfATape) {
  ocs2::ad_vector_t x = ocs2::ad_vector_t::Ones(5);
  ocs2::Independent(x);
  ocs2::ad_vector_t y;
  with_parameters(x.head(3), x.tail(2), y);
  ocs2::ad_fun_t tape(x, y);
  tape.optimize();
  EXPECT_EQ(tape.Domain(), 5u);
  EXPECT_EQ(tape.Range(), 2u);
  namespace sparsity = ocs2::cppad_sparsity;
  const auto jacobian = sparsity::getIntersection(sparsity::getJacobianSparsityPattern(tape),
                                                  sparsity::getJacobianVariableSparsity(2, 3));
  EXPECT_EQ(jacobian, (sparsity::SparsityPattern{{0, 1}, {0, 1, 2}}));
  const auto hessian = sparsity::getIntersection(sparsity::getHessianSparsityPattern(tape),
                                                 sparsity::getHessianVariableSparsity(3, 2));
  EXPECT_EQ(hessian, (sparsity::SparsityPattern{{0, 1, 2}, {1, 2}, {}, {}, {}}));
  EXPECT_EQ(sparsity::getNumberOfNonZeros(hessian), 5u);
  EXPECT_THROW(sparsity::getIntersection(jacobian, hessian), dyntape::ArgumentError);
}

TEST(Sparsity, ATapeThatIsLeftOpenHurtsNobody) {
  ocs2::ad_vector_t x = ocs2::ad_vector_t::Ones(2);
  EXPECT_THROW(ocs2::ad_fun_t(x, x), dyntape::ArgumentError);
  ocs2::Independent(x);  // and an exception leaves it open
  ocs2::ad_vector_t z = ocs2::ad_vector_t::Constant(1, 2.0);
  ocs2::Independent(z);
  const ocs2::ad_fun_t tape(z, z.cwiseProduct(z));
  EXPECT_EQ(tape.Domain(), 1u);
}

// --- What a client keeps of its own -----------------------------------------------------------------------

struct TheirQuadratic {
  double f = 0;
  Eigen::VectorXd dfdx, dfdu;
  Eigen::MatrixXd dfdxx, dfdux, dfduu;
};
struct TheirLinear {
  Eigen::VectorXd f;
  Eigen::MatrixXd dfdx, dfdu;
};

TEST_F(Interface, ResultsBecomeTheClientsStructs) {
  CppAdInterface f(with_parameters, 3, 2, "sample", folder());
  f.createModels(Order::First, false);
  const TheirQuadratic theirs = f.getGaussNewtonApproximation(kX, kP);
  expect_near(theirs.dfdxx, jacobian().transpose() * jacobian());
  ocs2::VectorFunctionLinearApproximation ours;
  ours.f = f.getFunctionValue(kX, kP), ours.dfdx = f.getJacobian(kX, kP);
  const TheirLinear linear = ours;
  expect_near(linear.dfdx, jacobian());
}

struct LeggedSettings {
  double positionErrorGain = 0;
  bool verboseCppAd = false, recompileLibrariesCppAd = true;
  std::string modelFolderCppAd;
};

TEST_F(Interface, TheClientsModelSettings) {
  const LeggedSettings theirs{.modelFolderCppAd = folder()};
  for (const bool was_there : {false, true}) {
    CppAdInterface f(with_parameters, 3, 2, ocs2::settingsFrom(theirs, "dynamics"));
    f.createModels(Order::First, theirs.verboseCppAd);
    EXPECT_EQ(f.function().statistics().timings.cache_hit, was_there);
    EXPECT_EQ(f.getModelName(), "dynamics");
  }
  EXPECT_TRUE(ocs2::settingsFrom(theirs, "dynamics", true).forceRebuild);
  EXPECT_FALSE(ocs2::settingsFrom(ocs2::ModelSettings(), "dynamics").forceRebuild);
}

}  // namespace
