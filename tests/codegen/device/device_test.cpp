// SPDX-License-Identifier: BSD-3-Clause
//
// Kernels of devices: their bits on a device of OpenCL against the interpreter, their text, their errors.
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/device/opencl_api.h>
#include <dyntape/codegen/device_function.h>
#include <dyntape/codegen/pipeline.h>
#include <dyntape/codegen/store/cache.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#if __has_include(<CL/cl.h>)
#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>
#endif

#include "codegen/calls.h"
#include "codegen/random_function.h"
#include "device_support.h"

namespace dyntape::device_test {
namespace {

using codegen::DeviceLanguage;
using testing::Random;
using testing::same;

CodegenOptions with(Order order) {
  CodegenOptions options;
  options.order = order;
  options.use_cache = false;
  return options;
}

// All outputs of the device and of the interpreter at these states; returns the number of comparisons.
std::size_t expect_same_bits(const Function& f, Order order, Random& random, std::size_t count,
                             const DeviceRunOptions& how = {}) {
  const DeviceFunction device = DeviceFunction::make(f, with(order), how);
  CodegenOptions interpreted = with(order);
  interpreted.route = Route::kInterpreter;
  const CompiledFunction reference = CompiledFunction::make(f, interpreted);
  const std::size_t n_w = f.n_w() + (order == Order::kSecond ? f.n_y() : 0);
  const auto x = testing::random_arguments(random, count * f.n_x()),
             p = random.vector(count * f.n_p(), -2, 2), w = random.vector(count * n_w, -1, 1);
  const auto found = device.evaluate(order, count, x, p, w);
  std::size_t compared = 0;
  const auto part = [](const std::vector<double>& all, std::size_t n, std::size_t s) {
    return std::vector<double>(all.begin() + static_cast<std::ptrdiff_t>(n * s),
                               all.begin() + static_cast<std::ptrdiff_t>(n * (s + 1)));
  };
  for (std::size_t s = 0; s < count; ++s) {
    const auto expected =
        reference.evaluate(order, part(x, f.n_x(), s), part(p, f.n_p(), s), part(w, n_w, s));
    const auto compare = [&](const char* what, const std::vector<double>& all,
                             const std::vector<double>& one) {
      for (std::size_t i = 0; i < one.size(); ++i, ++compared)
        ASSERT_TRUE(same(all[s * one.size() + i], one[i]))
            << what << " " << i << " of state " << s << ": device " << all[s * one.size() + i]
            << ", interpreted " << one[i];
    };
    compare("y", found.y, expected.y);
    compare("jacobian", found.jacobian, expected.jacobian);
    compare("hessian", found.hessian, expected.hessian);
    if (::testing::Test::HasFatalFailure()) return compared;
  }
  return compared;
}

bool is_exact(Op op) { return !has_portable_form(op) || is_turn(op); }

TEST(Device, RandomProgramsHaveTheInterpretersBits) {
  DYNTAPE_NEED_DEVICE;
  Random random(71);
  SCOPED_TRACE(random.seed_text());
  const Function f = testing::random_functions(random, 50, 25, is_exact);
  EXPECT_EQ(expect_same_bits(f, Order::kValue, random, 100), 100 * f.n_y());
}

TEST(ManyDevicePrograms, HaveTheInterpretersBits) {
  DYNTAPE_NEED_DEVICE;
  Random random(77);
  SCOPED_TRACE(random.seed_text());
  for (int part = 0; part < 4; ++part) {
    const Function f = testing::random_functions(random, 50, 25, is_exact);
    EXPECT_EQ(expect_same_bits(f, Order::kValue, random, 200), 200 * f.n_y());
  }
  const Function f = testing::random_functions(random, 50, 12, is_exact);
  EXPECT_GT(expect_same_bits(f, Order::kFirst, random, 100), 100 * f.n_y());
}

TEST(Device, DerivativesOfRandomPrograms) {
  DYNTAPE_NEED_DEVICE;
  Random random(72);
  SCOPED_TRACE(random.seed_text());
  for (const Order order : {Order::kFirst, Order::kSecond}) {
    const Function f = testing::random_functions(random, 10, 8, is_exact);
    EXPECT_GT(expect_same_bits(f, order, random, 40), 40 * f.n_y());
  }
}

Function guarded() {
  return record("guarded", 2, 1, [](const VectorXad& x, const VectorXad& p) {
    AD y = x[0] * p[0];
    if (x[0] < 1) y = y + sin(x[1]);
    if (x[1] < 1) y = y * cos(x[1]);
    return VectorXad::Constant(1, y).eval();
  });
}

// Recorded functions and kernels of one state and of lanes, called for few and for many numbers.
TEST(Device, Calls) {
  DYNTAPE_NEED_DEVICE;
  Random random(73);
  for (int variant = 0; variant < 4; ++variant)
    EXPECT_GT(expect_same_bits(testing::with_long_calls(variant), Order::kFirst, random, 5), 0u) << variant;
  EXPECT_GT(expect_same_bits(testing::with_calls(testing::kepler()), Order::kFirst, random, 5), 0u);
}

// Of infinities and NaN as well, which languages have as floats.
TEST(Device, ConstantsThatAreNotFinite) {
  DYNTAPE_NEED_DEVICE;
  Random random(78);
  Function f;
  f.name = "extremes", f.inputs = {1, 0, 0};
  const NodeId x = f.graph.input(Block::kVariables, 0);
  for (const double extreme : testing::kSpecials) {
    const NodeId constant = f.graph.constant(extreme);
    for (const Op op : {Op::Fmod, Op::Remainder, Op::Copysign, Op::Min, Op::Add}) {
      if (op == Op::Copysign && std::isnan(extreme)) continue;
      // glibc 2.36 gives a zero remainder by a tiny divisor another sign than x has.
      if (op == Op::Remainder && std::abs(extreme) < 1e-300) continue;
      f.outputs.push_back(f.graph.make(op, x, constant));
      f.outputs.push_back(f.graph.make(op, constant, x));
    }
    f.outputs.push_back(constant);
  }
  std::erase_if(f.outputs, [&](NodeId id) {  // the sign of a NaN is not defined
    return f.graph[id].op == Op::Copysign && f.graph[id].b == x;
  });
  EXPECT_GT(expect_same_bits(f, Order::kValue, random, 50), 0u);
}

TEST(Device, PiecesChangeNoBits) {
  DYNTAPE_NEED_DEVICE;
  Random random(74);
  const Function f = testing::random_functions(random, 20, 20, is_exact);
  EXPECT_GT(expect_same_bits(f, Order::kFirst, random, 10, {.piece_statements = 40}), 0u);
}

// pocl has the memory of all work-items of a group on the stack of a thread.
TEST(Device, ManyStatesWithMuchMemoryEach) {
  DYNTAPE_NEED_DEVICE;
  const Function f = record("wide", 1, [](const VectorXad& x) {
    VectorXad arguments(2), y(300);
    arguments << 0.5 * x[0], x[0];
    const AD e = call(testing::kepler(), arguments)[0];
    for (Eigen::Index i = 0; i < y.size(); ++i) y[i] = x[0] * double(i) + e;
    return y;
  });
  const std::size_t count = 32768;  // a driver that is free to may make groups of thousands
  std::vector<double> x(count);
  for (std::size_t s = 0; s < count; ++s) x[s] = double(s) / double(count);
  const auto y = DeviceFunction::make(f, with(Order::kValue)).evaluate(Order::kValue, count, x).y;
  for (std::size_t s = 0; s < count; s += 1999)
    for (std::size_t i = 0; i < 300; ++i) ASSERT_EQ(y[300 * s + i], x[s] * double(i) + y[300 * s]);
}

TEST(Device, PartsOfABatchAndGapsChangeNothing) {
  DYNTAPE_NEED_DEVICE;
  Random random(75);
  const Function f = guarded();
  const std::size_t n = 1000;
  std::vector<double> x(3 * n), p = {2.0}, y(2 * n, 7.0), jacobian(2 * n);
  for (double& v : x) v = random.uniform(-3, 0.9);
  x[3 * 701] = 3.0, x[3 * 999 + 1] = 5.0;
  std::vector<std::uint32_t> status(n, 9);
  const Strides strides{.x = 3, .p = 0, .w = 0, .y = 2, .jacobian = 2, .hessian = 0};
  const Points points{.count = n,
                      .x = x.data(),
                      .p = p.data(),
                      .y = y.data(),
                      .jacobian = jacobian.data(),
                      .strides = &strides,
                      .status = status.data()};
  const DeviceFunction device = DeviceFunction::make(f, with(Order::kFirst), {.most_states = 300});
  const Violation violation = device.run(Order::kFirst, points);
  EXPECT_EQ(violation.point, 701u);
  EXPECT_EQ(violation.guard, 1u);
  for (std::size_t s = 0; s < n; ++s) {
    EXPECT_EQ(status[s], s == 701 ? 1u : s == 999 ? 2u : 0u);
    EXPECT_EQ(y[2 * s + 1], 7.0);
    if (status[s]) continue;
    const CompiledFunction::Evaluation one =
        CompiledFunction::make(f,
                               [] {
                                 CodegenOptions options = with(Order::kFirst);
                                 options.route = Route::kInterpreter;
                                 return options;
                               }())
            .evaluate(Order::kFirst, std::vector<double>{x[3 * s], x[3 * s + 1]}, p);
    EXPECT_TRUE(same(y[2 * s], one.y[0]));
    EXPECT_TRUE(same(jacobian[2 * s], one.jacobian[0]) && same(jacobian[2 * s + 1], one.jacobian[1]));
  }
  try {
    device.check(violation, n);
    FAIL() << "no GuardViolation";
  } catch (const GuardViolation& e) {
    EXPECT_EQ(e.what(), describe_guard(f, 1) + " (at point 701)");
  }
  Points silent = points;
  silent.status = nullptr, silent.y = nullptr, silent.jacobian = nullptr;
  EXPECT_EQ(device.run(Order::kValue, silent).point, 701u);
}

// Functions of the device's own are within its bounds: OpenCL allows sixteen units in the last place.
TEST(Device, OtherFunctionsAreTheDevices) {
  DYNTAPE_NEED_DEVICE;
  Function f;
  f.name = "elementary", f.inputs = {2, 0, 0};
  const NodeId x = f.graph.input(Block::kVariables, 0), y = f.graph.input(Block::kVariables, 1);
  for (int k = 0; k < kTableOps; ++k) {
    const auto op = static_cast<Op>(k);
    if (!is_exact(op)) f.outputs.push_back(f.graph.make(op, x, info(op).arity > 1 ? y : kNoNode, kNoNode));
  }
  ASSERT_GT(f.outputs.size(), 15u);
  const DeviceFunction device = DeviceFunction::make(f, with(Order::kValue));
  const std::vector<double> at = {0.7, 0.6};
  const auto found = device.evaluate(Order::kValue, 1, at).y;
  const auto expected = evaluate(f, at);
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (std::isnan(expected[i]))
      EXPECT_TRUE(std::isnan(found[i])) << i;
    else
      EXPECT_NEAR(found[i], expected[i], 16 * 2.3e-16 * std::abs(expected[i])) << i;
  }
}

TEST(Device, SingleHasTheBitsOfTheTapeInFloat) {
  DYNTAPE_NEED_DEVICE;
  Random random(76);
  const Function f = record("swing", 3, 1, [](const VectorXad& x, const VectorXad& p) {
    VectorXad y(2);
    y << sin(x[0]) * cos(x[0]) + x[1] * p[0] - 0.1 * x[2], sqrt(x[1] * x[1] + 0.5) / (2.0 + cos(3.0 * x[2]));
    return y;
  });
  const DeviceFunction device = DeviceFunction::make(f, with(Order::kValue), {.single = true});
  if (!device.device().divides_exactly) GTEST_SKIP() << "the device divides floats inexactly";
  for (int k = 0; k < 100; ++k) {
    const auto x = random.vector(3, -3, 3), p = random.vector(1, -3, 3);
    const auto expected =
        evaluate_as<float>(f, std::vector<float>(x.begin(), x.end()), std::vector<float>(p.begin(), p.end()));
    const auto found = device.evaluate(Order::kValue, 1, x, p).y;
    for (int i = 0; i < 2; ++i)
      ASSERT_EQ(static_cast<float>(found[i]), expected[i]) << "output " << i << " at " << k;
  }
}

TEST(Device, TheProgramIsKeptInTheCache) {
  DYNTAPE_NEED_DEVICE;
  std::string folder = (std::filesystem::temp_directory_path() / "device_cache_XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  CodegenOptions options = with(Order::kFirst);
  options.use_cache = true, options.cache_folder = folder;
  const std::vector<double> x = {0.5, 0.25}, p = {3.0};
  const DeviceFunction first = DeviceFunction::make(guarded(), options),
                       again = DeviceFunction::make(guarded(), options);
  EXPECT_FALSE(first.was_cached());
  EXPECT_TRUE(again.was_cached());
  EXPECT_EQ(first.evaluate(Order::kFirst, 1, x, p).jacobian, again.evaluate(Order::kFirst, 1, x, p).jacobian);
  const auto cache = codegen::Cache::open(folder);
  ASSERT_EQ(cache->list().size(), 1u);
  EXPECT_EQ(cache->list()[0].manifest.name, "guarded");
  // A program that the driver does not take is made again.
  const codegen::Entry entry = cache->list()[0];
  std::ifstream file(entry.folder + "/manifest.json");
  const auto json = nlohmann::json::parse(file);
  const codegen::Key key = codegen::make_key(json["key_text"].get<std::string>());
  std::ifstream source(entry.source());
  const std::string text{std::istreambuf_iterator<char>(source), {}}, nonsense = "no program";
  codegen::write_file(entry.library(), nonsense);
  codegen::write_file(entry.folder + "/manifest.json",
                      codegen::manifest_text(key, entry.manifest, nonsense, text));
  const DeviceFunction mended = DeviceFunction::make(guarded(), options);
  EXPECT_FALSE(mended.was_cached());
  EXPECT_EQ(mended.evaluate(Order::kFirst, 1, x, p).jacobian,
            first.evaluate(Order::kFirst, 1, x, p).jacobian);
  std::filesystem::remove_all(folder);
}

std::string told(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& e) {
    return e.what();
  }
  return "nothing was thrown";
}

TEST(DeviceErrors, TheLoader) {
  EXPECT_EQ(told([] { codegen::opencl::load("libnowhere.so.7"); }).substr(0, 52),
            "OpenCL: the loader libnowhere.so.7 cannot be opened;");
  const std::string other = told([] { codegen::opencl::load("libm.so.6"); });
  EXPECT_EQ(other, "OpenCL: libm.so.6 has no function clGetPlatformIDs; expected a loader of OpenCL");
}

TEST(DeviceErrors, Names) {
  for (const std::string device : {"cuda:0", "opencl", "opencl:", "opencl:x", "opencl:0x", "", "opencl:-1"})
    EXPECT_EQ(told([&] { DeviceFunction::make(guarded(), with(Order::kValue), {.device = device}); }),
              "device \"" + device + "\": expected opencl: and a number, as in opencl:0");
  DYNTAPE_NEED_DEVICE;
  const std::string far =
      told([&] { DeviceFunction::make(guarded(), with(Order::kValue), {.device = "opencl:77"}); });
  EXPECT_EQ(far.substr(0, 55), "OpenCL: there is no device opencl:77; expected opencl:0");
}

TEST(DeviceErrors, OrdersSizesFunctionsAndLayouts) {
  DYNTAPE_NEED_DEVICE;
  const DeviceFunction f = DeviceFunction::make(guarded(), with(Order::kValue));
  const std::vector<double> x(4, 0.5), p = {1.0};
  EXPECT_EQ(told([&] { f.evaluate(Order::kFirst, 2, x, p); }),
            "\"guarded\" was made for order 0 on a device and is evaluated for order 1; make it with "
            "options.order = 1");
  EXPECT_EQ(told([&] { f.evaluate(Order::kValue, 3, x, p); }),
            "evaluate: x has 4 entries, function \"guarded\" expects 6, 2 a state");
  EXPECT_EQ(told([&] { f.evaluate(Order::kValue, 2, x); }),
            "evaluate: p has 0 entries, function \"guarded\" expects 2, 1 a state");
  EXPECT_EQ(told([&] { (void)f.run(Order::kValue, {.side_by_side = 4}); }),
            "run: \"guarded\" on a device takes state after state; got 4 side by side");
  CodegenOptions portable = with(Order::kValue);
  portable.functions = Functions::kPortable;
  EXPECT_EQ(
      told([&] { DeviceFunction::make(guarded(), portable); }),
      "text of \"guarded\" for a device has no library; expected functions sines or libm, got portable");
}

TEST(DeviceErrors, TheCompilersLog) {
  DYNTAPE_NEED_DEVICE;
  const std::string message = told([] {
    codegen::OpenClProgram(codegen::opencl_device(0),
                           {.text = "__kernel void f(__global double* x) { nonsense; }",
                            .kernels = {"f"},
                            .name = "f",
                            .use_cache = false});
  });
  EXPECT_NE(message.find("refuses the text of \"f\" (error -11): "), std::string::npos) << message;
  EXPECT_NE(message.find("nonsense"), std::string::npos) << message;
}

#ifdef CL_TARGET_OPENCL_VERSION
// The numbers that dyntape writes itself are those of the standard's header.
TEST(DeviceErrors, NumbersOfTheStandard) {
  namespace cl = codegen::opencl;
  EXPECT_EQ(cl::kSuccess, CL_SUCCESS);
  EXPECT_EQ(cl::kDeviceNotFound, CL_DEVICE_NOT_FOUND);
  EXPECT_EQ(cl::kNoMemory, CL_MEM_OBJECT_ALLOCATION_FAILURE);
  EXPECT_EQ(cl::kOutOfResources, CL_OUT_OF_RESOURCES);
  EXPECT_EQ(cl::kOutOfHostMemory, CL_OUT_OF_HOST_MEMORY);
  EXPECT_EQ(cl::kBuildFailure, CL_BUILD_PROGRAM_FAILURE);
  EXPECT_EQ(cl::kAllDevices, static_cast<cl::Bits>(CL_DEVICE_TYPE_ALL));
  EXPECT_EQ(cl::kIsCpu, static_cast<cl::Bits>(CL_DEVICE_TYPE_CPU));
  EXPECT_EQ(cl::kReadWrite, static_cast<cl::Bits>(CL_MEM_READ_WRITE));
  EXPECT_EQ(cl::kDividesExactly, static_cast<cl::Bits>(CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT));
  EXPECT_EQ(cl::kPlatformName, static_cast<cl::Uint>(CL_PLATFORM_NAME));
  EXPECT_EQ(cl::kDeviceType, static_cast<cl::Uint>(CL_DEVICE_TYPE));
  EXPECT_EQ(cl::kLargestBuffer, static_cast<cl::Uint>(CL_DEVICE_MAX_MEM_ALLOC_SIZE));
  EXPECT_EQ(cl::kSingleConfig, static_cast<cl::Uint>(CL_DEVICE_SINGLE_FP_CONFIG));
  EXPECT_EQ(cl::kDoubleConfig, static_cast<cl::Uint>(CL_DEVICE_DOUBLE_FP_CONFIG));
  EXPECT_EQ(cl::kMemoryBytes, static_cast<cl::Uint>(CL_DEVICE_GLOBAL_MEM_SIZE));
  EXPECT_EQ(cl::kDeviceName, static_cast<cl::Uint>(CL_DEVICE_NAME));
  EXPECT_EQ(cl::kDriverVersion, static_cast<cl::Uint>(CL_DRIVER_VERSION));
  EXPECT_EQ(cl::kBinarySizes, static_cast<cl::Uint>(CL_PROGRAM_BINARY_SIZES));
  EXPECT_EQ(cl::kBinaries, static_cast<cl::Uint>(CL_PROGRAM_BINARIES));
  EXPECT_EQ(cl::kBuildLog, static_cast<cl::Uint>(CL_PROGRAM_BUILD_LOG));
  EXPECT_EQ(cl::kLargestGroup, static_cast<cl::Uint>(CL_KERNEL_WORK_GROUP_SIZE));
  EXPECT_EQ(cl::kContextPlatform, CL_CONTEXT_PLATFORM);
}
#endif

// A device is not needed for its text.
TEST(DeviceText, SizesAndPlacesOfNonZeros) {
  const codegen::DeviceSource d =
      generate_device(guarded(), with(Order::kFirst), {.language = DeviceLanguage::kCuda});
  EXPECT_NE(d.source.text.find("DT_ENTRY void guarded_first_order(DT_GLOBAL const real* DT_RESTRICT x, "),
            std::string::npos);
  EXPECT_NE(d.source.text.find("__global__"), std::string::npos);
  EXPECT_EQ(d.source.text.find("__kernel"), std::string::npos);
  EXPECT_NE(d.source.header.find("#define GUARDED_JACOBIAN_NNZ 2"), std::string::npos);
  EXPECT_NE(d.source.header.find("guarded_jacobian_col[2] = {0, 1};"), std::string::npos);
  ASSERT_EQ(d.kernels.size(), 2u);
  EXPECT_EQ(d.kernels[1].name, "guarded_first_order");
  EXPECT_TRUE(d.kernels[1].is_guarded);
  EXPECT_EQ(d.kernels[1].outputs[1], 2u);
}

}  // namespace
}  // namespace dyntape::device_test
