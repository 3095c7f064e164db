// SPDX-License-Identifier: BSD-3-Clause
// Names of CppAD's that stand by themselves: absolute values apart, C of a function, vectors, Eigen's columns.
#include <Eigen/SparseCore>

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include <dyntape/interface/cppad/cg/dll_lib.h>

#include "programs.h"

namespace dyntape::cppad_names_test {
namespace {

using Sizes = std::vector<std::size_t>;

bool is_whole(const double& x) { return x == std::floor(x); }
bool divides(const double& x, const double& y) { return std::fmod(y, x) == 0; }
CPPAD_BOOL_UNARY(double, is_whole)
CPPAD_BOOL_BINARY(double, divides)
CPPAD_BOOL_UNARY(ADouble, is_whole)
CPPAD_BOOL_BINARY(ADouble, divides)

TEST(CppadBoolFunctions, AreOfTheValuesAndLeaveNoGuard) {
  ADFun<double> f = recorded({3, 6}, [](const AVector& x) {
    EXPECT_TRUE(is_whole(x[0]) && divides(x[0], x[1]) && divides(ADouble(3), x[1]));
    EXPECT_FALSE(is_whole(x[0] / 2) || divides(x[1], x[0]));
    EXPECT_TRUE(is_whole(AD<ADouble>(x[0])) && divides(AD<ADouble>(x[0]), AD<ADouble>(x[1])));
    return std::vector<ADouble>{is_whole(x[0]) ? x[0] : x[1]};
  });
  expect_near(f.Forward(0, DVector{0.5, 2}), {0.5});
  EXPECT_EQ(f.compare_change_number(), 0u);
}

// f = (||x0| - x1| x0, x1 + |x1|): z = (x0, u0 - x1, x1), y = (u1 x0, x1 + u2)
ADFun<double> with_absolute_values() {
  return recorded({1, 2}, [](const AVector& x) {
    const ADouble inner = abs(x[0]), outer = abs(inner - x[1]);
    return std::vector<ADouble>{outer * x[0], x[1] + abs(x[1])};
  });
}

TEST(CppadAbsNormal, PartsAreThoseOfTheFunction) {
  ADFun<double> f = with_absolute_values(), g, a;
  f.abs_normal_fun(g, a);
  EXPECT_EQ(g.Domain(), 5u);
  EXPECT_EQ(g.Range(), 5u);
  EXPECT_EQ(a.Domain(), 2u);
  EXPECT_EQ(a.Range(), 3u);
  expect_near(g.Forward(0, DVector{3, 5, 7, 11, 13}), {33, 18, 3, 2, 5});
  expect_near(a.Forward(0, DVector{-3, 5}), {3, 2, 5});
  // dy and dz by x and u: smooth, whatever the signs are.
  expect_near(g.Jacobian(DVector{3, 5, 7, 11, 13}), {11, 0,  0, 3, 0,  //
                                                     0,  1,  0, 0, 1,  //
                                                     1,  0,  0, 0, 0,  //
                                                     0,  -1, 1, 0, 0,  //
                                                     0,  1,  0, 0, 0});
  for (const std::vector<double>& x : {std::vector<double>{2, 0.5}, {-2, 3}, {-1, -4}, {0, 0}}) {
    const DVector at(x.begin(), x.end()), u = a.Forward(0, at), y = f.Forward(0, at);
    const DVector yz = g.Forward(0, DVector{at[0], at[1], u[0], u[1], u[2]});
    for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(yz[i], y[i]);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(std::abs(yz[2 + k]), u[k]);
  }
}

TEST(CppadAbsNormal, WithDynamicParametersAndBranches) {
  std::vector<ADouble> x{1.0}, p{2.0}, y(1);
  Independent(x, 0, true, p);
  y[0] = abs(x[0] - p[0]);
  if (y[0] > 0.5 && 0.5 < y[0]) y[0] *= 3;
  ADFun<double> f(x, y), g, a;
  f.abs_normal_fun(g, a);
  a.new_dynamic(std::vector<double>{5});
  expect_near(a.Forward(0, DVector{1}), {4});
  expect_near(g.Forward(0, DVector{1, 4}), {12, -1});
  EXPECT_EQ(g.compare_change_number(), 0u);
  g.Forward(0, DVector{1, 0.25});  // the branch is by u
  EXPECT_EQ(g.compare_change_number(), 2u);
}

struct Folder {
  Folder() : path(std::filesystem::temp_directory_path() / ("cppad_names_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(path);
  }
  ~Folder() { std::filesystem::remove_all(path); }
  std::string file(const std::string& name, const std::string& text = "") const {
    if (!text.empty()) std::ofstream(path / name) << text;
    return (path / name).string();
  }
  std::filesystem::path path;
};

template <class Float, class Function>
void expect_csrc_agrees() {
  std::vector<AD<Float>> x{Float(0.5), Float(2)}, p{Float(3)}, y(2);
  Independent(x, 0, true, p);
  y[0] = p[0] * sin(x[0]) - x[1];
  y[1] = CondExpLt(x[0], x[1], -x[0], x[1] * x[1]);
  if (x[0] < x[1] && x[1] > x[0]) y[0] += 1;
  ADFun<Float> f(x, y);
  f.function_name_set("pair");
  std::ostringstream code;
  f.to_csrc(code, sizeof(Float) == 4 ? "float" : "double");
  const Folder folder;
  const std::string library = folder.file("pair.so");
  std::string error =
      CppAD::create_dll_lib(library, std::vector<std::string>{folder.file("pair.c", code.str())}, {});
  ASSERT_EQ(error, "");
  const CppAD::link_dll_lib loaded(library, error);
  ASSERT_EQ(error, "");
  const auto call = reinterpret_cast<Function>(loaded("cppad_jit_pair", error));
  ASSERT_EQ(error, "");
  for (const std::vector<Float>& u : {std::vector<Float>{3, Float(0.5), 2}, {4, 3, 1}}) {
    std::vector<Float> got(2);
    std::size_t changes = 0;
    ASSERT_EQ(call(3, u.data(), 2, got.data(), &changes), 0);
    f.new_dynamic(std::vector<Float>{u[0]});
    const auto expected = f.Forward(0, std::vector<Float>{u[1], u[2]});
    for (std::size_t i = 0; i < 2; ++i)
      EXPECT_NEAR(got[i], expected[i], 1e-6 * (sizeof(Float) == 4 ? 1 : 1e-8));
    EXPECT_EQ(changes, f.compare_change_number());
    EXPECT_EQ(changes, u[1] < u[2] ? 0u : 2u);
  }
  std::size_t changes = 0;
  std::vector<Float> y_of_another_size(3);
  EXPECT_NE(call(2, y_of_another_size.data(), 2, y_of_another_size.data(), &changes), 0);
  EXPECT_NE(call(3, y_of_another_size.data(), 3, y_of_another_size.data(), &changes), 0);
  loaded("cppad_jit_other", error);
  EXPECT_NE(error.find("cppad_jit_other"), std::string::npos);
}

TEST(CppadCsrc, AgreesInDoubles) { expect_csrc_agrees<double, CppAD::jit_double>(); }
TEST(CppadCsrc, AgreesInFloats) { expect_csrc_agrees<float, CppAD::jit_float>(); }

// y = (x0 x1, x0 + call_id)
template <class Float>
class Called : public CppAD::atomic_four<Float> {
 public:
  explicit Called(const std::string& name) : CppAD::atomic_four<Float>(name) {}

 private:
  using Types = CppAD::vector<CppAD::ad_type_enum>;
  bool for_type(std::size_t, const Types& x, Types& y) override {
    y[0] = std::max(x[0], x[1]), y[1] = x[0];
    return true;
  }
  bool forward(std::size_t call_id, const CppAD::vector<bool>&, std::size_t, std::size_t up,
               const CppAD::vector<Float>& x, CppAD::vector<Float>& y) override {
    if (up > 0) return false;
    y[0] = x[0] * x[1], y[1] = x[0] + static_cast<Float>(call_id);
    return true;
  }
};
double names_step(const double& x) { return x < 1 ? 0 : 1; }
float names_step(const float& x) { return x < 1 ? 0 : 1; }
CPPAD_DISCRETE_FUNCTION(double, names_step)
CPPAD_DISCRETE_FUNCTION(float, names_step)

// Functions of the user are calls of the user's C: few of them, and as many as have their arguments in memory.
template <class Float, class Function>
void expect_calls_in_csrc(std::size_t calls) {
  const std::string type = sizeof(Float) == 4 ? "float" : "double";
  Called<Float> called("names_called");
  std::vector<AD<Float>> x{Float(0.5), Float(2)}, p{Float(3)}, y{0, 0}, in(2), out(2);
  Independent(x, 0, true, p);
  for (std::size_t k = 0; k < calls; ++k) {
    in[0] = k % 2 ? x[0] : p[0], in[1] = x[1] + Float(k);
    called(k, in, out);
    y[0] += out[0], y[1] += out[1] * names_step(x[0] * Float(k));
  }
  ADFun<Float> f(x, y);
  f.function_name_set("calls");
  std::ostringstream code;
  f.to_csrc(code, type);
  const Folder folder;
  const std::string library = folder.file("calls.so");
  const std::string users =
      "#include <stddef.h>\nint cppad_atomic_names_called(size_t call_id, size_t nx, const " + type +
      "* x, size_t ny, " + type +
      "* y, size_t* compare_change) {\n  if (nx != 2 || ny != 2) return 1;\n"
      "  if (x[0] < -100) return 7;\n  if (x[0] > 100) ++*compare_change;\n"
      "  y[0] = x[0] * x[1], y[1] = x[0] + call_id;\n  return 0;\n}\n" +
      type + " cppad_discrete_names_step(const " + type + " x) { return x < 1 ? 0 : 1; }\n";
  std::string error = CppAD::create_dll_lib(
      library, std::vector<std::string>{folder.file("users.c", users), folder.file("calls.c", code.str())},
      {});
  ASSERT_EQ(error, "");
  const CppAD::link_dll_lib loaded(library, error);
  ASSERT_EQ(error, "");
  const auto call = reinterpret_cast<Function>(loaded("cppad_jit_calls", error));
  ASSERT_EQ(error, "");
  std::size_t changes = 0;
  std::vector<Float> got(2);
  for (std::vector<Float> u : {std::vector<Float>{3, Float(0.5), 2}, {4, 3, 1}}) {
    ASSERT_EQ(call(3, u.data(), 2, got.data(), &changes), 0);
    f.new_dynamic(std::vector<Float>{u[0]});
    const auto expected = f.Forward(0, std::vector<Float>{u[1], u[2]});
    for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(got[i], expected[i]);
    u[1] = -200;
    EXPECT_EQ(call(3, u.data(), 2, got.data(), &changes), 7);
  }
  EXPECT_EQ(changes, 0u);
  ASSERT_EQ(call(3, std::vector<Float>{3, 200, 1}.data(), 2, got.data(), &changes), 0);
  EXPECT_EQ(changes, calls / 2);
}

TEST(CppadCsrc, CallsTheUsersCInDoubles) {
  for (const std::size_t calls : {3, 300}) expect_calls_in_csrc<double, CppAD::jit_double>(calls);
}
TEST(CppadCsrc, CallsTheUsersCInFloats) {
  for (const std::size_t calls : {3, 300}) expect_calls_in_csrc<float, CppAD::jit_float>(calls);
}

TEST(CppadCsrc, WhatGoesWrongIsSaid) {
  Called<double> unnamed("names (x, y)");
  const auto with_call = [&](const AVector& x) {
    AVector out(2);
    unnamed(x, out);
    return std::vector<ADouble>{out[0]};
  };
  auto g = recorded({1, 2}, with_call);
  g.function_name_set("g");
  std::ostringstream code_of_g;
  EXPECT_NE(sentence_of<ArgumentError>([&] { g.to_csrc(code_of_g, "double"); }).find("names (x, y)"),
            std::string::npos);
  auto f = recorded({1}, [](const AVector& x) { return std::vector<ADouble>{x[0]}; });
  std::ostringstream code;
  EXPECT_NE(sentence_of<ArgumentError>([&] { f.to_csrc(code, "double"); }).find("function_name_set"),
            std::string::npos);
  f.function_name_set("f");
  EXPECT_NE(sentence_of<ArgumentError>([&] { f.to_csrc(code, "half"); }).find("half"), std::string::npos);
  const Folder folder;
  const std::string library = folder.file("f.so");
  EXPECT_NE(CppAD::create_dll_lib(library, std::vector<std::string>{folder.file("f.c", "int f( {")}, {})
                .find("f.c"),
            std::string::npos);
  std::string error;
  CppAD::link_dll_lib missing(library, error);
  EXPECT_NE(error.find("f.so"), std::string::npos);
  EXPECT_EQ(missing("f", error), nullptr);
}

TEST(CppadVector, Compares) {
  const DVector a{1, 2}, b{1, 3}, longer{1, 2, 0};
  EXPECT_TRUE(a == a && a != b && a != longer);
  EXPECT_TRUE(a < b && b > a && a <= b && b >= a && a <= a && !(a < a) && a < longer);
}

TEST(CppadEigen, ColumnsAreSimpleVectors) {
  CppAD::eigen_vector<ADouble> x(2), y(2);
  x[0] = 2.0, x[1] = 3.0;
  Independent(x);
  for (std::size_t i = 0; i < x.size(); ++i) y[i] = x[i] * x.dot(x);
  ADFun<double> f(x, y);
  expect_near(f.Jacobian(DVector{2, 3}), {21, 12, 12, 31});
  y.resize(5);
  EXPECT_EQ(y.size(), 5u);
}

TEST(CppadEigen, SparseMatrices) {
  CppAD::sparse_rc<Sizes> pattern(2, 3, 3);
  pattern.set(0, 1, 2), pattern.set(1, 0, 0), pattern.set(2, 1, 0);
  CppAD::sparse_rcv<Sizes, std::vector<double>> source(pattern);
  for (std::size_t k = 0; k < 3; ++k) source.set(k, double(k));
  Eigen::SparseMatrix<double> matrix;
  CppAD::sparse2eigen(source, matrix);
  EXPECT_EQ(matrix.nonZeros(), 3);
  EXPECT_EQ(matrix.toDense(), (Eigen::MatrixXd(2, 3) << 1, 0, 0, 2, 0, 0).finished());
}

// The order is kept beside the entries, which stay where they are, until an entry changes.
TEST(CppadSparse, OrdersAreKept) {
  CppAD::sparse_rc<Sizes> pattern(2, 3, 3);
  pattern.set(0, 1, 2), pattern.set(1, 0, 0), pattern.set(2, 1, 0);
  const Sizes &rows = pattern.get_row_major(), &columns = pattern.get_col_major();
  EXPECT_TRUE(rows.empty() && columns.empty());
  pattern.set_row_major(), pattern.set_col_major();
  EXPECT_EQ(rows, (Sizes{1, 2, 0}));
  EXPECT_EQ(columns, (Sizes{1, 2, 0}));
  EXPECT_EQ(pattern.row(), (Sizes{1, 0, 1}));
  EXPECT_EQ(pattern.col(), (Sizes{2, 0, 0}));
  pattern.set(0, 0, 2);
  EXPECT_TRUE(rows.empty() && columns.empty());
}

TEST(CppadCheckpoint, OfFloats) {
  std::vector<AD<float>> x{2.0f}, y(1);
  Independent(x);
  y[0] = x[0] * x[0];
  ADFun<float> f(x, y);
  CppAD::chkpoint_two<float> square(f, "square");
  Independent(x);
  square(x, y);
  ADFun<float> g(x, y);
  EXPECT_EQ(g.Jacobian(std::vector<float>{3})[0], 6);
}

TEST(CppadGraph, OfAFunctionOnRecordedNumbers) {
  auto f = recorded({2}, [](const AVector& x) { return std::vector<ADouble>{x[0] * sin(x[0])}; });
  CppAD::cpp_graph graph;
  f.base2ad().to_graph(graph);
  ADFun<double> again;
  again.from_graph(graph);
  expect_near(again.Jacobian(DVector{2}), {std::sin(2) + 2 * std::cos(2)});
}

// Wherever they begin: t + smin - t may be more than smin.
TEST(CppadOde, TheSmallestStepIsTakenWhereTheErrorIsTooLarge) {
  struct {
    std::size_t tried = 0;
    void step(double ta, double tb, DVector& xa, DVector& xb, DVector& eb) {
      if (++tried > 1000) throw std::runtime_error("no end");
      xb[0] = xa[0] + (tb - ta), eb[0] = 1;
    }
    std::size_t order() const { return 4; }
  } method;
  for (const double smin : {1e-2, 1e-2 / 3, 0.07}) {
    method.tried = 0;
    DVector xi{0}, eabs{0}, ef(1);
    double scur = smin;
    const DVector x = CppAD::OdeErrControl(method, 0.0, 0.9, xi, smin, 1.0, scur, eabs, 1e-7, ef);
    EXPECT_NEAR(x[0], 0.9, 1e-12);
    EXPECT_LE(double(method.tried), 0.9 / smin + 3);
  }
}

TEST(CppadOde, GearGrowsFromAStepOfRounding) {
  struct {
    std::size_t asked = 0;
    void Ode(const double&, const DVector& x, DVector& f) {
      if (++asked > 100000) throw std::runtime_error("no end");
      f[0] = -x[0], f[1] = x[0] - 2 * x[1];
    }
    void Ode_dep(const double&, const DVector&, DVector& f_x) {
      f_x[0] = -1, f_x[1] = 0, f_x[2] = 1, f_x[3] = -2;
    }
  } F;
  DVector xi{1, 0}, eabs{1e-4, 1e-4}, ef(2), maxabs(2);
  double sini = 99 * std::numeric_limits<double>::epsilon();
  std::size_t nstep;
  const DVector x = CppAD::OdeGearControl(F, 5, 0.0, 1.0, xi, 1e-8, 1.0, sini, eabs, 0.0, ef, maxabs, nstep);
  EXPECT_NEAR(x[0], std::exp(-1.0), 1e-4);
  EXPECT_NEAR(x[1], std::exp(-1.0) - std::exp(-2.0), 1e-4);
  EXPECT_LT(nstep, 1000u);
}

}  // namespace
}  // namespace dyntape::cppad_names_test
