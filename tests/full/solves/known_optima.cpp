// SPDX-License-Identifier: BSD-3-Clause
//
// Known optima that take minutes: finest meshes, what a Hessian is worth, the least force that swings a
// cart-pole up, and where random starts lead.  The quick ones are in tests/interface/control/solve/known_*_test.cpp.
#include <dyntape/interface/control/solve/solve.h>

#include <algorithm>
#include <array>
#include <map>
#include <random>

#include "interface/control/known_problems.h"

namespace dyntape {
namespace {

using test::has_digits;
using test::solve_on;
using test::Solved;
using test::swing_up;
using test::swing_up_low;
using test::tight;

class FullOptima : public ::testing::TestWithParam<NlpMethod> {};
INSTANTIATE_TEST_SUITE_P(By, FullOptima, ::testing::Values(NlpMethod::kIpopt, NlpMethod::kRiccati),
                         test::method_name);

TEST_P(FullOptima, CartPoleOnFineMeshes) {
  struct Row {
    int intervals;
    const char *a, *b;
  };
  double last[2], limit[2];
  for (const auto& [n, a, b] : {Row{320, "58.8076674456", "57.9447803563"},
                                {640, "58.8076674574", "57.9447803098"},
                                {1280, "58.8076674581", "57.9447803069"}}) {
    const double cost[] = {solve_on(swing_up(), {.intervals = n}, tight(GetParam())).cost(),
                           solve_on(swing_up_low(), {.intervals = n}, tight(GetParam())).cost()};
    EXPECT_TRUE(has_digits(cost[0], a)) << n;
    EXPECT_TRUE(has_digits(cost[1], b)) << n;
    for (int i = 0; i < 2; ++i) limit[i] = (16 * cost[i] - last[i]) / 15, last[i] = cost[i];
  }
  // What shooting with Pontryagin's equations gives.
  EXPECT_TRUE(has_digits(limit[0], "58.8076674582"));
  EXPECT_TRUE(has_digits(limit[1], "57.9447803067"));
}

// One limit by every way: many points on few intervals, few on many, and held controls, whose cost comes near with the
// square of the interval.
TEST_P(FullOptima, CartPoleByEveryWay) {
  const double limit = 58.8076674582;
  for (const auto& [scheme, intervals, off] : {std::tuple(lobatto(5), 160, 1e-9),
                                               {lobatto(9), 40, 1e-9},
                                               {lobatto(17), 10, 1e-8},
                                               {lobatto(101), 1, 1e-8},
                                               {radau(3), 320, 1e-8},
                                               {radau(5), 160, 1e-9},
                                               {radau(100), 1, 1e-8},
                                               {pseudospectral(101), 1, 1e-6}}) {
    const Solved s = solve_on(swing_up(), {.scheme = scheme, .intervals = intervals}, tight(GetParam()));
    EXPECT_TRUE(s.success()) << scheme.name << " " << to_string(s.nlp.status);
    std::printf("%s on %d: off by %.1e, %d iterations\n", scheme.name.c_str(), intervals, s.cost() - limit,
                s.nlp.iterations());
    EXPECT_NEAR(s.cost(), limit, off) << scheme.name;
  }
  Solved held = solve_on(swing_up(), {.scheme = runge_kutta_4(1), .intervals = 160}, tight(GetParam()));
  double before = 0;
  for (const int n : {320, 640}) {
    before = held.cost();
    held =
        solve_on(swing_up(), {.scheme = runge_kutta_4(1), .intervals = n}, tight(GetParam()), &held.motion);
  }
  EXPECT_NEAR((4 * held.cost() - before) / 3, limit, 1e-6);
}

// Within limits of the force, on 320 intervals: basin A by way of coarser meshes, as from the line the fine one slips into B.
TEST_P(FullOptima, CartPoleWithinLimitsOnAFineMesh) {
  for (const auto& [limit, cost] : {std::pair(12, "59.191483"), {10, "62.260545"}}) {
    Solved s = solve_on(swing_up(0, limit), {.intervals = 40}, {.method = GetParam()});
    for (const int n : {80, 160, 320})
      s = solve_on(swing_up(0, limit), {.intervals = n}, tight(GetParam()), &s.motion);
    EXPECT_TRUE(s.success() && has_digits(s.cost(), cost)) << limit << " " << s.cost();
  }
  for (const auto& [limit, cost] : {std::pair(12, "57.971366"),
                                    {10, "58.865792"},
                                    {9, "60.309293"},
                                    {8, "63.808291"},
                                    {7, "78.433681"}}) {
    const Solved s = solve_on(swing_up_low(limit), {.intervals = 320}, tight(GetParam()));
    EXPECT_TRUE(s.success()) << limit;
    EXPECT_TRUE(has_digits(s.cost(), cost)) << limit;
  }
}

TEST_P(FullOptima, LeastForceOfTheCartPole) {
  Solved last = solve_on(swing_up_low(7), {.intervals = 40}, {.method = GetParam()});
  double feasible = 7, infeasible = 6.8;
  for (double limit = 6.87; infeasible - feasible < -1e-4; limit = (feasible + infeasible) / 2) {
    const Solved s = solve_on(swing_up_low(limit), {.intervals = 40}, {.method = GetParam()}, &last.motion);
    if (s.success()) {
      feasible = limit, last = s;
    } else {
      infeasible = limit;
    }
  }
  std::printf("least force %.5f N, at a cost of %.4f\n", feasible, last.cost());
  EXPECT_NEAR(feasible, 6.8655, 2e-4);
}

TEST_P(FullOptima, AcrobotOnFineMeshes) {
  struct Row {
    int intervals;
    const char *c, *d, *e;
  };
  Solved last[3];
  for (const auto& [n, c, d, e] : {Row{40, "34.87434450", "18.50413331", "17.17967370"},
                                   {80, "34.91826825", "18.54182494", "17.69043123"},
                                   {160, "34.91868376", "18.55259892", "17.70080481"},
                                   {320, "34.91877836", "18.55266267", "17.70087132"},
                                   {640, "34.91878392", "18.55266664", "17.70087544"}}) {
    const Problem problems[] = {test::acrobot_c(), test::acrobot_d(), test::acrobot_e(n)};
    const char* const costs[] = {c, d, e};
    for (int i = 0; i < 3; ++i) {
      last[i] = solve_on(problems[i], {.intervals = n}, {.method = GetParam(), .tolerance = 1e-11},
                         n == 40 ? nullptr : &last[i].motion);
      EXPECT_TRUE(last[i].success() && has_digits(last[i].cost(), costs[i])) << n << " "
                                                                             << "CDE"[i];
    }
  }
  const Problem line =
      test::acrobot([](double t) -> Eigen::Vector2d { return Eigen::Vector2d::Constant(test::kPi * t / 2); },
                    [](double) -> Eigen::Vector2d { return Eigen::Vector2d::Zero(); });
  const Solved dear = solve_on(line, {.intervals = 160}, {.method = GetParam(), .tolerance = 1e-11});
  EXPECT_TRUE(dear.success() && has_digits(dear.cost(), "77.8514")) << dear.cost();
}

// Iterations with the exact Hessian, by L-BFGS and by Gauss-Newton, which does not see the curvature of the dynamics; from the
// line at rest, along it at its speed, and from the line with a force.
TEST(FullOptima, WhatAHessianIsWorth) {
  const auto count = [](double weight, const char* cost, HessianKind hessian, double speed, double force) {
    Problem p = swing_up(weight);
    p.guess = [=](double t) {
      const Eigen::Vector4d x(t / 2, test::kPi * t / 2, speed / 2, speed * test::kPi / 2);
      return Stage<double>{t, x, {}, Eigen::VectorXd::Constant(1, force)};
    };
    const Solved s = solve_on(p, {.intervals = 40, .hessian = hessian}, {});
    EXPECT_TRUE(s.success() || s.nlp.status == SolveStatus::kAcceptable) << to_string(s.nlp.status);
    EXPECT_TRUE(has_digits(s.cost(), cost));
    return s.nlp.iterations();
  };
  for (const auto& [weight, cost, speed, force] : {std::tuple(0., "58.80758", 0., 0.),
                                                   {0., "58.80758", 1., 0.},
                                                   {0., "58.80758", 0., 1.},
                                                   {1., "96.32737", 0., 0.},
                                                   {10., "407.53905", 0., 0.}}) {
    const int exact = count(weight, cost, HessianKind::kExact, speed, force),
              memory = count(weight, cost, HessianKind::kLimitedMemory, speed, force),
              newton = count(weight, cost, HessianKind::kGaussNewton, speed, force);
    std::printf("weight %g: exact %d iterations, L-BFGS %d, Gauss-Newton %d\n", weight, exact, memory,
                newton);
    EXPECT_LE(exact, 16);
    EXPECT_GE(memory, 30);
    EXPECT_LE(memory, speed > 0 ? 100 : 50);  // in the units that speeds of the start give
    EXPECT_GT(newton, 150);
  }
}

double between(std::mt19937_64& random, double from, double to) {
  return std::uniform_real_distribution<double>(from, to)(random);
}

// From random starts on 40 intervals, which optima are found how often.
using Guess = std::function<Stage<double>(double t)>;
std::map<std::string, int> from_random_starts(Problem problem, int starts, unsigned seed, NlpMethod method,
                                              const std::function<Guess(std::mt19937_64&)>& draw) {
  std::mt19937_64 random(seed);
  StagedNlp program = discretize(problem, {.intervals = 40, .evaluation = test::kInterpreted});
  std::map<std::string, int> found;
  for (int i = 0; i < starts; ++i) {
    problem.guess = draw(random);
    program.set_values(problem);
    const NlpSolution s = solve_nlp(program, program.start(), {.method = method, .max_iterations = 1000});
    char cost[32];
    std::snprintf(cost, sizeof cost, "%.3f", s.objective);
    ++found[s.status == SolveStatus::kSolved ? cost : to_string(s.status)];
  }
  return found;
}

// The least cost; what was found most often is printed.
double least_of(const std::map<std::string, int>& found, const char* what, unsigned seed) {
  double least = HUGE_VAL;
  int others = 0;
  std::printf("%s, seed %u:", what, seed);
  for (const auto& [end, count] : found) {
    if (std::isdigit(end[0])) least = std::min(least, std::strtod(end.c_str(), nullptr));
    if (count < 3) {
      others += count;
    } else {
      std::printf(" %s (%d),", end.c_str(), count);
    }
  }
  std::printf(" others (%d); least %.3f\n", others, least);
  return least;
}

// Sines of random size on the line.
Guess waves(std::mt19937_64& random) {
  std::array<double, 4> a;
  for (double& size : a) size = between(random, -4, 4);
  return [a](double t) {
    const double s = test::kPi * t / 2, r = test::kPi / 2;
    const Eigen::Vector4d x(t / 2 + a[0] / 4 * std::sin(s) + a[1] / 4 * std::sin(2 * s),
                            s + a[2] * std::sin(s) + a[3] * std::sin(2 * s),
                            0.5 + r * (a[0] / 4 * std::cos(s) + a[1] / 2 * std::cos(2 * s)),
                            r * (1 + a[2] * std::cos(s) + 2 * a[3] * std::cos(2 * s)));
    return Stage<double>{t, x, {}, Eigen::VectorXd::Zero(1)};
  };
}

// Each point of 40 intervals of 2 s and each of their middles for itself.  All is drawn here: a guess is called as often as
// a solve likes.
Guess noise(std::mt19937_64& random, const Eigen::Vector4d& sizes, double force) {
  std::vector<Stage<double>> stages;
  for (int i = 0; i <= 80; ++i) {
    Eigen::Vector4d x;
    for (Eigen::Index k = 0; k < 4; ++k) x[k] = between(random, -sizes[k], sizes[k]);
    stages.push_back({i / 40., x, {}, Eigen::VectorXd::Constant(1, between(random, -force, force))});
  }
  return [stages](double t) { return stages.at(std::size_t(std::lround(40 * t))); };
}

// 6 N are too little, wherever the search begins.
TEST_P(FullOptima, NoStartSwingsTheCartPoleUpWithSixNewtons) {
  const auto found = from_random_starts(swing_up(0, 6), 100, 7, GetParam(), waves);
  for (const auto& [end, count] : found) {
    std::printf("%s: %d of 100 (seed 7)\n", end.c_str(), count);
    EXPECT_FALSE(std::isdigit(end[0])) << end;
  }
}

TEST_P(FullOptima, CartPoleFromRandomStarts) {
  const auto draw = [](std::mt19937_64& random) { return noise(random, {2, 4, 5, 10}, 20); };
  for (const bool is_noise : {false, true}) {
    constexpr unsigned kSeed = 7;
    const auto found = is_noise ? from_random_starts(swing_up(), 100, kSeed, GetParam(), draw)
                                : from_random_starts(swing_up(), 100, kSeed, GetParam(), waves);
    EXPECT_NEAR(least_of(found, is_noise ? "noise" : "waves", kSeed), 57.945, 1e-9);
    const auto count = [&](const char* cost) { return found.count(cost) ? found.at(cost) : 0; };
    EXPECT_GT(count("57.945"), 0);
    EXPECT_GT(count("58.808"), 0);
    EXPECT_GT(count("57.945") + count("58.808") + count("303.300"), 40);
  }
}

TEST_P(FullOptima, NothingIsLowerThanBasinEOfTheAcrobot) {
  constexpr unsigned kSeed = 11;
  const auto draw = [](std::mt19937_64& random) { return noise(random, {4, 4, 5, 5}, 5); };
  const auto found = from_random_starts(test::acrobot_c(), 150, kSeed, GetParam(), draw);
  EXPECT_GE(least_of(found, "acrobot", kSeed), 17.180 - 1e-9);  // that of basin E, which few starts lead to
  EXPECT_GT(found.count("34.874"), 0);
}

// J. Betts, Practical methods for optimal control (2010): 2030.85609.  Between narrow ridges |y|^2 lies near zero, so that the optimum is
// nearly flat where y turns around.
Problem alp_rider() {
  Problem p("alp rider", {"y1", "y2", "y3", "y4"}, {"u1", "u2"}, 20, [](const auto& s) {
    return vector(-10.0 * s.x[0] + s.u[0] + s.u[1], -2.0 * s.x[1] + s.u[0] + 2.0 * s.u[1],
                  -3.0 * s.x[2] + 5.0 * s.x[3] + s.u[0] - s.u[1],
                  5.0 * s.x[2] - 3.0 * s.x[3] + s.u[0] + 3.0 * s.u[1]);
  });
  p.add(running_cost("cost", [](const auto& s) {
    return std::decay_t<decltype(s.x[0])>(100.0 * s.x.squaredNorm() + 0.01 * s.u.squaredNorm());
  }));
  p.add(path_inequality(
      "ridge",
      [](const auto& s) {
        using std::exp;
        using T = std::decay_t<decltype(s.x[0])>;
        const T t = s.t;
        const auto bump = [&](double height, double middle, double width) {
          return T(height * exp(-width * (t - middle) * (t - middle)));
        };
        return vector(
            T(s.x.squaredNorm() - bump(3, 3, 12) - bump(3, 6, 10) - bump(3, 10, 6) - bump(8, 15, 4) - 0.01));
      },
      Eigen::VectorXd::Zero(1), Eigen::VectorXd::Constant(1, HUGE_VAL)));
  p.start << 2, 1, 2, 1;
  p.goal << 2, 3, 1, -2;
  return p;
}

TEST_P(FullOptima, TheAlpRider) {
  SolveOptions options;
  options.solver.method = GetParam();
  options.mesh.evaluation.route = Route::kInterpreter;
  const Solution s = solve(alp_rider(), options);
  EXPECT_TRUE(s.converged()) << s.verdict();
  EXPECT_NEAR(s.cost(), 2030.85609, 2e-3 * 2030.85609);
  EXPECT_LE(s.cost_change, options.cost_change);
  EXPECT_LE(s.iterations(), 2000);
  const auto settled = std::count_if(s.meshes.begin(), s.meshes.end(),
                                     [](const MeshRound& m) { return m.status == SolveStatus::kSettled; });
  EXPECT_GE(settled, 3);
  EXPECT_EQ(s.meshes.back().status, SolveStatus::kSolved);
  options.solver.max_iterations = 60;  // the first mesh has settled by then, the last one has not
  const Solution limited = solve(alp_rider(), options);
  EXPECT_FALSE(limited.success());
  EXPECT_EQ(limited.nlp.status, SolveStatus::kIterationLimit);
}

}  // namespace
}  // namespace dyntape
