// SPDX-License-Identifier: BSD-3-Clause
//
// Momentum, energies and wrenches: analytic derivatives against those of the recorded value, and on a tape.
#include <gtest/gtest.h>

#include <filesystem>
#include <random>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/algorithms/centroidal.h>
#include <dyntape/dynamics/algorithms/energy.h>
#include <dyntape/dynamics/effects/wrenches.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>

#include "source_folder.h"

namespace dyntape::centroidal_recorded_test {
namespace {

using dynamics::Base;
using dynamics::Centroidal;
using dynamics::Data;
using dynamics::EnergyGradients;
using dynamics::FixedIn;
using dynamics::Model;
using dynamics::Wrench;
using dynamics::WrenchTorques;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Robot {
  const char* name;
  Base base;
};

// max |a - b| / max |b|.
double error(const MatrixXd& got, const MatrixXd& expected) {
  return (got - expected).cwiseAbs().maxCoeff() / std::max(1e-300, expected.cwiseAbs().maxCoeff());
}

class RecordedCentroidal : public ::testing::TestWithParam<Robot> {
 protected:
  RecordedCentroidal() {
    const std::filesystem::path robots = std::filesystem::path(test::source_folder()) / "config" / "robots";
    model = dynamics::load_urdf((robots / (std::string(GetParam().name) + ".urdf")).string(),
                                {.base = GetParam().base});
    taped = model.cast<AD>();
    std::mt19937_64 random(5);
    q = dynamics::random_configuration(model, random);
    const auto number = [&] { return std::uniform_real_distribution<double>(-1, 1)(random); };
    v = VectorXd::NullaryExpr(model.nv, number);
    a = VectorXd::NullaryExpr(model.nv, number) * 3;
    for (const FixedIn fixed_in : {FixedIn::kBody, FixedIn::kWorld}) {
      const int frame = static_cast<int>(model.frames.size()) - 1 - static_cast<int>(wrenches.size());
      wrenches.push_back(dynamics::wrench_at_frame(model, frame, fixed_in,
                                                   {Eigen::Vector3d(1, -2, 3), Eigen::Vector3d(-3, 1, 2)}));
    }
  }

  static std::vector<double> joined(std::initializer_list<VectorXd> parts) {
    std::vector<double> all;
    for (const VectorXd& part : parts) all.insert(all.end(), part.begin(), part.end());
    return all;
  }

  template <class T>
  std::vector<Wrench<T>> wrenches_of() const {
    std::vector<Wrench<T>> cast;
    for (const Wrench<double>& wrench : wrenches) cast.push_back(wrench.cast<T>());
    return cast;
  }

  Model<double> model;
  Model<AD> taped;
  VectorXd q, v, a;
  std::vector<Wrench<double>> wrenches;
};

TEST_P(RecordedCentroidal, SlopesAreThoseOfTheRecordedValue) {
  const int nv = model.nv;
  // (h, h_dot, T, g, Q) of (d, v, a) with parameters q.
  const auto value = [&](const VectorXad& x, const VectorXad& at) {
    Data<AD> data(taped);
    Centroidal<AD> c(taped);
    WrenchTorques<AD> w(taped);
    const VectorXad d = x.head(nv), vel = x.segment(nv, nv), acc = x.tail(nv);
    const VectorXad moved = dynamics::integrate<AD>(taped, at, d);
    dynamics::centroidal_momentum_rate<AD>(taped, data, c, moved, vel, acc);
    VectorXad y(13 + 2 * nv);
    y << c.h.vector(), c.h_dot.vector(), dynamics::kinetic_energy<AD>(taped, data, moved, vel),
        dynamics::generalized_gravity<AD>(taped, data, moved),
        dynamics::wrench_torques<AD>(taped, data, w, wrenches_of<AD>(), moved);
    return y;
  };
  const SparseFunction derivatives = sparse_jacobian(
      record("momentum", static_cast<std::size_t>(3 * nv), static_cast<std::size_t>(model.nq), value));
  const std::vector<double> entries =
      evaluate(derivatives.function, joined({VectorXd::Zero(nv), v, a}), joined({q}));
  MatrixXd expected = MatrixXd::Zero(13 + 2 * nv, 3 * nv);
  for (std::size_t k = 0; k < entries.size(); ++k) {
    expected(derivatives.pattern.row[k], derivatives.pattern.col[k]) = entries[k];
  }
  Data<double> data(model);
  Centroidal<double> c(model);
  EnergyGradients<double> e(model);
  WrenchTorques<double> w(model);
  dynamics::centroidal_derivatives(model, data, c, q, v, a);
  EXPECT_LE(error(c.dh_dq, expected.block(0, 0, 6, nv)), 1e-13);
  EXPECT_LE(error(c.A, expected.block(0, nv, 6, nv)), 1e-13);
  EXPECT_LE(error(c.dh_dot_dq, expected.block(6, 0, 6, nv)), 1e-13);
  EXPECT_LE(error(c.dh_dot_dv, expected.block(6, nv, 6, nv)), 1e-13);
  EXPECT_LE(error(c.A, expected.block(6, 2 * nv, 6, nv)), 1e-13);
  dynamics::kinetic_energy_gradients(model, data, e, q, v);
  EXPECT_LE(error(e.dT_dq.transpose(), expected.block(12, 0, 1, nv)), 1e-13);
  EXPECT_LE(error(e.dT_dv.transpose(), expected.block(12, nv, 1, nv)), 1e-13);
  EXPECT_LE(error(dynamics::gravity_derivatives(model, data, e, q), expected.block(13, 0, nv, nv)), 1e-13);
  EXPECT_LE(error(dynamics::wrench_torque_derivatives(model, data, w, wrenches, q),
                  expected.block(13 + nv, 0, nv, nv)),
            1e-13);
}

// The analytic algorithms on a tape, away from where they were recorded: no branch, the same numbers.
TEST_P(RecordedCentroidal, AlgorithmsRunOnATape) {
  const auto n = static_cast<std::size_t>(model.nq + 2 * model.nv);
  const auto all = [&]<class T>(const Model<T>& robot, const dynamics::VectorX<T>& x) {
    const dynamics::VectorX<T> at = x.head(robot.nq), vel = x.segment(robot.nq, robot.nv),
                               acc = x.tail(robot.nv);
    Data<T> data(robot);
    Centroidal<T> c(robot);
    EnergyGradients<T> e(robot);
    WrenchTorques<T> w(robot);
    dynamics::centroidal_matrix_rate<T>(robot, data, c, at, vel);
    dynamics::centroidal_derivatives<T>(robot, data, c, at, vel, acc);
    dynamics::com_jacobian<T>(robot, data, c, at);
    dynamics::kinetic_energy_gradients<T>(robot, data, e, at, vel);
    dynamics::gravity_derivatives<T>(robot, data, e, at);
    dynamics::wrench_torque_derivatives<T>(robot, data, w, wrenches_of<T>(), at);
    dynamics::VectorX<T> y(29 * robot.nv + 2 * robot.nv * robot.nv);
    y << c.A_dot.reshaped(), c.dh_dq.reshaped(), c.dh_dot_dq.reshaped(), c.dh_dot_dv.reshaped(),
        c.J.reshaped(), e.dT_dq, e.dT_dv, e.dg_dq.reshaped(), w.dtau_dq.reshaped();
    return y;
  };
  const Function f = record("momentum", n, [&](const VectorXad& x) { return all(taped, x); });
  EXPECT_TRUE(f.guards.empty());
  const std::vector<double> x = joined({q, v, a}), y = evaluate(f, x);
  const VectorXd expected = all(model, VectorXd(VectorXd::Map(x.data(), static_cast<long>(n))));
  EXPECT_LE(error(VectorXd::Map(y.data(), static_cast<long>(y.size())), expected), 1e-14);
}

// Translations of the whole robot and joints on other branches leave nothing to compute.
TEST_P(RecordedCentroidal, StructuralZerosAreConstants) {
  if (GetParam().base != Base::kFloating) return;
  const auto n = static_cast<std::size_t>(model.nq + 2 * model.nv);
  const Function f = record("zeros", n, [&](const VectorXad& x) {
    Data<AD> data(taped);
    Centroidal<AD> c(taped);
    WrenchTorques<AD> w(taped);
    dynamics::centroidal_derivatives<AD>(taped, data, c, x.head(model.nq), x.segment(model.nq, model.nv),
                                         x.tail(model.nv));
    dynamics::wrench_torque_derivatives<AD>(taped, data, w, {}, x.head(model.nq));
    VectorXad y(36 + w.dtau_dq.size());
    y << c.dh_dq.leftCols(3).reshaped(), c.dh_dot_dq.leftCols(3).reshaped(), w.dtau_dq.reshaped();
    return y;
  });
  EXPECT_EQ(total_operations(f), 0U);
}

INSTANTIATE_TEST_SUITE_P(Robots, RecordedCentroidal,
                         ::testing::Values(Robot{"panda", Base::kFixed}, Robot{"solo12", Base::kFloating},
                                           Robot{"iiwa14", Base::kFloating}),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace dyntape::centroidal_recorded_test
