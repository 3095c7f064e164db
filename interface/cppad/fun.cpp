// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/detail/fun.hxx>

namespace dyntape::cppad::detail {

template class Fun<float>;
template class Fun<double>;

}  // namespace dyntape::cppad::detail
