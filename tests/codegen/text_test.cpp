// SPDX-License-Identifier: BSD-3-Clause
//
// The printed text: what compilers say of it, exact constants, the golden file, time and size.
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/pipeline.h>
#include <dyntape/codegen/print/c_text.h>
#include <gtest/gtest.h>

#include <chrono>
#include <clocale>
#include <fstream>
#include <sstream>

#include "compilers.h"
#include "random_function.h"
#include "source_folder.h"

namespace dyntape::text_test {
namespace {

using testing::Random;

CodegenOptions with_order(Order order) {
  CodegenOptions options;
  options.order = order;
  return options;
}

// A pendulum on a cart: small, but with parameters, names, a shared part and a sparse Hessian.
Function cart_pole() {
  RecordOptions options;
  options.variable_names = {"position", "angle", "rate", "force"};
  options.parameter_names = {"pole mass", "length"};
  options.output_names = {"cart acceleration", "pole acceleration"};
  return record(
      "cart pole", 4, 2,
      [](const VectorXad& x, const VectorXad& p) {
        // Operands that are results have names: which of two is recorded first is the compiler's choice.
        const AD s = sin(x[1]), c = cos(x[1]), m = p[0], l = p[1], part = m * s, inertia = 1.0 + part * s;
        const AD turn = l * x[2] * x[2], weight = 9.81 * c, inward = turn + weight;
        const AD push = x[3] * c, swing = m * turn * c * s, fall = (1.0 + m) * 9.81 * s;
        const AD sum = -push - swing - fall, lever = l * inertia, outward = part * inward;
        VectorXad y(2);
        y[0] = (x[3] + outward) / inertia;
        y[1] = sum / lever;
        return y;
      },
      options);
}

TEST(Text, PleasesCompilersAsCAndAsCpp) {
  Random random(7);
  SCOPED_TRACE(random.seed_text());
  Function f = testing::random_functions(random, 60, 12);
  f.name =
      "every op \"*/\" /* ?"
      "?/ \\ \n 7";
  for (int i = 0; i < 6; ++i) f.input_names[0].push_back("q\"" + std::to_string(i) + "*/\\\n");
  const NodeId condition = f.graph.make(Op::Lt, f.graph.input(Block::kVariables, 0), f.graph.constant(3));
  f.guards.push_back({condition, true, "a\\b*/c.cpp", 12});
  testing::expect_compiles_cleanly({generate_source(f, with_order(Order::kValue)).text,
                                    generate_source(cart_pole(), with_order(Order::kSecond)).text});
}

// What a name may do in a comment: nothing.  Every text of six of the characters that mean something there.
TEST(Text, NoNameLeavesItsComment) {
  constexpr std::string_view kSigns = "*/\\?\na";
  std::string name(6, ' ');
  for (int k = 0; k < 6 * 6 * 6 * 6 * 6 * 6; ++k) {
    for (int i = 0, rest = k; i < 6; ++i, rest /= 6) name[static_cast<std::size_t>(i)] = kSigns[rest % 6];
    const std::string comment = codegen::c_comment(name);
    for (const char* bad : {"*/", "/*", "\\", "\n"})
      ASSERT_EQ(comment.find(bad), std::string::npos) << codegen::c_string(name) << " -> " << comment;
  }
  RecordOptions options;
  options.variable_names = {"*\\ int x = system(0); /"};
  options.output_names = {"*?\?/\n/"};
  Function f = record(
      "*\\ #error", 1, [](const VectorXad& x) { return VectorXad(2 * x); }, options);
  CodegenOptions codegen = with_order(Order::kFirst);
  codegen.label = "*\\ #error /";
  testing::expect_compiles_cleanly(
      {generate_source(f, codegen).text, generate_embedded(f, codegen, {}).source.text});
  EXPECT_EQ(generate_source(f, codegen).text.find("system(0); */"), std::string::npos);
}

TEST(Text, PiecesPleaseCompilersTogetherAndApart) {
  Random random(8);
  SCOPED_TRACE(random.seed_text());
  const Function f = testing::random_functions(random, 20, 8);
  CodegenOptions options = with_order(Order::kFirst);
  options.piece_statements = 35;
  const codegen::Source source = generate_source(f, options);
  ASSERT_GT(source.pieces.size(), 10u);
  testing::expect_compiles_cleanly({source.text});
  testing::expect_compiles_cleanly({source.text}, {"-DDYNTAPE_FIRST=3", "-DDYNTAPE_LAST=5"});
  testing::expect_compiles_cleanly({source.text}, {"-DDYNTAPE_FIRST=0", "-DDYNTAPE_LAST=0"});
}

TEST(Text, WithoutInputsOrOutputs) {
  Function nothing;
  nothing.name = "";
  Function constant = nothing;
  constant.outputs.push_back(constant.graph.constant(-0.5));
  Function no_outputs = nothing;
  no_outputs.inputs = {2, 1, 0};
  std::vector<std::string> texts;
  for (const Function& f : {nothing, constant, no_outputs}) {
    CodegenOptions options = with_order(Order::kSecond);
    options.use_cache = false;
    options.route = Route::kCompiled;
    texts.push_back(generate_source(f, options).text);
    const CompiledFunction c = CompiledFunction::make(f, options);
    for (Order order : {Order::kValue, Order::kFirst, Order::kSecond}) {
      const auto result = c.evaluate(order, std::vector<double>(f.n_x()), std::vector<double>(f.n_p()),
                                     std::vector<double>(order == Order::kSecond ? f.n_y() : 0, 1.0));
      EXPECT_EQ(result.y, std::vector<double>(f.n_y(), -0.5));
      EXPECT_TRUE(result.jacobian.empty() && result.hessian.empty());
    }
  }
  testing::expect_compiles_cleanly(texts);
}

TEST(Text, HeaderDeclaresWhatTheTextDefines) {
  const codegen::Source source = generate_source(cart_pole(), with_order(Order::kFirst));
  testing::expect_compiles_cleanly({source.header + "\n" + source.header + "\n" + source.text});
}

TEST(Text, ConstantsAreExact) {
  const std::vector<double> constants = {0.1 + 0.2,
                                         1.0 / 3.0,
                                         3.14159265358979312,
                                         9007199254740993.0,
                                         12345678901234567.0,
                                         2.2250738585072014e-308,
                                         5e-324,
                                         1.7976931348623157e308,
                                         -0.0,
                                         0.0,
                                         std::numeric_limits<double>::infinity(),
                                         -std::numeric_limits<double>::infinity(),
                                         1.0,
                                         -2.5,
                                         1e22,
                                         1e21,
                                         123456.0,
                                         std::nextafter(1.0, 2.0)};
  Random random(9);
  Function f;
  f.name = "constants";
  f.inputs = {1, 0, 0};
  std::vector<double> expected = constants;
  for (int i = 0; i < 500; ++i) expected.push_back(std::bit_cast<double>(random.bits()));
  expected.push_back(std::numeric_limits<double>::quiet_NaN());
  for (double c : expected) f.outputs.push_back(f.graph.constant(c));
  CodegenOptions options = with_order(Order::kValue);
  options.use_cache = false;
  options.route = Route::kCompiled;
  const std::vector<double> found = CompiledFunction::make(f, options).evaluate(Order::kValue, {0}).y;
  for (std::size_t i = 0; i < expected.size(); ++i)
    EXPECT_TRUE(testing::same(found[i], expected[i])) << expected[i];
  testing::expect_compiles_cleanly({generate_source(f, options).text});
}

TEST(Text, DoesNotDependOnTheLocale) {
  const std::string text = generate_source(cart_pole(), with_order(Order::kSecond)).text;
  const std::string before = std::setlocale(LC_ALL, nullptr);
  bool found = false;
  for (const char* name : {"de_DE.UTF-8", "fr_FR.UTF-8", "de_DE"})
    found = found || std::setlocale(LC_ALL, name);
  if (!found) std::printf("no locale with a decimal comma is installed: the C locale is used twice\n");
  EXPECT_EQ(generate_source(cart_pole(), with_order(Order::kSecond)).text, text);
  std::setlocale(LC_ALL, before.c_str());
}

TEST(Text, GoldenFile) {
  const codegen::Source source = generate_source(cart_pole(), with_order(Order::kSecond));
  for (const auto& [suffix, text] : {std::pair(".c", &source.text), std::pair(".h", &source.header)}) {
    const std::string path = test::source_folder() + "/tests/golden/" + source.name + suffix;
    if (std::getenv("DYNTAPE_UPDATE_GOLDEN")) codegen::write_file(path, *text);
    std::ifstream golden(path);
    std::istringstream printed(*text);
    std::string expected, found;
    for (int line = 1; std::getline(printed, found); ++line) {
      ASSERT_TRUE(std::getline(golden, expected)) << path << " ends before line " << line;
      ASSERT_EQ(found, expected) << path << ":" << line << "; DYNTAPE_UPDATE_GOLDEN=1 writes it anew";
    }
    EXPECT_FALSE(std::getline(golden, expected)) << path << " has more lines";
  }
}

TEST(Text, SourcesAreWrittenWholeOrNotAtAll) {
  const testing::Scratch scratch;
  const codegen::Source source = generate_source(cart_pole(), with_order(Order::kFirst));
  const std::vector<std::string> paths = write_source(source, scratch / "deep/folder");
  ASSERT_EQ(paths.size(), 2u);
  int error = 0;
  EXPECT_EQ(codegen::read_file(paths[0], error), source.text);
  EXPECT_EQ(codegen::read_file(paths[1], error), source.header);
  const auto in_the_current_folder = [&] {
    return chdir(scratch.path().c_str()) == 0 && write_source(source, "").size() == 2 ? 0 : 1;
  };
  EXPECT_EQ(testing::in_child(in_the_current_folder), 0);
  EXPECT_EQ(codegen::read_file(scratch / (source.name + ".c"), error), source.text);
  codegen::write_file(scratch / "file", "");
  EXPECT_THROW(write_source(source, scratch / "file"), FileError);
  EXPECT_EQ(codegen::read_file(scratch / "file", error), "");
}

// y_k = y_{k-1}^2 + y_{k-2}: printed inline the text would double with every level.
Function doubling(std::size_t levels) {
  return record("doubling", 2, [&](const VectorXad& x) {
    AD before = x[0], now = x[1];
    for (std::size_t k = 0; k < levels; ++k) {
      const AD next = now * now + before;
      before = now;
      now = next;
    }
    return VectorXad::Constant(1, now).eval();
  });
}

TEST(Text, SizeIsLinear) {
  const std::size_t a = generate_source(doubling(30), with_order(Order::kValue)).text.size(),
                    b = generate_source(doubling(60), with_order(Order::kValue)).text.size();
  EXPECT_LT(b - a, 30u * 100u);
}

TEST(Text, AMillionStatementsPrintInLinearTime) {
  const auto seconds = [](std::size_t levels, std::size_t& bytes) {
    const Function f = doubling(levels);
    const auto start = std::chrono::steady_clock::now();
    bytes = generate_source(f, with_order(Order::kValue)).text.size();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  std::size_t small_bytes = 0, large_bytes = 0;
  const double small = seconds(50000, small_bytes), large = seconds(500000, large_bytes);
  std::printf("1e5 statements: %.3f s, 1e6 statements: %.3f s, %.1f MB\n", small, large,
              double(large_bytes) * 1e-6);
  EXPECT_LT(large_bytes, 13 * small_bytes);
  EXPECT_LT(large, 40 * small + 0.5);  // quadratic time would be a hundredfold
}

}  // namespace
}  // namespace dyntape::text_test
