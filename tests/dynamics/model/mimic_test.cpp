// SPDX-License-Identifier: BSD-3-Clause
//
// Joints that follow others: the projection against explicit products with G, derivatives against differences in
// 113 bits, a file against Pinocchio, and every rule that cannot be followed.
#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algebra/float128.h>
#include <dyntape/dynamics/algorithms/mimic.h>
#include <dyntape/dynamics/model/model_operations.h>
#include <dyntape/dynamics/urdf/urdf.h>

#include "dynamics/random_robots.h"
#include "dynamics/robot_files.h"

namespace dyntape::dynamics::mimic_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Vectorq = VectorX<Float128>;
using Rules = std::vector<MimicRule>;

class Mimic : public ::testing::TestWithParam<unsigned long> {
 protected:
  static Model<double> tree(Random& random) {
    return random_tree(random, {10, random.below(2) ? Base::kFloating : Base::kFixed});
  }
  Mimic() : random(GetParam()), full(tree(random)), model(full, random_rules(full, random)), data(full) {
    data.following = following(model);
    q = random_configuration(model, random.engine);
    v = random.vector(model.nv);
    a = random.vector(model.nv, 3);
    tau = random.vector(full.nv, 3);
    q_full = expand_configuration(model, q);
    v_full = expand_tangent(model, v);
    a_full = expand_tangent(model, a);
    G = MatrixXd(full.nv, model.nv);
    for (int k = 0; k < model.nv; ++k) G.col(k) = expand_tangent(model, VectorXd::Unit(model.nv, k));
  }

  Random random;
  Model<double> full;
  MimicModel<double> model;
  Data<double> data;
  VectorXd q, v, a, tau, q_full, v_full, a_full;
  MatrixXd G;
};

// What the rules say, entry by entry.
TEST_P(Mimic, FollowersFollow) {
  EXPECT_EQ(model.nv, full.nv - static_cast<int>(model.rules.size()));
  int followed = 0;
  const auto angle = [&](const Joint<double>& joint) {
    return joint.type == JointType::kContinuous ? std::atan2(q_full[joint.idx_q + 1], q_full[joint.idx_q])
                                                : q_full[joint.idx_q];
  };
  for (const MimicRule& rule : model.rules) {
    const Joint<double>& joint = full.joints[full.joint_index(rule.joint)];
    const Joint<double>& leader = full.joints[full.joint_index(rule.leader)];
    followed += nq(joint.type);
    const double off = angle(joint) - (rule.multiplier * angle(leader) + rule.offset);
    if (joint.type == JointType::kContinuous) {
      EXPECT_NEAR(std::remainder(off, 2 * M_PI), 0, 1e-14);
      EXPECT_NEAR(std::hypot(q_full[joint.idx_q], q_full[joint.idx_q + 1]), 1, 1e-14);
    } else {
      EXPECT_NEAR(off, 0, 1e-15);
    }
    EXPECT_EQ(v_full[joint.idx_v], rule.multiplier * v_full[leader.idx_v]);
  }
  EXPECT_EQ(model.nq, full.nq - followed);
  EXPECT_EQ(G.colwise().any().count(), model.nv);
  EXPECT_LE((G * v - v_full).norm(), 1e-14);
}

TEST_P(Mimic, TheProjectionIsThatOfTheFullModel) {
  const VectorXd tau_full = rnea(full, data, q_full, v_full, a_full);
  const MatrixXd M_full = crba(full, data, q_full), M = gather_both(model, M_full);
  EXPECT_LE(relative_error(gather(model, tau_full), G.transpose() * tau_full), 1e-14);
  EXPECT_LE(relative_error(M, G.transpose() * M_full * G), 1e-14);
  EXPECT_LE(relative_error(gather_columns(model, M_full), M_full * G), 1e-15);
  const VectorXd h = gather(model, nonlinear_effects(full, data, q_full, v_full));
  EXPECT_LE(relative_error(M * a + h, gather(model, tau_full)), 1e-13);
  const double energy = kinetic_energy(full, data, q_full, v_full);
  EXPECT_NEAR(energy, 0.5 * v.dot(M * v), 1e-14 * energy);
}

TEST_P(Mimic, ForwardDynamicsInvertsInverseDynamics) {
  const VectorXd torque = rnea(full, data, q_full, v_full, a_full);
  EXPECT_LE(relative_error(aba(full, data, q_full, v_full, torque), a_full), 1e-11);
  const MatrixXd M = gather_both(model, crba(full, data, q_full)), Minv = minverse(full, data, q_full);
  EXPECT_LE(relative_error(Minv, G * M.inverse() * G.transpose()), 1e-11);
  EXPECT_EQ(Minv, Minv.transpose());
}

// By differences in 113 bits along the leaders; of torques only what reaches the leaders matters.
TEST_P(Mimic, Derivatives) {
  const Model<Float128> exact_full = full.cast<Float128>();
  const MimicModel<Float128> exact = model.cast<Float128>();
  Data<Float128> data128(exact_full);
  data128.following = following(exact);
  const Vectorq x = q.cast<Float128>(), w = v.cast<Float128>(), b = a_full.cast<Float128>(),
                t = tau.cast<Float128>();
  const Float128 h(1e-11);
  const auto torque = [&](const Vectorq& q, const Vectorq& v) -> Vectorq {
    return gather(exact, rnea<Float128>(exact_full, data128, expand_configuration<Float128>(exact, q),
                                        expand_tangent<Float128>(exact, v), b));
  };
  const auto acceleration = [&](const Vectorq& q, const Vectorq& v) -> Vectorq {
    return aba<Float128>(exact_full, data128, expand_configuration<Float128>(exact, q),
                         expand_tangent<Float128>(exact, v), t);
  };
  const auto derivatives = [&](auto f, bool by_q) {
    MatrixXd result;
    for (int k = 0; k < model.nv; ++k) {
      Vectorq e = Vectorq::Zero(model.nv);
      e[k] = h;
      const auto at = [&](const Vectorq& d) {
        return by_q ? f(integrate<Float128>(exact, x, d), w) : f(x, w + d);
      };
      const VectorXd slope = Vectorq((at(e) - at(-e)) / (2 * h)).cast<double>();
      result.conservativeResize(slope.size(), model.nv);
      result.col(k) = slope;
    }
    return result;
  };
  id_derivatives(full, data, q_full, v_full, a_full);
  EXPECT_LE(relative_error(gather_both(model, data.dtau_dq), derivatives(torque, true)), 1e-13);
  EXPECT_LE(relative_error(gather_both(model, data.dtau_dv), derivatives(torque, false)), 1e-13);
  fd_derivatives(full, data, q_full, v_full, tau);
  EXPECT_LE(relative_error(gather_columns(model, data.ddq_dq), derivatives(acceleration, true)), 1e-10);
  EXPECT_LE(relative_error(gather_columns(model, data.ddq_dv), derivatives(acceleration, false)), 1e-10);
  EXPECT_LE(relative_error(gather(model, data.tau), gather(model, tau)), 1e-11);
}

TEST_P(Mimic, Configurations) {
  const VectorXd d = random.vector(model.nv), moved = integrate(model, q, d);
  EXPECT_LE((expand_configuration(model, moved) - integrate(full, q_full, expand_tangent(model, d))).norm(),
            1e-13);
}

INSTANTIATE_TEST_SUITE_P(Seeds, Mimic, ::testing::Range(1UL, 11UL));

TEST(MimicRules, ChainsAreResolvedToTheirFirstLeader) {
  const Rules rules = resolved({{"c", "b", 2, 1}, {"b", "a", 3, -1}});
  EXPECT_EQ(rules[0].leader, "a");
  EXPECT_EQ(rules[0].multiplier, 6);
  EXPECT_EQ(rules[0].offset, -1);  // 2 (3 a - 1) + 1
  EXPECT_EQ(rules[1].leader, "a");
}

Model<double> hand() {
  Model<double> model;
  model.name = "hand";
  Random random(1);
  for (const auto& [name, type] :
       std::vector<std::pair<std::string, JointType>>{{"a", JointType::kRevolute},
                                                      {"b", JointType::kPrismatic},
                                                      {"c", JointType::kHelical},
                                                      {"wheel", JointType::kContinuous},
                                                      {"wheel_2", JointType::kContinuous},
                                                      {"ball", JointType::kSpherical}})
    model.add_joint(model.njoints() - 1, random_joint(random, name, type), {}, random_inertia(random));
  return model;
}

TEST(MimicRules, WhatCannotBeFollowed) {
  const auto error = [](const Rules& rules) {
    try {
      MimicModel<double>(hand(), rules);
    } catch (const ArgumentError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  const std::string on_a_line = "expected a revolute, continuous, prismatic or helical joint",
                    hand = "model \"hand\": joint ";
  EXPECT_EQ(error({{"c", "b", -1, 0.5}, {"b", "a"}}), "");
  EXPECT_EQ(error({{"b", "aa"}}),
            hand + "\"b\" mimics \"aa\", and no joint that moves has that name; did you mean 'a'?");
  EXPECT_EQ(error({{"bb", "a"}}),
            hand + "\"bb\" mimics \"a\", but no joint that moves has its own name; did you mean 'b'?");
  EXPECT_EQ(error({{"b", "b"}}), hand + "\"b\" mimics itself; expected another joint");
  EXPECT_EQ(error({{"a", "b"}, {"b", "c"}, {"c", "a"}}),
            hand + "\"a\" mimics \"b\", which in the end follows itself; expected no circle");
  EXPECT_EQ(
      error({{"b", "wheel"}}),
      hand +
          "\"b\" mimics \"wheel\", which is continuous, its angle known but for whole turns; expected a "
          "revolute, prismatic or helical joint, or a follower that is continuous too");
  EXPECT_EQ(error({{"wheel", "a", 0.5, 1}}), "");
  EXPECT_EQ(error({{"wheel_2", "wheel", 0.5, 1}}),
            hand +
                "\"wheel_2\" mimics \"wheel\", which is continuous, by a multiplier that is not whole "
                "(0.500000), and would jump where that ends a turn; expected 1, -1, 2, ...");
  EXPECT_NE(error({{"wheel_2", "wheel"}, {"b", "wheel_2"}})
                .find("\"b\" mimics \"wheel_2\", and so in the end \"wheel\", which is continuous"),
            std::string::npos);
  EXPECT_NE(error({{"wheel_2", "wheel", -1e300, 0}}).find("expected at most 10000"), std::string::npos);
  EXPECT_EQ(error({{"wheel_2", "wheel", 3, 0}, {"wheel", "c", 0.5, 0}, {"b", "wheel_2"}}), "");
  EXPECT_EQ(error({{"ball", "a"}}), hand + "\"ball\" mimics \"a\" but is spherical; " + on_a_line);
  EXPECT_EQ(error({{"b", "a"}, {"b", "c"}}), hand + "\"b\" has two rules to mimic another; expected one");
  EXPECT_EQ(error({{"b", "a", 1 / 0., 0}}),
            hand + "\"b\" mimics \"a\" with a multiplier or an offset that is not a finite number");
}

TEST(MimicRules, FollowersOfAHeldLeaderAreHeld) {
  Rules rules = {{"c", "b", 2, 0.5}, {"b", "a", 3, -1}};
  const Model<double> model = lock_with_followers(hand(), {"a"}, rules);
  EXPECT_TRUE(rules.empty());
  ASSERT_EQ(model.njoints(), 3);
  const Model<double> expected =
      lock_joints(hand(), {"a", "b", "c"}, (VectorXd(11) << 0, -1, -1.5, 1, 0, 1, 0, 0, 0, 0, 1).finished());
  EXPECT_EQ(model.X_PJ[0].p, expected.X_PJ[0].p);
  EXPECT_EQ(model.X_PJ[0].R, expected.X_PJ[0].R);
  rules = {{"b", "a"}};
  EXPECT_THROW(lock_with_followers(hand(), {"b"}, rules), ArgumentError);
  EXPECT_EQ(lock_with_followers(hand(), {"wheel"}, rules).njoints(), 5);
  EXPECT_EQ(rules.size(), 1u);
  rules = {{"wheel_2", "wheel", -1, 0.5}};
  const Model<double> turned = lock_with_followers(hand(), {"wheel"}, rules);
  EXPECT_EQ(turned.njoints(), 4);
  EXPECT_TRUE(rules.empty());
  const Model<double> held =
      lock_joints(hand(), {"wheel", "wheel_2"},
                  (VectorXd(11) << 0, 0, 0, 1, 0, std::cos(0.5), std::sin(0.5), 0, 0, 0, 1).finished());
  EXPECT_EQ(turned.X_PJ[3].R, held.X_PJ[3].R);
}

// Pinocchio 4.1 with mimic = True.
TEST(MimicFiles, FingersOfThePanda) {
  const UrdfRobot robot = read_urdf(robot_file("panda"), {.snap = 0, .mimic = true});
  ASSERT_EQ(robot.mimics.size(), 1u);
  const MimicModel<double> model(robot.model, robot.mimics);
  ASSERT_EQ(model.nq, 8);
  ASSERT_EQ(model.nv, 8);
  VectorXd q(8), v(8), a(8), expected(8);
  for (int k = 0; k < 8; ++k) {
    q[k] = 0.1 * std::sin(k + 1);
    v[k] = 0.2 * std::cos(k);
    a[k] = 0.3 * std::sin(2. * k);
  }
  expected << 9.7770850014253854e-03, -9.1219159531153302e+00, 6.8414751817239813e-02,
      -6.0621267341118146e-01, 7.6452691346926976e-02, 1.9340840549697509e+00, 3.2046743771539888e-03,
      8.7409893971168249e-03;
  Data<double> data(model.full);
  const VectorXd q_full = expand_configuration(model, q);
  const VectorXd tau = rnea(model.full, data, q_full, expand_tangent(model, v), expand_tangent(model, a));
  EXPECT_LE(relative_error(gather(model, tau), expected), 1e-14);
  EXPECT_NEAR(gather_both(model, crba(model.full, data, q_full))(7, 7), 0.03, 1e-16);
  // Without the option it is two joints and a note.
  EXPECT_EQ(load_urdf(robot_file("panda")).nq, 9);
  EXPECT_TRUE(read_urdf(robot_file("panda")).mimics.empty());
  EXPECT_EQ(read_urdf(robot_file("panda"), {.lock = {"panda_finger_joint1"}, .mimic = true}).model.nv, 7);
}

// Two joints; the second may mimic.
std::string two_joints(const std::string& first, const std::string& mimic) {
  const std::string limit = "<limit lower='-1' upper='1' velocity='1' effort='1'/>";
  return "<robot name='r'><link name='l0'/>\n<joint name='a' type='" + first +
         "'><parent link='l0'/><child link='l1'/>" + limit + "</joint><link name='l1'/>\n" +
         "<joint name='b' type='revolute'><parent link='l1'/><child link='l2'/>" + limit + "\n" + mimic +
         "</joint><link name='l2'/></robot>";
}

TEST(MimicFiles, RulesAreReadOrRefusedWithTheirLine) {
  const auto error = [](const std::string& first, const std::string& mimic) {
    try {
      read_urdf_text(two_joints(first, mimic), "t.urdf", {.mimic = true});
    } catch (const FileError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  const UrdfRobot robot = read_urdf_text(
      two_joints("revolute", "<mimic joint='a' multiplier='-2' offset='.5'/>"), "t.urdf", {.mimic = true});
  ASSERT_EQ(robot.mimics.size(), 1u);
  EXPECT_EQ(robot.mimics[0].multiplier, -2);
  EXPECT_EQ(robot.mimics[0].offset, 0.5);
  EXPECT_TRUE(robot.notes.empty());
  EXPECT_EQ(error("revolute", "<mimic joint='aa'/>"),
            "t.urdf:4: joint \"b\" mimics \"aa\", and there is no such joint; did you mean 'a'?");
  EXPECT_EQ(error("fixed", "<mimic joint='a'/>"),
            "t.urdf:4: joint \"b\" mimics \"a\", which is fixed; expected a joint that moves");
  EXPECT_EQ(error("continuous", "<mimic joint='a'/>"),
            "t.urdf:4: joint \"b\" mimics \"a\", which is continuous, its angle known but for whole turns; "
            "expected "
            "a revolute, prismatic or helical joint, or a follower that is continuous too");
  EXPECT_EQ(error("revolute", "<mimic joint='b'/>"),
            "t.urdf:4: joint \"b\" mimics itself; expected another joint");
}

}  // namespace
}  // namespace dyntape::dynamics::mimic_test
