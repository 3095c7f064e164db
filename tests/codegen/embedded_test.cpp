// SPDX-License-Identifier: BSD-3-Clause
//
// Embedded text: what compilers say of it, its results against the interpreter's, what it links against, its
// stack.
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/build/stack_usage.h>
#include <dyntape/codegen/compiled_function.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <sstream>

#include "calls.h"
#include "embedded_text.h"
#include "random_function.h"

namespace dyntape::embedded_test {
namespace {

using codegen::EmbeddedOptions;
using codegen::EmbeddedSource;
using testing::EmbeddedLibrary;
using testing::Random;
using testing::Scratch;

CodegenOptions with(Order order, std::size_t piece_statements = 250,
                    Functions functions = kDefaultFunctions) {
  CodegenOptions options;
  options.order = order;
  options.route = Route::kInterpreter;
  options.piece_statements = piece_statements;
  options.functions = functions;
  return options;
}

EmbeddedOptions in(bool single) {
  EmbeddedOptions how;
  how.single = single;
  return how;
}

// A double pendulum's energy-like function: parameters, a sparse Hessian, sin and cos.
Function swing() {
  return record("swing", 4, 2, [](const VectorXad& x, const VectorXad& p) {
    VectorXad y(2);
    y[0] = p[0] * sin(x[0]) * x[2] * x[2] + cos(x[0] - x[1]) / (1.5 + x[3] * x[3]);
    y[1] = sqrt(1.0 + x[2] * x[2]) * p[1] - sin(x[1]);
    return y;
  });
}

Function guarded() {
  Function f = swing();
  const NodeId zero = f.graph.constant(0);
  for (std::uint32_t i : {2u, 3u})
    f.guards.push_back(
        {f.graph.make(Op::Lt, zero, f.graph.input(Block::kVariables, i)), true, "swing.cpp", 40 + int(i)});
  return f;
}

TEST(Embedded, PleasesCompilersFreestandingAndAsCpp) {
  Random random(41);
  SCOPED_TRACE(random.seed_text());
  const Function all = testing::random_functions(random, 30, 10);
  const Function calls = testing::with_calls(testing::kepler());
  Function nothing, constant;
  nothing.name = constant.name = "";
  constant.outputs.push_back(constant.graph.constant(-0.5));
  const auto text = [](const Function& f, Order order, bool single, bool own) {
    const Functions functions = own ? Functions::kSines : Functions::kLibm;
    const codegen::Source source = generate_embedded(f, with(order, 50, functions), in(single)).source;
    return source.header + source.header + source.text;
  };
  std::vector<std::string> doubles = {text(all, Order::kValue, false, false),
                                      text(calls, Order::kFirst, false, true),
                                      text(calls, Order::kFirst, true, true)};  // its kernel stays in double
  std::vector<std::string> floats = {text(all, Order::kValue, true, true),
                                     text(guarded(), Order::kSecond, true, false)};
  for (const Function& f : {nothing, constant}) floats.push_back(text(f, Order::kSecond, true, true));
  doubles.push_back(text(guarded(), Order::kSecond, false, true));
  testing::expect_compiles_cleanly(doubles, {"-ffreestanding"});
  testing::expect_compiles_cleanly(floats, {"-ffreestanding", "-Wdouble-promotion"});
}

void expect_interpreted_bits(const Function& f, std::size_t piece_statements,
                             const std::vector<std::string>& flags, bool is_wild) {
  const CodegenOptions options = with(Order::kSecond, piece_statements);
  const EmbeddedLibrary library(generate_embedded(f, options), flags);
  const CompiledFunction interpreted = CompiledFunction::make(f, options);
  Random random(42);
  SCOPED_TRACE(random.seed_text());
  for (int k = 0; k < 40; ++k) {
    const auto draw = [&](std::size_t n) {
      return is_wild ? testing::random_arguments(random, n) : random.vector(n, -1, 1);
    };
    const auto x = draw(f.n_x()), p = draw(f.n_p()), w = draw(f.n_w() + f.n_y());
    const auto expected = interpreted.evaluate(Order::kSecond, x, p, w);
    std::vector<double> y(expected.y.size()), j(expected.jacobian.size()), h(expected.hessian.size());
    const std::string name = f.name + "_";
    if (f.n_p()) {
      library.call<void>(name + "second_order", x.data(), p.data(), w.data(), y.data(), j.data(), h.data());
    } else {
      library.call<void>(name + "second_order", x.data(), w.data(), y.data(), j.data(), h.data());
    }
    for (std::size_t i = 0; i < y.size(); ++i) EXPECT_TRUE(testing::same(y[i], expected.y[i]));
    for (std::size_t i = 0; i < j.size(); ++i) EXPECT_TRUE(testing::same(j[i], expected.jacobian[i]));
    for (std::size_t i = 0; i < h.size(); ++i) EXPECT_TRUE(testing::same(h[i], expected.hessian[i]));
    std::vector<double> value(y.size());
    if (f.n_p()) {
      library.call<void>(name + "value", x.data(), p.data(), value.data());
    } else {
      library.call<void>(name + "value", x.data(), value.data());
    }
    for (std::size_t i = 0; i < y.size(); ++i) EXPECT_TRUE(testing::same(value[i], y[i]));
    if (::testing::Test::HasFailure()) return;
  }
}

TEST(Embedded, EqualsTheInterpreterBitForBit) {
  Random random(43);
  SCOPED_TRACE(random.seed_text());
  const Function all = testing::random_functions(random, 30, 10);
  expect_interpreted_bits(all, 250, {"-O2"}, true);
  expect_interpreted_bits(all, 40, {"-O0", "-DDYNTAPE_WORK="}, true);
  const Function calls = testing::with_calls(testing::kepler());
  expect_interpreted_bits(calls, 250, {"-O2"}, false);
  expect_interpreted_bits(calls, 6, {"-O3"}, false);
}

TEST(Embedded, SingleEqualsTheTapeInFloatBitForBit) {
  Random random(44);
  SCOPED_TRACE(random.seed_text());
  const Function f = swing();
  const EmbeddedLibrary own(generate_embedded(f, with(Order::kValue), in(true)));
  const EmbeddedLibrary libm(generate_embedded(f, with(Order::kValue, 250, Functions::kLibm), in(true)));
  for (int k = 0; k < 200; ++k) {
    std::vector<float> x(4), p(2), y(2), z(2);
    for (auto* block : {&x, &p}) {
      for (float& v : *block) v = static_cast<float>(random.uniform(-3, 3));
    }
    const std::vector<float> expected = evaluate_as<float>(f, x, p);
    own.call<void>("swing_value", std::as_const(x).data(), std::as_const(p).data(), y.data());
    libm.call<void>("swing_value", std::as_const(x).data(), std::as_const(p).data(), z.data());
    EXPECT_EQ(y, expected);
    for (int i = 0; i < 2; ++i) EXPECT_NEAR(z[i], expected[i], 5e-6) << "sizes of terms are below thirty";
  }
}

TEST(Embedded, ReportsTheFirstViolatedGuard) {
  const EmbeddedLibrary library(generate_embedded(guarded(), with(Order::kValue)));
  const std::vector<double> p = {1, 1};
  const auto status = [&](std::vector<double> x) {
    std::vector<double> y(2);
    return library.call<unsigned>("swing_value", std::as_const(x).data(), p.data(), y.data());
  };
  EXPECT_EQ(status({0, 0, 1, 1}), 0u);
  EXPECT_EQ(status({0, 0, -1, 1}), 1u);
  EXPECT_EQ(status({0, 0, 1, -1}), 2u);
  EXPECT_EQ(status({0, 0, -1, -1}), 1u);
}

TEST(Embedded, TablesAreThePatterns) {
  const Function f = swing();
  const EmbeddedLibrary library(generate_embedded(f, with(Order::kSecond)));
  const CompiledFunction c = CompiledFunction::make(f, with(Order::kSecond));
  for (const auto& [name, pattern] :
       {std::pair("jacobian", c.jacobian_pattern()), std::pair("hessian", c.hessian_pattern())}) {
    const auto* row = library.table<unsigned short>(std::string("swing_") + name + "_row");
    const auto* col = library.table<unsigned short>(std::string("swing_") + name + "_col");
    for (std::size_t k = 0; k < pattern.nnz(); ++k) {
      EXPECT_EQ(row[k], pattern.row[k]);
      EXPECT_EQ(col[k], pattern.col[k]);
    }
  }
}

// A program of one's own: it links against the C library and libm, and prints the library's bits.
TEST(Embedded, StandaloneProgramNeedsLibcAndLibmOnly) {
  const Function f = swing();
  for (const Functions functions : {Functions::kSines, Functions::kLibm}) {
    const Scratch folder;
    const CodegenOptions options = with(Order::kFirst, 250, functions);
    const auto e = generate_embedded(f, options);
    write_source(e.source, folder.path());
    codegen::write_file(
        folder / "main.c",
        "#include <stdio.h>\n#include \"swing.h\"\nint main(void) {\n"
        "  const double x[4] = {0.5, -0.25, 1.5, 2.0}, p[2] = {0.75, 1.25};\n"
        "  double y[2], j[sizeof swing_jacobian_row / sizeof *swing_jacobian_row];\n  unsigned i;\n"
        "  swing_first_order(x, p, y, j);\n"
        "  for (i = 0; i < 2; ++i) printf(\"%a\\n\", y[i]);\n"
        "  for (i = 0; i < sizeof j / sizeof *j; ++i) printf(\"%a\\n\", j[i]);\n  return 0;\n}\n");
    std::vector<std::string> words = {codegen::in_path("gcc"), "-std=c99", "-O2", "-Wall", "-Werror"};
    words.insert(words.end(), codegen::contract_flags().begin(), codegen::contract_flags().end());
    for (const char* file : {"main.c", "swing.c"}) words.push_back(folder / file);
    for (const std::string& last : {std::string("-o"), folder / "main", std::string("-lm")})
      words.push_back(last);
    ASSERT_EQ(testing::output_of(words, folder), "");

    std::istringstream lines(
        testing::output_of({codegen::in_path("readelf"), "-d", folder / "main"}, folder));
    std::set<std::string> libraries;
    for (std::string line; std::getline(lines, line);) {
      if (line.find("(NEEDED)") != std::string::npos) libraries.insert(line.substr(line.find('[')));
    }
    libraries.erase("[libm.so.6]");  // if a function of it is called
    EXPECT_EQ(libraries, std::set<std::string>{"[libc.so.6]"});
    const auto expected =
        CompiledFunction::make(f, options).evaluate(Order::kFirst, {0.5, -0.25, 1.5, 2}, {0.75, 1.25});
    std::vector<double> numbers = expected.y;
    numbers.insert(numbers.end(), expected.jacobian.begin(), expected.jacobian.end());
    std::istringstream printed(testing::output_of(testing::run_words(folder / "main"), folder));
    for (const double number : numbers) {
      std::string word;
      ASSERT_TRUE(printed >> word);
      EXPECT_EQ(std::strtod(word.c_str(), nullptr), number) << to_string(functions);
    }
  }
}

// Names that the object asks of others.
std::set<std::string> undefined_names(const EmbeddedSource& e, const char* level) {
  const Scratch folder;
  codegen::write_file(folder / "text.c", e.source.text);
  std::vector<std::string> words = {codegen::in_path("gcc"), "-std=c99", level, "-c"};
  words.insert(words.end(), codegen::contract_flags().begin(), codegen::contract_flags().end());
  for (const std::string& last : {std::string("-o"), folder / "text.o", folder / "text.c"})
    words.push_back(last);
  EXPECT_EQ(testing::output_of(words, folder), "");
  std::istringstream lines(testing::output_of({codegen::in_path("nm"), "-u", folder / "text.o"}, folder));
  std::set<std::string> names;
  for (std::string kind, name; lines >> kind >> name;) names.insert(name);
  return names;
}

TEST(Embedded, AsksForNothingButLibm) {
  const Function f = swing();
  for (const bool single : {false, true}) {
    EXPECT_EQ(undefined_names(generate_embedded(f, with(Order::kSecond, 20), in(single)), "-O2"),
              std::set<std::string>());
  }
  for (const char* level : {"-O0", "-O2"}) {
    auto names = undefined_names(generate_embedded(f, with(Order::kSecond, 250, Functions::kLibm)), level);
    names.erase("sqrt");  // an instruction where the compiler wants it to be
    EXPECT_EQ(names, (std::set<std::string>{"cos", "sin"})) << level;
  }
}

TEST(Embedded, StackStaysBelowItsBound) {
  Random random(45);
  SCOPED_TRACE(random.seed_text());
  const Function all = testing::random_functions(random, 40, 12),
                 calls = testing::with_calls(testing::kepler());
  EXPECT_EQ(generate_embedded(calls, with(Order::kFirst)).stack_bounds, (std::vector<std::size_t>{0, 0}))
      << "nobody knows what a kernel written by hand needs";
  for (const bool single : {false, true}) {
    for (const std::size_t length : {std::size_t{60}, std::size_t{100000}}) {
      const auto e = generate_embedded(all, with(Order::kFirst, length), in(single));
      for (const char* level : {"-O0", "-O2", "-O3"}) {
        const auto use = codegen::measure_stack(e, {"gcc", level});
        ASSERT_EQ(use.bytes.size(), 2u);
        for (int k = 0; k < 2; ++k) {
          EXPECT_LT(use.bytes[k], e.stack_bounds[k]) << level << " " << length;
          EXPECT_GT(use.bytes[k], 0u);
        }
        if (length > 1000 && level == std::string("-O0")) {
          EXPECT_GT(2 * use.bytes[1], e.stack_bounds[1]) << "a bound that says something";
        }
        EXPECT_TRUE(std::find(use.beyond.begin(), use.beyond.end(), single ? "expf" : "exp") !=
                    use.beyond.end());
        EXPECT_TRUE(std::find(use.beyond.begin(), use.beyond.end(), "sin") == use.beyond.end());
      }
    }
  }
}

TEST(Embedded, CallGraphsAreReadToTheirEnds) {
  const auto use = codegen::read_call_graph(
      "node: { title: \"f\" label: \"f\\na.c:1:1\\n16 bytes (static)\" }\n"
      "node: { title: \"a.c:g\" label: \"g\\na.c:2:1\\n100 bytes (static)\\n0 dynamic objects\" }\n"
      "node: { title: \"a.c:h\" label: \"h\\na.c:3:1\\n32 bytes (static)\" }\n"
      "node: { title: \"sin\" label: \"sin\\n<built-in>\" shape : ellipse }\n"
      "edge: { sourcename: \"f\" targetname: \"a.c:g\" label: \"a.c:1:2\" }\n"
      "edge: { sourcename: \"f\" targetname: \"a.c:h\" label: \"a.c:1:3\" }\n"
      "edge: { sourcename: \"a.c:g\" targetname: \"sin\" }\n"
      "edge: { sourcename: \"a.c:h\" targetname: \"a.c:g\" }\n",
      {"f"});
  EXPECT_EQ(use.bytes, std::vector<std::size_t>{148});
  EXPECT_EQ(use.beyond, std::vector<std::string>{"sin"});
  EXPECT_THROW(codegen::read_call_graph("", {"f"}), ToolError);
}

TEST(Embedded, RefusesPortableFunctionsAndCompilersThatAreNone) {
  CodegenOptions options = with(Order::kValue);
  options.functions = Functions::kPortable;
  EXPECT_THROW(generate_embedded(swing(), options), ArgumentError);
  EXPECT_THROW(codegen::measure_stack(generate_embedded(swing(), with(Order::kValue)), {"no-such-cc"}),
               ToolError);
}

}  // namespace
}  // namespace dyntape::embedded_test
