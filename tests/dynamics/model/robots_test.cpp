// SPDX-License-Identifier: BSD-3-Clause
//
// The robots of config/robots against published numbers: masses, joints, inverse and forward dynamics in one
// state, computed with Pinocchio from the sources that config/robots/README.md names.
//   k-th moving joint of the file (not of the model, which sorts by name), k = 1 .. n: q = 0.1 sin k, v = 0.2
//   cos k, a = 0.3 sin 2k; gravity (0, 0, -9.81) floating base: position (.3, -.2, .5), quaternion (.1, -.3,
//   .2, sqrt .86), velocity (.1 .. .6), acceleration (.6 .. .1), all in the body frame
#include <dyntape/dynamics/urdf/urdf.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <map>

#include "dynamics/reference_dynamics.h"
#include "dynamics/robot_files.h"

namespace dyntape::dynamics::robots_test {
namespace {

using Eigen::VectorXd;

// Moving joints of a robot in the order of its file.
std::vector<int> file_order(const Model<double>& model, const std::string& path) {
  std::ifstream file(path);
  const std::string text(std::istreambuf_iterator<char>(file), {});
  std::map<size_t, int> by_position;
  for (int i = 0; i < model.njoints(); ++i)
    if (model.joints[i].type != JointType::kFreeFlyer)
      by_position[text.find("<joint name=\"" + model.joints[i].name + "\"")] = i;
  std::vector<int> order;
  for (const auto& [position, joint] : by_position) order.push_back(joint);
  return order;
}

struct State {
  VectorXd q, v, a;
};

State check_state(const Model<double>& model, const std::vector<int>& order) {
  State s{VectorXd::Zero(model.nq), VectorXd::Zero(model.nv), VectorXd::Zero(model.nv)};
  if (model.joints[0].type == JointType::kFreeFlyer) {
    s.q.head<7>() << 0.3, -0.2, 0.5, 0.1, -0.3, 0.2, std::sqrt(0.86);
    s.v.head<6>() << 0.1, 0.2, 0.3, 0.4, 0.5, 0.6;
    s.a.head<6>() << 0.6, 0.5, 0.4, 0.3, 0.2, 0.1;
  }
  for (size_t k = 1; k <= order.size(); ++k) {
    const Joint<double>& joint = model.joints[order[k - 1]];
    s.q[joint.idx_q] = 0.1 * std::sin(k);
    s.v[joint.idx_v] = 0.2 * std::cos(k);
    s.a[joint.idx_v] = 0.3 * std::sin(2. * k);
  }
  return s;
}

struct Check {
  const char* robot;
  Base base;
  std::vector<std::string> lock;
  int joints;                              // moving, without the free-flyer
  double mass;                             // all links
  double tau_1, tau_n, tau_norm, fd_norm;  // first and last moving joint; norms over nv
};

const std::vector<std::string> kFingers = {"panda_finger_joint1", "panda_finger_joint2"};

const Check kChecks[] = {
    {"ur5", Base::kFixed, {}, 6, 20.9939, 1.23696907278, -0.00306355635868, 61.9413585941, 38.6155474},
    {"panda", Base::kFixed, kFingers, 7, 17.4519, 0.0353996495952, 0.0064488579556, 11.2050171198,
     58.05905232},
    {"iiwa14", Base::kFixed, {}, 7, 30.61, 0.00363309304864, 0.000318157546768, 11.7249725635, 12.8201413},
    {"solo12",
     Base::kFixed,
     {},
     12,
     2.50000279,
     0.103696489828,
     -0.00591510993312,
     0.204162198435,
     48.62038715},
    {"solo12",
     Base::kFloating,
     {},
     12,
     2.50000279,
     0.111534056881,
     -0.0297658774693,
     26.4484993724,
     10.56328469},
    {"simple_humanoid",
     Base::kFloating,
     {},
     29,
     130.8,
     19.7733948444,
     0.485968133237,
     1384.08327485,
     9.837361981},
    {"g1", Base::kFloating, {}, 29, 33.3411, -12.5111991066, 0.0399973657231, 352.83592141, 10.83881621},
    {"talos", Base::kFloating, {}, 32, 90.2722, -0.851220884279, 0.110859488416, 958.011799375, 10.45142377}};

class Robots : public ::testing::TestWithParam<Check> {};

// Half a unit in the last of `digits` printed digits.
double near(double printed, double digits) {
  return 0.5 * std::pow(10, std::floor(std::log10(std::abs(printed))) + 1 - digits);
}

TEST_P(Robots, MassesAndJoints) {
  const Check& c = GetParam();
  Model<double> whole = load_urdf(robot_file(c.robot), {.base = Base::kFloating});
  double mass = 0;
  for (const auto& inertia : whole.inertias) mass += inertia.mass;
  EXPECT_NEAR(mass, c.mass, 5e-5);
  const Model<double> model = load_urdf(robot_file(c.robot), {.base = c.base, .lock = c.lock});
  const int base = c.base == Base::kFloating ? 1 : 0;
  EXPECT_EQ(model.nv, c.joints + 6 * base);
  EXPECT_EQ(model.nq, c.joints + 7 * base);
  EXPECT_EQ(model.njoints(), c.joints + base);
}

TEST_P(Robots, DynamicsInTheCheckState) {
  const Check& c = GetParam();
  for (const double snap : {0.0, 1e-8}) {
    const Model<double> model =
        load_urdf(robot_file(c.robot), {.base = c.base, .lock = c.lock, .snap = snap});
    const std::vector<int> order = file_order(model, robot_file(c.robot));
    ASSERT_EQ(static_cast<int>(order.size()), c.joints);
    const State s = check_state(model, order);
    const VectorXd tau = reference::inverse_dynamics(model, s.q, s.v, s.a);
    // Rounding of our own; snapped angles move by up to 5e-12 rad, and figures far below the norm feel it.
    const double slack = (snap > 0 ? 5e-12 : 1e-14) * c.tau_norm;
    EXPECT_NEAR(tau[model.joints[order.front()].idx_v], c.tau_1, near(c.tau_1, 12) + slack);
    EXPECT_NEAR(tau[model.joints[order.back()].idx_v], c.tau_n, near(c.tau_n, 12) + slack);
    EXPECT_NEAR(tau.norm(), c.tau_norm, near(c.tau_norm, 12) + slack);
    const VectorXd a = reference::forward_dynamics(model, s.q, s.v, VectorXd::Zero(model.nv));
    EXPECT_NEAR(a.norm(), c.fd_norm, near(c.fd_norm, 9));
  }
}

INSTANTIATE_TEST_SUITE_P(All, Robots, ::testing::ValuesIn(kChecks), [](const auto& info) {
  return std::string(info.param.robot) + (info.param.base == Base::kFloating ? "_floating" : "_fixed");
});

// Kelly's equations of the cart-pole, in closed form.
TEST(OwnRobots, CartPole) {
  const Model<double> model = load_urdf(robot_file("cart_pole"));
  const double m1 = 1, m2 = 0.3, l = 0.5, g = 9.81;
  std::mt19937 random(3);
  for (int i = 0; i < 100; ++i) {
    const VectorXd q = 3 * reference::random_vector(2, random), v = 5 * reference::random_vector(2, random);
    const double u = 20 * reference::random_vector(1, random)[0];
    const double s = std::sin(q[1]), c = std::cos(q[1]), d = m1 + m2 * s * s;
    const Eigen::Vector2d expected((l * m2 * s * v[1] * v[1] + u + m2 * g * c * s) / d,
                                   -(l * m2 * c * s * v[1] * v[1] + u * c + (m1 + m2) * g * s) / (l * d));
    const VectorXd a = reference::forward_dynamics(model, q, v, Eigen::Vector2d(u, 0));
    ASSERT_LT((a - expected).norm(), 1e-12 * (1 + expected.norm())) << "seed 3";
    const auto states = reference::body_states(model, q, v, a);
    const Frame<double>& tip = model.frames[model.frame_index("tip")];
    ASSERT_LT((states[tip.body].position(tip.X_BF.p) - Vector3<double>(q[0] + l * s, 0, -l * c)).norm(),
              1e-14);
  }
}

TEST(OwnRobots, PendulumsAndBlock) {
  const double g = 9.81;
  const Model<double> pendulum = load_urdf(robot_file("pendulum"));
  EXPECT_NEAR(reference::inverse_dynamics(pendulum, VectorXd::Constant(1, 0.7), VectorXd::Zero(1),
                                          VectorXd::Constant(1, 2.0))[0],
              2 + g * std::sin(0.7), 1e-14);

  // In absolute angles A = q1, B = q1 + q2, with c, s of A - B:
  //   2 Add + c Bdd + s Bd^2 + 2 g sin A = tau_A,  c Add + Bdd - s Ad^2 + g sin B = tau_B
  // and the joints see tau_1 = tau_A + tau_B, tau_2 = tau_B.
  const Model<double> two = load_urdf(robot_file("double_pendulum"));
  const Eigen::Vector2d q(0.5, -0.9), v(0.3, -1.2), a(0.8, 0.4);
  const double A = q[0], B = q[0] + q[1], Ad = v[0], Bd = v[0] + v[1], Add = a[0], Bdd = a[0] + a[1];
  const double c = std::cos(A - B), s = std::sin(A - B);
  const double tau_A = 2 * Add + c * Bdd + s * Bd * Bd + 2 * g * std::sin(A);
  const double tau_B = c * Add + Bdd - s * Ad * Ad + g * std::sin(B);
  const VectorXd tau = reference::inverse_dynamics(two, q, v, a);
  EXPECT_NEAR(tau[0], tau_A + tau_B, 1e-14);
  EXPECT_NEAR(tau[1], tau_B, 1e-14);

  const Model<double> block = load_urdf(robot_file("block"));
  EXPECT_EQ(reference::inverse_dynamics(block, VectorXd::Constant(1, 3.0), VectorXd::Constant(1, 2.0),
                                        VectorXd::Constant(1, 5.0))[0],
            5);
}

}  // namespace
}  // namespace dyntape::dynamics::robots_test
