// SPDX-License-Identifier: BSD-3-Clause
// Recording, and what a function gives: dense derivatives, dynamic parameters, branches, nesting.
#include <sstream>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "programs.h"

namespace {

std::vector<ADouble> two_of_three(const AVector& x) { return {x[0] * x[0] * x[1], sin(x[1]) * x[2]}; }
const DVector kAt{2, 0.5, 3};

TEST(CppadRecording, FiveFormsOfIndependent) {
  for (int form = 0; form < 5; ++form) {
    AVector ax(1), ap(1), ay(1);
    ax[0] = 2, ap[0] = 3;
    const std::size_t abort_op_index = 0;
    if (form == 0) Independent(ax);
    if (form == 1) Independent(ax, ap);
    if (form == 2) Independent(ax, abort_op_index);
    if (form == 3) Independent(ax, abort_op_index, false);
    if (form == 4) Independent(ax, abort_op_index, false, ap);
    ay[0] = ax[0] < 10 ? ax[0] * ap[0] : ax[0];
    ADFun<double> f(ax, ay);
    const bool dynamic = form == 1 || form == 4;
    EXPECT_EQ(f.size_dyn_ind(), dynamic ? 1u : 0u);
    if (dynamic) f.new_dynamic(DVector{5});
    expect_near(f.Forward(0, DVector{20}), {dynamic ? 100.0 : 60.0});
    EXPECT_EQ(f.compare_change_number(), form < 3 ? 1u : 0u);
  }
}

TEST(CppadRecording, VectorsOfEveryKind) {
  std::vector<ADouble> ax{2.0}, ay(1);
  Independent(ax);
  ay[0] = ax[0] * ax[0];
  ADFun<double> f(ax, ay);
  EXPECT_EQ(f.Jacobian(std::vector<double>{3})[0], 6);
  EXPECT_EQ(f.Jacobian(Eigen::VectorXd(Eigen::VectorXd::Constant(1, 4.0)))[0], 8);
  EXPECT_EQ(f.Jacobian(DVector{5})[0], 10);
}

TEST(CppadRecording, CopiesBeforeIndependentAreConstants) {
  AVector ax(1), ay(1);
  ax[0] = 2;
  const ADouble before = ax[0];
  Independent(ax);
  ay[0] = before * ax[0];
  ADFun<double> f(ax, ay);
  expect_near(f.Jacobian(DVector{7}), {2});
}

TEST(CppadRecording, ConstructorEvaluatesOrderZero) {
  AVector ax(1), ay(1);
  ax[0] = 2;
  Independent(ax);
  ay[0] = ax[0] * ax[0];
  ADFun<double> f(ax, ay);
  EXPECT_EQ(f.size_order(), 1u);
  expect_near(f.Reverse(1, DVector{1}), {4});
  ADFun<double> g;
  ax[0] = 3;
  Independent(ax);
  ay[0] = ax[0] * ax[0];
  g.Dependent(ax, ay);
  EXPECT_EQ(g.size_order(), 0u);
}

TEST(CppadRecording, DependentWithoutIndependents) {
  AVector ax(2), ay(1);
  ax[0] = 1, ax[1] = 2;
  Independent(ax);
  ay[0] = ax[0] - ax[1];
  ADFun<double> f;
  f.Dependent(ay);
  EXPECT_EQ(f.Domain(), 2u);
  expect_near(f.Jacobian(DVector{1, 2}), {1, -1});
}

TEST(CppadRecording, DependentsMayBeAnything) {
  AVector ax(2), ap(1), ay(5);
  ax[0] = 1, ax[1] = 2, ap[0] = 3;
  Independent(ax, ap);
  ay[0] = 4, ay[1] = ap[0], ay[2] = ax[1], ay[3] = ax[1], ay[4] = ax[0] + ap[0];
  ADFun<double> f(ax, ay);
  expect_near(f.Forward(0, DVector{10, 20}), {4, 3, 20, 20, 13});
  EXPECT_TRUE(f.Parameter(0) && f.Parameter(1));
  EXPECT_FALSE(f.Parameter(2) || f.Parameter(4));
}

TEST(CppadRecording, AbortEndsIt) {
  AVector ax(1), ay(1);
  ax[0] = 2;
  Independent(ax);
  ADouble::abort_recording();
  ADouble::abort_recording();  // there need not be one
  Independent(ax);
  ay[0] = ax[0];
  ADFun<double> f(ax, ay);
  EXPECT_EQ(f.Range(), 1u);
}

TEST(CppadFun, JacobianByColumnsAndByRows) {
  ADFun<double> f = recorded({1, 1, 1}, two_of_three);
  expect_near(f.Jacobian(kAt), {2, 4, 0, 0, 3 * std::cos(0.5), std::sin(0.5)});
  ADFun<double> tall = recorded({1}, [](const AVector& x) -> std::vector<ADouble> {
    return {x[0], x[0] * x[0], ADouble(3)};
  });
  expect_near(tall.Jacobian(DVector{3}), {1, 6, 0});
}

TEST(CppadFun, HessianOfOneAndOfWeights) {
  ADFun<double> f = recorded({1, 1, 1}, two_of_three);
  expect_near(f.Hessian(kAt, std::size_t(0)), {1, 4, 0, 4, 0, 0, 0, 0, 0});
  const double s = -3 * std::sin(0.5), c = std::cos(0.5);
  expect_near(f.Hessian(kAt, DVector{2, 10}), {2, 8, 0, 8, 10 * s, 10 * c, 0, 10 * c, 0});
}

TEST(CppadFun, OneColumnOneRowAndSelectedSecondPartials) {
  ADFun<double> f = recorded({1, 1, 1}, two_of_three);
  expect_near(f.ForOne(kAt, 1), {4, 3 * std::cos(0.5)});
  expect_near(f.RevOne(kAt, 0), {2, 4, 0});
  using Sizes = CPPAD_TESTVECTOR(std::size_t);
  // ddy[i p + l] of (0, 0), (0, 1), (1, 2)
  expect_near(f.ForTwo(kAt, Sizes{0, 0, 1}, Sizes{0, 1, 2}), {1, 4, 0, 0, 0, std::cos(0.5)});
  // ddw[k p + l]: of result i[l], column j[l]
  expect_near(f.RevTwo(kAt, Sizes{0, 1}, Sizes{0, 2}), {1, 0, 4, std::cos(0.5), 0, 0});
}

TEST(CppadFun, NewDynamicWithoutAnotherRecording) {
  AVector ax(1), ap(2), ay(1);
  ax[0] = 1, ap[0] = 1, ap[1] = 2;
  Independent(ax, ap);
  ay[0] = (ap[0] * ap[1] + sin(ap[0])) * ax[0];
  ADFun<double> f(ax, ay);
  EXPECT_GE(f.size_dyn_par(), 2u);
  f.new_dynamic(DVector{3, 4});
  expect_near(f.Forward(0, DVector{2}), {(12 + std::sin(3.0)) * 2});
  expect_near(f.Jacobian(DVector{2}), {12 + std::sin(3.0)});
}

TEST(CppadFun, AssignmentCopiesMoveAndSwap) {
  ADFun<double> f = recorded({1}, [](const AVector&x) -> std::vector<ADouble> { return {x[0] * 2}; }), g, h;
  g = f;
  f.Forward(0, DVector{1});
  EXPECT_EQ(g.size_order(), 0u);
  expect_near(g.Forward(0, DVector{3}), {6});
  h.swap(g);
  EXPECT_EQ(g.Domain(), 0u);
  g = std::move(h);
  expect_near(g.Forward(0, DVector{4}), {8});
}

TEST(CppadFun, NamesAndSizes) {
  ADFun<double> f =
      recorded({1, 2}, [](const AVector& x) -> std::vector<ADouble> { return {x[0] * x[1] + x[1] * x[0]}; });
  f.function_name_set("product");
  EXPECT_EQ(f.function_name_get(), "product");
  EXPECT_EQ(f.size_var(), 4u) << "two variables, one product, one sum";
  EXPECT_GT(f.size_op(), 0u);
  EXPECT_GT(f.size_op_arg(), 0u);
  EXPECT_GT(f.size_op_seq(), 0u);
  EXPECT_EQ(f.size_text(), 0u);
  EXPECT_EQ(f.number_skip(), 0u);
}

TEST(CppadFun, OptimizeKeepsValues) {
  ADFun<double> f = recorded({1, 2}, [](const AVector& x) -> std::vector<ADouble> {
    const ADouble unused = exp(x[0]);
    return {x[0] < x[1] ? x[0] * x[1] : unused};
  });
  const std::size_t before = f.size_var();
  f.optimize();
  EXPECT_LE(f.size_var(), before);
  f.Forward(0, DVector{3, 2});
  EXPECT_EQ(f.compare_change_number(), 1u);
  f.optimize("no_compare_op collision_limit=1000");
  f.Forward(0, DVector{3, 2});
  EXPECT_EQ(f.compare_change_number(), 0u);
  expect_near(f.Forward(0, DVector{3, 2}), {6});
}

TEST(CppadBranches, ChangesAreCountedAndFound) {
  ADFun<double> f = recorded({1, 2}, [](const AVector& x) -> std::vector<ADouble> {
    ADouble y = x[0] < x[1] ? x[0] : x[1];
    if (x[0] > 0) y = y * 2;
    if (x[1] == 2) y = y + 1;
    if (x[0] != x[1]) y = y + 1;
    return {y};
  });
  f.Forward(0, DVector{1, 2});
  EXPECT_EQ(f.compare_change_number(), 0u);
  EXPECT_EQ(f.compare_change_op_index(), 0u);
  f.Forward(0, DVector{-1, 3});
  EXPECT_EQ(f.compare_change_number(), 2u);
  f.compare_change_count(1);
  const std::size_t first = f.compare_change_op_index();
  f.compare_change_count(2);
  EXPECT_NE(first, 0u);
  EXPECT_GT(f.compare_change_op_index(), first);
  f.compare_change_count(0);
  EXPECT_EQ(f.compare_change_number(), 0u);
}

TEST(CppadBranches, EachOfEqualComparisonsIsCounted) {
  ADFun<double> f = recorded({1, 2}, [](const AVector& x) -> std::vector<ADouble> {
    const bool truths[] = {x[0]<x[1], x[1]> x[0], x[0] < x[1], x[0] <= x[1]};
    return {truths[0] && truths[1] && truths[2] && truths[3] ? x[0] : x[1]};
  });
  f.Forward(0, DVector{3, 2});
  EXPECT_EQ(f.compare_change_number(), 4u);
  f.compare_change_count(3);
  const std::size_t third = f.compare_change_op_index();
  f.compare_change_count(4);
  EXPECT_GT(f.compare_change_op_index(), third);
  f.compare_change_count(5);
  EXPECT_EQ(f.compare_change_op_index(), 0u);
  f.compare_change_count(1);
  f.optimize();
  f.Forward(0, DVector{2, 2});
  EXPECT_EQ(f.compare_change_number(), 3u) << "2 is not less than 2";
}

// Whose index Independent takes to stop at the comparison.
TEST(CppadBranches, TheIndexOfAChangeIsThatOfTheRecording) {
  int compared = 0;
  const auto code = [&](const AVector& x) -> std::vector<ADouble> {
    [[maybe_unused]] const ADouble dropped = sin(x[1]) * exp(x[0]);
    compared = 1;
    const bool less = x[0] < x[1];
    compared = 2;
    return {less ? x[0] : x[1]};
  };
  ADFun<double> f = recorded({1, 2}, code);
  f.Forward(0, DVector{3, 2});
  const std::size_t index = f.compare_change_op_index();
  AVector ax{1, 2};
  Independent(ax, index);
  EXPECT_NE(sentence_of<dyntape::RecordingError>([&] { code(ax); }), "");
  EXPECT_EQ(compared, 1);
  ADouble::abort_recording();
  f.optimize();
  f.Forward(0, DVector{3, 2});
  EXPECT_EQ(f.compare_change_number(), 1u);
  EXPECT_EQ(f.compare_change_op_index(), 0u) << "there is none after optimize()";
}

TEST(CppadBranches, AskedToTheyThrowWithThePlace) {
  ADFun<double> f =
      recorded({1}, [](const AVector& x) -> std::vector<ADouble> { return {x[0] < 3 ? x[0] : x[0] * 2}; });
  f.check_branches(true);
  expect_near(f.Forward(0, DVector{2}), {2});
  const std::string sentence = sentence_of<dyntape::GuardViolation>([&] { f.Forward(0, DVector{4}); });
  EXPECT_NE(sentence.find("fun_test.cpp"), std::string::npos) << sentence;
}

TEST(CppadBranches, OfDynamicParametersToo) {
  AVector ax(1), ap(1), ay(1);
  ax[0] = 1, ap[0] = 1;
  Independent(ax, ap);
  ay[0] = ap[0] > 0 ? ax[0] : -ax[0];
  ADFun<double> f(ax, ay);
  f.new_dynamic(DVector{-1});
  f.Forward(0, DVector{1});
  EXPECT_EQ(f.compare_change_number(), 1u);
}

TEST(CppadNumbers, CheckForNanNamesTheOperation) {
  ADFun<double> f = recorded({1}, [](const AVector& x) -> std::vector<ADouble> { return {log(x[0]) + 1}; });
  EXPECT_TRUE(std::isnan(f.Forward(0, DVector{-1})[0])) << "nobody asked";
  f.check_for_nan(true);
  EXPECT_TRUE(f.check_for_nan());
  const std::string sentence = sentence_of<dyntape::NumericalError>([&] { f.Forward(0, DVector{-1}); });
  EXPECT_NE(sentence.find("Log"), std::string::npos) << sentence;
  f.check_for_nan(false);
  EXPECT_TRUE(std::isnan(f.Forward(0, DVector{-1})[0]));
}

TEST(CppadNested, DerivativesOfDerivativesByTwoLevels) {
  using A2 = AD<ADouble>;
  std::vector<ADouble> ax{2.0}, ay(1);
  Independent(ax);
  std::vector<A2> aax{ax[0]}, aay(1);
  Independent(aax);
  aay[0] = aax[0] * aax[0] * aax[0] * ax[0] + sin(aax[0]) * 2.0;
  ADFun<ADouble> inner(aax, aay);
  ay[0] = inner.Jacobian(ax)[0];  // 3 x^3 + 2 cos x
  ADFun<double> f(ax, ay);
  expect_near(f.Forward(0, DVector{3}), {81 + 2 * std::cos(3.0)});
  expect_near(f.Jacobian(DVector{3}), {81 - 2 * std::sin(3.0)});
}

TEST(CppadNested, InnerForwardAndReverseOfHighOrder) {
  using A2 = AD<ADouble>;
  std::vector<ADouble> ax{0.5}, ay(2);
  Independent(ax);
  std::vector<A2> aax{ax[0]}, aay(1);
  Independent(aax);
  aay[0] = exp(aax[0] * 2);
  ADFun<ADouble> inner(aax, aay);
  inner.Forward(0, ax);
  inner.Forward(1, std::vector<ADouble>{1.0});
  ay[0] = inner.Forward(2, std::vector<ADouble>{0.0})[0];  // 2 exp(2 x)
  ay[1] = inner.Reverse(3, std::vector<ADouble>{1.0})[2];  // d/dx of it: 4 exp(2 x)
  ADFun<double> f(ax, ay);
  const double e = std::exp(2.0);
  expect_near(f.Forward(0, DVector{1}), {2 * e, 4 * e});
  expect_near(f.Jacobian(DVector{1}), {4 * e, 8 * e});
}

TEST(CppadNested, ComparisonsLeaveGuardsOnBothLevels) {
  using A2 = AD<ADouble>;
  std::vector<ADouble> ax{1.0}, ay(1);
  Independent(ax);
  std::vector<A2> aax{ax[0]}, aay(1);
  Independent(aax);
  aay[0] = aax[0] < 2.0 ? aax[0] * 2 : aax[0];
  ADFun<ADouble> inner(aax, aay);
  ay[0] = inner.Forward(0, ax)[0];
  ADFun<double> f(ax, ay);
  f.Forward(0, DVector{3});
  EXPECT_EQ(f.compare_change_number(), 1u);
}

TEST(CppadNested, ThreeLevels) {
  using A2 = AD<ADouble>;
  using A3 = AD<A2>;
  std::vector<ADouble> x1{2.0}, y1(1);
  Independent(x1);
  std::vector<A2> x2{x1[0]}, y2(1);
  Independent(x2);
  std::vector<A3> x3{x2[0]}, y3(1);
  Independent(x3);
  y3[0] = pow(x3[0], 5);
  ADFun<A2> f3(x3, y3);
  y2[0] = f3.Jacobian(x2)[0];
  ADFun<ADouble> f2(x2, y2);
  y1[0] = f2.Jacobian(x1)[0];
  ADFun<double> f1(x1, y1);
  expect_near(f1.Jacobian(DVector{2}), {60 * 4});
}

TEST(CppadNested, Base2adRecordsDerivatives) {
  ADFun<double> f =
      recorded({1, 2}, [](const AVector& x) -> std::vector<ADouble> { return {x[0] * sin(x[1])}; });
  ADFun<ADouble, double> af = f.base2ad();
  AVector ax(2);
  ax[0] = 1, ax[1] = 2;
  Independent(ax);
  AVector ay = af.Jacobian(ax);
  ADFun<double> g(ax, ay);
  expect_near(g.Forward(0, DVector{3, 0.5}), {std::sin(0.5), 3 * std::cos(0.5)});
  expect_near(g.Jacobian(DVector{3, 0.5}), {0, std::cos(0.5), std::cos(0.5), -3 * std::sin(0.5)});
}

TEST(CppadNested, Base2adWithDynamicParameters) {
  AVector ax(1), ap(1), ay(1);
  ax[0] = 1, ap[0] = 2;
  Independent(ax, ap);
  ay[0] = ap[0] * ax[0] * ax[0];
  ADFun<double> f(ax, ay);
  ADFun<ADouble, double> af = f.base2ad();
  Independent(ax, ap);
  af.new_dynamic(ap);
  af.Forward(0, ax);
  AVector w(1);
  w[0] = 1;
  AVector gradient = af.Reverse(1, w);
  ADFun<double> g(ax, gradient);
  g.new_dynamic(DVector{5});
  expect_near(g.Forward(0, DVector{3}), {30});
}

TEST(CppadEigen, MatricesOfRecordedValues) {
  using Vector = Eigen::Matrix<ADouble, Eigen::Dynamic, 1>;
  using Matrix = Eigen::Matrix<ADouble, Eigen::Dynamic, Eigen::Dynamic>;
  Vector ax(4);
  ax << 4, 1, 1, 3;
  Independent(ax);
  Matrix A(2, 2);
  A << ax[0], ax[1], ax[2], ax[3];
  Vector ay(3);
  ay[0] = (2.0 * A * A.transpose() + Eigen::MatrixXd::Identity(2, 2).cast<ADouble>()).trace();
  ay[1] = A.determinant();
  ay[2] = ax.norm() + ax.squaredNorm() / 2;
  ADFun<double> f(ax, ay);
  const Eigen::VectorXd x = Eigen::Vector4d(1, 2, 3, 4), y = f.Forward(0, x), J = f.Jacobian(x);
  EXPECT_NEAR(y[0], 62, 1e-12);
  EXPECT_NEAR(y[1], -2, 1e-12);
  EXPECT_NEAR(y[2], std::sqrt(30.0) + 15, 1e-12);
  for (int j = 0; j < 4; ++j) EXPECT_NEAR(J[j], 4 * x[j], 1e-12);
  EXPECT_NEAR(J[4], 4, 1e-12);
  EXPECT_NEAR(J[8], 1 / std::sqrt(30.0) + 1, 1e-12);
}

TEST(CppadEigen, MixesWithDoubleAndInverts) {
  using Matrix = Eigen::Matrix<ADouble, 3, 3>;
  using Vector = Eigen::Matrix<ADouble, Eigen::Dynamic, 1>;
  const Eigen::Matrix3d B = Eigen::Matrix3d::Identity() * 2;
  Vector ax = Vector::Constant(1, ADouble(3));
  Independent(ax);
  const Matrix A = B.cast<ADouble>() * ax[0];
  const Matrix inverse = A.inverse();
  Vector ay(1);
  ay[0] = inverse(0, 0) + (B * 0.5).cast<ADouble>().sum() * ax[0];
  ADFun<double> f(ax, ay);
  EXPECT_NEAR(f.Jacobian(Eigen::VectorXd(Eigen::VectorXd::Constant(1, 2.0)))[0], -1.0 / 8 + 3, 1e-12);
}

TEST(CppadEigen, GeometryOfRecordedValues) {
  ADFun<double> f = recorded({0.3}, [](const AVector& x) -> std::vector<ADouble> {
    const Eigen::Matrix<ADouble, 3, 1> axis(ADouble(0), ADouble(0), ADouble(1)),
        point(ADouble(1), ADouble(2), ADouble(3));
    const Eigen::Quaternion<ADouble> q(Eigen::AngleAxis<ADouble>(x[0], axis));
    const Eigen::Matrix<ADouble, 3, 1> turned = q * point, by_matrix = q.toRotationMatrix() * point;
    return {turned[0], turned[1], by_matrix[0], by_matrix[1]};
  });
  const double a = 0.7, c = std::cos(a), s = std::sin(a);
  expect_near(f.Forward(0, DVector{a}), {c - 2 * s, s + 2 * c, c - 2 * s, s + 2 * c});
  expect_near(f.Jacobian(DVector{a}), {-s - 2 * c, c - 2 * s, -s - 2 * c, c - 2 * s});
}

TEST(CppadEigen, FactorisationsOfRecordedValues) {
  ADFun<double> f = recorded({4, 1, 3}, [](const AVector& x) -> std::vector<ADouble> {
    Eigen::Matrix<ADouble, 2, 2> A;
    A << x[0], x[1], x[1], x[2];
    const Eigen::Matrix<ADouble, 2, 1> b(ADouble(1), ADouble(2));
    const Eigen::Matrix<ADouble, 2, 1> y = A.llt().solve(b), z = A.partialPivLu().solve(b);
    return {y[0], y[1], z[0], z[1]};
  });
  expect_near(f.Forward(0, DVector{4, 1, 3}), {1.0 / 11, 7.0 / 11, 1.0 / 11, 7.0 / 11});
  // dy/dA_00 = -A^-1 e0 y0
  const DVector J = f.Jacobian(DVector{4, 1, 3});
  for (std::size_t i : {0u, 2u}) {
    EXPECT_NEAR(J[i * 3], -3.0 / 11 / 11, 1e-14);
    EXPECT_NEAR(J[(i + 1) * 3], 1.0 / 11 / 11, 1e-14);
  }
}

// A cost in the manner of Ceres: a functor of any scalar, by pointers.
struct Residual {
  template <class T>
  bool operator()(const T* x, T* r) const {
    using std::exp;
    r[0] = T(10) * (x[1] - x[0] * x[0]);
    r[1] = T(1) - exp(x[0]);
    return true;
  }
};

TEST(CppadFunctors, OfAnyScalar) {
  std::vector<ADouble> ax{1.0, 2.0}, ay(2);
  Independent(ax);
  ASSERT_TRUE(Residual()(ax.data(), ay.data()));
  ADFun<double> f(ax, ay);
  double r[2];
  const double x[2] = {0.5, 2};
  Residual()(x, r);
  expect_near(f.Forward(0, DVector{0.5, 2}), {r[0], r[1]});
  expect_near(f.Jacobian(DVector{0.5, 2}), {-10, 10, -std::exp(0.5), 0});
}

}  // namespace
