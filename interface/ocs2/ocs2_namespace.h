// SPDX-License-Identifier: BSD-3-Clause
//
// The names of ocs2.h in a namespace called ocs2, for code that is written into it:
//
//   #include <dyntape/interface/ocs2/ocs2_namespace.h>
//   namespace ocs2 {
//   class MyCost : public StateCostCppAd { ... };
//   }
//
// Not together with OCS2's own headers, which have these names too.
#pragma once

#include <dyntape/interface/ocs2/ocs2.h>

namespace ocs2 {
using namespace dyntape::ocs2;
}  // namespace ocs2
