// SPDX-License-Identifier: BSD-3-Clause
//
// Second derivatives in double against central differences, in 113 bits, of the first ones; against
// themselves in 113 bits; and against what must hold between them.
#include <dyntape/dynamics/algorithms/second_order.h>

#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/urdf/urdf.h>

#include <algorithm>
#include <functional>

#include "dynamics/exact_robot.h"
#include "dynamics/robot_files.h"

namespace dyntape::dynamics::second_order_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Slices = std::vector<MatrixXd>;  // of a tensor, by its last index

double tensor_error(const Tensor3<double>& tensor, const Slices& slices, double scale = 0) {
  double error = 0;
  for (int k = 0; k < tensor.size(); ++k) {
    error = std::max(error, (tensor.slice(k) - slices[k]).cwiseAbs().maxCoeff());
    scale = std::max(scale, slices[k].cwiseAbs().maxCoeff());
  }
  return scale == 0 ? error : error / scale;
}

// The mean of a tensor and the one with its last two indices exchanged.
Slices symmetric(const Slices& s) {
  Slices mean = s;
  for (std::size_t j = 0; j < s.size(); ++j) {
    for (std::size_t k = 0; k < s.size(); ++k) mean[k].col(j) = (s[k].col(j) + s[j].col(k)) / 2;
  }
  return mean;
}

// mu^T tensor, the rows of the result being the tensor's second index.
MatrixXd contracted(const VectorXd& mu, const Tensor3<double>& tensor) {
  MatrixXd m(tensor.size(), tensor.size());
  for (int k = 0; k < tensor.size(); ++k) m.col(k) = tensor.slice(k).transpose() * mu;
  return m;
}

MatrixXd assembled(const MatrixXd& qq, const MatrixXd& qv, const MatrixXd& vv, const MatrixXd& qu) {
  const long n = qq.rows();
  MatrixXd H = MatrixXd::Zero(3 * n, 3 * n);
  H.topRows(n) << qq, qv, qu;
  H.block(n, 0, n, n) = qv.transpose();
  H.block(2 * n, 0, n, n) = qu.transpose();
  H.block(n, n, n, n) = vv;
  return H;
}

class SecondOrderOf : public ExactRobot {
 protected:
  SecondOrderOf() : ExactRobot(6, 4), u(a) {}

  // Slices d results / d(column k), for each result that `call` leaves in data128.
  std::vector<Slices> differences(bool of_q, const std::vector<const MatrixXq*>& results,
                                  const std::function<void(const VectorXq&)>& call) {
    std::vector<Slices> slices(results.size());
    const Float128 h(1e-11);
    for (int k = 0; k < model.nv; ++k) {
      std::vector<MatrixXq> up;
      for (const int sign : {1, -1}) {
        VectorXq step = VectorXq::Zero(model.nv);
        step[k] = sign * h;
        call(of_q ? integrate<Float128>(exact, q, step) : VectorXq(v + step));
        if (sign > 0) {
          for (const MatrixXq* result : results) up.push_back(*result);
        } else {
          for (std::size_t r = 0; r < results.size(); ++r) {
            slices[r].push_back(((up[r] - *results[r]) / (2 * h)).cast<double>());
          }
        }
      }
    }
    return slices;
  }

  VectorXq u;  // accelerations, or the same numbers as torques
};

TEST_P(SecondOrderOf, InverseDynamics) {
  SecondOrder<double> second(model);
  id_second_order(model, *data, second, s.q, s.v, s.a);
  Data<Float128>& d = *data128;
  const auto by_q =
      differences(true, {&d.dtau_dq, &d.M}, [&](const VectorXq& x) { id_derivatives(exact, d, x, v, u); });
  const auto by_v = differences(false, {&d.dtau_dq, &d.dtau_dv},
                                [&](const VectorXq& x) { id_derivatives(exact, d, q, x, u); });
  // Where there is one joint only, derivatives vanish: errors are held against the inertia then.
  const double scale = d.M.cwiseAbs().maxCoeff().convert_to<double>();
  EXPECT_LE(tensor_error(second.d2tau_dqdq, symmetric(by_q[0]), scale), 1e-14);
  EXPECT_LE(tensor_error(second.d2tau_dadq, by_q[1], scale), 1e-14);
  EXPECT_LE(tensor_error(second.d2tau_dqdv, by_v[0], scale), 1e-14);
  EXPECT_LE(tensor_error(second.d2tau_dvdv, by_v[1], scale), 1e-14);
}

// Derivatives one after the other do not commute on a joint of several columns: their mean is what comes
// back, their difference the derivative along the bracket of the columns.
TEST_P(SecondOrderOf, SuccessiveDerivativesDifferByTheBracket) {
  SecondOrder<double> second(model);
  id_second_order(model, *data, second, s.q, s.v, s.a);
  id_derivatives(model, *data, s.q, s.v, s.a);
  Data<Float128>& d = *data128;
  const Slices successive =
      differences(true, {&d.dtau_dq}, [&](const VectorXq& x) { id_derivatives(exact, d, x, v, u); })[0];
  const double size = 1 + data->dtau_dq.cwiseAbs().maxCoeff();
  const Tree& tree = data->tree;
  for (int j = 0; j < model.nv; ++j) {
    for (int k = 0; k < model.nv; ++k) {
      VectorXd bracket = VectorXd::Zero(model.nv);
      if (tree.dofs[j].joint == tree.dofs[k].joint) {
        const Motion<double> w = cross(motion<double>(tree.dofs[j]), motion<double>(tree.dofs[k]));
        const int first = tree.first[tree.dofs[j].joint], count = tree.count[tree.dofs[j].joint];
        for (int c = first; c < first + count; ++c) {
          bracket[c] = motion<double>(tree.dofs[c]).vector().dot(w.vector());
        }
      }
      // d/dq_j of d tau/dq_k
      const VectorXd expected = second.d2tau_dqdq.slice(k).col(j) + 0.5 * data->dtau_dq * bracket;
      EXPECT_LE((successive[j].col(k) - expected).cwiseAbs().maxCoeff(), 1e-13 * size) << j << " " << k;
    }
  }
}

TEST_P(SecondOrderOf, ForwardDynamics) {
  ForwardSecondOrder<double> second(model);
  fd_second_order(model, *data, second, s.q, s.v, s.a);
  Data<Float128>& d = *data128;
  const auto by_q =
      differences(true, {&d.ddq_dq, &d.Minv}, [&](const VectorXq& x) { fd_derivatives(exact, d, x, v, u); });
  const auto by_v = differences(false, {&d.ddq_dq, &d.ddq_dv},
                                [&](const VectorXq& x) { fd_derivatives(exact, d, q, x, u); });
  // Each solution with M, ddq among them, loses as many digits as M's condition has.
  const Eigen::SelfAdjointEigenSolver<MatrixXd> M(data->M);
  const double condition = M.eigenvalues().maxCoeff() / M.eigenvalues().minCoeff();
  const double tolerance = 1e-13 + 1e-15 * condition;
  const double scale = data->Minv.cwiseAbs().maxCoeff();
  EXPECT_LE(tensor_error(second.d2ddq_dqdq, symmetric(by_q[0]), scale), tolerance);
  EXPECT_LE(tensor_error(second.d2ddq_dtaudq, by_q[1], scale), tolerance);
  EXPECT_LE(tensor_error(second.d2ddq_dqdv, by_v[0], scale), tolerance);
  EXPECT_LE(tensor_error(second.d2ddq_dvdv, by_v[1], scale), tolerance);
}

TEST_P(SecondOrderOf, HessiansAreTheTensorsContracted) {
  SecondOrder<double> second(model);
  ForwardSecondOrder<double> forward(model);
  Hessian<double> hessian(model);
  const VectorXd mu = random.vector(model.nv);
  const int n = model.nv;
  // fd_hessian first: what it leaves behind must not be seen.
  fd_hessian(model, *data, hessian, s.q, s.v, s.tau, mu);
  fd_second_order(model, *data, forward, s.q, s.v, s.tau);
  EXPECT_LE(relative_error(hessian.d2ddq,
                           assembled(contracted(mu, forward.d2ddq_dqdq), contracted(mu, forward.d2ddq_dqdv),
                                     contracted(mu, forward.d2ddq_dvdv),
                                     contracted(mu, forward.d2ddq_dtaudq).transpose())),
            1e-10);
  id_hessian(model, *data, hessian, s.q, s.v, s.a, mu);
  id_second_order(model, *data, second, s.q, s.v, s.a);
  const MatrixXd expected =
      assembled(contracted(mu, second.d2tau_dqdq), contracted(mu, second.d2tau_dqdv),
                contracted(mu, second.d2tau_dvdv), contracted(mu, second.d2tau_dadq).transpose());
  EXPECT_LE((hessian.d2tau - expected).cwiseAbs().maxCoeff(), 1e-14 * (1 + expected.cwiseAbs().maxCoeff()));
  EXPECT_TRUE(hessian.d2tau == hessian.d2tau.transpose());
  EXPECT_TRUE(hessian.d2ddq == hessian.d2ddq.transpose());
  EXPECT_EQ(hessian.d2tau.block(n, 2 * n, 2 * n, n), MatrixXd::Zero(2 * n, n));
  const MatrixXd first = hessian.d2ddq;
  fd_hessian(model, *data, hessian, s.q, s.v, s.tau, mu);
  EXPECT_TRUE(hessian.d2ddq == first);
}

TEST_P(SecondOrderOf, WithExternalForcesAndWithoutGravity) {
  std::vector<Force<double>> external(model.njoints());
  std::vector<Force<Float128>> external128;
  for (auto& f : external) {
    f = {random.vector3(5), random.vector3(5)};
    external128.push_back({f.linear.cast<Float128>(), f.angular.cast<Float128>()});
  }
  DynamicsTerms<double> acting;
  acting.gravity = false;
  acting.external = &external;
  DynamicsTerms<Float128> acting128;
  acting128.gravity = false;
  acting128.external = &external128;
  SecondOrder<double> second(model);
  Hessian<double> hessian(model);
  const VectorXd mu = random.vector(model.nv);
  id_second_order(model, *data, second, s.q, s.v, s.a, acting);
  id_hessian(model, *data, hessian, s.q, s.v, s.a, mu, acting);
  Data<Float128>& d = *data128;
  const Slices by_q = symmetric(differences(
      true, {&d.dtau_dq}, [&](const VectorXq& x) { id_derivatives(exact, d, x, v, u, acting128); })[0]);
  EXPECT_LE(tensor_error(second.d2tau_dqdq, by_q, 1), 1e-14);
  const MatrixXd qq = contracted(mu, second.d2tau_dqdq);
  EXPECT_LE((hessian.d2tau.topLeftCorner(model.nv, model.nv) - qq).cwiseAbs().maxCoeff(),
            1e-13 * (1 + qq.cwiseAbs().maxCoeff()));
}

TEST_P(SecondOrderOf, StructureIsExact) {
  SecondOrder<double> second(model), again(model);
  id_second_order(model, *data, second, s.q, s.v, s.a);
  const auto on_one_path = [&](int i, int j) {
    for (const auto& [from, to] : {std::pair(i, j), std::pair(j, i)}) {
      for (int p = data->tree.dofs[from].joint; p >= 0; p = model.parent[p]) {
        if (p == data->tree.dofs[to].joint) return true;
      }
    }
    return false;
  };
  for (int i = 0; i < model.nv; ++i) {
    for (int j = 0; j < model.nv; ++j) {
      for (int k = 0; k < model.nv; ++k) {
        EXPECT_EQ(second.d2tau_dqdq(i, j, k), second.d2tau_dqdq(i, k, j));
        EXPECT_EQ(second.d2tau_dvdv(i, j, k), second.d2tau_dvdv(i, k, j));
        EXPECT_EQ(second.d2tau_dadq(i, j, k), second.d2tau_dadq(j, i, k));
        if (on_one_path(i, j) && on_one_path(j, k) && on_one_path(i, k)) continue;
        EXPECT_EQ(second.d2tau_dqdq(i, j, k), 0);
        EXPECT_EQ(second.d2tau_dqdv(i, j, k), 0);
        EXPECT_EQ(second.d2tau_dvdv(i, j, k), 0);
        EXPECT_EQ(second.d2tau_dadq(i, j, k), 0);
      }
    }
  }
  // tau is quadratic in v and linear in a.
  id_second_order(model, *data, again, s.q, random.vector(model.nv), random.vector(model.nv));
  EXPECT_TRUE(second.d2tau_dvdv.values() == again.d2tau_dvdv.values());
  EXPECT_TRUE(second.d2tau_dadq.values() == again.d2tau_dadq.values());
  const VectorXd zero = VectorXd::Zero(model.nv);
  id_second_order(model, *data, again, s.q, zero, s.a);
  EXPECT_EQ(again.d2tau_dqdv.values(), VectorXd::Zero(again.d2tau_dqdv.values().size()));
}

TEST_P(SecondOrderOf, DoesNotSeeWhereTheBaseIs) {
  Model<double> far = model;
  State t = s;
  if (model.joints[0].type == JointType::kFreeFlyer) {
    t.q.head(3) += 1e8 * random.vector(3);
  } else {
    for (int i = 0; i < far.njoints(); ++i) {
      if (far.parent[i] < 0) far.X_PJ[i].p = random.vector3(1e8);
    }
  }
  ForwardSecondOrder<double> here(model), there(model);
  Hessian<double> hessian_here(model), hessian_there(model);
  const VectorXd mu = random.vector(model.nv);
  fd_second_order(model, *data, here, s.q, s.v, s.tau);
  fd_second_order(far, *data, there, t.q, t.v, t.tau);
  EXPECT_TRUE(here.id.d2tau_dqdq.values() == there.id.d2tau_dqdq.values());
  EXPECT_TRUE(here.id.d2tau_dqdv.values() == there.id.d2tau_dqdv.values());
  EXPECT_TRUE(here.d2ddq_dqdq.values() == there.d2ddq_dqdq.values());
  EXPECT_TRUE(here.d2ddq_dtaudq.values() == there.d2ddq_dtaudq.values());
  fd_hessian(model, *data, hessian_here, s.q, s.v, s.tau, mu);
  fd_hessian(far, *data, hessian_there, t.q, t.v, t.tau, mu);
  EXPECT_TRUE(hessian_here.d2tau == hessian_there.d2tau);
  EXPECT_TRUE(hessian_here.d2ddq == hessian_there.d2ddq);
}

INSTANTIATE_TEST_SUITE_P(Seeds, SecondOrderOf, ::testing::Range(1UL, 9UL));

class SecondOrderOfRobot : public ::testing::TestWithParam<const char*> {};

// The same templates in 113 bits.
TEST_P(SecondOrderOfRobot, IsAccurate) {
  const std::string name = GetParam();
  const UrdfOptions options{.base = name == "panda" ? Base::kFixed : Base::kFloating};
  const Model<double> model = load_urdf(robot_file(name), options);
  const Model<Float128> exact = model.cast<Float128>();
  Random random(7);
  const State s = random_state(model, random);
  const VectorXq q = s.q.cast<Float128>(), v = s.v.cast<Float128>(), a = s.a.cast<Float128>(),
                 tau = s.tau.cast<Float128>();
  const VectorXd mu = random.vector(model.nv);
  Data<double> data(model);
  Data<Float128> data128(exact);
  const auto error = [](const auto& x, const auto& y) {
    return relative_error(x, y.template cast<double>().eval());
  };
  SecondOrder<double> second(model);
  SecondOrder<Float128> second128(exact);
  id_second_order(model, data, second, s.q, s.v, s.a);
  id_second_order(exact, data128, second128, q, v, a);
  EXPECT_LE(error(second.d2tau_dqdq.values(), second128.d2tau_dqdq.values()), 1e-14);
  EXPECT_LE(error(second.d2tau_dqdv.values(), second128.d2tau_dqdv.values()), 1e-14);
  EXPECT_LE(error(second.d2tau_dvdv.values(), second128.d2tau_dvdv.values()), 1e-14);
  EXPECT_LE(error(second.d2tau_dadq.values(), second128.d2tau_dadq.values()), 1e-14);
  Hessian<double> hessian(model);
  Hessian<Float128> hessian128(exact);
  const VectorXq mu128 = mu.cast<Float128>();
  EXPECT_LE(error(id_hessian(model, data, hessian, s.q, s.v, s.a, mu),
                  id_hessian(exact, data128, hessian128, q, v, a, mu128)),
            1e-14);
  EXPECT_LE(error(fd_hessian(model, data, hessian, s.q, s.v, s.tau, mu),
                  fd_hessian(exact, data128, hessian128, q, v, tau, mu128)),
            1e-12);
}

INSTANTIATE_TEST_SUITE_P(Robots, SecondOrderOfRobot, ::testing::Values("panda", "solo12", "simple_humanoid"));

TEST(SecondOrder, RefusesWrongSizes) {
  Random random(1);
  const Model<double> model = random_tree(random, {.joints = 3}), other = random_tree(random, {.joints = 9});
  const State s = random_state(model, random);
  Data<double> data(model);
  SecondOrder<double> second(model), wrong(other);
  Hessian<double> hessian(model);
  EXPECT_THROW(id_second_order(model, data, second, s.q, VectorXd::Zero(1 + model.nv), s.a), ArgumentError);
  EXPECT_THROW(id_second_order(model, data, wrong, s.q, s.v, s.a), ArgumentError);
  EXPECT_THROW(id_hessian(model, data, hessian, s.q, s.v, s.a, VectorXd::Zero(model.nv - 1)), ArgumentError);
  EXPECT_THROW(fd_hessian(model, data, hessian, s.q, s.v, s.tau, VectorXd::Zero(model.nv + 1)),
               ArgumentError);
}

}  // namespace
}  // namespace dyntape::dynamics::second_order_test
