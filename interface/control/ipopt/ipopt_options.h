// SPDX-License-Identifier: BSD-3-Clause
//
// What Ipopt is asked for, and how that gets into an application of Ipopt.
//
// An option by Ipopt's name must be registered, of its type and within its range, and of no kind that names
// files, prints, or needs what solve_with_ipopt does not have; ArgumentError otherwise.
#pragma once

#include <string>

#include <dyntape/interface/control/nlp/solver_options.h>

namespace Ipopt {
class IpoptApplication;
}

namespace dyntape {

// ArgumentError unless Ipopt takes this option, with this value.
void check_ipopt_option(const std::string& name, const std::string& value);

namespace detail {
// `barrier`: with which it goes on from multipliers of an earlier solve; 0: it begins anew.
void configure(Ipopt::IpoptApplication& application, const SolverOptions& options, double barrier);
}  // namespace detail

}  // namespace dyntape
