// SPDX-License-Identifier: BSD-3-Clause
//
// Kernels of several lanes against one point at a time, bit for bit: every operator, special values in
// neighbouring lanes, any number of points, gaps, guards, calls; with each choice of functions.
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/linear_algebra.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/options/lane_widths.h>
#include <dyntape/codegen/pipeline.h>
#include <dyntape/codegen/run/lanes.h>
#include <gtest/gtest.h>

#include "calls.h"
#include "compilers.h"
#include "random_function.h"

namespace dyntape::lanes_test {
namespace {

using testing::Random;
using testing::same;
using testing::Scratch;

constexpr double kUntouched = -77;

CodegenOptions in_lanes(Order order, Functions functions = kDefaultFunctions) {
  CodegenOptions options;
  options.order = order;
  options.route = Route::kCompiled;
  options.use_cache = false;
  options.functions = functions;
  options.lanes = Lanes::kAll;
  return options;
}

// Everything of a (3 x 3) matrix and a vector.
VectorXad of_matrices(const VectorXad& x) {
  const MatrixXad A = x.head(9).reshaped(3, 3);
  const VectorXad b = x.tail(3);
  VectorXad y(23);
  y << solve(A, b), inverse(A).reshaped(), determinant(A), least_squares(A.leftCols(2), b),
      eigen_symmetric(A).values, eigen_symmetric(A).vectors.col(1), singular_values(A).head(2);
  return y;
}

// One library, once for each width that this processor has.
std::vector<CompiledFunction> at_every_width(const Function& f, CodegenOptions options) {
  const Scratch cache;
  options.use_cache = true;
  options.cache_folder = cache.path();
  std::vector<CompiledFunction> functions;
  for (std::size_t width : {1, 2, 4, 8}) {
    if (!codegen::has_lanes(static_cast<unsigned>(width))) {
      std::printf("%zu lanes: this processor has no such registers: not tried\n", width);
      continue;
    }
    options.widest_lanes = width;
    functions.push_back(CompiledFunction::make(f, options));
    EXPECT_EQ(functions.back().lane_width(), width);
    EXPECT_EQ(functions.back().timings().cache_hit, functions.size() > 1) << "the library holds all widths";
  }
  return functions;
}

// `count` points of n entries and `gap` doubles between them.
std::vector<double> points(Random& random, std::size_t count, std::size_t n, std::size_t gap) {
  std::vector<double> values(count * (n + gap), kUntouched);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < n; ++k) values[i * (n + gap) + k] = testing::random_argument(random);
  }
  return values;
}

struct Results {
  std::vector<double> y, jacobian, hessian;
};

// Arguments and results of `count` points with gaps, evaluated together or one by one.
struct Batch {
  Batch(const CompiledFunction& f, Random& random, std::size_t n, std::size_t gap)
      : function(f), order(f.order()), count(n) {
    const std::size_t nj = order >= Order::kFirst ? f.jacobian_pattern().nnz() : 0,
                      nh = order == Order::kSecond ? f.hessian_pattern().nnz() : 0,
                      nw = f.n_w() + (order == Order::kSecond ? f.n_y() : 0);
    strides = {f.n_x() + gap, f.n_p() + gap, nw + gap, f.n_y() + gap, nj + gap, nh + gap};
    x = points(random, n, f.n_x(), gap), p = points(random, n, f.n_p(), gap), w = points(random, n, nw, gap);
  }

  Results room() const {
    return {std::vector<double>(count * strides.y, kUntouched),
            std::vector<double>(count * strides.jacobian, kUntouched),
            std::vector<double>(count * strides.hessian, kUntouched)};
  }

  Results together(const CompiledFunction& f) const {
    Results r = room();
    CompiledFunction::Workspace workspace(f);
    EXPECT_FALSE(f.run(order,
                       {count, x.data(), p.data(), w.data(), r.y.data(), r.jacobian.data(), r.hessian.data(),
                        &strides, nullptr},
                       workspace));
    return r;
  }

  Results one_by_one() const {
    Results r = room();
    CompiledFunction::Workspace workspace(function);
    for (std::size_t i = 0; i < count; ++i) {
      const Points point{1,
                         &x[i * strides.x],
                         p.data() + i * strides.p,
                         w.data() + i * strides.w,
                         r.y.data() + i * strides.y,
                         r.jacobian.data() + i * strides.jacobian,
                         r.hessian.data() + i * strides.hessian,
                         nullptr,
                         nullptr};
      EXPECT_FALSE(function.run(order, point, workspace));
    }
    return r;
  }

  const CompiledFunction& function;  // the reference
  Order order;
  std::size_t count;
  Strides strides;
  std::vector<double> x, p, w;
};

void expect_same(const char* what, const std::vector<double>& found, const std::vector<double>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i)
    ASSERT_TRUE(same(found[i], expected[i]))
        << what << "[" << i << "]: in lanes " << found[i] << ", alone " << expected[i];
}

void expect_same(const Results& found, const Results& expected) {
  expect_same("y", found.y, expected.y);
  expect_same("jacobian", found.jacobian, expected.jacobian);
  expect_same("hessian", found.hessian, expected.hessian);
}

// Every width, every number of points up to three blocks and one more, with and without gaps.
void expect_lanes_are_points(const Function& f, const CodegenOptions& options, Random& random) {
  const auto widths = at_every_width(f, options);
  CodegenOptions interpreted = options;
  interpreted.route = Route::kInterpreter;
  const CompiledFunction reference = CompiledFunction::make(f, interpreted);
  for (const CompiledFunction& c : widths) {
    SCOPED_TRACE("lanes: " + std::to_string(c.lane_width()));
    for (std::size_t count = 0; count <= 3 * c.lane_width() + 1; ++count) {
      const Batch batch(reference, random, count, count % 3);
      expect_same(batch.together(c), batch.one_by_one());
      if (::testing::Test::HasFatalFailure()) return;
    }
  }
}

class LanesOf : public ::testing::TestWithParam<Functions> {};

// Pivots differ from lane to lane, and eigenvalues are a loop in each.
TEST_P(LanesOf, Matrices) {
  Random random(409);
  SCOPED_TRACE(random.seed_text());
  const Function f = record("matrices", 12, of_matrices);
  EXPECT_TRUE(f.guards.empty());
  expect_lanes_are_points(f, in_lanes(Order::kSecond, GetParam()), random);
}

TEST_P(LanesOf, EveryOperator) {
  Random random(401);
  SCOPED_TRACE(random.seed_text());
  expect_lanes_are_points(testing::random_functions(random, 60, 12), in_lanes(Order::kValue, GetParam()),
                          random);
}

TEST_P(LanesOf, DerivativesInPieces) {
  Random random(402);
  SCOPED_TRACE(random.seed_text());
  CodegenOptions options = in_lanes(Order::kSecond, GetParam());
  options.piece_statements = 100;
  expect_lanes_are_points(testing::random_functions(random, 6, 7), options, random);
}

TEST_P(LanesOf, AnyLevelAndCompiler) {
  Random random(410);
  SCOPED_TRACE(random.seed_text());
  const Function f = testing::random_functions(random, 30, 8);
  CodegenOptions options = in_lanes(Order::kValue, GetParam());
  for (const char* level : {"-O0", "-O3"}) {
    options.flags = {level};
    expect_lanes_are_points(f, options, random);
  }
  options.flags.clear();
  options.compiler = codegen::in_path("clang");
  if (options.compiler.empty()) GTEST_SKIP() << "clang is not installed";
  expect_lanes_are_points(f, options, random);
}

TEST_P(LanesOf, Calls) {
  Random random(403);
  SCOPED_TRACE(random.seed_text());
  const auto kernel = testing::kepler();
  for (const std::size_t pieces : {400, 6}) {
    CodegenOptions options = in_lanes(Order::kFirst, GetParam());
    options.piece_statements = pieces;
    expect_lanes_are_points(testing::with_calls(kernel), options, random);
  }
  for (const int variant : {0, 3}) {
    expect_lanes_are_points(testing::with_long_calls(variant), in_lanes(Order::kValue, GetParam()), random);
  }
}

INSTANTIATE_TEST_SUITE_P(Functions, LanesOf,
                         ::testing::Values(Functions::kSines, Functions::kLibm, Functions::kPortable),
                         [](const auto& info) { return std::string(to_string(info.param)); });

// Smooth, and guarded: a comparison at each entry.
Function guarded() {
  return record("guarded", 5, 2, [](const VectorXad& x, const VectorXad& p) {
    VectorXad y(3);
    y << sin(x[0]) * p[0], x[1] * x[2] + cos(x[3]), p[1] / x[4];
    for (int i = 0; i < 4; ++i) {
      if (x[i] < 2.0) y[i % 3] += x[4];
    }
    return y;
  });
}

TEST(Lanes, GuardsAreOfTheLaneThatViolatesThem) {
  Random random(404);
  SCOPED_TRACE(random.seed_text());
  const Function f = guarded();
  ASSERT_EQ(f.guards.size(), 4u);
  for (const CompiledFunction& c : at_every_width(f, in_lanes(Order::kFirst))) {
    CompiledFunction::Workspace workspace(c);
    const std::size_t count = 3 * c.lane_width() + 1;
    std::vector<double> x(5 * count), y(3 * count);
    const std::vector<double> p = random.vector(2, 1, 2);
    std::vector<std::uint32_t> status(count + 1, 99), expected;
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t k = 0; k < 5; ++k) x[5 * i + k] = random.uniform(0, 2.5);
      std::uint32_t first = 0;
      for (std::uint32_t k = 4; k-- > 0;) first = x[5 * i + k] < 2.0 ? first : k + 1;
      expected.push_back(first);
    }
    expected.push_back(99);
    const Strides shared{5, 0, 0, 3, 0, 0};
    Points batch{count, x.data(), p.data(), nullptr, y.data(), nullptr, nullptr, &shared, status.data()};
    const Violation violation = c.run(Order::kFirst, batch, workspace);
    EXPECT_EQ(status, expected);
    batch.status = nullptr;
    EXPECT_EQ(c.run(Order::kValue, batch, workspace).point, violation.point);
    EXPECT_EQ(violation.guard, expected[violation.point]);
  }
}

TEST(Lanes, BlocksOfThoseWhoKeepThem) {
  Random random(405);
  SCOPED_TRACE(random.seed_text());
  const Function f = guarded();
  for (const CompiledFunction& c : at_every_width(f, in_lanes(Order::kFirst))) {
    CompiledFunction::Workspace workspace(c);
    const std::size_t width = c.lane_width(), count = 3 * width, nj = c.jacobian_pattern().nnz();
    const Strides gaps{5 * width + 3, 0, 0, 3 * width + 1, nj * width + 5, 0};
    for (const Strides* strides : {static_cast<const Strides*>(nullptr), &gaps}) {
      const std::size_t sx = strides ? strides->x : 5 * width, sp = strides ? strides->p : 2 * width,
                        sy = strides ? strides->y : 3 * width, sj = strides ? strides->jacobian : nj * width;
      const auto x = random.vector(3 * sx, 0, 2.2), p = random.vector(3 * sp + 2 * width, 1, 2);
      std::vector<double> y(3 * sy, kUntouched), jacobian(3 * sj, kUntouched);
      std::vector<std::uint32_t> status(count, 99);
      const Violation violation = c.run(Order::kFirst,
                                        {count, x.data(), p.data(), nullptr, y.data(), jacobian.data(),
                                         nullptr, strides, status.data(), width},
                                        workspace);
      std::vector<bool> written(y.size(), false);
      for (std::size_t i = 0; i < count; ++i) {
        const std::size_t block = i / width, lane = i % width;
        std::vector<double> xi, pi, yi(3), ji(nj);
        for (std::size_t k = 0; k < 5; ++k) xi.push_back(x[block * sx + k * width + lane]);
        for (std::size_t k = 0; k < 2; ++k) pi.push_back(p[block * sp + k * width + lane]);
        std::uint32_t word = 0;
        (void)c.run(Order::kFirst,
                    {1, xi.data(), pi.data(), nullptr, yi.data(), ji.data(), nullptr, nullptr, &word},
                    workspace);
        EXPECT_EQ(status[i], word);
        for (std::size_t k = 0; k < 3; ++k) {
          EXPECT_EQ(y[block * sy + k * width + lane], yi[k]);
          written[block * sy + k * width + lane] = true;
        }
        for (std::size_t k = 0; k < nj; ++k) EXPECT_EQ(jacobian[block * sj + k * width + lane], ji[k]);
      }
      for (std::size_t i = 0; i < y.size(); ++i) EXPECT_EQ(y[i] == kUntouched, !written[i]);
      EXPECT_EQ(bool(violation), violation && status[violation.point] == violation.guard);
    }
    if (width == 1) continue;
    const Points odd{.count = width + 1, .side_by_side = width};
    EXPECT_THROW((void)c.run(Order::kValue, odd, workspace), ArgumentError);
  }
}

// A kernel of W lanes whose y is x, of so many entries.
std::size_t entries_copied = 0;
template <std::size_t W>
void copy_lanes(const double* x, const double*, const double*, double* y, double*, double*, double*,
                std::size_t, const dyntape_strides*, std::uint32_t*) {
  std::copy_n(x, entries_copied * W, y);
}

TEST(Lanes, EveryEntryOfAnyNumberGoesThereAndBack) {
  const std::pair<std::size_t, dyntape_run> kernels[] = {
      {2, copy_lanes<2>}, {4, copy_lanes<4>}, {8, copy_lanes<8>}};
  for (const auto& [width, run] : kernels) {
    dyntape_kernel kernel{};
    kernel.lane_width = static_cast<std::uint32_t>(width);
    kernel.run = run;
    for (std::size_t entries = 1; entries <= 40; ++entries) {
      entries_copied = entries;
      for (std::size_t points = 1; points <= 2 * width + 1; ++points) {
        const Strides sizes{entries, 0, 0, entries, 0, 0}, strides{entries + 2, 0, 0, entries + 3, 0, 0};
        codegen::AlignedRoom room;
        room.resize(codegen::room_for_lanes(kernel, sizes));
        // Of x nothing stands behind the last entry: an address sanitizer sees who reads on.
        std::vector<double> x((points - 1) * strides.x + entries), y(points * strides.y, kUntouched);
        for (std::size_t i = 0; i < x.size(); ++i) x[i] = static_cast<double>(i);
        codegen::run_in_lanes(
            kernel, sizes, {.count = points, .x = x.data(), .y = y.data(), .strides = &strides}, room.data());
        for (std::size_t i = 0; i < y.size(); ++i) {
          const std::size_t point = i / strides.y, entry = i % strides.y;
          const double expected = entry < entries ? x[point * strides.x + entry] : kUntouched;
          ASSERT_EQ(y[i], expected) << width << " lanes, " << entries << " entries, point " << point;
        }
      }
    }
  }
}

TEST(Lanes, OutputsThatAreNullAreSkipped) {
  Random random(406);
  SCOPED_TRACE(random.seed_text());
  const Function f = testing::random_functions(random, 4, 6);
  const CompiledFunction c = CompiledFunction::make(f, in_lanes(Order::kFirst));
  const Batch batch(c, random, 11, 0);
  const Results all = batch.one_by_one();
  CompiledFunction::Workspace workspace(c);
  for (int mask = 0; mask < 4; ++mask) {
    Results r = batch.room();
    EXPECT_FALSE(c.run(Order::kFirst,
                       {11, batch.x.data(), batch.p.data(), nullptr, mask & 1 ? r.y.data() : nullptr,
                        mask & 2 ? r.jacobian.data() : nullptr, nullptr, nullptr, nullptr},
                       workspace));
    expect_same("y", r.y, mask & 1 ? all.y : batch.room().y);
    expect_same("jacobian", r.jacobian, mask & 2 ? all.jacobian : batch.room().jacobian);
  }
}

// J dx and J^T w are functions like any other: their directions are weights, one a point.
TEST(Lanes, DirectionsOfManyPoints) {
  Random random(407);
  SCOPED_TRACE(random.seed_text());
  const Function f = record("smooth", 6, 1, [](const VectorXad& x, const VectorXad& p) {
    VectorXad y(4);
    y << sin(x[0] * x[1]) + p[0], x[2] / (2.0 + cos(x[3])), hypot(x[4], x[5]) * x[0], exp(x[1]) * x[5];
    return y;
  });
  for (const Function& product : {jvp(f), vjp(f)}) {
    ASSERT_GT(product.n_w(), 0u);
    expect_lanes_are_points(product, in_lanes(Order::kValue, Functions::kPortable), random);
  }
}

// Products of two different NaN behind selections of zero, and calls that leave them in registers and in memory: a compiler
// that computes what is not selected twice, in different orders, and blends by exclusive or, leaves a small number.
TEST(Lanes, NothingIsLeftOfNaNsThatAreNotSelected) {
  Random random(411);
  SCOPED_TRACE(random.seed_text());
  Function f;
  f.name = "selections";
  f.inputs = {6, 0, 0};
  std::vector<NodeId> pool;
  for (std::uint32_t i = 0; i < 6; ++i) pool.push_back(f.graph.input(Block::kVariables, i));
  const NodeId zero = f.graph.constant(0);
  for (int k = 0; k < 200; ++k) {
    const auto recent = [&] {
      return pool[pool.size() - 1 - random.below(std::min<std::size_t>(pool.size(), 10))];
    };
    const NodeId condition = pool[random.below(6)], a = recent(), b = recent();
    const NodeId forms[] = {f.graph.make(Op::Mul, a, b), f.graph.make(Op::Div, a, b),
                            f.graph.make(Op::Sinh, a),
                            f.graph.make(Op::Select, condition, zero, f.graph.make(Op::Mul, a, b))};
    pool.push_back(forms[random.below(4)]);
    if (k % 5 == 0) f.outputs.push_back(pool.back());
  }
  const std::size_t count = 64;
  std::vector<double> x(6 * count), y(f.n_y() * count);
  for (double& t : x) {
    const std::uint64_t nan = 0x7ff8000000000000u | (random.bits() & 0x8007ffffffffffffu);
    t = random.below(3) == 0   ? std::bit_cast<double>(nan)
        : random.below(3) == 0 ? 0.0
                               : random.uniform(-2, 2);
  }
  for (const CompiledFunction& c : at_every_width(f, in_lanes(Order::kValue, Functions::kPortable))) {
    CompiledFunction::Workspace workspace(c);
    EXPECT_FALSE(c.run(Order::kValue, {.count = count, .x = x.data(), .y = y.data()}, workspace));
    const Interpreter interpreter(f, Functions::kPortable);
    Interpreter::Workspace room(interpreter);
    std::vector<double> expected(f.n_y());
    for (std::size_t i = 0; i < count; ++i) {
      interpreter(&x[6 * i], nullptr, nullptr, expected.data(), room);
      expect_same("y",
                  {y.begin() + static_cast<std::ptrdiff_t>(i * f.n_y()),
                   y.begin() + static_cast<std::ptrdiff_t>((i + 1) * f.n_y())},
                  expected);
    }
  }
}

TEST(Lanes, AreNotThereUnlessAskedFor) {
  CodegenOptions options = in_lanes(Order::kValue);
  options.lanes = Lanes::kNone;
  EXPECT_EQ(CompiledFunction::make(guarded(), options).lane_width(), 1u);
  options.lanes = Lanes::kNative;
  const auto native = codegen::lane_widths(Lanes::kNative);
  ASSERT_EQ(native.size(), 1u);
  EXPECT_EQ(CompiledFunction::make(guarded(), options).lane_width(), native[0]);
  options.route = Route::kInterpreter;
  EXPECT_EQ(CompiledFunction::make(guarded(), options).lane_width(), 1u);
}

TEST(Lanes, TheTextPleasesCompilersAtEveryWidth) {
  Random random(408);
  SCOPED_TRACE(random.seed_text());
  Function f = testing::random_functions(random, 20, 12);
  f.guards.push_back(
      {f.graph.make(Op::Lt, f.graph.input(Block::kVariables, 0), f.graph.constant(3)), true, "a.cpp", 12});
  const auto kernel = testing::kepler();
  const std::vector<std::string> texts = {
      generate_source(f, in_lanes(Order::kValue)).text,
      generate_source(testing::with_calls(kernel), in_lanes(Order::kValue, Functions::kPortable)).text};
  for (unsigned width : codegen::lane_widths(Lanes::kAll))
    testing::expect_compiles_cleanly(texts, codegen::lane_flags(width));
}

// Functions differ where a last bit does; that they are the same in all routes is tested above.
TEST(Portable, DiffersFromTheCLibraryByRoundingOnly) {
  Random random(409);
  SCOPED_TRACE(random.seed_text());
  const Function f =
      record("sine", 1, [](const VectorXad& x) { return VectorXad::Constant(1, sin(x[0])).eval(); });
  CodegenOptions options = in_lanes(Order::kValue, Functions::kPortable);
  options.lanes = Lanes::kNone;
  const CompiledFunction portable = CompiledFunction::make(f, options);
  options.functions = Functions::kLibm;
  const CompiledFunction libm = CompiledFunction::make(f, options);
  int different = 0;
  for (int i = 0; i < 20000; ++i) {
    const std::vector<double> x = {random.uniform(-1, 1) * std::exp2(random.uniform(-20, 60))};
    const double a = portable.evaluate(Order::kValue, x).y[0], b = libm.evaluate(Order::kValue, x).y[0];
    EXPECT_LE(std::abs(a - b), 2.3e-16 * std::abs(b)) << x[0];
    different += a != b;
  }
  EXPECT_GT(different, 0);
}

TEST(Portable, AnAbsentSleefIsSaid) {
  const Scratch scratch;
  const std::string compiler = scratch / "cc";
  codegen::write_file(compiler,
                      "#!/bin/sh\nfor a; do test \"$a\" = -lsleef && { echo '/usr/bin/ld: cannot find "
                      "-lsleef: No such file or directory' >&2; exit 1; }; done\nexec cc \"$@\"\n");
  ASSERT_EQ(chmod(compiler.c_str(), 0700), 0);
  CodegenOptions options = in_lanes(Order::kValue, Functions::kPortable);
  options.compiler = compiler;
  const Function tanh_of =
      record("tanh", 1, [](const VectorXad& x) { return x.array().tanh().matrix().eval(); });
  const Function sine = record("sine", 1, [](const VectorXad& x) { return x.array().sin().matrix().eval(); });
  EXPECT_NO_THROW(CompiledFunction::make(sine, options));  // which the text has itself
  try {
    CompiledFunction::make(tanh_of, options);
    FAIL() << "no ToolError";
  } catch (const ToolError& e) {
    EXPECT_NE(std::string(e.what()).find("does not find SLEEF (Debian: libsleef-dev)"), std::string::npos)
        << e.what();
  }
  options.functions = Functions::kLibm;
  EXPECT_NO_THROW(CompiledFunction::make(tanh_of, options));
}

}  // namespace
}  // namespace dyntape::lanes_test
