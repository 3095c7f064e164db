// SPDX-License-Identifier: BSD-3-Clause
// CppAD's C++ and JSON graphs, by the documented format: nodes from 1 are parameters, variables, constants, results.
#include "programs.h"

namespace {

// ((p0 + x0) * 2.5, if x0 < p0 then x1 else -x1, p0 + x0 + x1)
const char* const kText = R"({
  "function_name": "example",
  "op_define_vec": [5, [
    {"op_code": 1, "name": "add", "n_arg": 2}, {"op_code": 2, "name": "mul", "n_arg": 2},
    {"op_code": 3, "name": "neg", "n_arg": 1}, {"op_code": 4, "name": "cexp_lt", "n_arg": 4},
    {"op_code": 5, "name": "sum"}]],
  "n_dynamic_ind": 1,
  "n_variable_ind": 2,
  "constant_vec": [1, [+0.25e+1]],
  "op_usage_vec": [5, [[1, 1, 2], [2, 5, 4], [3, 3], [4, 2, 1, 3, 7], [5, 1, 3, [1, 2, 3]]]],
  "dependent_vec": [3, [6, 8, 9]]
})";

void expect_the_example(ADFun<double>& f) {
  EXPECT_EQ(f.Domain(), 2u);
  EXPECT_EQ(f.Range(), 3u);
  EXPECT_EQ(f.size_dyn_ind(), 1u);
  EXPECT_EQ(f.function_name_get(), "example");
  f.new_dynamic(DVector{3});
  expect_near(f.Forward(0, DVector{2, 7}), {12.5, 7, 12});
  expect_near(f.Forward(0, DVector{4, 7}), {17.5, -7, 14});
  expect_near(f.Jacobian(DVector{4, 7}), {2.5, 0, 0, -1, 1, 1});
}

TEST(CppadGraph, ReadsJson) {
  ADFun<double> f;
  f.from_json(kText);
  expect_the_example(f);
}

TEST(CppadGraph, WhatIsWrittenReadsTheSame) {
  ADFun<double> f, g, h;
  f.from_json(kText);
  g.from_json(f.to_json());
  expect_the_example(g);
  CppAD::cpp_graph graph;
  g.to_graph(graph);
  h.from_graph(graph);
  expect_the_example(h);
}

TEST(CppadGraph, EveryRecordedOperatorSurvives) {
  const auto code = [](const AVector& x) -> std::vector<ADouble> {
    return {sin(x[0]) * exp(x[1]) - log10(x[0]) / hypot(x[0], x[1]),
            CondExpGe(x[0], x[1], sqrt(x[0]), cosh(x[1])), pow(x[0], x[1]) + azmul(x[0], x[1]) + atan(-x[0]),
            max(x[0], x[1]) - 2 * min(x[0], x[1]) + exp2(x[1]) + sign(x[0])};
  };
  ADFun<double> f = recorded({1, 2}, code), g;
  g.from_json(f.to_json());
  for (const DVector& x : {DVector{0.5, 1.5}, DVector{2, 0.25}}) {
    const DVector y = f.Forward(0, x), J = f.Jacobian(x);
    expect_near(g.Forward(0, x), std::vector<double>(y.begin(), y.end()));
    expect_near(g.Jacobian(x), std::vector<double>(J.begin(), J.end()));
  }
}

// A comparison says what was true; it is counted where it is not.
TEST(CppadGraph, ComparisonsAndPrints) {
  AVector ax{1}, ay(1);
  Independent(ax);
  ay[0] = ax[0] > 0.5 && 0.5 < ax[0] ? ADouble(2 * ax[0]) : ADouble(0);
  PrintFor("x is\n\t", ax[0]);  // as it stands in the text: the format has no escapes
  ADFun<double> f(ax, ay), g;
  g.from_json(f.to_json());
  std::ostringstream out;
  g.Forward(0, DVector{0.75}, out);
  EXPECT_EQ(out.str(), "x is\n\t0.75");
  EXPECT_NE(f.to_json().find("x is\n\t"), std::string::npos);
  EXPECT_EQ(g.compare_change_number(), 0u);
  g.Forward(0, DVector{0.25}, out);
  EXPECT_EQ(g.compare_change_number(), 2u);
}

TEST(CppadGraph, ParametersAndVariablesChangeSides) {
  ADFun<double> f =
      recorded({1, 2, 3}, [](const AVector& x) -> std::vector<ADouble> { return {x[2] * (x[0] + x[1])}; });
  CppAD::cpp_graph graph;
  f.to_graph(graph);
  f.from_graph(graph, {}, {true, true, false});
  EXPECT_EQ(f.Domain(), 1u);
  f.new_dynamic(DVector{10, 20});
  expect_near(f.Forward(0, DVector{3}), {90});
  expect_near(f.Jacobian(DVector{3}), {30});
}

double graph_step(const double& x) { return x < 0 ? 0 : 1; }
float graph_step(const float& x) { return x < 0 ? 0 : 1; }
CPPAD_DISCRETE_FUNCTION(double, graph_step)
CPPAD_DISCRETE_FUNCTION(float, graph_step)

template <class Base>
class GraphsOf : public ::testing::Test {};
using GraphBases = ::testing::Types<float, double>;
TYPED_TEST_SUITE(GraphsOf, GraphBases);

TYPED_TEST(GraphsOf, FunctionsOfTheUserByName) {
  using S = AD<TypeParam>;
  using Values = std::vector<TypeParam>;
  std::vector<S> x{2}, y(1);
  Independent(x);
  y[0] = x[0] * x[0] * x[0];
  ADFun<TypeParam> cube(x, y);
  CppAD::chkpoint_two<TypeParam> called(cube, "graph_cube");
  graph_step(S(1));  // known from its first call on
  CppAD::cpp_graph graph;
  graph.n_variable_ind_set(1);
  graph.atomic_name_vec_push_back("graph_cube");
  graph.discrete_name_vec_push_back("graph_step");
  for (std::size_t argument : {0, 1, 1, 1}) graph.operator_arg_push_back(argument);  // cube(x): node 2
  graph.operator_vec_push_back(CppAD::graph::atom_graph_op);
  for (std::size_t argument : {0, 1}) graph.operator_arg_push_back(argument);  // step(x): node 3
  graph.operator_vec_push_back(CppAD::graph::discrete_graph_op);
  graph.dependent_vec_push_back(2), graph.dependent_vec_push_back(3);
  ADFun<TypeParam> f, g;
  f.from_graph(graph);
  EXPECT_EQ(f.Forward(0, Values{3}), (Values{27, 1}));
  EXPECT_EQ(f.Jacobian(Values{3}), (Values{27, 0}));
  g.from_json(f.to_json());
  EXPECT_EQ(g.Jacobian(Values{-2}), (Values{12, 0}));
}

TEST(CppadGraph, WhatIsNoGraphIsSaid) {
  ADFun<double> f;
  const auto sentence = [&](std::string text, const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
    return sentence_of<dyntape::ArgumentError>([&] { f.from_json(text); });
  };
  EXPECT_NE(sentence(kText, "\"neg\"", "\"negate\"").find("no operator \"negate\""), std::string::npos);
  EXPECT_NE(sentence(kText, "[3, 3]", "[3, 7]").find("node 7, expected one of 1 to 6"), std::string::npos);
  EXPECT_NE(sentence(kText, "[3, 3]", "[9, 3]").find("op_code 9"), std::string::npos);
  EXPECT_NE(sentence(kText, "}", "]").find("from_json"), std::string::npos);
  EXPECT_NE(sentence(kText, "[1, [+0", "[2, [+0").find("says 2"), std::string::npos);
  ADFun<double> g = recorded({1}, [](const AVector& x) -> std::vector<ADouble> { return {floor(x[0])}; });
  EXPECT_NE(sentence_of<dyntape::ArgumentError>([&] { g.to_json(); }).find("no operator for"),
            std::string::npos);
}

}  // namespace
