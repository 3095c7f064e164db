// SPDX-License-Identifier: BSD-3-Clause
//
// State spaces: integration, difference and Jacobians on lines, rotations and products.
//
//   ConfigurationSpace<double> Q(model);                        // q of a robot: quaternions, (cos, sin), lines
//   ProductSpace X(Q, EuclideanSpace<double>(model.nv));        // (q, v)
//   VectorX<double> x1 = X.integrate(x0, d);                    // x0 (+) d
//   VectorX<double> e  = X.difference(x0, x1);                  // d (angles up to half a turn)
//
// A state has nx entries and moves in nt directions; x (nx), d (nt).  Jacobians are tangent (nt x nt), with
// increments at the moved point on both sides, as in model/configuration.h: of x (+) d by x and d, and of x1 (-) x0
// by x0 and x1.  `lines` lists the entries that are plain numbers, x'[line.x] = x[line.x] + d[line.t]; there a
// scheme may add as in a vector space.
#pragma once

#include <dyntape/dynamics/model/configuration.h>

#include <concepts>
#include <vector>

namespace dyntape::dynamics {

struct Line {
  int x, t;  // indices in a state and in its tangent
};

template <class S>
concept StateSpace = requires(const S& space, const VectorX<typename S::Scalar>& x) {
  { space.nx() } -> std::same_as<int>;
  { space.nt() } -> std::same_as<int>;
  { space.integrate(x, x) } -> std::same_as<VectorX<typename S::Scalar>>;
  { space.difference(x, x) } -> std::same_as<VectorX<typename S::Scalar>>;
  { space.integrate_jacobians(x) } -> std::same_as<TangentJacobians<typename S::Scalar>>;  // at d
  {
    space.difference_jacobians(x)
    } -> std::same_as<TangentJacobians<typename S::Scalar>>;  // at d = x1 (-) x0
  { space.lines() } -> std::same_as<std::vector<Line>>;
};

// n plain numbers.
template <class T>
class EuclideanSpace {
 public:
  using Scalar = T;
  explicit EuclideanSpace(int n) : n_(n) {}

  int nx() const { return n_; }
  int nt() const { return n_; }
  VectorX<T> integrate(const VectorRef<T>& x, const VectorRef<T>& d) const { return x + d; }
  VectorX<T> difference(const VectorRef<T>& x0, const VectorRef<T>& x1) const { return x1 - x0; }
  TangentJacobians<T> integrate_jacobians(const VectorRef<T>&) const { return {one(), one()}; }
  TangentJacobians<T> difference_jacobians(const VectorRef<T>&) const { return {-one(), one()}; }
  std::vector<Line> lines() const {
    std::vector<Line> lines;
    for (int i = 0; i < n_; ++i) lines.push_back({i, i});
    return lines;
  }

 private:
  MatrixX<T> one() const { return MatrixX<T>::Identity(n_, n_); }
  int n_;
};

// The configurations of a robot; holds a reference to the robot.
template <class T>
class ConfigurationSpace {
 public:
  using Scalar = T;
  explicit ConfigurationSpace(const Model<T>& model) : model_(&model) {}

  int nx() const { return model_->nq; }
  int nt() const { return model_->nv; }
  VectorX<T> integrate(const VectorRef<T>& q, const VectorRef<T>& d) const {
    return dynamics::integrate<T>(*model_, q, d);
  }
  VectorX<T> difference(const VectorRef<T>& q0, const VectorRef<T>& q1) const {
    return dynamics::difference<T>(*model_, q0, q1);
  }
  TangentJacobians<T> integrate_jacobians(const VectorRef<T>& d) const {
    return dynamics::integrate_jacobians<T>(*model_, d);
  }
  TangentJacobians<T> difference_jacobians(const VectorRef<T>& d) const {
    return dynamics::difference_jacobians<T>(*model_, d);
  }
  std::vector<Line> lines() const {
    std::vector<Line> lines;
    for (const Joint<T>& joint : model_->joints) {
      if (traits(joint.type).on_a_line) lines.push_back({joint.idx_q, joint.idx_v});
    }
    return lines;
  }

 private:
  const Model<T>* model_;
};

// Products: the entries of A, then those of B.
template <StateSpace A, StateSpace B>
class ProductSpace {
 public:
  using Scalar = typename A::Scalar;
  using T = Scalar;
  ProductSpace(const A& first, const B& second) : first_(first), second_(second) {}

  int nx() const { return first_.nx() + second_.nx(); }
  int nt() const { return first_.nt() + second_.nt(); }
  VectorX<T> integrate(const VectorRef<T>& x, const VectorRef<T>& d) const {
    return joined(first_.integrate(x.head(first_.nx()), d.head(first_.nt())),
                  second_.integrate(x.tail(second_.nx()), d.tail(second_.nt())));
  }
  VectorX<T> difference(const VectorRef<T>& x0, const VectorRef<T>& x1) const {
    return joined(first_.difference(x0.head(first_.nx()), x1.head(first_.nx())),
                  second_.difference(x0.tail(second_.nx()), x1.tail(second_.nx())));
  }
  TangentJacobians<T> integrate_jacobians(const VectorRef<T>& d) const {
    return side_by_side(first_.integrate_jacobians(d.head(first_.nt())),
                        second_.integrate_jacobians(d.tail(second_.nt())));
  }
  TangentJacobians<T> difference_jacobians(const VectorRef<T>& d) const {
    return side_by_side(first_.difference_jacobians(d.head(first_.nt())),
                        second_.difference_jacobians(d.tail(second_.nt())));
  }
  std::vector<Line> lines() const {
    std::vector<Line> lines = first_.lines();
    for (const Line& line : second_.lines()) lines.push_back({line.x + first_.nx(), line.t + first_.nt()});
    return lines;
  }

 private:
  static VectorX<T> joined(const VectorX<T>& a, const VectorX<T>& b) {
    VectorX<T> c(a.size() + b.size());
    c << a, b;
    return c;
  }
  MatrixX<T> diagonal(const MatrixX<T>& a, const MatrixX<T>& b) const {
    MatrixX<T> c = MatrixX<T>::Zero(nt(), nt());
    c.topLeftCorner(a.rows(), a.cols()) = a;
    c.bottomRightCorner(b.rows(), b.cols()) = b;
    return c;
  }
  TangentJacobians<T> side_by_side(const TangentJacobians<T>& a, const TangentJacobians<T>& b) const {
    return {diagonal(a.first, b.first), diagonal(a.second, b.second)};
  }

  A first_;
  B second_;
};

}  // namespace dyntape::dynamics
