// SPDX-License-Identifier: BSD-3-Clause
//
// Balls and bars that keep clear of each other: distances against brute force, derivatives against differences.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/motion/capsules.h>
#include "autodiff/dense.h"
#include "dynamics/robot_files.h"

namespace dyntape::terms_clear_test {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr unsigned kSeed = 9;

// A point that slides along the axes of the world: what is fixed to it is where q says.
RobotScene gantry() {
  dynamics::Model<double> model;
  model.name = "gantry";
  const Vector3d axes[] = {Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ()};
  for (int i = 0; i < 3; ++i) {
    dynamics::Joint<double> joint;
    joint.name = std::string(1, "xyz"[i]);
    joint.type = dynamics::JointType::kPrismatic;
    joint.axis = axes[i];
    model.add_joint(i - 1, joint, {}, {1, Vector3d(0, 0, 0), Eigen::Matrix3d(Eigen::Matrix3d::Identity())});
  }
  model.frames.push_back({"world", -1, {}});
  model.frames.push_back({"tool", 2, {}});
  return {model};
}

Stage<double> stage_of(const Vector3d& q) {
  Stage<double> s;
  s.x = VectorXd::Zero(6);
  s.x.head(3) = q;
  return s;
}

class Pairs : public ::testing::Test {
 protected:
  Vector3d drawn() { return {uniform_(random_), uniform_(random_), uniform_(random_)}; }

  // The least distance of two segments over a grid of points; not below the true one.
  static double sampled(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
    double least = HUGE_VAL;
    constexpr int kSamples = 400;
    for (int i = 0; i <= kSamples; ++i) {
      const Vector3d p = a + (b - a) * i / kSamples;
      for (int k = 0; k <= kSamples; ++k) least = std::min(least, (p - (c + (d - c) * k / kSamples)).norm());
    }
    return least;
  }

  RobotScene scene_ = gantry();
  std::mt19937_64 random_{kSeed};
  std::uniform_real_distribution<double> uniform_{-1, 1};
};

TEST_F(Pairs, DistancesAreThoseOfBruteForce) {
  for (int k = 0; k < 120; ++k) {
    const Vector3d q = drawn(), a = drawn(), c = drawn();
    Vector3d b = drawn(), d = drawn();
    if (k % 6 == 1) b = a;
    if (k % 6 == 2) d = c;
    if (k % 6 == 3) b = a, d = c;
    if (k % 6 == 4) d = c + (b - a) * (0.2 + std::abs(uniform_(random_)));  // parallel
    if (k % 6 == 5) d = c - (b - a);                                        // and the other way round
    const double least = sampled(a + q, b + q, c, d);
    for (const bool swapped : {false, true}) {
      Capsule moved = capsule("moved", "tool", a, b, 0.1), fixed = capsule("fixed", kWorld, c, d, 0.2);
      if (swapped) std::swap(moved, fixed);
      const double gap = clearance(scene_.model, q, moved, fixed) + 0.3;
      // A grid misses the nearest points by half a step at most, and the distance by that where they touch.
      EXPECT_LE(gap, least + 1e-12) << "pair " << k;
      EXPECT_GE(gap, least - 0.006) << "pair " << k;
      if (gap > 0.2) {
        EXPECT_GE(gap, least - 1e-4) << "pair " << k;
      }
      const double apart = 0.1 + 0.2 + 0.05;
      const VectorXd row = keep_clear(scene_, moved, fixed, 0.05).function(stage_of(q));
      EXPECT_NEAR(row[0], (gap * gap / apart - apart) / 2, 1e-12) << "pair " << k;
    }
  }
}

// First order: at contact the row is the clearance, and falls as fast.
TEST_F(Pairs, TheRowIsTheClearanceNearContact) {
  const Term term = keep_clear(scene_, sphere("a", "tool", Vector3d::Zero(), 0.1),
                               sphere("b", kWorld, Vector3d::Zero(), 0.2));
  EXPECT_NEAR(term.function(stage_of({0.3, 0, 0}))[0], 0, 1e-16);
  EXPECT_NEAR(term.function(stage_of({0.301, 0, 0}))[0], 0.001, 2e-6);
  EXPECT_NEAR(term.function(stage_of({0, -0.299, 0}))[0], -0.001, 2e-6);
  EXPECT_EQ(term.lower[0], 0);
  EXPECT_EQ(term.upper[0], HUGE_VAL);
}

TEST_F(Pairs, SlopesAndCurvaturesAreFiniteEverywhereAndRight) {
  const auto recorded = [](const StageFunction& f) {
    return record("gap", 6, [&](const VectorXad& x) {
      Stage<AD> s;
      s.x = x;
      return f(s);
    });
  };
  for (int kind = 0; kind < 3; ++kind) {
    const Capsule moved = kind == 0 ? sphere("a", "tool", {0.1, 0, 0}, 0.1)
                                    : capsule("a", "tool", {0.1, 0, 0}, {-0.2, 0.3, 0.4}, 0.1);
    const Capsule fixed = kind == 2 ? capsule("b", kWorld, {0.5, 0.2, 0}, {-0.3, 0.1, 0.2}, 0.2)
                                    : sphere("b", kWorld, {0.2, 0.2, 0.2}, 0.2);
    const StageFunction gap = keep_clear(scene_, moved, fixed).function;
    const Function f = recorded(gap);
    for (int k = 0; k < 30; ++k) {
      const Vector3d q = drawn();
      const VectorXd x = stage_of(q).x;
      const MatrixXd J = testing::jacobian(f, {x.begin(), x.end()});
      for (int i = 0; i < 3; ++i) {
        const Vector3d h = 1e-5 * Vector3d::Unit(i);
        const double slope = (gap(stage_of(q + h))[0] - gap(stage_of(q - h))[0]) / 2e-5;
        EXPECT_NEAR(J(0, i), slope, 2e-4) << "kind " << kind << ", draw " << k;
      }
      EXPECT_EQ(J.rightCols(3), MatrixXd::Zero(1, 3));
    }
    // Where the segments touch, and where both of their ends do.
    for (const Vector3d& q :
         {Vector3d(0, 0, 0), Vector3d(fixed.from - moved.from), Vector3d(fixed.to - moved.to)}) {
      const VectorXd x = stage_of(q).x;
      EXPECT_TRUE(testing::jacobian(f, {x.begin(), x.end()}).allFinite()) << kind;
      EXPECT_TRUE(testing::hessian(f, {x.begin(), x.end()}, {1.0}).allFinite()) << kind;
    }
  }
  // Centres on each other: no slope, and as far inside as can be.
  const StageFunction gap =
      keep_clear(scene_, sphere("a", "tool", {0.1, 0, 0}, 0.1), sphere("b", kWorld, {0.1, 0, 0}, 0.2))
          .function;
  EXPECT_NEAR(gap(stage_of(Vector3d::Zero()))[0], -0.15, 1e-16);
  EXPECT_EQ(testing::jacobian(recorded(gap), std::vector<double>(6, 0.0)), MatrixXd::Zero(1, 6));
  // Parallel bars: the values meet from both sides of the parallel.
  const auto turned = [&](double angle) {
    return clearance(scene_.model, Vector3d(0, 0, 0.3), capsule("a", "tool", {0, 0, 0}, {1, 0, 0}, 0.1),
                     capsule("b", kWorld, {0, 0, 0}, {std::cos(angle), std::sin(angle), 0}, 0.1));
  };
  for (double angle : {-1e-4, -1e-5, -1e-6, 0.0, 1e-9, 1e-6, 1e-5, 1e-4})
    EXPECT_NEAR(turned(angle), 0.1, 1e-8) << angle;
}

// Bars that cross at an angle of a thousandth of a degree and less touch: their distance is zero but for what is documented.
TEST_F(Pairs, NearlyParallelBarsMeetWhereTheyCross) {
  for (double angle : {1e-3, 1e-4, 3e-5, 9e-6, 1e-6, 2e-7, 9e-8, 1e-8}) {
    for (double length : {0.1, 1.0, 3.0}) {
      const Vector3d along(std::cos(angle), std::sin(angle), 0), half = along * length / 2;
      const double gap = clearance(scene_.model, Vector3d::Zero(), capsule("a", "tool", -half, half, 0.1),
                                   capsule("b", kWorld, {-length / 2, 0, 0}, {length / 2, 0, 0}, 0.1)) +
                         0.2;
      EXPECT_LT(gap, 5.1e-8 * length) << angle << " " << length;
      EXPECT_GE(gap, -1e-15);
    }
  }
}

TEST_F(Pairs, ErrorsSayWhatIsWrong) {
  const auto says = [&](const Capsule& a, const Capsule& b, double least, const char* part) {
    try {
      keep_clear(scene_, a, b, least);
      ADD_FAILURE() << "nothing thrown for " << part;
    } catch (const ArgumentError& e) {
      EXPECT_NE(std::string(e.what()).find(part), std::string::npos) << e.what();
    }
  };
  const Vector3d zero = Vector3d::Zero();
  const Capsule tool = sphere("hand", "tool", zero, 0.1), post = sphere("post", kWorld, zero, 0.1);
  says(sphere("hand", "tol", zero, 0.1), post, 0, "tool");
  says(sphere("hand", "tool", zero, 0), post, 0, "\"hand\": the radius is 0.0");
  says(sphere("hand", "tool", {0, NAN, 0}, 1), post, 0, "no finite number");
  says(tool, post, -1, "expected zero or more");
  says(tool, tool, 0, "no joint moves");
  says(sphere("base", "world", zero, 0.1), post, 0, "no joint moves \"base\" against \"post\"");
}

}  // namespace
}  // namespace dyntape::terms_clear_test
