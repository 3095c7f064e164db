// SPDX-License-Identifier: BSD-3-Clause
//
// Programs that include Pinocchio's own headers for CppAD and CppADCodeGen, as OCS2 does, unchanged: the drop-in folder has
// headers of these names.
#include <gtest/gtest.h>

#include <pinocchio/autodiff/cppad.hpp>
#include <pinocchio/codegen/cppadcg.hpp>
// Pinocchio's order
#include <pinocchio/algorithm/kinematics.hpp>
#if __has_include(<pinocchio/multibody.hpp>)
#include <pinocchio/multibody.hpp>
#else  // before Pinocchio 4
#include <pinocchio/multibody/data.hpp>
#include <pinocchio/multibody/model.hpp>
#endif

namespace pinocchio_names_test {

namespace pin = pinocchio;
using Generated = CppAD::cg::CG<double>;
using Scalar = CppAD::AD<Generated>;
using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;

// Two hinges about z and y with links of 1 m along x: the tip is at (c1 (1 + c2), s1 (1 + c2), -s2).
pin::Model two_links() {
  pin::Model model;
  const pin::SE3 link(Eigen::Matrix3d::Identity(), Eigen::Vector3d(1, 0, 0));
  const auto first = model.addJoint(0, pin::JointModelRZ(), pin::SE3::Identity(), "first");
  const auto second = model.addJoint(first, pin::JointModelRY(), link, "second");
  model.addJoint(second, pin::JointModelRZ(), link, "tip");
  return model;
}

TEST(PinocchioNames, ALibraryOfTheScalarOfOcs2) {
  const pin::ModelTpl<Scalar> model = two_links().cast<Scalar>();
  pin::DataTpl<Scalar> data(model);
  Vector q = Vector::Constant(3, Scalar(0.2));
  CppAD::Independent(q);
  pin::forwardKinematics(model, data, q);
  Vector tip = data.oMi[3].translation();
  CppAD::ADFun<Generated> f(q, tip);
  CppAD::cg::ModelCSourceGen<double> source(f, "tip");
  source.setCreateSparseJacobian(true);
  CppAD::cg::ModelLibraryCSourceGen<double> library(source);
  CppAD::cg::DynamicModelLibraryProcessor<double> processor(library);
  CppAD::cg::GccCompiler<double> compiler;
  const auto loaded = processor.createDynamicLibrary(compiler);
  const auto compiled = loaded->model("tip");
  const std::vector<double> x = {0.3, 0.8, -0.4}, y = compiled->ForwardZero(x),
                            J = compiled->SparseJacobian(x);
  const double c1 = std::cos(x[0]), s1 = std::sin(x[0]), c2 = std::cos(x[1]), s2 = std::sin(x[1]);
  const std::vector<double> expected = {c1 * (1 + c2), s1 * (1 + c2), -s2},
                            slopes = {-s1 * (1 + c2), -c1 * s2, 0, c1 * (1 + c2), -s1 * s2, 0, 0, -c2, 0};
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(y[i], expected[i], 1e-15);
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(J[i], slopes[i], 1e-15);
}

}  // namespace pinocchio_names_test
