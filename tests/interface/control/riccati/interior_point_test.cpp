// SPDX-License-Identifier: BSD-3-Clause
//
// The interior-point method on small programs with known answers, some of which are known to mislead such methods.
#include <gtest/gtest.h>

#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/ipopt/ipopt.h>
#include <dyntape/interface/control/nlp/kkt.h>
#include <dyntape/interface/control/riccati/interior_point.h>
#include "interface/control/recorded_nlp.h"

namespace dyntape::interior_point_test {
namespace {

using test::RecordedNlp;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

VectorXad all(std::initializer_list<AD> values) {
  VectorXad v(Eigen::Index(values.size()));
  Eigen::Index i = 0;
  for (const AD& value : values) v[i++] = value;
  return v;
}

bool is_solved(const NlpSolution& s) { return s.status == SolveStatus::kSolved; }

NlpSolution solve(Nlp& nlp, const std::vector<double>& start) {
  const NlpSolution s = solve_with_riccati(nlp, start, {.tolerance = 1e-10, .bound_relaxation = 0});
  if (is_solved(s)) {
    const KktResiduals r = kkt_residuals(nlp, s);
    EXPECT_LE(r.stationarity, 1e-6);
    EXPECT_LE(r.feasibility, 2e-8);
    EXPECT_LE(r.complementarity, 1e-6);
  }
  return s;
}

// W. Hock, K. Schittkowski, Test Examples for Nonlinear Programming Codes, 1981.
TEST(InteriorPoint, HockSchittkowski) {
  RecordedNlp hs71(
      [](const VectorXad& x) {
        return all({x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2], x[0] * x[1] * x[2] * x[3], x.squaredNorm()});
      },
      4, {25, 40}, {kInfinity, 40});
  for (std::size_t i = 0; i < 4; ++i) hs71.bound(i, 1, 5);
  const NlpSolution s71 = solve(hs71, {1, 5, 5, 1});
  EXPECT_EQ(s71.status, SolveStatus::kSolved);
  EXPECT_NEAR(s71.objective, 17.0140172892, 1e-6);

  RecordedNlp hs6(
      [](const VectorXad& x) {
        return all({(1 - x[0]) * (1 - x[0]), 10 * (x[1] - x[0] * x[0])});
      },
      2, {0}, {0});
  const NlpSolution s6 = solve(hs6, {-1.2, 1});
  EXPECT_EQ(s6.status, SolveStatus::kSolved);
  EXPECT_NEAR(s6.x[1], 1, 1e-8);

  RecordedNlp hs13(
      [](const VectorXad& x) {
        const AD a = 1 - x[0];
        return all({(x[0] - 2) * (x[0] - 2) + x[1] * x[1], a * a * a - x[1]});
      },
      2, {0}, {kInfinity});  // no multiplier exists at the optimum
  hs13.bound(0, 0, kInfinity), hs13.bound(1, 0, kInfinity);
  const NlpSolution s13 = solve_with_riccati(hs13, {-2, -2});
  EXPECT_NEAR(s13.objective, 1, 0.05);
}

// N. Maratos: the full Newton step raises both cost and violation; corrections of second order take it.
// x + y = 2 and x + (1 + e) y = 2 + 5 e: however alike the rows, the point is (-3, 5).
TEST(InteriorPoint, RowsThatNearlyRepeatEachOther) {
  for (const double e : {1e-4, 1e-5, 1e-6, 1e-7, 1e-8}) {
    RecordedNlp nlp(
        [e](const VectorXad& x) {
          return all({x.squaredNorm(), x[0] + x[1], x[0] + (1 + e) * x[1]});
        },
        2, {2, 2 + 5 * e}, {2, 2 + 5 * e});
    const NlpSolution s = solve(nlp, {0, 0});
    EXPECT_EQ(s.status, SolveStatus::kSolved) << e;
    EXPECT_NEAR(s.x[0], -3, 1e-14 / e + 1e-9) << e;
  }
}

TEST(InteriorPoint, MaratosEffect) {
  RecordedNlp nlp(
      [](const VectorXad& x) {
        return all({2 * (x.squaredNorm() - 1) - x[0], x.squaredNorm()});
      },
      2, {1}, {1});
  const NlpSolution s = solve(nlp, {std::cos(1.5), std::sin(1.5)});
  EXPECT_EQ(s.status, SolveStatus::kSolved);
  EXPECT_NEAR(s.x[0], 1, 1e-8);
  EXPECT_LE(s.iterations(), 12);
}

// A. Waechter, L. Biegler, Failure of global convergence for a class of interior point methods, 2000: steps get shorter and
// shorter at bounds, unless feasibility is restored.
TEST(InteriorPoint, WhereStepsStickToBounds) {
  RecordedNlp nlp(
      [](const VectorXad& x) {
        return all({x[0], x[0] * x[0] - x[1] - 1, x[0] - x[2] - 0.5});
      },
      3, {0, 0}, {0, 0});
  nlp.bound(1, 0, kInfinity), nlp.bound(2, 0, kInfinity);
  const NlpSolution s = solve(nlp, {-2, 3, 1});
  EXPECT_EQ(s.status, SolveStatus::kSolved);
  EXPECT_NEAR(s.objective, 1, 1e-7);
}

TEST(InteriorPoint, InfeasibleIsSaid) {
  RecordedNlp circle([](const VectorXad& x) { return all({x[0], x.squaredNorm() + 1}); }, 2, {0}, {0});
  EXPECT_EQ(solve_with_riccati(circle, {3, 4}).status, SolveStatus::kLocallyInfeasible);
  RecordedNlp gap(
      [](const VectorXad& x) {
        return all({x[0] * x[0], x[0], x[0]});
      },
      1, {1, -kInfinity}, {kInfinity, -1});
  EXPECT_EQ(solve_with_riccati(gap, {0.3}).status, SolveStatus::kLocallyInfeasible);
  RecordedNlp lines(
      [](const VectorXad& x) {
        return all({x.squaredNorm(), x[0] + x[1], x[0] + x[1]});
      },
      2, {1, 2}, {1, 2});
  EXPECT_EQ(solve_with_riccati(lines, {0.3, 1}).status, SolveStatus::kLocallyInfeasible);
  // Between fixed variables there is nothing to move.
  RecordedNlp fixed([](const VectorXad& x) { return all({x[1] * x[1], x[0] * x[0]}); }, 2, {2}, {2});
  fixed.bound(0, 1, 1);
  EXPECT_EQ(solve_with_riccati(fixed, {1, 1}).status, SolveStatus::kLocallyInfeasible);
}

TEST(InteriorPoint, UnboundedIsNoSolution) {
  RecordedNlp line([](const VectorXad& x) { return all({x[0] + x[1] * x[1]}); }, 2, {}, {});
  const SolveStatus status = solve_with_riccati(line, {0, 1}).status;
  EXPECT_TRUE(status == SolveStatus::kDiverging || status == SolveStatus::kStepFailed ||
              status == SolveStatus::kIterationLimit)
      << to_string(status);
}

// Rows twice, and their sum once more: multipliers are not unique, the point is.
TEST(InteriorPoint, RowsThatRepeatEachOther) {
  RecordedNlp nlp(
      [](const VectorXad& x) {
        using std::exp;
        return all({exp(x[0]) + exp(x[1]) + x[2] * x[2], x[0] + x[1], 2 * x[0] + 2 * x[1], x[1] - x[2],
                    x[0] + 2 * x[1] - x[2]});
      },
      3, {1, 2, 0, 1}, {1, 2, 0, 1});
  const NlpSolution s = solve(nlp, {3, 1, -1});
  EXPECT_EQ(s.status, SolveStatus::kSolved);
  EXPECT_NEAR(s.x[0] + s.x[1], 1, 1e-9);
}

// Random programs, not convex: whatever it calls solved fulfils the conditions, and Ipopt finds no better one from there.
TEST(InteriorPoint, RandomProgramsAgreeWithIpopt) {
  int solved = 0, same = 0;
  for (unsigned seed = 0; seed < 60; ++seed) {
    std::mt19937 engine(seed);
    std::normal_distribution<double> normal;
    const int n = 3 + int(engine() % 6), m = int(engine() % unsigned(n - 1));
    Eigen::MatrixXd A(n, n), B(m, n), C(m, n);
    Eigen::VectorXd linear(n);
    for (Eigen::MatrixXd* M : {&A, &B, &C}) *M = M->unaryExpr([&](double) { return normal(engine); });
    linear = linear.unaryExpr([&](double) { return normal(engine); });
    std::vector<double> lower(std::size_t(m), 0.0), upper(std::size_t(m), 0.0);
    for (std::size_t j = 0; j < std::size_t(m); ++j) {
      if (j % 2 == 1) lower[j] = -kInfinity, upper[j] = 1;
    }
    RecordedNlp nlp(
        [&](const VectorXad& x) {
          using std::sin;
          VectorXad y(1 + m);
          y[0] = 0;
          for (int i = 0; i < n; ++i) {
            AD product(0);
            for (int j = 0; j < n; ++j) product += A(i, j) * x[j];
            y[0] += sin(product) + 0.1 * product * product + linear[i] * x[i];
          }
          for (int k = 0; k < m; ++k) {
            y[1 + k] = 0;
            for (int j = 0; j < n; ++j) y[1 + k] += B(k, j) * x[j] + 0.3 * C(k, j) * x[j] * x[j];
          }
          return y;
        },
        std::size_t(n), lower, upper);
    for (std::size_t i = 0; i < std::size_t(n); i += 2) nlp.bound(i, -1.5, i % 4 == 0 ? 2 : kInfinity);
    const std::vector<double> start(std::size_t(n), 0.2);
    const NlpSolution ours = solve(nlp, start), other = solve_with_ipopt(nlp, start, {.tolerance = 1e-10});
    EXPECT_EQ(is_solved(ours), is_solved(other)) << "seed " << seed << ": " << to_string(ours.status);
    if (!is_solved(ours)) continue;
    ++solved;
    same += std::abs(ours.objective - other.objective) < 1e-6 * (1 + std::abs(other.objective));
    const NlpSolution again = solve_with_ipopt(nlp, ours.x, {.tolerance = 1e-10});
    EXPECT_NEAR(again.objective, ours.objective, 1e-6 * (1 + std::abs(ours.objective))) << "seed " << seed;
  }
  EXPECT_GE(solved, 50);
  EXPECT_GE(same, 45);
  std::printf("%d solved, %d with Ipopt's optimum\n", solved, same);
}

TEST(InteriorPoint, RefusesWhatItCannotDo) {
  RecordedNlp nlp([](const VectorXad& x) { return all({x.squaredNorm(), x[0] + x[2]}); }, 3, {1}, {1});
  const auto message = [&](const std::vector<double>& start, const SolverOptions& options) {
    try {
      solve_with_riccati(nlp, start, options);
    } catch (const ArgumentError& e) {
      return std::string(e.what());
    }
    return std::string("nothing thrown");
  };
  EXPECT_NE(message({1, 2}, {}).find("has 2 entries, the problem has 3"), std::string::npos);
  EXPECT_NE(message({1, 2, 3}, {.limited_memory = true}).find("limited memory"), std::string::npos);
  EXPECT_NE(message({1, 2, 3}, {.extra = {{"mu_strategy", "adaptive"}}}).find("mu_strategy"),
            std::string::npos);
  EXPECT_NE(message({1, 2, 3}, {.tolerance = 0}).find("tolerance is 0, expected a number above 0"),
            std::string::npos);
  EXPECT_NE(message({1, 2, 3}, {.max_iterations = -1}).find("-1 iterations"), std::string::npos);
  EXPECT_EQ(message({1, 2, 3}, {}), "nothing thrown");
}

// A solver that is kept: rows that get their first bound, other numbers of bounds, and what it refuses.
TEST(InteriorPoint, OneSolverManySolves) {
  class Bounded : public RecordedNlp {
   public:
    Bounded()
        : RecordedNlp(
              [](const VectorXad& x) {
                return all({x[0] * x[0], x[0]});
              },
              1, {-kInfinity}, {kInfinity}) {}
    void at_least(double value) { row_bounds(0, value, kInfinity); }
  } nlp;
  StructuredInteriorPoint solver(nlp);
  EXPECT_NEAR(solver.solve({3}, {}).x[0], 0, 1e-6);
  nlp.at_least(2);
  const NlpSolution first = solver.solve({3}, {});
  EXPECT_NEAR(first.x[0], 2, 1e-6);
  const NlpSolution again = solver.solve(first.x, {}, &first);
  EXPECT_LE(again.iterations(), 2);
  EXPECT_NEAR(again.x[0], 2, 1e-6);
  EXPECT_THROW(solver.solve({3, 4}, {}), ArgumentError);
  EXPECT_THROW(solver.solve({3}, {.tolerance = -1}), ArgumentError);
  const NlpSolution empty;
  EXPECT_THROW(solver.solve({3}, {}, &empty), ArgumentError);
  nlp.bound(0, 4, 3);
  EXPECT_EQ(solver.solve({3}, {}).status, SolveStatus::kBadOption);
}

// A chain of masses and one force: goals of all states on meshes on which a few controls could not meet them.
TEST(InteriorPoint, GoalsOfFewControlsOnFineMeshes) {
  for (int N : {40, 320, 1280}) {
    Problem p("masses", {"a", "b", "c", "va", "vb", "vc"}, {"u"}, 2.0, [](const auto& s) {
      using T = std::decay_t<decltype(s.t)>;
      const T ab = 30.0 * (s.x[1] - s.x[0]), bc = 30.0 * (s.x[2] - s.x[1]);
      return vector(T(s.x[3]), T(s.x[4]), T(s.x[5]), T(s.u[0] + ab), T(bc - ab), T(-bc));
    });
    p.add(running_squares("effort", [](const auto& s) { return s.u; }));
    p.start << 0, 0, 0, 0, 0, 0;
    p.goal << 1, 1, 1, 0, 0, 0;
    StagedNlp nlp = discretize(p, {.intervals = N, .evaluation = test::kInterpreted});
    const NlpSolution s = solve_nlp(nlp, nlp.start(), {.method = NlpMethod::kRiccati});
    EXPECT_EQ(s.status, SolveStatus::kSolved) << N;
    EXPECT_LE(s.iterations(), 2) << N;
    if (N > 40) continue;
    EXPECT_NEAR(s.objective, solve_nlp(nlp, nlp.start()).objective, 1e-6 * s.objective);
  }
}

TEST(InteriorPoint, LimitsEndIt) {
  RecordedNlp nlp(
      [](const VectorXad& x) {
        const AD a = x[1] - x[0] * x[0], b = 1 - x[0];
        return all({100 * a * a + b * b});
      },
      2, {}, {});
  EXPECT_EQ(solve_with_riccati(nlp, {-1.2, 1}, {.max_iterations = 3}).status, SolveStatus::kIterationLimit);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(solve_with_riccati(nlp, {-1.2, 1}, {.stop = stop.get_token()}).status, SolveStatus::kStopped);
  EXPECT_EQ(solve_with_riccati(nlp, {-1.2, 1}).status, SolveStatus::kSolved);
}

}  // namespace
}  // namespace dyntape::interior_point_test
