// SPDX-License-Identifier: BSD-3-Clause
//
// IpoptOptions into an application of Ipopt.  Internal.
//
// An option by Ipopt's name must be registered, of its type and within its range, and of no kind that names
// files, prints, or needs what solve_with_ipopt does not have; ArgumentError otherwise.
#pragma once

#include <dyntape/interface/solvers/ipopt.h>

namespace Ipopt {
class IpoptApplication;
}

namespace dyntape::detail {

void configure(Ipopt::IpoptApplication& application, const IpoptOptions& options);

}  // namespace dyntape::detail
