// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/expr.h>

namespace dyntape {

thread_local Graph* GraphScope::current_ = nullptr;

}  // namespace dyntape
