// SPDX-License-Identifier: BSD-3-Clause
//
// Results that several terms of a problem share.  A client derives a class and casts:
//
//   const auto& mine = cast<MyPreComputation>(preComputation);
#pragma once

#include <utility>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/ocs2/names.h>

namespace dyntape::ocs2 {

enum class Request {
  Cost = 1,
  Constraint = 2,
  SoftConstraint = 4,
  Dynamics = 8,
  Approximation = 16,
};

class RequestSet {
 public:
  constexpr RequestSet(Request request)
      : bits_(static_cast<unsigned>(request)) {}  // NOLINT: a single request is a set
  constexpr RequestSet operator+(RequestSet other) const { return RequestSet(bits_ | other.bits_); }
  constexpr bool contains(Request request) const { return (bits_ & static_cast<unsigned>(request)) != 0; }
  constexpr bool containsAny(RequestSet other) const { return (bits_ & other.bits_) != 0; }
  constexpr bool containsAll(RequestSet other) const { return (bits_ & other.bits_) == other.bits_; }

 private:
  explicit constexpr RequestSet(unsigned bits) : bits_(bits) {}
  unsigned bits_;
};
constexpr RequestSet operator+(Request a, Request b) { return RequestSet(a) + RequestSet(b); }

class PreComputation {
 public:
  using Request = ocs2::Request;
  using RequestSet = ocs2::RequestSet;

  PreComputation() = default;
  virtual ~PreComputation() = default;
  virtual PreComputation* clone() const { return new PreComputation(*this); }
  virtual void request(RequestSet, scalar_t /*time*/, const vector_t& /*state*/, const vector_t& /*input*/) {}
  virtual void requestPreJump(RequestSet, scalar_t /*time*/, const vector_t& /*state*/) {}
  virtual void requestFinal(RequestSet, scalar_t /*time*/, const vector_t& /*state*/) {}

 protected:
  PreComputation(const PreComputation&) = default;
};

template <class Derived>
const Derived& cast(const PreComputation& preComputation) {
  const auto* derived = dynamic_cast<const Derived*>(&preComputation);
  if (!derived) throw ArgumentError("cast: this PreComputation is of another class");
  return *derived;
}
template <class Derived>
Derived& cast(PreComputation& preComputation) {
  return const_cast<Derived&>(cast<Derived>(std::as_const(preComputation)));
}

}  // namespace dyntape::ocs2
