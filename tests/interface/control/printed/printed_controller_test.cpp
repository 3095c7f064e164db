// SPDX-License-Identifier: BSD-3-Clause
//
// Controllers as one C file: the bits of a reference, the plans of RecedingHorizon, what is refused, and the text.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <regex>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/codegen/pipeline.h>
#include <dyntape/interface/control/mpc/receding_horizon.h>
#include <dyntape/interface/control/printed/controller.h>
#include <dyntape/interface/control/printed/controller_library.h>
#include <dyntape/interface/control/problem/penalties.h>
#include "controller_reference.h"
#include "interface/control/ocp_problems.h"
#include "interface/message_of.h"

namespace dyntape::printed_controller_test {
namespace {

using Eigen::VectorXd;

MeshOptions stepped(int intervals, Scheme scheme = runge_kutta_4(1)) {
  return {.scheme = std::move(scheme), .intervals = intervals, .hessian = HessianKind::kGaussNewton};
}

// Costs pull upright; rail and force are limited.
Problem cart_pole(double force_limit = 20) {
  Problem p = test::swing_up(0.2, force_limit);
  p.goal.setConstant(Problem::kFree);
  const VectorXd upright = Eigen::Vector4d(1, std::numbers::pi, 0, 0);
  p.add(terminal_squares("upright", [upright](const auto& s) {
    return (10.0 * (s.x - upright.cast<typename std::decay_t<decltype(s.x)>::Scalar>())).eval();
  }));
  return p;
}

// A mass between walls, with a soft row, a parameter of time, and a cost that has a curvature of its own.
Problem walled() {
  Parameters parameters;
  const Parameter target =
      parameters.add("target", [](double t) { return VectorXd::Constant(1, std::sin(2 * t)); });
  Problem p("walled mass", {"p", "v"}, {"u", "brake"}, 1.0,
            [](const auto& s) { return vector(s.x[1], s.u[0] - 0.5 * s.u[1] * s.x[1]); });
  p.parameters = parameters;
  p.add(running_squares(
      "follow", [target](const auto& s) { return vector(3.0 * (s.x[0] - target(s)[0]), s.x[1] - s.x[1]); }));
  p.add(running_squares("effort", [](const auto& s) { return (0.1 * s.u).eval(); }));
  p.add(path_inequality(
      "speed and force", [](const auto& s) { return vector(s.x[1] + 0.1 * s.u[0]); },
      VectorXd::Constant(1, -1), VectorXd::Constant(1, 1)));
  p.add(soft(running_squares("near the middle", [](const auto& s) { return vector(s.x[0]); }),
             SmoothAbsolute{.weight = 0.1, .width = 0.2}));
  p.add(terminal_inequality(
      "slow at the end", [](const auto& s) { return vector(s.x[1]); }, VectorXd::Constant(1, -0.5),
      VectorXd::Constant(1, 0.5)));
  p.start << 0, 0;
  p.u.lower << -4, 0;
  p.u.upper << 4, 1;
  return p;
}

using Ref = test::Reference<double>;

// The recorded functions by the interpreter, with full Jacobians.
Ref::Evaluate interpreted_value(const Function& f) {
  const auto run = std::make_shared<Interpreter>(f);
  return [run](const Ref::Row& z, const Ref::Row& p, Ref::Row& y, Ref::Matrix*) {
    Interpreter::Workspace room(*run);
    y.resize(run->function().n_y());
    (*run)(z.data(), p.data(), nullptr, y.data(), room);
  };
}

Ref::Evaluate interpreted_first(const Function& f) {
  const auto derived = std::make_shared<Derivatives>(derive(f, Order::kFirst));
  const auto run = std::make_shared<Interpreter>(derived->function);
  return [run, derived](const Ref::Row& z, const Ref::Row& p, Ref::Row& y, Ref::Matrix* jacobian) {
    Interpreter::Workspace room(*run);
    std::vector<double> all(run->function().n_y());
    (*run)(z.data(), p.data(), nullptr, all.data(), room);
    y.assign(all.begin(), all.begin() + long(derived->n_y));
    jacobian->assign(derived->n_y, Ref::Row(z.size(), 0.0));
    for (std::size_t k = 0; k < derived->jacobian.nnz(); ++k)
      (*jacobian)[derived->jacobian.row[k]][derived->jacobian.col[k]] = all[derived->n_y + k];
  };
}

test::ReferenceConstants<double> constants_of(const ControllerOptions& o) {
  return {.price = o.price,
          .mu_end = 1e-8,
          .left = 1e-6,
          .rounding = 1e-14,
          .tolerance = 1e-4,
          .damping = 1e-9,
          .iterations = o.iterations,
          .interior_steps = o.interior_steps,
          .trials = o.trials};
}

// Steps from states that a random plant reaches, at times that are no multiples of the mesh.
void expect_equal_bits(const Problem& problem, const ControllerOptions& options) {
  const ControllerParts parts = controller_parts(problem, options);
  Ref reference(parts,
                {interpreted_value(parts.stage.value), interpreted_first(parts.stage.first),
                 interpreted_value(parts.end.value), interpreted_first(parts.end.first)},
                constants_of(options));
  ControllerLibrary printed(problem, options);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> noise(-0.2, 0.2);
  VectorXd x = problem.start;
  const auto n_z = std::size_t(problem.n_x() + problem.n_u());
  for (int k = 0; k < 6; ++k) {
    const double t = 0.07 * k;
    // The reference has the parameters of the problem's time.
    if (problem.parameters.size() > 0 && k > 0) break;
    const ControllerStep step = printed.step(t, x, 3);
    const int status = reference.step({x.begin(), x.end()}, t, 3);
    ASSERT_EQ(int(step.status), status);
    EXPECT_EQ(step.interior_steps, reference.interior_steps);
    int different = 0;
    for (std::size_t i = 0; i < parts.times.size() * n_z; ++i)
      different += printed.number(printed.printed().layout.z + i) != reference.z[i / n_z][i % n_z];
    EXPECT_EQ(different, 0) << "step " << k;
    for (double& value : x) value += noise(random);
  }
}

TEST(PrintedController, HasTheBitsOfTheReference) {
  expect_equal_bits(cart_pole(), {.mesh = stepped(20)});
  expect_equal_bits(cart_pole(), {.mesh = stepped(15, euler()), .price = 50});
  expect_equal_bits(walled(), {.mesh = stepped(12)});
}

// With limits of force and rail active.
TEST(PrintedController, ConvergesToThePlanOfTheDesktop) {
  const Problem p = cart_pole(6);
  MpcOptions usual;
  usual.mesh = stepped(30);
  usual.solver.tolerance = 1e-12;
  RecedingHorizon desktop(p, usual);
  MpcOptions text = usual;
  text.printed = true;
  RecedingHorizon printed(p, text);
  const VectorXd x = Eigen::Vector4d(0.1, 0.3, 0, 0);
  const MpcStep& a = desktop.step(0, x);
  MpcStep b = printed.step(0, x);
  for (int i = 0; i < 8 && b.status != SolveStatus::kSolved; ++i) b = printed.step(0, x);
  ASSERT_EQ(b.status, SolveStatus::kSolved);
  ASSERT_TRUE(a.usable);
  EXPECT_NEAR(b.plan.motion.u.maxCoeff(), 6, 1e-4) << "no limit is active";
  EXPECT_NEAR(a.cost, b.cost, 1e-5 * a.cost);
  EXPECT_LT((a.plan.motion.x - b.plan.motion.x).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_LT((a.plan.motion.u.leftCols(30) - b.plan.motion.u.leftCols(30)).cwiseAbs().maxCoeff(), 1e-3);
}

// A mass that is pushed with little force, with limits of position and speed.
Problem pushed_mass() {
  Problem p("pushed mass", {"p", "v"}, {"u"}, 2.0, [](const auto& s) { return vector(s.x[1], s.u[0]); });
  p.add(running_squares("middle", [](const auto& s) { return s.x; }));
  p.add(running_squares("effort", [](const auto& s) { return (0.3 * s.u).eval(); }));
  p.add(terminal_squares("rest", [](const auto& s) { return (3.0 * s.x).eval(); }));
  p.start << 0, 0;
  p.u.lower << -1;
  p.u.upper << 1;
  p.x.lower << -1, -0.6;
  p.x.upper << 1, 0.6;
  return p;
}

// From any state, with the plan of another one: a linear model is solved in two iterations, and a third sees no change.
TEST(PrintedController, SolvesAgainAfterShocks) {
  for (const bool single : {false, true}) {
    ControllerLibrary mpc(pushed_mass(), {.mesh = stepped(20), .single = single});
    std::mt19937 random(7);
    std::uniform_real_distribution<double> noise(-1, 1);
    mpc.step(0, VectorXd::Zero(2), 10);
    int unsolved = 0, most = 0;
    double t = 0;
    for (const double size : {0.5, 2.0, 20.0}) {
      for (int k = 0; k < 200; ++k) {
        const Eigen::Vector2d x(size * noise(random), size * noise(random));
        const ControllerStep s = mpc.step(t += 0.1, x, 8);
        unsolved += s.status != ControllerStep::Status::kSolved;
        most = std::max(most, s.interior_steps);
      }
    }
    EXPECT_EQ(unsolved, 0) << (single ? "float" : "double");
    EXPECT_LE(most, single ? 100 : 80);
  }
}

// A goal is two sides without room between them, whose weights are without bound: float lost the plan in them, and said that
// it was solved.
TEST(PrintedController, ReachesGoalsInFloatAsInDouble) {
  Problem p = pushed_mass();
  p.goal << 0, 0;
  p.add(path_inequality(
      "row", [](const auto& s) { return vector(s.x[0] + 0.5 * s.x[1]); }, VectorXd::Constant(1, -0.4),
      VectorXd::Constant(1, 0.4)));
  ControllerLibrary exact(p, {.mesh = stepped(20)}), single(p, {.mesh = stepped(20), .single = true});
  std::mt19937 random(11);
  std::uniform_real_distribution<double> noise(-0.4, 0.4);
  int unsolved = 0;
  double most = 0;
  for (int k = 0; k < 200; ++k) {
    const Eigen::Vector2d x = k == 0 ? Eigen::Vector2d(0, 0) : Eigen::Vector2d(noise(random), noise(random));
    exact.restart(), single.restart();
    unsolved += exact.step(0, x, 20).status != ControllerStep::Status::kSolved;
    unsolved += single.step(0, x, 20).status != ControllerStep::Status::kSolved;
    most = std::max(most, (exact.plan().u.leftCols(20) - single.plan().u.leftCols(20)).cwiseAbs().maxCoeff());
  }
  EXPECT_EQ(unsolved, 0);
  EXPECT_LT(most, 0.01);
}

// Where limits of control begin and end to hold, the plan depends on the last product by its root.
TEST(PrintedController, SolvesToATighterTolerance) {
  const Problem p = pushed_mass();
  ControllerLibrary usual(p, {.mesh = stepped(20)}), tight(p, {.mesh = stepped(20), .tolerance = 1e-6});
  for (const Eigen::Vector2d& x :
       {Eigen::Vector2d(1, 0), Eigen::Vector2d(-0.3084, -0.00015), Eigen::Vector2d(0.3, 0.28)}) {
    EXPECT_EQ(usual.step(0, x, 8).status, ControllerStep::Status::kSolved);
    EXPECT_EQ(tight.step(0, x, 8).status, ControllerStep::Status::kSolved);
    EXPECT_LT((usual.plan().u.leftCols(20) - tight.plan().u.leftCols(20)).cwiseAbs().maxCoeff(), 1e-3);
  }
}

TEST(PrintedController, SwingsUpInFloatAsInDouble) {
  const Problem p = cart_pole();
  for (const bool single : {false, true}) {
    ControllerLibrary mpc(p, {.mesh = stepped(30), .single = single});
    VectorXd x = p.start;
    const double h = 2.0 / 30;
    for (int k = 0; k < 75; ++k) {
      ASSERT_TRUE(mpc.step(k * h, x, k == 0 ? 50 : 3).usable());
      const VectorXd u = mpc.control(k * h, x);
      ASSERT_LE(std::abs(u[0]), 20);
      for (int i = 0; i < 20; ++i) x += h / 20 * p.rate(p.stage(0, x, {}, u));
    }
    EXPECT_NEAR(x[1], std::numbers::pi, 0.05) << (single ? "float" : "double");
    EXPECT_NEAR(x[0], 1, 0.1);
  }
}

TEST(PrintedController, SaysWhatABudgetMade) {
  ControllerLibrary mpc(cart_pole(), {.mesh = stepped(20)});
  const VectorXd x = VectorXd::Zero(4);
  EXPECT_EQ(mpc.step(0, x, 1).status, ControllerStep::Status::kBudgetEnded);
  const ControllerStep nothing = mpc.step(0, x, 0);
  EXPECT_EQ(nothing.iterations, 0);
  EXPECT_EQ(nothing.status, ControllerStep::Status::kBudgetEnded);
  const Trajectory before = mpc.plan();
  const ControllerStep bad = mpc.step(0, VectorXd::Constant(4, NAN), 5);
  EXPECT_EQ(bad.status, ControllerStep::Status::kNotFinite);
  EXPECT_TRUE(mpc.plan().x == before.x);
  for (int i = 0; i < 20; ++i) mpc.step(0, x, 50);
  EXPECT_EQ(mpc.step(0, x, 50).status, ControllerStep::Status::kSolved);
}

// What stops a step far from its guess in one step's time is not a reason to fail.
TEST(PrintedController, StaysFiniteFromAnywhere) {
  for (const bool single : {false, true}) {
    ControllerLibrary mpc(cart_pole(), {.mesh = stepped(20), .single = single});
    std::mt19937 random(1);
    std::uniform_real_distribution<double> far(-10, 10);
    int not_finite = 0;
    for (int k = 0; k < 100; ++k) {
      const VectorXd x = VectorXd::NullaryExpr(4, [&] { return far(random); });
      not_finite += mpc.step(0.05 * k, x, 2).usable() ? 0 : 1;
      const VectorXd u = mpc.control(0.05 * k, x);
      EXPECT_TRUE(u.allFinite());
      EXPECT_LE(std::abs(u[0]), 20 * (1 + 1e-6));
    }
    EXPECT_EQ(not_finite, 0);
  }
}

// A program that changes limits between steps.  Returns 0 if each plan is solved with the given first control.
constexpr char kChangesLimits[] = R"(#include "lift.h"
static lift_state s;
static int goes_wrong(double lower, double upper, double control) {
  const double x[2] = {0, 0};
  double u[1], off;
  s.bound[0] = lower;
  s.bound[1] = upper;
  if (lift_step(&s, x, 0, 4) != LIFT_SOLVED) return 1;
  lift_control(&s, 0, x, u);
  off = u[0] - control;
  return off > 1e-3 || off < -1e-3;
}
int main(void) {
  const double x[2] = {0, 0};
  double u[1];
  lift_init(&s);
  if (goes_wrong(0, 20, 20)) return 1;
  if (goes_wrong(0, 12, 12)) return 2;
  if (goes_wrong(9.5, 12, 12)) return 3;
  if (goes_wrong(0, 20, 20)) return 4;
  s.bound[1] = 1e300 * 1e300;
  if (lift_step(&s, x, 0, 4) != LIFT_NOT_FINITE) return 5;
  s.bound[0] = s.bound[1];
  lift_control(&s, 0, x, u);
  if (u[0] - u[0] != 0) return 9;
  s.bound[0] = 13;
  s.bound[1] = 12;
  if (lift_step(&s, x, 0, 4) != LIFT_NO_ROOM) return 7;
  s.bound[0] = 12;
  if (lift_step(&s, x, 0, 4) != LIFT_NO_ROOM) return 8;
  s.bound[0] = 0;
  s.bound[1] = 20;
  lift_control(&s, 0, x, u);
  return u[0] > 20 || u[0] < 0 ? 6 : 0;
}
)";

TEST(PrintedController, FollowsLimitsThatChange) {
  Problem p("lift", {"z", "v"}, {"u"}, 1.0, [](const auto& s) { return vector(s.x[1], s.u[0] - 9.81); });
  p.add(running_squares("height", [](const auto& s) { return vector(3.0 * (s.x[0] - 1.0)); }));
  p.add(
      running_squares("effort", [](const auto& s) { return (0.1 * (s.u.array() - 9.81)).matrix().eval(); }));
  p.start << 0, 0;
  p.u.lower << 0;
  p.u.upper << 20;
  std::string folder = (std::filesystem::temp_directory_path() / "dyntape_lift_XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  write_source(generate_controller(p, {.mesh = stepped(5)}).source, folder);
  write_file_atomically(folder + "/main.c", kChangesLimits);
  EXPECT_EQ(std::system(("cd " + folder + " && cc -std=c99 -O2 main.c lift.c -o lift").c_str()), 0);
  const int status = std::system((folder + "/lift").c_str());
  EXPECT_EQ(WEXITSTATUS(status), 0);
  std::filesystem::remove_all(folder);
}

// A sensor that fails between two steps: the plan's control, within its limits.
TEST(PrintedController, ControlsStayFiniteForStatesThatAreNot) {
  ControllerLibrary mpc(cart_pole(), {.mesh = stepped(20)});
  mpc.step(0, VectorXd::Zero(4), 5);
  for (const double bad : std::initializer_list<double>{NAN, INFINITY, -INFINITY, 1e300}) {
    const VectorXd u = mpc.control(0.01, VectorXd::Constant(4, bad));
    EXPECT_TRUE(u.allFinite()) << bad;
    EXPECT_LE(std::abs(u[0]), 20 * (1 + 1e-6)) << bad;
  }
}

TEST(PrintedController, RefusesWhatItCannotPrint) {
  const auto message = [](const Problem& p, ControllerOptions o = {.mesh = stepped(10)}) {
    return message_of<ArgumentError>([&] { generate_controller(p, o); });
  };
  const auto expect = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  Problem p = cart_pole();
  expect(message(p, {.mesh = stepped(10, trapezoid())}), "trapezoid");
  MeshOptions exact = stepped(10);
  exact.hessian = HessianKind::kExact;
  expect(message(p, {.mesh = exact}), "gauss_newton");
  expect(message(p, {.mesh = stepped(10), .target_bytes = 1000}), "1 000");
  Problem free = p;
  free.free_duration(1, 2);
  expect(message(free), "duration is free");
  Problem via = p;
  via.add(at_fraction(0.5, running_squares("via", [](const auto& s) { return s.x; })));
  expect(message(via), "\"via\"");
  Problem library = p;
  library.add(running_squares("angle", [](const auto& s) {
    using std::atan2;
    return vector(atan2(s.x[0], s.x[1] + 2.0));
  }));
  expect(message(library), "atan2");
  Problem equal = p;
  equal.u.lower[0] = equal.u.upper[0];
  expect(message(equal), "\"u\"");
  expect(message(p, {.mesh = stepped(10), .interior_steps = 0}), "interior_steps");
  expect(message(p, {.mesh = stepped(10), .name = "dt"}), "dt_");
}

// Every loop has a constant bound: the count of the text refuses others; and no function of a library is called.
TEST(PrintedController, TextHasBoundsAndNoLibrary) {
  for (const bool single : {false, true}) {
    const PrintedController c = generate_controller(cart_pole(), {.mesh = stepped(20), .single = single});
    EXPECT_GT(c.of_iteration.operations, 1e4);
    EXPECT_LT(c.of_step.sum(), c.of_iteration.sum());
    EXPECT_EQ(c.source.text.find("math.h"), std::string::npos);
    EXPECT_EQ(c.source.text.find("malloc"), std::string::npos);
    EXPECT_EQ(c.source.text.find("@"), std::string::npos);
    EXPECT_EQ(c.source.header.find("@"), std::string::npos);
    // No variable outside functions but constants.
    const std::regex variable(
        "\nstatic (?!const|real dt_|int dt_|void dt_|dt_|unsigned dt_|__attribute__)[^\n(]*;");
    EXPECT_FALSE(std::regex_search(c.source.text, variable));
    const std::string stated = std::to_string(c.state_bytes);
    EXPECT_LT(c.state_bytes, 32000u);
  }
}

}  // namespace
}  // namespace dyntape::printed_controller_test
