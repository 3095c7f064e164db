// SPDX-License-Identifier: BSD-3-Clause
//
// Eigen with AD computes what Eigen with double computes, and differentiates.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>

#include <dyntape/autodiff/record/linear_algebra.h>
#include <dyntape/autodiff/record/record.h>

#include "autodiff/dense.h"
#include "autodiff/quad.h"
#include "autodiff/random.h"

namespace dyntape::testing::eigen_test {
namespace {

template <class T>
using Vec = Eigen::Matrix<T, Eigen::Dynamic, 1>;
template <class T>
using Mat = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>;
template <class T>
using Vec3 = Eigen::Matrix<T, 3, 1>;
template <class T>
using Mat3 = Eigen::Matrix<T, 3, 3>;

// Records `f` at a random point, holds its value to f in double and its Jacobian to differences, there and
// at neighbouring points.  `guards`: whether Eigen branches on the way.
template <class F>
void check(const char* name, std::size_t n, F f, bool guards = false) {
  SCOPED_TRACE(name);
  Random random(11);
  RecordOptions options;
  options.variables = random.vector(n, 0.3, 1.2);
  const Function recorded = record(
      name, n, [&](const VectorXad& x) { return VectorXad(f(x)); }, options);
  EXPECT_EQ(recorded.guards.empty(), !guards);
  for (int trial = 0; trial < 5; ++trial) {
    std::vector<double> x = options.variables;
    for (double& t : x) t += random.uniform(-1e-3, 1e-3);
    const Eigen::VectorXd at = Eigen::Map<const Eigen::VectorXd>(x.data(), static_cast<Eigen::Index>(n));
    const Eigen::VectorXd direct = f(at);
    const std::vector<double> y = evaluate(recorded, x);
    ASSERT_EQ(static_cast<std::size_t>(direct.size()), y.size());
    const double scale = 1 + direct.cwiseAbs().maxCoeff();
    for (std::size_t i = 0; i < y.size(); ++i) {  // Eigen adds up doubles in another order
      EXPECT_NEAR(y[i], direct[static_cast<Eigen::Index>(i)], 1e-13 * scale) << i;
    }
    const Eigen::MatrixXd j = jacobian(recorded, x);
    for (std::size_t k = 0; k < n; ++k) {
      const std::vector<Quad> column = difference(recorded, x, k);
      for (std::size_t i = 0; i < y.size(); ++i) {
        const auto expected = static_cast<double>(column[i]);
        EXPECT_NEAR(j(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)), expected,
                    1e-11 * (scale + std::abs(expected)));
      }
    }
  }
}

template <class X>
using ScalarOf = typename std::decay_t<X>::Scalar;

// A matrix of the entries of x, and a symmetric positive definite one.
template <class X>
Mat3<ScalarOf<X>> matrix(const X& x) {
  Mat3<ScalarOf<X>> m;
  m << x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8];
  return m;
}
template <class X>
Mat3<ScalarOf<X>> definite(const X& x) {
  using T = ScalarOf<X>;
  return matrix(x) * matrix(x).transpose() + 2.0 * Mat3<T>::Identity();
}

TEST(Eigen, Products) {
  check("matrix times vector", 12, [](const auto& x) { return (matrix(x) * x.tail(3)).eval(); });
  check("quadratic form", 12, [](const auto& x) {
    using T = ScalarOf<decltype(x)>;
    return Vec<T>::Constant(1, x.tail(3).dot(matrix(x).transpose() * x.tail(3))).eval();
  });
  check("dynamic product", 9, [](const auto& x) {
    using T = ScalarOf<decltype(x)>;
    const Mat<T> m = matrix(x);
    const Mat<T> p = m * m * m.transpose();
    return Vec<T>(p.reshaped());
  });
  check("dot and cross", 6, [](const auto& x) {
    using T = ScalarOf<decltype(x)>;
    const Vec3<T> a = x.head(3), b = x.tail(3);
    Vec<T> y(4);
    y << a.cross(b), a.dot(b);
    return y;
  });
}

TEST(Eigen, MixedWithDouble) {
  check("double scalars", 3, [](const auto& x) { return (2.0 * x / 3.0 + x * 2 - 3 * x).eval(); });
  check("double matrix", 3, [](const auto& x) {
    using T = ScalarOf<decltype(x)>;
    Eigen::Matrix3d m;
    m << 1, 2, 3, 4, 5, 6, 7, 8, 10;
    return Vec<T>(m * x);
  });
  check("cast and add", 3, [](const auto& x) {
    using T = ScalarOf<decltype(x)>;
    return Vec<T>(x + Eigen::Vector3d(1, 2, 3).template cast<T>());
  });
}

TEST(Eigen, Norms) {
  check("norms", 4, [](const auto& x) {
    using T = ScalarOf<decltype(x)>;
    Vec<T> y(5);
    y << x.norm(), x.squaredNorm(), x.template lpNorm<1>(), x.sum(), x.prod();
    return y;
  });
  check(
      "normalized", 3, [](const auto& x) { return Vec<ScalarOf<decltype(x)>>(x.normalized()); }, true);
  check("branch-free normalized", 3, [](const auto& x) { return normalized(x); });
}

TEST(Eigen, BlocksAndInitialisers) {
  check("blocks", 9, [](const auto& x) {
    using T = ScalarOf<decltype(x)>;
    Mat3<T> m = matrix(x);
    m.template topLeftCorner<2, 2>() += m.template bottomRightCorner<2, 2>();
    m.col(1).swap(m.col(2));
    m.row(0) *= 2;
    m.diagonal().array() += 1.0;
    Vec<T> y(5);
    y << m.col(0), m.trace(), m(1, 2);
    return y;
  });
  check("coefficient-wise", 3, [](const auto& x) {
    using T = ScalarOf<decltype(x)>;
    Vec<T> y(18);
    y << x.array().sin(), x.array().exp(), x.array().sqrt(), x.array().abs(), x.array().square(),
        (x.array() / 2 + 1).log();
    return y;
  });
}

TEST(Eigen, InverseAndDeterminant) {
  check("inverse 3x3", 9,
        [](const auto& x) { return Vec<ScalarOf<decltype(x)>>(definite(x).inverse().eval().reshaped()); });
  check("determinant 3x3", 9, [](const auto& x) {
    return Vec<ScalarOf<decltype(x)>>::Constant(1, matrix(x).determinant()).eval();
  });
}

TEST(Eigen, Rotations) {
  check("quaternion product and rotation", 11, [](const auto& x) {
    using T = ScalarOf<decltype(x)>;
    const Eigen::Quaternion<T> a(x[0], x[1], x[2], x[3]), b(x[4], x[5], x[6], x[7]);
    const Vec3<T> v = x.tail(3);
    Vec<T> y(13);
    y << (a * b).coeffs(), (a * b) * v, a.conjugate().coeffs(), a.toRotationMatrix().diagonal().sum(),
        a.dot(b);
    return y;
  });
  check("angle and axis", 4, [](const auto& x) {
    using T = ScalarOf<decltype(x)>;
    return Vec<T>(Eigen::AngleAxis<T>(x[0], Vec3<T>(x.tail(3))).toRotationMatrix().reshaped());
  });
  check(
      "quaternion of a rotation matrix", 3,
      [](const auto& x) {
        using T = ScalarOf<decltype(x)>;
        const Mat3<T> r =
            (Eigen::AngleAxis<T>(x[0], Vec3<T>::UnitX()) * Eigen::AngleAxis<T>(x[1], Vec3<T>::UnitY()))
                .toRotationMatrix();
        return Vec<T>(Eigen::Quaternion<T>(r).coeffs());
      },
      true);
}

TEST(Eigen, Factorisations) {
  check("LLT", 12,
        [](const auto& x) { return Vec<ScalarOf<decltype(x)>>(definite(x).llt().solve(x.tail(3))); });
  check("LDLT", 12,
        [](const auto& x) { return Vec<ScalarOf<decltype(x)>>(definite(x).ldlt().solve(x.tail(3))); });
  check("partial-pivot LU", 12, [](const auto& x) {
    return Vec<ScalarOf<decltype(x)>>(definite(x).partialPivLu().solve(x.tail(3)));
  });
  check("QR", 12, [](const auto& x) {
    return Vec<ScalarOf<decltype(x)>>(definite(x).householderQr().solve(x.tail(3)));
  });
  check(
      "full-pivot LU", 12,
      [](const auto& x) { return Vec<ScalarOf<decltype(x)>>(definite(x).fullPivLu().solve(x.tail(3))); },
      true);
  check("branch-free llt", 12,
        [](const auto& x) { return Vec<ScalarOf<decltype(x)>>(llt_solve(llt(definite(x)), x.tail(3))); });
  check("branch-free ldlt", 12,
        [](const auto& x) { return Vec<ScalarOf<decltype(x)>>(ldlt_solve(ldlt(definite(x)), x.tail(3))); });
}

TEST(Eigen, CastsToNumbersAreTheValuesOfTheRecordingPoint) {
  RecordOptions options;
  options.variables = {1.5, -2.5};
  const Function f = record(
      "cast", 2,
      [](const VectorXad& x) {
        EXPECT_EQ(x.cast<double>(), Eigen::Vector2d(1.5, -2.5));
        EXPECT_EQ(x.cast<float>(), Eigen::Vector2f(1.5f, -2.5f));
        EXPECT_EQ(x.cast<int>(), Eigen::Vector2i(1, -2));
        return VectorXad(x + x.cast<double>());
      },
      options);
  EXPECT_EQ(evaluate(f, {10, 20}), (std::vector<double>{11.5, 17.5}));
}

TEST(LinearAlgebra, NormalizedReachesEveryLengthButZero) {
  const Function f = record("normalized", 2, [](const VectorXad& x) { return normalized(x); });
  for (const double length :
       {5e-324, 1e-310, 1e-200, 1e-160, 1e-150, 1.0, 1e150, 1e160, 1e200, 1e240, 1e307}) {
    const Eigen::Vector2d v = length * Eigen::Vector2d(3, 4);
    const double y = v[1] / v[0];  // the digits that the smallest lengths have
    const Eigen::Vector2d expected(1 / std::hypot(1, y), y / std::hypot(1, y));
    EXPECT_LE((normalized(v) - expected).norm(), 1e-15) << length;
    const std::vector<double> found = evaluate(f, {v[0], v[1]});
    EXPECT_EQ(found, (std::vector<double>{normalized(v)[0], normalized(v)[1]})) << length;
    if (length < 1e-150 || length > 1e240) continue;  // the slope, 1 / length, has a range of its own
    const Eigen::MatrixXd slope = jacobian(f, {v[0], v[1]}) * (5 * length);
    EXPECT_NEAR(slope(0, 0), 0.64, 1e-13) << length;
    EXPECT_NEAR(slope(0, 1), -0.48, 1e-13) << length;
  }
  // Where squares have room the bits are those of the plain formula.
  Random random(17);
  SCOPED_TRACE(random.seed_text());
  for (int i = 0; i < 1000; ++i) {
    const auto x = random.vector(3, -2, 2);
    const Eigen::Vector3d v = Eigen::Vector3d(x.data()) * std::pow(10, random.uniform(-100, 100));
    const double inverse = 1 / std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    EXPECT_EQ(normalized(v), (v * inverse).eval());
  }
}

TEST(LinearAlgebra, FactorsMultiplyBackToTheMatrix) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Random random(seed);
    SCOPED_TRACE(random.seed_text());
    const auto n = static_cast<Eigen::Index>(1 + random.below(8));
    Eigen::MatrixXd a = Eigen::MatrixXd::NullaryExpr(n, n, [&] { return random.uniform(-1, 1); });
    const Eigen::MatrixXd m = a * a.transpose() + Eigen::MatrixXd::Identity(n, n);
    const Eigen::MatrixXd b = Eigen::MatrixXd::NullaryExpr(n, 2, [&] { return random.uniform(-1, 1); });
    const Eigen::MatrixXd l = llt(m);
    const auto f = ldlt(m);
    EXPECT_LE((l * l.transpose() - m).norm(), 1e-14 * m.norm());
    EXPECT_LE((f.l * f.d.asDiagonal() * f.l.transpose() - m).norm(), 1e-14 * m.norm());
    EXPECT_LE((m * llt_solve(l, b) - b).norm(), 1e-12 * m.norm());
    EXPECT_LE((m * ldlt_solve(f, b) - b).norm(), 1e-12 * m.norm());
  }
}

TEST(LinearAlgebra, EdgesAndErrors) {
  EXPECT_TRUE(std::isnan(llt(Eigen::MatrixXd::Constant(1, 1, -1.0))(0, 0)));
  EXPECT_EQ(normalized(Eigen::Vector3d(0, 0, 0)).norm(), 0);
  EXPECT_THROW(llt(Eigen::MatrixXd::Zero(2, 3)), ArgumentError);
  EXPECT_THROW(llt_solve(Eigen::MatrixXd::Identity(2, 2), Eigen::VectorXd::Zero(3)), ArgumentError);
  // The zero vector: slope zero, not 0 * inf.
  const Function f = record("normalized", 2, [](const VectorXad& x) { return normalized(x); });
  EXPECT_EQ(jacobian(f, {0, 0}).norm(), 0);
  EXPECT_EQ(hessian(f, {0, 0}, {1, 1}).norm(), 0);
}

TEST(Eigen, AFactorisationThatLeavesItsBranchNamesThePlace) {
  const Function f = record("solve", 4, [](const VectorXad& x) {
    Eigen::Matrix<AD, 2, 2> m;
    m << 2.0 + x[0], x[1], x[1], 2.0 + x[2];
    const Eigen::FullPivLU<Eigen::Matrix<AD, 2, 2>> factor(m);
    return VectorXad(factor.solve(Eigen::Matrix<AD, 2, 1>(x[3], 1.0)));
  });
  ASSERT_FALSE(f.guards.empty());
  EXPECT_NO_THROW(evaluate(f, {0.8, 0.5, 1.2, 2}));
  try {
    evaluate(f, {7, 0.5, -1.5, 2});
    FAIL() << "the largest entry is another one";
  } catch (const GuardViolation& e) {
    EXPECT_NE(std::string(e.what()).find("Eigen/src/"), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("\"solve\""), std::string::npos) << e.what();
  }
}

TEST(Eigen, InfoIsADecisionAndLeavesAGuard) {
  const Function f = record("solve", 3, [](const VectorXad& x) {
    Eigen::Matrix<AD, 2, 2> m;
    m << 2.0 + x[0], x[1], x[1], 2.0 + x[2];
    const Eigen::LLT<Eigen::Matrix<AD, 2, 2>> factor(m);
    EXPECT_EQ(factor.info(), Eigen::Success);
    return VectorXad(factor.solve(Eigen::Matrix<AD, 2, 1>(1.0, 1.0)));
  });
  EXPECT_EQ(f.guards.size(), 2u);
  EXPECT_NO_THROW(evaluate(f, {5, 0.5, 7}));
  EXPECT_THROW(evaluate(f, {-3, 0.5, 7}), GuardViolation);
}

}  // namespace
}  // namespace dyntape::testing::eigen_test
