// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/robot/factored_dynamics.h>

#include <numeric>

#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/algorithms/inertia_condition.h>
#include <dyntape/dynamics/algorithms/sparse_factor.h>
#include <dyntape/interface/robot/minverse_product.h>

namespace dyntape::detail {
namespace {

using dynamics::Data;
using dynamics::Model;
using dynamics::SparseFactor;

// Up to here the derivatives of accelerations are as good as by articulated inertias, since both end with a product with
// M^-1 that loses as many digits; the inverse has errors of 2e-14 where articulated inertias leave 4e-16.
constexpr double kMostCondition = 1e3;

// Where a product has a factor that is zero by structure nothing is recorded.
MatrixXad minus_product(const MatrixXad& A, const MatrixXad& B) {
  MatrixXad C(A.rows(), B.cols());
  for (Eigen::Index j = 0; j < B.cols(); ++j) {
    for (Eigen::Index i = 0; i < A.rows(); ++i) {
      AD sum = 0;
      for (Eigen::Index k = 0; k < B.rows(); ++k) sum -= A(i, k) * B(k, j);
      C(i, j) = sum;
    }
  }
  return C;
}

void append(VectorXad& y, Eigen::Index& next, const MatrixXad& block) {
  for (Eigen::Index i = 0; i < block.rows(); ++i) {
    for (Eigen::Index j = 0; j < block.cols(); ++j) y[next++] = block(i, j);
  }
}

Function record_minverse(const Model<double>& model) {
  const Model<AD> taped = model.cast<AD>();
  Data<AD> data(taped);
  SparseFactor<AD> factor(data.tree, model.parent);
  return record("minverse", static_cast<std::size_t>(model.nq), [&](const VectorXad& q) {
    factor.compute(dynamics::crba<AD>(taped, data, q));
    VectorXad y(model.nv * model.nv);
    Eigen::Index next = 0;
    append(y, next, factor.inverse());
    return y;
  });
}

// Forward dynamics at one state.
class Derivation {
 public:
  using Vector3ad = MinverseProduct::Vector3ad;

  explicit Derivation(const Model<double>& model)
      : model_(model.cast<AD>()),
        data_(model_),
        factor_(data_.tree, model.parent),
        base_(base_of(model)),
        product_(data_.tree, base_) {}

  const MinverseProduct& product() const { return product_; }

  // The derivatives of inverse dynamics at the acceleration under tau.
  void run(const VectorXad& state) {
    const VectorXad q = state.head(model_.nq), v = state.segment(model_.nq, model_.nv);
    // At rest the same recursion gives M and the bias, and most of what it is made of is there for the next time;
    // the derivatives at rest are dead code.
    dynamics::id_derivatives<AD>(model_, data_, q, v, VectorXad::Zero(model_.nv));
    factor_.compute(data_.M);
    const VectorXad ddq = factor_.solve(state.tail(model_.nv) - data_.tau);
    dynamics::id_derivatives<AD>(model_, data_, q, v, ddq);
    if (base_ == MinverseProduct::Base::kAny) return;
    gravity_ = dynamics::transposed_times(data_.X_PB[0].R, dynamics::Vector3<AD>(model_.gravity));
    turn_ = v.segment<3>(3);
  }

  MatrixXad inverse() const { return factor_.inverse(); }

  VectorXad by_loop(const MatrixXad& Minv) const {
    return call(product_.callee(), product_.arguments(Minv, data_.dtau_dq, data_.dtau_dv, gravity_, turn_));
  }

  // -M^-1 D for both D, one after the other, by a product of one's own.
  template <class Product>
  std::vector<MatrixXad> by(Product&& minus_minverse_times) const {
    std::vector<MatrixXad> results;
    for (int block = 0; block < 2; ++block) {
      MatrixXad D = block ? data_.dtau_dv : data_.dtau_dq;
      const int known = base_ == MinverseProduct::Base::kFree ? (block ? 3 : 6) : 0;
      D.leftCols(known).setZero();
      MatrixXad result = minus_minverse_times(D);
      if (known)
        result.block<3, 3>(0, known - 3) =
            dynamics::skew(dynamics::Vector3<AD>(block ? Vector3ad(-turn_) : gravity_));
      results.push_back(std::move(result));
    }
    return results;
  }

  const SparseFactor<AD>& factor() const { return factor_; }

 private:
  static MinverseProduct::Base base_of(const Model<double>& model) {
    const bool is_free =
        model.njoints() > 0 && model.joints[0].type == dynamics::JointType::kFreeFlyer && model.parent[0] < 0;
    return is_free ? MinverseProduct::Base::kFree : MinverseProduct::Base::kAny;
  }

  const Model<AD> model_;
  Data<AD> data_;
  SparseFactor<AD> factor_;
  MinverseProduct::Base base_;
  MinverseProduct product_;
  Vector3ad gravity_ = Vector3ad::Zero(), turn_ = Vector3ad::Zero();  // of a free base, in its frame
};

std::size_t state_size(const Model<double>& model) {
  return static_cast<std::size_t>(model.nq + 2 * model.nv);
}

Function record_with_loop(const Model<double>& model) {
  Derivation derivation(model);
  return record("fd-derivatives", state_size(model), [&](const VectorXad& x) {
    derivation.run(x);
    const MatrixXad Minv = derivation.inverse();
    VectorXad y(3 * model.nv * model.nv);
    y << derivation.by_loop(Minv), Eigen::Map<const VectorXad>(Minv.data(), Minv.size());
    return y;
  });
}

// Both products on one tape, which shares everything else.
std::vector<Function> record_straight(const Model<double>& model) {
  Derivation derivation(model);
  const Eigen::Index size = 3 * model.nv * model.nv;
  const Function both = record("fd-derivatives", state_size(model), [&](const VectorXad& x) {
    derivation.run(x);
    const MatrixXad Minv = derivation.inverse(), W = derivation.factor().inverse_of_L(), W_T = -W.transpose(),
                    scaled = W * derivation.factor().D_inverse().asDiagonal();
    VectorXad y(2 * size);
    Eigen::Index next = 0;
    for (const MatrixXad& block : derivation.by([&](const MatrixXad& D) { return minus_product(Minv, D); }))
      append(y, next, block);
    append(y, next, Minv);
    for (const MatrixXad& block :
         derivation.by([&](const MatrixXad& D) { return minus_product(scaled, minus_product(W_T, D)); }))
      append(y, next, block);
    append(y, next, Minv);
    return y;
  });
  std::vector<Function> ways;
  for (const Eigen::Index first : {Eigen::Index{0}, size}) {
    std::vector<std::size_t> chosen(static_cast<std::size_t>(size));
    std::iota(chosen.begin(), chosen.end(), static_cast<std::size_t>(first));
    ways.push_back(select_outputs(both, chosen));
  }
  return ways;
}

}  // namespace

std::vector<Function> record_factored(const Model<double>& model, const RobotFunction& function) {
  const bool is_inverse = function.row() == RobotFunction("minverse").row();
  if (!function.mimics.empty() || !(is_inverse || function.row() == RobotFunction::kFdDerivatives.row()))
    return {};
  if (!(dynamics::worst_inertia_condition(model) <= kMostCondition)) return {};
  if (is_inverse) return {record_minverse(model)};
  if (MinverseProduct(dynamics::tree_of(model)).is_worth_a_loop()) return {record_with_loop(model)};
  return record_straight(model);
}

}  // namespace dyntape::detail
