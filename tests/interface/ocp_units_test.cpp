// SPDX-License-Identifier: BSD-3-Clause
//
// The same problem in other units: kilograms or milligrams, metres or kilometres, seconds or hours.
#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/ocp/optimise.h>
#include <dyntape/interface/solvers/scaled_nlp.h>
#include "ocp_problems.h"

namespace dyntape {
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
  ASSERT_TRUE(reference.success()) << describe(reference.nlp.status);
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
    Collocation nlp(hills(unit), {.intervals = 10, .evaluation = test::kInterpreted});
    Trajectory motion = nlp.trajectory(nlp.start());
    motion.u(0, 3) = 6.001 * unit.force();
    return verify(nlp.problem(), motion, ScaledNlp(nlp, nlp.magnitudes(nlp.start())).units());
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
  Collocation nlp(hills({1, 1, 1}), {.intervals = 4, .evaluation = test::kInterpreted});
  const Trajectory motion = nlp.trajectory(nlp.start());
  NlpMagnitudes of_another = nlp.magnitudes(nlp.start());
  EXPECT_EQ(of_another.x.size(), nlp.shape().n());
  of_another.g.pop_back();
  EXPECT_THROW(verify(nlp.problem(), motion, of_another), ArgumentError);
}

TEST(ScaledNlp, SolutionsComeBackToTheProgramsUnits) {
  Collocation nlp(hills({1e-3, 10, 2}), {.intervals = 4, .evaluation = test::kInterpreted});
  ScaledNlp scaled(nlp, nlp.magnitudes(nlp.start()));
  const NlpSolution own = solve_with_ipopt(nlp, nlp.start());
  const NlpSolution again = scaled.in_own_units(scaled.in_scaled_units(own));
  EXPECT_EQ(own.x, again.x);
  EXPECT_EQ(own.lambda, again.lambda);
  EXPECT_EQ(own.lower_price, again.lower_price);
  EXPECT_EQ(own.objective, again.objective);
  // Multipliers are those of the program as it is written.
  const KktResiduals r = kkt_residuals(nlp, own);
  double price = 0;
  for (double l : own.lambda) price = std::max(price, std::abs(l));
  EXPECT_LT(r.stationarity, 1e-6 * price);
}

TEST(ScaledNlp, DerivativesAreThoseOfItsFunctions) {
  Collocation nlp(hills({1e-3, 10, 2}), {.intervals = 4, .evaluation = test::kInterpreted});
  ScaledNlp scaled(nlp, nlp.magnitudes(nlp.start()));
  EXPECT_TRUE(check_derivatives(scaled, scaled.in_scaled_units(nlp.start())).good());
}

// A joint that need not move, and a goal that differs from the start by rounding.
TEST(Magnitudes, OfWhatStandsStillComeFromWhatMovesIt) {
  Problem p = test::swing_up();
  p.goal[0] = 1e-17;
  p.guess = nullptr;
  Collocation nlp(p, {.intervals = 10, .evaluation = test::kInterpreted});
  const NlpMagnitudes m = nlp.magnitudes(nlp.start());
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

}  // namespace
}  // namespace dyntape
