// SPDX-License-Identifier: BSD-3-Clause
// CppADCodeGen's functions in recordings, patterns, C of the user's, and C of expressions.
#include <dyntape/interface/cppad/cg.h>

#include <dlfcn.h>
#include <unistd.h>

#include <filesystem>
#include <sstream>

#include "interface/cppad/programs.h"

namespace dyntape::cppad_cg_atomic_test {
namespace {

using namespace CppAD::cg;
using CppAD::AD;
using CppAD::ADFun;
using CGD = CG<double>;
using ADCG = AD<CGD>;
using Sets = std::vector<std::set<std::size_t>>;

// y0 = x0 x1, y1 = sin(x1)
template <class Vector>
void product_and_sine(const Vector& x, Vector& y) {
  y[0] = x[0] * x[1];
  y[1] = sin(x[1]);
}
const std::vector<double> kAt{0.7, 1.9};
void expect_close(const std::vector<double>& got, const std::vector<double>& expected) {
  expect_near(DVector(got.begin(), got.end()), expected);
}

// z = y0^2 + y1 of the inner function: a library with all derivatives.
template <class Atomic>
std::unique_ptr<GenericModel<double>> outer_model(Atomic& atomic) {
  std::vector<ADCG> x(2), y(2), z(1);
  for (std::size_t j = 0; j < 2; ++j) x[j] = kAt[j];
  Independent(x);
  atomic(x, y);
  z[0] = y[0] * y[0] + y[1];
  ADFun<CGD> f;
  f.Dependent(z);
  ModelCSourceGen<double> source(f, "outer");
  source.setCreateJacobian(true);
  source.setCreateHessian(true);
  ModelLibraryCSourceGen<double> sources(source);
  DynamicModelLibraryProcessor<double> processor(sources);
  GccCompiler<double> compiler;
  return processor.createDynamicLibrary(compiler)->model("outer");
}
void expect_outer(GenericModel<double>& model) {
  const double a = kAt[0], b = kAt[1];
  expect_close(model.ForwardZero(kAt), {a * a * b * b + std::sin(b)});
  expect_close(model.Jacobian(kAt), {2 * a * b * b, 2 * a * a * b + std::cos(b)});
  expect_close(model.Hessian(kAt, std::vector<double>{1}),
               {2 * b * b, 4 * a * b, 4 * a * b, 2 * a * a - std::sin(b)});
}

std::unique_ptr<ADFun<CGD>> inner_function() {
  std::vector<ADCG> x(2), y(2);
  for (std::size_t j = 0; j < 2; ++j) x[j] = kAt[j];
  Independent(x);
  product_and_sine(x, y);
  return std::make_unique<ADFun<CGD>>(x, y);
}

std::unique_ptr<GenericModel<double>> inner_model() {
  const auto f = inner_function();
  ModelCSourceGen<double> source(*f, "inner");
  ModelLibraryCSourceGen<double> sources(source);
  DynamicModelLibraryProcessor<double> processor(sources);
  GccCompiler<double> compiler;
  return processor.createDynamicLibrary(compiler)->model("inner");
}

TEST(CppadCgAtomic, ACheckpointInALibrary) {
  std::vector<AD<double>> ax(2), ay(2);
  for (std::size_t j = 0; j < 2; ++j) ax[j] = kAt[j];
  CppAD::checkpoint<double> inner("inner", product_and_sine<std::vector<AD<double>>>, ax, ay);
  CGAtomicFun<double> again(inner, kAt, true);
  expect_outer(*outer_model(again));
}

TEST(CppadCgAtomic, ARecordedFunctionUnderAName) {
  const auto f = inner_function();
  CGAtomicFunBridge<double> bridge("inner", *f, true);
  expect_outer(*outer_model(bridge));
  CppAD::atomic_base<CGD>& base = bridge;  // as programs pass them on
  expect_outer(*outer_model(base));
  using CSets = CppAD::vector<std::set<std::size_t>>;
  const CSets jacobian = bridge.jacobianForwardSparsitySet(2, CppAD::vector<CGD>(2)),
              hessian = bridge.hessianSparsitySet(2, CppAD::vector<CGD>(2));
  EXPECT_EQ(Sets(jacobian.begin(), jacobian.end()), (Sets{{0, 1}, {1}}));
  EXPECT_EQ(Sets(hessian.begin(), hessian.end()), (Sets{{1}, {0, 1}}));
}

TEST(CppadCgAtomic, AModelInALibraryThatOutlivesIt) {
  auto model = inner_model();
  CGAtomicFun<double> of_model(model->asAtomic(), std::vector<double>(2), true);
  const auto outer = outer_model(of_model);
  outer->addAtomicFunction(model->asAtomic());
  EXPECT_TRUE(outer->getAtomicFunctionNames().empty());
  model.reset();
  expect_outer(*outer);
}

TEST(CppadCgAtomic, AModelInARecordingOfNumbers) {
  std::vector<AD<double>> x(2), y(2);
  for (std::size_t j = 0; j < 2; ++j) x[j] = kAt[j];
  ADFun<double> f;
  {
    const auto model = inner_model();
    Independent(x);
    model->asAtomic()(x, y);
    f.Dependent(x, y);
  }
  expect_close(f.Jacobian(kAt), {kAt[1], kAt[0], 0, std::cos(kAt[1])});
  expect_close(f.Hessian(kAt, std::size_t(0)), {0, 1, 1, 0});
}

TEST(CppadCgAtomic, TheWrongNumberOfArguments) {
  const auto model = inner_model();
  std::vector<AD<double>> x(3), y(2);
  const std::string sentence = sentence_of<ArgumentError>([&] { model->asAtomic()(x, y); });
  EXPECT_NE(sentence.find("\"inner\": got 3 arguments and 2 results, expected 2 and 2"), std::string::npos)
      << sentence;
}

// By hand: order 0 and 1 forward, 1 and 2 reverse, of numbers and of AD.
class ByHand : public CppAD::atomic_three<double> {
 public:
  ByHand() : CppAD::atomic_three<double>("by_hand") {}

 private:
  using Types = CppAD::vector<CppAD::ad_type_enum>;
  template <class S>
  static bool coefficients_of(std::size_t up, const CppAD::vector<S>& tx, CppAD::vector<S>& ty) {
    if (up > 1) return false;
    const std::size_t q = up + 1;
    const S a = tx[0], b = tx[q];
    ty[0] = a * b, ty[q] = sin(b);
    if (up == 1) ty[1] = tx[1] * b + a * tx[q + 1], ty[q + 1] = cos(b) * tx[q + 1];
    return true;
  }
  template <class S>
  static bool adjoints_of(std::size_t up, const CppAD::vector<S>& tx, CppAD::vector<S>& px,
                          const CppAD::vector<S>& py) {
    if (up > 1) return false;
    const std::size_t q = up + 1;
    const S a = tx[0], b = tx[q];
    px[0] = py[0] * b, px[q] = py[0] * a + py[q] * cos(b);
    if (up == 1) {
      const S da = tx[1], db = tx[q + 1];
      px[0] += py[1] * db, px[q] += py[1] * da - py[q + 1] * sin(b) * db;
      px[1] = py[1] * b, px[q + 1] = py[1] * a + py[q + 1] * cos(b);
    }
    return true;
  }
  bool for_type(const CppAD::vector<double>&, const Types& x, Types& y) override {
    y[0] = std::max(x[0], x[1]), y[1] = x[1];
    return true;
  }
  bool forward(const CppAD::vector<double>&, const Types&, std::size_t, std::size_t, std::size_t up,
               const CppAD::vector<double>& tx, CppAD::vector<double>& ty) override {
    return coefficients_of(up, tx, ty);
  }
  bool forward(const CppAD::vector<AD<double>>&, const Types&, std::size_t, std::size_t, std::size_t up,
               const CppAD::vector<AD<double>>& tx, CppAD::vector<AD<double>>& ty) override {
    return coefficients_of(up, tx, ty);
  }
  bool reverse(const CppAD::vector<double>&, const Types&, std::size_t up, const CppAD::vector<double>& tx,
               const CppAD::vector<double>&, CppAD::vector<double>& px,
               const CppAD::vector<double>& py) override {
    return adjoints_of(up, tx, px, py);
  }
  bool reverse(const CppAD::vector<AD<double>>&, const Types&, std::size_t up,
               const CppAD::vector<AD<double>>& tx, const CppAD::vector<AD<double>>&,
               CppAD::vector<AD<double>>& px, const CppAD::vector<AD<double>>& py) override {
    return adjoints_of(up, tx, px, py);
  }
};

TEST(CppadCgAtomic, AFunctionByHandInALibrary) {
  ByHand by_hand;
  CGAtomicFun<double> again(by_hand, kAt);
  expect_outer(*outer_model(again));
}

TEST(CppadCgAtomic, AFunctionByHandIsDerivedAndRecordedAgain) {
  ByHand by_hand;
  CGAtomicFun<double> again(by_hand, kAt);
  std::vector<ADCG> x(2), y(2);
  for (std::size_t j = 0; j < 2; ++j) x[j] = kAt[j];
  Independent(x);
  again(x, y);
  ADFun<CGD> f(x, y);
  const std::vector<CGD> at{kAt[0], kAt[1]};
  const auto J = f.Jacobian(at);
  expect_close({J[0].getValue(), J[1].getValue(), J[2].getValue(), J[3].getValue()},
               {kAt[1], kAt[0], 0, std::cos(kAt[1])});
  // Its derivatives as a function of numbers.
  std::vector<CGD> ax = at;
  Independent(ax);
  const std::vector<CGD> aJ = f.Jacobian(ax);
  ADFun<double> g(ax, aJ);
  expect_close(g.Jacobian(kAt), {0, 1, 1, 0, 0, 0, 0, -std::sin(kAt[1])});
}

TEST(CppadCgSparsity, PatternsOfAFunction) {
  std::vector<AD<double>> x{1.0, 2.0, 3.0}, y(2);
  Independent(x);
  y[0] = x[0] * x[2];
  y[1] = 2 * x[1];
  ADFun<double> f(x, y);
  const Sets jacobian{{0, 2}, {1}}, hessian{{2}, {}, {0}};
  EXPECT_EQ((jacobianSparsitySet<Sets, double>(f)), jacobian);
  EXPECT_EQ((jacobianForwardSparsitySet<Sets, double>(f)), jacobian);
  EXPECT_EQ((jacobianReverseSparsity<std::vector<bool>, double>(f)),
            (std::vector<bool>{true, false, true, false, true, false}));
  EXPECT_EQ((hessianSparsitySet<Sets, double>(f)), hessian);
  EXPECT_EQ((hessianSparsitySet<Sets, double>(f, std::size_t(1))), Sets(3));
  std::vector<std::size_t> row, col;
  generateSparsityIndexes(jacobian, row, col);
  EXPECT_EQ(row, (std::vector<std::size_t>{0, 0, 1}));
  EXPECT_EQ(col, (std::vector<std::size_t>{0, 2, 1}));
  const auto entries = toSparsityPattern<std::vector<std::size_t>>(jacobian, 2, 3);
  EXPECT_EQ(entries.nr(), 2u);
  EXPECT_EQ(entries.nc(), 3u);
  EXPECT_EQ(entries.col(), col);
  Sets back(2);
  generateSparsitySet(row, col, back);
  EXPECT_EQ(back, jacobian);
  EXPECT_NE(sentence_of<ArgumentError>([&] {
              hessianSparsitySet<Sets, double>(f, std::size_t(2));
            }).find("result 2"),
            std::string::npos);
}

TEST(CppadCgSparsity, Products) {
  const Sets a{{1}, {0, 2}}, b{{0}, {1}, {0, 1}};  // 2 x 3, 3 x 2
  Sets product(2), transposed(2), of_transpose(2);
  multMatrixMatrixSparsity(a, b, product, 2, 3, 2);
  EXPECT_EQ(product, (Sets{{1}, {0, 1}}));
  const Sets a_transposed = transposePattern(a, 2, 3);
  EXPECT_EQ(a_transposed, (Sets{{1}, {0}, {1}}));
  multMatrixTransMatrixSparsity(a_transposed, b, of_transpose, 3, 2, 2);
  EXPECT_EQ(of_transpose, product);
  multMatrixMatrixSparsityTrans(a_transposed, b, transposed, 3, 2, 2);
  EXPECT_EQ(transposed, transposePattern(product, 2, 2));
  Sets sum = product;
  addMatrixSparsity(Sets{{0}, {}}, sum);
  EXPECT_EQ(sum, (Sets{{0, 1}, {0, 1}}));
}

struct Folder {
  Folder() : path(std::filesystem::temp_directory_path() / ("cppad_cg_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(path);
  }
  ~Folder() { std::filesystem::remove_all(path); }
  std::filesystem::path path;
};

// y of the C function `f` in a library that is made of the text.
std::vector<double> call_of(const std::string& text, const std::vector<double>& x, std::size_t n_y) {
  const Folder folder;
  GccCompiler<double> compiler;
  compiler.setTemporaryFolder((folder.path / "objects").string());
  compiler.compileSources({{"f.c", text}}, true);
  compiler.buildDynamic((folder.path / "lib" / "f.so").string());
  void* const library = dlopen((folder.path / "lib" / "f.so").c_str(), RTLD_NOW);
  EXPECT_NE(library, nullptr) << dlerror();
  const auto f = reinterpret_cast<void (*)(const double*, double*)>(dlsym(library, "f"));
  std::vector<double> y(n_y, -1);
  f(x.data(), y.data());
  dlclose(library);
  compiler.cleanup();
  EXPECT_FALSE(std::filesystem::exists(folder.path / "objects"));
  return y;
}

TEST(CppadCgCode, StatementsStandInAFunctionOfTheUser) {
  const auto f = inner_function();
  CodeHandler<double> handler(10);
  CppAD::vector<CGD> x(2);
  handler.makeVariables(x);
  CppAD::vector<CGD> J = f->Jacobian(x);
  J[0] = CondExpLt(x[0], CGD(1), J[0], CGD(7));
  LanguageC<double> language("double");
  LangCDefaultVariableNameGenerator<double> names("out", "in");
  std::ostringstream code;
  code << "#include <math.h>\nvoid f(const double* in, double* out) {\n"
       << language.generateTemporaryVariableDeclaration();
  handler.generateCode(code, language, J, names);
  code << "}\n";
  expect_close(call_of(code.str(), kAt, 4), {kAt[1], kAt[0], 0, std::cos(kAt[1])});
}

TEST(CppadCgCode, TheCompilerSaysWhatIsWrong) {
  const Folder folder;
  GccCompiler<double> compiler;
  compiler.setTemporaryFolder(folder.path.string());
  EXPECT_NE(sentence_of<ToolError>([&] {
              compiler.compileSources({{"bad.c", "int f( {"}}, true);
            }).find("bad.c"),
            std::string::npos);
}

TEST(CppadCgCode, ViewsCopyElements) {
  std::vector<double> a{1, 2}, b{3, 4}, longer(3);
  ArrayView<double> view(a);
  view = ArrayView<const double>(b);
  EXPECT_EQ(a, b);
  EXPECT_EQ(view.at(1), 4);
  EXPECT_THROW(view.at(2), ArgumentError);
  EXPECT_THROW(view = ArrayView<double>(longer), ArgumentError);
}

TEST(CppadCgCode, SettingsOfThreadsAndLibrariesAreKept) {
  const auto f = inner_function();
  ModelCSourceGen<double> source(*f, "inner");
  ModelLibraryCSourceGen<double> sources(source);
  sources.setMultiThreading(MultiThreadingType::PTHREADS);
  EXPECT_EQ(sources.getMultiThreading(), MultiThreadingType::PTHREADS);
  const Folder folder;
  SaveFilesModelLibraryProcessor<double>::saveLibrarySourcesTo(sources, folder.path.string());
  EXPECT_TRUE(std::filesystem::exists(folder.path / "inner.c"));
  DynamicModelLibraryProcessor<double> processor(sources);
  EXPECT_EQ(processor.getCustomLibraryExtension(), nullptr);
  processor.setCustomLibraryExtension(".so.1");
  EXPECT_EQ(*processor.getCustomLibraryExtension(), ".so.1");
  processor.removeCustomLibraryExtension();
  EXPECT_EQ(processor.getCustomLibraryExtension(), nullptr);
  GccCompiler<double> compiler;
  compiler.addCompileFlag("-pthread");
  const auto library = processor.createDynamicLibrary(compiler);
  library->setThreadNumber(2);
  library->setThreadPoolSchedulerStrategy(ThreadPoolScheduleStrategy::GUIDED);
  EXPECT_EQ(library->getThreadNumber(), 2u);
  EXPECT_EQ(library->getThreadPoolSchedulerStrategy(), ThreadPoolScheduleStrategy::GUIDED);
  LinuxDynamicLib<double> moved(std::move(*library));
  expect_close(moved.model("inner")->ForwardZero(kAt), {kAt[0] * kAt[1], std::sin(kAt[1])});
}

}  // namespace
}  // namespace dyntape::cppad_cg_atomic_test
