// SPDX-License-Identifier: BSD-3-Clause
//
// Instantiates recording, functions and atomic functions over bases.  Before the include:
//
//   #define DYNTAPE_CPPAD_BASES(of, ...) of(float, __VA_ARGS__) of(double, __VA_ARGS__)
//   #define DYNTAPE_CPPAD_TEMPLATE template             // extern template: they are in the library
#define DYNTAPE_CPPAD_OF_BASE(Base, ...)                                                                     \
  DYNTAPE_CPPAD_TEMPLATE struct Tape<Base>;                                                                  \
  DYNTAPE_CPPAD_TEMPLATE class Fun<Base>;                                                                    \
  DYNTAPE_CPPAD_TEMPLATE AD<Base> apply(Row, const AD<Base>&, const AD<Base>&, const AD<Base>&);             \
  DYNTAPE_CPPAD_TEMPLATE bool compare(Row, const AD<Base>&, const AD<Base>&, const char*, int);              \
  DYNTAPE_CPPAD_TEMPLATE void record_guard(Row, const AD<Base>&, const AD<Base>&);                           \
  DYNTAPE_CPPAD_TEMPLATE Kind kind_of(const AD<Base>&);                                                      \
  DYNTAPE_CPPAD_TEMPLATE const Base& value_to_keep(const AD<Base>&);                                         \
  DYNTAPE_CPPAD_TEMPLATE bool is_recording<Base>();                                                          \
  DYNTAPE_CPPAD_TEMPLATE void begin_recording(AD<Base>*, std::size_t, AD<Base>*, std::size_t, const Begin&); \
  DYNTAPE_CPPAD_TEMPLATE std::uint32_t open_recording<Base>();                                               \
  DYNTAPE_CPPAD_TEMPLATE std::shared_ptr<const Recording<Base>> recorded_so_far(const AD<Base>*,             \
                                                                                std::size_t);                \
  DYNTAPE_CPPAD_TEMPLATE void record_print(const AD<Base>&, const std::string&, const AD<Base>&,             \
                                           const std::string&);                                              \
  DYNTAPE_CPPAD_TEMPLATE std::vector<AD<Base>> record_call(                                                  \
      const std::shared_ptr<const Callee>&, const std::shared_ptr<const KernelInSeries>&,                    \
      const std::vector<AD<Base>>&, const std::vector<Base>&);                                               \
  DYNTAPE_CPPAD_TEMPLATE std::shared_ptr<const Recording<Base>> end_recording(const AD<Base>*, std::size_t,  \
                                                                              const AD<Base>*, std::size_t);
#define DYNTAPE_CPPAD_APPLY_1(Base, name) DYNTAPE_CPPAD_TEMPLATE AD<Base> apply<Row::name>(AD<Base>);
#define DYNTAPE_CPPAD_APPLY_2(Base, name) \
  DYNTAPE_CPPAD_TEMPLATE AD<Base> apply<Row::name>(AD<Base>, AD<Base>);
#define DYNTAPE_CPPAD_APPLY_3(Base, name) \
  DYNTAPE_CPPAD_TEMPLATE AD<Base> apply<Row::name>(AD<Base>, AD<Base>, AD<Base>);
#define DYNTAPE_CPPAD_ABORT(Base, ...) DYNTAPE_CPPAD_TEMPLATE void AD<Base>::abort_recording();

namespace CppAD::inline dyntape_names::detail {
DYNTAPE_CPPAD_BASES(DYNTAPE_CPPAD_OF_BASE, )
#define OP(name, fn, n, ...) DYNTAPE_CPPAD_BASES(DYNTAPE_CPPAD_APPLY_##n, name)
#include <dyntape/autodiff/graph/ops.def>
}  // namespace CppAD::inline dyntape_names::detail

namespace CppAD::inline dyntape_names {
DYNTAPE_CPPAD_BASES(DYNTAPE_CPPAD_ABORT, )
}  // namespace CppAD::inline dyntape_names

#undef DYNTAPE_CPPAD_OF_BASE
#undef DYNTAPE_CPPAD_APPLY_1
#undef DYNTAPE_CPPAD_APPLY_2
#undef DYNTAPE_CPPAD_APPLY_3
#undef DYNTAPE_CPPAD_ABORT
#undef DYNTAPE_CPPAD_BASES
#undef DYNTAPE_CPPAD_TEMPLATE
