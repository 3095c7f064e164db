// SPDX-License-Identifier: BSD-3-Clause
//
// The peer's side of bench_tape_peer: Pinocchio's inverse dynamics on CppAD's tape, a library of its own.
#include <pinocchio/autodiff/cppad.hpp>
// Pinocchio's order
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/multibody.hpp>

#include "pinocchio_model.h"
#include "tape_times.h"

namespace {

using dyntape::bench::least_us;
using dyntape::bench::Times;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// The fastest of CppAD's drivers: forward with directions one by one or in groups, reverse.
double measure_drivers(CppAD::ADFun<double>& f, const Eigen::VectorXd& x, RowMajor& answer) {
  using Sizes = CppAD::vector<std::size_t>;
  const auto n = static_cast<std::size_t>(x.size());
  CppAD::sparse_rc<Sizes> identity(n, n, n), pattern;
  for (std::size_t i = 0; i < n; ++i) identity.set(i, i, i);
  f.for_jac_sparsity(identity, false, false, true, pattern);
  CppAD::sparse_rcv<Sizes, Eigen::VectorXd> J(pattern);
  double least = 1e9;
  for (const std::size_t group : {1, 4, 8, 16, 32}) {
    CppAD::sparse_jac_work work;
    least = std::min(least, least_us([&] { f.sparse_jac_for(group, x, J, pattern, "cppad", work); }));
  }
  CppAD::sparse_jac_work work;
  least = std::min(least, least_us([&] { f.sparse_jac_rev(x, J, pattern, "cppad", work); }));
  answer = RowMajor::Zero(static_cast<Eigen::Index>(J.nr()), x.size());
  for (std::size_t k = 0; k < J.nnz(); ++k)
    answer(static_cast<Eigen::Index>(J.row()[k]), static_cast<Eigen::Index>(J.col()[k])) = J.val()[k];
  return least;
}

}  // namespace

bool measure_cppad(const dyntape_peer_joint* joints, int count, const double* gravity, const double* x, int n,
                   double* y, double* J, Times* times, Times* optimised) {
  using Scalar = CppAD::AD<double>;
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  pinocchio::Model model;
  if (!peer::build_model(joints, count, gravity, model)) return false;
  const pinocchio::ModelTpl<Scalar> taped = model.cast<Scalar>();
  const Eigen::VectorXd point = Eigen::VectorXd::Map(x, n);
  Eigen::VectorXd torques;
  RowMajor jacobian;
  pinocchio::DataTpl<Scalar> data(taped);
  const auto record_it = [&](CppAD::ADFun<double>& f) {
    Vector at = point.cast<Scalar>();
    CppAD::Independent(at);
    const Vector q = at.head(model.nq), v = at.segment(model.nq, model.nv), a = at.tail(model.nv);
    const Vector tau = pinocchio::rnea(taped, data, q, v, a);
    f.Dependent(at, tau);
  };
  CppAD::ADFun<double> f;
  record_it(f);
  times->record = least_us([&] {
    CppAD::ADFun<double> again;
    record_it(again);
  });
  times->value = least_us([&] { torques = f.Forward(0, point); });
  times->jacobian = measure_drivers(f, point, jacobian);
  optimised->record = times->record + least_us([&] {
                        CppAD::ADFun<double> again;
                        record_it(again);
                        again.optimize();
                      });
  optimised->record -= times->record;
  f.optimize();
  optimised->value = least_us([&] { f.Forward(0, point); });
  optimised->jacobian = measure_drivers(f, point, jacobian);
  Eigen::VectorXd::Map(y, torques.size()) = torques;
  RowMajor::Map(J, jacobian.rows(), jacobian.cols()) = jacobian;
  return true;
}
