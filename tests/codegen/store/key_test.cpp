// SPDX-License-Identifier: BSD-3-Clause
//
// What decides a library enters its key: each ingredient is changed alone, through the whole pipeline.
#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <functional>

#include "codegen/compilers.h"

namespace dyntape::key_test {
namespace {

using testing::Scratch;

VectorXad one(const AD& x) { return VectorXad::Constant(1, x); }

// A kernel by hand, all of which can be chosen.
struct Recipe {
  double value = 2, jvp = 2, vjp = 2, second = 0;
  std::string name = "kernel", comment, lanes = "";
  Pattern pattern;
  std::size_t operations = 1;
  bool is_recorded = false, dissolves = false, is_inner = false;
};

std::shared_ptr<const Callee> slope_of(double slope, double second, bool is_reverse) {
  const auto value = recorded_callee(record(
      is_reverse ? "vjp" : "jvp", 2, [slope](const VectorXad& v) { return one(slope * v[1] + 0 * v[0]); }));
  if (!is_reverse) return value;
  auto adjoints = std::make_shared<Callee>(*value);
  adjoints->jvp = [second] {  // (x, w, dx, dw) -> tangents of the adjoint of x
    return recorded_callee(
        record("vjp_jvp", 4, [second](const VectorXad& v) { return one(second * v[2] * v[1]); }));
  };
  return adjoints;
}

std::shared_ptr<const Callee> kernel(const Recipe& r) {
  std::variant<Kernel, Recorded> body;
  if (r.is_recorded) {
    const Function f = record("kernel", 1, [&r](const VectorXad& x) { return one(r.value * x[0]); });
    body = (r.dissolves ? dissolving_callee(f) : recorded_callee(f))->body;
  } else {
    Kernel& kernel = std::get<Kernel>(body);
    kernel.evaluate = [value = r.value](const double* in, double* out) { out[0] = value * in[0]; };
    kernel.c_body = r.comment + "out[0] = " + std::to_string(r.value) + " * in[0];\n";
    kernel.c_body_of_lanes = r.lanes;
    kernel.operations = {{Op::Mul, r.operations}};
  }
  auto callee = std::make_shared<Callee>(r.name, 1, 1, body);
  callee->pattern = r.pattern;
  callee->jvp = [r] { return slope_of(r.jvp, 0, false); };
  callee->vjp = [r] { return slope_of(r.vjp, r.second, true); };
  return callee;
}

Function calling(const Recipe& r) {
  auto callee = kernel(r);
  if (r.is_inner)  // a kernel inside a recorded callee, whose derivatives follow from it
    callee = recorded_callee(record("outer", 1, [&](const VectorXad& x) { return call(callee, x); }));
  return record("f", 1, [&](const VectorXad& x) { return VectorXad(5 * call(callee, x)); });
}

class LibraryKey : public ::testing::Test {
 protected:
  CodegenOptions options() const {
    CodegenOptions o;
    o.order = Order::kSecond;
    o.route = Route::kCompiled;
    o.cache_folder = scratch_ / "cache";
    return o;
  }
  bool is_hit(const Recipe& r, const CodegenOptions& o) const {
    return CompiledFunction::make(calling(r), o).timings().cache_hit;
  }
  bool is_hit(const Recipe& r) const { return is_hit(r, options()); }

  // The base is there; the changed one is not, until it was made.
  void expect_another(const Recipe& base, const Recipe& changed, const char* what) const {
    is_hit(base);
    EXPECT_TRUE(is_hit(base)) << what;
    EXPECT_FALSE(is_hit(changed)) << what;
    EXPECT_TRUE(is_hit(changed)) << what;
  }
  Scratch scratch_;
};

TEST_F(LibraryKey, ASlopeThatIsCorrectedIsServedCorrected) {
  for (const double slope : {3.0, 2.0}) {
    Recipe r;
    r.jvp = r.vjp = slope;
    CodegenOptions o = options();
    o.order = Order::kFirst;
    const auto f = CompiledFunction::make(calling(r), o);
    EXPECT_EQ(f.evaluate(Order::kFirst, {1.0}).jacobian, std::vector<double>{5 * slope});
  }
}

TEST_F(LibraryKey, EveryPartOfAKernel) {
  const std::vector<std::pair<const char*, std::function<void(Recipe&)>>> changes = {
      {"value", [](Recipe& r) { r.value = 3; }},
      {"body", [](Recipe& r) { r.comment = "/* another */ "; }},
      {"jvp", [](Recipe& r) { r.jvp = 3; }},
      {"vjp", [](Recipe& r) { r.vjp = 3; }},
      {"second derivative", [](Recipe& r) { r.second = 1; }},
      {"pattern",
       [](Recipe& r) {
         r.pattern = {1, 1, {}, {}};
       }},
      {"dense pattern",
       [](Recipe& r) {
         r.pattern = {1, 1, {0}, {0}};
       }},
      {"operations", [](Recipe& r) { r.operations = 2; }},
      {"body of lanes", [](Recipe& r) { r.lanes = "out[0] = in[0] + in[0];\n"; }},
      {"name", [](Recipe& r) { r.name = "other"; }},  // a body may call itself
  };
  for (const auto& [what, change] : changes) {
    Recipe r;
    change(r);
    expect_another({}, r, what);
  }
}

TEST_F(LibraryKey, DerivativesOfCalleesWithinCallees) {
  Recipe base, changed;
  base.is_inner = changed.is_inner = true;
  changed.jvp = 3;
  expect_another(base, changed, "jvp of a kernel inside a recorded callee");
  changed = base;
  changed.second = 1;
  expect_another(base, changed, "second derivative of a kernel inside a recorded callee");
}

TEST_F(LibraryKey, WhatARecordedCalleeBringsAlong) {
  Recipe base;
  base.is_recorded = true;
  for (const auto& [what, change] : std::vector<std::pair<const char*, std::function<void(Recipe&)>>>{
           {"jvp", [](Recipe& r) { r.jvp = 3; }},
           {"vjp", [](Recipe& r) { r.vjp = 3; }},
           {"dissolving", [](Recipe& r) { r.dissolves = true; }}}) {
    Recipe r = base;
    change(r);
    expect_another(base, r, what);
  }
}

// What is not asked for is not made.
TEST_F(LibraryKey, DerivativesThatAreNotNeededAreNotMade) {
  auto made = std::make_shared<int>(0);
  auto callee = std::make_shared<Callee>(*kernel({}));
  callee->jvp = [made, jvp = callee->jvp] { return ++*made, jvp(); };
  callee->vjp = [made, vjp = callee->vjp] { return ++*made, vjp(); };
  const Function f = record("f", 1, [&](const VectorXad& x) { return call(callee, x); });
  CodegenOptions o = options();
  o.order = Order::kValue;
  CompiledFunction::make(f, o);
  EXPECT_EQ(*made, 0);
}

TEST(Callees, ACopyHasItsOwnDerivatives) {
  const auto original = kernel({});
  const auto held = jvp_callee(original);
  auto copy = std::make_shared<Callee>(*original);
  copy->jvp = [] { return slope_of(7, 0, false); };
  EXPECT_EQ(evaluate(*jvp_callee(copy)->recorded()->function, {1, 1})[0], 7);
  EXPECT_EQ(jvp_callee(original), held);
}

// --- the compiler and its surroundings ---

// Headers of one's own that say something else than the system's.
std::string folder_with_math(const Scratch& scratch, const std::string& name, const std::string& text) {
  const std::string folder = scratch / name;
  mkdir(folder.c_str(), 0700);
  codegen::write_file(folder + "/math.h", text);
  return folder;
}

constexpr char kOtherSine[] = "#include_next <math.h>\n#define sin(x) (cos(x))\n";

std::vector<double> sine(CodegenOptions o, bool* is_hit = nullptr) {
  o.functions = Functions::kLibm;
  const Function f = record("sine", 1, [](const VectorXad& x) { return one(sin(x[0])); });
  const auto c = CompiledFunction::make(f, o);
  if (is_hit) *is_hit = c.timings().cache_hit;
  return c.evaluate(Order::kValue, {0.5}).y;
}

TEST_F(LibraryKey, TheEnvironmentReachesNoCompiler) {
  const std::string folder = folder_with_math(scratch_, "headers", kOtherSine);
  for (const char* name : {"CPATH", "C_INCLUDE_PATH", "GCC_EXEC_PREFIX", "COMPILER_PATH", "LD_PRELOAD",
                           "LD_LIBRARY_PATH", "CCC_OVERRIDE_OPTIONS"}) {
    setenv(name, folder.c_str(), 1);
    CodegenOptions o = options();
    o.force_rebuild = true;
    const auto found = sine(o);
    unsetenv(name);
    EXPECT_EQ(found, std::vector<double>{std::sin(0.5)}) << name;
  }
}

TEST_F(LibraryKey, AHeaderThatChangesIsNoHit) {
  const std::string folder = folder_with_math(scratch_, "headers", kOtherSine);
  CodegenOptions o = options();
  o.flags = {"-I" + folder};
  bool is_hit = true;
  EXPECT_EQ(sine(o, &is_hit), std::vector<double>{std::cos(0.5)});
  EXPECT_EQ(sine(o, &is_hit), std::vector<double>{std::cos(0.5)});
  EXPECT_TRUE(is_hit);
  codegen::write_file(folder + "/math.h", "#include_next <math.h>\n#define sin(x) (tan(x))\n");
  EXPECT_EQ(sine(o, &is_hit), std::vector<double>{std::tan(0.5)});
  EXPECT_FALSE(is_hit);
  codegen::write_file(folder + "/math.h", kOtherSine);  // the same text again, another file
  EXPECT_EQ(sine(o, &is_hit), std::vector<double>{std::cos(0.5)});
  EXPECT_TRUE(is_hit);
  unlink((folder + "/math.h").c_str());
  EXPECT_EQ(sine(o), std::vector<double>{std::sin(0.5)});
}

TEST_F(LibraryKey, AHeaderThatComesBeforeAnotherIsSeen) {
  const std::string folder = scratch_ / "empty";
  mkdir(folder.c_str(), 0700);
  CodegenOptions o = options();
  o.flags = {"-I" + folder};
  EXPECT_EQ(sine(o), std::vector<double>{std::sin(0.5)});
  folder_with_math(scratch_, "empty", kOtherSine);
  EXPECT_EQ(sine(o), std::vector<double>{std::cos(0.5)});
}

TEST_F(LibraryKey, ABodyIncludesNothing) {
  Recipe r;
  r.comment = "\n#include \"table.h\"\n";
  try {
    is_hit(r);
    ADD_FAILURE() << "no error";
  } catch (const ArgumentError& e) {
    EXPECT_NE(std::string(e.what()).find("#include \"table.h\""), std::string::npos) << e.what();
  }
}

TEST_F(LibraryKey, AWrapperThatTurnsIntoAnotherCompilerIsNoHit) {
  if (codegen::in_path("gcc").empty() || codegen::in_path("clang").empty())
    GTEST_SKIP() << "gcc and clang are needed";
  const std::string chosen = scratch_ / "chosen", wrapper = scratch_ / "wrapper";
  codegen::write_file(wrapper, "#!/bin/sh\nread name < " + chosen + "\nexec $name \"$@\"\n");
  chmod(wrapper.c_str(), 0700);
  CodegenOptions o = options();
  o.compiler = wrapper;
  bool is_hit = true;
  for (const char* name : {"gcc\n", "clang\n"}) {
    codegen::write_file(chosen, name);
    sine(o, &is_hit);
    EXPECT_FALSE(is_hit) << name;
    sine(o, &is_hit);
    EXPECT_TRUE(is_hit) << name;
  }
}

TEST_F(LibraryKey, ARecordOfTheCompilerWithAWrongFieldIsWrittenAnew) {
  CodegenOptions o = options();
  o.flags = {"-DRECORD=1"};  // of no other test: this process does not know its compiler
  const auto f = [&] {
    return testing::in_child([&] { return CompiledFunction::make(calling({}), o).timings().cache_hit; });
  };
  EXPECT_EQ(f(), 0);
  std::string record;
  for (const std::string& name : codegen::names_in(scratch_ / "cache")) {
    if (name.starts_with("compiler-")) record = (scratch_ / "cache/") + name;
  }
  ASSERT_FALSE(record.empty());
  int error = 0;
  const std::string sound = codegen::read_file(record, error).value();
  for (const std::string field : {"identity", "version", "what", "signatures"}) {
    std::string text = sound;
    text.replace(text.find("\"" + field + "\":"), field.size() + 3, "\"" + field + "\": 3, \"x\":");
    codegen::write_file(record, text);
    EXPECT_EQ(f(), 1) << field << ": a hit";
    EXPECT_EQ(codegen::read_file(record, error), sound) << field;
  }
  unlink(record.c_str());
  ASSERT_EQ(mkfifo(record.c_str(), 0600), 0);
  EXPECT_EQ(f(), 1) << "a FIFO in its place";
}

}  // namespace
}  // namespace dyntape::key_test
