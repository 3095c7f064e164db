// SPDX-License-Identifier: BSD-3-Clause
//
// Motions in phases against closed forms, and against the same motion in one.
#include <gtest/gtest.h>

#include <random>

#include <dyntape/interface/control/solve/optimise.h>
#include "interface/control/ocp_problems.h"
#include "interface/message_of.h"

namespace dyntape::phases_test {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

class PhasesBy : public ::testing::TestWithParam<NlpMethod> {
 protected:
  Solution solved(const Phases& phases, std::vector<MeshOptions> meshes = {{.intervals = 10}}) {
    for (MeshOptions& mesh : meshes) mesh.evaluation = test::kInterpreted;
    const Solution s =
        optimise(phases, {.meshes = std::move(meshes), .solver = {.method = GetParam(), .tolerance = 1e-10}});
    EXPECT_TRUE(s.success()) << describe(s.nlp.status);
    EXPECT_LT(s.link_violation, 1e-8);
    EXPECT_LT(s.verification.violation, 1e-8) << s.verification.worst_row;
    return s;
  }
};
INSTANTIATE_TEST_SUITE_P(By, PhasesBy, ::testing::Values(NlpMethod::kIpopt, NlpMethod::kRiccati),
                         [](const auto& info) {
                           return info.param == NlpMethod::kIpopt ? "ipopt" : "riccati";
                         });

// p'' = u / mass, least int u^2; where it begins and ends: what is given.
Problem push(double duration, double mass = 1) {
  Problem p("push", {"p", "v"}, {"u"}, duration,
            [mass](const auto& s) { return vector(s.x[1], std::decay_t<decltype(s.t)>(s.u[0] / mass)); });
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));
  p.start.setConstant(Problem::kFree), p.goal.setConstant(Problem::kFree);
  return p;
}

Problem from(Problem p, double x, double v) {
  p.start << x, v;
  return p;
}
Problem to(Problem p, double x, double v) {
  p.goal << x, v;
  return p;
}

TEST_P(PhasesBy, AMotionCutInPiecesIsTheSame) {
  Phases cut("cut");
  cut.add("first", from(push(0.3), 0, 0));
  cut.add("second", push(0.5));
  cut.add("third", to(push(0.2), 1, 0));
  const Solution s = solved(cut, {{.intervals = 3}, {.intervals = 7}, {.intervals = 2}});
  EXPECT_NEAR(s.cost(), 12, 1e-8);
  EXPECT_DOUBLE_EQ(s.phases[2].begin, 0.8);
  const Eigen::VectorXd& t = s.motion.t;
  const MatrixXd& x = s.motion.x;
  ASSERT_EQ(t.size(), 27);
  for (Eigen::Index i = 0; i < t.size(); ++i) EXPECT_NEAR(x(0, i), t[i] * t[i] * (3 - 2 * t[i]), 1e-8);
  for (std::size_t k = 0; k < 3; ++k) {
    const Trajectory& motion = s.phases[k].motion;
    for (int i = 0; i < motion.points(); ++i) {
      const double t = s.phases[k].begin + motion.t[i];
      EXPECT_NEAR(motion.x(0, i), t * t * (3 - 2 * t), 1e-8);
      EXPECT_NEAR(motion.u(0, i), 6 - 12 * t, 1e-6);
    }
  }
}

// u m = b - a t; with the moments M_k of 1 / m^2, int u^2 = 1 / (M_2 - M_1^2 / M_0).
TEST_P(PhasesBy, DynamicsOfTheirOwn) {
  Phases loaded("loaded");
  loaded.add("empty", from(push(0.5, 1), 0, 0));
  loaded.add("full", to(push(0.5, 2), 1, 0));
  double moments[3];
  for (int k = 0; k < 3; ++k) {
    const double half = std::pow(0.5, k + 1);
    moments[k] = (half + (1 - half) / 4) / (k + 1);
  }
  const double least = 1 / (moments[2] - moments[1] * moments[1] / moments[0]);
  EXPECT_NEAR(solved(loaded).cost(), least, 1e-8 * least);
}

// Against a wall and back, in 1 s each: 4 v^2 - 12 v + 12 there, 4 e^2 v^2 - 12 e v + 12 back.
TEST_P(PhasesBy, ALinkChangesTheState) {
  const double e = 0.8;
  Phases bounce("bounce");
  Problem there = from(push(1), 0, 0);
  there.goal[0] = 1;
  bounce.add("there", there);
  bounce.add("back", to(push(1), 0, 0), [e](const auto& s) {
    using T = std::decay_t<decltype(s.t)>;
    return vector(T(s.x[0]), T(-e * s.x[1]));
  });
  const Solution s = solved(bounce);
  EXPECT_NEAR(s.cost(), 24 - 9 * (1 + e) * (1 + e) / (1 + e * e), 1e-8);
  EXPECT_NEAR(s.phases[0].motion.x(1, s.phases[0].motion.points() - 1), 1.5 * (1 + e) / (1 + e * e), 1e-7);
}

// The least over the speed at the wall, of the same two costs with another law of impact, found by bisection of its slope.
TEST_P(PhasesBy, ALinkMayBeCurved) {
  const auto after = [](double v) { return -0.8 * v + 0.1 * v * v; };
  const auto slope = [&](double v) {
    const double w = after(v), dw = -0.8 + 0.2 * v;
    return 8 * v - 12 + (8 * w + 12) * dw;
  };
  double low = 0, high = 4;
  for (int i = 0; i < 60; ++i) (slope((low + high) / 2) < 0 ? low : high) = (low + high) / 2;
  const double v = low, w = after(v), least = 4 * v * v - 12 * v + 12 + 4 * w * w + 12 * w + 12;
  Phases bounce("bounce");
  Problem there = from(push(1), 0, 0);
  there.goal[0] = 1;
  bounce.add("there", there);
  bounce.add("back", to(push(1), 0, 0), [](const auto& s) {
    using T = std::decay_t<decltype(s.t)>;
    return vector(T(s.x[0]), T(-0.8 * s.x[1] + 0.1 * s.x[1] * s.x[1]));
  });
  const Solution s = solved(bounce);
  EXPECT_NEAR(s.cost(), least, 1e-8 * least);
}

// Bang, then bang: how long each takes is free.
TEST_P(PhasesBy, DurationsMayBeFree) {
  Phases bang("bang");
  for (const double u : {1.0, -1.0}) {
    Problem p("bang", {"p", "v"}, {"u"}, 0.7, [](const auto& s) { return vector(s.x[1], s.u[0]); });
    p.add(minimum_time(1));
    p.free_duration(0.1, 5);
    p.u.lower[0] = p.u.upper[0] = u;
    p.start.setConstant(Problem::kFree), p.goal.setConstant(Problem::kFree);
    bang.add(u > 0 ? "faster" : "slower", u > 0 ? from(p, 0, 0) : to(p, 1, 0));
  }
  const Solution s = solved(bang);
  EXPECT_NEAR(s.cost(), 2, 1e-8);
  EXPECT_NEAR(s.phases[1].begin, 1, 1e-8);
}

// States of another kind: a phase that has one less.
TEST_P(PhasesBy, PhasesMayHaveOtherStates) {
  Phases stop("stop");
  stop.add("move", from(push(1), 0, 0));
  Problem still("still", {"p"}, {"u"}, 1, [](const auto& s) { return s.u; });
  still.add(running_squares("speed", [](const auto& s) { return s.u; }));
  still.start.setConstant(Problem::kFree), still.goal << 1;
  stop.add("slide", still, [](const auto& s) { return s.x.head(1).eval(); });
  // To (d, v free): 3 d^2; then (1 - d)^2: least at d = 1/4.
  const Solution s = solved(stop);
  EXPECT_NEAR(s.cost(), 0.75, 1e-8);
  EXPECT_NEAR(s.phases[1].motion.x(0, 0), 0.25, 1e-8);
}

Phases forced() {
  Problem p("forced", {"x", "v"}, {"u"}, std::numbers::pi, [](const auto& s) {
    using std::cos;
    using T = std::decay_t<decltype(s.t)>;
    return vector(T(s.x[1]), T(cos(2.0 * s.t) - s.x[0] - 0.2 * s.x[1] + s.u[0]));
  });
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));
  p.start.setConstant(Problem::kFree), p.goal.setConstant(Problem::kFree);
  Phases cycle("cycle");
  cycle.add("whole", p);
  cycle.close();
  return cycle;
}

// x'' + 0.2 x' + x = cos 2t: the motion that goes on for ever is a cos 2t + b sin 2t.
TEST_P(PhasesBy, AClosedMotionIsPeriodic) {
  const Solution s = solved(forced(), {{.intervals = 60}});
  const double a = 1 / (-3 - 0.16 / 3), b = -0.4 * a / 3;
  const Trajectory& motion = s.phases[0].motion;
  for (int i = 0; i < motion.points(); ++i)
    EXPECT_NEAR(motion.x(0, i), a * std::cos(2 * motion.t[i]) + b * std::sin(2 * motion.t[i]), 1e-6);
  EXPECT_LT(s.link_violation, 1e-10);
}

// Stage by stage the last row knows the first state by copies; optima and multipliers are those of Ipopt, which knows none.
TEST(Phases, ClosedMotionsAreSolvedByBothMethods) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const auto drawn = [&](int rows, int columns) {
    return MatrixXd(MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); }));
  };
  for (int k = 0; k < 6; ++k) {
    const int intervals = 1 + 3 * k;  // of one alone the closing row ties neighbours
    Phases cycle("cycle");
    for (const char* name : {"one", "other"}) {
      const MatrixXd A = drawn(3, 3), B = drawn(3, 2), d = drawn(3, 1);
      Problem p("linear", {"a", "b", "c"}, {"u", "w"}, 0.5, [=](const auto& s) {
        using T = std::decay_t<decltype(s.t)>;
        return (A.cast<T>() * s.x + B.cast<T>() * s.u + d.cast<T>()).eval();
      });
      p.add(running_squares("effort", [](const auto& s) { return s.u; }));
      p.add(running_squares("away", [](const auto& s) { return s.x; }));
      p.start.setConstant(Problem::kFree), p.goal.setConstant(Problem::kFree);
      if (k == 5) p.u.upper.setConstant(0.2);
      cycle.add(name, p);
    }
    const MatrixXd L = drawn(3, 3);
    cycle.close([L](const auto& s) {
      using std::sin;
      using T = std::decay_t<decltype(s.t)>;
      return (L.cast<T>() * s.x.unaryExpr([](const T& x) { return T(x + 0.3 * sin(x)); })).eval();
    });
    const auto by = [&](NlpMethod method) {
      return optimise(cycle, {.meshes = {{.intervals = intervals, .evaluation = test::kInterpreted}},
                              .solver = {.method = method, .tolerance = 1e-10}});
    };
    const Solution stages = by(NlpMethod::kRiccati), ipopt = by(NlpMethod::kIpopt);
    ASSERT_TRUE(stages.converged() && ipopt.converged()) << k << stages.verdict() << ipopt.verdict();
    EXPECT_LT(stages.link_violation, 1e-9);
    EXPECT_LT(stages.kkt.stationarity, 1e-8);
    EXPECT_NEAR(stages.cost(), ipopt.cost(), 1e-7 * (1 + ipopt.cost())) << k;
    for (std::size_t i = 0; i < ipopt.nlp.x.size(); ++i)
      EXPECT_NEAR(stages.nlp.x[i], ipopt.nlp.x[i], 1e-4) << k;
    ASSERT_EQ(stages.nlp.lambda.size(), ipopt.nlp.lambda.size());
    for (std::size_t j = 0; j < ipopt.nlp.lambda.size(); ++j)
      EXPECT_NEAR(stages.nlp.lambda[j], ipopt.nlp.lambda[j], 1e-4 * (1 + std::abs(ipopt.nlp.lambda[j]))) << k;
  }
}

TEST(Phases, MistakesAreOneSentence) {
  const auto told = [](const Phases& phases, std::vector<MeshOptions> meshes = {{}}) {
    for (MeshOptions& mesh : meshes) mesh.evaluation = test::kInterpreted;
    return message_of<ArgumentError>([&] { discretize(phases, meshes); });
  };
  EXPECT_EQ(told(Phases("none")), "phases \"none\": there are none");
  Phases two("two");
  two.add("one", from(push(1), 0, 0));
  two.add("other", to(push(1), 1, 0));
  EXPECT_EQ(told(two), "nothing thrown");
  EXPECT_EQ(told(two, {{}, {}, {}}),
            "phases \"two\": 3 meshes for 2 phases, expected one each or one for all");
  EXPECT_EQ(told(two, {{}, {.hessian = HessianKind::kGaussNewton}}),
            "phases \"two\": meshes ask for different Hessians, expected one kind");
  Phases twice = two;
  twice.add("one", push(1));
  EXPECT_EQ(told(twice), "phases \"two\": two are called \"one\"");
  Phases first("first");
  first.add("one", push(1), [](const auto& s) { return s.x; });
  EXPECT_NE(told(first).find("the first, \"one\", has a link, but nothing is before it"), std::string::npos);
  Problem still("still", {"p"}, {"u"}, 1, [](const auto& s) { return s.u; });
  Phases fewer = two;
  fewer.add("still", still);
  EXPECT_EQ(told(fewer),
            "phases \"two\": \"other\" has 2 states, \"still\" has 1, and no link says what becomes of them");
  Phases wrong = two;
  wrong.add("still", still, [](const auto& s) { return s.x; });
  EXPECT_EQ(told(wrong), "phases \"two\": the link from \"other\" to \"still\" gives 2 states, expected 1");
}

// A phase that begins and ends anywhere is measured by its neighbours: in metres or in micrometres, the same.
TEST_P(PhasesBy, UnitsChangeNothing) {
  double costs[3];
  int k = 0;
  for (const double L : {1.0, 1e-6, 1e6}) {
    const auto part = [L](double duration) {
      Problem p("wave", {"p", "v"}, {"u"}, duration, [L](const auto& s) {
        using std::sin;
        return vector(s.x[1], std::decay_t<decltype(s.t)>(s.u[0] - 3.0 * L * sin(s.x[0] / L)));
      });
      p.add(running_squares("effort", [](const auto& s) { return s.u; }));
      p.start.setConstant(Problem::kFree), p.goal.setConstant(Problem::kFree);
      return p;
    };
    Phases cut("cut");
    cut.add("first", from(part(0.4), 0.5 * L, 0));
    cut.add("second", part(0.3));
    cut.add("third", to(part(0.3), -0.7 * L, 0));
    costs[k++] = solved(cut).cost() / (L * L);
  }
  EXPECT_NEAR(costs[1], costs[0], 1e-7 * costs[0]);
  EXPECT_NEAR(costs[2], costs[0], 1e-7 * costs[0]);
}

TEST(Phases, ALinkThatIsNotFiniteIsNamed) {
  for (const bool by_slope : {false, true}) {
    Phases two("two");
    two.add("one", from(push(1), 0, 0));
    two.add("other", to(push(1), 1, 0), [by_slope](const auto& s) {
      using std::log, std::sqrt;
      using T = std::decay_t<decltype(s.t)>;
      const T all = s.x[0] * s.x[0];
      return vector(T(by_slope ? sqrt(all) : log(all)), T(s.x[1]));
    });
    const std::string told =
        message_of<NumericalError>([&] { optimise(two, {.meshes = {{.evaluation = test::kInterpreted}}}); });
    EXPECT_EQ(told.find("the link from \"one\" to \"other\" " +
                        std::string(by_slope ? "has a slope of p by p that is" : "gives p = ")),
              0u)
        << told;
  }
}

TEST(Phases, NamesSayWhichPhase) {
  Phases two("two");
  two.add("one", from(push(1), 0, 0));
  two.add("other", to(push(1), 1, 0));
  const StagedNlp nlp = discretize(two, {{.intervals = 2, .evaluation = test::kInterpreted}});
  EXPECT_EQ(nlp.variable_name(0), "one: p at point 0 (t = 0 s)");
  EXPECT_EQ(nlp.variable_name(16), "other: v at point 0 (t = 0 s)");
  const std::vector<RowBlock>& rows = nlp.program().rows;
  const auto is_link = [](const RowBlock& block) { return block.kind == RowBlock::Kind::kLink; };
  const std::size_t link = std::find_if(rows.begin(), rows.end(), is_link)->row;
  EXPECT_EQ(nlp.constraint_name(link + 1), "link from \"one\" to \"other\": v");
  EXPECT_EQ(nlp.constraint_name(link + 2).rfind("other: ", 0), 0u);
}

}  // namespace
}  // namespace dyntape::phases_test
