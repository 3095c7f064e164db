// SPDX-License-Identifier: BSD-3-Clause
//
// Derivatives of the motion of frames in double, against central differences in 113 bits along q (+) d: a
// step of 1e-11 leaves an error near 1e-21.  In all three frames, of frames and of bodies.
#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/kinematic_derivatives.h>

#include <functional>

#include "dynamics/exact_robot.h"

namespace dyntape::dynamics::kinematic_derivatives_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Matrix6Xd = Matrix6X<double>;

constexpr ReferenceFrame kFrames[] = {ReferenceFrame::kLocal, ReferenceFrame::kWorld,
                                      ReferenceFrame::kLocalWorldAligned};

const char* name(ReferenceFrame in) {
  return in == ReferenceFrame::kLocal ? "local" : in == ReferenceFrame::kWorld ? "world" : "aligned";
}

class KinematicDerivativesOf : public ExactRobot {
 protected:
  KinematicDerivativesOf() : ExactRobot(8, 3) {
    frame = random.below(static_cast<int>(model.frames.size()));
    K = std::make_unique<KinematicDerivatives<double>>(model);
    forward_kinematics(model, *data, s.q, s.v, s.a);
  }

  using Function = std::function<MatrixXq(const VectorXq&)>;

  // Central difference of f at 0.
  MatrixXd slope_along(const VectorXq& direction, const Function& f) {
    const Float128 h(1e-11);
    return ((f(direction * h) - f(-direction * h)) / (2 * h)).cast<double>();
  }
  MatrixXd slope(int rows, const Function& f) {
    MatrixXd d(rows, model.nv);
    for (int k = 0; k < model.nv; ++k) d.col(k) = slope_along(VectorXq::Unit(model.nv, k), f);
    return d;
  }

  // V, A and C of the frame in 113 bits, for other arguments: six rows each, in the order of kFrames.
  enum What { kV, kA, kC };
  VectorXq motions(const VectorXq& at_q, const VectorXq& at_v, const VectorXq& at_a) {
    VectorXq all(54);
    forward_kinematics(exact, *data128, at_q, at_v, at_a);
    for (int i = 0; i < 3; ++i) {
      all.segment<6>(18 * i) = frame_velocity(exact, *data128, frame, kFrames[i]).vector();
      all.segment<6>(18 * i + 6) = frame_acceleration(exact, *data128, frame, kFrames[i]).vector();
      all.segment<6>(18 * i + 12) = frame_classical_acceleration(exact, *data128, frame, kFrames[i]).vector();
    }
    return all;
  }
  static Matrix6Xd pick(const MatrixXd& derivatives, int i, What what) {
    return derivatives.middleRows<6>(18 * i + 6 * what);
  }
  VectorXq moved(const VectorXq& d) { return integrate<Float128>(exact, q, d); }
  Function jacobian(ReferenceFrame in) {
    return [=, this](const VectorXq& d) -> MatrixXq {
      return frame_jacobian<Float128>(exact, *data128, moved(d), frame, in);
    };
  }

  // A slope may vanish: its error is held against what it is the slope of as well.
  template <class A, class B>
  void expect_near(const A& got, const B& expected, double scale, double tolerance = 1e-13) {
    const double size = std::max(scale, expected.cwiseAbs().maxCoeff());
    EXPECT_LE((got - expected).cwiseAbs().maxCoeff(), tolerance * size);
  }
  static double size(const Motion<double>& m) { return m.vector().cwiseAbs().maxCoeff(); }

  int frame = 0;
  std::unique_ptr<KinematicDerivatives<double>> K;
};

TEST_P(KinematicDerivativesOf, VelocityAndAcceleration) {
  const MatrixXd by_q = slope(54, [&](const VectorXq& d) { return motions(moved(d), v, a); });
  const MatrixXd by_v = slope(54, [&](const VectorXq& d) { return motions(q, v + d, a); });
  const MatrixXd by_a = slope(54, [&](const VectorXq& d) { return motions(q, v, a + d); });
  for (int i = 0; i < 3; ++i) {
    const ReferenceFrame in = kFrames[i];
    SCOPED_TRACE(name(in));
    frame_acceleration_derivatives(model, *data, *K, frame, in);
    expect_near(K->V.vector(), frame_velocity(model, *data, frame, in).vector(), 0);
    expect_near(K->A.vector(), frame_acceleration(model, *data, frame, in).vector(), 0);
    expect_near(K->C.vector(), frame_classical_acceleration(model, *data, frame, in).vector(), 0);
    const double scale = std::max(size(K->A), size(K->C));
    expect_near(K->dV_dq, pick(by_q, i, kV), size(K->V));
    expect_near(K->dA_dq, pick(by_q, i, kA), scale);
    expect_near(K->dC_dq, pick(by_q, i, kC), scale);
    expect_near(K->J, pick(by_v, i, kV), 0);
    expect_near(K->dA_dv, pick(by_v, i, kA), size(K->V));
    expect_near(K->dC_dv, pick(by_v, i, kC), size(K->V));
    expect_near(K->J, pick(by_a, i, kA), 0);
    expect_near(K->J, pick(by_a, i, kC), 0);
    expect_near(frame_jacobian(model, *data, s.q, frame, in), K->J, 0);
    const Matrix6Xd J = K->J, dV_dq = K->dV_dq;
    frame_velocity_derivatives(model, *data, *K, frame, in);
    EXPECT_EQ(K->J, J);
    EXPECT_EQ(K->dV_dq, dV_dq);
  }
}

// d/dt V = J a + J_dot v is the spatial acceleration in kLocal and kWorld and the classical one in
// kLocalWorldAligned.  Errata E44: there the spatial one is wrong, and this test sees it.
TEST_P(KinematicDerivativesOf, JacobianInTime) {
  double worst = 0;
  for (const ReferenceFrame in : kFrames) {
    SCOPED_TRACE(name(in));
    const Matrix6Xd rate = slope_along(v, jacobian(in));
    frame_jacobian_rate(model, *data, *K, frame, in);
    expect_near(K->J_dot, rate, size(K->V));
    const VectorXd acceleration = K->J * s.a + K->J_dot * s.v;
    const Motion<double> A = frame_acceleration(model, *data, frame, in);
    const Motion<double> C = frame_classical_acceleration(model, *data, frame, in);
    const bool aligned = in == ReferenceFrame::kLocalWorldAligned;
    expect_near(acceleration, (aligned ? C : A).vector(), size(C), 1e-13);
    if (aligned) worst = (acceleration - A.vector()).norm() / (1 + A.vector().norm());
    frame_acceleration_derivatives(model, *data, *K, frame, in);
    expect_near(K->J_dot, rate, size(K->V));
    const Matrix6Xd& by_v = aligned ? K->dC_dv : K->dA_dv;
    expect_near(by_v, Matrix6Xd(K->J_dot + K->dV_dq), size(K->V));
  }
  if (K->V.angular.cross(K->V.linear).norm() > 0.1) {
    EXPECT_GT(worst, 1e-3);
  }
}

TEST_P(KinematicDerivativesOf, Jacobian) {
  KinematicHessian<double> H(model);
  for (const ReferenceFrame in : kFrames) {
    SCOPED_TRACE(name(in));
    frame_hessian(model, *data, H, frame, in);
    frame_jacobian_rate(model, *data, *K, frame, in);
    const double scale = K->J.cwiseAbs().maxCoeff();
    Matrix6Xd along_v = Matrix6Xd::Zero(6, model.nv);
    for (int j = 0; j < model.nv; ++j) {
      along_v += H.slice(j) * s.v[j];
      expect_near(Matrix6Xd(H.slice(j)), slope_along(VectorXq::Unit(model.nv, j), jacobian(in)), scale);
    }
    expect_near(along_v, K->J_dot, scale);
  }
}

// Lie brackets of the columns, symmetric where the increments commute and the axes stand still.
TEST_P(KinematicDerivativesOf, JacobianAreSymmetricUpToBrackets) {
  KinematicHessian<double> H(model);
  for (const ReferenceFrame in : kFrames) {
    SCOPED_TRACE(name(in));
    frame_hessian(model, *data, H, frame, in);
    frame_jacobian_rate(model, *data, *K, frame, in);
    for (int j : K->support) {
      for (int k : K->support) {
        const bool one_joint = data->tree.dofs[j].joint == data->tree.dofs[k].joint;
        const Motion<double> J_j = K->S[j], J_k = K->S[k];
        Motion<double> bracket = cross(J_k, J_j);
        if (in == ReferenceFrame::kWorld) bracket = cross(J_j, J_k);
        if (in == ReferenceFrame::kLocalWorldAligned) bracket = {{0, 0, 0}, J_j.angular.cross(J_k.angular)};
        if (one_joint && in != ReferenceFrame::kLocal) continue;
        if (one_joint) bracket = {};
        expect_near(VectorXd(H.slice(j).col(k) - H.slice(k).col(j)), bracket.vector(), 1, 1e-15);
      }
    }
  }
}

TEST_P(KinematicDerivativesOf, JacobianTransposedTimesAWrench) {
  KinematicHessian<double> H(model);
  for (const ReferenceFrame in : kFrames) {
    SCOPED_TRACE(name(in));
    frame_hessian(model, *data, H, frame, in);
    const Force<double> f{random.vector3(), random.vector3()};
    const MatrixXd fH = frame_weighted_hessian(model, *data, *K, frame, in, f);
    for (int j = 0; j < model.nv; ++j) {
      expect_near(VectorXd(fH.col(j)), VectorXd(H.slice(j).transpose() * f.vector()), 1, 1e-15 * 8);
    }
    frame_jacobian_rate(model, *data, *K, frame, in);
    EXPECT_NEAR(s.v.dot(fH * s.v), f.vector().dot(K->J_dot * s.v),
                1e-13 * (1 + fH.norm() * s.v.squaredNorm()));
  }
}

// Second derivative of the position of a frame along q (+) v t.
TEST_P(KinematicDerivativesOf, PositionTwice) {
  const Float128 h(1e-8);
  const auto position = [&](const Float128& t) {
    forward_kinematics<Float128>(exact, *data128, moved(v * t));
    return frame_placement(exact, *data128, frame).p;
  };
  const Vector3<Float128> twice = (position(h) - position(0) - position(0) + position(-h)) / (h * h);
  const Vector3<double> w = random.vector3();
  const MatrixXd fH =
      frame_weighted_hessian(model, *data, *K, frame, ReferenceFrame::kLocalWorldAligned, {w, {0, 0, 0}});
  const double expected = static_cast<double>(w.cast<Float128>().dot(twice));
  EXPECT_NEAR(s.v.dot(fH * s.v), expected, 1e-13 * (1 + fH.norm() * s.v.squaredNorm()));
  for (int j = 0; j < model.nv; ++j) {
    for (int k = 0; k < j; ++k) {
      if (data->tree.dofs[j].joint == data->tree.dofs[k].joint) continue;
      EXPECT_EQ(fH(j, k), fH(k, j));
    }
  }
}

// An increment of the placement in its own frame is J d, J in kLocal.
TEST_P(KinematicDerivativesOf, Placement) {
  frame_jacobian_rate(model, *data, *K, frame, ReferenceFrame::kLocal);
  forward_kinematics<Float128>(exact, *data128, q);
  const auto X0 = inverse(frame_placement(exact, *data128, frame));
  const Matrix6Xd expected = slope(6, [&](const VectorXq& d) -> MatrixXq {
    forward_kinematics<Float128>(exact, *data128, moved(d));
    return log(X0 * frame_placement(exact, *data128, frame)).vector();
  });
  expect_near(K->J, expected, 0);
}

TEST_P(KinematicDerivativesOf, BodiesAreThoseOfTheirFrames) {
  const int body = model.frames[frame].body;
  model.frames[frame].X_BF = {};
  KinematicDerivatives<double> B(model);
  KinematicHessian<double> H(model), HB(model);
  const Force<double> f{random.vector3(), random.vector3()};
  for (const ReferenceFrame in : kFrames) {
    SCOPED_TRACE(name(in));
    frame_acceleration_derivatives(model, *data, *K, frame, in);
    frame_acceleration_derivatives(model, *data, B, on_body(body), in);
    for (const auto x : {&KinematicDerivatives<double>::J, &KinematicDerivatives<double>::J_dot,
                         &KinematicDerivatives<double>::dV_dq, &KinematicDerivatives<double>::dA_dq,
                         &KinematicDerivatives<double>::dA_dv, &KinematicDerivatives<double>::dC_dq,
                         &KinematicDerivatives<double>::dC_dv}) {
      EXPECT_EQ((*K).*x, B.*x);
    }
    frame_velocity_derivatives(model, *data, B, on_body(body), in);
    EXPECT_EQ(K->dV_dq, B.dV_dq);
    EXPECT_EQ(K->J_dot, frame_jacobian_rate(model, *data, B, on_body(body), in));
    EXPECT_EQ(frame_hessian(model, *data, H, frame, in), frame_hessian(model, *data, HB, on_body(body), in));
    EXPECT_EQ(frame_weighted_hessian(model, *data, *K, frame, in, f),
              frame_weighted_hessian(model, *data, B, on_body(body), in, f));
    expect_near(frame_jacobian(model, *data, s.q, on_body(body), in), K->J, 0);
  }
}

// Only the rotation of the base enters, except in kWorld.
TEST_P(KinematicDerivativesOf, FarAwayHaveTheSameBits) {
  if (model.joints[0].type != JointType::kFreeFlyer) return;
  VectorXd far_q = s.q;
  far_q.head<3>() += Vector3<double>(1e8, -1e8, 3e7);
  Data<double> far(model);
  KinematicDerivatives<double> F(model);
  KinematicHessian<double> H(model), HF(model);
  forward_kinematics(model, far, far_q, s.v, s.a);
  for (const ReferenceFrame in : {ReferenceFrame::kLocal, ReferenceFrame::kLocalWorldAligned}) {
    SCOPED_TRACE(name(in));
    frame_acceleration_derivatives(model, *data, *K, frame, in);
    frame_acceleration_derivatives(model, far, F, frame, in);
    for (const auto x : {&KinematicDerivatives<double>::J, &KinematicDerivatives<double>::J_dot,
                         &KinematicDerivatives<double>::dV_dq, &KinematicDerivatives<double>::dA_dq,
                         &KinematicDerivatives<double>::dA_dv, &KinematicDerivatives<double>::dC_dq,
                         &KinematicDerivatives<double>::dC_dv}) {
      EXPECT_EQ((*K).*x, F.*x);
    }
    EXPECT_EQ(frame_hessian(model, *data, H, frame, in), frame_hessian(model, far, HF, frame, in));
  }
}

// A workspace forgets the frame before; a frame fixed to the world does not move.
TEST_P(KinematicDerivativesOf, FramesOneAfterTheOther) {
  KinematicDerivatives<double> fresh(model);
  KinematicHessian<double> H(model), fresh_H(model);
  const Force<double> f{random.vector3(), random.vector3()};
  const ReferenceFrame in = ReferenceFrame::kLocalWorldAligned;
  for (size_t other = 0; other < model.frames.size(); ++other) {
    frame_acceleration_derivatives(model, *data, *K, static_cast<int>(other), in);
    frame_hessian(model, *data, H, static_cast<int>(other), in);
    frame_weighted_hessian(model, *data, *K, static_cast<int>(other), in, f);
  }
  frame_acceleration_derivatives(model, *data, *K, frame, in);
  frame_acceleration_derivatives(model, *data, fresh, frame, in);
  EXPECT_EQ(K->J, fresh.J);
  EXPECT_EQ(K->dC_dq, fresh.dC_dq);
  EXPECT_EQ(frame_hessian(model, *data, H, frame, in), frame_hessian(model, *data, fresh_H, frame, in));
  EXPECT_EQ(frame_weighted_hessian(model, *data, *K, frame, in, f),
            frame_weighted_hessian(model, *data, fresh, frame, in, f));

  model.frames.push_back({"world", -1, random_placement(random)});
  const int world = static_cast<int>(model.frames.size()) - 1;
  frame_acceleration_derivatives(model, *data, *K, world, in);
  frame_hessian(model, *data, H, world, in);
  const Matrix6Xd zero = Matrix6Xd::Zero(6, model.nv);
  EXPECT_EQ(K->J, zero);
  EXPECT_EQ(K->dC_dq, zero);
  EXPECT_EQ(K->C.vector(), VectorXd::Zero(6));
  EXPECT_EQ(H.H.cwiseAbs().maxCoeff(), 0);
}

INSTANTIATE_TEST_SUITE_P(Seeds, KinematicDerivativesOf, ::testing::Range(1UL, 25UL));

TEST(KinematicDerivatives, NamesWhatIsWrong) {
  Random random(3);
  const Model<double> model = random_tree(random), other = random_tree(random, {.joints = 3});
  Data<double> data(model);
  KinematicDerivatives<double> K(model), wrong(other);
  KinematicHessian<double> H(model);
  const ReferenceFrame in = ReferenceFrame::kLocal;
  EXPECT_THROW(frame_velocity_derivatives(model, data, K, 99, in), ArgumentError);
  EXPECT_THROW(frame_hessian(model, data, H, on_body(-1), in), ArgumentError);
  EXPECT_THROW(frame_jacobian_rate(model, data, wrong, 0, in), ArgumentError);
  try {
    frame_jacobian_rate(model, data, K, on_body(10), in);
    FAIL() << "no error";
  } catch (const ArgumentError& e) {
    EXPECT_NE(std::string(e.what()).find("frame_jacobian_rate: body 10 does not exist"), std::string::npos)
        << e.what();
  }
}

}  // namespace
}  // namespace dyntape::dynamics::kinematic_derivatives_test
