// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/robot/robot_callee.h>

#include <algorithm>

#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/interface/robot/robot_functions.h>
#include <dyntape/interface/robot/robot_rows.h>

namespace dyntape {
namespace {

using dynamics::Model;

// The rows of the value, of its derivatives and of the Hessian of its weighted sum.
struct Rows {
  RobotFunction value, derivatives, hessian;
};

// y = run(x), a row of the table on the tape.
VectorXad row_of(const Model<AD>& model, const RobotFunction& function, const VectorXad& x) {
  detail::RobotWorkspace<AD> work(model, function);
  VectorXad y(static_cast<Eigen::Index>(work.n_out()));
  work.evaluate(x.data(), y.data());
  return y;
}

// Its derivatives, (nv x 3nv) by q, v and the third input.
MatrixXad jacobian(const Model<AD>& model, const Rows& rows, const VectorXad& x) {
  const Eigen::Index n = model.nv;
  const VectorXad blocks = row_of(model, rows.derivatives, x);
  MatrixXad J(n, 3 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < 3 * n; ++j) J(i, j) = blocks[j / n * n * n + i * n + j % n];
  }
  return J;
}

// (n x n), by the entries of x, of the sum of w_i y_i.
MatrixXad hessian(const Model<AD>& model, const Rows& rows, const VectorXad& x, const VectorXad& w) {
  VectorXad state(x.size() + w.size());
  state << x, w;
  return row_of(model, rows.hessian, state).reshaped(x.size(), x.size());  // symmetric
}

// A product that leaves out what is structurally zero: a zero factor folds as it is recorded.
VectorXad product(const MatrixXad& A, const VectorXad& x) {
  VectorXad y = VectorXad::Constant(A.rows(), AD(0));
  for (Eigen::Index i = 0; i < A.rows(); ++i) {
    for (Eigen::Index j = 0; j < A.cols(); ++j) y[i] += A(i, j) * x[j];
  }
  return y;
}

bool has_one_coordinate(const dynamics::Joint<double>& joint) {
  return dynamics::traits(joint.type).on_a_line;
}

void check_joints(const Model<double>& model) {
  for (const auto& joint : model.joints) {
    if (has_one_coordinate(joint)) continue;
    throw ArgumentError(
        "model \"" + model.name + "\": joint \"" + joint.name + "\" is " + dynamics::to_string(joint.type) +
        "; dynamics as a callee need joints of one coordinate (revolute, prismatic, helical)");
  }
}

std::shared_ptr<const Callee> robot_callee(const Model<double>& model, const Rows& rows) {
  check_joints(model);
  const Eigen::Index n = model.nv;
  const auto size = static_cast<std::size_t>(3 * n);
  const std::string name = model.name + "_" + to_string(rows.value);
  const auto tangents = [=] {
    const Model<AD> taped = model.cast<AD>();
    return dissolving_callee(record(name + "_jvp", 2 * size, [&](const VectorXad& x) {
      return product(jacobian(taped, rows, x.head(3 * n)), x.tail(3 * n));
    }));
  };
  // (x, w, dx, dw) -> H(x, w) dx + J(x)^T dw
  const auto tangents_of_adjoints = [=] {
    const Model<AD> taped = model.cast<AD>();
    return dissolving_callee(record(name + "_vjp_jvp", 2 * (size + model.nv), [&](const VectorXad& all) {
      const VectorXad x = all.head(3 * n), w = all.segment(3 * n, n), dx = all.segment(4 * n, 3 * n);
      const VectorXad by_x = product(hessian(taped, rows, x, w), dx),
                      by_w = product(jacobian(taped, rows, x).transpose(), all.tail(n));
      return VectorXad(by_x + by_w);
    }));
  };
  const auto adjoints = [=] {
    const Model<AD> taped = model.cast<AD>();
    return dissolving_callee(record(name + "_vjp", size + model.nv,
                                    [&](const VectorXad& x) {
                                      return product(jacobian(taped, rows, x.head(3 * n)).transpose(),
                                                     x.tail(n));
                                    }),
                             tangents_of_adjoints);
  };
  Function value = record_robot_function(model, rows.value);
  value.name = name;
  return dissolving_callee(value, tangents, adjoints);
}

}  // namespace

std::shared_ptr<const Callee> inverse_dynamics_callee(const Model<double>& model) {
  return robot_callee(model,
                      {RobotFunction::kRnea, RobotFunction::kIdDerivatives, RobotFunction("id-hessian")});
}

std::shared_ptr<const Callee> forward_dynamics_callee(const Model<double>& model) {
  return robot_callee(model,
                      {RobotFunction::kAba, RobotFunction::kFdDerivatives, RobotFunction("fd-hessian")});
}

bool is_worth_callees(const Model<double>& model) {
  return model.nv >= 3 && std::all_of(model.joints.begin(), model.joints.end(), has_one_coordinate);
}

Function record_differentiable(const Model<double>& model, const RobotFunction& function) {
  Function value = record_robot_function(model, function);
  const bool is_forward = function.row() == RobotFunction::kAba.row();
  const bool is_dynamics = is_forward || function.row() == RobotFunction::kRnea.row();
  if (!is_dynamics || !function.mimics.empty() || !is_worth_callees(model)) return value;
  const auto callee = is_forward ? forward_dynamics_callee(model) : inverse_dynamics_callee(model);
  Function called = record(value.name, callee->n_in, [&](const VectorXad& x) { return call(callee, x); });
  called.input_names = std::move(value.input_names);
  called.output_names = std::move(value.output_names);
  return called;
}

}  // namespace dyntape
