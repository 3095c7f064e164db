// SPDX-License-Identifier: BSD-3-Clause
//
// Calls of one elementary function side by side: their order, and that one state has the interpreter's bits through registers of
// any width, for numbers of every size.
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/pipeline.h>
#include <dyntape/codegen/schedule/gather.h>
#include <gtest/gtest.h>

#include "compilers.h"
#include "random_function.h"

namespace dyntape::gather_test {
namespace {

using codegen::gather_calls;
using testing::Random;
using testing::same;

std::vector<NodeId> computed(const Graph& graph) {
  std::vector<NodeId> order;
  for (NodeId id = 0; id < graph.size(); ++id) {
    if (is_table_op(graph[id].op)) order.push_back(id);
  }
  return order;
}

// A chain of joints: each angle's sine and cosine are used before the next are asked for; then tanh of what came out.
Function chain(int joints) {
  return record("chain", joints, [joints](const VectorXad& q) {
    AD x = 1, y = 0;
    for (int i = 0; i < joints; ++i) {
      const AD s = sin(q[i] + 0.25 * i), c = cos(q[i] + 0.25 * i), turned = c * x - s * y;
      y = s * x + c * y;
      x = turned + 0.5;
    }
    VectorXad r(2);
    r << tanh(x) * tanh(y), sin(x) + cos(y);
    return r;
  });
}

// Lengths of the runs of calls of one function.
std::vector<std::size_t> runs(const Graph& graph, const std::vector<NodeId>& order) {
  std::vector<std::size_t> lengths;
  Op last = Op::Const;
  for (NodeId id : order) {
    if (!codegen::is_gathered(graph, id, Functions::kPortable)) {
      last = Op::Const;
      continue;
    }
    const Op op = codegen::team_operator(graph[id].op);
    if (op != last) lengths.push_back(0);
    ++lengths.back();
    last = op;
  }
  return lengths;
}

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (std::size_t at = text.find(what); at != text.npos; at = text.find(what, at + 1)) ++n;
  return n;
}

void expect_order(const Graph& graph, const std::vector<NodeId>& before, const std::vector<NodeId>& after) {
  std::vector<NodeId> sorted = after;
  std::sort(sorted.begin(), sorted.end());
  EXPECT_EQ(sorted, before) << "each node once";
  std::vector<bool> is_there(graph.size(), false);
  for (NodeId id : after) {
    graph.for_each_argument(id, [&](NodeId a) {
      EXPECT_TRUE(is_there[a] || !is_table_op(graph[a].op)) << "node " << id << " reads " << a;
    });
    is_there[id] = true;
  }
}

TEST(Gather, CallsOfAChainComeTogether) {
  const Function f = chain(6);
  const std::vector<NodeId> order = computed(f.graph),
                            gathered = gather_calls(f.graph, order, Functions::kPortable);
  expect_order(f.graph, order, gathered);
  EXPECT_EQ(runs(f.graph, order), (std::vector<std::size_t>{2, 2, 2, 2, 2, 2, 2, 2}));
  EXPECT_EQ(runs(f.graph, gathered), (std::vector<std::size_t>{12, 2, 2}));
}

TEST(Gather, TeamsHaveUpToEightValues) {
  const Function f = chain(19);
  EXPECT_EQ(runs(f.graph, gather_calls(f.graph, computed(f.graph), Functions::kPortable)),
            (std::vector<std::size_t>{16, 16, 6, 2, 2}));
  CodegenOptions options;
  options.order = Order::kValue;
  options.functions = Functions::kPortable;
  const std::string text = generate_source(f, options).text;
  EXPECT_EQ(count(text, "\n  DT_TURNS("), 4) << "8, 8, 3, and of x and y";
  EXPECT_EQ(count(text, "\n  DT_MANY(tanh, "), 1);
  EXPECT_EQ(count(text, "\n  DT_TURN("), 19);
}

TEST(Gather, RandomGraphsStayInOrder) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    Random random(seed);
    const Function f = testing::random_functions(random, 3, 40 + 10 * seed);
    const std::vector<NodeId> order = computed(f.graph);
    SCOPED_TRACE(random.seed_text());
    expect_order(f.graph, order, gather_calls(f.graph, order, Functions::kPortable));
  }
}

TEST(Gather, OneStateHasTheBitsOfTheInterpreterInRegistersOfAnyWidth) {
  const Function f = chain(11);
  Random random(63);
  SCOPED_TRACE(random.seed_text());
  std::vector<std::vector<double>> states;
  for (double size : {1.0, 900.0, 999.9999, 1e3, 1000.1, 1e5, 1e6, 1e9, 1e22, 1e300, 1e-9, 1e-310, 0.0}) {
    for (int k = 0; k < 5; ++k) {  // one entry, or all
      std::vector<double> x(11);
      for (std::size_t i = 0; i < x.size(); ++i)
        x[i] = random.uniform(-1, 1) * (k == 0 || i % 5 == std::size_t(k) ? size : 1.0);
      states.push_back(x);
    }
  }
  for (double special : testing::kSpecials) {
    std::vector<double> x(11, 0.5);
    x[4] = special;
    states.push_back(x);
  }
#if defined(__x86_64__)
  const std::vector<std::vector<std::string>> widths = {{}, {"-mno-avx512f"}, {"-mno-avx"}};
#else
  const std::vector<std::vector<std::string>> widths = {{}};
#endif
  for (std::size_t k = 0; k < 2 * widths.size(); ++k) {
    const std::vector<std::string>& flags = widths[k / 2];
    CodegenOptions options;
    options.order = Order::kValue;
    options.route = Route::kCompiled;
    options.functions = k % 2 ? Functions::kSines : Functions::kPortable;
    options.use_cache = false;
    options.flags = flags;
    const Interpreter interpreter(f, options.functions);
    Interpreter::Workspace room(interpreter);
    const CompiledFunction compiled = CompiledFunction::make(f, options);
    for (const std::vector<double>& x : states) {
      const std::vector<double> found = compiled.evaluate(Order::kValue, x).y;
      std::vector<double> expected(f.n_y());
      interpreter(x.data(), nullptr, nullptr, expected.data(), room);
      for (std::size_t i = 0; i < found.size(); ++i)
        EXPECT_TRUE(same(found[i], expected[i]))
            << found[i] << " " << expected[i] << (flags.empty() ? "" : flags[0]);
    }
  }
}

}  // namespace
}  // namespace dyntape::gather_test
