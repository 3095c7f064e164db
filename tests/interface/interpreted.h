// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/codegen/options/options.h>

namespace dyntape::test {

// Nothing is compiled, nothing is left in the user's cache.
inline const CodegenOptions kInterpreted{.route = Route::kInterpreter};

}  // namespace dyntape::test
