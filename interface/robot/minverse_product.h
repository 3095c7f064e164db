// SPDX-License-Identifier: BSD-3-Clause
//
// The dense last part of the derivatives of forward dynamics, as a loop.  As straight-line code this part is two
// thirds of a humanoid's operations and a megabyte; fetching this code would cost more than the arithmetic.
//
//   const MinverseProduct product(data.tree);
//   VectorXad ddq_dq_and_dv = call(product.callee(), product.arguments(Minv, dtau_dq, dtau_dv));
//
// Results: -Minv dtau_dq, then -Minv dtau_dv (nv x nv each), row by row.  Reads only the entries of dtau_dq and
// dtau_dv that may be non-zero: column j has entries in the rows on one path with j, docs/math.md (D.19).  Sums run
// in the order of dynamics::fd_derivatives and have the same bits.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/autodiff/record/eigen.h>
#include <dyntape/dynamics/algorithms/data.h>

namespace dyntape {

class MinverseProduct {
 public:
  using Vector3ad = Eigen::Matrix<AD, 3, 1>;

  // kFree: the first joint is a free-flyer.  The effect of its position, orientation and linear velocity on
  // accelerations is known without M: for a body in free fall, gravity turns and w x v changes in its own frame;
  // nothing else changes.
  enum class Base { kAny, kFree };
  explicit MinverseProduct(const dynamics::Tree& tree, Base base = Base::kAny);

  // Whether a loop is faster than straight-line code.
  bool is_worth_a_loop() const;

  // ArgumentError: the robot has fewer than eight degrees of freedom.
  std::shared_ptr<const Callee> callee() const;
  // For a free base, also gravity and the angular velocity, both in its frame.
  VectorXad arguments(const MatrixXad& Minv, const MatrixXad& dtau_dq, const MatrixXad& dtau_dv,
                      const Vector3ad& gravity = Vector3ad::Zero(),
                      const Vector3ad& turn = Vector3ad::Zero()) const;

 private:
  int begin(int j) const { return j == 0 ? 0 : end_[j - 1]; }
  std::size_t n_in() const;
  void run(const AD* in, AD* out) const;
  void run(const double* in, double* out, int lanes) const;  // entry i of lane l at [i lanes + l]
  std::vector<OperationCount> operations() const;
  std::string c_loops(const std::string& real, const std::string& body) const;
  std::string c_body() const;
  std::string c_column(int width) const;
  std::string c_body_of_lanes() const;

  int nv_;
  std::array<int, 2> known_ = {0, 0};  // the first columns of the two results that need no product
  std::vector<int> path_;              // the rows of each column, one after the other
  std::vector<int> end_;               // where the rows of each column end
};

}  // namespace dyntape
