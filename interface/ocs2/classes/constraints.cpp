// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/ocs2/classes/constraints.h>

#include <dyntape/autodiff/error.h>

namespace dyntape::ocs2 {
namespace {

using ApproximationOrder = CppAdInterface::ApproximationOrder;

ApproximationOrder needed(ConstraintOrder order) {
  return order == ConstraintOrder::Linear ? ApproximationOrder::First : ApproximationOrder::Second;
}

void check_quadratic(const char* name, ConstraintOrder order) {
  if (order == ConstraintOrder::Quadratic) return;
  throw ArgumentError(std::string(name) +
                      ": a constraint of order Linear has no quadratic approximation; construct it with "
                      "ConstraintOrder::Quadratic");
}

[[noreturn]] void refuse(const char* what) {
  throw ArgumentError(std::string("this constraint does not implement ") + what);
}

}  // namespace

namespace detail {

VectorFunctionLinearApproximation linear(const TermModel& term, const char* name, const vector_t& p,
                                         scalar_t time, const vector_t& state, const vector_t& input) {
  const vector_t x = term.variables(name, time, state, input);
  const CppAdInterface& model = term.of(name);
  VectorFunctionLinearApproximation a;
  a.f = model.getFunctionValue(x, p);
  const matrix_t jacobian = model.getJacobian(x, p);
  a.dfdx = jacobian.middleCols(1, state.size());
  if (input.size() > 0) a.dfdu = jacobian.rightCols(input.size());
  return a;
}

VectorFunctionQuadraticApproximation quadratic_rows(const TermModel& term, const char* name,
                                                    const vector_t& p, scalar_t time, const vector_t& state,
                                                    const vector_t& input) {
  const VectorFunctionLinearApproximation first = linear(term, name, p, time, state, input);
  const vector_t x = term.variables(name, time, state, input);
  VectorFunctionQuadraticApproximation a;
  a.f = first.f, a.dfdx = first.dfdx, a.dfdu = first.dfdu;
  for (Eigen::Index i = 0; i < a.f.size(); ++i) {
    const matrix_t hessian = term.of(name).getHessian(static_cast<std::size_t>(i), x, p);
    const auto row = scalar_blocks(term.sizes(), 0, vector_t::Zero(x.size()), hessian);
    a.dfdxx.push_back(row.dfdxx);
    if (input.size() == 0) continue;
    a.dfdux.push_back(row.dfdux);
    a.dfduu.push_back(row.dfduu);
  }
  return a;
}

template <class Self, class... Input>
VectorFunctionLinearApproximation Constraint<Self, Input...>::getLinearApproximation(
    scalar_t, const vector_t&, const Input&..., const PreComputation&) const {
  refuse("getLinearApproximation");
}
template <class Self, class... Input>
VectorFunctionQuadraticApproximation Constraint<Self, Input...>::getQuadraticApproximation(
    scalar_t, const vector_t&, const Input&..., const PreComputation&) const {
  refuse("getQuadraticApproximation");
}

template <class Base, class... Input>
void RecordedConstraint<Base, Input...>::initialize(std::size_t stateDim,
                                                    InPlaceOf<Input, std::size_t>... inputDim,
                                                    std::size_t parameterDim, const std::string& modelName,
                                                    const std::string& modelFolder, bool recompileLibraries,
                                                    bool verbose, const char* file, int line) {
  const auto recorded = [this](ad_scalar_t t, const ad_vector_t& x, const ad_vector_t& u,
                               const ad_vector_t& p) {
    if constexpr (sizeof...(Input) == 0) {
      return constraintFunction(t, x, p);
    } else {
      return constraintFunction(t, x, u, p);
    }
  };
  model_.make(recorded, {stateDim, (std::size_t(0) + ... + inputDim), parameterDim}, modelName, modelFolder,
              needed(this->getOrder()), recompileLibraries, verbose, {file, line});
}

template <class Base, class... Input>
vector_t RecordedConstraint<Base, Input...>::getValue(scalar_t time, const vector_t& state,
                                                      const Input&... input,
                                                      const PreComputation& preComp) const {
  const vector_t x = model_.variables(kind(), time, state, input...);
  return model_.of(kind()).getFunctionValue(x, getParameters(time, preComp));
}

template <class Base, class... Input>
VectorFunctionLinearApproximation RecordedConstraint<Base, Input...>::getLinearApproximation(
    scalar_t time, const vector_t& state, const Input&... input, const PreComputation& preComp) const {
  return linear(model_, kind(), getParameters(time, preComp), time, state, input...);
}

template <class Base, class... Input>
VectorFunctionQuadraticApproximation RecordedConstraint<Base, Input...>::getQuadraticApproximation(
    scalar_t time, const vector_t& state, const Input&... input, const PreComputation& preComp) const {
  check_quadratic(kind(), this->getOrder());
  return quadratic_rows(model_, kind(), getParameters(time, preComp), time, state, input...);
}

template class Constraint<StateConstraint>;
template class Constraint<StateInputConstraint, vector_t>;
template class RecordedConstraint<StateConstraint>;
template class RecordedConstraint<StateInputConstraint, vector_t>;

}  // namespace detail
}  // namespace dyntape::ocs2
