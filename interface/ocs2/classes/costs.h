// SPDX-License-Identifier: BSD-3-Clause
//
// Costs of a client's own, derived for it: OCS2's StateCostCppAd, StateInputCostCppAd and StateInputCostGaussNewtonAd.
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
// Variables are time and state, or time, state and input; derivatives by time are not returned.  state (nx), input (nu): shapes of
// results are those of approximation.h.  modelFolder: root of the cache, empty for the user's.  recompileLibraries: as OCS2 has it,
// createModels or loadModelsIfAvailable; here neither can load what is stale.  Errors of a recording name the line of initialize.
//
// Errors: ArgumentError for sizes, and for a class that did not call initialize; those of CppAdInterface.
#pragma once

#include <memory>
#include <string>

#include <dyntape/interface/ocs2/classes/linear_interpolation.h>
#include <dyntape/interface/ocs2/classes/pre_computation.h>
#include <dyntape/interface/ocs2/cpp_ad_interface.h>

namespace dyntape::ocs2 {

class StateCost {
 public:
  StateCost() = default;
  virtual ~StateCost() = default;
  virtual StateCost* clone() const = 0;
  virtual bool isActive(scalar_t /*time*/) const { return true; }
  virtual scalar_t getValue(scalar_t time, const vector_t& state,
                            const TargetTrajectories& targetTrajectories,
                            const PreComputation& preComp) const = 0;
  virtual ScalarFunctionQuadraticApproximation getQuadraticApproximation(
      scalar_t time, const vector_t& state, const TargetTrajectories& targetTrajectories,
      const PreComputation& preComp) const = 0;

 protected:
  StateCost(const StateCost&) = default;
};

class StateInputCost {
 public:
  StateInputCost() = default;
  virtual ~StateInputCost() = default;
  virtual StateInputCost* clone() const = 0;
  virtual bool isActive(scalar_t /*time*/) const { return true; }
  virtual scalar_t getValue(scalar_t time, const vector_t& state, const vector_t& input,
                            const TargetTrajectories& targetTrajectories,
                            const PreComputation& preComp) const = 0;
  virtual ScalarFunctionQuadraticApproximation getQuadraticApproximation(
      scalar_t time, const vector_t& state, const vector_t& input,
      const TargetTrajectories& targetTrajectories, const PreComputation& preComp) const = 0;

 protected:
  StateInputCost(const StateInputCost&) = default;
};

namespace detail {

// A model of (time, state, input) that a class makes in initialize(); copies share it.
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
  // ArgumentError, naming the class, where there is none.
  const CppAdInterface& of(const char* name) const;
  // (time, state, input), sizes checked.
  vector_t variables(const char* name, scalar_t time, const vector_t& state,
                     const vector_t& input = {}) const;
  const Sizes& sizes() const { return sizes_; }

 private:
  Sizes sizes_;
  std::shared_ptr<const CppAdInterface> model_;
};

// Blocks of derivatives by (time, state, input), that of time left out; without inputs those blocks are empty.
ScalarFunctionQuadraticApproximation scalar_blocks(const TermModel::Sizes& sizes, scalar_t value,
                                                   const vector_t& gradient, const matrix_t& hessian);

}  // namespace detail

class StateCostCppAd : public StateCost {
 public:
  StateCostCppAd() = default;
  void initialize(std::size_t stateDim, std::size_t parameterDim, const std::string& modelName,
                  const std::string& modelFolder = "", bool recompileLibraries = true, bool verbose = true,
                  const char* file = __builtin_FILE(), int line = __builtin_LINE());
  // (parameterDim) of costFunction.
  virtual vector_t getParameters(scalar_t /*time*/, const TargetTrajectories&, const PreComputation&) const {
    return vector_t(0);
  }
  scalar_t getValue(scalar_t time, const vector_t& state, const TargetTrajectories& targetTrajectories,
                    const PreComputation& preComp) const override;
  ScalarFunctionQuadraticApproximation getQuadraticApproximation(
      scalar_t time, const vector_t& state, const TargetTrajectories& targetTrajectories,
      const PreComputation& preComp) const override;

 protected:
  StateCostCppAd(const StateCostCppAd&) = default;
  virtual ad_scalar_t costFunction(ad_scalar_t time, const ad_vector_t& state,
                                   const ad_vector_t& parameters) const = 0;

 private:
  detail::TermModel model_;
};

class StateInputCostCppAd : public StateInputCost {
 public:
  StateInputCostCppAd() = default;
  void initialize(std::size_t stateDim, std::size_t inputDim, std::size_t parameterDim,
                  const std::string& modelName, const std::string& modelFolder = "",
                  bool recompileLibraries = true, bool verbose = true, const char* file = __builtin_FILE(),
                  int line = __builtin_LINE());
  virtual vector_t getParameters(scalar_t /*time*/, const TargetTrajectories&, const PreComputation&) const {
    return vector_t(0);
  }
  scalar_t getValue(scalar_t time, const vector_t& state, const vector_t& input,
                    const TargetTrajectories& targetTrajectories,
                    const PreComputation& preComp) const override;
  ScalarFunctionQuadraticApproximation getQuadraticApproximation(
      scalar_t time, const vector_t& state, const vector_t& input,
      const TargetTrajectories& targetTrajectories, const PreComputation& preComp) const override;

 protected:
  StateInputCostCppAd(const StateInputCostCppAd&) = default;
  virtual ad_scalar_t costFunction(ad_scalar_t time, const ad_vector_t& state, const ad_vector_t& input,
                                   const ad_vector_t& parameters) const = 0;

 private:
  detail::TermModel model_;
};

// f = 1/2 |y|^2, and J^T J in the place of its Hessian, which is positive semi-definite.
class StateInputCostGaussNewtonAd : public StateInputCost {
 public:
  StateInputCostGaussNewtonAd() = default;
  void initialize(std::size_t stateDim, std::size_t inputDim, std::size_t parameterDim,
                  const std::string& modelName, const std::string& modelFolder = "",
                  bool recompileLibraries = true, bool verbose = true, const char* file = __builtin_FILE(),
                  int line = __builtin_LINE());
  virtual vector_t getParameters(scalar_t /*time*/, const TargetTrajectories&, const PreComputation&) const {
    return vector_t(0);
  }
  scalar_t getValue(scalar_t time, const vector_t& state, const vector_t& input,
                    const TargetTrajectories& targetTrajectories,
                    const PreComputation& preComp) const override;
  ScalarFunctionQuadraticApproximation getQuadraticApproximation(
      scalar_t time, const vector_t& state, const vector_t& input,
      const TargetTrajectories& targetTrajectories, const PreComputation& preComp) const override;

 protected:
  StateInputCostGaussNewtonAd(const StateInputCostGaussNewtonAd&) = default;
  virtual ad_vector_t costVectorFunction(ad_scalar_t time, const ad_vector_t& state, const ad_vector_t& input,
                                         const ad_vector_t& parameters) const = 0;

 private:
  detail::TermModel model_;
};

}  // namespace dyntape::ocs2
