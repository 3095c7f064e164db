// SPDX-License-Identifier: BSD-3-Clause
//
// Libraries in a process: many at once, replaced on disk, unloaded in any order; what loading leaves alone.
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/pipeline.h>
#include <dyntape/codegen/store/cache.h>
#include <dyntape/codegen/store/library.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "compilers.h"
#include "random_function.h"
#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

namespace dyntape::loading_test {
namespace {

namespace fs = std::filesystem;
using codegen::Library;
using testing::Random;
using testing::Scratch;

Function scaled(double c) {
  return record("scaled", 2,
                [c](const VectorXad& x) { return VectorXad::Constant(1, c * sin(x[0]) * x[1]).eval(); });
}

CompiledFunction compiled(const Function& f, const std::string& cache = "", bool force = false) {
  CodegenOptions options;
  options.route = Route::kCompiled;
  options.use_cache = !cache.empty();
  options.cache_folder = cache;
  options.force_rebuild = force;
  return CompiledFunction::make(f, options);
}

std::vector<double> value(const CompiledFunction& f, const std::vector<double>& x) {
  return f.evaluate(Order::kValue, x).y;
}

#if defined(__SSE2__)
TEST(Loading, LeavesTheFloatingPointStateAlone) {
  const unsigned usual = _mm_getcsr() & ~0x3fu;
  for (const unsigned state : {usual, usual | 0x8000u, usual | 0x2000u}) {  // flush to zero; round downwards
    _mm_setcsr(state);
    const CompiledFunction c = compiled(scaled(2));
    EXPECT_EQ(_mm_getcsr() & ~0x3fu, state);
    std::thread([&] { EXPECT_EQ(_mm_getcsr() & ~0x3fu, state); }).join();
  }
  _mm_setcsr(usual);
}
#endif

TEST(Loading, TwoLibrariesAtOnceAndCopiesOutliveTheOriginal) {
  auto a = std::make_unique<CompiledFunction>(compiled(scaled(2)));
  const CompiledFunction copy = *a, b = compiled(scaled(3));
  a.reset();
  EXPECT_EQ(value(copy, {1, 2}), evaluate(scaled(2), {1, 2}));
  EXPECT_EQ(value(b, {1, 2}), evaluate(scaled(3), {1, 2}));
}

TEST(Loading, Case115_WhatIsLoadedStaysWhateverLiesOnDisk) {
  const Scratch scratch;
  const std::string folder = scratch / "cache";
  const CompiledFunction first = compiled(scaled(2), folder);
  const auto expected = evaluate(scaled(2), {0.7, 3});
  const auto entry = codegen::Cache::open(folder)->list().at(0);

  const CompiledFunction again = compiled(scaled(2), folder, true);  // published over the entry
  EXPECT_EQ(value(first, {0.7, 3}), expected);
  fs::remove(entry.library());
  codegen::write_file(entry.library(), "not a library");
  EXPECT_EQ(value(first, {0.7, 3}), expected);
  EXPECT_EQ(value(again, {0.7, 3}), expected);
  fs::remove_all(folder);
  EXPECT_EQ(value(first, {0.7, 3}), expected);
  EXPECT_EQ(value(compiled(scaled(2), folder), {0.7, 3}), expected);
}

TEST(Loading, Case115_FiveHundredLibrariesInAnyOrder) {
  Random random(7);
  SCOPED_TRACE(random.seed_text());
  const Scratch scratch;
  const Function f = scaled(2);
  compiled(f, scratch / "cache");
  const std::string library = codegen::Cache::open(scratch / "cache")->list().at(0).library();
  const std::string content = content_hash(compact(f));

  std::vector<std::shared_ptr<const Library>> loaded;
  for (int i = 0; i < 500; ++i) {
    const std::string copy = scratch / (std::to_string(i) + ".so");
    fs::copy_file(library, copy);
    loaded.push_back(Library::load(copy, content));
  }
  const std::vector<double> x = {0.7, 3}, expected = evaluate(f, x);
  while (!loaded.empty()) {
    const auto& any = loaded[random.below(loaded.size())];
    std::vector<double> work(any->descriptor().kernels[0].work), y(1);
    any->descriptor().kernels[0].run(x.data(), nullptr, nullptr, y.data(), nullptr, nullptr, work.data(), 1,
                                     nullptr, nullptr);
    ASSERT_EQ(y, expected);
    loaded.erase(loaded.begin() + static_cast<std::ptrdiff_t>(random.below(loaded.size())));
  }
}

// The descriptor of another version has other fields: it is refused before a field behind the number is read.
TEST(Loading, ALibraryOfAnotherInterfaceIsRefused) {
  const Scratch scratch;
  const Function f = compact(scaled(2));
  const std::string content = content_hash(f), text = generate_source(f, {}).text;
  const auto load = [&](int number) {
    const std::string source = scratch / (std::to_string(number) + ".c"), library = source + ".so";
    const std::string own = "#define DYNTAPE_ABI " + std::to_string(DYNTAPE_ABI) + "\n";
    const std::size_t at = text.find(own);
    EXPECT_NE(at, std::string::npos);
    codegen::write_file(source, std::string(text).replace(
                                    at, own.size(), "#define DYNTAPE_ABI " + std::to_string(number) + "\n"));
    EXPECT_EQ(testing::output_of({codegen::in_path("cc"), "-shared", "-fPIC", source, "-o", library, "-lm"},
                                 scratch),
              "");
    return Library::load(library, content);
  };
  EXPECT_NE(load(DYNTAPE_ABI), nullptr);
  try {
    load(DYNTAPE_ABI - 1);
    FAIL() << "loaded";
  } catch (const ToolError& e) {
    EXPECT_NE(std::string(e.what()).find("its interface is number " + std::to_string(DYNTAPE_ABI - 1) +
                                         ", this program's is number " + std::to_string(DYNTAPE_ABI)),
              std::string::npos)
        << e.what();
  }
}

}  // namespace
}  // namespace dyntape::loading_test
