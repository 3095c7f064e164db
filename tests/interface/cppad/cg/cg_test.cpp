// SPDX-License-Identifier: BSD-3-Clause
// Programs written for CppADCodeGen's classes.
#include <dyntape/autodiff/own_sines.h>
#include <dyntape/interface/cppad/cg.h>

#include <filesystem>
#include <sstream>
#include <thread>

#include "interface/cppad/cg/library.h"
#include "interface/cppad/programs.h"

namespace {

using namespace CppAD::cg;
using cg_tests::CGD;
using cg_tests::everything;
using cg_tests::Library;
using ADCG = AD<CGD>;

// y0 = x0 / 2 + x1^2, y1 = sin(x0) x2
std::unique_ptr<ADFun<CGD>> example() {
  std::vector<ADCG> x(3), y(2);
  for (auto& v : x) v = 1.0;
  Independent(x);
  y[0] = x[0] / 2.0 + x[1] * x[1];
  y[1] = sin(x[0]) * x[2];
  return std::make_unique<ADFun<CGD>>(x, y);
}
const std::vector<double> kAt{0.5, 2, 3};
const double kSin = std::sin(0.5), kCos = std::cos(0.5);

TEST(CppadCg, ForwardZero) {
  const Library l(example(), [](auto&) {});
  EXPECT_EQ(l.model->ForwardZero(kAt), (std::vector<double>{4.25, kSin * 3}));
  std::vector<double> y(2);
  l.model->ForwardZero(kAt, y);
  EXPECT_EQ(y[0], 4.25);
  expect_near(l.model->ForwardZero(DVector{0.5, 2, 3}), {4.25, kSin * 3});
  EXPECT_EQ(l.model->Domain(), 3u);
  EXPECT_EQ(l.model->Range(), 2u);
  EXPECT_EQ(l.model->getName(), "model");
}

TEST(CppadCg, DenseJacobian) {
  const Library l(example());
  expect_near(l.model->Jacobian(DVector{0.5, 2, 3}), {0.5, 4, 0, kCos * 3, 0, kSin});
}

TEST(CppadCg, DenseHessian) {
  const Library l(example());
  expect_near(l.model->Hessian(DVector{0.5, 2, 3}, DVector{1, 1}), {-kSin * 3, 0, kCos, 0, 2, 0, kCos, 0, 0});
  expect_near(l.model->Hessian(DVector{0.5, 2, 3}, std::size_t(0)), {0, 0, 0, 0, 2, 0, 0, 0, 0});
}

TEST(CppadCg, SparseJacobian) {
  const Library l(example());
  std::vector<double> values;
  std::vector<std::size_t> row, col;
  l.model->SparseJacobian(kAt, values, row, col);
  EXPECT_EQ(row, (std::vector<std::size_t>{0, 0, 1, 1}));
  EXPECT_EQ(col, (std::vector<std::size_t>{0, 1, 0, 2}));
  EXPECT_EQ(values, (std::vector<double>{0.5, 4, kCos * 3, kSin}));
  expect_near(l.model->SparseJacobian(DVector{0.5, 2, 3}), {0.5, 4, 0, kCos * 3, 0, kSin});
}

TEST(CppadCg, SparseJacobianIntoViews) {
  const Library l(example());
  std::vector<double> values(4);
  const std::size_t *row, *col;
  l.model->SparseJacobian(ArrayView<const double>(kAt), ArrayView<double>(values), &row, &col);
  EXPECT_EQ(values[1], 4);
  EXPECT_EQ(row[3], 1u);
  EXPECT_EQ(col[3], 2u);
}

TEST(CppadCg, SparseHessianHasBothTriangles) {
  const Library l(example());
  std::vector<double> values;
  std::vector<std::size_t> row, col;
  l.model->SparseHessian(kAt, std::vector<double>{1, 1}, values, row, col);
  EXPECT_EQ(row, (std::vector<std::size_t>{0, 0, 1, 2}));
  EXPECT_EQ(col, (std::vector<std::size_t>{0, 2, 1, 0}));
  EXPECT_EQ(values, (std::vector<double>{-kSin * 3, kCos, 2, kCos}));
}

TEST(CppadCg, CustomElements) {
  const Library l(example(), [](ModelCSourceGen<double>& source) {
    everything(source);
    source.setCustomSparseJacobianElements(std::vector<std::size_t>{1, 0, 0},
                                           std::vector<std::size_t>{2, 1, 2});
    source.setCustomSparseHessianElements(std::vector<std::set<std::size_t>>{{0}, {}, {0}});
  });
  std::vector<double> values;
  std::vector<std::size_t> row, col;
  l.model->SparseJacobian(kAt, values, row, col);
  EXPECT_EQ(values, (std::vector<double>{kSin, 4, 0}));
  l.model->SparseHessian(kAt, std::vector<double>{1, 1}, values, row, col);
  EXPECT_EQ(row, (std::vector<std::size_t>{0, 2}));
  EXPECT_EQ(values, (std::vector<double>{-kSin * 3, kCos}));
}

TEST(CppadCg, ForwardOne) {
  const Library l(example());
  expect_near(l.model->ForwardOne(DVector{0.5, 1, 2, 0, 3, 10}), {0.5, kCos * 3 + 10 * kSin});
}

TEST(CppadCg, ReverseOne) {
  const Library l(example());
  expect_near(l.model->ReverseOne(DVector{0.5, 2, 3}, DVector{4.25, kSin * 3}, DVector{2, 10}),
              {1 + 30 * kCos, 8, 10 * kSin});
}

TEST(CppadCg, ReverseTwoAsTheInterpreterDoes) {
  const Library l(example());
  ADFun<double> f = recorded({1, 1, 1}, [](const AVector& x) -> std::vector<ADouble> {
    return {x[0] / 2.0 + x[1] * x[1], sin(x[0]) * x[2]};
  });
  const DVector tx{0.5, 1, 2, -1, 3, 2}, py{5, 2, 7, 10};
  f.Forward(0, DVector{0.5, 2, 3}), f.Forward(1, DVector{1, -1, 2});
  const DVector expected = f.Reverse(2, py);
  expect_near(l.model->ReverseTwo(tx, DVector(4), py), std::vector<double>(expected.begin(), expected.end()));
}

TEST(CppadCg, Patterns) {
  const Library l(example());
  EXPECT_EQ(l.model->JacobianSparsitySet(), (std::vector<std::set<std::size_t>>{{0, 1}, {0, 2}}));
  EXPECT_EQ(l.model->HessianSparsitySet(), (std::vector<std::set<std::size_t>>{{0, 2}, {1}, {0}}));
  EXPECT_EQ(l.model->JacobianSparsityBool(), (std::vector<bool>{true, true, false, true, false, true}));
  std::vector<std::size_t> row, col;
  l.model->HessianSparsity(row, col);
  EXPECT_EQ(row.size(), 4u);
}

TEST(CppadCg, WhatWasNotCreatedIsSaid) {
  const Library l(example(), [](auto&) {});
  EXPECT_FALSE(l.model->isJacobianAvailable());
  EXPECT_TRUE(l.model->isForwardZeroAvailable());
  const std::string sentence = sentence_of<dyntape::ArgumentError>([&] { l.model->Jacobian(kAt); });
  EXPECT_NE(sentence.find("setCreateJacobian(true)"), std::string::npos) << sentence;
  EXPECT_NE(sentence_of<dyntape::ArgumentError>([&] { l.library->model("mode"); }).find("there are model"),
            std::string::npos);
  EXPECT_NE(sentence_of<dyntape::ArgumentError>([&] {
              l.model->ForwardZero(std::vector<double>{1});
            }).find("expected 3"),
            std::string::npos);
}

TEST(CppadCg, LibrariesOfSeveralModels) {
  const auto f = example(), g = example();
  ModelCSourceGen<double> one(*f, "one"), two(*g, "two");
  two.setCreateJacobian(true);
  ModelLibraryCSourceGen<double> sources(one);
  sources.addModel(two);
  DynamicModelLibraryProcessor<double> processor(sources, "both");
  EXPECT_EQ(processor.getLibraryName(), "both");
  processor.getOptions()["dlOpenMode"] = "1";
  GccCompiler<double> compiler;
  compiler.setCompileFlags({"-O1"});
  const auto library = processor.createDynamicLibrary(compiler);
  EXPECT_EQ(library->getModelNames(), (std::set<std::string>{"one", "two"}));
  EXPECT_TRUE(library->model("two")->isJacobianAvailable());
  EXPECT_FALSE(library->model("one")->isJacobianAvailable());
}

TEST(CppadCg, SourcesAreSaved) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "cppad_cg_sources";
  std::filesystem::remove_all(folder);
  const auto f = example();
  ModelCSourceGen<double> source(*f, "saved");
  source.setCreateSparseJacobian(true);
  ModelLibraryCSourceGen<double> sources(source);
  SaveFilesModelLibraryProcessor<double> processor(sources);
  processor.saveSourcesTo(folder.string());
  EXPECT_TRUE(std::filesystem::exists(folder / "saved.c"));
  std::filesystem::remove_all(folder);
}

TEST(CppadCg, OptionsThatTuneAreTaken) {
  const Library l(example(), [](ModelCSourceGen<double>& source) {
    everything(source);
    source.setJacobianADMode(JacobianADMode::Reverse);
    source.setParameterPrecision(17);
    source.setMaxAssignmentsPerFunc(100);
    source.setMaxOperationsPerAssignment(10);
    source.setMultiThreading(true);
    source.setTypicalIndependentValues(kAt);
    source.setRelatedDependents({{0}, {1}});
    EXPECT_TRUE(source.isCreateReverseTwo());
  });
  EXPECT_EQ(l.model->ForwardZero(kAt)[0], 4.25);
}

TEST(CppadCg, AfterOptimize) {
  auto f = example();
  f->optimize();
  ModelCSourceGen<double> source(*f, "optimized");
  ModelLibraryCSourceGen<double> sources(source);
  DynamicModelLibraryProcessor<double> processor(sources);
  ClangCompiler<double> compiler("cc");
  EXPECT_EQ(processor.createDynamicLibrary(compiler)->model("optimized")->ForwardZero(kAt)[0], 4.25);
}

TEST(CppadCg, ConditionsAndGuards) {
  std::vector<ADCG> x(1), y(2);
  x[0] = 2.0;
  Independent(x);
  y[0] = CondExpGt(x[0], ADCG(0.0), sqrt(x[0]), ADCG(0.0));
  y[1] = x[0] > 1.0 ? x[0] * x[0] : x[0];
  ADFun<CGD> f(x, y);
  ModelCSourceGen<double> source(f, "guarded");
  source.setCreateJacobian(true);
  ModelLibraryCSourceGen<double> sources(source);
  DynamicModelLibraryProcessor<double> processor(sources);
  GccCompiler<double> compiler;
  const auto model = processor.createDynamicLibrary(compiler)->model("guarded");
  expect_near(model->Jacobian(DVector{4}), {0.25, 8});
  EXPECT_THROW(model->Jacobian(DVector{0}), dyntape::GuardViolation);
}

TEST(CppadCg, NoNanFromWhatIsNotTaken) {
  std::vector<ADCG> x(1), y(1);
  x[0] = 2.0;
  Independent(x);
  y[0] = CondExpGt(x[0], ADCG(0.0), sqrt(x[0]), ADCG(0.0));
  ADFun<CGD> f(x, y);
  ModelCSourceGen<double> source(f, "sinc");
  everything(source);
  ModelLibraryCSourceGen<double> sources(source);
  DynamicModelLibraryProcessor<double> processor(sources);
  GccCompiler<double> compiler;
  const auto model = processor.createDynamicLibrary(compiler)->model("sinc");
  for (double at : {0.0, -1.0}) {
    expect_near(model->Jacobian(DVector{at}), {0});
    expect_near(model->Hessian(DVector{at}, DVector{1}), {0});
    expect_near(model->ReverseTwo(DVector{at, 1}, DVector{0, 0}, DVector{0, 1}), {0, 0});
  }
}

TEST(CppadCg, ThreadsShareAModel) {
  const Library l(example());
  std::vector<std::thread> threads;
  std::vector<int> right(4, 0);
  for (std::size_t t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (int k = 0; k < 200; ++k) {
        const double x0 = 0.01 * k + double(t);
        right[t] += l.model->Jacobian(std::vector<double>{x0, 2, 3})[3] == dyntape::own::cos(x0) * 3;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(right, std::vector<int>(4, 200));
}

TEST(CppadCg, CodeHandlerPrintsDerivatives) {
  auto f = example();
  CodeHandler<double> handler;
  CppAD::vector<CGD> x(3);
  for (CGD& v : x) v = 1.0;
  handler.makeVariables(x);
  CppAD::vector<CGD> J = f->Jacobian(x);
  LanguageC<double> language("double");
  language.setGenerateFunction("jacobian");
  LangCDefaultVariableNameGenerator<double> names;
  std::ostringstream code;
  handler.generateCode(code, language, J, names);
  EXPECT_NE(code.str().find("jacobian_value"), std::string::npos) << code.str();
  EXPECT_NE(code.str().find("cos("), std::string::npos);
}

TEST(CppadCg, CodeHandlerPrintsSeveralTimes) {
  CodeHandler<double> first;
  CppAD::vector<CGD> x(2);
  x[0] = 1.0, x[1] = 2.0;
  first.makeVariables(x);
  LanguageC<double> language("double");
  LangCDefaultVariableNameGenerator<double> names;
  const auto text = [&](CodeHandler<double>& handler, const CGD& y) {
    CppAD::vector<CGD> dependent(1);
    dependent[0] = y;
    std::ostringstream code;
    handler.generateCode(code, language, dependent, names);
    return code.str();
  };
  const std::string product = text(first, x[0] * x[1]), again = text(first, x[0] * x[1]);
  EXPECT_EQ(product, again);
  EXPECT_NE(text(first, sin(x[0])), product);
  {
    CodeHandler<double> second;  // ends the recording of the first
    CppAD::vector<CGD> z(1);
    z[0] = 1.0;
    second.makeVariables(z);
    EXPECT_NE(text(second, cos(z[0])).find("cos"), std::string::npos);
  }
  EXPECT_THROW(text(first, x[0]), dyntape::RecordingError);
}

TEST(CppadCg, ValuesOfTheScalar) {
  CGD a = 2.5;
  EXPECT_TRUE(a.isParameter() && !a.isVariable() && a.isValueDefined());
  EXPECT_EQ(a.getValue(), 2.5);
  a.setValue(0);
  EXPECT_TRUE(a.isIdenticalZero());
  EXPECT_TRUE(CGD(1).isIdenticalOne());
}

}  // namespace
