// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/robot/robot_callee.h>

#include <algorithm>
#include <functional>

#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/contact/constrained_hessian.h>
#include <dyntape/interface/robot/robot_functions.h>
#include <dyntape/interface/robot/robot_rows.h>

namespace dyntape {
namespace {

using dynamics::Model;

// Derivatives of y(x), x = (q, v, w), as they are recorded on a tape.  Without a Hessian that of the value is derived.
struct Analytic {
  std::function<MatrixXad(const VectorXad& x)> jacobian;                     // (y by x)
  std::function<MatrixXad(const VectorXad& x, const VectorXad& w)> hessian;  // (x by x) of w^T y
};

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

// Derivatives of a row, (nv x 3nv) by q, v and the third input.
MatrixXad row_jacobian(const Model<AD>& model, const Rows& rows, const VectorXad& x) {
  const Eigen::Index n = model.nv;
  const VectorXad blocks = row_of(model, rows.derivatives, x);
  MatrixXad J(n, 3 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < 3 * n; ++j) J(i, j) = blocks[j / n * n * n + i * n + j % n];
  }
  return J;
}

// (n x n), by the entries of x, of the sum of w_i y_i.
MatrixXad row_hessian(const Model<AD>& model, const Rows& rows, const VectorXad& x, const VectorXad& w) {
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

// Those, or joints whose q holds a quaternion.
void check_joints_of_held(const Model<double>& model) {
  for (const auto& joint : model.joints) {
    const bool has_quaternion =
        joint.type == dynamics::JointType::kSpherical || joint.type == dynamics::JointType::kFreeFlyer;
    if (has_one_coordinate(joint) || has_quaternion) continue;
    throw ArgumentError(
        "model \"" + model.name + "\": joint \"" + joint.name + "\" is " + dynamics::to_string(joint.type) +
        "; constrained dynamics as a callee need joints that are revolute, prismatic, helical, "
        "spherical or free-flyers");
  }
}

std::shared_ptr<const Callee> analytic_callee(const Function& value, const Analytic& derivatives) {
  const std::size_t n_x = value.n_x(), n_y = value.n_y();
  const auto n = static_cast<Eigen::Index>(n_x), m = static_cast<Eigen::Index>(n_y);
  const std::string name = value.name;
  const auto tangents = [=] {
    return dissolving_callee(record(name + "_jvp", 2 * n_x, [&](const VectorXad& x) {
      return product(derivatives.jacobian(x.head(n)), x.tail(n));
    }));
  };
  // (x, w, dx, dw) -> H(x, w) dx + J(x)^T dw
  const auto tangents_of_adjoints = [=] {
    return dissolving_callee(record(name + "_vjp_jvp", 2 * (n_x + n_y), [&](const VectorXad& all) {
      const VectorXad x = all.head(n), w = all.segment(n, m), dx = all.segment(n + m, n);
      const VectorXad by_x = product(derivatives.hessian(x, w), dx),
                      by_w = product(derivatives.jacobian(x).transpose(), all.tail(m));
      return VectorXad(by_x + by_w);
    }));
  };
  const auto adjoints = [=] {
    const Function vjp = record(name + "_vjp", n_x + n_y, [&](const VectorXad& x) {
      return product(derivatives.jacobian(x.head(n)).transpose(), x.tail(m));
    });
    if (derivatives.hessian) return dissolving_callee(vjp, tangents_of_adjoints);
    return dissolving_callee(vjp, [=] { return jvp_callee(vjp_callee(dissolving_callee(value))); });
  };
  return dissolving_callee(value, tangents, adjoints);
}

std::shared_ptr<const Callee> row_callee(const Model<double>& model, const Rows& rows) {
  check_joints(model);
  Function value = record_robot_function(model, rows.value);
  value.name = model.name + "_" + to_string(rows.value);
  return analytic_callee(value, {[=](const VectorXad& x) { return row_jacobian(model.cast<AD>(), rows, x); },
                                 [=](const VectorXad& x, const VectorXad& w) {
                                   return row_hessian(model.cast<AD>(), rows, x, w);
                                 }});
}

// (nv x nq) the displacement in the moving frames that a change of q is; a quaternion's length is none.
MatrixXad displacement_map(const Model<AD>& model, const VectorXad& q) {
  MatrixXad map = MatrixXad::Constant(model.nv, model.nq, AD(0));
  for (const auto& joint : model.joints) {
    const Eigen::Index i = joint.idx_q, k = joint.idx_v;
    if (dynamics::traits(joint.type).on_a_line) {
      map(k, i) = AD(1);
      continue;
    }
    // w = 2 of conj(u) du, with u = (v, s):  s dv - ds v - v x dv
    const Eigen::Index p = joint.type == dynamics::JointType::kFreeFlyer ? 3 : 0;
    const dynamics::Vector4<AD> u = q.segment<4>(i + p);
    if (p > 0) map.block<3, 3>(k, i) = dynamics::rotation(u).transpose();
    const AD twice = AD(2) / dynamics::squared_length(u), x = u[0] * twice, y = u[1] * twice,
             z = u[2] * twice, s = u[3] * twice;
    map.block<3, 4>(k + p, i + p) << s, z, -y, -x, -z, s, x, -y, y, -x, s, -z;
  }
  return map;
}

// Constrained dynamics and impacts on the tape: accelerations or velocities, and the forces where these are unique.
struct Held {
  Held(const Model<double>& robot, const std::vector<dynamics::Constraint<double>>& list, bool independent)
      : model(robot.cast<AD>()), data(model), c(model, cast(list)) {
    c.independent = independent;
  }
  static std::vector<dynamics::Constraint<AD>> cast(const std::vector<dynamics::Constraint<double>>& list) {
    std::vector<dynamics::Constraint<AD>> result;
    for (const auto& constraint : list) result.push_back(constraint.cast<AD>());
    return result;
  }

  MatrixXad with_forces(const MatrixXad& motion, const MatrixXad& forces) const {
    if (!c.independent) return motion;
    MatrixXad both(motion.rows() + forces.rows(), motion.cols());
    both << motion, forces;
    return both;
  }

  VectorXad value(const VectorXad& x) {
    const Eigen::Index n = model.nv;
    dynamics::constrained_dynamics<AD>(model, data, c, x.head(model.nq), x.segment(model.nq, n), x.tail(n));
    return with_forces(c.ddq, c.lambda);
  }
  // By the entries of q, of which the dynamics know displacements.
  MatrixXad by_q(const VectorXad& x, const MatrixXad& by_displacement) const {
    if (model.nq == model.nv) return by_displacement;
    const MatrixXad map = displacement_map(model, x.head(model.nq)).transpose();
    MatrixXad result(by_displacement.rows(), model.nq);
    for (Eigen::Index i = 0; i < result.rows(); ++i)
      result.row(i) = product(map, by_displacement.row(i).transpose()).transpose();
    return result;
  }
  MatrixXad jacobian(const VectorXad& x) {
    const Eigen::Index n = model.nv;
    dynamics::constrained_dynamics_derivatives<AD>(model, data, c, x.head(model.nq), x.segment(model.nq, n),
                                                   x.tail(n));
    MatrixXad motion(n, x.size()), forces(c.lambda.size(), x.size());
    motion << by_q(x, c.ddq_dq), c.ddq_dv, c.ddq_dtau;
    forces << by_q(x, c.lambda_dq), c.lambda_dv, c.lambda_dtau;
    return with_forces(motion, forces);
  }
  MatrixXad hessian(const VectorXad& x, const VectorXad& w) {
    const Eigen::Index n = model.nv;
    dynamics::ConstrainedHessian<AD> second(model, c);
    return dynamics::constrained_hessian<AD>(model, data, c, second, x.head(n), x.segment(n, n), x.tail(n),
                                             w.head(n), w.tail(w.size() - n));
  }

  VectorXad impact(double restitution, const VectorXad& x) {
    const Eigen::Index n = model.nv;
    dynamics::impulse_dynamics<AD>(model, data, c, x.head(n), x.tail(n), AD(restitution));
    return with_forces(c.v_plus, c.impulse);
  }
  MatrixXad impact_jacobian(double restitution, const VectorXad& x) {
    const Eigen::Index n = model.nv;
    dynamics::impulse_dynamics_derivatives<AD>(model, data, c, x.head(n), x.tail(n), AD(restitution));
    MatrixXad motion(n, 2 * n), forces(c.lambda.size(), 2 * n);
    motion << c.v_plus_dq, c.v_plus_dv;
    forces << c.impulse_dq, c.impulse_dv;
    return with_forces(motion, forces);
  }
  MatrixXad impact_hessian(double restitution, const VectorXad& x, const VectorXad& w) {
    const Eigen::Index n = model.nv;
    dynamics::ConstrainedHessian<AD> second(model, c);
    return dynamics::impulse_hessian<AD>(model, data, c, second, x.head(n), x.tail(n), AD(restitution),
                                         w.head(n), w.tail(w.size() - n));
  }

  Model<AD> model;
  dynamics::Data<AD> data;
  dynamics::ConstraintData<AD> c;
};

}  // namespace

std::shared_ptr<const Callee> inverse_dynamics_callee(const Model<double>& model) {
  return row_callee(model,
                    {RobotFunction::kRnea, RobotFunction::kIdDerivatives, RobotFunction("id-hessian")});
}

std::shared_ptr<const Callee> forward_dynamics_callee(const Model<double>& model) {
  return row_callee(model, {RobotFunction::kAba, RobotFunction::kFdDerivatives, RobotFunction("fd-hessian")});
}

std::shared_ptr<const Callee> constrained_dynamics_callee(
    const Model<double>& model, const std::vector<dynamics::Constraint<double>>& constraints,
    bool independent) {
  check_joints_of_held(model);
  const auto held = [=] { return Held(model, constraints, independent); };
  const Function value =
      record(model.name + "_constrained_dynamics", static_cast<std::size_t>(model.nq + 2 * model.nv),
             [&](const VectorXad& x) { return held().value(x); });
  Analytic derivatives{[=](const VectorXad& x) { return held().jacobian(x); }, {}};
  if (model.nq == model.nv)
    derivatives.hessian = [=](const VectorXad& x, const VectorXad& w) { return held().hessian(x, w); };
  return analytic_callee(value, derivatives);
}

std::shared_ptr<const Callee> impulse_dynamics_callee(
    const Model<double>& model, const std::vector<dynamics::Constraint<double>>& constraints,
    double restitution, bool independent) {
  check_joints(model);
  const auto held = [=] { return Held(model, constraints, independent); };
  const Function value = record(model.name + "_impulse_dynamics", static_cast<std::size_t>(2 * model.nv),
                                [&](const VectorXad& x) { return held().impact(restitution, x); });
  return analytic_callee(value, {[=](const VectorXad& x) { return held().impact_jacobian(restitution, x); },
                                 [=](const VectorXad& x, const VectorXad& w) {
                                   return held().impact_hessian(restitution, x, w);
                                 }});
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
