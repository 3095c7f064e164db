// SPDX-License-Identifier: BSD-3-Clause
//
// Parameters of optimal control problems: what changes in place is what would have been recorded.
#include <gtest/gtest.h>

#include <filesystem>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/interface/control/discretize/resampled.h>
#include <dyntape/interface/control/solve/ddp.h>
#include <dyntape/interface/control/solve/optimise.h>
#include "interface/control/evaluated.h"
#include "interface/control/ocp_problems.h"
#include "interface/message_of.h"
#include "interface/temporary_cache.h"

namespace dyntape::ocp_parameters_test {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::VectorXd;

// What the cart-pole below is told: its load, where it shall go, what pushes it over time, how far it may go.
struct Told {
  double load = 0;
  Vector2d target = {1, 3};
  double push = 0;
  double reach = 2;

  ParameterValue::OfTime pushes() const {
    return [push = push](double t) { return VectorXd::Constant(1, push * std::sin(3 * t)); };
  }
};

const Told kOne, kOther{0.4, {0.7, 2.0}, 0.8, 1.5};

// A term of every kind, dynamics and all read what is told: by the handles of parameters, or as constants.
template <class Load, class Target, class Push, class Reach>
Problem told_problem(Load load, Target target, Push push, Reach reach, bool inverse) {
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
  p.add(running_squares("effort", [](const auto& s) { return (0.1 * s.u).eval(); }));
  p.add(running_squares("near", [=](const auto& s) { return (s.x.head(2) - target(s)).eval(); }));
  p.add(terminal_squares("rest", [=](const auto& s) { return (s.x.head(2) - target(s)).eval(); }));
  p.add(path_inequality(
      "reach", [=](const auto& s) { return reach(s)[0] - s.x[0] * s.x[0]; }, VectorXd::Zero(1),
      VectorXd::Constant(1, HUGE_VAL)));
  p.start << 0, 0, 0, 0;
  p.goal[2] = p.goal[3] = 0;
  return p;
}

Problem with_parameters(const Told& told, bool inverse = false) {
  Parameters parameters;
  const Parameter load = parameters.add("load", told.load), target = parameters.add("target", told.target);
  const Parameter push = parameters.add("push", told.pushes()), reach = parameters.add("reach", told.reach);
  Problem p = told_problem(load, target, push, reach, inverse);
  p.parameters = parameters;
  return p;
}

Problem with_constants(const Told& told, bool inverse = false) {
  const auto constant = [](const VectorXd& value) {
    return [value](const auto& s) {
      return value.template cast<typename std::decay_t<decltype(s.x)>::Scalar>().eval();
    };
  };
  const auto push = [told](const auto& s) {
    using std::sin;
    return vector(told.push * sin(3.0 * s.t));
  };
  return told_problem(constant(VectorXd::Constant(1, told.load)), constant(told.target), push,
                      constant(VectorXd::Constant(1, told.reach)), inverse);
}

void tell(Parameters& parameters, const Told& told) {
  parameters.set("load", told.load);
  parameters.set("target", told.target);
  parameters.set("push", told.pushes());
  parameters.set("reach", told.reach);
}

double difference(const std::vector<double>& a, const std::vector<double>& b) {
  EXPECT_EQ(a.size(), b.size());
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}

std::vector<double> wavy(const StagedNlp& nlp) {
  std::vector<double> x = nlp.start();
  for (std::size_t i = 0; i < x.size(); ++i) x[i] += 0.3 * std::sin(2.0 * double(i));
  return x;
}

class EveryForm : public ::testing::TestWithParam<std::tuple<std::string, bool, HessianKind>> {};
INSTANTIATE_TEST_SUITE_P(
    OcpParameters, EveryForm,
    ::testing::Combine(::testing::Values("euler", "trapezoid", "hermite-simpson", "lobatto-4", "radau-2",
                                         "runge-kutta-4"),
                       ::testing::Bool(), ::testing::Values(HessianKind::kExact, HessianKind::kGaussNewton)));

// The same x is asked for before and after: what was evaluated before has to be forgotten.
TEST_P(EveryForm, ValuesInPlaceAreThoseOfAProgramMadeWithThem) {
  const auto& [scheme, inverse, hessian] = GetParam();
  const MeshOptions mesh{.scheme = scheme_by_name(scheme),
                         .nodes = {0, 0.4, 0.6, 1.5},
                         .hessian = hessian,
                         .evaluation = test::kInterpreted};
  if (inverse && scheme_by_name(scheme).step) {  // steps know the forward form alone
    EXPECT_THROW(discretize(with_parameters(kOne, inverse), mesh), ArgumentError);
    return;
  }
  StagedNlp nlp = discretize(with_parameters(kOne, inverse), mesh),
            made = discretize(with_constants(kOther, inverse), mesh);
  const std::vector<double> x = wavy(nlp);
  const Evaluated before = evaluated(nlp, x);
  Parameters now = nlp.problem().parameters;
  tell(now, kOther);
  nlp.set_parameters(now);
  const Evaluated after = evaluated(nlp, x), expected = evaluated(made, x);
  EXPECT_NEAR(after.cost, expected.cost, 1e-12 * expected.cost);
  EXPECT_GT(std::abs(after.cost - before.cost), 1e-3);
  EXPECT_LT(difference(after.gradient, expected.gradient), 1e-12);
  EXPECT_LT(difference(after.g, expected.g), 1e-12);
  EXPECT_LT(difference(after.jacobian, expected.jacobian), 1e-12);
  EXPECT_LT(difference(after.hessian, expected.hessian), 1e-12);
  EXPECT_GT(difference(after.g, before.g), 1e-3);
  EXPECT_GT(difference(after.gradient, before.gradient), 1e-3);
  tell(now, kOne);
  nlp.set_parameters(now);
  EXPECT_EQ(evaluated(nlp, x).cost, before.cost);
}

TEST_P(EveryForm, DerivativesAreThoseOfTheFunctions) {
  const auto& [scheme, inverse, hessian] = GetParam();
  if (inverse && scheme_by_name(scheme).step) return;  // refused, see above
  StagedNlp nlp = discretize(with_parameters(kOther, inverse), {.scheme = scheme_by_name(scheme),
                                                                .intervals = 3,
                                                                .hessian = hessian,
                                                                .evaluation = test::kInterpreted});
  const DerivativeCheck check = check_derivatives(nlp, wavy(nlp));
  EXPECT_TRUE(check.good());
}

TEST(OcpParameters, ASolutionInPlaceIsThatOfConstants) {
  for (const bool inverse : {false, true}) {
    const MeshOptions mesh{.intervals = 20, .evaluation = test::kInterpreted};
    StagedNlp nlp = discretize(with_parameters(kOne, inverse), mesh);
    const OptimiseOptions options{.mesh = mesh, .solver = {.tolerance = 1e-10}};
    const Solution first = optimise(nlp, nlp.start(), options);
    ASSERT_TRUE(first.converged()) << first.verdict();
    Problem now = nlp.problem();
    tell(now.parameters, kOther);
    nlp.set_values(now);
    const Solution changed = optimise(nlp, nlp.start(), options);
    const Solution constants = optimise(with_constants(kOther, inverse), options);
    ASSERT_TRUE(changed.success() && constants.success());
    EXPECT_NEAR(changed.cost(), constants.cost(), 1e-8);
    EXPECT_LT((changed.motion.x - constants.motion.x).cwiseAbs().maxCoeff(), 1e-6);
    EXPECT_LT((changed.motion.u - constants.motion.u).cwiseAbs().maxCoeff(), 1e-5);
    EXPECT_GT(std::abs(changed.cost() - first.cost()), 0.05);
    // The checks run the plain functions, with the parameters of every instant.
    EXPECT_NEAR(changed.verification.cost, changed.cost(), 1e-10);
    EXPECT_LT(changed.verification.violation, 1e-6);
    EXPECT_LT(changed.verification.worst_defect, 1e-3);
    const Trajectory again = resampled(nlp.problem(), changed.motion, nlp.times());
    EXPECT_LT((again.x - changed.motion.x).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_NEAR(changed.verification.worst_defect, constants.verification.worst_defect, 1e-6);
  }
}

// Start, goal and bounds as well: the shape is that of a program made with them, and so is the solution.
TEST(OcpParameters, EndsAndBoundsChangeInPlace) {
  Problem problem = test::swing_up(), other = problem;
  other.start << 0.1, 0.2, 0, 0;
  other.goal << 0.8, 3.1, Problem::kFree, 0;
  other.x.upper[0] = 1.5;
  other.u.upper[0] = 15;
  const auto guess = other.guess;
  other.guess = [guess](double t) {
    Stage<double> stage = guess(t);
    stage.x *= 0.9;
    return stage;
  };
  for (const Scheme& scheme : test::every_scheme()) {
    const MeshOptions mesh{.scheme = scheme, .intervals = 25, .evaluation = test::kInterpreted};
    StagedNlp nlp = discretize(problem, mesh), made = discretize(other, mesh);
    nlp.set_values(other);
    EXPECT_EQ(nlp.shape().x_lower, made.shape().x_lower);
    EXPECT_EQ(nlp.shape().x_upper, made.shape().x_upper);
    EXPECT_EQ(nlp.shape().g_lower, made.shape().g_lower);
    EXPECT_EQ(nlp.start(), made.start());
    const OptimiseOptions options{.mesh = mesh};
    const Solution changed = optimise(nlp, nlp.start(), options),
                   fresh = optimise(made, made.start(), options);
    ASSERT_TRUE(changed.converged() && fresh.converged());
    EXPECT_EQ(changed.nlp.x, fresh.nlp.x) << scheme.name;
    EXPECT_LT(changed.verification.violation, 1e-6);
  }
}

std::size_t files_in(const std::string& folder) {
  const auto all = fs::recursive_directory_iterator(folder);
  return static_cast<std::size_t>(
      std::count_if(begin(all), end(all), [](const auto& entry) { return entry.is_regular_file(); }));
}

TEST(OcpParameters, NothingIsCompiledAgain) {
  const TemporaryCache cache;
  Problem problem = test::block_move();
  const Parameter load = problem.parameters.add("load", 1.0);
  problem.rate = problem.ode = [load](const auto& s) {
    return vector(s.x[1], typename std::decay_t<decltype(s.x)>::Scalar(s.u[0] / load(s)[0]));
  };
  const MeshOptions mesh{.intervals = 4, .evaluation = {.cache_folder = cache.path()}};
  StagedNlp nlp = discretize(problem, mesh);
  EXPECT_EQ(nlp.build().compiled, 1);
  const std::size_t files = files_in(cache.path());
  EXPECT_GT(files, 0u);
  for (const double kg : {2.0, 3.0}) {
    Problem now = nlp.problem();
    now.parameters.set("load", kg);
    now.goal[0] = 2;
    nlp.set_values(now);
    const Solution s = optimise(nlp, nlp.start(), {});
    ASSERT_TRUE(s.success());
    EXPECT_NEAR(s.cost(), 12 * 4 * kg * kg, 1e-6);  // int (m a)^2
  }
  EXPECT_EQ(nlp.build().compiled, 1);
  EXPECT_EQ(files_in(cache.path()), files);
  // Values are not in the keys of the cache either: another program with others finds its functions there.
  problem.parameters.set("load", 7.0);
  const StagedNlp again = discretize(problem, mesh);
  EXPECT_EQ(again.build().compiled, 0);
  EXPECT_EQ(again.build().from_cache, 1);
  EXPECT_EQ(files_in(cache.path()), files);
}

// all_as_variables: the derivatives by parameters, against differences of the plain functions.
TEST(OcpParameters, SlopesByParametersAreThoseOfDifferences) {
  const Problem problem = with_parameters(kOther);
  const Function f = all_as_variables(record_stage(problem).node);
  const Eigen::Index n_z = 5, n_p = problem.parameters.size();
  const VectorXd z = (VectorXd(n_z) << 0.3, 0.5, -0.2, 0.7, 1.1).finished();
  const double t = 0.6;
  VectorXd point(n_z + 1 + n_p);
  point << z, t, problem.parameters.at(t);
  const Derivatives first = derive(f, Order::kFirst);
  const std::vector<double> values = evaluate(first.function, point);
  const Pattern& pattern = first.jacobian;
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(Eigen::Index(f.n_y()), point.size());
  ASSERT_EQ(values.size(), f.n_y() + pattern.nnz());
  for (std::size_t k = 0; k < pattern.nnz(); ++k) J(pattern.row[k], pattern.col[k]) = values[f.n_y() + k];

  const auto plain = [&](const VectorXd& p) {  // rate, path row, cost
    const Stage<double> s{t, z.head(4), {}, z.tail(1), p};
    VectorXd y(6);
    y << problem.rate(s), problem.terms[3].function(s),
        problem.terms[0].function(s).squaredNorm() + problem.terms[1].function(s).squaredNorm();
    return y;
  };
  const VectorXd p = problem.parameters.at(t);
  EXPECT_LT((Eigen::Map<const VectorXd>(values.data(), 6) - plain(p)).norm(), 1e-14);
  for (Eigen::Index i = 0; i < n_p; ++i) {
    const VectorXd step = 1e-5 * VectorXd::Unit(n_p, i);
    const VectorXd slope = (plain(p + step) - plain(p - step)) / 2e-5;
    EXPECT_GT(slope.norm(), 0.1) << i;
    EXPECT_LT((J.col(n_z + 1 + i) - slope).norm(), 1e-8) << i;
  }
}

Problem soft(const Told& told) {  // what stepwise methods know
  Problem p = with_parameters(told);
  std::erase_if(p.terms, [](const Term& term) { return term.role == Role::kInequality; });
  p.goal.setConstant(Problem::kFree);
  return p;
}

TEST(OcpParameters, StepwiseSolvesTakeThemInPlace) {
  const DdpOptions options{.intervals = 60, .evaluation = test::kInterpreted};
  DdpSolver solver(soft(kOne), options);
  const DdpSolution first = solver.solve();
  Problem now = solver.problem();
  tell(now.parameters, kOther);
  now.start[0] = 0.2;
  solver.set_values(now);
  const DdpSolution changed = solver.solve();
  Problem constant = with_constants(kOther);
  std::erase_if(constant.terms, [](const Term& term) { return term.role == Role::kInequality; });
  constant.goal.setConstant(Problem::kFree);
  constant.start[0] = 0.2;
  const DdpSolution expected = solve_with_ddp(constant, options);
  ASSERT_TRUE(first.success() && changed.success() && expected.success());
  EXPECT_NEAR(changed.cost, expected.cost, 1e-9);
  EXPECT_LT((changed.u - expected.u).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_GT(std::abs(changed.cost - first.cost), 0.05);
  EXPECT_EQ(solver.build().interpreted, 2);
  now.x.upper[0] = 1;
  EXPECT_THROW(solver.set_values(now), ArgumentError);  // limits of states
  EXPECT_EQ(solver.solve().cost, changed.cost);
}

// Steps ask for parameters at their beginning, middle and end, and stay of fourth order: a defect of a step is its fifth
// power.
TEST(OcpParameters, StepsFollowParametersThatVary) {
  double last = 0;
  for (const int n : {20, 40}) {
    const DdpSolution s = solve_with_ddp(soft(kOther), {.intervals = n, .evaluation = test::kInterpreted});
    ASSERT_TRUE(s.success());
    if (last > 0) {
      EXPECT_NEAR(last / s.integration_error, 32, 8);
    }
    last = s.integration_error;
  }
  EXPECT_LT(last, 1e-6);
}

TEST(OcpParameters, MistakesAreOneSentence) {
  Parameters p;
  p.add("target", Vector2d(1, 2));
  p.add("load", 1.0);
  EXPECT_EQ(p.entry_names(), (std::vector<std::string>{"target[0]", "target[1]", "load"}));
  EXPECT_EQ(p.at(0), Eigen::Vector3d(1, 2, 1));
  EXPECT_EQ(message_of<ArgumentError>([&] { p.set("traget", 1.0); }),
            "there is no parameter \"traget\"; did you mean 'target'?");
  EXPECT_EQ(message_of<ArgumentError>([&] { p.find("zz"); }),
            "there is no parameter \"zz\"; valid are 'target', 'load'");
  EXPECT_EQ(message_of<ArgumentError>([&] { p.set("target", 1.0); }),
            "the parameter \"target\" has 1 entries, expected 2");
  EXPECT_EQ(message_of<ArgumentError>([&] { p.set("target", Vector2d(0, std::nan(""))); }),
            "the parameter \"target[1]\" is nan, expected a finite number");
  EXPECT_EQ(message_of<ArgumentError>([&] { p.add("load", 2.0); }), "there are two parameters \"load\"");
  EXPECT_EQ(message_of<ArgumentError>([&] { p.add("", 2.0); }), "a parameter has no name");
  EXPECT_EQ(message_of<ArgumentError>([&] { p.add("none", VectorXd(0)); }),
            "the parameter \"none\" has no entries");
  EXPECT_EQ(message_of<ArgumentError>([&] { p.add("square", Eigen::Matrix2d::Zero()); }),
            "the value of a parameter is a matrix of 2 x 2, expected a number or a vector");
  EXPECT_EQ(message_of<ArgumentError>([&] { p.add("empty", ParameterValue::OfTime()); }),
            "the value of a parameter is an empty function, expected one of time that gives a vector");
  EXPECT_EQ(p.at(3), Eigen::Vector3d(1, 2, 1));
  Parameters row;
  row.add("row", Eigen::RowVector3d(1, 2, 3));
  EXPECT_EQ(row.at(0), Eigen::Vector3d(1, 2, 3));
  Parameters fewer;
  fewer.add("target", Vector2d(1, 2));
  EXPECT_EQ(message_of<ArgumentError>([&] { p.check_same(fewer); }), "the parameter \"load\" is missing");
  Parameters swapped;
  swapped.add("load", 1.0);
  EXPECT_NE(message_of<ArgumentError>([&] {
              p.check_same(swapped);
            }).find("\"load\" has 1 entries from 0 on, expected 1 from 2"),
            std::string::npos);
  const Parameter load = p.find("load");
  EXPECT_NE(message_of<ArgumentError>([&] {
              load(Stage<double>{0, VectorXd(2), {}, {}});
            }).find("a stage has 0 parameters"),
            std::string::npos);
}

// What cannot be taken changes nothing.
TEST(OcpParameters, ValuesThatDoNotFitLeaveAProgramAsItWas) {
  StagedNlp nlp = discretize(with_parameters(kOne), {.intervals = 6, .evaluation = test::kInterpreted});
  const std::vector<double> x = wavy(nlp);
  const Evaluated before = evaluated(nlp, x);
  const auto refused = [&](const std::function<void(Problem&)>& change) {
    Problem now = nlp.problem();
    change(now);
    const std::string what = message_of<ArgumentError>([&] { nlp.set_values(now); });
    EXPECT_EQ(evaluated(nlp, x).cost, before.cost);
    return what;
  };
  EXPECT_NE(refused([](Problem& p) { p.start[0] = HUGE_VAL; }).find("the start of \"p\" is inf"),
            std::string::npos);
  EXPECT_NE(refused([](Problem& p) { p.u.lower[0] = 1, p.u.upper[0] = 0; }).find("\"u\" are empty"),
            std::string::npos);
  EXPECT_NE(refused([](Problem& p) { p.duration = 3; }).find("expected 1.5"), std::string::npos);
  EXPECT_NE(refused([](Problem& p) { p.parameters = {}; }).find("\"load\" is missing"), std::string::npos);
  EXPECT_EQ(refused([](Problem& p) {
              p.parameters.set("push",
                               [](double t) { return VectorXd::Constant(1, t > 1.3 ? std::nan("") : 0); });
            }),
            "the parameter \"push\" is nan at t = 1.375000 s, expected a finite number");
  EXPECT_NE(
      refused([](Problem& p) { p.states[1] = "angle"; }).find("the states are others than were recorded"),
      std::string::npos);
  EXPECT_NE(refused([](Problem& p) { p.controls.push_back("y"); }).find("\"y\", expected none"),
            std::string::npos);
  EXPECT_NE(refused([](Problem& p) { p.terms.pop_back(); }).find("terms, expected the "), std::string::npos);
}

// An x that is no number is none of what was evaluated before.
TEST(OcpParameters, NothingStaleIsGivenForWhatIsNoNumber) {
  StagedNlp nlp = discretize(with_parameters(kOne), {.intervals = 6, .evaluation = test::kInterpreted});
  const std::vector<double> x = wavy(nlp), none(x.size(), std::nan(""));
  std::vector<double> slope(x.size());
  double cost = 0;
  ASSERT_TRUE(nlp.objective(x.data(), cost) && nlp.gradient(x.data(), slope.data()));
  nlp.set_values(nlp.problem());
  EXPECT_FALSE(nlp.objective(none.data(), cost));
  EXPECT_FALSE(nlp.gradient(none.data(), slope.data()));
}

// Late in the motion, where recording does not look.
TEST(OcpParameters, ValuesThatFailLaterAreErrorsEverywhere) {
  const auto late = [](double bad) {
    return
        [bad](double t) { return VectorXd::Constant(std::isnan(bad) || t < 1.3 ? 1 : 2, t > 1.3 ? bad : 0); };
  };
  for (const double bad : {std::nan(""), 0.0}) {
    Problem p = soft(kOne);
    p.parameters.set("push", late(bad));
    EXPECT_NE(message_of<ArgumentError>([&] {
                discretize(p, {.intervals = 6, .evaluation = test::kInterpreted});
              }).find("\"push\""),
              std::string::npos);
    EXPECT_NE(message_of<ArgumentError>([&] {
                solve_with_ddp(p, {.intervals = 20, .evaluation = test::kInterpreted});
              }).find("\"push\""),
              std::string::npos);
    DdpSolver solver(soft(kOne), {.intervals = 20, .evaluation = test::kInterpreted});
    const double before = solver.solve().cost;
    EXPECT_NE(message_of<ArgumentError>([&] { solver.set_values(p); }).find("\"push\""), std::string::npos);
    EXPECT_EQ(solver.solve().cost, before);
  }
}

}  // namespace
}  // namespace dyntape::ocp_parameters_test
