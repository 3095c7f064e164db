// SPDX-License-Identifier: BSD-3-Clause
//
// Rotations and placements, from 0 over denormals to half a turn, against 113 bits.
#include <gtest/gtest.h>

#include <dyntape/dynamics/algebra/float128.h>

#include <algorithm>
#include <cmath>

#include "dynamics/random_robots.h"

namespace dyntape::dynamics::lie_test {
namespace {

using Matrix3d = Matrix3<double>;
using Vector3d = Vector3<double>;
using Eigen::Vector4d;

constexpr double kEps = 0x1p-52;
const double kPi = std::acos(-1.0);

double units(double got, const Float128& exact) {
  if (exact == 0) return std::abs(got) / kEps;
  return static_cast<double>(abs((Float128(got) - exact) / exact)) / kEps;
}

// The second derivative in one sweep: value, slope and curvature of a function of one variable.
template <class S>
struct Jet {
  S f, d, dd;
  Jet(S value = 0) : f(value), d(0), dd(0) {}
  Jet(S value, S slope, S curvature) : f(value), d(slope), dd(curvature) {}
};
template <class S>
Jet<S> chain(const Jet<S>& x, S f, S d, S dd) {
  return {f, d * x.d, dd * x.d * x.d + d * x.dd};
}
template <class S>
Jet<S> operator+(const Jet<S>& x, const Jet<S>& y) {
  return {x.f + y.f, x.d + y.d, x.dd + y.dd};
}
template <class S>
Jet<S> operator-(const Jet<S>& x, const Jet<S>& y) {
  return {x.f - y.f, x.d - y.d, x.dd - y.dd};
}
template <class S>
Jet<S> operator*(const Jet<S>& x, const Jet<S>& y) {
  return {x.f * y.f, x.d * y.f + x.f * y.d, x.dd * y.f + 2 * x.d * y.d + x.f * y.dd};
}
template <class S>
Jet<S> operator/(const Jet<S>& x, const Jet<S>& y) {
  return x * chain<S>(y, 1 / y.f, -1 / (y.f * y.f), 2 / (y.f * y.f * y.f));
}
template <class S>
bool operator<(const Jet<S>& x, const Jet<S>& y) {
  return x.f < y.f;
}
template <class S>
Jet<S> sqrt(const Jet<S>& x) {
  using std::sqrt;
  const S r = sqrt(x.f);
  return chain<S>(x, r, 1 / (2 * r), -1 / (4 * r * x.f));
}
template <class S>
Jet<S> sin(const Jet<S>& x) {
  using std::cos, std::sin;
  return chain<S>(x, sin(x.f), cos(x.f), -sin(x.f));
}
template <class S>
Jet<S> cos(const Jet<S>& x) {
  using std::cos, std::sin;
  return chain<S>(x, cos(x.f), -sin(x.f), -cos(x.f));
}
template <class S>
Jet<S> atan(const Jet<S>& x) {
  using std::atan;
  const S g = 1 / (1 + x.f * x.f);
  return chain<S>(x, atan(x.f), g, -2 * x.f * g * g);
}
using JetD = Jet<double>;

// c_k and its derivatives in 113 bits, by the series with as many terms as it takes; d c_k is (k c_(k+2) -
// c_(k+1)) / 2 and must not be needed here.
Jet<Float128> exact_stumpff(int k, double z) {
  Float128 term = 1;
  for (int i = 2; i <= k; ++i) term /= i;
  const Float128 x(z);
  Float128 f = 0, d = 0, dd = 0, power = 1, power1 = 0, power2 = 0;  // x^n and its derivatives
  for (int n = 0; n < 80; ++n) {
    f += term * power;
    d += term * power1;
    dd += term * power2;
    power2 = power2 * x + 2 * power1;
    power1 = power1 * x + power;
    power *= x;
    term /= -Float128((2 * n + k + 1) * (2 * n + k + 2));
  }
  return {f, d, dd};
}

template <int K>
void check_coefficient(double limit, double slope_limit, double curvature_limit) {
  Random random(K + 1);
  double worst[3] = {0, 0, 0};
  for (int n = 0; n < 4000; ++n) {
    const double t = n % 2 ? std::pow(10, random.uniform(-9, 0.49)) : random.uniform(0, kPi);
    const double z = n == 0 ? 0 : t * t;
    if (K == 0 && z > 2) continue;  // zero of the cosine
    if (K == 1 && z > 8) continue;  // zero of the sine
    const JetD got = stumpff<K>(JetD(z, 1, 0));
    const Jet<Float128> exact = exact_stumpff(K, z);
    worst[0] = std::max(worst[0], units(got.f, exact.f));
    worst[1] = std::max(worst[1], units(got.d, exact.d));
    worst[2] = std::max(worst[2], units(got.dd, exact.dd));
  }
  EXPECT_LE(worst[0], limit) << "c_" << K;
  EXPECT_LE(worst[1], slope_limit) << "c_" << K;
  EXPECT_LE(worst[2], curvature_limit) << "c_" << K;
}

TEST(Coefficients, AreAccurateWithTwoDerivativesUpToHalfATurn) {
  check_coefficient<0>(4, 4, 4);
  check_coefficient<1>(4, 4, 4);
  check_coefficient<2>(4, 4, 4);
  check_coefficient<3>(4, 4, 4);
  check_coefficient<4>(4, 4, 4);
  check_coefficient<5>(4, 4, 4);
}

TEST(Coefficients, InverseJacobianCoefficient) {
  Random random(1);
  double worst = 0;
  for (int n = 0; n < 4000; ++n) {
    const double t = n % 2 ? std::pow(10, random.uniform(-9, 0)) : random.uniform(0, kPi);
    const double z = t * t;
    const Float128 quarter = Float128(z) / 4;
    const Float128 exact =
        (exact_stumpff(2, z / 4).f - exact_stumpff(3, z / 4).f) / (4 * exact_stumpff(1, z / 4).f);
    if (z > 1e-3) {  // and that is (1 - (t/2) cot(t/2)) / t^2
      const Float128 h = sqrt(quarter);
      EXPECT_LE(static_cast<double>(abs((1 - h / tan(h)) / z - exact)), 1e-28);
    }
    worst = std::max(worst, units(inverse_jacobian_coefficient(z), exact));
  }
  EXPECT_LE(worst, 5);
  EXPECT_DOUBLE_EQ(inverse_jacobian_coefficient(0.0), 1.0 / 12);
}

TEST(Coefficients, BeyondHalfATurn) {
  Random random(2);
  for (int n = 0; n < 1000; ++n) {
    const double z = random.uniform(10, 60);
    EXPECT_NEAR(stumpff<2>(z), static_cast<double>(exact_stumpff(2, z).f), 1e-15);
    EXPECT_NEAR(stumpff<3>(z), static_cast<double>(exact_stumpff(3, z).f), 1e-15);
    EXPECT_NEAR(stumpff<5>(z), static_cast<double>(exact_stumpff(5, z).f), 1e-16);
  }
}

// log(exp w) = w, |w| down to denormals and up to half a turn.
TEST(Log, InvertsExpAtEveryAngle) {
  Random random(3);
  std::vector<double> angles = {0, 1e-300, 1e-200, 1e-160};
  for (int k = 1; k <= 15; ++k) angles.push_back(std::pow(10, -k));
  for (int k = 1; k <= 15; ++k) angles.push_back(kPi - std::pow(10, -k));
  for (int k = 0; k < 200; ++k) angles.push_back(random.uniform(0, kPi));
  for (const double angle : angles) {
    const Vector3d w = random.vector3().normalized() * angle;
    const Vector3d from_quaternion = log(exp_quaternion(w)), from_matrix = log(exp(w));
    EXPECT_LE((from_quaternion - w).norm(), 4 * kEps * angle) << angle;
    EXPECT_LE((from_matrix - w).norm(), 8 * kEps * angle) << angle;
    EXPECT_LE((exp(from_matrix) - exp(w)).norm(), 8 * kEps) << angle;
  }
}

TEST(Log, OfHalfATurnIsHalfATurn) {
  for (int k = 0; k < 3; ++k) {
    const Vector3d w = Vector3d::Unit(k) * kPi;
    EXPECT_LE((log(exp_quaternion(w)) - w).norm(), 4 * kEps);
    EXPECT_NEAR(log(exp(w)).norm(), kPi, 4 * kEps);
    Vector4d q = Vector4d::Zero();
    q[k] = 1;  // exactly half a turn: both signs of q must choose one sheet
    EXPECT_EQ(log(q), log(Vector4d(-q)));
    EXPECT_EQ(log(q), w);
  }
}

[[gnu::noinline]] Vector3d log_of(const Vector4d& q) { return log(q); }

// Compiled for itself, as the algorithms are, and not folded into a test.
TEST(Log, OfEverySign) {
  for (int i = 0; i < 81; ++i) {
    const Vector4d q(i % 3 - 1, i / 3 % 3 - 1, i / 9 % 3 - 1, i / 27 - 1);
    if (q.isZero()) continue;
    const Vector3d w = log_of(q);
    EXPECT_LE(w.norm(), kPi + 1e-15) << q.transpose();
    EXPECT_LE((log_of(Vector4d(-q)) - w).norm(), 1e-15) << q.transpose();
    EXPECT_LE((rotation(q) - exp(w)).norm(), 1e-14) << q.transpose();
  }
}

TEST(Quaternions, BothSignsAndAnyLengthAreOneRotation) {
  Random random(4);
  for (int n = 0; n < 500; ++n) {
    const Vector4d q = random.vector(4), minus = -q;
    EXPECT_EQ(log(q), log(minus));
    EXPECT_EQ(rotation(q), rotation(minus));
    for (const double length : {1e-3, 1.01, 1e3}) {
      EXPECT_LE((log(Vector4d(q * length)) - log(q)).norm(), 8 * kEps * kPi);
      EXPECT_LE((rotation(Vector4d(q * length)) - rotation(q)).norm(), 8 * kEps);
    }
    EXPECT_LE((rotation(q) * rotation(q).transpose() - Matrix3d::Identity()).norm(), 8 * kEps);
  }
}

TEST(Quaternions, OfAMatrixAtEveryAngle) {
  Random random(5);
  for (int n = 0; n < 2000; ++n) {
    const Vector3d w = random.vector3().normalized() * (n % 4 ? random.uniform(0, kPi) : kPi - 1e-9);
    const Matrix3d R = exp(w);
    EXPECT_LE((rotation(quaternion(R)) - R).norm(), 12 * kEps) << w.transpose();
    const Vector4d a = random.vector(4), b = random.vector(4);
    EXPECT_LE((rotation(quaternion_product(a, b)) - rotation(a) * rotation(b)).norm(), 16 * kEps);
  }
}

TEST(Screws, LogInvertsExp) {
  Random random(6);
  for (int n = 0; n < 500; ++n) {
    const double angle = n % 3 ? random.uniform(0, kPi - 1e-3) : std::pow(10, random.uniform(-12, -1));
    const Motion<double> xi{random.vector3(2), random.vector3().normalized() * angle};
    const Motion<double> back = log(exp(xi));
    EXPECT_LE((back.vector() - xi.vector()).norm(), 64 * kEps * xi.vector().norm()) << "angle " << angle;
    const Placement<double> X = exp(xi) * exp(Motion<double>{-xi.linear, -xi.angular});
    EXPECT_LE((X.R - Matrix3d::Identity()).norm() + X.p.norm(), 32 * kEps);
  }
}

// exp(xi + d) = exp(xi) exp(J d), J from differences in 113 bits.
TEST(Screws, RightJacobians) {
  using Vq = Vector6<Float128>;
  Random random(7);
  const Float128 h(1e-11);
  const auto motion_of = [](const Vq& x) { return Motion<Float128>{x.head<3>(), x.tail<3>()}; };
  for (int n = 0; n < 60; ++n) {
    const double angle = n == 0 ? 0 : n % 3 ? random.uniform(0, kPi) : std::pow(10, random.uniform(-12, -1));
    const Motion<double> xi{random.vector3(2), random.vector3().normalized() * angle};
    const Vq x = xi.vector().cast<Float128>();
    Matrix6<double> expected;
    for (int k = 0; k < 6; ++k) {
      const Vq e = Vq::Unit(k) * h;
      const auto from = [&](const Vq& y) {
        return log(inverse(exp(motion_of(x))) * exp(motion_of(y))).vector();
      };
      const Vq slope = (from(x + e) - from(x - e)) / (2 * h);
      expected.col(k) = slope.cast<double>();
    }
    const Matrix6<double> J = right_jacobian(xi);
    EXPECT_LE((J - expected).norm(), 32 * kEps * J.norm()) << "angle " << angle;
    EXPECT_LE((inverse_right_jacobian(xi) * J - Matrix6<double>::Identity()).norm(),
              32 * kEps * J.norm() * J.norm());
    EXPECT_LE((right_jacobian(xi.angular) - J.topLeftCorner<3, 3>()).norm(), 1e-30);
  }
}

// Exactly at zero, first and second derivatives are those of the power series: exp w = 1 + W + W^2/2 + ...,
// and log undoes it.
TEST(AtZero, FirstAndSecondDerivativesAreExact) {
  for (int k = 0; k < 3; ++k) {
    Vector3<JetD> w;
    for (int i = 0; i < 3; ++i) w[i] = JetD(0, i == k ? 1 : 0, 0);
    const Vector4<JetD> q = exp_quaternion(w);
    EXPECT_EQ(q[3].f, 1);
    EXPECT_EQ(q[3].d, 0);
    EXPECT_EQ(q[3].dd, -0.25);
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(q[i].d, i == k ? 0.5 : 0);
      EXPECT_EQ(q[i].dd, 0);
    }
    // log takes half the angle from atan: |v|^2 = s and n = sqrt(s + w^2) with w = 1.
    const JetD s = q[0] * q[0] + q[1] * q[1] + q[2] * q[2];
    const JetD ratio = atan_ratio(s);
    EXPECT_EQ(ratio.f, 1);
    EXPECT_EQ(ratio.d, 0);
    EXPECT_NEAR(ratio.dd, -2 * 0.25 / 3, 1e-16);
  }
}

}  // namespace
}  // namespace dyntape::dynamics::lie_test
