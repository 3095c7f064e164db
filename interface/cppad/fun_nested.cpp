// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/detail/fun.hxx>

namespace dyntape::cppad::detail {

template class Fun<AD<double>>;
template class Fun<AD<AD<double>>>;

}  // namespace dyntape::cppad::detail
