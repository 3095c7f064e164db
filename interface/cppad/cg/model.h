// SPDX-License-Identifier: BSD-3-Clause
//
// A model of a library: computes values and derivatives by compiled kernels (cg.h).
//
//   std::vector<double> y = model->ForwardZero(x), J = model->Jacobian(x), H = model->Hessian(x, w);
//   model->SparseHessian(x, w, values, rows, cols);      // both triangles, or the selected elements
//
// Calls throw if the library has no such derivative; the message names the setCreate... call to add.
#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include <dyntape/interface/cppad/ad_fun.h>

namespace CppAD::inline dyntape_names {
template <class Base>
class atomic_base;
}

namespace CppAD::inline dyntape_names::cg {

template <class Base>
using CG = AD<Base>;

// A view of a part of an array.
template <class Type>
class ArrayView {
 public:
  ArrayView() = default;
  ArrayView(Type* data, std::size_t size) : data_(data), size_(size) {}
  template <class Vector>
  requires requires(Vector& v) {
    v.size();
    { &v[0] } -> std::convertible_to<Type*>;
  }  // NOLINTNEXTLINE: vectors are passed as views
  ArrayView(Vector& v) : data_(v.size() > 0 ? &v[0] : nullptr), size_(std::size_t(v.size())) {}
  template <class Vector>
  requires requires(const Vector& v) {
    v.size();
    { &v[0] } -> std::convertible_to<Type*>;
  }  // NOLINTNEXTLINE: also temporary ones
  ArrayView(const Vector& v) : data_(v.size() > 0 ? &v[0] : nullptr), size_(std::size_t(v.size())) {}
  ArrayView(const ArrayView&) = default;
  // Copies the elements, of which there are as many.
  ArrayView& operator=(const ArrayView& other) { return copy(other), *this; }
  template <class Other>
  ArrayView& operator=(const ArrayView<Other>& other) {
    return copy(other), *this;
  }
  Type* data() const { return data_; }
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  Type& operator[](std::size_t i) const { return data_[i]; }
  Type& at(std::size_t i) const {
    detail::check_index("ArrayView: element", i, size_);
    return data_[i];
  }
  Type* begin() const { return data_; }
  Type* end() const { return data_ + size_; }

 private:
  template <class Other>
  void copy(const ArrayView<Other>& other) {
    detail::check_size("ArrayView: the size of the other", other.size(), size_);
    for (std::size_t i = 0; i < size_; ++i) data_[i] = other.data()[i];
  }

  Type* data_ = nullptr;
  std::size_t size_ = 0;
};

template <class Base>
class CGAtomicGenericModel;
struct ModelState;  // the compiled function and what was asked for; in model.cpp

// The parts that ModelCSourceGen creates.
struct ModelChoice {
  bool forward_zero = true, jacobian = false, hessian = false, sparse_jacobian = false,
       sparse_hessian = false, forward_one = false, reverse_one = false, reverse_two = false;
  std::vector<std::size_t> jacobian_rows, jacobian_cols, hessian_rows, hessian_cols;  // empty: all
};

template <class Base>
class GenericModel {
  static_assert(std::is_same_v<Base, double>, "GenericModel<Base>: Base is double");

 public:
  using In = ArrayView<const double>;
  using Out = ArrayView<double>;
  using Doubles = std::vector<double>;
  using Sizes = std::vector<std::size_t>;
  using Sets = std::vector<std::set<std::size_t>>;

  explicit GenericModel(std::shared_ptr<const ModelState> state) : state_(std::move(state)) {}
  GenericModel(GenericModel&&) noexcept = default;
  virtual ~GenericModel() = default;

  const std::string& getName() const;
  std::size_t Domain() const;
  std::size_t Range() const;
  // The recorded function, and the same function for other recordings (atomic_fun.h).
  std::shared_ptr<detail::Fun<Base>> recorded() const;
  CGAtomicGenericModel<Base>& asAtomic();
  // A model contains the functions that it calls: these calls add nothing.
  std::vector<std::string> getAtomicFunctionNames() const { return {}; }
  bool addAtomicFunction(atomic_base<Base>&) { return false; }
  bool addExternalModel(GenericModel&) { return false; }

  bool isForwardZeroAvailable() const { return choice().forward_zero; }
  bool isJacobianAvailable() const { return choice().jacobian; }
  bool isHessianAvailable() const { return choice().hessian; }
  bool isSparseJacobianAvailable() const { return choice().sparse_jacobian; }
  bool isSparseHessianAvailable() const { return choice().sparse_hessian; }
  bool isForwardOneAvailable() const { return choice().forward_one; }
  bool isReverseOneAvailable() const { return choice().reverse_one; }
  bool isReverseTwoAvailable() const { return choice().reverse_two; }
  bool isJacobianSparsityAvailable() const { return true; }
  bool isHessianSparsityAvailable() const { return choice().sparse_hessian || choice().hessian; }

  // --- values: (n) -> (m) ---
  template <class Vector>
  Vector ForwardZero(const Vector& x) const {
    return made<Vector>(Range(), [&](Out y) { zero(in(x), y); });
  }
  template <class Vector>
  void ForwardZero(const Vector& x, Vector& y) const {
    into(y, [&](Out out) { zero(in(x), out); });
  }
  void ForwardZero(In x, Out y) const { zero(x, y); }

  // --- dense derivatives, row by row ---
  template <class Vector>
  Vector Jacobian(const Vector& x) const {
    return made<Vector>(Range() * Domain(), [&](Out J) { dense_jacobian(in(x), J); });
  }
  template <class Vector>
  void Jacobian(const Vector& x, Vector& J) const {
    into(J, [&](Out out) { dense_jacobian(in(x), out); });
  }
  void Jacobian(In x, Out J) const { dense_jacobian(x, J); }
  template <class Vector>
  Vector Hessian(const Vector& x, const Vector& w) const {
    return made<Vector>(Domain() * Domain(), [&](Out H) { dense_hessian(in(x), in(w), H); });
  }
  template <class Vector>
  Vector Hessian(const Vector& x, std::size_t i) const {
    return made<Vector>(Domain() * Domain(), [&](Out H) { dense_hessian(in(x), weight(i), H); });
  }
  template <class Vector>
  void Hessian(const Vector& x, const Vector& w, Vector& H) const {
    into(H, [&](Out out) { dense_hessian(in(x), in(w), out); });
  }
  void Hessian(In x, In w, Out H) const { dense_hessian(x, w, H); }

  // --- directions, by Taylor coefficients [j 2 + k] ---
  template <class Vector>
  Vector ForwardOne(const Vector& tx) const {  // tx (2 n) -> dy (m)
    return made<Vector>(Range(), [&](Out dy) { first_order(in(tx), dy); });
  }
  template <class Vector>
  void ForwardOne(const Vector& tx, Vector& ty) const {  // ty (2 m): its second halves
    Doubles dy(Range());
    first_order(in(tx), dy);
    for (std::size_t i = 0; i < dy.size(); ++i) ty[2 * i + 1] = dy[i];
  }
  template <class Vector>
  Vector ReverseOne(const Vector& tx, const Vector&, const Vector& py) const {  // x (n), py (m) -> px (n)
    return made<Vector>(Domain(), [&](Out px) { adjoint(in(tx), in(py), px); });
  }
  template <class Vector>
  void ReverseOne(const Vector& tx, const Vector&, Vector& px, const Vector& py) const {
    into(px, [&](Out out) { adjoint(in(tx), in(py), out); });
  }
  template <class Vector>
  Vector ReverseTwo(const Vector& tx, const Vector&, const Vector& py) const {  // (2 n), (2 m) -> px (2 n)
    return made<Vector>(2 * Domain(), [&](Out px) { adjoint_two(in(tx), in(py), px); });
  }
  template <class Vector>
  void ReverseTwo(const Vector& tx, const Vector&, Vector& px, const Vector& py) const {
    into(px, [&](Out out) { adjoint_two(in(tx), in(py), out); });
  }

  // --- sparse derivatives ---
  template <class Vector>
  Vector SparseJacobian(const Vector& x) const {  // dense, row by row
    return made<Vector>(Range() * Domain(), [&](Out J) { spread_jacobian(in(x), J); });
  }
  template <class Vector, class SizeVector>
  void SparseJacobian(const Vector& x, Vector& values, SizeVector& row, SizeVector& col) const {
    values.resize(jacobian_rows().size());
    into(values, [&](Out out) { jacobian_values(in(x), out); });
    copy_sizes(jacobian_rows(), row), copy_sizes(jacobian_cols(), col);
  }
  void SparseJacobian(In x, Out values, const std::size_t** row, const std::size_t** col) const;
  template <class Vector>
  Vector SparseHessian(const Vector& x, const Vector& w) const {
    return made<Vector>(Domain() * Domain(), [&](Out H) { spread_hessian(in(x), in(w), H); });
  }
  template <class Vector, class SizeVector>
  void SparseHessian(const Vector& x, const Vector& w, Vector& values, SizeVector& row,
                     SizeVector& col) const {
    values.resize(hessian_rows().size());
    into(values, [&](Out out) { hessian_values(in(x), in(w), out); });
    copy_sizes(hessian_rows(), row), copy_sizes(hessian_cols(), col);
  }
  void SparseHessian(In x, In w, Out values, const std::size_t** row, const std::size_t** col) const;

  // --- patterns ---
  void JacobianSparsity(Sizes& row, Sizes& col) const { row = jacobian_rows(), col = jacobian_cols(); }
  void HessianSparsity(Sizes& row, Sizes& col) const { row = hessian_rows(), col = hessian_cols(); }
  Sets JacobianSparsitySet() const { return sets(Range(), jacobian_rows(), jacobian_cols()); }
  Sets HessianSparsitySet() const { return sets(Domain(), hessian_rows(), hessian_cols()); }
  std::vector<bool> JacobianSparsityBool() const { return bools(Range(), jacobian_rows(), jacobian_cols()); }
  std::vector<bool> HessianSparsityBool() const { return bools(Domain(), hessian_rows(), hessian_cols()); }

 private:
  template <class Vector>
  static constexpr bool kIsContiguous = requires(Vector& v) {
    { v.data() } -> std::convertible_to<const double*>;
  };

  const ModelChoice& choice() const;
  // Into the caller's memory, whose size is checked.
  void zero(In x, Out y) const;
  void dense_jacobian(In x, Out J) const;
  void dense_hessian(In x, In w, Out H) const;
  void first_order(In tx, Out dy) const;
  void adjoint(In x, In py, Out px) const;
  void adjoint_two(In tx, In py, Out px) const;
  void jacobian_values(In x, Out values) const;
  void hessian_values(In x, In w, Out values) const;
  void spread_jacobian(In x, Out J) const;
  void spread_hessian(In x, In w, Out H) const;
  Doubles weight(std::size_t i) const;
  const Sizes& jacobian_rows() const;
  const Sizes& jacobian_cols() const;
  const Sizes& hessian_rows() const;
  const Sizes& hessian_cols() const;

  // The entries of a vector where they are, or copies of them.
  template <class Vector>
  static auto in(const Vector& v) {
    if constexpr (kIsContiguous<Vector>) {
      return In(v.data(), std::size_t(v.size()));
    } else {
      return detail::copied<Doubles>(v);
    }
  }
  // write(view) computes the entries of a vector.
  template <class Vector, class Write>
  static void into(Vector& v, const Write& write) {
    if constexpr (kIsContiguous<Vector>) {
      write(Out(v.data(), std::size_t(v.size())));
    } else {
      Doubles values(std::size_t(v.size()));
      write(values);
      for (std::size_t i = 0; i < values.size(); ++i) v[i] = values[i];
    }
  }
  template <class Vector, class Write>
  static Vector made(std::size_t n, const Write& write) {
    Vector v(n);
    into(v, write);
    return v;
  }
  template <class SizeVector>
  static void copy_sizes(const Sizes& from, SizeVector& to) {
    to.resize(from.size());
    for (std::size_t k = 0; k < from.size(); ++k) to[k] = from[k];
  }
  static Sets sets(std::size_t n, const Sizes& rows, const Sizes& cols) {
    Sets all(n);
    for (std::size_t k = 0; k < rows.size(); ++k) all[rows[k]].insert(cols[k]);
    return all;
  }
  std::vector<bool> bools(std::size_t n, const Sizes& rows, const Sizes& cols) const {
    std::vector<bool> all(n * Domain(), false);
    for (std::size_t k = 0; k < rows.size(); ++k) all[rows[k] * Domain() + cols[k]] = true;
    return all;
  }

  std::shared_ptr<const ModelState> state_;
  std::shared_ptr<CGAtomicGenericModel<Base>> atomic_;
};

}  // namespace CppAD::inline dyntape_names::cg
