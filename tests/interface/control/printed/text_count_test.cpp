// SPDX-License-Identifier: BSD-3-Clause
//
// Counts of C text: bounds of loops, the dearer side of a branch, what has no bound.
#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/printed/text_count.h>
#include "interface/message_of.h"

namespace dyntape::text_count_test {
namespace {

TextCount of(const std::string& body, const std::string& before = "") {
  return CountedText(before + "static void f(double a[9], double x) {\n" + body + "\n}\n").of("f");
}

TEST(TextCount, CountsOperationsLoadsAndStores) {
  const TextCount c = of("a[0] = a[1] * x + a[2];");
  EXPECT_EQ(c.operations, 2);
  EXPECT_EQ(c.loads, 2);
  EXPECT_EQ(c.stores, 1);
  const TextCount compound = of("a[0] += x;");
  EXPECT_EQ(compound.loads, 1);
  EXPECT_EQ(compound.stores, 1);
  EXPECT_EQ(compound.operations, 1);
}

TEST(TextCount, LoopsAndTriangles) {
  EXPECT_EQ(of("for (int i = 0; i < 5; ++i) {\n a[i] = x;\n}").stores, 5);
  EXPECT_EQ(of("for (int i = 0; i < 4; ++i) {\n for (int j = 0; j <= i; ++j) {\n a[j] = x;\n}\n}").stores,
            10);
  EXPECT_EQ(of("for (int i = 0; i < N; ++i) {\n a[i] = x;\n}", "#define N 7\n").stores, 7);
  EXPECT_EQ(CountedText("#define N 7\nvoid f(double a[9]) { for (int i = 0; i < N; ++i) { a[i] = 0; } }\n",
                        {{"N", 3}})
                .of("f")
                .stores,
            3);
}

TEST(TextCount, TakesTheDearerSide) {
  EXPECT_EQ(of("if (x > 0) { a[0] = x; } else { a[0] = x; a[1] = x; }").stores, 2);
  EXPECT_EQ(of("for (int i = 0; i < 3; ++i) { if (x > 0) { break; } a[i] = x; }").stores, 3);
}

TEST(TextCount, CallsCountWithTheirFunction) {
  EXPECT_EQ(of("g(a); g(a);", "static void g(double a[9]) { a[0] = 1; a[1] = 2; }\n").stores, 4);
}

TEST(TextCount, RefusesWhatHasNoBound) {
  const auto message = [](const std::string& body) { return message_of<ArgumentError>([&] { of(body); }); };
  EXPECT_NE(message("while (x > 0) { a[0] = x; }").find("while"), std::string::npos);
  EXPECT_NE(message("for (int i = 0; i < n; ++i) { a[i] = x; }").find("not constant"), std::string::npos);
  EXPECT_NE(message("for (int i = 9; i > 0; --i) { a[i] = x; }").find("expected a loop"), std::string::npos);
  EXPECT_NE(message("f(a, x);").find("\"f\""), std::string::npos) << "recursion";
  EXPECT_NE(message("a[0] = exp(x);").find("\"exp\""), std::string::npos);
}

}  // namespace
}  // namespace dyntape::text_count_test
