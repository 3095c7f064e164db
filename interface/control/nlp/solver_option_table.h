// SPDX-License-Identifier: BSD-3-Clause
//
// The options of SolverOptions that task files and Python set.  Each is here once: its name, range or words, and meaning;
// its default is the member's (solver_options.h).  A reader is a visitor:
//
//   struct FromFile {
//     void number(const char* name, double& value, const io::Range& range, const char* meaning);   // and int&
//     void flag(const char* name, bool& value, const char* meaning);
//     template <class E> void choice(const char* name, E& value, const io::Choice<E>& words, const char* meaning);
//   };
//   FromFile reader;
//   visit_options(options, reader);        // the value is the default before, and what the user chose after
#pragma once

#include <dyntape/interface/control/nlp/solver_options.h>
#include <dyntape/interface/io/choice.h>
#include <dyntape/interface/io/range.h>

namespace dyntape {

inline io::Choice<NlpMethod> nlp_methods() {
  return {
      {"automatic", NlpMethod::kAutomatic}, {"riccati", NlpMethod::kRiccati}, {"ipopt", NlpMethod::kIpopt}};
}
inline constexpr const char* kNlpMethodsMeaning =
    "riccati: dyntape's interior-point method, stage by stage; ipopt: Ipopt; automatic: riccati, and ipopt "
    "with a "
    "limited_memory Hessian, options of Ipopt or a print_level.  Where riccati or ipopt gets stuck, the "
    "other one tries";

inline io::Choice<HessianKind> hessian_kinds() {
  return {{"exact", HessianKind::kExact},
          {"gauss_newton", HessianKind::kGaussNewton},
          {"limited_memory", HessianKind::kLimitedMemory}};
}

template <class Visitor>
void visit_options(SolverOptions& o, Visitor& v) {
  v.number("tolerance", o.tolerance, io::positive(), "tolerance of the scaled optimality error");
  v.number("dual_tolerance", o.dual_tolerance, io::positive(), "tolerance of the unscaled stationarity");
  v.number("bound_relaxation", o.bound_relaxation, io::not_negative(),
           "widening of the bounds, in units in which nominal values are 1; times 10 at most for larger "
           "bounds; 0: exact bounds");
  v.number("max_iterations", o.max_iterations, io::not_negative(), "largest number of iterations");
  v.number("max_seconds", o.max_seconds, io::positive(), "largest processor time of all threads [s]");
  v.flag("stop_at_acceptable", o.stop_at_acceptable,
         "stop early if the solver stalls at an acceptable point");
  v.choice("barrier_update", o.barrier_update,
           io::Choice<BarrierUpdate>{{"adaptive", BarrierUpdate::kAdaptive},
                                     {"monotone", BarrierUpdate::kMonotone}},
           "of riccati: adaptive: chosen at each step; monotone: decreased when a barrier problem is "
           "solved; the default for rigid contacts is monotone");
  v.number("print_level", o.print_level, io::between(0, 12),
           "verbosity of Ipopt; above 0 the method automatic takes Ipopt");
}

}  // namespace dyntape
