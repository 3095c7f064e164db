// SPDX-License-Identifier: BSD-3-Clause
//
// Slopes of optimal motions against solves with other values, closed forms, Riccati's recursion and differential
// dynamic programming.
#include <gtest/gtest.h>

#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/nlp/solver_options.h>
#include <dyntape/interface/control/riccati/riccati.h>
#include <dyntape/interface/control/sensitivity/motion_sensitivities.h>
#include <dyntape/interface/control/solve/ddp.h>
#include "interface/control/ocp_problems.h"
#include "interface/message_of.h"

namespace dyntape::motion_sensitivities_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::kInterpreted;

MeshOptions mesh_of(const char* scheme, int intervals) {
  return {.scheme = scheme_by_name(scheme), .intervals = intervals, .evaluation = kInterpreted};
}

NlpSolution solved(StagedNlp& nlp, NlpMethod method = NlpMethod::kRiccati, double tolerance = 1e-11) {
  NlpSolution s =
      solve_nlp(nlp, nlp.start(), {.method = method, .tolerance = tolerance, .bound_relaxation = 0});
  EXPECT_TRUE(s.status == SolveStatus::kSolved || s.status == SolveStatus::kAcceptable)
      << to_string(s.status);
  return s;
}

VectorXd as_vector(const std::vector<double>& v) { return VectorXd::Map(v.data(), Eigen::Index(v.size())); }

double off(const VectorXd& a, const VectorXd& b) { return (a - b).norm() / (1e-9 + b.norm()); }

// Of a motion whose optimum is known in numbers: u(t) = 6 (d - p0) (1 - 2 t) - v0 (4 - 6 t), J = 12 (d - p0)^2 - ...
Problem to_a_place(double distance = 1) {
  Problem p = test::block_move(distance);
  const Parameter place = p.parameters.add("place", distance);
  p.goal.setConstant(Problem::kFree);
  p.add(terminal_equality("there", [place](const auto& s) { return vector(s.x[0] - place(s)[0], s.x[1]); }));
  return p;
}

TEST(MotionSensitivities, BlockMoveInClosedForm) {
  for (const double d : {1.0, 1e-6, 1e6}) {
    const Problem p = to_a_place(d);
    const MeshOptions mesh = mesh_of("hermite-simpson", 8);
    StagedNlp nlp = discretize(p, mesh);
    const NlpSolution s = solved(nlp);
    MotionSensitivity sensitivity(p, mesh);
    const MotionSensitivities derivatives = sensitivity.at(p, s);
    ASSERT_TRUE(derivatives.good()) << derivatives.why;
    EXPECT_EQ(derivatives.parameters.names, std::vector<std::string>{"place"});
    EXPECT_NEAR(derivatives.parameters.cost[0], 24 * d, 1e-9 * d);
    EXPECT_NEAR(derivatives.start.cost[0], -24 * d, 1e-9 * d);
    EXPECT_NEAR(derivatives.start.cost[1], -12 * d, 1e-9 * d);
    EXPECT_NEAR(derivatives.gain(0, 0), -6, 1e-9);
    EXPECT_NEAR(derivatives.gain(0, 1), -4, 1e-9);
    for (int point = 0; point <= 16; ++point) {
      const double t = point / 16.0;
      EXPECT_NEAR(derivatives.parameters.x(3 * point + 2, 0), 6 - 12 * t, 1e-8) << t;
      EXPECT_NEAR(derivatives.parameters.x(3 * point, 0), 3 * t * t - 2 * t * t * t, 1e-9) << t;
    }
    EXPECT_EQ(derivatives.parameters.to[0], HUGE_VAL);
    EXPECT_EQ(derivatives.parameters.from[0], -HUGE_VAL);
  }
}

// The first control is what the scheme's polynomial is there, whether or not there is a point for it.
TEST(MotionSensitivities, GainIsThatOfTheFirstControl) {
  const Problem p = to_a_place();
  for (const Scheme& scheme : {lobatto(5), radau(3), radau(5)}) {
    const MeshOptions mesh = mesh_of(scheme.name.c_str(), 4);
    StagedNlp nlp = discretize(p, mesh);
    const MotionSensitivities derivatives = MotionSensitivity(p, mesh).at(p, solved(nlp));
    ASSERT_TRUE(derivatives.good()) << derivatives.why;
    EXPECT_LT((derivatives.gain - Eigen::RowVector2d(-6, -4)).norm(), 1e-8) << scheme.name;
  }
}

// Linear dynamics and squares, controls held: the gain is Riccati's, on the steps of Euler's scheme.
TEST(MotionSensitivities, GainIsRiccatisOfTheSameSteps) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::mt19937 engine(seed);
    std::normal_distribution<double> normal;
    const auto random = [&](int rows, int cols) {
      return MatrixXd(MatrixXd::NullaryExpr(rows, cols, [&] { return normal(engine); }));
    };
    const MatrixXd A = random(3, 3), B = random(3, 2), C = random(3, 3), D = random(3, 2);
    Problem p("lqr", {"a", "b", "c"}, {"u", "w"}, 1.5, [=](const auto& s) {
      using T = typename std::decay_t<decltype(s.x)>::Scalar;
      return (A.cast<T>() * s.x + B.cast<T>() * s.u).eval();
    });
    p.add(running_squares("mixed", [=](const auto& s) {
      using T = typename std::decay_t<decltype(s.x)>::Scalar;
      return (C.cast<T>() * s.x + D.cast<T>() * s.u).eval();
    }));
    p.add(running_squares("effort", [](const auto& s) { return s.u; }));
    p.add(terminal_squares("end", [](const auto& s) { return s.x; }));
    p.start = random(3, 1);
    p.goal.setConstant(Problem::kFree);
    const int N = 1 + int(seed % 15);
    const double h = 1.5 / N;
    Riccati riccati;
    riccati.begin(2 * MatrixXd::Identity(3, 3), VectorXd::Zero(3));
    MatrixXd root = MatrixXd::Zero(5, 5);
    root << C, D, MatrixXd::Zero(2, 3), MatrixXd::Identity(2, 2);
    for (int k = 0; k < N; ++k)
      ASSERT_TRUE(riccati.push({.A = MatrixXd::Identity(3, 3) + h * A,
                                .B = h * B,
                                .c = VectorXd::Zero(3),
                                .H = 2 * h * root.transpose() * root,
                                .g = VectorXd::Zero(5),
                                .lower = {},
                                .upper = {}},
                               0));
    const MeshOptions mesh = mesh_of("euler", N);
    StagedNlp nlp = discretize(p, mesh);
    MotionSensitivity sensitivity(p, mesh);
    const MotionSensitivities derivatives = sensitivity.at(p, solved(nlp));
    ASSERT_TRUE(derivatives.good()) << seed << ": " << derivatives.why;
    EXPECT_LT((derivatives.gain - riccati.policy().K).norm(), 1e-9 * (1 + riccati.policy().K.norm())) << seed;
    EXPECT_LT(off(derivatives.start.cost, riccati.P() * p.start), 1e-9) << seed;  // of 1/2 x.P x
  }
}

// DDP's steps hold the controls, collocation's controls are lines: their gains approach each other with the step.
TEST(MotionSensitivities, GainApproachesThatOfDifferentialDynamicProgramming) {
  Problem p("pendulum", {"th", "w"}, {"u"}, 1.0, [](const auto& s) {
    using std::sin;
    return vector(s.x[1], s.u[0] - 9.81 * sin(s.x[0]));
  });
  p.add(running_squares("effort", [](const auto& s) { return (0.5 * s.u).eval(); }));
  p.add(terminal_squares("end", [](const auto& s) { return vector(5 * (s.x[0] - 2), s.x[1]); }));
  p.start << 0.3, -1;
  p.goal.setConstant(Problem::kFree);
  double before = 0;
  for (const int N : {20, 40, 80}) {
    const DdpSolution ddp = solve_with_ddp(p, {.intervals = N, .evaluation = kInterpreted});
    ASSERT_TRUE(ddp.success() && ddp.is_minimum);
    const MeshOptions mesh = mesh_of("hermite-simpson", N);
    StagedNlp nlp = discretize(p, mesh);
    MotionSensitivity sensitivity(p, mesh);
    const MotionSensitivities derivatives = sensitivity.at(p, solved(nlp));
    ASSERT_TRUE(derivatives.good()) << derivatives.why;
    const double now = (derivatives.gain - ddp.policy[0].K).norm() / derivatives.gain.norm();
    EXPECT_LT((derivatives.start.cost - ddp.slope.col(0)).norm(),
              4e-3 * 400.0 / N / N * ddp.slope.col(0).norm());
    EXPECT_LT(now, 4.0 / N);
    if (before > 0) {
      EXPECT_NEAR(before / now, 2, 0.3) << N;
    }
    before = now;
  }
}

// A cart-pole that is told its load, its target, a push over time and how far it may go; force within limits.
Problem told(bool inverse, double limit) {
  Parameters parameters;
  const Parameter load = parameters.add("load", 0.3),
                  target = parameters.add("target", Eigen::Vector2d(1, 2.5));
  const Parameter push =
      parameters.add("push", [](double t) { return VectorXd::Constant(1, 0.5 * std::sin(3 * t)); });
  const Parameter reach = parameters.add("reach", 0.5);
  const auto force = [=](const auto& s) { return (s.u[0] + push(s)[0]) / (1.0 + load(s)[0]); };
  const auto ode = [=](const auto& s) {
    using std::sin;
    using T = std::decay_t<decltype(s.u[0])>;
    return vector(T(s.x[2]), T(s.x[3]), T(force(s)), T(-9.81 * sin(s.x[1]) - force(s)));
  };
  Problem p("told", {"p", "th", "pd", "thd"}, {"u"}, 1.5, ode);
  if (inverse) {
    p.rate = [](const auto& s) { return vector(s.x[2], s.x[3], s.a[0], s.a[1]); };
    p.use_accelerations(
        {"pdd", "thdd"}, [ode](const auto& s) { return (ode(s).tail(2) - s.a).eval(); }, ode);
  }
  p.parameters = parameters;
  p.add(running_squares("effort", [](const auto& s) { return (0.1 * s.u).eval(); }));
  p.add(running_squares("near", [=](const auto& s) { return (s.x.head(2) - target(s)).eval(); }));
  p.add(terminal_squares("rest", [=](const auto& s) { return (s.x.head(2) - target(s)).eval(); }));
  p.add(path_inequality(
      "reach", [=](const auto& s) { return reach(s)[0] - s.x[0] * s.x[0]; }, VectorXd::Zero(1),
      VectorXd::Constant(1, HUGE_VAL)));
  p.start << 0, 0.1, 0, 0;
  p.goal[2] = p.goal[3] = 0;
  p.u.lower[0] = -limit, p.u.upper[0] = limit;
  return p;
}

struct Case {
  const char* scheme;
  bool inverse;
  double limit;
  int intervals;
  NlpMethod method;
};
class EveryMotion : public ::testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(MotionSensitivities, EveryMotion,
                         ::testing::Values(Case{"hermite-simpson", false, 8, 9, NlpMethod::kRiccati},
                                           Case{"hermite-simpson", true, 8, 9, NlpMethod::kIpopt},
                                           Case{"trapezoid", true, HUGE_VAL, 12, NlpMethod::kRiccati},
                                           Case{"trapezoid", false, 6, 12, NlpMethod::kIpopt},
                                           Case{"euler", false, 7, 14, NlpMethod::kRiccati},
                                           Case{"hermite-simpson-linear", false, 8, 9, NlpMethod::kRiccati},
                                           Case{"lobatto-4", true, 8, 6, NlpMethod::kRiccati},
                                           Case{"radau-3", false, 8, 6, NlpMethod::kRiccati},
                                           Case{"runge-kutta-4", false, 8, 14, NlpMethod::kRiccati}));

// All derivatives of all values against differences of solves with other values.
TEST_P(EveryMotion, SlopesAreThoseOfSolves) {
  const Case c = GetParam();
  const MeshOptions mesh = mesh_of(c.scheme, c.intervals);
  Problem p = told(c.inverse, c.limit);
  if (mesh.scheme.step) p.parameters.set("push", 0.3);
  StagedNlp nlp = discretize(p, mesh);
  const NlpSolution s = solved(nlp, c.method);
  MotionSensitivity sensitivity(p, mesh);
  const MotionSensitivities derivatives = sensitivity.at(p, s);
  ASSERT_TRUE(derivatives.good()) << derivatives.why;
  ASSERT_EQ(derivatives.parameters.names, p.parameters.entry_names());
  EXPECT_LT(*std::min_element(s.lambda.end() - nlp.shape().stages.size(), s.lambda.end()),
            -1e-4);  // of "reach"
  const double most = *std::max_element(s.upper_multiplier.begin(), s.upper_multiplier.end());
  EXPECT_EQ(most > 1e-4, c.limit < HUGE_VAL);
  const auto solve = [&](const Problem& other) {
    nlp.set_values(other);
    const NlpSolution result =
        solve_nlp(nlp, s.x, {.method = c.method, .tolerance = 1e-11, .bound_relaxation = 0});
    EXPECT_TRUE(result.status == SolveStatus::kSolved || result.status == SolveStatus::kAcceptable);
    return result;
  };
  const auto compare = [&](const SensitivityTable& table, int i, const auto& changed) {
    const double h = std::min({1e-4, 0.3 * table.to[i], -0.3 * table.from[i]});
    ASSERT_GT(h, 2e-6) << table.names[std::size_t(i)];
    const NlpSolution up = solve(changed(h)), down = solve(changed(-h));
    EXPECT_LT(off(table.x.col(i), (as_vector(up.x) - as_vector(down.x)) / (2 * h)), 1e-4)
        << table.names[std::size_t(i)];
    EXPECT_LT(off(table.lambda.col(i), (as_vector(up.lambda) - as_vector(down.lambda)) / (2 * h)), 1e-4)
        << table.names[std::size_t(i)];
    EXPECT_NEAR(table.cost[i], (up.objective - down.objective) / (2 * h),
                1e-5 * (1 + std::abs(table.cost[i])))
        << table.names[std::size_t(i)];
  };
  const auto with = [&](const auto& change) {
    return [&p, change](double h) {
      Problem q = p;
      change(q, h);
      return q;
    };
  };
  compare(derivatives.parameters, 0, with([](Problem& q, double h) { q.parameters.set("load", 0.3 + h); }));
  compare(derivatives.parameters, 2,
          with([](Problem& q, double h) { q.parameters.set("target", Eigen::Vector2d(1, 2.5 + h)); }));
  compare(derivatives.parameters, 3, with([&mesh](Problem& q, double h) {
            if (mesh.scheme.step) return q.parameters.set("push", 0.3 + h);
            q.parameters.set("push",
                             [h](double t) { return VectorXd::Constant(1, 0.5 * std::sin(3 * t) + h); });
          }));
  compare(derivatives.parameters, 4, with([](Problem& q, double h) { q.parameters.set("reach", 0.5 + h); }));
  for (int i = 0; i < 4; ++i)
    compare(derivatives.start, i, with([i](Problem& q, double h) { q.start[i] += h; }));
  if (mesh.scheme.uses_first_point()) {
    EXPECT_EQ(derivatives.gain.row(0), derivatives.start.x.row(4 + p.n_a()));
  }
}

// What a prediction is off by falls with the square of the change: of parameters over time, start, goal and limits
// together.
TEST(MotionSensitivities, PredictionsAreOfTheFirstOrder) {
  const Problem p = told(true, 8);
  const MeshOptions mesh = mesh_of("hermite-simpson", 9);
  StagedNlp nlp = discretize(p, mesh);
  const NlpSolution s = solved(nlp);
  MotionSensitivity sensitivity(p, mesh);
  ASSERT_TRUE(sensitivity.at(p, s).good());
  double before = 0;
  for (const double h : {4e-3, 2e-3, 1e-3}) {
    Problem q = p;
    q.parameters.set("load", 0.3 + h), q.parameters.set("reach", 0.5 - 2 * h);
    q.parameters.set("push", [h](double t) { return VectorXd::Constant(1, 0.5 * std::sin(3 * t) + h * t); });
    q.start[1] += h, q.goal[2] = h;
    q.u.lower[0] -= h, q.u.upper[0] += 2 * h;
    const NlpSolution near = sensitivity.predict(q);
    nlp.set_values(q);
    const NlpSolution exact = solved(nlp);
    const double now = (as_vector(near.x) - as_vector(exact.x)).norm();
    EXPECT_LT(now, 0.1 * (as_vector(s.x) - as_vector(exact.x)).norm());
    EXPECT_NEAR(near.objective, exact.objective, 200 * h * h);
    EXPECT_LT(off(as_vector(near.lower_multiplier), as_vector(exact.lower_multiplier)), 30 * h);
    if (before > 0) {
      EXPECT_NEAR(before / now, 4, 0.6) << h;
    }
    before = now;
  }
  // Of the values themselves: the solution, better than it was.
  const NlpSolution same = sensitivity.predict(p);
  EXPECT_LT(off(as_vector(same.x), as_vector(s.x)), 1e-7);
  EXPECT_EQ(same.units.x, s.units.x);
  EXPECT_EQ(same.units.g, s.units.g);
}

// T = (36 d^2 / w)^(1/4) of an effort and a weight of time: dT/dw = -T / (4 w), dJ/dw = T.
TEST(MotionSensitivities, KnowAFreeDuration) {
  Problem p = test::block_move(0.8, 1.5);
  const Parameter w = p.parameters.add("w", 3.0);
  p.free_duration(0.2, 5);
  p.add(running_cost("time", [w](const auto& s) { return w(s)[0]; }));
  const MeshOptions mesh = mesh_of("hermite-simpson", 10);
  StagedNlp nlp = discretize(p, mesh);
  const NlpSolution s = solved(nlp);
  MotionSensitivity sensitivity(p, mesh);
  const MotionSensitivities derivatives = sensitivity.at(p, s);
  ASSERT_TRUE(derivatives.good()) << derivatives.why;
  const double T = std::pow(36 * 0.8 * 0.8 / 3, 0.25);
  EXPECT_NEAR(derivatives.parameters.x(2, 0), -T / 12, 1e-7);
  EXPECT_NEAR(derivatives.parameters.cost[0], T, 1e-7);
  EXPECT_EQ(derivatives.start.names, p.states);
}

// The duration, a variable of every point, rests on its bound: as derivatives of the motion of that duration, and of the bound.  With
// w its weight and T its bound J = 12 d^2 / T^3 + w T.
TEST(MotionSensitivities, KnowADurationAtItsBound) {
  for (const char* scheme : {"trapezoid", "hermite-simpson", "lobatto-5", "radau-3"}) {
    Problem p = test::block_move(0.8, 1);
    const Parameter w = p.parameters.add("w", 3.0);
    p.free_duration(0.2, 1);
    p.add(running_cost("time", [w](const auto& s) { return w(s)[0]; }));
    const MeshOptions mesh = mesh_of(scheme, 10);
    StagedNlp nlp = discretize(p, mesh);
    const NlpSolution s = solved(nlp);
    MotionSensitivity sensitivity(p, mesh);
    const MotionSensitivities derivatives = sensitivity.at(p, s);
    ASSERT_TRUE(derivatives.good()) << scheme << ": " << derivatives.why;
    EXPECT_NEAR(derivatives.parameters.x(2, 0), 0, 1e-12) << scheme;
    EXPECT_NEAR(derivatives.parameters.cost[0], 1, 1e-7) << scheme;
    EXPECT_GT(derivatives.parameters.to[0], 1) << scheme;
    Problem given = test::block_move(0.8, 1);
    StagedNlp same = discretize(given, mesh);
    const MotionSensitivities of_given = MotionSensitivity(given, mesh).at(given, solved(same));
    ASSERT_TRUE(of_given.good());
    EXPECT_LT((derivatives.gain - of_given.gain).norm(), 1e-6) << scheme;
    for (const double bound : {1.001, 0.999}) {
      Problem moved = p;
      moved.duration = bound, moved.free_time->longest = bound;
      const NlpSolution near = sensitivity.predict(moved);
      EXPECT_NEAR(near.x[2], bound, 1e-9) << scheme;
      EXPECT_NEAR(near.x[near.x.size() - 2], bound, 1e-9) << scheme;
      nlp.set_values(moved);
      EXPECT_NEAR(near.objective, solved(nlp).objective, 1e-4) << scheme;
      EXPECT_GT(std::abs(near.objective - s.objective), 1e-2) << scheme;
    }
  }
}

// Which limits hold, and what is given, a prediction takes from the solution: values with others are refused, none is ignored.
TEST(MotionSensitivities, PredictionsRefuseWhatTheyDoNotKnow) {
  Problem p = test::block_move();
  p.goal[1] = Problem::kFree;
  p.u.upper[0] = 20, p.x.upper[1] = 5;
  p.add(path_inequality(
      "pace", [](const auto& s) { return vector(s.x[1]); }, VectorXd::Constant(1, -9.),
      VectorXd::Constant(1, 9.)));
  const MeshOptions mesh = mesh_of("trapezoid", 8);
  StagedNlp nlp = discretize(p, mesh);
  const NlpSolution s = solved(nlp);
  MotionSensitivity sensitivity(p, mesh);
  ASSERT_TRUE(sensitivity.at(p, s).good());
  const auto said = [&](const auto& change) {
    Problem next = p;
    change(next);
    return message_of<ArgumentError>([&] { sensitivity.predict(next); });
  };
  // A limit that stays out of reach, and one that does not: u begins at 3.
  EXPECT_EQ(said([](Problem& q) { q.u.upper[0] = 10; }), "nothing thrown");
  const std::string beyond = said([](Problem& q) { q.u.upper[0] = 1; });
  EXPECT_NE(beyond.find("\"u at point 0 (t = 0 s)\" would be "), std::string::npos) << beyond;
  EXPECT_NE(beyond.find("beyond its new limit of 1 that did not hold it before"), std::string::npos)
      << beyond;
  EXPECT_NE(said([](Problem& q) { q.x.upper[1] = 1; }).find("beyond its new limit of 1"), std::string::npos);
  EXPECT_EQ(said([](Problem& q) { q.goal[0] = 1.1; }), "nothing thrown");
  EXPECT_NE(
      said([](Problem& q) { q.goal[1] = 0; }).find("\"v at point 8 (t = 1 s)\" is given where it was open"),
      std::string::npos);
  EXPECT_NE(said([](Problem& q) { q.goal[0] = Problem::kFree; }).find("is open where it was held"),
            std::string::npos);
  EXPECT_NE(said([](Problem& q) {
              q.goal[0] = Problem::kFree, q.x.lower[0] = -1, q.x.upper[0] = 2;
            }).find("\"p at point 8 (t = 1 s)\" is open where it was held"),
            std::string::npos);
  EXPECT_NE(said([](Problem& q) { q.terms.back().upper[0] = 2; }).find("other bounds of the term \"pace\""),
            std::string::npos);
}

// At a solution by Gauss-Newton the derivatives are those of the problem, not of the approximation.
TEST(MotionSensitivities, AreExactWhateverFoundTheSolution) {
  const Problem p = told(false, 8);
  MeshOptions mesh = mesh_of("trapezoid", 8);
  StagedNlp exact = discretize(p, mesh);
  MotionSensitivity sensitivity(p, mesh);
  const MotionSensitivities one = sensitivity.at(p, solved(exact));
  mesh.hessian = HessianKind::kGaussNewton;
  StagedNlp approximate = discretize(p, mesh);
  const NlpSolution s = solved(approximate, NlpMethod::kRiccati, 1e-10);
  const MotionSensitivities other = sensitivity.at(p, s);
  ASSERT_TRUE(one.good() && other.good()) << other.why;
  EXPECT_LT((one.parameters.x - other.parameters.x).norm(), 1e-5 * one.parameters.x.norm());
}

// On a fine mesh a loose tolerance does not tell which points of an arc are held: flagged, and yet nearly the derivatives
// of a tight solve.
TEST(MotionSensitivities, ArcsOnFineMeshesAreFlaggedUntilTheyAreTold) {
  const Problem p = told(true, 8);
  const MeshOptions mesh = mesh_of("trapezoid", 200);
  StagedNlp nlp = discretize(p, mesh);
  MotionSensitivity sensitivity(p, mesh);
  const MotionSensitivities loose = sensitivity.at(p, solved(nlp, NlpMethod::kRiccati, 1e-9)),
                            tight = sensitivity.at(p, solved(nlp, NlpMethod::kRiccati, 1e-13));
  EXPECT_EQ(loose.status, SensitivityStatus::kWeaklyActive);
  ASSERT_TRUE(tight.good()) << tight.why;
  EXPECT_GT(tight.gain.norm(), 10);
  EXPECT_LT((loose.gain - tight.gain).norm(), 1e-4 * tight.gain.norm());
  EXPECT_LT(off(loose.parameters.cost, tight.parameters.cost), 1e-6);
  // A prediction from there, bound multipliers and moved limits with it.
  const NlpSolution s = solved(nlp, NlpMethod::kRiccati, 1e-9);
  sensitivity.at(p, s);
  Problem q = p;
  q.u.upper[0] += 1e-3, q.parameters.set("load", 0.301);
  const NlpSolution near = sensitivity.predict(q);
  nlp.set_values(q);
  const NlpSolution exact = solved(nlp, NlpMethod::kRiccati, 1e-9);
  const auto moved = [&](const NlpSolution& to, std::vector<double> NlpSolution::*part) {
    return (as_vector(to.*part) - as_vector(s.*part)).eval();
  };
  EXPECT_LT(off(moved(near, &NlpSolution::x), moved(exact, &NlpSolution::x)), 1e-2);
  EXPECT_LT(off(moved(near, &NlpSolution::upper_multiplier), moved(exact, &NlpSolution::upper_multiplier)),
            1e-2);
}

TEST(MotionSensitivities, FlagWhatHasNone) {
  const MeshOptions mesh = mesh_of("trapezoid", 8);
  const auto derivatives = [&](const Problem& p, const Problem& now) {
    StagedNlp nlp = discretize(p, mesh);
    MotionSensitivity sensitivity(p, mesh);
    return sensitivity.at(now, solved(nlp, NlpMethod::kRiccati, 1e-10));
  };
  const Problem p = to_a_place();
  EXPECT_EQ(derivatives(p, p).status, SensitivityStatus::kGood);
  // Of other values it is no solution.
  Problem elsewhere = p;
  elsewhere.parameters.set("place", 2);
  const MotionSensitivities wrong = derivatives(p, elsewhere);
  EXPECT_EQ(wrong.status, SensitivityStatus::kNotASolution);
  EXPECT_TRUE(std::isnan(wrong.gain(0, 0)));
  // A limit just where the greatest force is.
  Problem weak = p;
  StagedNlp free = discretize(p, mesh);
  weak.u.upper[0] = solved(free).x[2];
  const MotionSensitivities touching = derivatives(weak, weak);
  EXPECT_EQ(touching.status, SensitivityStatus::kWeaklyActive);
  EXPECT_EQ(touching.why, "\"u at point 0 (t = 0 s)\" rests on a bound that has no bound multiplier");
  // The same end twice.
  Problem twice = p;
  twice.add(p.terms.back());
  EXPECT_EQ(derivatives(twice, twice).status, SensitivityStatus::kDependentRows);
  // Nothing to be minimised.
  Problem idle = p;
  idle.terms.erase(idle.terms.begin());
  EXPECT_EQ(derivatives(idle, idle).status, SensitivityStatus::kNoStrictMinimum);
  StagedNlp nlp = discretize(p, mesh_of("trapezoid", 9));
  MotionSensitivity sensitivity(p, mesh);
  EXPECT_EQ(message_of<ArgumentError>([&] { sensitivity.at(p, solved(nlp)); }),
            "problem \"block move\": the solution has 30 variables and 20 multipliers, on this mesh there "
            "are 27 and 18");
  EXPECT_EQ(
      message_of<ArgumentError>([&] { sensitivity.predict(p); }),
      "problem \"block move\": a prediction needs a solution to start from; expected at() before predict()");
  ASSERT_TRUE(sensitivity
                  .at(p,
                      [&] {
                        StagedNlp same = discretize(p, mesh);
                        return solved(same);
                      }())
                  .good());
  Problem open = p;
  open.start[1] = Problem::kFree;
  EXPECT_EQ(message_of<ArgumentError>([&] { sensitivity.predict(open); }),
            "problem \"block move\": \"v at point 0 (t = 0 s)\" is open where it was held, which no "
            "prediction knows");
}

}  // namespace
}  // namespace dyntape::motion_sensitivities_test
