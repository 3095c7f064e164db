// SPDX-License-Identifier: BSD-3-Clause
//
// Schemes of any number of points: what their tables promise, and that all that knows schemes knows them.
#include <gtest/gtest.h>

#include <Eigen/QR>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/discretize/resampled.h>
#include <dyntape/interface/control/mpc/receding_horizon.h>
#include <dyntape/interface/control/solve/optimise.h>
#include "interface/control/known_problems.h"
#include "interface/message_of.h"

namespace dyntape::scheme_families_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of x = t^k and f = k t^(k-1) on [0, 1]: what the rows lack, and what the quadrature of t^k is off by.
double lacks(const Scheme& s, int k) {
  const VectorXd x = s.c.array().pow(k),
                 f = k == 0 ? VectorXd::Zero(s.points()).eval() : VectorXd(k * s.c.array().pow(k - 1));
  return (s.alpha * x + s.beta * f).cwiseAbs().maxCoeff();
}
double quadrature_error(const Scheme& s, int k) {
  return std::abs(s.gamma.dot(VectorXd(s.c.array().pow(k))) - 1. / (k + 1));
}

TEST(SchemeFamilies, AreExactForPolynomials) {
  for (const int n : {1, 2, 3, 4, 5, 8, 16, 33, 64, 128}) {
    struct Row {
      Scheme scheme;
      int degree, quadrature;  // up to which states, and integrands, are exact
    };
    std::vector<Row> rows = {{radau(n), n, 2 * n - 2}};
    if (n >= 2) rows.push_back({lobatto(n), n, 2 * n - 3});
    if (n >= 3) rows.push_back({pseudospectral(n), n - 1, 2 * n - 3});
    for (const auto& [scheme, degree, quadrature] : rows) {
      for (int k = 0; k <= degree; ++k) EXPECT_LT(lacks(scheme, k), 3e-14) << scheme.name << " " << k;
      for (int k = 0; k <= quadrature; ++k)
        EXPECT_LT(quadrature_error(scheme, k), 3e-15) << scheme.name << " " << k;
      if (n > 8) continue;  // beyond, the next power is as good as exact
      EXPECT_GT(lacks(scheme, degree + 1), 1e-8) << scheme.name;
      EXPECT_GT(quadrature_error(scheme, quadrature + 1), 1e-13) << scheme.name;
    }
  }
}

TEST(SchemeFamilies, BeginWithWhatHasAName) {
  EXPECT_LT((lobatto(2).beta - trapezoid().beta).norm() + (lobatto(2).alpha - trapezoid().alpha).norm(),
            1e-15);
  // The rows of Hermite-Simpson are others of the same space.
  const auto rows = [](const Scheme& s) {
    MatrixXd all(s.rows(), 2 * s.points());
    all << s.alpha, s.beta;
    return all;
  };
  MatrixXd both(4, 6);
  both << rows(lobatto(3)), rows(hermite_simpson());
  EXPECT_EQ(both.colPivHouseholderQr().rank(), 2);
  const Scheme implicit = radau(1);
  EXPECT_EQ(implicit.beta, (MatrixXd(1, 2) << 0, -1).finished());
  EXPECT_FALSE(implicit.uses_first_point());
  EXPECT_TRUE(implicit.uses_last_point());
  EXPECT_EQ(implicit.control_weights(0.3), Eigen::Vector2d(0, 1));
}

TEST(SchemeFamilies, NamesAreRead) {
  for (const Scheme& scheme : test::every_scheme()) EXPECT_EQ(scheme_by_name(scheme.name).c, scheme.c);
  EXPECT_EQ(scheme_by_name("pseudospectral-16").points(), 16);
  const auto said = [](const char* name) { return message_of<ArgumentError>([&] { scheme_by_name(name); }); };
  EXPECT_EQ(said("lobato-5"),
            "there is no scheme \"lobato-5\"; the schemes are euler, trapezoid, hermite-simpson, "
            "hermite-simpson-linear, runge-kutta-4, semi-implicit-euler, lobatto-<points>, radau-<points>, "
            "pseudospectral-<points>, runge-kutta-4x<steps>; did you mean 'lobatto-5'?");
  EXPECT_EQ(scheme_by_name("runge-kutta-4x5").steps, 5);
  EXPECT_EQ(said("runge-kutta-4x0"), "there is no scheme \"runge-kutta-4x0\": expected 1 to 128 steps");
  EXPECT_NE(said("runge-kutta-5").find("did you mean 'runge-kutta-4'?"), std::string::npos);
  EXPECT_NE(said("hermite-simpsn").find("did you mean 'hermite-simpson'?"), std::string::npos);
  EXPECT_EQ(said("lobatto-1"), "there is no scheme \"lobatto-1\": expected 2 to 128 points");
  EXPECT_EQ(said("radau-0"), "there is no scheme \"radau-0\": expected 1 to 128 points");
  EXPECT_EQ(said("pseudospectral-129"),
            "there is no scheme \"pseudospectral-129\": expected 3 to 128 points");
  for (const char* wrong :
       {"", "5", "lobatto", "lobatto-", "lobatto-5x", "lobatto--5", "radau-99999999999", "-3"})
    EXPECT_NE(said(wrong), "nothing thrown") << wrong;
}

// Rows of several intervals all but depend on each other: refused, also of a finer mesh.
TEST(SchemeFamilies, PseudospectralIsOfOneInterval) {
  const Problem p = test::block_move();
  const auto said = [&](int intervals, std::vector<double> nodes = {}) {
    return message_of<ArgumentError>([&] {
      discretize(p, {.scheme = pseudospectral(16),
                     .intervals = intervals,
                     .nodes = nodes,
                     .evaluation = test::kInterpreted});
    });
  };
  EXPECT_EQ(
      said(2),
      "problem \"block move\": the scheme \"pseudospectral-16\" is of one interval, got 2, on which its "
      "rows all but depend on each other; expected 1 interval and more points, or lobatto-16");
  EXPECT_NE(said(1, {0, 0.5, 1}).find("got 2"), std::string::npos);
  EXPECT_EQ(said(1), "nothing thrown");
  EXPECT_NE(said(0).find("at least one interval"), std::string::npos);
  const StagedNlp one =
      discretize(p, {.scheme = pseudospectral(8), .intervals = 1, .evaluation = test::kInterpreted});
  EXPECT_NE(message_of<ArgumentError>([&] {
              discretize(one, {0, 0.5, 1});
            }).find("is of one interval"),
            std::string::npos);
  for (const Scheme& scheme : test::every_scheme()) EXPECT_EQ(scheme.fault_on(100), "") << scheme.name;
}

// A pendulum that nobody drives: the state at the end, beside that of an integrator of order 8.
TEST(SchemeFamilies, HaveTheirOrders) {
  Problem p("pendulum", {"th", "w"}, {"u"}, 2.0, [](const auto& s) {
    using std::sin;
    return vector(s.x[1], std::decay_t<decltype(s.t)>(-4.0 * sin(s.x[0])));
  });
  p.add(running_squares("none", [](const auto& s) { return s.u; }));
  p.start << 1.2, 0.3;
  const VectorXd exact =
      simulate(
          p, p.start, 0, p.duration, [](double) { return VectorXd::Zero(1).eval(); }, 1e-14)
          .x;
  struct Row {
    Scheme scheme;
    int intervals;
  };
  for (const auto& [scheme, n] : {Row{euler(), 200},
                                  {trapezoid(), 40},
                                  {hermite_simpson(), 16},
                                  {lobatto(2), 40},
                                  {lobatto(3), 16},
                                  {lobatto(4), 6},
                                  {lobatto(5), 4},
                                  {radau(1), 200},
                                  {radau(2), 40},
                                  {radau(3), 8},
                                  {radau(4), 5},
                                  {runge_kutta_4(1), 16},
                                  {runge_kutta_4(3), 6},
                                  {scheme_by_name("semi-implicit-euler"), 200}}) {
    double error[2];
    for (int i = 0; i < 2; ++i) {
      const test::Solved s = test::solve_on(p, {.scheme = scheme, .intervals = n << i},
                                            {.method = NlpMethod::kRiccati, .tolerance = 1e-12});
      ASSERT_TRUE(s.success()) << scheme.name;
      error[i] = (s.motion.x.rightCols(1) - exact).norm();
    }
    const double order = std::log2(error[0] / error[1]);
    std::printf("%s: order %.2f, off by %.1e on %d intervals\n", scheme.name.c_str(), order, error[0], n);
    EXPECT_NEAR(order, scheme.order, 0.1 * scheme.order) << scheme.name;
  }
}

bool is_exact_for_cubics(const Scheme& scheme) { return scheme.order >= 4 && !scheme.step; }

// Both forms by both solvers: one optimum, and where states are cubic and controls linear the one there is.
TEST(SchemeFamilies, BlockMoveInBothForms) {
  std::vector<Scheme> all = test::every_scheme();
  for (const Scheme& scheme : {radau(2), radau(4), pseudospectral(8)}) all.push_back(scheme);
  for (const Scheme& scheme : all) {
    const bool is_long = scheme.name.front() == 'p';
    std::vector<double> costs;
    for (const bool inverse : {false, true}) {
      Problem p = test::block_move();
      if (inverse && scheme.step) continue;
      if (inverse) {
        p.rate = [](const auto& s) { return vector(s.x[1], s.a[0]); };
        p.use_accelerations(
            {"a"}, [](const auto& s) { return s.u[0] - s.a[0]; }, p.ode);
      }
      for (const NlpMethod method : {NlpMethod::kIpopt, NlpMethod::kRiccati}) {
        const Solution s = optimise(
            p, {.mesh = {.scheme = scheme, .intervals = is_long ? 1 : 8, .evaluation = test::kInterpreted},
                .solver = {.method = method, .tolerance = 1e-10}});
        ASSERT_TRUE(s.converged()) << scheme.name << " " << inverse << to_string(s.nlp.status);
        EXPECT_LT(s.verification.violation, 1e-9) << scheme.name;
        EXPECT_NEAR(s.verification.cost, s.cost(), 1e-9) << scheme.name;
        costs.push_back(s.cost());
        if (!is_exact_for_cubics(scheme)) continue;
        EXPECT_NEAR(s.cost(), 12, 1e-9) << scheme.name;
        EXPECT_LT(s.verification.worst_defect, 1e-9) << scheme.name;
        EXPECT_LT(s.verification.miss, 1e-9) << scheme.name;
        for (int i = 0; i < s.motion.points(); ++i)
          EXPECT_NEAR(s.motion.u(0, i), 6 - 12 * s.motion.t[i], 1e-6);
        const double h = 1. / s.motion.intervals();
        EXPECT_NEAR(s.motion.control(0, 0.3)[0], 6 - 12 * 0.3 * h, 1e-6) << scheme.name;
      }
    }
    for (const double cost : costs) EXPECT_NEAR(cost, costs[0], 1e-9) << scheme.name;
    const double n = 8;
    if (scheme.name == "radau-1" || scheme.name == "runge-kutta-4") {
      EXPECT_NEAR(costs[0], 12 * n * n / (n * n - 1), 1e-9);
    }
  }
}

// 12 d^2 / T^3 + w T is least at T^4 = 36 d^2 / w.
TEST(SchemeFamilies, FreeDuration) {
  Problem p = test::block_move(1.5);
  p.add(minimum_time(4));
  p.free_duration(0.2, 10);
  for (const Scheme& scheme : {lobatto(4), lobatto(5), radau(3), radau(5)}) {
    for (const NlpMethod method : {NlpMethod::kIpopt, NlpMethod::kRiccati}) {
      const test::Solved s =
          test::solve_on(p, {.scheme = scheme, .intervals = 4}, {.method = method, .tolerance = 1e-10});
      ASSERT_TRUE(s.success()) << scheme.name;
      EXPECT_NEAR(s.duration(), std::pow(36 * 2.25 / 4, 0.25), 1e-7) << scheme.name;
      const Verification v = verify(p, s.motion);
      EXPECT_LT(v.violation, 1e-7);
      EXPECT_LT(v.miss, 1e-7);
    }
  }
}

// A path row and limits in force, the first point of a Radau mesh having none.
TEST(SchemeFamilies, LimitsAndPathRows) {
  for (const Scheme& scheme : test::every_scheme()) {
    Problem p = test::block_move();
    p.u.lower[0] = -5.7, p.u.upper[0] = 8;
    p.add(path_inequality(
        "speed", [](const auto& s) { return vector(s.x[1], s.u[0] + s.x[1]); }, VectorXd::Constant(2, -10.),
        Eigen::Vector2d(1.4, 5.5)));
    double cost = 0;
    for (const NlpMethod method : {NlpMethod::kIpopt, NlpMethod::kRiccati}) {
      const Solution s =
          optimise(p, {.mesh = {.scheme = scheme, .intervals = 30, .evaluation = test::kInterpreted},
                       .solver = {.method = method, .tolerance = 1e-10}});
      ASSERT_TRUE(s.converged()) << scheme.name << " " << to_string(s.nlp.status);
      EXPECT_LT(s.verification.violation, 1e-8) << scheme.name << " " << s.verification.worst_row;
      EXPECT_NEAR(s.cost(), 12.3117, is_exact_for_cubics(scheme) ? 1e-3 : 0.1) << scheme.name;
      if (cost > 0) {
        EXPECT_NEAR(s.cost(), cost, 1e-7) << scheme.name;
      }
      cost = s.cost();
    }
  }
}

// Three phases by three schemes.
TEST(SchemeFamilies, InPhases) {
  const auto part = [](double duration) {
    Problem p = test::block_move(1, duration);
    p.start.setConstant(Problem::kFree), p.goal.setConstant(Problem::kFree);
    return p;
  };
  Phases phases("move");
  Problem first = part(0.3), last = part(0.2);
  first.start << 0, 0, last.goal << 1, 0;
  phases.add("first", first), phases.add("second", part(0.5)), phases.add("third", last);
  for (const NlpMethod method : {NlpMethod::kIpopt, NlpMethod::kRiccati}) {
    const Solution s =
        optimise(phases, {.meshes = {{.scheme = radau(3), .intervals = 2, .evaluation = test::kInterpreted},
                                     {.scheme = lobatto(5), .intervals = 1, .evaluation = test::kInterpreted},
                                     {.scheme = radau(4), .intervals = 3, .evaluation = test::kInterpreted}},
                          .solver = {.method = method, .tolerance = 1e-10}});
    ASSERT_TRUE(s.success());
    EXPECT_NEAR(s.cost(), 12, 1e-8);
    EXPECT_LT(s.verification.violation, 1e-8) << s.verification.worst_row;
  }
}

// The motion on a finer mesh of the same functions is nearly solved.
TEST(SchemeFamilies, MeshesAreRefined) {
  for (const Scheme& scheme : {lobatto(5), radau(4)}) {
    StagedNlp coarse =
        discretize(test::swing_up(), {.scheme = scheme, .intervals = 20, .evaluation = test::kInterpreted});
    const OptimiseOptions options{.solver = {.method = NlpMethod::kRiccati}};
    const Solution before = optimise(coarse, coarse.start(), options);
    StagedNlp finer = discretize(coarse, halved(before.motion));
    const Solution after =
        optimise(finer, finer.variables(resampled(test::swing_up(), before.motion, finer.times())), options);
    ASSERT_TRUE(before.success() && after.success());
    EXPECT_LE(after.nlp.iterations(), 10) << scheme.name;
    EXPECT_EQ(after.motion.intervals(), 40);
    EXPECT_NEAR(after.cost(), 58.8076674582, 1e-5) << scheme.name;
    EXPECT_LT(after.verification.worst_defect, before.verification.worst_defect / 16) << scheme.name;
  }
}

// A plan goes on where the plant is on the last one: nearly nothing is left to do.
TEST(SchemeFamilies, PlansMoveOn) {
  Problem p = test::block_move();
  p.goal.setConstant(Problem::kFree);
  p.terms = {running_squares("near", [](const auto& s) { return vector(s.x[0] - 1.0, 0.1 * s.x[1]); }),
             running_squares("effort", [](const auto& s) { return (0.1 * s.u).eval(); })};
  p.u.lower[0] = -8, p.u.upper[0] = 8;
  for (const Scheme& scheme : test::every_scheme()) {
    RecedingHorizon mpc(p, {.mesh = {.scheme = scheme,
                                     .intervals = 10,
                                     .hessian = HessianKind::kGaussNewton,
                                     .evaluation = test::kInterpreted}});
    VectorXd x = VectorXd::Zero(2);
    for (int k = 0; k < 20; ++k) {
      const MpcStep& s = mpc.step(0.1 * k, x);
      ASSERT_TRUE(s.usable) << scheme.name << " " << k;
      ASSERT_EQ(s.status, SolveStatus::kSolved) << scheme.name << " " << k;
      EXPECT_LE(s.iterations, k == 0 ? 30 : 10) << scheme.name << " " << k;
      x = s.plan.motion.x.col(s.plan.motion.node(1));
    }
    EXPECT_NEAR(x[0], 1, 0.05) << scheme.name;
  }
}

}  // namespace
}  // namespace dyntape::scheme_families_test
