// SPDX-License-Identifier: BSD-3-Clause
// Files of models: written by createDynamicLibrary, read by LinuxDynamicLib.
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/cppad/cg.h>

#include <cstdlib>
#include <filesystem>

#include "interface/cppad/programs.h"

namespace cg_file_test {
namespace {

using namespace CppAD::cg;
using CGD = CG<double>;
using ADCG = AD<CGD>;
namespace fs = std::filesystem;

class CppadCgFile : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "dyntape_models_XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  fs::path folder_;
};

// Operators of one, two and three arguments, constants that need all digits, a branch, dynamic parameters.
std::unique_ptr<ADFun<CGD>> recorded() {
  std::vector<ADCG> x(3), p(1), y(3);
  x[0] = 0.5, x[1] = 2.0, x[2] = -3.0;
  p[0] = 0.25;
  Independent(x, 0, true, p);
  y[0] = atan2(x[0], x[1]) * (1.0 / 3.0) + p[0] * x[2];
  y[1] = CondExpLt(x[0], x[2], exp(x[1]), pow(x[1], x[0])) - 1e-300;
  y[2] = x[0] < x[1] ? sin(x[0]) / x[2] : x[0];
  return std::make_unique<ADFun<CGD>>(x, y);
}

void create_all(ModelCSourceGen<double>& source) {
  source.setCreateJacobian(true);
  source.setCreateHessian(true);
  source.setCreateSparseJacobian(true);
  source.setCreateSparseHessian(true);
}

std::unique_ptr<DynamicLib<double>> written(const std::string& name, const std::string& model = "model") {
  const auto f = recorded();
  ModelCSourceGen<double> source(*f, model);
  create_all(source);
  const std::vector<std::size_t> row{2, 0}, col{0, 1};
  source.setCustomSparseJacobianElements(row, col);
  ModelLibraryCSourceGen<double> sources(source);
  DynamicModelLibraryProcessor<double> processor(sources, name);
  GccCompiler<double> compiler;
  return processor.createDynamicLibrary(compiler);
}

TEST_F(CppadCgFile, HasTheSameBitsWhenItIsReadAgain) {
  const auto library = written(path("models"));
  fs::rename(path("models.so"), path("renamed.so"));  // as OCS2 does
  const LinuxDynamicLib<double> again(path("renamed.so"));
  EXPECT_EQ(again.getModelNames(), std::set<std::string>{"model"});
  const auto a = library->model("model"), b = again.model("model");
  for (const std::vector<double>& x : {std::vector<double>{0.5, 2, -3}, {-1.25, 0.75, 10}, {1e-9, 1e9, 3}}) {
    EXPECT_EQ(a->ForwardZero(x), b->ForwardZero(x));
    EXPECT_EQ(a->Jacobian(x), b->Jacobian(x));
    EXPECT_EQ(a->Hessian(x, std::vector<double>{1, -2, 0.5}), b->Hessian(x, std::vector<double>{1, -2, 0.5}));
  }
  EXPECT_NEAR(b->ForwardZero(std::vector<double>{0.5, 2, -3})[0], std::atan2(0.5, 2) / 3 - 0.75, 1e-15);
  std::vector<std::size_t> row, col;
  b->JacobianSparsity(row, col);
  EXPECT_EQ(row, (std::vector<std::size_t>{2, 0}));
  EXPECT_EQ(col, (std::vector<std::size_t>{0, 1}));
  EXPECT_FALSE(b->isForwardOneAvailable());
  EXPECT_THROW(b->ForwardZero(std::vector<double>{3, 2, 1}), dyntape::GuardViolation);
}

TEST_F(CppadCgFile, MayBeReadWithoutACompilerOrACache) {
  written(path("models"));
  std::string text = dyntape::read_file(path("models.so"));
  const std::string compiler = R"("compiler":"gcc")";
  ASSERT_NE(text.find(compiler), std::string::npos) << text.substr(0, 200);
  text.replace(text.find(compiler), compiler.size(), R"("compiler":"")");
  dyntape::write_file_atomically(path("any.so"), text);
  const LinuxDynamicLib<double> library(path("any.so"));
  EXPECT_NEAR(library.model("model")->ForwardZero(std::vector<double>{0.5, 2, -3})[0],
              std::atan2(0.5, 2) / 3 - 0.75, 1e-15);
}

TEST_F(CppadCgFile, IsReplacedByTheNextLibraryOfItsName) {
  written(path("models"), "first");
  written(path("models"), "second");
  EXPECT_EQ(LinuxDynamicLib<double>(path("models.so")).getModelNames(), std::set<std::string>{"second"});
}

TEST_F(CppadCgFile, IsNotWrittenForFunctionsOfTheUserAndLeavesNoOlderOne) {
  written(path("models"));
  struct Twice : CppAD::atomic_three<CGD> {
    Twice() : CppAD::atomic_three<CGD>("twice") {}
    bool for_type(const CppAD::vector<CGD>&, const CppAD::vector<CppAD::ad_type_enum>& of_x,
                  CppAD::vector<CppAD::ad_type_enum>& of_y) override {
      of_y[0] = of_x[0];
      return true;
    }
    bool forward(const CppAD::vector<CGD>&, const CppAD::vector<CppAD::ad_type_enum>&, std::size_t,
                 std::size_t, std::size_t order_up, const CppAD::vector<CGD>& x,
                 CppAD::vector<CGD>& y) override {
      if (order_up > 0) return false;
      y[0] = x[0] * 2.0;
      return true;
    }
  } twice;
  CppAD::vector<ADCG> x(1), y(1);
  x[0] = 1.0;
  Independent(x);
  twice(x, y);
  ADFun<CGD> f(x, y);
  ModelCSourceGen<double> source(f, "model");
  ModelLibraryCSourceGen<double> sources(source);
  DynamicModelLibraryProcessor<double> processor(sources, path("models"));
  GccCompiler<double> compiler;
  const auto library = processor.createDynamicLibrary(compiler);
  EXPECT_FALSE(fs::exists(path("models.so")));
  EXPECT_THROW(LinuxDynamicLib<double>(path("models.so")), dyntape::FileError);
}

TEST_F(CppadCgFile, NamesTheFileThatIsMissingDamagedOrOfAnotherKind) {
  const auto sentence = [&](const std::string& name) {
    return sentence_of<dyntape::FileError>([&] { LinuxDynamicLib<double> read(path(name)); });
  };
  EXPECT_NE(sentence("none.so").find("none.so"), std::string::npos);
  dyntape::write_file_atomically(path("other.so"),
                                 "\x7f"
                                 "ELF\x02\x01");
  EXPECT_NE(sentence("other.so").find("no library of models"), std::string::npos) << sentence("other.so");
  written(path("models"));
  const std::string text = dyntape::read_file(path("models.so"));
  dyntape::write_file_atomically(path("half.so"), text.substr(0, text.size() / 2));
  EXPECT_NE(sentence("half.so").find("no library of models"), std::string::npos) << sentence("half.so");
  for (const auto& [from, to] :
       std::vector<std::pair<std::string, std::string>>{{"\"Pow\"", "\"Powder\""},
                                                        {"[\"Input\",0,", "[\"Input\",9,"},
                                                        {"\"Pow\"", "\"Hypot\""},
                                                        {"\"Atan2\",", "\"Atan2\",90"}}) {
    std::string changed = text;
    const std::size_t at = changed.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    changed.replace(at, from.size(), to);
    dyntape::write_file_atomically(path("changed.so"), changed);
    EXPECT_NE(sentence("changed.so").find("no library of models"), std::string::npos) << to;
  }
}

}  // namespace
}  // namespace cg_file_test
