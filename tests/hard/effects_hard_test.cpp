// SPDX-License-Identifier: BSD-3-Clause
//
// Effects at their onsets, far beyond them and at their apexes, by every route, against 113 bits.
#include <gtest/gtest.h>
#include <xmmintrin.h>

#include <cmath>

#include <dyntape/dynamics/effects/effects.h>
#include <dyntape/interface/robot/robot_functions.h>

#include "every_route.h"

namespace dyntape::effects_hard_test {
namespace {

using dynamics::ContactExponent;
using dynamics::Effects;
using dynamics::JointType;
using dynamics::Model;
using Eigen::VectorXd;
using testing::EveryRoute;
using testing::Float128;
using ::testing::Values;

// A mass on massless slides along x, y and z.
Model<double> particle(double mass) {
  Model<double> model;
  model.name = "particle";
  for (int k = 0; k < 3; ++k) {
    dynamics::Joint<double> slide;
    slide.name = std::string("slide_") + "xyz"[k];
    slide.type = JointType::kPrismatic;
    slide.axis = Eigen::Vector3d::Unit(k);
    model.add_joint(k - 1, slide, {}, {k == 2 ? mass : 0, Eigen::Vector3d::Zero(), Eigen::Matrix3d::Zero()});
  }
  model.frames.push_back({"mass", 2, {}});
  return model;
}

Model<double> slider(double lower = -HUGE_VAL, double upper = HUGE_VAL) {
  Model<double> model;
  model.name = "slider";
  dynamics::Joint<double> slide;
  slide.name = "slide";
  slide.type = JointType::kPrismatic;
  slide.axis = Eigen::Vector3d::UnitX();
  slide.limits.lower = lower, slide.limits.upper = upper;
  model.add_joint(-1, slide, {}, {1, Eigen::Vector3d::Zero(), Eigen::Matrix3d::Zero()});
  return model;
}

// Accelerations of (q, v, tau) in T.
template <class T>
testing::VectorOf<T> accelerations(const Model<double>& model, const Effects<double>& effects,
                                   const testing::VectorOf<T>& x) {
  const Model<T> robot = model.cast<T>();
  const Effects<T> acting = effects.cast<T>();
  dynamics::Data<T> data(robot);
  dynamics::EffectTorques<T> torques(robot);
  return dynamics::forward_dynamics<T>(robot, data, torques, acting, x.head(model.nq),
                                       x.segment(model.nq, model.nv), x.tail(model.nv));
}

struct Allowed {
  double value = 1e-14, slope = 1e-12, curvature = 1e-11;
};

// Value and derivatives by every route against 113 bits; all finite.  Returns them.
EveryRoute::Parts expect_exact(const Model<double>& model, const Effects<double>& effects, const Values& x,
                               const Allowed& allowed = {}) {
  const EveryRoute routes(record_forward_dynamics(model, effects), Order::kSecond,
                          {.near = std::max(1e-11, allowed.curvature)});
  const testing::VectorOf<Float128> in_quad =
      Eigen::Map<const VectorXd>(x.data(), long(x.size())).cast<Float128>();
  const testing::VectorOf<Float128> exact = accelerations<Float128>(model, effects, in_quad);
  testing::expect_accurate(routes, x, {exact.begin(), exact.end()},
                           {.value = allowed.value, .slope = allowed.slope, .curvature = allowed.curvature});
  return routes.parts(x);
}

// --- Contacts ------------------------------------------------------------------------------------------------

struct Touch {
  const char* name;
  double depth, rate;  // penetration (m), its rate (m/s)
  double sliding = 0;  // m/s
};

class ContactAt : public ::testing::TestWithParam<std::tuple<ContactExponent, Touch>> {
 protected:
  static Effects<double> ground(const Model<double>& model, ContactExponent exponent) {
    Effects<double> effects;
    effects.gravity = false;
    dynamics::ContactBody<double> ball;
    dynamics::place_at_frame(model, "mass", ball);
    ball.stiffness = 1e5, ball.dissipation = 0.5, ball.friction = 0.8, ball.exponent = exponent;
    effects.contacts.push_back(ball);
    return effects;
  }
};

// H47, X01 | naive: the second derivative of x^1.5 is infinite at touch, sqrt of a negative depth is NaN in the
// branch that is not taken | holds: value, derivatives and curvatures are finite and right on both sides of touch, at it,
// at a depth of 1e-300 m | routes: template in double, all of C and the interpreter, forward and reverse, as a callee
// H46 | naive: 1 + d x' below zero pulls on whoever leaves fast | holds: the normal force is never negative and
// exactly zero beyond - 1 / d | routes: the same
// H54 | naive: u_t / |u_t| at the apex of the friction cone is 0 / 0 | holds: smooth at rest, with the slope - mu f_n
// / eps | routes: the same
// H23 | naive: softplus contacts leave forces of 1e-320 N ten metres above the ground | holds: exactly 0 there, with
// derivatives | routes: the same
// X07 | naive: a wall hit at 1 km/s leaves the range of the law, or is passed between two tests for touch | holds:
// the force is that of 113 bits at any depth and speed | routes: the same
TEST_P(ContactAt, IsTheLawWithItsSlopes) {
  const auto& [exponent, touch] = GetParam();
  const Model<double> model = particle(0.5);
  const Effects<double> effects = ground(model, exponent);
  const Values x = {0, 0, -touch.depth, touch.sliding, 0, -touch.rate, 0, 0, 0};
  // The curvature of tanh(s) / s at s = 1e-8 is a difference that keeps half of the digits of the largest one.
  const bool near_apex = touch.sliding > 0 && touch.sliding < 1e-9;
  const EveryRoute::Parts got =
      expect_exact(model, effects, x, near_apex ? Allowed{1e-14, 1e-12, 1e-8} : Allowed{});
  EXPECT_GE(got.y[2], 0);
  if (touch.depth <= 0 || touch.rate < -2) {
    for (const Values* part : {&got.y, &got.jacobian, &got.hessian}) {
      for (double number : *part)
        EXPECT_TRUE(number == 0 || part == &got.jacobian) << number;  // tau moves it
    }
    EXPECT_EQ(got.y[0], 0);
  } else {
    const double f = got.y[2] * 0.5;
    EXPECT_LE(std::hypot(got.y[0], got.y[1]) * 0.5, 0.8 * f * (1 + 1e-14));
    EXPECT_EQ(got.y[0] == 0, touch.sliding == 0 || f == 0);
  }
}

std::string contact_name(const ::testing::TestParamInfo<ContactAt::ParamType>& info) {
  const char* exponents[] = {"one_", "three_halves_", "two_"};
  return exponents[int(std::get<0>(info.param))] + std::string(std::get<1>(info.param).name);
}

const Touch kTouches[] = {Touch{"touch", 0, -0.1},
                          Touch{"a_hair_above", -1e-300, 1},
                          Touch{"a_hair_below", 1e-100, 1, 0.1},
                          Touch{"ten_metres_above", -10, 3},
                          Touch{"apex_of_the_cone", 1e-3, 0},
                          Touch{"a_little_sliding", 1e-3, 0, 1e-12},
                          Touch{"much_sliding", 1e-3, 0.1, 1e3},
                          Touch{"leaving_fast", 1e-3, -10, 0.3},
                          Touch{"a_wall_at_a_kilometre_a_second", 1, 1e3, 10}};

INSTANTIATE_TEST_SUITE_P(Of, ContactAt,
                         ::testing::Combine(::testing::Values(ContactExponent::kOne,
                                                              ContactExponent::kThreeHalves,
                                                              ContactExponent::kTwo),
                                            ::testing::ValuesIn(kTouches)),
                         contact_name);

// H23 | naive: a library that flushes denormals gives other bits than its host | holds: with flush-to-zero and
// denormals-are-zero set or not, forces of contacts and limits near their onsets have the same bits from 1e-90 m on |
// routes: template in double, C at -O3, interpreter
TEST(Denormals, FlushedOrNotTheForcesAreTheSame) {
  Model<double> model = slider(-1, 1);
  Effects<double> effects;
  effects.gravity = false;
  const auto all = [](double x) { return VectorXd::Constant(1, x); };
  effects.limits = dynamics::SoftLimits<double>{all(1e4), all(3), all(0.01)};
  effects.friction = dynamics::CoulombFriction<double>{all(2), 1e-3, all(3), 1e-2};
  const Function f = record_forward_dynamics(model, effects);
  CodegenOptions options{
      .order = Order::kFirst, .route = Route::kCompiled, .use_cache = false, .flags = {"-O3"}};
  const CompiledFunction compiled = CompiledFunction::make(f, options);
  const auto results = [&] {
    Values found;
    for (const double past : {-10.0, -1e-90, 0.0, 1e-90, 1e-20, 1e-3, 0.5}) {
      for (const double v : {0.0, 1e-150, 1e-9, 1.0, 1e4}) {
        const Values x = {0.99 + past, v, 0.1};
        const auto r = compiled.evaluate(Order::kFirst, x);
        for (const Values& part : {r.y, r.jacobian, evaluate(f, x)})
          found.insert(found.end(), part.begin(), part.end());
        const VectorXd a = accelerations<double>(model, effects, Eigen::Vector3d(x[0], x[1], x[2]));
        found.push_back(a[0]);
      }
    }
    return found;
  };
  const Values usual = results();
  const unsigned state = _mm_getcsr();
  _mm_setcsr(state | 0x8040);
  const Values flushed = results();
  _mm_setcsr(state);
  EXPECT_TRUE(testing::same_bits(flushed, usual));
}

// --- Joints --------------------------------------------------------------------------------------------------

struct Speed {
  const char* name;
  double v;
};

class FrictionAt : public ::testing::TestWithParam<Speed> {};

// H24, H21 | naive: sign(v) has no slope at rest, and tanh by exponentials is inf / inf at v / w = 1e9 | holds:
// friction with its fall from breakaway to sliding is finite and right with both derivatives from rest to 1e100 m/s |
// routes: template in double, all of C and the interpreter, forward and reverse, as a callee
TEST_P(FrictionAt, IsSmoothAndBounded) {
  const Model<double> model = slider();
  Effects<double> effects;
  const auto all = [](double x) { return VectorXd::Constant(1, x); };
  effects.friction = dynamics::CoulombFriction<double>{all(2), 1e-9, all(3), 1e-2};
  const EveryRoute::Parts got = expect_exact(model, effects, {0.1, GetParam().v, 0}, {1e-14, 1e-11, 1e-10});
  EXPECT_LE(std::abs(got.y[0]), 3 + 1e-14);
  EXPECT_EQ(got.y[0] == 0, GetParam().v == 0);
}

INSTANTIATE_TEST_SUITE_P(Speeds, FrictionAt,
                         ::testing::Values(Speed{"rest", 0}, Speed{"denormal", 1e-310},
                                           Speed{"creep", -3e-10}, Speed{"width", 1e-9},
                                           Speed{"beyond", 4e-7}, Speed{"fall", 7e-3}, Speed{"fast", -1},
                                           Speed{"very_fast", 1e100}),
                         [](const auto& info) { return info.param.name; });

struct Stop {
  const char* name;
  double past, rate;  // of the onset (m), of the rate (m/s)
};

class StopAt : public ::testing::TestWithParam<Stop> {};

// X07 | naive: a spring of a stop has a kink at its onset, and its damper pulls on who leaves | holds: soft stops are
// twice differentiable at onset and at the seam, never pull, and are those of 113 bits a metre past the limit at 1
// km/s | routes: template in double, all of C and the interpreter, forward and reverse, as a callee
TEST_P(StopAt, PushesOnly) {
  const Model<double> model = slider(-1, 1);
  Effects<double> effects;
  const auto all = [](double x) { return VectorXd::Constant(1, x); };
  effects.limits = dynamics::SoftLimits<double>{all(1e4), all(30), all(0.125)};
  // Behind a stop that is left at 1 km/s the push is what rounding leaves of a difference: 1e-13 of its terms.
  const EveryRoute::Parts got = expect_exact(model, effects, {0.875 + GetParam().past, GetParam().rate, 0},
                                             GetParam().rate < -1 ? Allowed{1e-9, 1e-9, 1e-9} : Allowed{});
  EXPECT_LE(got.y[0], 0);
  if (GetParam().past <= 0) {
    EXPECT_EQ(got.y[0], 0);
  }
}

INSTANTIATE_TEST_SUITE_P(Of, StopAt,
                         ::testing::Values(Stop{"before", -1e-6, 1}, Stop{"onset", 0, 1},
                                           Stop{"a_hair_past", 1e-14, 1}, Stop{"seam", 0.125, 0.5},
                                           Stop{"hit_hard", 1, 1e3}, Stop{"left_fast", 0.25, -1e3},
                                           Stop{"at_rest", 0.0625, 0}),
                         [](const auto& info) { return info.param.name; });

class CommandOf : public ::testing::TestWithParam<double> {};

// H24, H21 | naive: a hard limit of torque has two derivatives, a soft one overflows | holds: the smooth limit is L tanh(u
// / L) with both derivatives from no command to 1e200 N m, the hard one has the slope of within or of beyond |
// routes: template in double, all of C and the interpreter, forward and reverse, as a callee
TEST_P(CommandOf, IsLimited) {
  for (const auto kind : {dynamics::SaturationKind::kSmooth, dynamics::SaturationKind::kHard}) {
    const Model<double> model = slider();
    Effects<double> effects;
    effects.saturation = dynamics::Saturation<double>{VectorXd::Constant(1, 5), kind};
    const EveryRoute::Parts got = expect_exact(model, effects, {0, 0, GetParam()});
    EXPECT_LE(std::abs(got.y[0]), 5);
    EXPECT_GE(got.y[0] * GetParam(), 0);
  }
}

INSTANTIATE_TEST_SUITE_P(Newtons, CommandOf, ::testing::Values(0.0, 1e-300, -5.0, 1e3, -1e200),
                         [](const auto& info) { return "number_" + std::to_string(info.index); });

class WindAt : public ::testing::TestWithParam<double> {};

// H14 | naive: the speed |u| has no slope where nothing moves against the medium | holds: drag is smooth there and
// right up to 1e6 m/s, with both derivatives | routes: template in double, all of C and the interpreter, forward and
// reverse, as a callee
TEST_P(WindAt, HasSlopesWhereNothingMoves) {
  const Model<double> model = particle(1);
  Effects<double> effects;
  dynamics::DragBody<double> sail;
  dynamics::place_at_frame(model, "mass", sail);
  sail.area = 0.3;
  effects.drag.push_back(sail);
  effects.drag.medium = {2, 0, 0};
  expect_exact(model, effects, {0, 0, 0, 2 + GetParam(), 0, 0, 0, 0, 0});
}

INSTANTIATE_TEST_SUITE_P(MetresASecond, WindAt, ::testing::Values(0.0, 1e-12, 1e6),
                         [](const auto& info) { return "number_" + std::to_string(info.index); });

// X06 | naive: a smoothing that is a plain number, as 1e-9 under a root, makes contacts and stops in millimetres
// others | holds: with all lengths in other units (powers of two) accelerations have the same bits | routes: template
// in double, tape
TEST(EffectUnits, LengthsInAnyUnitAreTheSame) {
  const auto bits = [](double u) {  // a metre in new units
    Model<double> model = particle(0.5);
    for (auto& joint : model.joints) joint.limits.lower = -0.3 * u, joint.limits.upper = 0.01 * u;
    model.gravity *= u;
    Effects<double> effects;
    const auto all = [](double x) { return VectorXd::Constant(3, x); };
    dynamics::ContactBody<double> ball;
    dynamics::place_at_frame(model, "mass", ball);
    ball.radius = 0.02 * u, ball.stiffness = 1e4, ball.dissipation = 0.5 / u, ball.friction = 0.8;
    ball.exponent = ContactExponent::kOne;
    effects.contacts.push_back(ball);
    effects.contacts.slip = 1e-3 * u;
    effects.friction = dynamics::CoulombFriction<double>{all(2 * u), 1e-2 * u, all(3 * u), 0.1 * u};
    effects.limits = dynamics::SoftLimits<double>{all(1e3), all(3), all(0.125 * u)};
    effects.saturation = dynamics::Saturation<double>{all(5 * u), dynamics::SaturationKind::kSmooth};
    dynamics::DragBody<double> sail;
    dynamics::place_at_frame(model, "mass", sail);
    sail.area = 0.3 * u * u;
    effects.drag.push_back(sail);
    effects.drag.medium = {2 * u, 0, 0}, effects.drag.density = 1.25 / (u * u * u),
    effects.drag.smoothing = 1e-3 * u;
    const Function f = record_forward_dynamics(model, effects);
    Values found;
    for (const double depth : {0.003, -0.1}) {
      const Values x = {0.02 * u, -0.25 * u, (0.02 - depth) * u, 0.4 * u, -0.01 * u, 0.3 * u, 3 * u,
                        -7 * u,   0.1 * u};
      for (double a : evaluate(f, x)) found.push_back(a / u);
      for (double a : accelerations<double>(model, effects, Eigen::Map<const VectorXd>(x.data(), 9)))
        found.push_back(a / u);
    }
    return found;
  };
  const Values metres = bits(1);
  for (const double u : {0x1p10, 0x1p-10, 0x1p40}) EXPECT_TRUE(testing::same_bits(bits(u), metres)) << u;
}

}  // namespace
}  // namespace dyntape::effects_hard_test
