// SPDX-License-Identifier: BSD-3-Clause
//
// The program that collocation makes: derivatives, patterns, names, and what it allocates.
#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <new>
#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/ipopt/ipopt.h>
#include <dyntape/interface/control/riccati/interior_point.h>
#include <dyntape/interface/control/solve/optimise.h>
#include "interface/control/ocp_problems.h"

namespace {
std::atomic<long> allocations{0};
}

// Every allocation of C++ in this program is counted.  Out of line, or gcc sees malloc's memory deleted.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* p = std::malloc(size == 0 ? 1 : size)) return p;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* p) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept { std::free(p); }

namespace dyntape::ocp_structure_test {
namespace {

// The cart-pole with a term of every kind.
Problem with_every_kind_of_term() {
  Problem p = test::swing_up(1.0);
  p.add(running_cost("timed", [](const auto& s) { return s.t * s.x[0] * s.u[0]; }));
  p.add(path_inequality(
      "power", [](const auto& s) { return s.u[0] * s.x[2]; }, Eigen::VectorXd::Constant(1, -40.),
      Eigen::VectorXd::Constant(1, 40.)));
  p.add(path_equality("zero", [](const auto& s) { return (s.x[0] - s.x[0] * s.x[0]) * (s.x[1] - s.t); }));
  p.add(terminal_cost("end", [](const auto& s) {
    using std::cos;
    return cos(s.x[1]) * s.x[3] + s.u[0] * s.u[0] * s.x[0];
  }));
  p.add(terminal_inequality(
      "tip", [](const auto& s) { return vector(s.x[0] * s.x[1], s.u[0] + s.x[2] * s.x[2]); },
      Eigen::Vector2d(-9, -9), Eigen::Vector2d(9, 9)));
  p.add(terminal_squares("rest", [](const auto& s) { return s.x.tail(2).eval(); }));
  return p;
}

// The block with its acceleration as a variable: x' = (v, a), u - m a = 0 with m = 2, a bound in every group.
Problem inverse_form() {
  Problem p("inverse block", {"p", "v"}, {"u"}, 1.0, [](const auto& s) { return vector(s.x[1], s.a[0]); });
  p.use_accelerations(
      {"a"}, [](const auto& s) { return s.u[0] - 2.0 * s.a[0]; },
      [](const auto& s) {
        return vector(s.x[1], typename std::decay_t<decltype(s.x)>::Scalar(s.u[0] / 2.0));
      });
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));
  p.start << 0, 0;
  p.goal << 1, 0;
  return p;
}

std::vector<double> random_point(const StagedNlp& nlp, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> x = nlp.start();
  for (double& v : x) v += 0.3 * normal(random);
  return x;
}

class EveryScheme : public ::testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Collocation, EveryScheme,
                         ::testing::Values("euler", "trapezoid", "hermite-simpson", "hermite-simpson-linear",
                                           "lobatto-5", "radau-1", "radau-3", "pseudospectral-5",
                                           "runge-kutta-4", "semi-implicit-euler", "runge-kutta-4x3"),
                         [](auto info) {
                           std::replace(info.param.begin(), info.param.end(), '-', '_');
                           return info.param;
                         });

TEST_P(EveryScheme, DerivativesAreThoseOfTheFunctions) {
  const Scheme scheme = scheme_by_name(GetParam());
  for (Problem problem : {with_every_kind_of_term(), scheme.step ? test::block_move() : inverse_form()}) {
    if (scheme.step) problem.duration /= 10;  // what long steps curve differences do not resolve
    std::vector<double> nodes{0, 0.3 * problem.duration, 0.4 * problem.duration, problem.duration};
    if (scheme.spans_all) nodes = {0, problem.duration};
    StagedNlp nlp = discretize(problem, {.scheme = scheme, .nodes = nodes, .evaluation = test::kInterpreted});
    for (unsigned seed = 1; seed <= 3; ++seed) {
      const DerivativeCheck check = check_derivatives(nlp, random_point(nlp, seed), {.seed = seed});
      EXPECT_TRUE(check.good()) << problem.name << ", seed " << seed << ": " << check.mismatches[0].row
                                << " by " << check.mismatches[0].variable << ": " << check.mismatches[0].given
                                << " or " << check.mismatches[0].difference;
      EXPECT_LT(check.worst_first, 1e-9) << seed;
      EXPECT_LT(check.worst_second, 1e-8) << seed;
    }
  }
}

// A place is in the pattern exactly where a random point has a non-zero derivative.
TEST_P(EveryScheme, PatternsAreExact) {
  Problem problem = test::swing_up(1.0);
  problem.add(terminal_cost("end", [](const auto& s) { return s.x[0] * s.u[0] * s.u[0]; }));
  const Scheme scheme = scheme_by_name(GetParam());
  const int n = scheme.spans_all ? 1 : 3;
  StagedNlp nlp = discretize(problem, {.scheme = scheme, .intervals = n, .evaluation = test::kInterpreted});
  const NlpShape& shape = nlp.shape();
  const std::vector<double> x = random_point(nlp, 7);
  std::vector<double> lambda(shape.m(), 0.0);
  for (std::size_t j = 0; j < shape.m(); ++j) lambda[j] = std::cos(3.0 * static_cast<double>(j) + 1);
  // Dense differences of g and of the gradient of the Lagrangian.
  const auto lagrangian = [&](const std::vector<double>& at) {
    std::vector<double> gradient(shape.n()), jacobian(shape.jacobian.nnz());
    EXPECT_TRUE(nlp.gradient(at.data(), gradient.data()) && nlp.jacobian(at.data(), jacobian.data()));
    for (std::size_t k = 0; k < jacobian.size(); ++k) {
      gradient[shape.jacobian.col[k]] += lambda[shape.jacobian.row[k]] * jacobian[k];
    }
    return gradient;
  };
  std::vector<std::vector<bool>> in_jacobian(shape.m(), std::vector<bool>(shape.n())), in_hessian(shape.n());
  for (auto& row : in_hessian) row.resize(shape.n());
  for (std::size_t k = 0; k < shape.jacobian.nnz(); ++k)
    in_jacobian[shape.jacobian.row[k]][shape.jacobian.col[k]] = true;
  for (std::size_t k = 0; k < shape.hessian.nnz(); ++k)
    in_hessian[shape.hessian.row[k]][shape.hessian.col[k]] = true;
  std::size_t surplus = 0, missing = 0;
  for (std::size_t j = 0; j < shape.n(); ++j) {
    std::vector<double> up = x, down = x, g_up(shape.m()), g_down(shape.m());
    up[j] += 1e-4;
    down[j] -= 1e-4;
    EXPECT_TRUE(nlp.constraints(up.data(), g_up.data()) && nlp.constraints(down.data(), g_down.data()));
    for (std::size_t i = 0; i < shape.m(); ++i) {
      const bool non_zero = std::abs(g_up[i] - g_down[i]) > 1e-12;
      missing += non_zero && !in_jacobian[i][j];
      surplus += !non_zero && in_jacobian[i][j];
    }
    const std::vector<double> l_up = lagrangian(up), l_down = lagrangian(down);
    for (std::size_t i = j; i < shape.n(); ++i) {
      const bool non_zero = std::abs(l_up[i] - l_down[i]) > 1e-11;
      missing += non_zero && !in_hessian[i][j];
      surplus += !non_zero && in_hessian[i][j];
    }
  }
  EXPECT_TRUE(missing == 0 && surplus == 0) << missing << " " << surplus;
}

TEST(Collocation, PatternsAreSortedAndHaveEachPlaceOnce) {
  StagedNlp nlp = discretize(with_every_kind_of_term(), {.intervals = 4, .evaluation = test::kInterpreted});
  for (const Pattern* pattern : {&nlp.shape().jacobian, &nlp.shape().hessian}) {
    for (std::size_t k = 1; k < pattern->nnz(); ++k) {
      const auto before = std::pair(pattern->row[k - 1], pattern->col[k - 1]);
      EXPECT_LT(before, std::pair(pattern->row[k], pattern->col[k]));
    }
  }
}

TEST(Collocation, GaussNewtonIsTwiceTheSquareOfTheJacobianOfTheResiduals) {
  // For linear residuals and dynamics it is the exact Hessian.
  Problem problem = test::block_move();
  problem.add(running_squares("tracking", [](const auto& s) { return (s.x * 3.0 + s.x.reverse()).eval(); }));
  problem.add(terminal_squares("end", [](const auto& s) { return (s.x[0] - 2.0 * s.x[1]); }));
  MeshOptions mesh{.intervals = 3, .evaluation = test::kInterpreted};
  StagedNlp exact = discretize(problem, mesh);
  mesh.hessian = HessianKind::kGaussNewton;
  StagedNlp squares = discretize(problem, mesh);
  ASSERT_EQ(exact.shape().hessian, squares.shape().hessian);
  const std::vector<double> x = random_point(exact, 3), lambda(exact.shape().m(), 1.0);
  std::vector<double> a(exact.shape().hessian.nnz()), b(a.size());
  ASSERT_TRUE(exact.hessian(x.data(), 1.5, lambda.data(), a.data()));
  ASSERT_TRUE(squares.hessian(x.data(), 1.5, lambda.data(), b.data()));
  for (std::size_t k = 0; k < a.size(); ++k) EXPECT_NEAR(a[k], b[k], 1e-13) << k;
}

// By each route and with each kind of Hessian, from the first evaluation on.
TEST(Collocation, EvaluationsAllocateNothing) {
  const auto cache = std::filesystem::temp_directory_path() / ("dyntape-ocp-" + std::to_string(getpid()));
  for (Route route : {Route::kInterpreter, Route::kAutomatic}) {
    for (HessianKind kind : {HessianKind::kExact, HessianKind::kGaussNewton}) {
      StagedNlp nlp = discretize(
          test::swing_up(1.0),
          {.intervals = 20, .hessian = kind, .evaluation = {.route = route, .cache_folder = cache.string()}});
      std::vector<std::vector<double>> points;
      for (unsigned seed = 0; seed < 5; ++seed) points.push_back(random_point(nlp, seed));
      std::vector<double> gradient(nlp.shape().n()), g(nlp.shape().m()), lambda(g.size(), 0.5);
      std::vector<double> jacobian(nlp.shape().jacobian.nnz()), hessian(nlp.shape().hessian.nnz());
      double value = 0;
      const long before = allocations;
      for (const std::vector<double>& x : points) {
        ASSERT_TRUE(nlp.objective(x.data(), value) && nlp.constraints(x.data(), g.data()) &&
                    nlp.gradient(x.data(), gradient.data()) && nlp.jacobian(x.data(), jacobian.data()) &&
                    nlp.hessian(x.data(), 1, lambda.data(), hessian.data()));
      }
      EXPECT_EQ(allocations - before, 0);
    }
  }
  std::filesystem::remove_all(cache);
}

TEST(Collocation, NamesVariablesAndConstraints) {
  StagedNlp nlp = discretize(with_every_kind_of_term(),
                             {.scheme = trapezoid(), .intervals = 4, .evaluation = test::kInterpreted});
  EXPECT_EQ(nlp.variable_name(0), "p at point 0 (t = 0 s)");
  EXPECT_EQ(nlp.variable_name(9), "u at point 1 (t = 0.5 s)");
  EXPECT_EQ(nlp.constraint_name(5), "defect of th in interval 1");
  EXPECT_EQ(nlp.constraint_name(16), "power at point 0 (t = 0 s)");
  EXPECT_EQ(nlp.constraint_name(nlp.shape().m() - 1), "tip[1] at the end");
}

TEST(Collocation, RefusesWhatDoesNotFit) {
  const auto message = [](const Problem& problem, const MeshOptions& mesh) {
    try {
      StagedNlp nlp = discretize(problem, mesh);
    } catch (const ArgumentError& e) {
      return std::string(e.what());
    }
    return std::string("nothing thrown");
  };
  Problem p = test::block_move();
  EXPECT_NE(message(p, {.intervals = 0, .evaluation = test::kInterpreted}).find("at least one interval"),
            std::string::npos);
  EXPECT_NE(message(p, {.nodes = {0, 0.5, 0.5, 1}, .evaluation = test::kInterpreted}).find("increasing"),
            std::string::npos);
  const Problem stateless("none", {}, {"u"}, 1, StageFunction([](const auto& s) { return s.x; }));
  EXPECT_NE(message(stateless, {}).find("there are no states; expected one or more"), std::string::npos);
  p.start.resize(3);
  EXPECT_NE(message(p, {}).find("the start has 3 entries, expected 2"), std::string::npos);
  p = test::block_move();
  p.x.upper[0] = 0.5;
  EXPECT_NE(message(p, {}).find("the goal of \"p\" is 1"), std::string::npos);
  p = test::block_move();
  p.add(running_cost("two", [](const auto& s) { return s.x; }));
  EXPECT_NE(message(p, {}).find("\"two\" has 2 entries, expected a scalar"), std::string::npos);
  p = test::block_move();
  p.add(running_cost("plain", [](const auto& s) { return s.x[0]; }));
  EXPECT_NE(message(p, {.hessian = HessianKind::kGaussNewton, .evaluation = test::kInterpreted})
                .find("\"plain\" is a plain cost"),
            std::string::npos);
  p = test::block_move();
  p.add(path_inequality(
      "box", [](const auto& s) { return s.x; }, Eigen::VectorXd::Zero(1), Eigen::VectorXd::Ones(1)));
  EXPECT_NE(message(p, {}).find("\"box\" has 2 entries, its bounds have 1 and 1"), std::string::npos);
}

// Bounds without room are refused where they stand: on states, controls, path and end terms.
TEST(Collocation, RefusesBoundsThatAreEmpty) {
  const double infinity = std::numeric_limits<double>::infinity();
  const auto message = [](const Problem& problem) {
    try {
      StagedNlp nlp = discretize(problem, {.intervals = 2, .evaluation = test::kInterpreted});
    } catch (const ArgumentError& e) {
      return std::string(e.what());
    }
    return std::string("nothing thrown");
  };
  const auto all = [](double value) { return Eigen::VectorXd::Constant(2, value); };
  const auto position = [](const auto& s) { return s.x; };
  const std::pair<double, double> empty[] = {
      {1, -1}, {std::nan(""), 1}, {0, std::nan("")}, {infinity, infinity}, {-infinity, -infinity}};
  for (const auto& [lower, upper] : empty) {
    Problem path = test::block_move(), end = path, state = path, control = path;
    path.add(path_inequality("box", position, all(lower), all(upper)));
    EXPECT_NE(message(path).find("the bounds of term \"box[0]\" are empty"), std::string::npos) << lower;
    end.add(terminal_inequality("tip", position, all(lower), all(upper)));
    EXPECT_NE(message(end).find("the bounds of term \"tip[0]\" are empty"), std::string::npos) << lower;
    state.x = {all(lower), all(upper)};
    EXPECT_NE(message(state).find("the bounds of \"p\" are empty"), std::string::npos) << lower;
    control.u = {all(lower).head(1), all(upper).head(1)};
    EXPECT_NE(message(control).find("the bounds of \"u\" are empty"), std::string::npos) << lower;
  }
  Problem open = test::block_move();
  open.add(path_inequality("box", position, all(-infinity), all(infinity)));
  EXPECT_EQ(message(open), "nothing thrown");
}

// What is no number is refused with a sentence of its own, not as a wrong derivative.
TEST(Collocation, RefusesAStartThatIsNoNumber) {
  const auto message = [](const auto& act) {
    try {
      act();
    } catch (const ArgumentError& e) {
      return std::string(e.what());
    }
    return std::string("nothing thrown");
  };
  const MeshOptions mesh{.intervals = 2, .evaluation = test::kInterpreted};
  StagedNlp nlp = discretize(test::block_move(), mesh);
  for (double bad : {std::nan(""), HUGE_VAL}) {
    std::vector<double> start = nlp.start();
    start[3] = bad;
    EXPECT_NE(message([&] { optimise(nlp, start, {}); }).find("the start of p at point 1 (t = 0.25 s) is "),
              std::string::npos);
  }
  Problem from = test::block_move(), to = from;
  from.start[0] = -HUGE_VAL;
  EXPECT_NE(message([&] { discretize(from, mesh); }).find("the start of \"p\" is -inf, expected a number"),
            std::string::npos);
  to.goal[1] = HUGE_VAL;
  EXPECT_NE(message([&] { discretize(to, mesh); }).find("the goal of \"v\" is inf, expected a number"),
            std::string::npos);
}

// Durations and intervals for which duration * k / k is not the duration.
TEST(Collocation, MeshesEndAtTheDurationWhateverRoundingDoes) {
  std::mt19937_64 random(17);
  std::uniform_real_distribution<double> decades(-3, 3);
  Problem p = test::block_move();
  for (int trial = 0; trial < 10000; ++trial) {
    const int intervals = 1 + static_cast<int>(random() % 300);
    p.duration = trial % 2 ? std::pow(10, decades(random)) : static_cast<double>(1 + random() % 100) / 10;
    const std::vector<double> even = node_times(p, {.intervals = intervals});
    ASSERT_EQ(even.size(), std::size_t(intervals) + 1) << "seed 17, trial " << trial;
    ASSERT_EQ(even.back(), p.duration) << "seed 17, trial " << trial;
    std::vector<double> summed = {0};
    for (int k = 0; k < intervals; ++k) summed.push_back(summed.back() + p.duration / intervals);
    ASSERT_EQ(node_times(p, {.nodes = summed}).back(), p.duration) << "seed 17, trial " << trial;
  }
  for (const auto& [duration, intervals] : {std::pair{0.8, 24}, {0.9, 36}, {0.7, 48}}) {
    StagedNlp nlp =
        discretize(test::block_move(1, duration), {.intervals = intervals, .evaluation = test::kInterpreted});
    EXPECT_EQ(nlp.times().back(), duration);
  }
  p.duration = 1;
  for (const std::vector<double>& nodes :
       {std::vector<double>{0, std::nan(""), 1}, {0, 0.5, 0.999}, {0.1, 1}, {0, 1, 1}, {0}}) {
    EXPECT_THROW(node_times(p, {.nodes = nodes}), ArgumentError);
  }
}

// The kind of Hessian is the program's, whatever the options of the call say.
TEST(Collocation, KnowsItsKindOfHessian) {
  for (HessianKind kind : {HessianKind::kLimitedMemory, HessianKind::kGaussNewton, HessianKind::kExact}) {
    StagedNlp nlp =
        discretize(test::swing_up(), {.intervals = 20, .hessian = kind, .evaluation = test::kInterpreted});
    EXPECT_THROW(optimise(nlp, {1, 2, 3}, {}), ArgumentError);
    const Solution s = optimise(nlp, nlp.start(), {.solver = {.try_other_method = false}, .verify = false});
    EXPECT_NEAR(s.cost(), 58.70267, 1e-4) << int(kind);
    const bool is_limited = kind == HessianKind::kLimitedMemory;
    const NlpSolution direct = (is_limited ? solve_with_ipopt : solve_with_riccati)(nlp, nlp.start(), {});
    EXPECT_EQ(direct.x, s.nlp.x) << int(kind);
  }
}

// A program that lies about one derivative is found out, by name.
class Liar : public StagedNlp {
 public:
  Liar(bool first, bool second)
      : StagedNlp(discretize(test::swing_up(), {.intervals = 5, .evaluation = test::kInterpreted})),
        first_(first),
        second_(second) {}
  bool jacobian(const double* x, double* nonzeros) override {
    const bool good = StagedNlp::jacobian(x, nonzeros);
    if (first_) nonzeros[40] += 1e-3;
    return good;
  }
  bool hessian(const double* x, double sigma, const double* lambda, double* nonzeros) override {
    const bool good = StagedNlp::hessian(x, sigma, lambda, nonzeros);
    if (second_) nonzeros[17] += 1e-3;
    return good;
  }

 private:
  bool first_, second_;
};

TEST(DerivativeCheck, NamesAWrongEntry) {
  Liar honest(false, false), first(true, false), second(false, true);
  EXPECT_TRUE(check_derivatives(honest, honest.start()).good());
  const DerivativeCheck a = check_derivatives(first, first.start(), {.second_order = false});
  ASSERT_EQ(a.mismatches.size(), 1u);
  const NlpShape& shape = first.shape();
  EXPECT_EQ(a.mismatches[0].row, first.constraint_name(shape.jacobian.row[40]));
  EXPECT_EQ(a.mismatches[0].variable, first.variable_name(shape.jacobian.col[40]));
  const DerivativeCheck b = check_derivatives(second, second.start());
  ASSERT_FALSE(b.good());
  EXPECT_EQ(b.mismatches[0].variable.empty(), false);
  EXPECT_NE(b.mismatches[0].row.find("derivative of the Lagrangian by"), std::string::npos);
}

TEST(Kkt, PricesHaveASign) {
  Problem p = test::block_move();
  p.add(path_inequality(
      "from below", [](const auto& s) { return s.x; }, Eigen::Vector2d(-1e3, -1e3),
      Eigen::Vector2d::Constant(HUGE_VAL)));
  StagedNlp nlp = discretize(p, {.intervals = 4, .evaluation = test::kInterpreted});
  const NlpSolution good = solve_with_ipopt(nlp, nlp.start());
  EXPECT_LT(kkt_residuals(nlp, good).complementarity, 1e-5);
  for (const auto& spoil : std::vector<std::function<void(NlpSolution&)>>{
           [](NlpSolution& s) { s.lambda.back() = 3; },            // of a bound that is not there
           [](NlpSolution& s) { s.lower_multiplier[5] = 3; },      // likewise
           [](NlpSolution& s) { s.upper_multiplier[5] = -3; }}) {  // and below zero
    NlpSolution s = good;
    spoil(s);
    EXPECT_GE(kkt_residuals(nlp, s).complementarity, 3);
  }
}

TEST(Kkt, WhatIsNoNumberIsNotOptimal) {
  StagedNlp nlp = discretize(test::block_move(), {.intervals = 4, .evaluation = test::kInterpreted});
  const NlpSolution good = solve_with_ipopt(nlp, nlp.start());
  ASSERT_LT(kkt_residuals(nlp, good).stationarity, 1e-6);
  for (std::size_t j = 0; j < good.lambda.size(); ++j) {
    NlpSolution s = good;
    s.lambda[j] = std::nan("");
    EXPECT_TRUE(std::isnan(kkt_residuals(nlp, s).stationarity)) << j;
  }
  for (auto bound_multiplier : {&NlpSolution::lower_multiplier, &NlpSolution::upper_multiplier}) {
    NlpSolution s = good;
    (s.*bound_multiplier)[3] = std::nan("");
    EXPECT_TRUE(std::isnan(kkt_residuals(nlp, s).stationarity));
    EXPECT_TRUE(std::isnan(kkt_residuals(nlp, s).complementarity));
  }
  Trajectory motion = nlp.trajectory(good.x);
  motion.u(0, 3) = std::nan("");
  const Verification v = verify(nlp.problem(), motion);
  EXPECT_TRUE(std::isnan(v.violation) && std::isnan(v.worst_defect) && std::isnan(v.miss));
}

TEST(Verification, FindsWhatIsViolatedAndWhatTheSchemeCannotSee) {
  const Problem problem = test::swing_up();
  const Solution s = optimise(problem, {.mesh = {.intervals = 40, .evaluation = test::kInterpreted}});
  ASSERT_TRUE(s.success());
  EXPECT_LT(s.verification.violation, 1e-8);
  EXPECT_NEAR(s.verification.cost, s.cost(), 1e-10);
  EXPECT_LT(s.kkt.stationarity, 1e-7);
  EXPECT_LT(s.kkt.complementarity, 1e-7);
  // Published: 1.36e-2 (problem statement in ocp_problems.h, Hermite-Simpson, quadratic control).
  EXPECT_NEAR(s.verification.miss, 1.36e-2, 2e-4);
  EXPECT_GT(s.verification.worst_defect, 1e-8);
  EXPECT_LT(s.verification.worst_defect, 1e-2);
  Trajectory moved = s.motion;
  moved.x(2, 10) += 0.1;
  const Verification v = verify(problem, moved);
  EXPECT_GT(v.violation, 0.05);
  EXPECT_NE(v.worst_row.find("defect of p"), std::string::npos) << v.worst_row;
  moved = s.motion;
  moved.u(0, 7) = 21;
  EXPECT_NEAR(verify(problem, moved).violation, 1.0, 0.3);
}

TEST(Verification, TheMissFallsWithTheFourthPowerOfTheStep) {
  double previous = 0;
  const std::pair<int, double> known[] = {{80, 8.39e-4}, {160, 5.24e-5}};
  for (const auto& [n, miss] : known) {
    const Solution s = optimise(test::swing_up(), {.mesh = {.intervals = n, .evaluation = test::kInterpreted},
                                                   .solver = {.tolerance = 1e-10}});
    EXPECT_NEAR(s.verification.miss, miss, 0.01 * miss);
    if (previous > 0) {
      EXPECT_NEAR(previous / s.verification.miss, 16, 0.5);
    }
    previous = s.verification.miss;
  }
}

}  // namespace
}  // namespace dyntape::ocp_structure_test
