// SPDX-License-Identifier: BSD-3-Clause
//
// Co-design: derivatives by masses, lengths, armature and gravity, against 113-bit differences and the
// regressor.
#include <gtest/gtest.h>

#include <filesystem>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/algebra/float128.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/algorithms/regressor.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/model_parameters.h>

#include "source_folder.h"

namespace dyntape::model_parameters_test {
namespace {

using dynamics::Data;
using dynamics::Float128;
using dynamics::Model;
using dynamics::VectorX;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Model<double> load(const std::string& name) {
  const auto root = std::filesystem::path(test::source_folder()) / "config" / "robots" / (name + ".urdf");
  return dynamics::load_urdf(root.string(), {});
}

// tau and ddq, one below the other.
template <class T>
VectorX<T> dynamics_both_ways(const Model<T>& robot, const VectorX<T>& x) {
  Data<T> data(robot);
  const VectorX<T> q = x.head(robot.nq), v = x.segment(robot.nq, robot.nv), w = x.tail(robot.nv);
  VectorX<T> y(2 * robot.nv);
  y << dynamics::rnea<T>(robot, data, q, v, w), dynamics::aba<T>(robot, data, q, v, w);
  return y;
}

std::vector<double> some_state(const Model<double>& model) {
  std::vector<double> x;
  for (int i = 0; i < model.nq + 2 * model.nv; ++i) x.push_back(std::sin(1.0 + 2.3 * i));
  return x;
}

MatrixXd dense(const SparseFunction& f, const std::vector<double>& x, const std::vector<double>& p) {
  const std::vector<double> values = evaluate(f.function, x, p);
  MatrixXd J =
      MatrixXd::Zero(static_cast<Eigen::Index>(f.pattern.rows), static_cast<Eigen::Index>(f.pattern.cols));
  for (std::size_t k = 0; k < f.pattern.nnz(); ++k) J(f.pattern.row[k], f.pattern.col[k]) = values[k];
  return J;
}

const std::vector<std::string> kNames = {"mass:forearm_link",
                                         "comx:forearm_link",
                                         "comz:upper_arm_link",
                                         "Ixx:forearm_link",
                                         "Iyz:wrist_1_link",
                                         "length:elbow_joint",
                                         "length:wrist_1_joint",
                                         "armature:elbow_joint",
                                         "gravity:x",
                                         "gravity:z",
                                         "mass:tool0"};

TEST(ModelParameters, JacobianMatchesDifferencesIn113Bits) {
  const Model<double> model = load("ur5");
  const ModelParameters design(model, kNames);
  const std::vector<double> state = some_state(model), nominal = design.nominal();
  const Function f = record_design(model, design, state.size(), dynamics_both_ways<AD>);
  const MatrixXd J = dense(sparse_jacobian(f), nominal, state);

  const Float128 h(1e-11);
  VectorX<Float128> x(static_cast<Eigen::Index>(state.size())), d(static_cast<Eigen::Index>(nominal.size()));
  for (std::size_t i = 0; i < state.size(); ++i) x[static_cast<Eigen::Index>(i)] = state[i];
  for (std::size_t i = 0; i < nominal.size(); ++i) d[static_cast<Eigen::Index>(i)] = nominal[i];
  for (Eigen::Index k = 0; k < d.size(); ++k) {
    VectorX<Float128> up = d, down = d;
    up[k] += h;
    down[k] -= h;
    const VectorX<Float128> slope = (dynamics_both_ways(design.apply<Float128>(up), x) -
                                     dynamics_both_ways(design.apply<Float128>(down), x)) /
                                    (2 * h);
    const VectorXd expected = slope.cast<double>();
    for (int block = 0; block < 2; ++block) {
      const VectorXd e = expected.segment(6 * block, 6);
      EXPECT_LE((J.col(k).segment(6 * block, 6) - e).cwiseAbs().maxCoeff(), 1e-12 * e.cwiseAbs().maxCoeff())
          << kNames[static_cast<std::size_t>(k)];
    }
  }
}

// Torques are linear in mass at a fixed centre of mass: the column of Y, moved along.
TEST(ModelParameters, MassesAgreeWithTheRegressor) {
  const Model<double> model = load("ur5");
  const ModelParameters design(model, {"mass:forearm_link"});
  const std::vector<double> state = some_state(model);
  const Function f =
      record_design(model, design, state.size(), [](const Model<AD>& robot, const VectorXad& x) {
        return VectorXad(dynamics_both_ways<AD>(robot, x).head(6));
      });
  const MatrixXd J = dense(sparse_jacobian(f), design.nominal(), state);
  Data<double> data(model);
  dynamics::RegressorData<double> regressor(model);
  const Eigen::Map<const VectorXd> x(state.data(), 18);
  const MatrixXd& Y =
      dynamics::torque_regressor(model, data, regressor, x.head(6), x.segment(6, 6), x.tail(6));
  const int body = model.frames[model.frame_index("forearm_link")].body;
  dynamics::Inertia<double> unit = model.inertias[body];
  unit.mass = 1;
  unit.I_c.setZero();
  const VectorXd expected = Y.middleCols(10 * body, 10) * dynamics::inertial_parameters(unit);
  EXPECT_LE((J.col(0) - expected).cwiseAbs().maxCoeff(), 1e-13 * expected.cwiseAbs().maxCoeff());
}

// dtau/dtheta of the recorded algorithm is Y: recorded in the parameters themselves.
TEST(ModelParameters, DerivativeByInertialParametersIsTheRegressor) {
  const Model<double> model = load("ur5");
  const std::vector<double> state = some_state(model);
  const VectorXd theta = dynamics::inertial_parameters(model);
  RecordOptions options;
  options.variables.assign(theta.begin(), theta.end());
  const Function f = record(
      "rnea_of_theta", 60, 18,
      [&](const VectorXad& x, const VectorXad& p) {
        Model<AD> robot = model.cast<AD>();
        dynamics::set_inertial_parameters<AD>(robot, x);
        return VectorXad(dynamics_both_ways<AD>(robot, p).head(6));
      },
      options);
  Data<double> data(model);
  dynamics::RegressorData<double> regressor(model);
  const Eigen::Map<const VectorXd> x(state.data(), 18);
  const MatrixXd& Y =
      dynamics::torque_regressor(model, data, regressor, x.head(6), x.segment(6, 6), x.tail(6));
  const MatrixXd J = dense(sparse_jacobian(f), options.variables, state);
  EXPECT_LE((J - Y).cwiseAbs().maxCoeff(), 1e-12 * Y.cwiseAbs().maxCoeff());
}

TEST(ModelParameters, AsParametersTheStateIsDifferentiated) {
  const Model<double> model = load("arm_2r");
  const ModelParameters design(model, {"gravity:z"});
  const Function by_design = record_design(model, design, 6, dynamics_both_ways<AD>);
  const Function by_state = record_design(model, design, 6, dynamics_both_ways<AD>, DesignAs::kParameters);
  EXPECT_EQ(by_design.n_x(), 1u);
  EXPECT_EQ(by_state.n_x(), 6u);
  EXPECT_EQ(by_design.input_names[0], design.names());
  const std::vector<double> state = some_state(model);
  EXPECT_EQ(evaluate(by_design, design.nominal(), state), evaluate(by_state, state, design.nominal()));
  EXPECT_EQ(all_as_variables(by_state).n_x(), 7u);
}

TEST(ModelParameters, FaultsAreNamed) {
  const Model<double> model = load("ur5");
  const auto message = [&](const std::string& name) -> std::string {
    try {
      ModelParameters(model, {name});
    } catch (const ArgumentError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_NE(message("mass:forearm_lonk").find("did you mean 'forearm_link'"), std::string::npos);
  EXPECT_NE(message("moss:forearm_link").find("did you mean 'mass'"), std::string::npos);
  EXPECT_NE(message("gravity:w").find("gravity:x"), std::string::npos);
  EXPECT_NE(message("mass").find("form"), std::string::npos);
  EXPECT_NE(message("length:elbow").find("elbow_joint"), std::string::npos);
  EXPECT_THROW(ModelParameters(model, {"gravity:x", "gravity:x"}), ArgumentError);
}

}  // namespace
}  // namespace dyntape::model_parameters_test
