// SPDX-License-Identifier: BSD-3-Clause
//
// Operations on models against the dynamics of the model they came from, for all robots of config/robots.
#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/model/model_operations.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <gtest/gtest.h>

#include "dynamics/reference_dynamics.h"
#include "dynamics/robot_files.h"

namespace dyntape::dynamics::model_operations_test {
namespace {

using Eigen::MatrixXd;
using Vector3d = Vector3<double>;
using Eigen::VectorXd;
using reference::body_states;
using reference::BodyState;

constexpr int kSeed = 11;

class Operations : public ::testing::TestWithParam<std::string> {
 protected:
  Model<double> floating() const { return load_urdf(robot_file(GetParam()), {.base = Base::kFloating}); }
  Model<double> fixed() const { return load_urdf(robot_file(GetParam())); }
  std::mt19937 random_{kSeed};
};

Placement<double> frame_in_world(const Model<double>& m, const std::vector<BodyState>& states, int frame) {
  const Frame<double>& f = m.frames[frame];
  if (f.body < 0) return f.X_BF;
  return Placement<double>{states[f.body].R, states[f.body].p} * f.X_BF;
}

double distance(const Placement<double>& a, const Placement<double>& b) {
  return (a.R - b.R).norm() + (a.p - b.p).norm();
}

// 0 stands for a pass within relative rounding.
double relative(const VectorXd& got, const VectorXd& expected) {
  return (got - expected).norm() / (1 + expected.norm());
}

// q, v or tau of `to` from those of `from`, joint by joint, by name; joints missing in `from` stay as they
// are.
template <class Size, class Index>
void copy_joints(const Model<double>& from, const VectorXd& x, const Model<double>& to, VectorXd& y,
                 Size size, Index index) {
  for (const Joint<double>& joint : to.joints)
    for (const Joint<double>& other : from.joints)
      if (joint.name == other.name)
        y.segment(index(joint), size(joint.type)) = x.segment(index(other), size(joint.type));
}
VectorXd q_for(const Model<double>& to, const Model<double>& from, const VectorXd& q) {
  VectorXd y = VectorXd::Zero(to.nq);
  copy_joints(
      from, q, to, y, [](JointType t) { return nq(t); }, [](const auto& j) { return j.idx_q; });
  return y;
}
VectorXd v_for(const Model<double>& to, const Model<double>& from, const VectorXd& v) {
  VectorXd y = VectorXd::Zero(to.nv);
  copy_joints(
      from, v, to, y, [](JointType t) { return nv(t); }, [](const auto& j) { return j.idx_v; });
  return y;
}

TEST_P(Operations, LockedJointsAreJointsAtRest) {
  for (const Model<double>& full : {fixed(), floating()}) {
    for (int trial = 0; trial < 10; ++trial) {
      std::vector<std::string> names;
      for (const Joint<double>& joint : full.joints)
        if (random_() % 3 == 0) names.push_back(joint.name);
      const VectorXd q = reference::random_configuration(full, random_);
      const Model<double> reduced = lock_joints(full, names, q);
      ASSERT_EQ(reduced.njoints(), full.njoints() - static_cast<int>(names.size()));
      const VectorXd v = reference::random_vector(reduced.nv, random_);
      const VectorXd a = reference::random_vector(reduced.nv, random_);
      const VectorXd v_full = v_for(full, reduced, v), a_full = v_for(full, reduced, a);
      const VectorXd expected = v_for(reduced, full, reference::inverse_dynamics(full, q, v_full, a_full));
      const VectorXd q_reduced = q_for(reduced, full, q);
      ASSERT_LT(relative(reference::inverse_dynamics(reduced, q_reduced, v, a), expected), 1e-13)
          << "seed " << kSeed << ", trial " << trial;

      const auto states = body_states(reduced, q_reduced, v, a),
                 states_full = body_states(full, q, v_full, a_full);
      for (size_t f = 0; f < full.frames.size(); ++f)
        ASSERT_LT(distance(frame_in_world(reduced, states, f), frame_in_world(full, states_full, f)), 1e-13);
    }
  }
}

TEST_P(Operations, LockingNothingChangesNothing) {
  const Model<double> model = floating(), same = lock_joints(model, {}, VectorXd::Zero(model.nq));
  ASSERT_EQ(same.njoints(), model.njoints());
  for (int i = 0; i < model.njoints(); ++i) {
    EXPECT_EQ(same.joints[i].name, model.joints[i].name);
    EXPECT_EQ(same.parent[i], model.parent[i]);
    EXPECT_EQ(same.X_PJ[i].R, model.X_PJ[i].R);
    EXPECT_EQ(same.X_PJ[i].p, model.X_PJ[i].p);
    EXPECT_EQ(same.inertias[i].com, model.inertias[i].com);
    EXPECT_EQ(same.inertias[i].I_c, model.inertias[i].I_c);
  }
}

TEST_P(Operations, LockingEverythingLeavesOneBody) {
  const Model<double> model = floating();
  std::vector<std::string> names;
  for (int i = 1; i < model.njoints(); ++i) names.push_back(model.joints[i].name);
  const VectorXd q = reference::random_configuration(model, random_);
  const Model<double> body = lock_joints(model, names, q);
  double mass = 0;
  for (const auto& inertia : model.inertias) mass += inertia.mass;
  ASSERT_EQ(body.njoints(), 1);
  EXPECT_NEAR(body.inertias[0].mass, mass, 1e-13 * mass);
  names.push_back(model.joints[0].name);
  EXPECT_EQ(lock_joints(model, names, q).nv, 0);
}

double kinetic_energy(const Model<double>& m, const VectorXd& q, const VectorXd& v) {
  return 0.5 * v.dot(reference::mass_matrix(m, q) * v);
}

double potential_energy(const Model<double>& m, const std::vector<BodyState>& states) {
  double energy = 0;
  for (int i = 0; i < m.njoints(); ++i)
    energy -= m.inertias[i].mass * m.gravity.dot(states[i].position(m.inertias[i].com));
  return energy;
}

// The state of `model` at which it stands and moves as `old` does at (q, v), with `frame` as its base.
std::pair<VectorXd, VectorXd> moved_state(const Model<double>& model, const Model<double>& old,
                                          const VectorXd& q, const VectorXd& v, int frame) {
  VectorXd q_new = q_for(model, old, q), v_new = v_for(model, old, v);
  const auto states = body_states(old, q, v, VectorXd::Zero(old.nv));
  const Placement<double> X = frame_in_world(old, states, frame);
  const BodyState& body = states[old.frames[frame].body];
  q_new.head<3>() = X.p;
  q_new.segment<4>(3) = Eigen::Quaterniond(X.R).coeffs();
  v_new.head<3>() = X.R.transpose() * body.velocity(old.frames[frame].X_BF.p);
  v_new.segment<3>(3) = X.R.transpose() * body.w;
  return {q_new, v_new};
}

TEST_P(Operations, AnotherBaseIsTheSameRobot) {
  const Model<double> old = floating();
  for (size_t f = 0; f < old.frames.size(); f += std::max<size_t>(1, old.frames.size() / 8)) {
    const std::string& name = old.frames[f].name;
    const Model<double> model = change_base(old, name, Base::kFloating);
    ASSERT_EQ(model.nv, old.nv);
    const VectorXd q = reference::random_configuration(old, random_),
                   v = reference::random_vector(old.nv, random_);
    const auto [q_new, v_new] = moved_state(model, old, q, v, f);
    const VectorXd zero = VectorXd::Zero(old.nv);
    const auto states = body_states(model, q_new, v_new, zero), states_old = body_states(old, q, v, zero);
    for (size_t k = 0; k < old.frames.size(); ++k)
      ASSERT_LT(distance(frame_in_world(model, states, k), frame_in_world(old, states_old, k)), 1e-13)
          << name;
    const double T = kinetic_energy(old, q, v), U = potential_energy(old, states_old);
    ASSERT_NEAR(kinetic_energy(model, q_new, v_new), T, 1e-13 * (1 + T)) << name << ", seed " << kSeed;
    ASSERT_NEAR(potential_energy(model, states), U, 1e-12 * (1 + std::abs(U))) << name;
  }
}

// Driven by its joints alone, a robot does the same whatever its base is called.
TEST_P(Operations, AnotherBaseFeelsTheSameTorques) {
  const Model<double> old = floating();
  const MatrixXd M = reference::mass_matrix(old, reference::random_configuration(old, random_));
  const VectorXd inertias = M.selfadjointView<Eigen::Lower>().eigenvalues();
  if (inertias.minCoeff() < 1e-12 * inertias.maxCoeff())
    GTEST_SKIP() << "a free floating base of point masses has no forward dynamics";
  for (size_t f = 0; f < old.frames.size(); f += std::max<size_t>(1, old.frames.size() / 4)) {
    const Model<double> model = change_base(old, old.frames[f].name, Base::kFloating);
    const VectorXd q = reference::random_configuration(old, random_),
                   v = reference::random_vector(old.nv, random_);
    VectorXd tau = 10 * reference::random_vector(old.nv, random_);
    tau.head<6>().setZero();
    const auto [q_new, v_new] = moved_state(model, old, q, v, f);
    VectorXd expected = reference::forward_dynamics(old, q, v, tau);
    VectorXd got = reference::forward_dynamics(model, q_new, v_new, v_for(model, old, tau));
    expected = v_for(model, old, expected);
    ASSERT_LT(relative(got.tail(got.size() - 6), expected.tail(got.size() - 6)), 1e-9)
        << old.frames[f].name << ", seed " << kSeed;
  }
}

TEST_P(Operations, AFixedBaseIsAFloatingOneLocked) {
  const Model<double> old = floating();
  const std::string& name = old.frames.back().name;
  const Model<double> fixed = change_base(old, name, Base::kFixed);
  const Model<double> floats = change_base(old, name, Base::kFloating);
  VectorXd neutral = VectorXd::Zero(floats.nq);
  neutral[6] = 1;
  const Model<double> locked = lock_joints(floats, {"root_joint"}, neutral);
  ASSERT_EQ(fixed.nv, old.nv - 6);
  const VectorXd q = reference::random_configuration(fixed, random_);
  const VectorXd v = reference::random_vector(fixed.nv, random_),
                 a = reference::random_vector(fixed.nv, random_);
  EXPECT_EQ(reference::inverse_dynamics(fixed, q, v, a), reference::inverse_dynamics(locked, q, v, a));
  EXPECT_LT(distance(fixed.frames[fixed.frame_index(name)].X_BF, {}), 1e-14);
}

TEST_P(Operations, ThereAndBackAgain) {
  const Model<double> old = floating();
  const Model<double> there = change_base(old, old.frames.back().name, Base::kFloating);
  const Model<double> back = change_base(there, old.frames.front().name, Base::kFloating);
  const VectorXd q = reference::random_configuration(old, random_);
  const VectorXd v = reference::random_vector(old.nv, random_), a = reference::random_vector(old.nv, random_);
  const VectorXd tau =
      reference::inverse_dynamics(back, q_for(back, old, q), v_for(back, old, v), v_for(back, old, a));
  EXPECT_LT(relative(v_for(old, back, tau), reference::inverse_dynamics(old, q, v, a)), 1e-13)
      << "seed " << kSeed;
  for (const Joint<double>& joint : old.joints)
    EXPECT_EQ(back.joints[back.joint_index(joint.name)].axis, joint.axis);
}

TEST_P(Operations, GravityIsReplaced) {
  const Model<double> model = floating(), tilted = with_gravity(model, {1, 2, -9});
  const VectorXd q = reference::random_configuration(model, random_), zero = VectorXd::Zero(model.nv);
  double mass = 0;
  for (const auto& inertia : model.inertias) mass += inertia.mass;
  const VectorXd tau = reference::inverse_dynamics(tilted, q, zero, zero);
  EXPECT_NEAR(tau.head<3>().norm(), mass * Vector3d(1, 2, -9).norm(), 1e-12 * mass);
  EXPECT_EQ(model.gravity, Vector3d(0, 0, -9.81));
}

INSTANTIATE_TEST_SUITE_P(Robots, Operations, ::testing::ValuesIn(robot_names()),
                         [](const auto& info) { return info.param; });

TEST(ModelOperations, SayWhatIsWrong) {
  const Model<double> arm = load_urdf(robot_file("panda"));
  const VectorXd q = VectorXd::Zero(arm.nq);
  EXPECT_THROW(lock_joints(arm, {"panda_joint"}, q), ArgumentError);
  EXPECT_THROW(lock_joints(arm, {}, VectorXd::Zero(3)), ArgumentError);
  EXPECT_THROW(lock_joints(arm, {"panda_joint1"}, VectorXd::Constant(arm.nq, NAN)), ArgumentError);
  EXPECT_THROW(change_base(arm, "panda_hand", Base::kFixed), ArgumentError);
  EXPECT_THROW(with_gravity(arm, {0, 0, INFINITY}), ArgumentError);
  const Model<double> dog = load_urdf(robot_file("solo12"), {.base = Base::kFloating});
  EXPECT_THROW(change_base(dog, "FL_FOOTT", Base::kFixed), ArgumentError);
  EXPECT_THROW(lock_joints(dog, {"root_joint"}, VectorXd::Zero(dog.nq)), ArgumentError);  // quaternion 0
}

TEST(ModelOperations, LockedAtLoadOrAfterwards) {
  const std::vector<std::string> fingers = {"panda_finger_joint1", "panda_finger_joint2"};
  const Model<double> at_load = load_urdf(robot_file("panda"), {.lock = fingers});
  const Model<double> whole = load_urdf(robot_file("panda"));
  const Model<double> after = lock_joints(whole, fingers, VectorXd::Zero(whole.nq));
  ASSERT_EQ(at_load.nv, 7);
  ASSERT_EQ(after.nv, 7);
  EXPECT_EQ(at_load.inertias[6].I_c, after.inertias[6].I_c);
  EXPECT_NEAR(at_load.inertias[6].mass, 0.735522 + 0.73 + 2 * 0.015, 1e-15);
  EXPECT_EQ(at_load.frames.size(), whole.frames.size());
}

TEST(ModelOperations, ContinuousJointsTurnRoundAndLock) {
  const std::string text =
      "<robot name='r'><link name='a'><inertial><mass value='2'/><inertia ixx='1' ixy='.1' ixz='.2' "
      "iyy='1.2' "
      "iyz='.3' izz='1.4'/></inertial></link><joint name='j' type='continuous'><parent link='a'/><child "
      "link='b'/>"
      "<origin xyz='1 2 3' rpy='.1 .2 .3'/><axis xyz='1 2 3'/></joint><link name='b'><inertial><origin "
      "xyz='.1 .2 .3'/><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial>"
      "</link></robot>";
  const Model<double> old = load_urdf_text(text, "t.urdf", {.base = Base::kFloating});
  const Model<double> hung = change_base(old, "b", Base::kFixed);
  std::mt19937 random(kSeed);
  for (int i = 0; i < 20; ++i) {
    const VectorXd q = reference::random_configuration(old, random);
    const auto states = body_states(old, q, VectorXd::Zero(7), VectorXd::Zero(7));
    const auto states_hung = body_states(hung, q.tail<2>(), VectorXd::Zero(1), VectorXd::Zero(1));
    const Placement<double> X_ba = inverse(frame_in_world(old, states, 1)) * frame_in_world(old, states, 0);
    ASSERT_LT(distance(frame_in_world(hung, states_hung, 0), X_ba), 1e-14);
    const Model<double> stiff = lock_joints(old, {"j"}, q);
    ASSERT_LT(distance(inverse(stiff.frames[1].X_BF) * stiff.frames[0].X_BF, X_ba), 1e-14);
  }
}

}  // namespace
}  // namespace dyntape::dynamics::model_operations_test
