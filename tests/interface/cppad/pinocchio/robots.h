// SPDX-License-Identifier: BSD-3-Clause
//
// Four robots of Pinocchio's, joint by joint, and how its algorithms are recorded and compiled.  A unit an algorithm: each takes a
// compiler's minutes.
#pragma once

#include <gtest/gtest.h>

#include <dyntape/interface/cppad/pinocchio.h>
// Pinocchio's order
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/multibody.hpp>

#include <dyntape/interface/cppad/library.h>

namespace pin = pinocchio;

using Scalar = CppAD::AD<double>;
using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
using Eigen::MatrixXd;
using Eigen::VectorXd;

inline pin::SE3 offset(double x, double y, double z, double angle) {
  return {Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 2, 3).normalized()).matrix(), Eigen::Vector3d(x, y, z)};
}

inline void add_body(pin::Model& model, pin::JointIndex joint, double scale) {
  Eigen::Matrix3d R = Eigen::AngleAxisd(0.3 * scale, Eigen::Vector3d(3, 1, 2).normalized()).matrix();
  const Eigen::Matrix3d I = R * Eigen::Vector3d(0.02, 0.03, 0.04).asDiagonal() * R.transpose() * scale;
  model.appendBodyToJoint(joint, pin::Inertia(1.3 * scale, Eigen::Vector3d(0.05, -0.02, 0.1) * scale, I),
                          pin::SE3::Identity());
}

inline pin::JointIndex add(pin::Model& model, pin::JointIndex parent, const pin::JointModel& joint,
                           const pin::SE3& placement) {
  const auto index = model.addJoint(parent, joint, placement, "joint" + std::to_string(model.njoints));
  add_body(model, index, 1.0 / (1 + 0.1 * double(index)));
  return index;
}

inline pin::Model arm() {  // six hinges
  pin::Model model;
  pin::JointIndex last = 0;
  for (int i = 0; i < 6; ++i) {
    const pin::JointModel joint =
        i % 3 == 0 ? pin::JointModel(pin::JointModelRZ())
        : i % 3 == 1
            ? pin::JointModel(pin::JointModelRY())
            : pin::JointModel(pin::JointModelRevoluteUnaligned(Eigen::Vector3d(1, 1, 0).normalized()));
    last = add(model, last, joint, offset(0.1, 0.05, 0.3, 0.2 * i));
  }
  return model;
}
inline pin::Model crane() {  // a cart, two pendula and a rope
  pin::Model model;
  auto cart = add(model, 0, pin::JointModelPX(), offset(0, 0, 1, 0));
  auto swing = add(model, cart, pin::JointModelRY(), offset(0, 0, -0.2, 0.1));
  auto rope = add(model, swing, pin::JointModelPrismaticUnaligned(Eigen::Vector3d(0.6, 0, -0.8)),
                  offset(0, 0, -0.3, 0.2));
  add(model, rope, pin::JointModelRUBX(), offset(0.1, 0, -0.1, 0.3));
  return model;
}
inline pin::Model legged(int legs, int joints) {
  pin::Model model;
  const auto base = add(model, 0, pin::JointModelFreeFlyer(), pin::SE3::Identity());
  for (int leg = 0; leg < legs; ++leg) {
    auto last = base;
    for (int i = 0; i < joints; ++i) {
      const pin::JointModel joint =
          i % 2 ? pin::JointModel(pin::JointModelRY()) : pin::JointModel(pin::JointModelRX());
      last = add(model, last, joint, offset(0.2 * (leg % 2), 0.15 * leg, -0.25, 0.1 * (leg + i)));
    }
  }
  return model;
}

struct Robot {
  const char* name;
  pin::Model (*make)();
};
inline const Robot kRobots[] = {{"arm", arm},
                                {"crane", crane},
                                {"quadruped", [] { return legged(4, 3); }},
                                {"biped", [] { return legged(2, 6); }}};

class PinocchioRecorded : public ::testing::TestWithParam<Robot> {
 protected:
  PinocchioRecorded()
      : model_(GetParam().make()), data_(model_), taped_(model_.cast<Scalar>()), taped_data_(taped_) {
    q_ = pin::neutral(model_);
    q_ = pin::integrate(model_, q_, VectorXd(VectorXd::LinSpaced(model_.nv, -0.5, 0.7)));
    v_ = VectorXd::LinSpaced(model_.nv, 0.4, -0.3);
    u_ = VectorXd::LinSpaced(model_.nv, 1.0, 2.0);
  }

  // Of (dq, v, u): the configuration moves in its tangent space.
  template <class Algorithm>
  CppAD::ADFun<double> record(Algorithm&& algorithm) {
    const Eigen::Index n = model_.nv;
    VectorXd at(3 * n);
    at << VectorXd::Zero(n), v_, u_;
    Vector ax = at.cast<Scalar>();
    CppAD::Independent(ax);
    const Vector q = pin::integrate(taped_, Vector(q_.cast<Scalar>()), Vector(ax.head(n)));
    const Vector y = algorithm(q, Vector(ax.segment(n, n)), Vector(ax.tail(n)));
    CppAD::ADFun<double> f;
    f.Dependent(ax, y);
    return f;
  }
  // Through generated code.
  MatrixXd jacobian(const CppAD::ADFun<double>& f) {
    EXPECT_TRUE(CppAD::to_function(f).guards.empty()) << "guards are left";
    const dyntape::CompiledFunction g = CppAD::to_library(f);
    std::vector<double> x(std::size_t(model_.nv), 0.0);
    x.insert(x.end(), v_.data(), v_.data() + v_.size());
    x.insert(x.end(), u_.data(), u_.data() + u_.size());
    const auto all = g.evaluate(dyntape::Order::kFirst, x);
    value_ = VectorXd::Map(all.y.data(), Eigen::Index(all.y.size()));
    MatrixXd J = MatrixXd::Zero(Eigen::Index(g.n_y()), Eigen::Index(g.n_x()));
    for (std::size_t k = 0; k < all.jacobian.size(); ++k)
      J(g.jacobian_pattern().row[k], g.jacobian_pattern().col[k]) = all.jacobian[k];
    return J;
  }
  static void expect_equal(const MatrixXd& got, const MatrixXd& expected, const char* what) {
    const double apart = (got - expected).cwiseAbs().maxCoeff() / (1 + expected.cwiseAbs().maxCoeff());
    EXPECT_LT(apart, 1e-12) << what;
    ::testing::Test::RecordProperty(what, std::to_string(apart));
  }

  pin::Model model_;
  pin::Data data_;
  pin::ModelTpl<Scalar> taped_;
  pin::DataTpl<Scalar> taped_data_;
  VectorXd q_, v_, u_, value_;
};
