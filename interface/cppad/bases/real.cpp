// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/bases/recorded.hxx>
#include <dyntape/interface/cppad/detail/fun.hxx>
#include <dyntape/interface/cppad/nodes/detail/atomic.hxx>

#define DYNTAPE_CPPAD_BASES(of, ...) \
  of(float, __VA_ARGS__) of(double, __VA_ARGS__) of(long double, __VA_ARGS__)
#define DYNTAPE_CPPAD_TEMPLATE template
#include <dyntape/interface/cppad/bases/instantiate.hxx>

namespace CppAD::inline dyntape_names::detail {

template class AtomicFunction<float>;
template class AtomicFunction<double>;
template class AtomicFunction<long double>;
template std::shared_ptr<const Recording<double>> recording_of_numbers(const Recording<float>&, const char*);
template std::shared_ptr<const Recording<double>> recording_of_numbers(const Recording<double>&, const char*);
template std::vector<AD<float>> atomic_by_name(const std::string&, std::size_t, const std::vector<AD<float>>&,
                                               std::size_t);
template std::vector<AD<double>> atomic_by_name(const std::string&, std::size_t,
                                                const std::vector<AD<double>>&, std::size_t);

}  // namespace CppAD::inline dyntape_names::detail
