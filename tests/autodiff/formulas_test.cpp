// SPDX-License-Identifier: BSD-3-Clause
// LaTeX and MathML of recorded functions.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>

#include <dyntape/autodiff/graph/formulas.h>
#include <dyntape/autodiff/record/record.h>

namespace dyntape::testing::formulas_test {
namespace {

// The formula of one result of x and y.
std::string latex_of(const std::function<AD(const AD&, const AD&)>& f) {
  Function g = record("g", 2, [&](const VectorXad& x) { return VectorXad::Constant(1, f(x[0], x[1])); });
  g.input_names[0] = {"x", "y"};
  std::string text = to_latex(g, {.open = "[", .close = "]", .output = "z"});
  for (std::size_t at; (at = text.find("\\operatorname{")) != std::string::npos;) {
    text.erase(text.find('}', at), 1);
    text.erase(at, 14);
  }
  return text;
}

TEST(Formulas, HaveBracketsWherePrecedenceNeedsThem) {
  EXPECT_EQ(latex_of([](const AD& x, const AD& y) { return x / (x + y); }), "[z_{0} = \\frac{x}{x + y}]\n");
  EXPECT_EQ(latex_of([](const AD& x, const AD& y) { return x - sin(y); }),
            "[z_{0} = x - sin\\left(y\\right)]\n");
  const auto product = [](const AD& x, const AD& y) {
    const AD difference = x - y;  // first: the order of two operands is the compiler's
    return sqrt(x) * difference;
  };
  EXPECT_EQ(latex_of(product), "[z_{0} = \\left(x - y\\right) \\cdot \\sqrt{x}]\n");
  EXPECT_EQ(latex_of([](const AD& x, const AD& y) { return -3 * x / (y * 0.5); }),
            "[z_{0} = \\frac{\\left(-3\\right) \\cdot x}{0.5 \\cdot y}]\n");
  EXPECT_EQ(latex_of([](const AD& x, const AD& y) { return pow(x - y, y + 0.5); }),
            "[z_{0} = {\\left(x - y\\right)}^{y + 0.5}]\n");
  EXPECT_EQ(latex_of([](const AD& x, const AD& y) { return x - (y - exp(x)); }),
            "[z_{0} = x - \\left(y - e^{x}\\right)]\n");
  EXPECT_EQ(latex_of([](const AD& x, const AD& y) { return select(x < y, x, 1e-20 * y); }),
            "[z_{0} = \\begin{cases} x & \\text{if } x < y \\\\ "
            "1 \\cdot 10^{-20} \\cdot y & \\text{otherwise} \\end{cases}]\n");
}

TEST(Formulas, NameWhatIsUsedTwice) {
  const Function f = record("f", 2, [](const VectorXad& x) {
    const AD t = x[0] / x[1];
    return VectorXad{{sin(t), cos(t), t, exp(x[1])}};
  });
  EXPECT_EQ(shared_values(f), 0u);  // t is a result
  EXPECT_EQ(to_latex(f).substr(0, 34), "\\[ v_{0} = \\frac{x_{0}}{x_{1}} \\]\n");
  const Function g = record("g", 2, [](const VectorXad& x) {
    const AD t = x[0] / x[1];
    return VectorXad{{sin(t), cos(t)}};
  });
  EXPECT_EQ(shared_values(g), 1u);
  const std::string page = to_mathml(g, {.open = "<math>", .close = "</math>", .shared = "t"});
  EXPECT_EQ(
      page,
      "<math><msub><mi>t</mi><mn>0</mn></msub><mo>=</mo><mfrac><mrow><msub><mi>x</mi><mn>0</mn></msub></mrow>"
      "<mrow><msub><mi>x</mi><mn>1</mn></msub></mrow></mfrac></math>\n"
      "<math><msub><mi>y</mi><mn>0</mn></msub><mo>=</mo><mi>sin</mi><mo>(</mo><mrow><msub><mi>t</mi><mn>0</"
      "mn>"
      "</msub></mrow><mo>)</mo></math>\n"
      "<math><msub><mi>y</mi><mn>1</mn></msub><mo>=</mo><mi>cos</mi><mo>(</mo><mrow><msub><mi>t</mi><mn>0</"
      "mn>"
      "</msub></mrow><mo>)</mo></math>\n");
}

// A sum of many terms has no formula longer than the limit, and takes linear time.
TEST(Formulas, AreCutIfTheyAreLong) {
  const Function f = record("f", 2, [](const VectorXad& x) {
    AD s = 0.0;
    for (int k = 0; k < 20000; ++k) s = sin(s + x[k % 2]);
    return VectorXad::Constant(1, s);
  });
  const std::string text = to_latex(f);
  EXPECT_LT(text.size(), 4000000u);
  std::size_t longest = 0, begin = 0;
  for (std::size_t end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1)
    longest = std::max(longest, end - begin);
  EXPECT_LT(longest, 1200u);
}

}  // namespace
}  // namespace dyntape::testing::formulas_test
