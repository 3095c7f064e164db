// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/detail/fun.hxx>

namespace CppAD::inline dyntape_names::detail {

template class Fun<AD<double>>;
template class Fun<AD<AD<double>>>;

}  // namespace CppAD::inline dyntape_names::detail
