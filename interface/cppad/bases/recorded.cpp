// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/bases/recorded.hxx>
#include <dyntape/interface/cppad/detail/fun.hxx>
#include <dyntape/interface/cppad/nodes/detail/atomic.hxx>

#define DYNTAPE_CPPAD_BASES(of, ...) of(AD<double>, __VA_ARGS__) of(AD<AD<double>>, __VA_ARGS__)
#define DYNTAPE_CPPAD_TEMPLATE template
#include <dyntape/interface/cppad/bases/instantiate.hxx>

namespace CppAD::inline dyntape_names::detail {

template class AtomicFunction<AD<double>>;
template std::shared_ptr<Fun<AD<double>>> on_recorded(const Fun<double>&);
template std::shared_ptr<Fun<AD<AD<double>>>> on_recorded(const Fun<AD<double>>&);
template std::shared_ptr<const Recording<double>> recording_of_numbers(const Recording<AD<double>>&,
                                                                       const char*);
template std::shared_ptr<const Recording<double>> recording_of_numbers(const Recording<AD<AD<double>>>&,
                                                                       const char*);
template std::vector<AD<AD<double>>> atomic_by_name(const std::string&, std::size_t,
                                                    const std::vector<AD<AD<double>>>&, std::size_t);

}  // namespace CppAD::inline dyntape_names::detail
