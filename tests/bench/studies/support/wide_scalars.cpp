// SPDX-License-Identifier: BSD-3-Clause
#include "wide_scalars.h"

#include <dyntape/dynamics/algorithms/detail/derivatives.hxx>
#include <dyntape/dynamics/algorithms/detail/forward_dynamics.hxx>
#include <dyntape/dynamics/algorithms/detail/inverse_dynamics.hxx>
#include <dyntape/dynamics/algorithms/detail/kinematics.hxx>

namespace dyntape::tools {

template <class T>
InScalar<T>::InScalar(const dynamics::Model<double>& model, Wanted wanted)
    : wanted_(wanted), model_(model.cast<T>()), data_(model_) {}

template <class T>
void InScalar<T>::run(const Eigen::VectorXd& state) {
  q_ = state.head(model_.nq).template cast<T>();
  v_ = state.segment(model_.nq, model_.nv).template cast<T>();
  tau_ = state.tail(model_.nv).template cast<T>();
  if (wanted_ == Wanted::kDerivatives)
    dynamics::fd_derivatives<T>(model_, data_, q_, v_, tau_);
  else
    dynamics::aba<T>(model_, data_, q_, v_, tau_);
}

template <class T>
std::vector<Exact> InScalar<T>::result() const {
  std::vector<Exact> all;
  const auto append = [&](const auto& block) {
    for (Eigen::Index i = 0; i < block.rows(); ++i)
      for (Eigen::Index j = 0; j < block.cols(); ++j) all.emplace_back(block(i, j));
  };
  if (wanted_ == Wanted::kAccelerations) {
    append(data_.ddq);
    return all;
  }
  append(data_.ddq_dq), append(data_.ddq_dv), append(data_.Minv);
  return all;
}

double error_of(const std::vector<Exact>& expected, const std::vector<Exact>& got) {
  Exact error = 0, scale = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const Exact e = abs(got[i] - expected[i]), size = abs(expected[i]);
    if (!(e <= error)) error = e;  // a NaN stays
    if (size > scale) scale = size;
  }
  return static_cast<double>(Exact(error / scale));
}

template class InScalar<float>;
template class InScalar<double>;
#if !defined(__aarch64__)  // where Float128 is long double
template class InScalar<long double>;
#endif
template class InScalar<dynamics::Float128>;
template class InScalar<Exact>;

}  // namespace dyntape::tools
