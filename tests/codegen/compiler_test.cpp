// SPDX-License-Identifier: BSD-3-Clause
//
// The compiler stage: which flags, which compiler, and what happens when it is missing or fails.
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/build/compile.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/options/flags.h>
#include <dyntape/codegen/pipeline.h>
#include <dyntape/codegen/store/cache.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>

#include <chrono>
#include <cmath>
#include <filesystem>

#include "compilers.h"
#include "random_function.h"

namespace dyntape::compiler_test {
namespace {

using testing::fake_compiler;
using testing::Random;
using testing::Scratch;

Function trigonometric() {
  return record("trigonometric", 2, [](const VectorXad& x) {
    VectorXad y(4);
    // gcc pairs sin and cos of one argument, and turns these powers into products and roots, if it may.
    y << sin(x[0]), cos(x[0]), pow(x[0], 0.5), pow(x[0], x[1]);
    return y;
  });
}

CodegenOptions uncached() {
  CodegenOptions options;
  options.use_cache = false;
  options.route = Route::kCompiled;
  options.order = Order::kValue;
  return options;
}

TEST(Flags, ElementaryFunctionsAreTheOnesOfTheMathematicsLibrary) {
  Random random(41);
  SCOPED_TRACE(random.seed_text());
  for (const char* level : {"-O0", "-O2", "-O3"}) {
    CodegenOptions options = uncached();
    options.flags = {level};
    options.functions = Functions::kLibm;
    const CompiledFunction c = CompiledFunction::make(trigonometric(), options);
    CompiledFunction::Workspace workspace(c);
    for (int k = 0; k < 20000; ++k) {
      const double x[2] = {random.uniform(-100, 100), 2.0};
      double y[4];
      c.value(x, nullptr, y, workspace);
      const volatile double a = x[0], two = 2.0, half = 0.5;
      const double expected[4] = {std::sin(a), std::cos(a), std::pow(a, half), std::pow(a, two)};
      for (int i = 0; i < 4; ++i)
        ASSERT_TRUE(testing::same(y[i], expected[i])) << level << " output " << i << " at " << a;
    }
  }
}

TEST(Flags, EveryElementaryFunctionOfTheTableIsNamed) {
  const auto& flags = codegen::contract_flags();
  const auto has = [&](const std::string& flag) {
    return std::find(flags.begin(), flags.end(), flag) != flags.end();
  };
  for (const char* flag : {"-ffp-contract=off", "-fno-builtin-sin", "-fno-builtin-pow", "-fno-builtin-atan2",
                           "-fno-builtin-expm1"})
    EXPECT_TRUE(has(flag)) << flag;
  EXPECT_FALSE(has("-fno-builtin-sqrt"));
}

TEST(Flags, ThoseThatChangeResultsAreLeftOutAndSaidOnce) {
  const std::vector<std::string> given = {"-O3",
                                          "-g",
                                          "-march=native",
                                          "-mtune=native",
                                          "-ffast-math",
                                          "-DA=1",
                                          "-I",
                                          "/tmp",
                                          "-Ofast",
                                          "-funsafe-math-optimizations",
                                          "-mfpmath=387",
                                          "-Wall",
                                          "-Wl,-x",
                                          "-mabi=ms",
                                          "-mno-sse2",
                                          "-mlong-double-64",
                                          "-mavx2",
                                          "-Dsin=cos",
                                          "-Ddouble=float",
                                          "-D",
                                          "fma(a,b,c)=0",
                                          "-DF(x)=x",
                                          "-D",
                                          "B=2",
                                          "",
                                          "-I"};
  ::testing::internal::CaptureStderr();
  EXPECT_EQ(codegen::accepted_flags(given),
            (std::vector<std::string>{"-O3", "-g", "-march=native", "-mtune=native", "-DA=1", "-I", "/tmp",
                                      "-Wall", "-mavx2", "-D", "B=2"}));
  const std::string notice = ::testing::internal::GetCapturedStderr();
  for (const char* flag : {"-ffast-math", "-Ofast", "-funsafe-math-optimizations", "-mfpmath=387", "-Wl,-x",
                           "-mabi=ms", "-mno-sse2", "-mlong-double-64", "-Dsin=cos", "-Ddouble=float",
                           "-Dfma(a,b,c)=0", "-DF(x)=x", "-I is left out"})
    EXPECT_NE(notice.find(flag), std::string::npos) << flag;
  ::testing::internal::CaptureStderr();
  codegen::accepted_flags(given);
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(Flags, AcceptedOnesReachTheCompiler) {
  const Scratch scratch;
  CodegenOptions options = uncached();
  options.use_cache = true;
  options.cache_folder = scratch / "cache";
  options.flags = {"-g", "-ffast-math", "-march=no-such-processor"};
  EXPECT_THROW(CompiledFunction::make(trigonometric(), options), Error);
  options.flags = {"-g", "-ffast-math"};
  const CompiledFunction c = CompiledFunction::make(trigonometric(), options);
  const std::string library = std::filesystem::path(c.source_path()).parent_path() / "library.so";
  int error = 0;
  const std::string bytes = codegen::read_file(library, error).value();
  EXPECT_NE(bytes.find(".debug_info"), std::string::npos);
  // A debugger finds the source where it lies now, not where it was compiled.
  EXPECT_EQ(bytes.find("cache/build-"), std::string::npos);
}

TEST(MissingCompiler, IsSaidOnceAndDoneWithout) {
  CodegenOptions options = uncached();
  options.compiler = "/nowhere/else/cc";
  EXPECT_THROW(CompiledFunction::make(trigonometric(), options), ToolError);
  options.route = Route::kAutomatic;
  ::testing::internal::CaptureStderr();
  const CompiledFunction c = CompiledFunction::make(trigonometric(), options);
  EXPECT_NE(::testing::internal::GetCapturedStderr().find(
                "\"/nowhere/else/cc\" does not exist; functions are not compiled"),
            std::string::npos);
  EXPECT_EQ(c.route(), testing::without_compiler());
  EXPECT_EQ(c.evaluate(Order::kValue, {0.5, 2.0}).y, evaluate(trigonometric(), {0.5, 2.0}));
  ::testing::internal::CaptureStderr();
  CompiledFunction::make(trigonometric(), options);
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(MissingCompiler, NamedByTheEnvironment) {
  const std::string path = std::getenv("PATH");
  setenv("PATH", "/nowhere", 1);
  EXPECT_FALSE(codegen::find_compiler("", {}));
  setenv("PATH", path.c_str(), 1);
  setenv("DYNTAPE_CC", "/nowhere/cc", 1);
  EXPECT_FALSE(codegen::find_compiler("", {}));
  EXPECT_TRUE(codegen::find_compiler("gcc", {})) << "an option precedes the environment";
  unsetenv("DYNTAPE_CC");
  const auto compiler = codegen::find_compiler("", {});
  ASSERT_TRUE(compiler);
  EXPECT_NE(compiler->version.find("version"), std::string::npos);
  EXPECT_NE(compiler->identity.find("-m"), std::string::npos) << "processor features";
  EXPECT_EQ(compiler->identity.find(std::filesystem::current_path()), std::string::npos);
}

std::string message_of(const CodegenOptions& options, const Function& f = trigonometric()) {
  try {
    CompiledFunction::make(f, options);
  } catch (const ToolError& e) {
    return e.what();
  }
  return "no ToolError";
}

TEST(FailingCompiler, EverythingIsReported) {
  const Scratch scratch;
  CodegenOptions options = uncached();
  options.route = Route::kAutomatic;
  options.use_cache = true;
  options.cache_folder = scratch / "cache";
  options.compiler =
      fake_compiler(scratch, "for i in 1 2 3; do echo \"complaint $i\" >&2; done; echo spoken; exit 42");
  const std::string message = message_of(options);
  for (const char* part :
       {"exit status 42", "complaint 1\ncomplaint 2\ncomplaint 3", "spoken", "-ffp-contract=off", "fake-cc"})
    EXPECT_NE(message.find(part), std::string::npos) << part << "\n" << message;
  const std::size_t at = message.find("kept in ") + 8;
  const std::string source = message.substr(at, message.find('\n', at) - at);
  int error = 0;
  EXPECT_EQ(codegen::read_file(source, error), generate_source(trigonometric(), options).text);
  EXPECT_TRUE(codegen::Cache::open(scratch / "cache")->list().empty());
}

TEST(FailingCompiler, ThatTakesTooLongIsEnded) {
  const Scratch scratch;
  CodegenOptions options = uncached();
  options.compiler = fake_compiler(scratch, "sleep 60");
  options.compile_seconds = 0.3;
  const auto start = std::chrono::steady_clock::now();
  EXPECT_NE(message_of(options).find("was ended after"), std::string::npos);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
}

TEST(FailingCompiler, ThatTakesTooMuchMemoryFails) {
  CodegenOptions options = uncached();
  Random random(42);
  options.compile_bytes = std::size_t{40} << 20;
  EXPECT_NE(message_of(options, testing::random_functions(random, 300, 20)).find("the compiler ended with"),
            std::string::npos);
}

TEST(FailingCompiler, ForWantOfWhatTheTextDoesNotDecide) {
  const testing::Scratch scratch;
  for (const std::string want : {"Too many open files", "Resource temporarily unavailable"}) {
    CodegenOptions o;
    o.use_cache = false;
    o.compiler = testing::fake_compiler(scratch, "echo 'ld: " + want + "'; exit 1");
    const Function f = record("f", 1, [](const VectorXad& x) { return VectorXad(2.0 * x); });
    EXPECT_EQ(CompiledFunction::make(f, o).route(), testing::without_compiler()) << want;
    o.route = Route::kCompiled;
    EXPECT_THROW(CompiledFunction::make(f, o), ToolError) << want;
  }
}

TEST(FailingCompiler, ThatWritesNoLibrary) {
  const Scratch scratch;
  CodegenOptions options = uncached();
  options.compiler = fake_compiler(scratch, "exit 0");
  EXPECT_NE(message_of(options).find("cannot be used"), std::string::npos);
  options.compiler =
      fake_compiler(scratch, "while [ $# -gt 1 ]; do [ \"$1\" = -o ] && echo nonsense > \"$2\"; shift; done");
  EXPECT_NE(message_of(options).find("cannot be used"), std::string::npos);
}

TEST(Compiler, PiecesOfOneFileCompileInParallel) {
  Random random(43);
  SCOPED_TRACE(random.seed_text());
  const Function f = testing::random_functions(random, 300, 12);
  CodegenOptions options = uncached();
  options.piece_statements = 100;
  options.jobs = 3;
  const CompiledFunction c = CompiledFunction::make(f, options);
  for (int k = 0; k < 20; ++k) {
    const auto x = testing::random_arguments(random, f.n_x()), p = testing::random_arguments(random, f.n_p());
    const auto found = c.evaluate(Order::kValue, x, p).y, expected = evaluate(f, x, p);
    for (std::size_t i = 0; i < found.size(); ++i) ASSERT_TRUE(testing::same(found[i], expected[i])) << i;
  }
}

// A compiler that would write a file after a second.
TEST(Compiler, EndsWithItsHost) {
  const Scratch scratch;
  const std::string started = scratch / "started", late = scratch / "late";
  CodegenOptions options = uncached();
  options.compiler = fake_compiler(scratch, "sh -c 'touch " + started + "; sleep 1; touch " + late + "'");
  const pid_t host = fork();
  if (host == 0) {
    message_of(options);
    _exit(0);
  }
  while (access(started.c_str(), F_OK) != 0) usleep(1000);
  kill(host, SIGKILL);
  waitpid(host, nullptr, 0);
  usleep(1500000);
  EXPECT_NE(access(late.c_str(), F_OK), 0);
}

TEST(Compiler, HostsThatIgnoreTheirChildren) {
  const auto before = signal(SIGCHLD, SIG_IGN);
  {
    const Scratch scratch;
    CodegenOptions options = uncached();
    options.compiler = fake_compiler(scratch, "echo 'what is wrong'; exit 3");
    EXPECT_NE(message_of(options).find("what is wrong"), std::string::npos) << "its words are not lost";
  }
  const CompiledFunction c = CompiledFunction::make(trigonometric(), uncached());
  EXPECT_EQ(c.evaluate(Order::kValue, {0.5, 2.0}).y, evaluate(trigonometric(), {0.5, 2.0}));
  signal(SIGCHLD, before);
}

TEST(Compiler, ClangGivesTheSameBits) {
  if (codegen::in_path("clang").empty()) GTEST_SKIP() << "clang is not installed";
  Random random(44);
  SCOPED_TRACE(random.seed_text());
  const Function f = testing::random_functions(random, 100, 12);
  CodegenOptions options = uncached();
  options.compiler = "clang";
  options.flags = {"-O2"};
  const CompiledFunction c = CompiledFunction::make(f, options);
  for (int k = 0; k < 100; ++k) {
    const auto x = testing::random_arguments(random, f.n_x()), p = testing::random_arguments(random, f.n_p());
    const auto found = c.evaluate(Order::kValue, x, p).y, expected = evaluate(f, x, p);
    for (std::size_t i = 0; i < found.size(); ++i) ASSERT_TRUE(testing::same(found[i], expected[i])) << i;
  }
}

}  // namespace
}  // namespace dyntape::compiler_test
