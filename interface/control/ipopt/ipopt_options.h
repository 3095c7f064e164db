// SPDX-License-Identifier: BSD-3-Clause
//
// Options for Ipopt, and their transfer to an Ipopt application.
//
// An option by Ipopt's name must be registered, of the right type and in its range.  It must not name files, print,
// or need functions that solve_with_ipopt does not have.  Otherwise ArgumentError.
#pragma once

#include <string>

#include <dyntape/interface/control/nlp/solver_options.h>

namespace Ipopt {
class IpoptApplication;
}

namespace dyntape {

// Throws ArgumentError unless Ipopt accepts this option with this value.
void check_ipopt_option(const std::string& name, const std::string& value);

namespace detail {
// `barrier`: the barrier parameter for a warm start with multipliers; 0: a cold start.  `push`: how far a start with
// options.first_barrier is moved inside the bounds.
void configure(Ipopt::IpoptApplication& application, const SolverOptions& options, double barrier,
               double push);
}  // namespace detail

}  // namespace dyntape
