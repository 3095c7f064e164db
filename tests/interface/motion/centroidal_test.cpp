// SPDX-License-Identifier: BSD-3-Clause
//
// A robot as one mass on its feet.  Its dynamics against the whole robot's; what can be stood without a step against the closed
// form of the linear inverted pendulum; loops that stand disturbances and walk.
#include <gtest/gtest.h>

#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/centroidal.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/control/mpc/closed_loop.h>
#include <dyntape/interface/control/solve/optimise.h>
#include <dyntape/interface/motion/centroidal_problem.h>
#include <dyntape/interface/motion/standing.h>
#include "dynamics/robot_files.h"
#include "interface/control/ocp_problems.h"
#include "interface/message_of.h"

namespace dyntape::centroidal_test {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

const std::vector<std::string> kFeet = {"FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"};

struct Dog {
  RobotScene scene{
      dynamics::load_urdf(dynamics::robot_file("solo12"), {.base = dynamics::Base::kFloating}), {}, {}};
  VectorXd q = dynamics::neutral(scene.model);

  Dog() { q.tail(12) << 0.1, 0.8, -1.6, -0.1, 0.8, -1.6, 0.1, -0.8, 1.6, -0.1, -0.8, 1.6; }
  CentroidalBody body(double friction = 1.2) const {
    std::vector<HeldContact> contacts;
    for (const std::string& foot : kFeet) contacts.push_back({.frame = foot, .friction = friction});
    return centroidal_body(scene, q, contacts);
  }
};

// The reference's: 1.38607 m/s forwards, 1.20309 m/s sideways; with a horizon and with friction that end it earlier.
struct Limit {
  double omega, edge;

  Limit(const CentroidalBody& body, int axis) {
    const double height = body.com.z() - body.feet[0].place.z();
    omega = std::sqrt(9.81 / height);
    edge = std::abs(body.feet[0].place[axis] - body.com[axis]);
    friction_part = std::min(1.0, body.feet[0].friction * height / edge);
  }
  double ideal() const { return omega * edge; }
  double within(double horizon) const {
    return ideal() * std::tanh(omega * horizon) * std::sqrt(friction_part * (2 - friction_part));
  }

 private:
  double friction_part;
};

// Without a step, at constant height, without angular momentum.
CentroidalOptions strictly(double duration) {
  return {.duration = duration, .is_level = true, .zero_angular_momentum = true, .ends_at_rest = true};
}

Solution solved(Problem problem, int axis, double velocity, NlpMethod method = NlpMethod::kRiccati,
                int intervals = 10) {
  problem.start[3 + axis] = velocity;
  return optimise(problem,
                  {.mesh = {.scheme = trapezoid(), .intervals = intervals, .evaluation = test::kInterpreted},
                   .solver = {.method = method, .max_iterations = 300},
                   .check_derivatives = false,
                   .verify = false});
}

TEST(Centroidal, TheBodyIsThatOfTheReference) {
  const Dog dog;
  const CentroidalBody body = dog.body();
  EXPECT_NEAR(body.mass, 2.50000279, 1e-8);
  for (const CentroidalBody::Foot& foot : body.feet) {
    EXPECT_NEAR(std::abs(foot.place.x() - body.com.x()), 0.19460, 1e-5) << foot.name;
    EXPECT_NEAR(std::abs(foot.place.y() - body.com.y()), 0.16891, 1e-5) << foot.name;
    EXPECT_NEAR(body.com.z() - foot.place.z(), 0.193368, 1e-6) << foot.name;
  }
  EXPECT_NEAR(Limit(body, 0).ideal(), 1.38607, 1e-5);
  EXPECT_NEAR(Limit(body, 1).ideal(), 1.20309, 1e-5);
  // Standing still, each foot bears a quarter, and nothing moves.
  const Problem p = centroidal_problem(body, {});
  const Stage<double> s = p.first_guess(0);
  EXPECT_NEAR(s.u[2], 6.13126, 1e-5);
  EXPECT_NEAR(s.u[2] + s.u[5] + s.u[8] + s.u[11], 24.52503, 1e-5);
  EXPECT_LT(p.rate(p.stage(0, p.start, {}, s.u)).norm(), 1e-12);
}

// Forces on the feet of the whole robot, whatever its joints do: its momentum changes as the mass's.
TEST(Centroidal, TheRateIsThatOfTheWholeRobot) {
  const Dog dog;
  const auto& model = dog.scene.model;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const auto drawn = [&](Eigen::Index n) -> VectorXd {
      return VectorXd::NullaryExpr(n, [&] { return uniform(random); });
    };
    const VectorXd q = dynamics::integrate<double>(model, dog.q, drawn(18)), v = drawn(18),
                   forces = 20 * drawn(12);
    VectorXd tau = VectorXd::Zero(18);
    tau.tail(12) = 5 * drawn(12);
    dynamics::Data<double> data(model);
    std::vector<HeldContact> contacts;
    for (int i = 0; i < 4; ++i) {
      contacts.push_back({.frame = kFeet[std::size_t(i)]});
      const auto& J =
          dynamics::frame_jacobian<double>(model, data, q, model.frame_index(kFeet[std::size_t(i)]),
                                           dynamics::ReferenceFrame::kLocalWorldAligned);
      tau += J.topRows(3).transpose() * forces.segment<3>(3 * i);
    }
    const VectorXd a = dynamics::aba<double>(model, data, q, v, tau);
    dynamics::Centroidal<double> whole(model);
    dynamics::centroidal_momentum_rate<double>(model, data, whole, q, v, a);
    const Problem p = centroidal_problem(centroidal_body(dog.scene, q, contacts), {});
    const VectorXd x = centroidal_state(dog.scene, q, v), rate = p.rate(p.stage(0, x, {}, forces));
    EXPECT_LT((x.head(3) - whole.com).norm(), 1e-14);
    EXPECT_LT((x.segment(3, 3) - whole.velocity).norm(), 1e-13);
    EXPECT_LT((rate.head(3) - whole.velocity).norm(), 1e-13);
    EXPECT_LT((rate.segment(3, 3) * whole.mass - whole.h_dot.linear).norm(), 1e-12 * forces.norm());
    EXPECT_LT((rate.tail(3) - whole.h_dot.angular).norm(), 1e-12 * forces.norm());
  }
}

TEST(Centroidal, PushesBelowTheLimitAreStoodAndThoseAboveAreInfeasible) {
  const Dog dog;
  const Problem p = centroidal_problem(dog.body(), strictly(0.5));
  for (NlpMethod method : {NlpMethod::kRiccati, NlpMethod::kIpopt}) {
    for (int axis : {0, 1}) {
      for (double sign : {1.0, -1.0}) {
        const double limit = sign * Limit(dog.body(), axis).ideal();
        EXPECT_EQ(solved(p, axis, 0.95 * limit, method).nlp.status, SolveStatus::kSolved) << axis << sign;
        EXPECT_EQ(solved(p, axis, 1.05 * limit, method).nlp.status, SolveStatus::kLocallyInfeasible)
            << axis << sign;
      }
    }
  }
}

// By bisection: friction above and below what the whole limit asks for, horizons that are long and short.
TEST(Centroidal, TheThresholdIsTheClosedForm) {
  const Dog dog;
  const std::pair<double, double> cases[] = {
      {1.2, 0.5}, {1.2, 0.25}, {0.7, 0.5}, {0.4, 0.6}};  // friction, horizon (s)
  for (const auto& [friction, horizon] : cases) {
    const CentroidalBody body = dog.body(friction);
    const Problem p = centroidal_problem(body, strictly(horizon));
    for (int axis : {0, 1}) {
      const double expected = Limit(body, axis).within(horizon);
      double stood = 0.9 * expected, not_stood = 1.1 * expected;
      ASSERT_TRUE(solved(p, axis, stood, NlpMethod::kRiccati, 20).success());
      ASSERT_FALSE(solved(p, axis, not_stood, NlpMethod::kRiccati, 20).success());
      while (not_stood - stood > 1e-3 * expected) {
        const double middle = (stood + not_stood) / 2;
        (solved(p, axis, middle, NlpMethod::kRiccati, 20).success() ? stood : not_stood) = middle;
      }
      std::printf("friction %.1f, horizon %.2f s, axis %d: %.4f of the closed form %.4f m/s\n", friction,
                  horizon, axis, stood / expected, expected);
      EXPECT_NEAR(stood, expected, 0.01 * expected) << friction << " " << horizon << " " << axis;
    }
  }
}

// Along a plan the capture point moves away from the centre of pressure as exp(omega t), and stays within the support.
TEST(Centroidal, TheCapturePointFleesThePressure) {
  const Dog dog;
  const CentroidalBody body = dog.body();
  const Problem p = centroidal_problem(body, strictly(0.5));
  const Limit limit(body, 0);
  const Solution s = solved(p, 0, 0.95 * limit.ideal());
  ASSERT_TRUE(s.success());
  double farthest = 0;
  for (int k = 0; k < s.motion.points(); ++k) {
    const VectorXd x = s.motion.x.col(k), u = s.motion.u.col(k),
                   rate = p.rate(p.stage(s.motion.t[k], x, {}, u));
    double pressure = 0, up = 0;
    for (int i = 0; i < 4; ++i) {
      pressure += u[3 * i + 2] * body.feet[std::size_t(i)].place.x();
      up += u[3 * i + 2];
    }
    const double capture = x[0] + x[3] / limit.omega, flees = rate[0] + rate[3] / limit.omega;
    EXPECT_NEAR(flees, limit.omega * (capture - pressure / up), 1e-4) << k;
    farthest = std::max(farthest, capture - body.com.x());
  }
  EXPECT_LT(farthest, limit.edge);
  EXPECT_NEAR(farthest, 0.95 * limit.edge, 0.02 * limit.edge);
  const VectorXd end = s.motion.x.col(s.motion.points() - 1);
  EXPECT_LT(end.segment(3, 6).norm(), 1e-6);
  EXPECT_NEAR(end[2], body.com.z(), 1e-6);
}

ClosedLoopOptions steered(double seconds, double at, int axis, double velocity) {
  ClosedLoopOptions options{.seconds = seconds, .period = 0.002};
  options.mpc.mesh = {.scheme = trapezoid(), .intervals = 10, .evaluation = test::kInterpreted};
  options.mpc.solver = {.tolerance = 1e-4, .max_iterations = 300};
  options.disturbances = {{at, VectorXd::Unit(9, 3 + axis) * velocity}};
  return options;
}

TEST(Centroidal, TheLoopStandsPushesInFourDirections) {
  const Dog dog;
  const Problem p = centroidal_problem(dog.body(), strictly(0.5));
  for (int axis : {0, 1}) {
    for (double sign : {1.0, -1.0}) {
      const double limit = sign * Limit(dog.body(), axis).ideal();
      const ClosedLoop stood = close_loop(p, steered(2, 0.1, axis, 0.95 * limit));
      EXPECT_EQ(stood.unusable(), 0) << axis << sign;
      const VectorXd end = stood.motion.x.col(stood.motion.points() - 1);
      EXPECT_LT((end - p.start).norm(), 0.02) << axis << sign;
      EXPECT_LT((stood.motion.x.row(2).array() - p.start[2]).abs().maxCoeff(), 1e-4);
      EXPECT_LT(stood.motion.x.bottomRows(3).cwiseAbs().maxCoeff(), 1e-3);
      // What acts is within the cones from the first step after the push on; their tip is 0.0245 N below.
      for (int foot = 0; foot < 4; ++foot) {
        const auto f = stood.motion.u.middleRows(3 * foot, 3);
        EXPECT_GE(f.row(2).minCoeff(), -1e-6);
        EXPECT_LE((f.topRows(2).colwise().norm() - 1.2 * f.row(2)).maxCoeff(), 0.026) << foot;
      }
      // Noticed at the first step after the push, and the solver's own verdict.
      const ClosedLoop lost = close_loop(p, steered(0.11, 0.1, axis, 1.05 * limit));
      ASSERT_GT(lost.unusable(), 0) << axis << sign;
      EXPECT_TRUE(lost.steps[50].usable);
      EXPECT_FALSE(lost.steps[51].usable);
      EXPECT_EQ(lost.steps[51].status, SolveStatus::kLocallyInfeasible) << axis << sign;
    }
  }
}

TEST(Centroidal, WalksByTheScheduleOfItsFeet) {
  const Dog dog;
  const CentroidalBody body = dog.body(0.7);
  CentroidalOptions options{.duration = 0.4, .most_force = 30, .is_level = true};
  options.weights = {.com = 100, .velocity = 1, .angular = 100, .force = 1e-4};
  Problem p = centroidal_problem(body, options);
  const Gait trot{.period = 0.4, .duty = 0.5, .phases = {0, 0.5, 0.5, 0}, .velocity = {0.3, 0}};
  walk(p, body, trot);
  // Diagonal pairs, each standing where half of its stance is right below.
  const auto load = [&](const char* foot, double t) {
    return p.parameters.find(std::string(foot) + " load")(p.stage(t, {}, {}, {}))[0];
  };
  EXPECT_EQ(load("FL_FOOT", 0.1), 1);
  EXPECT_EQ(load("HR_FOOT", 0.1), 1);
  EXPECT_EQ(load("FR_FOOT", 0.1), 0);
  EXPECT_EQ(load("FL_FOOT", 0.2), 0);
  EXPECT_EQ(load("HL_FOOT", 0.2), 1);
  EXPECT_EQ(load("HL_FOOT", 0.4), 0);
  const Parameter place = p.parameters.find("FL_FOOT place");
  EXPECT_NEAR(place(p.stage(0.5, {}, {}, {})).x(), body.feet[0].place.x() + 0.3 * 0.5, 1e-12);
  ClosedLoopOptions loop = steered(4, 2, 1, 0.3);
  loop.period = 0.01;
  loop.mpc.iterations = 1;
  loop.mpc.mesh.intervals = 20;
  const ClosedLoop walked = close_loop(p, loop);
  EXPECT_EQ(walked.unusable(), 0);
  const Parameter target = p.parameters.find("com");
  double off = 0;  // after a second, and a second after the push
  for (int k = 0; k < walked.motion.points(); ++k) {
    const double t = walked.motion.t[k];
    EXPECT_LE(walked.motion.u.col(k).maxCoeff(), 30 + 1e-6);
    if (t < 1 || (t >= 2 && t < 3)) continue;
    off = std::max(off, (walked.motion.x.col(k).head(3) - target(p.stage(t, {}, {}, {}))).norm());
  }
  std::printf("trot: %.1f mm off at most\n", 1e3 * off);
  EXPECT_LT(off, 0.005);
  EXPECT_GT(walked.motion.x(0, walked.motion.points() - 1), 1.19);
}

TEST(Centroidal, LegsReachWhatTheyCan) {
  const Dog dog;
  const CentroidalBody body = dog.body();
  const auto placed = [&](const Vector3d& by) {
    Stand stand{body.com + by, {}};
    for (const CentroidalBody::Foot& foot : body.feet) stand.feet.push_back({foot.name, foot.place});
    return standing(dog.scene, dog.q, stand);
  };
  const Vector3d by(0.05, -0.04, 0.02);
  const Posture pose = placed(by);
  EXPECT_LT(pose.off, 1e-9);
  EXPECT_TRUE(pose.q.segment(3, 4).isApprox(dog.q.segment(3, 4), 1e-12));
  std::vector<HeldContact> contacts;
  for (const std::string& foot : kFeet) contacts.push_back({.frame = foot});
  const CentroidalBody there = centroidal_body(dog.scene, pose.q, contacts);
  EXPECT_LT((there.com - body.com - by).norm(), 1e-9);
  for (int i = 0; i < 4; ++i)
    EXPECT_LT((there.feet[std::size_t(i)].place - body.feet[std::size_t(i)].place).norm(), 1e-9);
  EXPECT_GT(placed({0, 0, 0.5}).off, 0.01);
  VectorXd aimless = dog.q;
  aimless.segment(3, 4).setZero();
  EXPECT_THROW(standing(dog.scene, aimless, {body.com, {}}), ArgumentError);
}

TEST(Centroidal, RefusesWhatIsNoRobotOnItsFeet) {
  const Dog dog;
  const auto refusal = [&](const auto& change) {
    CentroidalBody body = dog.body();
    CentroidalOptions options;
    change(body, options);
    return message_of<ArgumentError>([&] { centroidal_problem(body, options); });
  };
  using Body = CentroidalBody;
  using Options = CentroidalOptions;
  EXPECT_NE(refusal([](Body& b, Options&) { b.feet.clear(); }).find("no foot"), std::string::npos);
  EXPECT_NE(refusal([](Body& b, Options&) { b.mass = 0; }).find("mass is 0"), std::string::npos);
  EXPECT_NE(refusal([](Body& b, Options&) { b.gravity.setZero(); }).find("pulls down"), std::string::npos);
  EXPECT_NE(refusal([](Body& b, Options&) { b.feet[1].name = "FL_FOOT"; }).find("twice"), std::string::npos);
  EXPECT_NE(refusal([](Body& b, Options&) { b.feet[1].friction = 0; }).find("friction"), std::string::npos);
  EXPECT_NE(refusal([](Body& b, Options&) { b.feet[1].place[0] = NAN; }).find("FR_FOOT"), std::string::npos);
  EXPECT_NE(refusal([](Body&, Options& o) { o.most_force = 0; }).find("most force"), std::string::npos);
  EXPECT_NE(refusal([](Body&, Options& o) { o.weights.com = -1; }).find("weight"), std::string::npos);
  Problem p = centroidal_problem(dog.body(), {});
  const auto gait = [&](const Gait& g) { return message_of<ArgumentError>([&] { walk(p, dog.body(), g); }); };
  EXPECT_NE(gait({.phases = {0, 0.5}}).find("2 phases"), std::string::npos);
  EXPECT_NE(gait({.duty = 0, .phases = {0, 0, 0, 0}}).find("duty"), std::string::npos);
  EXPECT_NE(gait({.period = 0, .phases = {0, 0, 0, 0}}).find("period"), std::string::npos);
}

}  // namespace
}  // namespace dyntape::centroidal_test
