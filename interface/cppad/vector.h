// SPDX-License-Identifier: BSD-3-Clause
//
// CppAD::vector: a vector whose elements have addresses, also if they are bools; and the vector of CppAD's test
// programs.
//
//   CPPAD_TESTVECTOR(double) x(3);
//
// ArgumentError: an index beyond the end, in every build.
#pragma once

#include <compare>
#include <concepts>
#include <cstddef>
#include <initializer_list>
#include <iterator>
#include <memory>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

// The names are in namespace CppAD, so that programs may open and specialise it.  The inline namespace makes their
// symbols differ from those of programs that are compiled with CppAD's own headers.
namespace CppAD::inline dyntape_names {}
namespace dyntape {
namespace cppad = ::CppAD;
}

namespace CppAD::inline dyntape_names {

namespace detail {
using namespace ::dyntape;  // this layer is written over dyntape's graph
[[noreturn]] void refuse(const std::string& sentence);
[[noreturn]] void refuse_size(const std::string& what, std::size_t got, std::size_t expected);
[[noreturn]] void refuse_index(const std::string& what, std::size_t i, std::size_t n);
// A vector of any class as one of another class.
template <class To, class From>
To copied(const From& from) {
  const auto n = static_cast<std::size_t>(from.size());
  To to(n);
  for (std::size_t i = 0; i < n; ++i) to[i] = static_cast<typename To::value_type>(from[i]);
  return to;
}
// ArgumentError: "<what>: got <got>, expected <expected>".
inline void check_size(const char* what, std::size_t got, std::size_t expected) {
  if (got != expected) refuse_size(what, got, expected);
}
// ArgumentError: "<what> <i> does not exist; there are <n>".
inline void check_index(const char* what, std::size_t i, std::size_t n) {
  if (i >= n) refuse_index(what, i, n);
}

// A pointer as a class, because programs expect a class for iterators.
template <class Type>
class VectorIterator {
 public:
  using iterator_category = std::random_access_iterator_tag;
  using value_type = std::remove_cv_t<Type>;
  using difference_type = std::ptrdiff_t;
  using pointer = Type*;
  using reference = Type&;

  VectorIterator() = default;
  explicit VectorIterator(Type* at) : at_(at) {}
  template <class Other>
  requires std::convertible_to<Other*, Type*> VectorIterator(const VectorIterator<Other>& other)  // NOLINT
      : at_(other.operator->()) {}

  Type& operator*() const { return *at_; }
  Type* operator->() const { return at_; }
  Type& operator[](difference_type i) const { return at_[i]; }
  VectorIterator& operator++() { return ++at_, *this; }
  VectorIterator& operator--() { return --at_, *this; }
  VectorIterator operator++(int) { return VectorIterator(at_++); }
  VectorIterator operator--(int) { return VectorIterator(at_--); }
  VectorIterator& operator+=(difference_type n) { return at_ += n, *this; }
  VectorIterator& operator-=(difference_type n) { return at_ -= n, *this; }
  friend VectorIterator operator+(VectorIterator a, difference_type n) { return a += n; }
  friend VectorIterator operator+(difference_type n, VectorIterator a) { return a += n; }
  friend VectorIterator operator-(VectorIterator a, difference_type n) { return a -= n; }
  friend difference_type operator-(VectorIterator a, VectorIterator b) { return a.at_ - b.at_; }
  friend bool operator==(VectorIterator a, VectorIterator b) { return a.at_ == b.at_; }
  friend auto operator<=>(VectorIterator a, VectorIterator b) { return a.at_ <=> b.at_; }

 private:
  Type* at_ = nullptr;
};

}  // namespace detail

template <class Type>
class vector {
 public:
  using value_type = Type;
  using iterator = detail::VectorIterator<Type>;
  using const_iterator = detail::VectorIterator<const Type>;

  vector() = default;
  explicit vector(std::size_t n) { resize(n); }
  vector(std::size_t n, const Type& value) {
    resize(n);
    for (Type& element : *this) element = value;
  }
  vector(std::initializer_list<Type> values) { assign(values.begin(), values.end()); }
  template <class Iterator>
  requires requires(Iterator i) { *i, ++i; }
  vector(Iterator first, Iterator last) { assign(first, last); }
  vector(const vector& other) { assign(other.begin(), other.end()); }
  vector(vector&& other) noexcept { swap(other); }
  vector& operator=(const vector& other) {
    if (this != &other) assign(other.begin(), other.end());
    return *this;
  }
  vector& operator=(vector&& other) noexcept {
    swap(other);
    return *this;
  }

  std::size_t size() const { return size_; }
  std::size_t capacity() const { return capacity_; }
  bool empty() const { return size_ == 0; }
  Type* data() { return data_.get(); }
  const Type* data() const { return data_.get(); }
  iterator begin() { return iterator(data()); }
  iterator end() { return iterator(data() + size_); }
  const_iterator begin() const { return const_iterator(data()); }
  const_iterator end() const { return const_iterator(data() + size_); }
  Type& operator[](std::size_t i) { return check(i), data_[i]; }
  const Type& operator[](std::size_t i) const { return check(i), data_[i]; }

  // Keeps the elements if n fits the capacity.
  void resize(std::size_t n) {
    if (n > capacity_) grow(n);
    size_ = n;
  }
  void clear() { data_.reset(), size_ = capacity_ = 0; }
  void push_back(const Type& value) {
    const Type copy = value;
    if (size_ == capacity_) grow(2 * size_ + 1);
    data_[size_++] = copy;
  }
  template <class Vector>
  void push_vector(const Vector& values) {
    for (std::size_t i = 0, n = values.size(); i < n; ++i) push_back(values[i]);
  }
  void swap(vector& other) noexcept {
    std::swap(data_, other.data_), std::swap(size_, other.size_), std::swap(capacity_, other.capacity_);
  }
  template <class Iterator>
  void assign(Iterator first, Iterator last) {
    size_ = 0;
    for (; first != last; ++first) push_back(*first);
  }

  // Compare element by element, then by size.
  friend bool operator==(const vector& a, const vector& b) {
    if (a.size_ != b.size_) return false;
    for (std::size_t i = 0; i < a.size_; ++i)
      if (!(a.data()[i] == b.data()[i])) return false;
    return true;
  }
  friend bool operator<(const vector& a, const vector& b) {
    for (std::size_t i = 0; i < a.size_ && i < b.size_; ++i) {
      if (a.data()[i] < b.data()[i]) return true;
      if (b.data()[i] < a.data()[i]) return false;
    }
    return a.size_ < b.size_;
  }
  friend bool operator>(const vector& a, const vector& b) { return b < a; }
  friend bool operator<=(const vector& a, const vector& b) { return !(b < a); }
  friend bool operator>=(const vector& a, const vector& b) { return !(a < b); }

  friend std::ostream& operator<<(std::ostream& out, const vector& v) {
    out << "{ ";
    for (std::size_t i = 0; i < v.size(); ++i) out << (i ? ", " : "") << v[i];
    return out << " }";
  }

 private:
  void check(std::size_t i) const { detail::check_index("vector: element", i, size_); }
  void grow(std::size_t n) {
    std::unique_ptr<Type[]> larger(new Type[n]());
    for (std::size_t i = 0; i < size_; ++i) larger[i] = std::move(data_[i]);
    data_ = std::move(larger);
    capacity_ = n;
  }

  std::unique_ptr<Type[]> data_;
  std::size_t size_ = 0, capacity_ = 0;
};

// A vector of bools, printed without braces and commas.
class vectorBool : public vector<bool> {
 public:
  using vector<bool>::vector;
  static std::size_t bit_per_unit() { return 8 * sizeof(bool); }
  friend std::ostream& operator<<(std::ostream& out, const vectorBool& v) {
    for (bool b : v) out << b;
    return out;
  }
};

}  // namespace CppAD::inline dyntape_names

#define CPPAD_TESTVECTOR(Scalar) ::CppAD::vector<Scalar>
