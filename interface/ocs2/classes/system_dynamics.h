// SPDX-License-Identifier: BSD-3-Clause
//
// OCS2's SystemDynamicsBaseAD: a client derives the dynamics of a system, dyntape differentiates them.
//
//   class Pendulum : public ocs2::SystemDynamicsBaseAD {
//    public:
//     Pendulum() { initialize(2, 1, "pendulum"); }
//     Pendulum* clone() const override { return new Pendulum(*this); }
//
//    protected:
//     ocs2::ad_vector_t systemFlowMap(ocs2::ad_scalar_t, const ocs2::ad_vector_t& x, const ocs2::ad_vector_t& u,
//                                     const ocs2::ad_vector_t&) const override { ... }
//   };
//
//   Pendulum pendulum;
//   auto dxdt = pendulum.linearApproximation(0, x, u, {});         // f (nx), dfdx (nx x nx), dfdu (nx x nu)
//
// Each of these is a library of first order; the last two are made at their first use:
//   flow map
//   jump map         default: the state does not change
//   guard surfaces   default: one surface, -1 everywhere
// flowMapDerivativeTime() and similar calls evaluate the derivative at their own arguments, not at an earlier point.
//
// ArgumentError: sizes, initialize() was not called.  Other errors: those of CppAdInterface.
#pragma once

#include <dyntape/interface/ocs2/classes/costs.h>

namespace dyntape::ocs2 {

// A call without a PreComputation uses the object's own.
class SystemDynamicsBase {
 public:
  explicit SystemDynamicsBase(const PreComputation& preComputation = PreComputation())
      : preComputation_(preComputation.clone()) {}
  virtual ~SystemDynamicsBase() = default;
  virtual SystemDynamicsBase* clone() const = 0;

  vector_t computeFlowMap(scalar_t time, const vector_t& state, const vector_t& input);
  vector_t computeJumpMap(scalar_t time, const vector_t& state);
  VectorFunctionLinearApproximation linearApproximation(scalar_t time, const vector_t& state,
                                                        const vector_t& input);
  VectorFunctionLinearApproximation jumpMapLinearApproximation(scalar_t time, const vector_t& state);

  virtual vector_t computeFlowMap(scalar_t time, const vector_t& state, const vector_t& input,
                                  const PreComputation& preComp) = 0;
  virtual VectorFunctionLinearApproximation linearApproximation(scalar_t time, const vector_t& state,
                                                                const vector_t& input,
                                                                const PreComputation& preComp) = 0;
  // Defaults: the state does not change, and there is one surface that is never reached.
  virtual vector_t computeJumpMap(scalar_t time, const vector_t& state, const PreComputation& preComp);
  virtual vector_t computeGuardSurfaces(scalar_t time, const vector_t& state);
  virtual VectorFunctionLinearApproximation jumpMapLinearApproximation(scalar_t time, const vector_t& state,
                                                                       const PreComputation& preComp);
  virtual VectorFunctionLinearApproximation guardSurfacesLinearApproximation(scalar_t time,
                                                                             const vector_t& state,
                                                                             const vector_t& input);
  virtual vector_t flowMapDerivativeTime(scalar_t time, const vector_t& state, const vector_t& input);
  virtual vector_t jumpMapDerivativeTime(scalar_t time, const vector_t& state, const vector_t& input);
  virtual vector_t guardSurfacesDerivativeTime(scalar_t time, const vector_t& state, const vector_t& input);

 protected:
  SystemDynamicsBase(const SystemDynamicsBase& other) : preComputation_(other.preComputation_->clone()) {}
  PreComputation& preComputation() { return *preComputation_; }

 private:
  std::unique_ptr<PreComputation> preComputation_;
};

class SystemDynamicsBaseAD : public SystemDynamicsBase {
 public:
  using SystemDynamicsBase::computeFlowMap;
  using SystemDynamicsBase::computeJumpMap;
  using SystemDynamicsBase::jumpMapLinearApproximation;
  using SystemDynamicsBase::linearApproximation;
  using SystemDynamicsBase::SystemDynamicsBase;

  void initialize(std::size_t stateDim, std::size_t inputDim, const std::string& modelName,
                  const std::string& modelFolder = "", bool recompileLibraries = true, bool verbose = true,
                  const char* file = __builtin_FILE(), int line = __builtin_LINE());

  vector_t computeFlowMap(scalar_t time, const vector_t& state, const vector_t& input,
                          const PreComputation& preComp) override;
  vector_t computeJumpMap(scalar_t time, const vector_t& state, const PreComputation& preComp) override;
  vector_t computeGuardSurfaces(scalar_t time, const vector_t& state) override;

  VectorFunctionLinearApproximation linearApproximation(scalar_t time, const vector_t& state,
                                                        const vector_t& input,
                                                        const PreComputation& preComp) override;
  VectorFunctionLinearApproximation jumpMapLinearApproximation(scalar_t time, const vector_t& state,
                                                               const PreComputation& preComp) override;
  VectorFunctionLinearApproximation guardSurfacesLinearApproximation(scalar_t time, const vector_t& state,
                                                                     const vector_t& input) override;

  vector_t flowMapDerivativeTime(scalar_t time, const vector_t& state, const vector_t& input) override;
  vector_t jumpMapDerivativeTime(scalar_t time, const vector_t& state, const vector_t& input) override;
  vector_t guardSurfacesDerivativeTime(scalar_t time, const vector_t& state, const vector_t& input) override;

 protected:
  SystemDynamicsBaseAD(const SystemDynamicsBaseAD&) = default;

  virtual ad_vector_t systemFlowMap(ad_scalar_t time, const ad_vector_t& state, const ad_vector_t& input,
                                    const ad_vector_t& parameters) const = 0;
  virtual ad_vector_t systemJumpMap(ad_scalar_t /*time*/, const ad_vector_t& state,
                                    const ad_vector_t& /*parameters*/) const {
    return state;
  }
  virtual ad_vector_t systemGuardSurfaces(ad_scalar_t /*time*/, const ad_vector_t& /*state*/,
                                          const ad_vector_t& /*parameters*/) const {
    return ad_vector_t::Constant(1, ad_scalar_t(-1));
  }
  virtual vector_t getFlowMapParameters(scalar_t /*time*/, const PreComputation&) const {
    return vector_t(0);
  }
  virtual std::size_t getNumFlowMapParameters() const { return 0; }
  virtual vector_t getJumpMapParameters(scalar_t /*time*/, const PreComputation&) const {
    return vector_t(0);
  }
  virtual std::size_t getNumJumpMapParameters() const { return 0; }
  virtual vector_t getGuardSurfacesParameters(scalar_t /*time*/) const { return vector_t(0); }
  virtual std::size_t getNumGuardSurfacesParameters() const { return 0; }

 private:
  const detail::TermModel& jump_map();
  const detail::TermModel& guard_surfaces();

  struct How {
    std::string name, folder;
    bool recompile = true, verbose = true;
    detail::TermModel::Place place{};
  };
  How how_;
  detail::TermModel flow_map_, jump_map_, guard_surfaces_;
};

}  // namespace dyntape::ocs2
