// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/bases/recorded.hxx>
#include <dyntape/interface/cppad/detail/fun.hxx>
#include <dyntape/interface/cppad/nodes/detail/atomic.hxx>

#define DYNTAPE_CPPAD_BASES(of, ...) \
  of(std::complex<float>, __VA_ARGS__) of(std::complex<double>, __VA_ARGS__)
#define DYNTAPE_CPPAD_TEMPLATE template
#include <dyntape/interface/cppad/bases/instantiate.hxx>

namespace CppAD::inline dyntape_names::detail {

template class AtomicFunction<std::complex<float>>;
template class AtomicFunction<std::complex<double>>;

}  // namespace CppAD::inline dyntape_names::detail
