// SPDX-License-Identifier: BSD-3-Clause
// What CppADCodeGen documents around models: languages, temporaries, sparseForJacHessian, vectors of any class,
// the pool of threads.
#include <dyntape/interface/cppad/cg.h>
#include <dyntape/interface/cppad/cg/thread_pool.h>

#include <cstdio>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <valarray>

#include "interface/cppad/cg/library.h"
#include "interface/cppad/programs.h"

namespace cg_languages_test {
namespace {

using namespace CppAD::cg;
using cg_tests::CGD;
using ADCG = AD<CGD>;

// A handler with two variables, and text() of results of them.
struct Printed {
  explicit Printed(Language<double>& l) : language(l), x(2) { handler.makeVariables(x); }
  std::string text(const std::vector<CGD>& results) {
    CppAD::vector<CGD> y(results.size());
    for (std::size_t i = 0; i < results.size(); ++i) y[i] = results[i];
    LangCDefaultVariableNameGenerator<double> names("out", "in", "t");
    std::ostringstream out;
    handler.generateCode(out, language, y, names);
    return out.str();
  }
  Language<double>& language;
  CodeHandler<double> handler;
  CppAD::vector<CGD> x;
};

TEST(CppadCgLanguages, Latex) {
  LanguageLatex<double> language;
  language.setEquationEnvironment("$", "$");
  Printed p(language);
  const std::string quotient = p.text({p.x[0] / p.x[1]});
  EXPECT_EQ(quotient, "$out_{0} = \\frac{in_{0}}{in_{1}}$\n");
  EXPECT_EQ(p.text({p.x[0] / p.x[1]}), quotient);
  EXPECT_EQ(p.text({exp(p.x[1]), CGD(2)}), "$out_{0} = e^{in_{1}}$\n$out_{1} = 2$\n");
}

TEST(CppadCgLanguages, Dot) {
  LanguageDot<double> language;
  Printed p(language);
  const std::string text = p.text({sin(p.x[1])});
  EXPECT_EQ(text.find("digraph"), 0u);
  EXPECT_NE(text.find("\"in[1]\""), std::string::npos) << text;
  EXPECT_NE(text.find("\"Sin\""), std::string::npos);
  EXPECT_NE(text.find("\"out[0]\""), std::string::npos);
}

TEST(CppadCgLanguages, MathMLIsAPage) {
  LanguageMathML<double> language;
  language.setStyle(language.getStyle() + "math { color: red; }");
  language.setJavascript("var a = 1;");
  language.setHeadExtraMarkup("<meta name=\"a\">");
  language.setEquationMarkup("<math class=\"e\">", "</math>");
  Printed p(language);
  const std::string page = p.text({sqrt(p.x[0])});
  for (const char* part :
       {"<!DOCTYPE html>", "math { color: red; }", "var a = 1;", "<meta name=\"a\">", "</html>",
        "<math class=\"e\"><msub><mi>out</mi><mn>0</mn></msub><mo>=</mo><msqrt>",
        "<msub><mi>in</mi><mn>0</mn>"})
    EXPECT_NE(page.find(part), std::string::npos) << part << "\n" << page;
}

TEST(CppadCgLanguages, ToolsForThePage) {
  namespace tools = CppAD::cg::system;
  EXPECT_EQ(tools::createPath({"a", "b"}, "c.tex"), "a/b/c.tex");
  const std::string script = tools::createPath(tools::getWorkingDirectory(), "cg_languages_test.sh");
  std::ofstream(script) << "exit $1\n";
  EXPECT_EQ(readStringFromFile(script), "exit $1\n");
  EXPECT_NO_THROW(tools::callExecutable("/bin/sh", {script, "0"}));
  EXPECT_NE(sentence_of<dyntape::ToolError>([&] {
              tools::callExecutable("/bin/sh", {script, "3"});
            }).find("status 3"),
            std::string::npos);
  EXPECT_THROW(tools::callExecutable("/no/such/program", {}), dyntape::Error);
  std::remove(script.c_str());
}

TEST(CppadCgLanguages, CInAMapOfFiles) {
  LanguageC<double> language("double");
  std::map<std::string, std::string> files;
  language.setMaxAssignmentsPerFunction(100, &files);
  language.setGenerateFunction("quotient");
  Printed p(language);
  const std::string text = p.text({p.x[0] / p.x[1]});
  ASSERT_EQ(files.count("quotient.c"), 1u);
  EXPECT_EQ(files["quotient.c"], text);
}

TEST(CppadCgLanguages, TemporariesAreUsedTwice) {
  LanguageC<double> language("double");
  Printed p(language);
  const CGD product = p.x[0] * p.x[1];
  p.text({product, sin(p.x[0])});
  EXPECT_EQ(p.handler.getTemporaryVariableCount(), 0u);
  p.text({sin(product), cos(product)});
  EXPECT_EQ(p.handler.getTemporaryVariableCount(), 1u);
  p.text({product, cos(product), sin(product)});  // the temporary is a result
  EXPECT_EQ(p.handler.getTemporaryVariableCount(), 0u);
  EXPECT_EQ(p.handler.getTemporaryArraySize(), 0u);
}

// y0 = x0 x1 x2, y1 = x1 / x0
template <class Vector>
void expect_all_at_once() {
  std::vector<ADouble> ax{1.0, 1.0, 1.0}, ay(2);
  Independent(ax);
  ay[0] = ax[0] * ax[1] * ax[2];
  ay[1] = ax[1] / ax[0];
  ADFun<double> f(ax, ay);
  using Sets = std::vector<std::set<std::size_t>>;
  using Sizes = std::vector<std::size_t>;
  const Sets jacobian_sets{{0, 1, 2}, {0, 1}}, hessian_sets{{0, 1, 2}, {0, 2}, {0, 1}};
  const Sizes jrow{1, 0}, jcol{0, 2}, hrow{0, 1, 0}, hcol{0, 2, 1};
  Vector x(3), w(2), y(2), jac(2), hes(3);
  x[0] = 2, x[1] = 3, x[2] = 5, w[0] = 1, w[1] = 4;
  SparseForjacHessianWork work;
  for (int again = 0; again < 2; ++again) {
    EXPECT_GT(
        sparseForJacHessian(f, x, w, y, jacobian_sets, jrow, jcol, jac, hessian_sets, hrow, hcol, hes, work),
        0u);
    EXPECT_DOUBLE_EQ(y[0], 30);
    EXPECT_DOUBLE_EQ(y[1], 1.5);
    EXPECT_DOUBLE_EQ(jac[0], -0.75);
    EXPECT_DOUBLE_EQ(jac[1], 6);
    EXPECT_DOUBLE_EQ(hes[0], 4 * 2 * 3.0 / 8);    // 4 * 2 x1 / x0^3
    EXPECT_DOUBLE_EQ(hes[1], 2);                  // x0
    EXPECT_DOUBLE_EQ(hes[2], 5 - 4 * 1.0 / 4.0);  // x2 - 4 / x0^2
  }
  std::vector<Vector> weights(2, w), hessians(2, hes);
  weights[1][1] = 0;
  sparseForJacHessian(f, x, weights, y, jacobian_sets, jrow, jcol, jac, hessian_sets, hrow, hcol, hessians,
                      work);
  EXPECT_DOUBLE_EQ(hessians[0][0], 3);
  EXPECT_DOUBLE_EQ(hessians[1][0], 0);
  EXPECT_DOUBLE_EQ(hessians[1][2], 5);
}
TEST(CppadCgSparse, ValueJacobianAndHessianInOneCall) {
  expect_all_at_once<std::vector<double>>();
  expect_all_at_once<std::valarray<double>>();
  expect_all_at_once<CppAD::vector<double>>();
}

// y0 = x0 x1, y1 = 3 x1
std::unique_ptr<ADFun<CGD>> product() {
  std::vector<ADCG> x(2), y(2);
  x[0] = 1.0, x[1] = 1.0;
  Independent(x);
  y[0] = x[0] * x[1];
  y[1] = 3.0 * x[1];
  return std::make_unique<ADFun<CGD>>(x, y);
}

template <class Vector>
Vector vector_of(std::initializer_list<double> values) {
  Vector v(values.size());
  std::size_t i = 0;
  for (double value : values) v[i++] = value;
  return v;
}
template <class Vector>
void expect_entries(const Vector& v, const std::vector<double>& expected) {
  ASSERT_EQ(std::size_t(v.size()), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_DOUBLE_EQ(v[i], expected[i]) << i;
}

template <class Vector>
void expect_calls() {
  const cg_tests::Library m(product());
  const auto of = [](std::initializer_list<double> values) { return vector_of<Vector>(values); };
  const Vector x = of({2, 5}), w = of({10, 1});
  expect_entries(m.model->ForwardZero(x), {10, 15});
  expect_entries(m.model->Jacobian(x), {5, 2, 0, 3});
  expect_entries(m.model->SparseJacobian(x), {5, 2, 0, 3});
  expect_entries(m.model->Hessian(x, w), {0, 10, 10, 0});
  expect_entries(m.model->Hessian(x, std::size_t(0)), {0, 1, 1, 0});
  expect_entries(m.model->SparseHessian(x, w), {0, 10, 10, 0});
  Vector values(1), dense(4);
  std::vector<std::size_t> row, col;
  m.model->SparseJacobian(x, values, row, col);
  expect_entries(values, {5, 2, 3});
  EXPECT_EQ(col, (std::vector<std::size_t>{0, 1, 1}));
  m.model->SparseHessian(x, w, values, row, col);
  expect_entries(values, {10, 10});
  m.model->Jacobian(x, dense);
  expect_entries(dense, {5, 2, 0, 3});
  m.model->Hessian(x, w, dense);
  expect_entries(dense, {0, 10, 10, 0});
  const Vector tx = of({2, 1, 5, -1}), ty = of({10, 0, 15, 0});  // direction (1, -1)
  expect_entries(m.model->ForwardOne(tx), {3, -3});
  expect_entries(m.model->ReverseOne(x, of({10, 15}), w), {50, 23});
  expect_entries(m.model->ReverseTwo(tx, ty, of({0, 10, 0, 1})), {-10, 50, 10, 23});
}
TEST(CppadCgModels, TakeVectorsOfAnyClass) {
  expect_calls<std::vector<double>>();
  expect_calls<CppAD::vector<double>>();
  expect_calls<std::valarray<double>>();
}

TEST(CppadCgModels, RefuseArraysOfOtherSizes) {
  const cg_tests::Library m(product());
  std::vector<double> x{2, 5}, three(3), four(4);
  const auto sentence = [&](const std::function<void()>& call) {
    return sentence_of<dyntape::ArgumentError>(call);
  };
  EXPECT_NE(sentence([&] { m.model->ForwardZero(three, x); }).find("the size of x: got 3, expected 2"),
            std::string::npos);
  EXPECT_NE(sentence([&] { m.model->ForwardZero(x, three); }).find("the size of y: got 3, expected 2"),
            std::string::npos);
  EXPECT_NE(sentence([&] { m.model->Jacobian(x, three); }).find("the Jacobian: got 3"), std::string::npos);
  EXPECT_NE(sentence([&] { m.model->Hessian(x, x, three); }).find("the Hessian: got 3"), std::string::npos);
  EXPECT_NE(sentence([&] { m.model->Hessian(x, three, four); }).find("w: got 3"), std::string::npos);
  EXPECT_NE(sentence([&] { m.model->ReverseTwo(four, four, three); }).find("py: got 3"), std::string::npos);
}

TEST(CppadCgPool, RunsEachJobOnce) {
  std::vector<int> done(20, 0);
  std::vector<void*> arguments;
  for (int& d : done) arguments.push_back(&d);
  std::vector<cppadcg_thpool_function_type> jobs(20, [](void* d) { ++*static_cast<int*>(d); });
  std::vector<float> elapsed(20, -1), reference(20, 0);
  std::vector<int> order(20);
  for (int i = 0; i < 20; ++i) order[std::size_t(i)] = 19 - i;
  for (int disabled : {0, 1}) {
    cppadcg_thpool_set_disabled(disabled);
    cppadcg_thpool_add_jobs(jobs.data(), arguments.data(), nullptr, elapsed.data(), order.data(), nullptr, 20,
                            0);
    cppadcg_thpool_add_job(jobs[0], arguments[0], nullptr, nullptr);
    cppadcg_thpool_wait();
  }
  cppadcg_thpool_set_disabled(0);
  EXPECT_EQ(done[0], 4);
  EXPECT_EQ(done[19], 2);
  for (float seconds : elapsed) EXPECT_GE(seconds, 0);
  const float times[] = {1, 3, 2};
  cppadcg_thpool_update_order(reference.data(), 0, times, order.data(), 3);
  EXPECT_EQ(std::vector<int>(order.begin(), order.begin() + 3), (std::vector<int>{1, 2, 0}));
  cppadcg_thpool_update_order(reference.data(), 1, times, order.data(), 3);
  EXPECT_EQ(reference[1], 3);  // their mean
  cppadcg_thpool_shutdown();
}

}  // namespace
}  // namespace cg_languages_test
