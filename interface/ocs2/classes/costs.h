// SPDX-License-Identifier: BSD-3-Clause
//
// OCS2's StateCostCppAd, StateInputCostCppAd and StateInputCostGaussNewtonAd: a client derives a cost, dyntape
// differentiates it.
//
//   class Tracking : public ocs2::StateCostCppAd {
//    public:
//     Tracking() { initialize(2, 2, "tracking"); }
//     Tracking* clone() const override { return new Tracking(*this); }
//     ocs2::vector_t getParameters(ocs2::scalar_t time, const ocs2::TargetTrajectories& targets,
//                                  const ocs2::PreComputation&) const override { return targets.getDesiredState(time); }
//
//    protected:
//     ocs2::ad_scalar_t costFunction(ocs2::ad_scalar_t, const ocs2::ad_vector_t& state,
//                                    const ocs2::ad_vector_t& parameters) const override {
//       return (state - parameters).squaredNorm();
//     }
//   };
//
// Variables: time and state, or time, state and input.  Derivatives by time are not returned.
//   state (nx), input (nu)   results have the shapes of approximation.h
//   modelFolder              root of the cache; empty: the user's default cache
//   recompileLibraries       as in OCS2, createModels or loadModelsIfAvailable; neither loads a stale library
//
// ArgumentError: sizes, initialize() was not called.  Other errors: those of CppAdInterface; errors of a recording
// name the line of initialize().
#pragma once

#include <memory>
#include <string>

#include <dyntape/interface/ocs2/classes/linear_interpolation.h>
#include <dyntape/interface/ocs2/classes/pre_computation.h>
#include <dyntape/interface/ocs2/cpp_ad_interface.h>

namespace dyntape::ocs2 {

namespace detail {

// A cost of a state, or of a state and an input.
template <class Self, class... Input>
class Cost {
 public:
  Cost() = default;
  virtual ~Cost() = default;
  virtual Self* clone() const = 0;
  virtual bool isActive(scalar_t /*time*/) const { return true; }
  virtual scalar_t getValue(scalar_t time, const vector_t& state, const Input&... input,
                            const TargetTrajectories& targetTrajectories,
                            const PreComputation& preComp) const = 0;
  virtual ScalarFunctionQuadraticApproximation getQuadraticApproximation(
      scalar_t time, const vector_t& state, const Input&... input,
      const TargetTrajectories& targetTrajectories, const PreComputation& preComp) const = 0;

 protected:
  Cost(const Cost&) = default;
};

}  // namespace detail

class StateCost : public detail::Cost<StateCost> {};
class StateInputCost : public detail::Cost<StateInputCost, vector_t> {};

namespace detail {

// A model of (time, state, input), made by initialize(); copies share it.
class TermModel {
 public:
  using Function = std::function<ad_vector_t(ad_scalar_t time, const ad_vector_t& state,
                                             const ad_vector_t& input, const ad_vector_t& parameters)>;
  struct Sizes {
    std::size_t state = 0, input = 0, parameters = 0;
  };

  struct Place {
    const char* file;
    int line;
  };

  void make(Function function, Sizes sizes, const std::string& modelName, const std::string& modelFolder,
            CppAdInterface::ApproximationOrder order, bool recompileLibraries, bool verbose, Place place);
  bool is_made() const { return model_ != nullptr; }
  // ArgumentError, naming the class, if there is no model.
  const CppAdInterface& of(const char* name) const;
  // (time, state, input), with checked sizes.
  vector_t variables(const char* name, scalar_t time, const vector_t& state,
                     const vector_t& input = {}) const;
  const Sizes& sizes() const { return sizes_; }

 private:
  Sizes sizes_;
  std::shared_ptr<const CppAdInterface> model_;
};

// Blocks of derivatives by state and input, without the block of time; without inputs the input blocks are empty.
ScalarFunctionQuadraticApproximation scalar_blocks(const TermModel::Sizes& sizes, scalar_t value,
                                                   const vector_t& gradient, const matrix_t& hessian);

// The argument for each input of the model.
template <class Input, class T>
using InPlaceOf = T;

// A cost that a client records; initialize() makes its model.
template <class Base, class... Input>
class RecordedCost : public Base {
 public:
  RecordedCost() = default;
  void initialize(std::size_t stateDim, InPlaceOf<Input, std::size_t>... inputDim, std::size_t parameterDim,
                  const std::string& modelName, const std::string& modelFolder = "",
                  bool recompileLibraries = true, bool verbose = true, const char* file = __builtin_FILE(),
                  int line = __builtin_LINE());
  // (parameterDim) of the function.
  virtual vector_t getParameters(scalar_t /*time*/, const TargetTrajectories&, const PreComputation&) const {
    return vector_t(0);
  }
  scalar_t getValue(scalar_t time, const vector_t& state, const Input&... input,
                    const TargetTrajectories& targetTrajectories,
                    const PreComputation& preComp) const override;
  ScalarFunctionQuadraticApproximation getQuadraticApproximation(
      scalar_t time, const vector_t& state, const Input&... input,
      const TargetTrajectories& targetTrajectories, const PreComputation& preComp) const override;

 protected:
  RecordedCost(const RecordedCost&) = default;

 private:
  virtual const char* kind() const = 0;  // for messages
  virtual bool is_gauss_newton() const { return false; }
  virtual ad_vector_t values(ad_scalar_t time, const ad_vector_t& state,
                             const InPlaceOf<Input, ad_vector_t>&... input,
                             const ad_vector_t& parameters) const = 0;
  TermModel model_;
};

inline ad_vector_t one(const ad_scalar_t& value) { return ad_vector_t::Constant(1, value); }

}  // namespace detail

class StateCostCppAd : public detail::RecordedCost<StateCost> {
 protected:
  virtual ad_scalar_t costFunction(ad_scalar_t time, const ad_vector_t& state,
                                   const ad_vector_t& parameters) const = 0;

 private:
  const char* kind() const final { return "StateCostCppAd"; }
  ad_vector_t values(ad_scalar_t time, const ad_vector_t& state, const ad_vector_t& parameters) const final {
    return detail::one(costFunction(time, state, parameters));
  }
};

class StateInputCostCppAd : public detail::RecordedCost<StateInputCost, vector_t> {
 protected:
  virtual ad_scalar_t costFunction(ad_scalar_t time, const ad_vector_t& state, const ad_vector_t& input,
                                   const ad_vector_t& parameters) const = 0;

 private:
  const char* kind() const final { return "StateInputCostCppAd"; }
  ad_vector_t values(ad_scalar_t time, const ad_vector_t& state, const ad_vector_t& input,
                     const ad_vector_t& parameters) const final {
    return detail::one(costFunction(time, state, input, parameters));
  }
};

// f = 1/2 |y|^2 with J^T J instead of the Hessian; J^T J is positive semi-definite.
class StateInputCostGaussNewtonAd : public detail::RecordedCost<StateInputCost, vector_t> {
 protected:
  virtual ad_vector_t costVectorFunction(ad_scalar_t time, const ad_vector_t& state, const ad_vector_t& input,
                                         const ad_vector_t& parameters) const = 0;

 private:
  const char* kind() const final { return "StateInputCostGaussNewtonAd"; }
  bool is_gauss_newton() const final { return true; }
  ad_vector_t values(ad_scalar_t time, const ad_vector_t& state, const ad_vector_t& input,
                     const ad_vector_t& parameters) const final {
    return costVectorFunction(time, state, input, parameters);
  }
};

}  // namespace dyntape::ocs2
