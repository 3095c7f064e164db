// SPDX-License-Identifier: BSD-3-Clause
//
// Rotations where formulas break: no angle, tiny ones, half a turn, quaternions of any length.  Every instance is one point,
// held by every route (every_route.h).
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include <dyntape/dynamics/algebra/lie.h>
#include <dyntape/dynamics/model/configuration.h>

#include "every_route.h"

namespace dyntape::testing::lie_hard_test {
namespace {

using dynamics::JointType;
using dynamics::Vector3;
using dynamics::Vector4;
using Eigen::VectorXd;
constexpr double kPi = std::numbers::pi;

const Eigen::Vector3d& axis() {
  static const Eigen::Vector3d kAxis = Eigen::Vector3d(1, -2, 0.5).normalized();
  return kAxis;
}

// A name for each of a list of angles.
std::string angle_name(const ::testing::TestParamInfo<double>& info) {
  char text[40];
  if (info.param > 3) {
    std::snprintf(text, sizeof text, "pi_less_%g", kPi - info.param);
  } else {
    std::snprintf(text, sizeof text, "%g", info.param);
  }
  std::string name;
  for (const char* c = text; *c; ++c) name += std::isalnum(static_cast<unsigned char>(*c)) ? *c : '_';
  return name;
}

struct LogOfQuaternion {
  template <class T>
  VectorOf<T> operator()(const VectorOf<T>& q) const {
    return dynamics::log(Vector4<T>(q));
  }
};

// Of a turn by `angle`, to the rounding of its entries.
VectorXd quaternion_of(double angle) {
  VectorXd q(4);
  q << std::sin(angle / 2) * axis(), std::cos(angle / 2);
  return q;
}

class LogAtAngles : public ::testing::TestWithParam<double> {};

// H01 | naive: acos of the trace is NaN below 1e-8 rad, 2 acos(w) is 3 % off at 1e-7 rad | holds: log of a quaternion
// to 4e-15 of its size from 0 over denormals, derivatives to 1e-13, all finite | routes: all
// H02 | naive: the antisymmetric part over sin(angle) is garbage within 1e-7 of half a turn | holds: the same
// accuracy up to 1e-15 rad before half a turn | routes: all
TEST_P(LogAtAngles, IsAccurateWithBothDerivatives) {
  const double angle = GetParam();
  Within within;
  within.step = kPi - angle < 1e-6 ? 0 : 1e-9;  // beyond half a turn log comes back from the other side
  expect_by_every_route("log", LogOfQuaternion(), quaternion_of(angle), within);
}

INSTANTIATE_TEST_SUITE_P(Angles, LogAtAngles,
                         ::testing::Values(0.0, 1e-310, 1e-200, 1e-160, 1e-20, 1e-12, 1e-8, 1e-7, 1e-4, 1e-3,
                                           0.1, 1.0, 2.0, kPi - 1e-3, kPi - 1e-5, kPi - 1e-7, kPi - 1e-8,
                                           kPi - 1e-12, kPi - 1e-15),
                         angle_name);

struct LogOfMatrix {
  template <class T>
  VectorOf<T> operator()(const VectorOf<T>& x) const {
    return dynamics::log(dynamics::Matrix3<T>(dynamics::exp(Vector3<T>(x))));
  }
};

class MatrixAtAngles : public ::testing::TestWithParam<double> {};

// H02, H04, H06 | naive: the way over the matrix loses half of the digits near half a turn, and derivatives at no
// rotation are 0 / 0 | holds: log(exp(w)) = w to 1e-14 with Jacobian 1 and Hessian 0, the errors of derivatives in
// proportion to 1 / sin | routes: all
TEST_P(MatrixAtAngles, ThereAndBackIsTheIdentity) {
  const double angle = GetParam(), to_half = kPi - angle;
  const VectorXd w = angle * axis();
  const Function f = record("matrix", 3, [](const VectorXad& x) { return VectorXad(LogOfMatrix()(x)); });
  const EveryRoute routes(f, Order::kSecond, {.lanes = false, .near = 1e-8});
  const EveryRoute::Parts got = routes.parts({w[0], w[1], w[2]});
  const double near_half = 1e-15 / std::min(1.0, to_half);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(got.y[i], w[i], 8e-15 * std::max(angle, 1e-300) + near_half * 1e-2);
  ASSERT_EQ(got.jacobian.size(), 9u);
  for (int k = 0; k < 9; ++k) EXPECT_NEAR(got.jacobian[k], k % 4 == 0 ? 1 : 0, 1e-13 + 1e2 * near_half);
  for (double h : got.hessian) EXPECT_NEAR(h, 0, 1e-12 + 1e3 * near_half / to_half);
}

INSTANTIATE_TEST_SUITE_P(Angles, MatrixAtAngles,
                         ::testing::Values(0.0, 1e-200, 1e-12, 1e-8, 1e-4, 1e-3, 0.1, 1.0, 2.0, 3.0,
                                           kPi - 1e-2, kPi - 1e-3, kPi - 1e-4),
                         angle_name);

// Exactly half a turn: w of the quaternion is 0, the matrix is symmetric.
// H02, X02 | naive: at exactly half a turn the axis comes out as zero or as NaN | holds: log has the length pi to
// 4e-15 and gives the same rotation again, of the quaternion with w = 0 and of the matrix, about every axis | routes:
// all
TEST(HalfATurn, IsHalfATurnAboutEveryAxis) {
  const Function f = record("half", 4, [](const VectorXad& q) {
    VectorXad y(6);
    y << dynamics::log(Vector4<AD>(q)), dynamics::log(dynamics::rotation(Vector4<AD>(q)));
    return y;
  });
  const EveryRoute routes(f, Order::kValue);
  const Eigen::Vector3d axes[] = {{1, 0, 0},  {0, 1, 0},  {0, 0, 1},    {0, 0, -1},     {-1, 0, 0},
                                  {1, 1, 0},  {0, -1, 1}, {1, -2, 0.5}, {1e-9, 1, 0},   {1, 1e-300, 0},
                                  {-1, 0, 1}, {1, 1, 1},  {-1, -1, -1}, {1e-200, 0, 1}, {0.1, 0.2, -0.3}};
  for (const Eigen::Vector3d& direction : axes) {
    const Eigen::Vector3d u = direction.normalized();
    const Values y = routes({u[0], u[1], u[2], 0});
    for (int from : {0, 3}) {
      const Eigen::Vector3d w(y[from], y[from + 1], y[from + 2]);
      EXPECT_NEAR(w.norm(), kPi, 4e-15 * kPi) << direction.transpose();
      EXPECT_NEAR(std::abs(w.dot(u)), kPi, 1e-14) << direction.transpose();
    }
  }
}

struct Coefficients {
  template <class T>
  VectorOf<T> operator()(const VectorOf<T>& x) const {
    VectorOf<T> y(5);
    y << dynamics::stumpff<1>(x[0]), dynamics::stumpff<2>(x[0]), dynamics::stumpff<3>(x[0]),
        dynamics::stumpff<4>(x[0]), dynamics::inverse_jacobian_coefficient(x[0]);
    return y;
  }
};

class CoefficientsAtAngles : public ::testing::TestWithParam<double> {};

// H04 | naive: (1 - cos t)/t^2 and (t - sin t)/t^3 are wrong by 5e-9 at 1e-4 rad and by all at 1e-8 rad, their
// derivatives earlier | holds: value to 4e-15, both derivatives to 1e-13 by the squared angle, on both sides of the
// seam of series and closed form | routes: all
TEST_P(CoefficientsAtAngles, AreAccurateWithBothDerivatives) {
  const double angle = GetParam();
  Within within;
  within.slope = 4e-14, within.curvature = 4e-13;
  // Next to nothing differences would cross zero; at the seam, those of the graph what is left of its series.
  within.step = angle * angle > 1e-3 && angle != 2 ? 1e-9 : 0;
  expect_by_every_route("coefficients", Coefficients(), VectorXd::Constant(1, angle * angle), within);
}

INSTANTIATE_TEST_SUITE_P(Angles, CoefficientsAtAngles,
                         ::testing::Values(0.0, 1e-160, 1e-8, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 1.999, 2.0, 3.0),
                         angle_name);

// --- At exactly zero -----------------------------------------------------------------------------------------

class AtRest : public ::testing::TestWithParam<JointType> {};

// H06, H10 | naive: sqrt(0) in a norm makes the derivative of a difference NaN exactly where every rest-to-rest
// motion starts | holds: (q0 (+) d1) (-) (q0 (+) d2) at d = 0 has the Jacobian (1, -1), and finite second
// derivatives, for each type of joint | routes: all
TEST_P(AtRest, DifferencesOfEqualConfigurationsHaveTheirDerivatives) {
  dynamics::Joint<double> plain;
  plain.type = GetParam();
  plain.pitch = 0.1;
  const int nq = dynamics::nq(plain.type), nv = dynamics::nv(plain.type);
  std::mt19937_64 random(7);
  dynamics::Model<double> model;
  model.add_joint(-1, plain, {}, {1, {0, 0, 0}, Eigen::Matrix3d::Identity()});
  const VectorXd q0 = dynamics::random_configuration(model, random);
  const Function f = record("difference", std::size_t(2 * nv), [&](const VectorXad& d) {
    dynamics::Joint<AD> joint;
    joint.type = plain.type, joint.pitch = plain.pitch;
    VectorXad a(nq), b(nq), y(nv);
    dynamics::integrate<AD>(joint, q0.cast<AD>(), d.head(nv), a);
    dynamics::integrate<AD>(joint, q0.cast<AD>(), d.tail(nv), b);
    dynamics::difference<AD>(joint, b, a, y);
    return y;
  });
  const EveryRoute routes(f, Order::kSecond, {.lanes = false, .size = 1});
  const EveryRoute::Parts got = routes.parts(Values(std::size_t(2 * nv), 0.0));
  for (double y : got.y) EXPECT_NEAR(y, 0, 1e-16);
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(nv, 2 * nv), expected(nv, 2 * nv);
  expected << Eigen::MatrixXd::Identity(nv, nv), -Eigen::MatrixXd::Identity(nv, nv);
  const Pattern& places = routes.derived().jacobian;
  for (std::size_t k = 0; k < places.nnz(); ++k) J(places.row[k], places.col[k]) = got.jacobian[k];
  EXPECT_LE((J - expected).cwiseAbs().maxCoeff(), 1e-15) << J;
  for (double h : got.hessian) EXPECT_LE(std::abs(h), 1 + 1e-14);  // brackets of directions
}

INSTANTIATE_TEST_SUITE_P(Types, AtRest,
                         ::testing::Values(JointType::kRevolute, JointType::kContinuous,
                                           JointType::kPrismatic, JointType::kHelical, JointType::kSpherical,
                                           JointType::kPlanar, JointType::kFreeFlyer),
                         [](const auto& info) {
                           std::string name = dynamics::to_string(info.param);
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

// --- Lengths -------------------------------------------------------------------------------------------------

class Lengths : public ::testing::TestWithParam<double> {
 protected:
  // Rotation, its log, and the quaternion of unit length.
  static Function recorded() {
    return record("lengths", 4, [](const VectorXad& x) {
      const Vector4<AD> q = x;
      VectorXad y(16);
      const dynamics::Matrix3<AD> R = dynamics::rotation(q);
      y << R.col(0), R.col(1), R.col(2), dynamics::log(q), dynamics::normalized(q);
      return y;
    });
  }

 public:
  static std::string named(const ::testing::TestParamInfo<double>& info) {
    std::string name = std::to_string(std::lround(std::log10(info.param)));
    if (name[0] == '-') name[0] = 'm';
    return "ten_to_" + name + "_" + std::to_string(info.index);
  }
};

// H08 | naive: a quaternion of length 1.01 or 1e-3 is taken as it is by one algorithm and normalised by another; at
// 1e-160 its square underflows | holds: all read its direction: the values of unit length to 1e-15 from 1e-150 to
// 1e150, and from 1e-70 to 1e70 derivatives that are those at unit length over the length | routes: all
// H07 | naive: log jumps by a turn between q and -q | holds: both have the same bits in values, and derivatives of the
// other sign | routes: all
TEST_P(Lengths, DirectionIsAllThatIsRead) {
  const double length = GetParam();
  const bool with_slopes = std::abs(std::log10(length)) <= 70;
  const EveryRoute routes(recorded(), with_slopes ? Order::kFirst : Order::kValue);
  const Values q = {0.4, -0.2, 0.7, 0.3};
  Values long_q = q, other = q;
  for (std::size_t i = 0; i < 4; ++i) long_q[i] = q[i] * length, other[i] = -long_q[i];
  const EveryRoute::Parts unit = routes.parts(q), got = routes.parts(long_q), minus = routes.parts(other);
  EXPECT_LE(error_of(got.y, unit.y), 1e-15);
  // The last four are a quaternion, which keeps its sheet.
  EXPECT_TRUE(same_bits({minus.y.begin(), minus.y.begin() + 12}, {got.y.begin(), got.y.begin() + 12}));
  if (!with_slopes) return;
  Values scaled = got.jacobian, negative = minus.jacobian;
  for (double& s : scaled) s *= length;
  for (double& s : negative) s = -s;
  EXPECT_LE(error_of(scaled, unit.jacobian), 1e-14);
  const Pattern& places = routes.derived().jacobian;
  for (std::size_t k = 0; k < places.nnz() && places.row[k] < 12; ++k)
    EXPECT_TRUE(same_bits({negative[k]}, {got.jacobian[k]})) << k;
}

INSTANTIATE_TEST_SUITE_P(Of, Lengths, ::testing::Values(1e-150, 1e-70, 1e-3, 1.01, 1e3, 1e70, 1e150),
                         &Lengths::named);

// --- Screws --------------------------------------------------------------------------------------------------

struct Screw {
  template <class T>
  VectorOf<T> operator()(const VectorOf<T>& x) const {
    const dynamics::Motion<T> back =
        dynamics::log(dynamics::exp(dynamics::Motion<T>{Vector3<T>(x.head(3)), Vector3<T>(x.tail(3))}));
    VectorOf<T> y(6);
    y << back.linear, back.angular;
    return y;
  }
};

class Screws : public ::testing::TestWithParam<double> {};

// H04, H06, X03 | naive: the linear part of log on SE(3) loses 1e-14 just above the seam of its series, and is NaN
// without a rotation | holds: log(exp(xi)) = xi with the identity as its Jacobian from no rotation to 3 rad, the
// translation large beside it | routes: all
TEST_P(Screws, ThereAndBackIsTheIdentity) {
  const double angle = GetParam();
  const Eigen::Vector3d w = angle * axis();
  const Function f = record("screw", 6, [](const VectorXad& x) { return VectorXad(Screw()(x)); });
  const EveryRoute routes(f, Order::kFirst, {.near = 1e-12});
  const Values x = {100, -3, 0.2, w[0], w[1], w[2]};
  const EveryRoute::Parts got = routes.parts(x);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(got.y[i], x[i], 4e-14 * 100);
  for (int i = 3; i < 6; ++i) EXPECT_NEAR(got.y[i], x[i], 4e-15 * std::max(angle, 1e-300));
  for (std::size_t k = 0; k < got.jacobian.size(); ++k) {
    const Pattern& places = routes.derived().jacobian;
    EXPECT_NEAR(got.jacobian[k], places.row[k] == places.col[k] ? 1 : 0, 1e-11) << k;
  }
}

INSTANTIATE_TEST_SUITE_P(Angles, Screws, ::testing::Values(0.0, 1e-160, 1e-8, 1e-3, 1.0, 3.0), angle_name);

}  // namespace
}  // namespace dyntape::testing::lie_hard_test
