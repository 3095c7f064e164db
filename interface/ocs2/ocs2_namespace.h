// SPDX-License-Identifier: BSD-3-Clause
//
// The names of ocs2.h in namespace ocs2.  Use it for code that is written inside this namespace:
//
//   #include <dyntape/interface/ocs2/ocs2_namespace.h>
//   namespace ocs2 {
//   class MyCost : public StateCostCppAd { ... };
//   }
//
// Do not include OCS2's own headers in the same program: they define the same names.
#pragma once

#include <dyntape/interface/ocs2/ocs2.h>

namespace ocs2 {
using namespace dyntape::ocs2;
}  // namespace ocs2
