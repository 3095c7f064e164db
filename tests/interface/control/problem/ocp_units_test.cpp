// SPDX-License-Identifier: BSD-3-Clause
//
// The same problem in other units: kilograms or milligrams, metres or kilometres, seconds or hours.
#include <gtest/gtest.h>

#include <numbers>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/ipopt/ipopt.h>
#include <dyntape/interface/control/nlp/scaled_nlp.h>
#include <dyntape/interface/control/solve/optimise.h>
#include "interface/control/ocp_problems.h"

namespace dyntape::ocp_units_test {
namespace {

struct Units {
  double mass, length, time;
  double force() const { return mass * length / (time * time); }
};

// Numbers of 1 kg, 1 m, 1 s in units that make them m, d and T: a block among hills, with a force that is bounded,
// a speed that is, and costs of force and of place.
Problem hills(const Units& unit) {
  const double mass = unit.mass, length = unit.length, force = unit.force();
  Problem p("hills", {"p", "v"}, {"u"}, unit.time, [=](const auto& s) {
    using std::sin;
    return vector(s.x[1], (s.u[0] - force * sin(3.0 * s.x[0] / length)) / mass);
  });
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));
  p.add(running_cost("place", [=](const auto& s) {
    using std::cos;
    return force * force * cos(5.0 * s.x[0] / length);
  }));
  p.add(path_inequality(
      "speed", [](const auto& s) { return s.x[1]; }, Eigen::VectorXd::Constant(1, 0.0),
      Eigen::VectorXd::Constant(1, 1.3 * length / unit.time)));
  p.u.lower[0] = -6 * force;
  p.u.upper[0] = 6 * force;
  p.start << 0, 0;
  p.goal << length, 0;
  return p;
}

double consistent_cost(const Solution& s, const Units& unit) {
  return s.cost() / (unit.force() * unit.force() * unit.time);
}

Solution solved(const Units& unit, HessianKind kind) {
  return optimise(hills(unit),
                  {.mesh = {.intervals = 20, .hessian = kind, .evaluation = test::kInterpreted}});
}

class EveryKind : public ::testing::TestWithParam<HessianKind> {};
INSTANTIATE_TEST_SUITE_P(Units, EveryKind,
                         ::testing::Values(HessianKind::kExact, HessianKind::kLimitedMemory),
                         [](const auto& info) {
                           return info.param == HessianKind::kExact ? "exact" : "limited_memory";
                         });

TEST_P(EveryKind, OptimumAndVerdictDoNotDependOnThem) {
  const Solution reference = solved({1, 1, 1}, GetParam());
  ASSERT_TRUE(reference.success()) << reference.verdict();
  const double cost = consistent_cost(reference, {1, 1, 1});
  for (double mass : {1e-6, 1.0, 1e6}) {
    for (double length : {1e-6, 1.0, 1e6}) {
      for (double time : {1e-3, 1.0, 1e3}) {
        const Units unit{mass, length, time};
        const Solution s = solved(unit, GetParam());
        const std::string where =
            std::to_string(mass) + " " + std::to_string(length) + " " + std::to_string(time);
        EXPECT_TRUE(s.success()) << describe(s.nlp.status) << " " << where;
        EXPECT_NEAR(consistent_cost(s, unit) / cost, 1, 1e-7) << where;
        if (GetParam() == HessianKind::kExact) {
          EXPECT_LE(s.nlp.iterations(), reference.nlp.iterations() + 3) << where;
        }
        EXPECT_LT(s.kkt.stationarity, 1e-6) << where;
        EXPECT_LT(s.verification.violation, 1e-7) << where;
      }
    }
  }
}

// A motion that is a little wrong is as wrong in any units.
TEST(Violation, DoesNotDependOnThem) {
  const auto of_moved = [](const Units& unit) {
    StagedNlp nlp = discretize(hills(unit), {.intervals = 10, .evaluation = test::kInterpreted});
    Trajectory motion = nlp.trajectory(nlp.start());
    motion.u(0, 3) = 6.001 * unit.force();
    return verify(nlp.problem(), motion, ScaledNlp(nlp, nlp.scaling(nlp.start())).units());
  };
  const Verification reference = of_moved({1, 1, 1});
  EXPECT_GT(reference.violation, 1e-4);
  for (double mass : {0x1p-20, 0x1p20}) {
    for (double length : {0x1p-20, 0x1p20}) {
      const Verification v = of_moved({mass, length, 1});
      EXPECT_NEAR(v.violation / reference.violation, 1, 1e-9) << mass << " " << length;
      EXPECT_EQ(v.worst_row, reference.worst_row);
    }
  }
}

TEST(Violation, AsksForMagnitudesOfItsProgram) {
  StagedNlp nlp = discretize(hills({1, 1, 1}), {.intervals = 4, .evaluation = test::kInterpreted});
  const Trajectory motion = nlp.trajectory(nlp.start());
  NlpScaling of_another = nlp.scaling(nlp.start());
  EXPECT_EQ(of_another.x.size(), nlp.shape().n());
  of_another.g.pop_back();
  EXPECT_THROW(verify(nlp.problem(), motion, of_another), ArgumentError);
}

TEST(ScaledNlp, SolutionsComeBackToTheProgramsUnits) {
  StagedNlp nlp = discretize(hills({1e-3, 10, 2}), {.intervals = 4, .evaluation = test::kInterpreted});
  ScaledNlp scaled(nlp, nlp.scaling(nlp.start()));
  const NlpSolution own = solve_with_ipopt(nlp, nlp.start());
  const NlpSolution again = scaled.in_own_units(scaled.in_scaled_units(own));
  EXPECT_EQ(own.x, again.x);
  EXPECT_EQ(own.lambda, again.lambda);
  EXPECT_EQ(own.lower_multiplier, again.lower_multiplier);
  EXPECT_EQ(own.objective, again.objective);
  // Multipliers are those of the program as it is written.
  const KktResiduals r = kkt_residuals(nlp, own);
  double bound_multiplier = 0;
  for (double l : own.lambda) bound_multiplier = std::max(bound_multiplier, std::abs(l));
  EXPECT_LT(r.stationarity, 1e-6 * bound_multiplier);
}

TEST(ScaledNlp, DerivativesAreThoseOfItsFunctions) {
  StagedNlp nlp = discretize(hills({1e-3, 10, 2}), {.intervals = 4, .evaluation = test::kInterpreted});
  ScaledNlp scaled(nlp, nlp.scaling(nlp.start()));
  EXPECT_TRUE(check_derivatives(scaled, scaled.in_scaled_units(nlp.start())).good());
}

// A joint that need not move, and a goal that differs from the start by rounding.
TEST(Magnitudes, OfWhatStandsStillComeFromWhatMovesIt) {
  Problem p = test::swing_up();
  p.goal[0] = 1e-17;
  p.guess = nullptr;
  StagedNlp nlp = discretize(p, {.intervals = 10, .evaluation = test::kInterpreted});
  const NlpScaling m = nlp.scaling(nlp.start());
  for (double x : m.x) EXPECT_GT(x, 0.1);
  for (double g : m.g) EXPECT_GT(g, 0.1);
  EXPECT_TRUE(optimise(p, {.mesh = {.intervals = 40, .evaluation = test::kInterpreted}}).success());
}

// A start that stands still, and an end that is an equation.
TEST(Magnitudes, OfWhatOnlyTheEndMovesComeFromWhatItLacks) {
  for (double length : {1e-9, 1.0, 1e9}) {
    Problem p = test::block_move();
    p.goal.setConstant(Problem::kFree);
    p.add(terminal_equality("end", [=](const auto& s) { return vector(s.x[0] - length, s.x[1]); }));
    const Solution s = optimise(p, {.mesh = {.intervals = 10, .evaluation = test::kInterpreted}});
    EXPECT_TRUE(s.success()) << length;
    EXPECT_NEAR(s.cost() / (length * length), 12, 1e-6) << length;
  }
}

TEST(Weights, OfAnySizeAreNoWrongDerivatives) {
  for (double root : {1e-150, 1e150}) {
    Problem p = test::block_move();
    p.terms.clear();
    p.add(running_squares("effort", [=](const auto& s) { return (s.u * root).eval(); }));
    const Solution s = optimise(p, {.mesh = {.intervals = 10, .evaluation = test::kInterpreted}});
    EXPECT_TRUE(s.success()) << root;
    EXPECT_NEAR(s.cost() / root / root, 12, 1e-6) << root;
  }
}

// Nothing but the cost, a bound on one side or an obstacle on the path says how far the motion goes.
TEST(Magnitudes, OfWhatStandsStillComeFromCostsAndBoundsAndPaths) {
  const auto tracked = [](double length) {
    Problem p("track", {"p", "v"}, {"u"}, 1.0, [](const auto& s) { return vector(s.x[1], s.u[0]); });
    p.add(running_squares("error", [=](const auto& s) {
      using std::sin;
      return vector(s.x[0] - length * sin(std::numbers::pi * s.t), 0.01 * s.u[0]);
    }));
    p.start << 0, 0;
    p.goal << 0, 0;
    p.x.upper[0] = 0.3 * length;
    return p;
  };
  const auto over_hill = [](double length) {
    Problem p = test::block_move(0);
    const double infinity = std::numeric_limits<double>::infinity();
    p.add(path_inequality(
        "hill",
        [=](const auto& s) { return vector(s.x[0] - length * (0.5 - 8.0 * (s.t - 0.5) * (s.t - 0.5))); },
        Eigen::VectorXd::Zero(1), Eigen::VectorXd::Constant(1, infinity)));
    return p;
  };
  const MeshOptions mesh{.intervals = 20, .evaluation = test::kInterpreted};
  for (double length : {1e-9, 1e-6, 1e-3, 1.0, 1e6}) {
    const Solution track = optimise(tracked(length), {.mesh = mesh});
    EXPECT_TRUE(track.success()) << length << track.verdict();
    EXPECT_NEAR(track.cost() / (length * length) / 0.226009119, 1, 1e-6) << length;
    const Solution over = optimise(over_hill(length), {.mesh = mesh});
    EXPECT_TRUE(over.success()) << length;
    EXPECT_NEAR(over.cost() / (length * length) / 48, 1, 1e-6) << length;
  }
}

// A start at rest near the reference, which alone moves the block; limits far away say nothing of how far.
TEST(Magnitudes, OfAReferenceOutweighTheRoomBetweenLimits) {
  const auto cost = [](double from) {
    Problem p = test::block_move();
    p.terms.clear();
    p.add(running_squares("all", [](const auto& s) { return vector(s.x[0], std::sqrt(1e-3) * s.u[0]); }));
    p.start << from, 0;
    p.goal << Problem::kFree, 0;
    p.x.lower[0] = -1;
    p.x.upper[0] = 100;
    const Solution s = optimise(p, {.mesh = {.intervals = 20, .evaluation = test::kInterpreted}});
    EXPECT_TRUE(s.success()) << from;
    return s.cost() / (from * from);
  };
  const double reference = cost(1);
  for (double from : {1e-3, 1e-6}) EXPECT_NEAR(cost(from) / reference, 1, 1e-6) << from;
}

// Magnitudes of a stiff spring are finite, and what rounding makes of differences is no wrong derivative.
TEST(Magnitudes, OfStiffSpringsAndNarrowBoundsAreNoWrongDerivatives) {
  for (double stiffness : {1e4, 1e8, 1e10}) {
    Problem p("springs", {"p", "q", "v", "w"}, {"u"}, 1.0, [=](const auto& s) {
      const auto force = stiffness * (s.x[0] - s.x[1]);
      return vector(s.x[2], s.x[3], s.u[0] - force - 0.5 * s.x[2], force - 0.3 * s.x[3]);
    });
    p.add(running_squares("effort", [](const auto& s) { return s.u; }));
    p.start << 0, 0, 0, 0;
    p.goal << 1, 1, 0, 0;
    StagedNlp nlp = discretize(p, {.intervals = 6, .evaluation = test::kInterpreted});
    EXPECT_TRUE(check_derivatives(nlp, nlp.start()).good()) << stiffness;
  }
  for (double bound : {1e-9, 1e-300}) {
    Problem p = test::block_move();
    p.x.lower[1] = -bound;
    p.x.upper[1] = bound;
    StagedNlp nlp = discretize(p, {.intervals = 6, .evaluation = test::kInterpreted});
    EXPECT_TRUE(check_derivatives(nlp, nlp.start()).good()) << bound;
  }
}

// Far from zero, among hills that are as long as the way: steps are as long as the hills ask for, not as the place is.
TEST(Magnitudes, OfAShortWayFarFromZeroAreNoWrongDerivatives) {
  for (double place : {1e3, 1e6, 1e8}) {
    Problem p = hills({1, 1, 1});
    p.start[0] += place, p.goal[0] += place;
    StagedNlp nlp = discretize(p, {.intervals = 6, .evaluation = test::kInterpreted});
    EXPECT_TRUE(check_derivatives(nlp, nlp.start()).good()) << place;
  }
}

// What a wild guess calls large is not what the optimum calls large.
Problem pushed_over(double force_guessed) {
  Problem p("pushed", {"p", "v"}, {"u"}, 1.0, [](const auto& s) {
    using std::sin;
    return vector(s.x[1], s.u[0] - sin(s.x[0]) * 9.81);
  });
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));
  p.start << 0, 0;
  p.goal << 3, 0;
  p.x.upper[1] = 4;
  p.guess = [line = straight_line(p), force_guessed](double t) {
    Stage<double> stage = line(t);
    stage.u[0] = force_guessed;
    return stage;
  };
  return p;
}

// At rest, held by nothing: rows that lack a weight, and one of whose terms rounding alone is left.
TEST(Magnitudes, OfRowsThatLackRoundingComeFromTheOthers) {
  Problem p("two", {"p", "r", "v", "w"}, {"u", "y"}, 1.0, [](const auto& s) {
    auto rate = s.x;
    rate << s.x.tail(2), s.a;
    return rate;
  });
  const auto residual = [](const auto& s) {
    using T = std::decay_t<decltype(s.t)>;
    return vector(T(2.0 * s.a[0] + 9.81 - s.u[0]), T(0.5 * s.a[1] + 0.1 * s.a[0] + 1e-19 - s.u[1]));
  };
  p.use_accelerations({"a", "b"}, residual, [](const auto& s) {
    auto rate = s.x;
    rate << s.x.tail(2), s.u;
    return rate;
  });
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));
  p.start << 0, 0, 0, 0;
  StagedNlp nlp = discretize(p, {.intervals = 4, .evaluation = test::kInterpreted});
  const std::vector<double> start = nlp.start();
  for (double x : nlp.scaling(start).x) EXPECT_GT(x, 1e-6);
  EXPECT_TRUE(check_derivatives(nlp, start).good());

  // A guess that holds what hangs, and the other but for rounding.
  p.guess = [](double t) {
    return Stage<double>{t, Eigen::Vector4d(t, t, 0, 0), Eigen::VectorXd::Zero(2),
                         Eigen::Vector2d(9.81, -1e-19)};
  };
  StagedNlp held = discretize(p, {.intervals = 4, .evaluation = test::kInterpreted});
  for (double x : held.scaling(held.start()).x) EXPECT_GT(x, 1e-6);
}

// The end lacks a metre of one state, and of a row that both make up but rounding.
TEST(Magnitudes, OfEndsThatLackRoundingComeFromTheOthers) {
  Problem p("two", {"p", "r"}, {"u", "y"}, 1.0, [](const auto& s) { return s.u; });
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));
  p.add(terminal_equality("end", [](const auto& s) {
    using T = std::decay_t<decltype(s.t)>;
    return vector(T(s.x[0] - 1.0), T(s.x[1] + 1e-3 * s.x[0] + 1e-19));
  }));
  p.start << 0, 0;
  StagedNlp nlp = discretize(p, {.intervals = 4, .evaluation = test::kInterpreted});
  for (double x : nlp.scaling(nlp.start()).x) EXPECT_GT(x, 1e-6);
  EXPECT_TRUE(optimise(nlp, nlp.start(), {}).success());
}

// The end lacks what a cosine at its top, or at its foot, has no slope towards; the derivatives around tell how far it is.
TEST(Magnitudes, OfACosineAtItsTopComeFromAround) {
  for (double length : {1e-9, 1.0, 1e9}) {
    for (double angle : {0.0, 1e-9, 0.1, 3.1, std::numbers::pi}) {
      Problem p("arc", {"p", "v"}, {"u"}, 1.0, [=](const auto& s) {
        using std::sin;
        return vector(s.x[1], s.u[0] - length * sin(s.x[0] / length));
      });
      p.add(running_squares("effort", [](const auto& s) { return s.u; }));
      const double target = angle < 1 ? -1 : 1;
      p.add(terminal_equality("end", [=](const auto& s) {
        using std::cos;
        return vector(cos(s.x[0] / length) - target);
      }));
      p.start << angle * length, 0;
      StagedNlp nlp = discretize(p, {.intervals = 10, .evaluation = test::kInterpreted});
      const NlpScaling m = nlp.scaling(nlp.start());
      EXPECT_GT(m.x[0] / length, 0.02) << length << " " << angle;
      EXPECT_LT(m.x[0] / length, 20) << length << " " << angle;
    }
  }
}

TEST(Rounds, EndAtTheOptimumFromAWildGuess) {
  for (HessianKind kind : {HessianKind::kExact, HessianKind::kGaussNewton}) {
    for (double force : {1.0, 1e3, 1e5, 1e7}) {
      const Solution s = optimise(
          pushed_over(force), {.mesh = {.intervals = 20, .hessian = kind, .evaluation = test::kInterpreted}});
      EXPECT_TRUE(s.success()) << force << s.verdict();
      EXPECT_NEAR(s.cost() / 140.746214, 1, 1e-6) << force;
      EXPECT_LT(s.kkt.stationarity, 1e-6) << force;
      EXPECT_LT(s.kkt.complementarity, 1e-6) << force;
    }
  }
}

TEST(Rounds, EndAtTheOptimumOfACostThatIsSteepAtTheGuess) {
  for (double place : {0.0, 10.0, 100.0, 1000.0}) {
    Problem p = test::block_move();
    p.terms.clear();
    p.add(running_cost("steep", [](const auto& s) {
      const auto d = s.x[0] - 1.0;
      return d * d * d * d + 1e-3 * s.u[0] * s.u[0];
    }));
    p.goal.setConstant(Problem::kFree);
    p.x.upper[1] = 2;
    p.guess = [line = straight_line(p), place](double t) {
      Stage<double> stage = line(t);
      if (t > 0) stage.x[0] = place;
      return stage;
    };
    const Solution s = optimise(p, {.mesh = {.intervals = 20, .evaluation = test::kInterpreted}});
    EXPECT_TRUE(s.success()) << place << s.verdict();
    EXPECT_NEAR(s.cost() / 0.184337039, 1, 1e-6) << place;
  }
}

// The iterations that a user allows are those of all rounds, and one log tells of all.
TEST(Rounds, ShareTheirLimitsAndTheirLog) {
  const MeshOptions mesh{.intervals = 20, .evaluation = test::kInterpreted};
  const NlpSolution free = optimise(pushed_over(1e5), {.mesh = mesh}).nlp;
  for (std::size_t k = 0; k < free.log.size(); ++k) EXPECT_EQ(free.log[k].iteration, int(k));
  const int allowed = free.iterations() - 2;
  const NlpSolution cut =
      optimise(pushed_over(1e5), {.mesh = mesh, .solver = {.max_iterations = allowed}}).nlp;
  EXPECT_EQ(cut.status, SolveStatus::kIterationLimit);
  EXPECT_EQ(cut.iterations(), allowed);
}

}  // namespace
}  // namespace dyntape::ocp_units_test
