// SPDX-License-Identifier: BSD-3-Clause
//
// OCS2's StateConstraintCppAd and StateInputConstraintCppAd: a client derives a constraint, dyntape differentiates
// it.
//
//   class Reach : public ocs2::StateConstraintCppAd {
//    public:
//     Reach() : StateConstraintCppAd(ocs2::ConstraintOrder::Linear) { initialize(2, 0, "reach"); }
//     Reach* clone() const override { return new Reach(*this); }
//     std::size_t getNumConstraints(ocs2::scalar_t) const override { return 1; }
//
//    protected:
//     ocs2::ad_vector_t constraintFunction(ocs2::ad_scalar_t, const ocs2::ad_vector_t& state,
//                                          const ocs2::ad_vector_t&) const override { ... }
//   };
//
// Order Linear makes a library of first order, Quadratic one of second order.  Shapes: approximation.h.  Time is a
// variable whose derivatives are not returned.
//
// ArgumentError: sizes, a quadratic approximation of a linear constraint, initialize() was not called.  Other
// errors: those of CppAdInterface.
#pragma once

#include <dyntape/interface/ocs2/classes/costs.h>

namespace dyntape::ocs2 {

enum class ConstraintOrder { Linear, Quadratic };

namespace detail {

// A constraint of a state, or of a state and an input.
template <class Self, class... Input>
class Constraint {
 public:
  explicit Constraint(ConstraintOrder order) : order_(order) {}
  virtual ~Constraint() = default;
  virtual Self* clone() const = 0;
  ConstraintOrder getOrder() const { return order_; }
  virtual bool isActive(scalar_t /*time*/) const { return true; }
  virtual std::size_t getNumConstraints(scalar_t time) const = 0;
  virtual vector_t getValue(scalar_t time, const vector_t& state, const Input&... input,
                            const PreComputation& preComp) const = 0;
  virtual VectorFunctionLinearApproximation getLinearApproximation(scalar_t time, const vector_t& state,
                                                                   const Input&... input,
                                                                   const PreComputation& preComp) const;
  virtual VectorFunctionQuadraticApproximation getQuadraticApproximation(scalar_t time, const vector_t& state,
                                                                         const Input&... input,
                                                                         const PreComputation& preComp) const;

 protected:
  Constraint(const Constraint&) = default;

 private:
  ConstraintOrder order_;
};

}  // namespace detail

class StateConstraint : public detail::Constraint<StateConstraint> {
  using Constraint::Constraint;
};
class StateInputConstraint : public detail::Constraint<StateInputConstraint, vector_t> {
  using Constraint::Constraint;
};

namespace detail {

// A constraint that a client records; initialize() makes its model.
template <class Base, class... Input>
class RecordedConstraint : public Base {
 public:
  using Base::Base;
  void initialize(std::size_t stateDim, InPlaceOf<Input, std::size_t>... inputDim, std::size_t parameterDim,
                  const std::string& modelName, const std::string& modelFolder = "",
                  bool recompileLibraries = true, bool verbose = true, const char* file = __builtin_FILE(),
                  int line = __builtin_LINE());
  // (parameterDim) of the function.
  virtual vector_t getParameters(scalar_t /*time*/, const PreComputation&) const { return vector_t(0); }
  vector_t getValue(scalar_t time, const vector_t& state, const Input&... input,
                    const PreComputation& preComp) const override;
  VectorFunctionLinearApproximation getLinearApproximation(scalar_t time, const vector_t& state,
                                                           const Input&... input,
                                                           const PreComputation& preComp) const override;
  VectorFunctionQuadraticApproximation getQuadraticApproximation(
      scalar_t time, const vector_t& state, const Input&... input,
      const PreComputation& preComp) const override;

 protected:
  RecordedConstraint(const RecordedConstraint&) = default;
  virtual ad_vector_t constraintFunction(ad_scalar_t time, const ad_vector_t& state,
                                         const InPlaceOf<Input, ad_vector_t>&... input,
                                         const ad_vector_t& parameters) const = 0;

 private:
  virtual const char* kind() const = 0;  // for messages
  TermModel model_;
};

}  // namespace detail

class StateConstraintCppAd : public detail::RecordedConstraint<StateConstraint> {
  using RecordedConstraint::RecordedConstraint;
  const char* kind() const final { return "StateConstraintCppAd"; }
};
class StateInputConstraintCppAd : public detail::RecordedConstraint<StateInputConstraint, vector_t> {
  using RecordedConstraint::RecordedConstraint;
  const char* kind() const final { return "StateInputConstraintCppAd"; }
};

namespace detail {

// Evaluates a model of (time, state, input): value, Jacobian, and one Hessian for each row.
VectorFunctionLinearApproximation linear(const TermModel& term, const char* name, const vector_t& p,
                                         scalar_t time, const vector_t& state, const vector_t& input = {});
VectorFunctionQuadraticApproximation quadratic_rows(const TermModel& term, const char* name,
                                                    const vector_t& p, scalar_t time, const vector_t& state,
                                                    const vector_t& input = {});

}  // namespace detail

}  // namespace dyntape::ocs2
