// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/print/print_lanes.h>

#include <algorithm>
#include <array>
#include <set>

#include <dyntape/codegen/options/flags.h>
#include <dyntape/codegen/print/own_trig.h>
#include <dyntape/codegen/schedule/gather.h>

namespace dyntape::codegen {
namespace {

constexpr char kOneTypes[] =
    R"(/* A real is a double, or with -DDYNTAPE_LANES=8 (4, 2) a vector with a double of each of eight states: the
 * statements are the same.  Reals lie in memory at any address. */
#ifndef DYNTAPE_LANES
#define DYNTAPE_LANES 1
#endif
#if DYNTAPE_LANES == 1
typedef double real, reals;
typedef int64_t dt_words;
#define DT_NAME(name) name
#define DT_ALL(constant) (constant)
#define DT_LEAVE(a) (void)(a)
)";

constexpr char kOneSelect[] = "#define dt_select(condition, a, b) ((condition) ? (a) : (b))\n";

// Of several violated guards the first is reported, in whatever order they are met.
constexpr char kOneCheck[] =
    "#define DT_CHECK(violated, k) if ((violated) && (*guard == 0 || *guard > (k))) *guard = (k)\n";

constexpr char kOneKernel[] =
    R"(#define DT_KERNEL(name, n_in, n_out) \
  static void name##_of_one(const double* DT_RESTRICT in, double* DT_RESTRICT out); \
  DT_PIECE void name(const double* DT_RESTRICT in, double* DT_RESTRICT out, double* DT_RESTRICT work) { \
    (void)work; \
    name##_of_one(in, out); \
  } \
  static void name##_of_one(const double* DT_RESTRICT in, double* DT_RESTRICT out)
)";

constexpr char kLaneTypes[] = R"(#else
typedef double real __attribute__((vector_size(8 * DYNTAPE_LANES)));
typedef real reals __attribute__((aligned(8)));
typedef int64_t dt_words __attribute__((vector_size(8 * DYNTAPE_LANES)));
#define DT_INLINE static __inline__ __attribute__((unused, always_inline))
#define DT_PASTE(a, b, c) a##b##c
#define DT_JOIN(a, b, c) DT_PASTE(a, b, c)
#define DT_NAME(name) DT_JOIN(name, _x, DYNTAPE_LANES)
DT_INLINE real dt_zero(void) {
  const real zero = {0};
  return zero;
}
#define DT_ALL(constant) ((constant) - dt_zero())
#define DT_LEAVE(a) DT_CLEAR(a)
)";

// What is in the upper halves of registers makes every instruction of a function that was compiled for SSE wait for them, some of
// libm's and the caller's among them; compilers clear them at -O2, and not at -O1.
constexpr char kLeave[] = R"(#if defined(__x86_64__) && defined(__AVX__)
#define DT_CLEAR(a) \
  __asm__ volatile("vzeroupper" : "+m"(a) : : "xmm0", "xmm1", "xmm2", "xmm3", "xmm4", "xmm5", "xmm6", "xmm7", \
                   "xmm8", "xmm9", "xmm10", "xmm11", "xmm12", "xmm13", "xmm14", "xmm15")
#else
#define DT_CLEAR(a) (void)(a)
#endif
)";

// Of a constant zero and b gcc makes b ^ (mask & b), and with AVX-512 may compute b twice for that, the operands of a
// product in another order: of two NaN another one comes out each time, and a small number of both.
constexpr char kLaneSelect[] =
    R"(#define dt_select(condition, a, b) \
  dt_blend((dt_words)(condition), DT_ALL(a), DT_ALL(b), sizeof(a) < sizeof(b))
DT_INLINE real dt_blend(dt_words mask, real a, real b, int a_is_constant) {
#if defined(__AVX512F__)
  if (a_is_constant) __asm__("" : "+v"(b)); /* computed once */
#endif
  (void)a_is_constant;
  return (real)((mask & (dt_words)a) | (~mask & (dt_words)b));
}
)";

constexpr char kLaneCheck[] = R"(#define DT_CHECK(violated, k) dt_check((dt_words)(violated), k, guard)
DT_INLINE void dt_check(dt_words violated, int64_t k, dt_words* guard) {
  const dt_words is_first = violated & (dt_words)((*guard == 0) | (*guard > k));
  *guard = (is_first & k) | (~is_first & *guard);
}
)";

// The compiler puts a negated argument into the instruction, and one that lies in memory.
constexpr char kLaneFma[] = R"(DT_INLINE real dt_fma(real x, real y, real z) {
#if defined(__AVX512F__) && DYNTAPE_LANES == 8
  return __builtin_ia32_vfmaddpd512_mask(x, y, z, (unsigned char)-1, 4);
#elif defined(__FMA__) && DYNTAPE_LANES == 4
  return __builtin_ia32_vfmaddpd256(x, y, z);
#elif defined(__FMA__) && DYNTAPE_LANES == 2
  return __builtin_ia32_vfmaddpd(x, y, z);
#elif defined(__aarch64__) && DYNTAPE_LANES == 2
  __asm__("fmla %0.2d, %1.2d, %2.2d" : "+w"(z) : "w"(x), "w"(y));
  return z;
#else
  int lane;
  for (lane = 0; lane < DYNTAPE_LANES; ++lane) x[lane] = fma(x[lane], y[lane], z[lane]);
  return x;
#endif
}
)";

constexpr char kLaneKernel[] = R"(#define DT_KERNEL(name, n_in, n_out) \
  static void name##_of_one(const double* DT_RESTRICT in, double* DT_RESTRICT out); \
  DT_PIECE void DT_NAME(name)(const reals* DT_RESTRICT in, reals* DT_RESTRICT out, \
                              reals* DT_RESTRICT work) { \
    double* const a = (double*)work; \
    double* const b = a + n_in; \
    int lane, i; \
    for (lane = 0; lane < DYNTAPE_LANES; ++lane) { \
      for (i = 0; i < n_in; ++i) a[i] = ((const double*)in)[i * DYNTAPE_LANES + lane]; \
      name##_of_one(a, b); \
      for (i = 0; i < n_out; ++i) ((double*)out)[i * DYNTAPE_LANES + lane] = b[i]; \
    } \
  } \
  static void name##_of_one(const double* DT_RESTRICT in, double* DT_RESTRICT out)
)";

// Functions that are an instruction, or a few of its bits.
struct OwnForm {
  std::string_view function;
  const char* text;
};
constexpr OwnForm kOwnForms[] = {
    {"sqrt", R"(DT_INLINE real dt_sqrt(real x) {
#if defined(__AVX512F__) && DYNTAPE_LANES == 8
  __asm__("vsqrtpd %1, %0" : "=v"(x) : "v"(x));
#elif defined(__AVX__) && DYNTAPE_LANES <= 4
  __asm__("vsqrtpd %1, %0" : "=x"(x) : "x"(x));
#elif defined(__SSE2__) && DYNTAPE_LANES == 2
  __asm__("sqrtpd %1, %0" : "=x"(x) : "x"(x));
#elif defined(__aarch64__) && DYNTAPE_LANES == 2
  __asm__("fsqrt %0.2d, %1.2d" : "=w"(x) : "w"(x));
#else
  int lane;
  for (lane = 0; lane < DYNTAPE_LANES; ++lane) x[lane] = sqrt(x[lane]);
#endif
  return x;
}
)"},
    {"fabs", R"(DT_INLINE real dt_fabs(real x) { return (real)((dt_words)x & 0x7fffffffffffffff); }
)"},
    {"copysign", R"(DT_INLINE real dt_copysign(real x, real y) {
  return (real)(((dt_words)x & 0x7fffffffffffffff) | ((dt_words)y & ~(int64_t)0x7fffffffffffffff));
}
)"},
};

// All others: as libm computes them, one lane after the other.
constexpr char kEach[] = R"(#define DT_EACH_1(f) \
  static __attribute__((unused)) real dt_##f(real x) { \
    double a[DYNTAPE_LANES]; \
    int lane; \
    *(reals*)a = x; \
    DT_LEAVE(a); \
    for (lane = 0; lane < DYNTAPE_LANES; ++lane) a[lane] = f(a[lane]); \
    return *(const reals*)a; \
  }
#define DT_EACH_2(f) \
  static __attribute__((unused)) real dt_##f(real x, real y) { \
    double a[DYNTAPE_LANES], b[DYNTAPE_LANES]; \
    int lane; \
    *(reals*)a = x; \
    *(reals*)b = y; \
    DT_LEAVE(a); \
    DT_LEAVE(b); \
    for (lane = 0; lane < DYNTAPE_LANES; ++lane) a[lane] = f(a[lane], b[lane]); \
    return *(const reals*)a; \
  }
)";

// Sine and cosine of one argument.  Since 2.28 one code computes them in glibc's sin, cos and sincos: the same bits, in
// three quarters of the time of two calls (own_trig_test.cpp).  Other C libraries are called twice.
constexpr char kPair[] = R"(
#ifdef __GLIBC__
#define DT_SINCOS __GLIBC_PREREQ(2, 28)
#else
#define DT_SINCOS 0
#endif
#if DT_SINCOS && !defined(__cplusplus)
extern void sincos(double, double*, double*);
#elif !DT_SINCOS
static __attribute__((unused)) void dt_two(double x, double* s, double* c) {
  *s = sin(x);
  *c = cos(x);
}
#define sincos(x, s, c) dt_two(x, s, c)
#endif
#if DYNTAPE_LANES == 1
#define dt_sincos(x, s, c) sincos(x, s, c)
#else
static __attribute__((unused)) void dt_sincos(real x, real* s, real* c) {
  double a[DYNTAPE_LANES], b[DYNTAPE_LANES];
  int lane;
  *(reals*)a = x;
  DT_LEAVE(a);
  for (lane = 0; lane < DYNTAPE_LANES; ++lane) sincos(a[lane], &a[lane], &b[lane]);
  *s = *(const reals*)a;
  *c = *(const reals*)b;
}
#endif
)";

// Of one state up to eight values go through wide registers together (schedule/gather.h): four at a time, since a core that
// works on eight computes the scalars around them with one unit less (UR5's rnea: 103 ns with four, 133 with eight).
constexpr char kWidth[] = R"(
#if DYNTAPE_LANES > 1
#define DT_WIDTH DYNTAPE_LANES
#elif defined(__AVX__)
#define DT_WIDTH 4
#elif defined(__SSE2__) || (defined(__aarch64__) && defined(__GNUC__))
#define DT_WIDTH 2
#else
#define DT_WIDTH 1
#endif
#if DT_WIDTH > 1
typedef double dt_vector __attribute__((vector_size(8 * DT_WIDTH)));
typedef int64_t dt_vector_words __attribute__((vector_size(8 * DT_WIDTH)));
#define DT_HELPER static __inline__ __attribute__((unused))
#else
typedef double dt_vector;
#define DT_HELPER static
#endif
)";

constexpr char kTurns[] = R"(
#if DT_WIDTH > 1
static __attribute__((unused, noinline)) void dt_sines(dt_vector x, dt_vector* s, dt_vector* c) {
  dt_turn(x, s, c);
#if DYNTAPE_LANES == 1
  DT_CLEAR(*s);
#endif
}
#endif
#if DYNTAPE_LANES > 1
static __attribute__((unused, noinline)) real dt_sin(real x) {
  real s, c;
  dt_turn(x, &s, &c);
  return s;
}
static __attribute__((unused, noinline)) real dt_cos(real x) {
  real s, c;
  dt_turn(x, &s, &c);
  return c;
}
#undef sin
#undef cos
#define sin(a) dt_sin(DT_ALL(a))
#define cos(a) dt_cos(DT_ALL(a))
#define dt_sincos(x, s, c) dt_sines(x, s, c)
#else
#define dt_sincos(x, s, c) dt_circle(x, s, c)
#endif
#if DYNTAPE_LANES > 1 || DT_WIDTH == 1
#define DT_TURNS(m, n, a, b, c, d, e, f, g, h)
#define DT_TURN(m, k, x, s, c) dt_sincos(x, s, c)
#else
#define DT_TURN(m, k, x, s, c) (*(s) = DT_OF(sin, m, k, x), *(c) = DT_OF(cos, m, k, x))
#if DT_WIDTH == 4
#define DT_TURNS(m, n, a, b, c, d, e, f, g, h) \
  const dt_vector m##0 = {a, b, c, d}, m##1 = {e, f, g, h}; \
  dt_vector m##_sin[2], m##_cos[2]; \
  dt_sines(m##0, m##_sin, m##_cos); \
  if (n > 4) dt_sines(m##1, m##_sin + 1, m##_cos + 1)
#else
/* Of two registers, which share the constants. */
static __attribute__((unused, noinline)) void dt_more_sines(dt_vector x, dt_vector y, dt_vector* s, dt_vector* c) {
  const dt_vector_words few = dt_turn_few(x, s, c);
  if (dt_all(few & dt_turn_few(y, s + 1, c + 1))) return;
  dt_turn_each(x, s, c);
  dt_turn_each(y, s + 1, c + 1);
}
#define DT_TURNS(m, n, a, b, c, d, e, f, g, h) \
  const dt_vector m##0 = {a, b}, m##1 = {c, d}, m##2 = {e, f}, m##3 = {g, h}; \
  dt_vector m##_sin[4], m##_cos[4]; \
  if (n > 2) dt_more_sines(m##0, m##1, m##_sin, m##_cos); else dt_sines(m##0, m##_sin, m##_cos); \
  if (n > 6) dt_more_sines(m##2, m##3, m##_sin + 2, m##_cos + 2); else if (n > 4) dt_sines(m##2, m##_sin + 2, m##_cos + 2)
#endif
#endif
)";

constexpr char kTeams[] = R"(
#if DYNTAPE_LANES > 1 || DT_WIDTH == 1
#define DT_OF(f, m, k, x) f(x)
#else
#define DT_OF(f, m, k, x) m##_##f[(k) / DT_WIDTH][(k) % DT_WIDTH]
#endif
)";

constexpr char kSleef[] = R"(
/* SLEEF's deterministic functions: the same bits in 1, 2, 4 and 8 lanes.  Link with -lsleef. */
#if DT_WIDTH == 8
#define DT_PORTABLE(f, ulp) Sleef_cinz_##f##d8_##ulp##avx512fnofma
#elif DT_WIDTH == 4
#define DT_PORTABLE(f, ulp) Sleef_cinz_##f##d4_##ulp##avx
#elif DT_WIDTH == 2 && defined(__aarch64__)
#define DT_PORTABLE(f, ulp) Sleef_cinz_##f##d2_##ulp##advsimdnofma
#elif DT_WIDTH == 2
#define DT_PORTABLE(f, ulp) Sleef_cinz_##f##d2_##ulp##sse2
#else
#define DT_PORTABLE(f, ulp) Sleef_cinz_##f##d1_##ulp##purec
#endif
#if DYNTAPE_LANES > 1 || DT_WIDTH == 1
#define DT_VALUE_1(f) DT_HELPER real dt_##f(real x) { return DT_VECTOR_##f(x); }
#define DT_VALUE_2(f) DT_HELPER real dt_##f(real x, real y) { return DT_VECTOR_##f(x, y); }
#define DT_MANY(f, m, n, a, b, c, d, e, g, h, i)
#else
#define DT_VALUE_1(f) \
  static __attribute__((unused, noinline)) void dt_many_##f(dt_vector x, dt_vector* y) { \
    *y = DT_VECTOR_##f(x); \
    DT_CLEAR(*y); \
  } \
  DT_HELPER double dt_##f(double x) { \
    const dt_vector a = {x}; \
    dt_vector y; \
    dt_many_##f(a, &y); \
    return y[0]; \
  }
#define DT_VALUE_2(f) \
  static __attribute__((unused, noinline)) double dt_##f(double x, double y) { \
    const dt_vector a = {x}, b = {y}; \
    dt_vector z = DT_VECTOR_##f(a, b); \
    DT_CLEAR(z); \
    return z[0]; \
  }
#if DT_WIDTH == 4
#define DT_MANY(f, m, n, a, b, c, d, e, g, h, i) \
  const dt_vector m##0 = {a, b, c, d}, m##1 = {e, g, h, i}; \
  dt_vector m##_##f[2]; \
  dt_many_##f(m##0, m##_##f); \
  if (n > 4) dt_many_##f(m##1, m##_##f + 1)
#else
#define DT_MANY(f, m, n, a, b, c, d, e, g, h, i) \
  const dt_vector m##0 = {a, b}, m##1 = {c, d}, m##2 = {e, g}, m##3 = {h, i}; \
  dt_vector m##_##f[4]; \
  dt_many_##f(m##0, m##_##f); \
  if (n > 2) dt_many_##f(m##1, m##_##f + 1); \
  if (n > 4) dt_many_##f(m##2, m##_##f + 2); \
  if (n > 6) dt_many_##f(m##3, m##_##f + 3)
#endif
#endif
)";

const PortableFunction* portable(std::string_view function) {
  const auto* found = std::find_if(std::begin(kPortableFunctions), std::end(kPortableFunctions),
                                   [&](const PortableFunction& p) { return p.name == function; });
  return found == std::end(kPortableFunctions) ? nullptr : found;
}

// "#define pow(a, b) <to>(DT_ALL(a), DT_ALL(b))"
std::string definition(const std::string& function, int arity, const std::string& to) {
  constexpr const char* kParameters[] = {"(a) ", "(a, b) ", "(a, b, c) "};
  constexpr const char* kArguments[] = {"(DT_ALL(a))\n", "(DT_ALL(a), DT_ALL(b))\n",
                                        "(DT_ALL(a), DT_ALL(b), DT_ALL(c))\n"};
  return "#define " + function + kParameters[arity - 1] + to + kArguments[arity - 1];
}

std::string lane_functions(const std::vector<Op>& operators) {
  std::string text, macros;
  for (Op op : operators) {
    const std::string function(called_function(op));
    const int arity = info(op).arity;
    if (function == "fma") {  // real_types() has it: kernels written by hand may use it
      macros += definition(function, arity, "dt_fma");
      continue;
    }
    const auto* own = std::find_if(std::begin(kOwnForms), std::end(kOwnForms),
                                   [&](const OwnForm& form) { return form.function == function; });
    if (own != std::end(kOwnForms)) {
      text += own->text;
    } else {
      if (text.find(kEach) == std::string::npos) text += kEach;
      text += "DT_EACH_" + std::to_string(arity) + "(" + function + ")\n";
    }
    macros += definition(function, arity, "dt_" + function);
  }
  return macros.empty() ? "" : "\n#if DYNTAPE_LANES > 1\n" + text + macros + "#endif\n";
}

std::string portable_functions(const std::vector<Op>& operators) {
  std::string text, macros, turns;
  for (Op op : operators) {
    if (is_turn(op)) {
      turns = own_trig(false, true, true) + own_circle() + "#if DT_WIDTH > 1" + own_trig_in_lanes() +
              "#endif\n" + kTurns;
      continue;
    }
    const std::string function(called_function(op)), arity = std::to_string(info(op).arity);
    const std::string name =
        "DT_PORTABLE(" + function + ", " + std::string(portable(function)->accuracy) + ")";
    text += "dt_vector " + name + (arity == "1" ? "(dt_vector)" : "(dt_vector, dt_vector)") + ";\n";
    text += "#define DT_VECTOR_" + function + " " + name + "\nDT_VALUE_" + arity + "(" + function + ")\n";
    macros += definition(function, info(op).arity, "dt_" + function);
  }
  if (operators.empty()) return {};
  return std::string(kWidth) + kTeams + turns + (text.empty() ? "" : kSleef + text + macros);
}

}  // namespace

Vocabulary vocabulary(const KernelSets& sets, const std::vector<const Callee*>& callees) {
  Vocabulary words;
  std::array<bool, kTableOps> used{};
  const auto add = [&](const Function& function) {
    for (const Node& node : function.graph.nodes()) {
      if (static_cast<int>(node.op) < kTableOps) used[static_cast<std::size_t>(node.op)] = true;
    }
    words.guards = words.guards || !function.guards.empty();
  };
  for (const KernelPlan& kernel : sets.kernels) add(kernel.derivatives.function);
  for (const Callee* callee : callees) {
    if (const Recorded* recorded = callee->recorded()) add(*recorded->function);
    if (const Kernel* kernel = callee->kernel()) {
      words.kernels = words.kernels || kernel->c_body_of_lanes.empty();
      words.fuses = words.fuses || kernel->c_body_of_lanes.find("dt_fma(") != std::string::npos;
    }
  }
  for (int op = 0; op < kTableOps; ++op) {
    if (!used[static_cast<std::size_t>(op)]) continue;
    words.operators.push_back(static_cast<Op>(op));
    words.fuses = words.fuses || called_function(static_cast<Op>(op)) == "fma";
  }
  return words;
}

std::string real_types(const Vocabulary& words) {
  const bool selects = std::any_of(words.operators.begin(), words.operators.end(), [](Op op) {
    return info(op).c.find("dt_select") != std::string_view::npos;
  });
  return std::string(kOneTypes) + (selects ? kOneSelect : "") + (words.guards ? kOneCheck : "") +
         (words.kernels ? kOneKernel : "") + kLaneTypes + (selects ? kLaneSelect : "") +
         (words.fuses ? kLaneFma : "") + (words.guards ? kLaneCheck : "") +
         (words.kernels ? kLaneKernel : "") + "#endif\n" + kLeave;
}

std::string real_functions(const Vocabulary& words, Functions functions) {
  std::vector<Op> in_lanes, portables;
  std::set<std::string_view> met;  // several operators call one function
  for (Op op : words.operators) {
    const std::string_view function = called_function(op);
    if (function.empty() || !met.insert(function).second) continue;
    (is_portable(op, functions) ? portables : in_lanes).push_back(op);
  }
  const bool pairs = functions == Functions::kLibm && met.count("sin") && met.count("cos");
  return (pairs ? kPair : "") + portable_functions(portables) + lane_functions(in_lanes);
}

bool needs_sleef(const Vocabulary& words, Functions functions) {
  return std::any_of(words.operators.begin(), words.operators.end(),
                     [functions](Op op) { return is_portable(op, functions) && !is_turn(op); });
}

}  // namespace dyntape::codegen
