// SPDX-License-Identifier: BSD-3-Clause
//
// An array whose index may be a recorded value.
//
//   VecAD<double> table(3);
//   table[size_t(0)] = 1.0;                        // before or in a recording
//   AD<double> y = table[ax[0]];                   // the element at the integer part of ax[0] at evaluation
//   table[ax[0]] = ax[1];                          // later reads see the new element
//
// An access by a recorded index records a condition on each element: the cost is linear in the number of elements.
// At evaluation, an index outside the array reads element 0 and writes nothing.  ArgumentError: an index outside the
// array at the recording point.
#pragma once

#include <string>

#include <dyntape/interface/cppad/conditions.h>
#include <dyntape/interface/cppad/vector.h>

namespace CppAD::inline dyntape_names {

template <class Base>
class VecAD;

// The element at an index: an AD<Base> with the value that it had when it was asked for, which assignment stores.
template <class Base>
class VecAD_reference : public AD<Base> {
 public:
  using S = AD<Base>;
  VecAD_reference(VecAD<Base>& array, const S& index) : S(array.load(index)), array_(array), index_(index) {}
  VecAD_reference(const VecAD_reference&) = default;

  VecAD_reference& operator=(const VecAD_reference& other) { return *this = static_cast<const S&>(other); }
  VecAD_reference& operator=(const S& value) {
    array_.store(index_, value);
    S::operator=(value);
    return *this;
  }
  template <MixesWith<Base> Number>
  VecAD_reference& operator=(const Number& value) {
    return *this = S(value);
  }
  VecAD_reference& operator+=(const S& b) { return *this = *this + b; }
  VecAD_reference& operator-=(const S& b) { return *this = *this - b; }
  VecAD_reference& operator*=(const S& b) { return *this = *this * b; }
  VecAD_reference& operator/=(const S& b) { return *this = *this / b; }

 private:
  VecAD<Base>& array_;
  S index_;
};

template <class Base>
class VecAD {
 public:
  using S = AD<Base>;
  using reference = VecAD_reference<Base>;

  VecAD() = default;
  explicit VecAD(std::size_t n) : elements_(n) {}

  std::size_t size() const { return elements_.size(); }
  S& operator[](std::size_t i) { return elements_[i]; }
  S& operator[](int i) { return elements_[std::size_t(i)]; }
  reference operator[](const S& index) { return {*this, index}; }
  template <MixesWith<Base> Number>
  requires(!std::integral<Number>) reference operator[](const Number& index) { return {*this, S(index)}; }

 private:
  friend VecAD_reference<Base>;

  std::size_t place(const S& index) const {
    const auto value = plain_value(index);
    if (!(value >= 0) || value >= double(size()))
      detail::refuse("VecAD: index " + std::to_string(double(value)) + ", expected one of 0 to " +
                     std::to_string(size()) + " exclusive");
    return static_cast<std::size_t>(value);
  }
  S load(const S& index) const {
    const std::size_t now = place(index);
    if (Constant(index)) return elements_[now];
    const S whole = trunc(index);
    S element = elements_[0];
    for (std::size_t k = 1; k < size(); ++k) element = CondExpEq(whole, S(double(k)), elements_[k], element);
    return element;
  }
  void store(const S& index, const S& value) {
    const std::size_t now = place(index);
    if (Constant(index)) {
      elements_[now] = value;
      return;
    }
    const S whole = trunc(index);
    for (std::size_t k = 0; k < size(); ++k)
      elements_[k] = CondExpEq(whole, S(double(k)), value, elements_[k]);
  }

  vector<S> elements_;
};

}  // namespace CppAD::inline dyntape_names
