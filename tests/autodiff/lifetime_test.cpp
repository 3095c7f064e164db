// SPDX-License-Identifier: BSD-3-Clause
//
// Threads, lifetimes and exceptions (hard cases 78, 79, 85 and 99-105).
#include <gtest/gtest.h>

#include <thread>

#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/record/record.h>

#include "dense.h"
#include "random_program.h"

namespace dyntape::testing::lifetime_test {
namespace {

VectorXad one(const AD& y) { return VectorXad::Constant(1, y); }

template <class Work>
void in_threads(int n, Work work) {
  std::vector<std::thread> threads;
  for (int i = 0; i < n; ++i) threads.emplace_back(work, i);
  for (std::thread& t : threads) t.join();
}

std::string message_of(const std::function<void()>& f) {
  try {
    f();
  } catch (const RecordingError& e) {
    return e.what();
  }
  return "no error";
}

TEST(Lifetime, Case78_AValueComputedBeforeRecordingIsAConstant) {
  const AD before = AD(2) * 3;
  const Function f = record("f", 1, [&](const VectorXad& x) { return one(before * x[0]); });
  EXPECT_EQ(evaluate(f, {2})[0], 12);
}

TEST(Lifetime, Case79_AValueDoesNotOutliveItsRecording) {
  AD kept;
  record("first", 1, [&](const VectorXad& x) { return one(kept = x[0] * 2); });
  EXPECT_NE(message_of([&] { kept = kept + 1; }).find("after its recording has ended"), std::string::npos);
  const auto second = [&](auto use) {
    return message_of([&] { record("second", 1, [&](const VectorXad& x) { return one(use(x[0])); }); });
  };
  for (const std::string& what :
       {second([&](const AD& x) { return x + kept; }), second([&](const AD& x) { return kept * x; }),
        second([&](const AD& x) { return select(x < 0, x, kept); }),
        second([&](const AD&) { return sin(kept); }), second([&](const AD&) { return kept; })}) {
    EXPECT_NE(what.find("a value of another recording"), std::string::npos) << what;
    EXPECT_NE(what.find("\"second\""), std::string::npos) << what;
  }
  kept = 1;  // assignment makes it whole again
  EXPECT_EQ((kept + 1).value(), 2);
}

// A recording within a recording, of its own values; a value of the other is refused, both are named.
TEST(Lifetime, Case85_ARecordingInsideARecording) {
  Function inner;
  const Function outer = record("outer", 2, [&](const VectorXad& x) {
    const AD before = x[0] * 2;
    inner = record("inner", 1, [](const VectorXad& y) { return one(y[0] * y[0]); });
    return one(before + sin(x[1]));
  });
  EXPECT_EQ(evaluate(inner, {3})[0], 9);
  EXPECT_EQ(evaluate(outer, {1, 0.5})[0], 2 + own::sin(0.5));
  EXPECT_EQ(content_hash(inner),
            content_hash(record("inner", 1, [](const VectorXad& y) { return one(y[0] * y[0]); })));

  const int line = __LINE__ + 3;
  const auto mixed = [&](auto use) {
    return message_of([&] {
      record("outer", 1, [&](const VectorXad& x) {
        record("inner", 1, [&](const VectorXad& y) { return one(use(x[0], y[0])); });
        return x;
      });
    });
  };
  const auto callee = recorded_callee(inner);
  for (const std::string& what :
       {mixed([](const AD&x, const AD&y) { return x + y; }),
        mixed([](const AD&x, const AD&y) { return y * x; }), mixed([](const AD&x, const AD&) { return x; }),
        mixed([](const AD&x, const AD&y) { return atan2(x, y); }),
        mixed([](const AD&x, const AD&y) { return select(x < y, x, y); }),
        mixed([&](const AD&x, const AD&) { return call(callee, one(x))[0]; })}) {
    EXPECT_NE(what.find("\"inner\", begun at"), std::string::npos) << what;
    EXPECT_NE(what.find("\"outer\", begun at"), std::string::npos) << what;
    EXPECT_NE(what.find("lifetime_test.cpp:" + std::to_string(line)), std::string::npos) << what;
  }
}

// Recordings side by side, whose operations alternate, are those that are made one after the other.
TEST(Recorder, SeveralAreOpenAtOnce) {
  const auto alone = [](const Program& program) { return content_hash(recorded(program)); };
  Random random(5);
  const Program a = random_program(random, 100), b = random_program(random, 100);
  EXPECT_NE(alone(a), alone(b));
  Recorder first("first", 2), second("second", 2, 1);
  AD u = first.x()[0], v = second.x()[0];
  for (int i = 0; i < 50; ++i) {
    u = sin(u) + first.x()[1];
    v = v * second.x()[1] + second.p()[0];
    if (i == 25) {
      EXPECT_EQ(alone(a), alone(a));  // and one within
    }
  }
  const Function g = second.end(one(v)), f = first.end(one(u));
  EXPECT_EQ(f.name, "first");
  EXPECT_EQ(g.n_x(), 2u);
  EXPECT_EQ(g.n_p(), 1u);
  EXPECT_EQ(content_hash(f), content_hash(record("first", 2, [](const VectorXad& x) {
              AD y = x[0];
              for (int i = 0; i < 50; ++i) y = sin(y) + x[1];
              return one(y);
            })));
  EXPECT_EQ(content_hash(g), content_hash(record("second", 2, 1, [](const VectorXad& x, const VectorXad& p) {
              AD y = x[0];
              for (int i = 0; i < 50; ++i) y = y * x[1] + p[0];
              return one(y);
            })));
}

TEST(Recorder, EndsOnce) {
  Recorder recorder("f", 1);
  const AD y = recorder.x()[0] + 1;
  EXPECT_EQ(evaluate(recorder.end(one(y)), {2})[0], 3);
  EXPECT_NE(message_of([&] { recorder.end(one(y)); }).find("\"f\" is over"), std::string::npos);
  EXPECT_NE(message_of([&] { static_cast<void>(y + 1); }).find("after its recording has ended"),
            std::string::npos);
}

// The recording that is named is one of those that meet, not the innermost.
TEST(Recorder, NamesTheRecordingOfTheValueThatIsOpen) {
  Recorder a("a", 1);
  AD over;
  {
    Recorder b("b", 1);
    over = b.x()[0];
  }
  Recorder c("c", 1);
  EXPECT_NE(message_of([&] { static_cast<void>(over + a.x()[0]); }).find("while \"a\" is recorded"),
            std::string::npos);
}

// Guards belong to the recording whose values are compared.
TEST(Recorder, GuardsStayWithTheirRecording) {
  Recorder first("first", 1);
  const AD x = first.x()[0];
  Recorder second("second", 1);
  const AD y = second.x()[0] * 2;
  if (x > 0.0) static_cast<void>(y + 1);
  EXPECT_EQ(second.end(one(y)).guards.size(), 0u);
  EXPECT_EQ(first.end(one(x)).guards.size(), 1u);
}

TEST(Recorder, AnotherThreadIsRefusedAndHarmless) {
  auto recorder = std::make_unique<Recorder>("here", 1);
  std::string what;
  std::thread([&] {
    what = message_of([&] { recorder->end(recorder->x()); });
    EXPECT_NE(message_of([&] { static_cast<void>(recorder->x()[0] + 1); }), "no error");
    recorder.reset();
  }).join();
  EXPECT_NE(what.find("in another thread"), std::string::npos) << what;
  const Function f = record("next", 1, [](const VectorXad& x) { return one(x[0] * 2); });
  EXPECT_EQ(evaluate(f, {2})[0], 4);
}

// Who records for others names their line, or none: never its own.
TEST(Lifetime, ErrorsNameTheLineThatIsHandedOn) {
  AD kept;
  record("first", 1, [&](const VectorXad& x) { return one(kept = x[0] * 2); });
  const auto mistake = [&](const VectorXad& x) { return one(kept * x[0]); };
  const std::string theirs = message_of([&] { record("f", 1, mistake, {}, "robot.cpp", 12); });
  EXPECT_NE(theirs.find("\"f\" is recorded, begun at robot.cpp:12: values"), std::string::npos) << theirs;
  const std::string none = message_of([&] { record("f", 1, mistake, {}, nullptr, 0); });
  EXPECT_NE(none.find("\"f\" is recorded: values"), std::string::npos) << none;
}

TEST(Lifetime, Case99_OneInterpreterManyThreads) {
  Random random(99);
  const Program program = random_program(random, 200);
  const Interpreter run(derive(recorded(program), Order::kSecond).function);
  const std::vector<double> w(run.function().n_w(), 0.5);
  std::vector<double> expected(run.function().n_y());
  Interpreter::Workspace workspace(run);
  run(program.x.data(), program.p.data(), w.data(), expected.data(), workspace);
  std::vector<int> differences(8, 0);
  in_threads(8, [&](int t) {
    Interpreter::Workspace own(run);
    std::vector<double> y(expected.size());
    for (int i = 0; i < 50; ++i) {
      run(program.x.data(), program.p.data(), w.data(), y.data(), own);
      differences[t] += y != expected;
    }
  });
  EXPECT_EQ(differences, std::vector<int>(8, 0));
}

TEST(Lifetime, Case100_EightThreadsRecordAtOnceAndManyShortOnes) {
  std::vector<std::string> alone(8), together(8);
  const auto work = [](int t) {
    Random random(static_cast<std::uint64_t>(t) + 1000);
    return content_hash(derive(recorded(random_program(random, 100)), Order::kSecond).function);
  };
  for (int t = 0; t < 8; ++t) alone[t] = work(t);
  in_threads(8, [&](int t) {
    for (int i = 0; i < 5; ++i) together[t] = work(t);
  });
  EXPECT_EQ(alone, together);
  for (int i = 0; i < 1000; ++i) {
    double y = 0;
    std::thread([&] {
      y = evaluate(record("f", 1, [](const VectorXad& x) { return one(x[0] * 2); }), {1.0 * i})[0];
    }).join();
    ASSERT_EQ(y, 2.0 * i);
  }
}

TEST(Lifetime, Case101_RecordedHereEvaluatedAndDestroyedThere) {
  auto f = std::make_unique<Function>(record("f", 1, [](const VectorXad& x) { return one(x[0] * x[0]); }));
  double y = 0;
  std::thread([&, g = std::move(f)]() mutable {
    y = evaluate(vjp(*g), {3}, {}, {1})[0];
    g.reset();
  }).join();
  EXPECT_EQ(y, 6);
}

TEST(Lifetime, Case103_AnExceptionEndsTheRecording) {
  for (int i = 0; i < 3; ++i) {
    EXPECT_THROW(record("thrower", 2,
                        [](const VectorXad& x) -> VectorXad {
                          const AD y = x[0] * x[1];
                          throw std::runtime_error(std::to_string(y.value()));
                        }),
                 std::runtime_error);
    EXPECT_EQ(evaluate(record("next", 1, [](const VectorXad& x) { return one(x[0] + 1); }), {1})[0], 2);
  }
}

// A thread keeps the memory of a recording for the next.
TEST(Lifetime, WhatWasRecordedBeforeLeavesNoTrace) {
  const auto record_long = [](int n) {
    return record("long", 2, [n](const VectorXad& x) {
      AD y = x[0];
      for (int i = 0; i < n; ++i) y = y * x[1] + double(i);
      return one(y);
    });
  };
  for (const int before : {0, 3, 1000, 500000}) {
    Random random(11);
    const Program program = random_program(random, 200);
    std::string fresh, after;
    std::thread([&] { fresh = content_hash(recorded(program)); }).join();
    std::thread([&] {
      const Function f = record_long(before);
      after = content_hash(recorded(program));
      EXPECT_EQ(f.graph.size(), record_long(before).graph.size());
    }).join();
    EXPECT_EQ(fresh, after) << "after " << before;
  }
}

TEST(Lifetime, Case104_BrokenGraphsAreRefused) {
  Function f = record("f", 2, [](const VectorXad& x) { return one(x[0] * x[1]); });
  f.inputs[0] = 1;  // the graph reads a second variable
  EXPECT_THROW(check(f), RecordingError);
  EXPECT_THROW(Interpreter{f}, RecordingError);
  EXPECT_THROW(compact(f), RecordingError);
  f = Function();
  f.outputs = {0};
  EXPECT_THROW(check(f), RecordingError);
}

TEST(Lifetime, Case105_AFunctionMayGoWhileAnotherIsRecorded) {
  auto old = std::make_unique<Function>(record("old", 1, [](const VectorXad& x) { return one(exp(x[0])); }));
  const Function f = record("new", 1, [&](const VectorXad& x) {
    const AD y = x[0] * 2;
    old.reset();
    return one(y + 1);
  });
  EXPECT_EQ(evaluate(f, {1})[0], 3);
}

TEST(Lifetime, AFunctionIsAValue) {
  const Function f = record("f", 1, [](const VectorXad& x) { return one(sin(x[0])); });
  Function g = f;
  g.graph.make(Op::Mul, 0, 0);
  g.outputs = {0};
  EXPECT_EQ(evaluate(f, {1})[0], own::sin(1.0));
  EXPECT_EQ(evaluate(g, {1})[0], 1);
}

}  // namespace
}  // namespace dyntape::testing::lifetime_test
