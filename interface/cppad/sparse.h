// SPDX-License-Identifier: BSD-3-Clause
//
// Sparse patterns and matrices as rows and columns of their entries.
//
//   sparse_rc<std::vector<size_t>> pattern(2, 3, 1);
//   pattern.set(0, 1, 2);                                          // entry 0 is at (1, 2)
//   sparse_rcv<std::vector<size_t>, std::vector<double>> J(pattern);
//   f.sparse_jac_for(10, x, J, pattern, "cppad", work);            // J.val()
#pragma once

#include <cstddef>
#include <string>
#include <utility>

#include <dyntape/interface/cppad/vector.h>

namespace CppAD::inline dyntape_names {

namespace detail {
// The order of entries by the first index, then by the second (sets.cpp).
vector<std::size_t> sorted_places(const vector<std::size_t>& first, const vector<std::size_t>& second);
}  // namespace detail

template <class SizeVector>
class sparse_rc {
 public:
  sparse_rc() : row_(0), col_(0), row_major_(0), col_major_(0) {}
  sparse_rc(std::size_t nr, std::size_t nc, std::size_t nnz) : sparse_rc() { resize(nr, nc, nnz); }

  void resize(std::size_t nr, std::size_t nc, std::size_t nnz) {
    nr_ = nr, nc_ = nc, nnz_ = nnz;
    row_.resize(nnz);
    col_.resize(nnz);
    forget_orders();
  }
  void set(std::size_t k, std::size_t r, std::size_t c) {
    if (k >= nnz_ || r >= nr_ || c >= nc_)
      detail::refuse("sparse_rc::set: entry " + std::to_string(k) + " at (" + std::to_string(r) + ", " +
                     std::to_string(c) + "), expected one of " + std::to_string(nnz_) + " within " +
                     std::to_string(nr_) + " x " + std::to_string(nc_));
    row_[k] = r;
    col_[k] = c;
    forget_orders();
  }
  void push_back(std::size_t r, std::size_t c) {
    SizeVector rows(nnz_ + 1), cols(nnz_ + 1);
    for (std::size_t k = 0; k < nnz_; ++k) rows[k] = row_[k], cols[k] = col_[k];
    row_ = rows, col_ = cols;
    ++nnz_;
    set(nnz_ - 1, r, c);
  }
  std::size_t nr() const { return nr_; }
  std::size_t nc() const { return nc_; }
  std::size_t nnz() const { return nnz_; }
  const SizeVector& row() const { return row_; }
  const SizeVector& col() const { return col_; }
  SizeVector row_major() const { return order(row_, col_); }
  SizeVector col_major() const { return order(col_, row_); }
  // Store the order until an entry changes; do not move entries.
  void set_row_major() { row_major_ = row_major(); }
  void set_col_major() { col_major_ = col_major(); }
  const SizeVector& get_row_major() const { return row_major_; }
  const SizeVector& get_col_major() const { return col_major_; }
  void swap(sparse_rc& other) { std::swap(*this, other); }

  friend bool operator==(const sparse_rc& a, const sparse_rc& b) {
    if (a.nr_ != b.nr_ || a.nc_ != b.nc_ || a.nnz_ != b.nnz_) return false;
    const SizeVector of_a = a.row_major(), of_b = b.row_major();
    for (std::size_t k = 0; k < a.nnz_; ++k) {
      if (a.row_[of_a[k]] != b.row_[of_b[k]] || a.col_[of_a[k]] != b.col_[of_b[k]]) return false;
    }
    return true;
  }
  friend std::ostream& operator<<(std::ostream& out, const sparse_rc& a) {
    out << "{ ";
    for (std::size_t k = 0; k < a.nnz_; ++k)
      out << (k ? ", " : "") << "(" << a.row_[k] << "," << a.col_[k] << ")";
    return out << " }";
  }

 private:
  void forget_orders() {
    if (row_major_.size() > 0) row_major_.resize(0);
    if (col_major_.size() > 0) col_major_.resize(0);
  }
  // The order of entries by the first index, then by the second.
  SizeVector order(const SizeVector& first, const SizeVector& second) const {
    vector<std::size_t> a(nnz_), b(nnz_);
    for (std::size_t k = 0; k < nnz_; ++k) a[k] = first[k], b[k] = second[k];
    const vector<std::size_t> places = detail::sorted_places(a, b);
    SizeVector result(nnz_);
    for (std::size_t k = 0; k < nnz_; ++k) result[k] = places[k];
    return result;
  }

  std::size_t nr_ = 0, nc_ = 0, nnz_ = 0;
  SizeVector row_, col_, row_major_, col_major_;
};

template <class SizeVector, class ValueVector>
class sparse_rcv {
 public:
  sparse_rcv() : val_(0) {}
  explicit sparse_rcv(const sparse_rc<SizeVector>& pattern) : pattern_(pattern), val_(pattern.nnz()) {}

  void resize(std::size_t nr, std::size_t nc, std::size_t nnz) {
    pattern_.resize(nr, nc, nnz);
    val_.resize(nnz);
  }
  template <class Value>
  void set(std::size_t k, const Value& value) {
    detail::check_index("sparse_rcv::set: entry", k, nnz());
    val_[k] = value;
  }
  template <class Value>
  void set(std::size_t k, std::size_t r, std::size_t c, const Value& value) {
    pattern_.set(k, r, c);
    val_[k] = value;
  }
  std::size_t nr() const { return pattern_.nr(); }
  std::size_t nc() const { return pattern_.nc(); }
  std::size_t nnz() const { return pattern_.nnz(); }
  const SizeVector& row() const { return pattern_.row(); }
  const SizeVector& col() const { return pattern_.col(); }
  const ValueVector& val() const { return val_; }
  const sparse_rc<SizeVector>& pat() const { return pattern_; }
  SizeVector row_major() const { return pattern_.row_major(); }
  SizeVector col_major() const { return pattern_.col_major(); }
  void set_row_major() { pattern_.set_row_major(); }
  void set_col_major() { pattern_.set_col_major(); }
  const SizeVector& get_row_major() const { return pattern_.get_row_major(); }
  const SizeVector& get_col_major() const { return pattern_.get_col_major(); }
  void swap(sparse_rcv& other) { std::swap(*this, other); }

 private:
  sparse_rc<SizeVector> pattern_;
  ValueVector val_;
};

}  // namespace CppAD::inline dyntape_names
