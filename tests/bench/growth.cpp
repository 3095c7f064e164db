// SPDX-License-Identifier: BSD-3-Clause
//
// How the time of every stage grows with the size of the graph: up to a million nodes, 100 000 outputs, 100 000
// calls, in shapes that have been known to make a stage slow.
//
//   ninja -C build bench_growth && build/bin/bench_growth [--short] [SHAPE ...] >growth.csv
//
// Columns: the shape and the stage; nodes of the largest graph; processor seconds of the stage there; and the slope
// of log(seconds) over log(size) from a sixteenth of the size on.  1 is linear.  A last line for each shape names its
// steepest stage.  The exit status is 1 where a slope of a stage that takes a tenth of a second is above 1.2.
// --short stops at a quarter of the size.
#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/derive/sparsity.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/passes/outline.h>
#include <dyntape/codegen/pipeline.h>
#include <dyntape/codegen/schedule/schedule.h>
#include <dyntape/interface/files/info/section.h>
#include <dyntape/interface/io/csv.h>

namespace dyntape {
namespace {

using Index = Eigen::Index;

VectorXad one(const AD& y) { return VectorXad::Constant(1, y); }

// --- shapes: functions of about n nodes, outputs or calls ---

Function chain(std::size_t n) {
  return record("chain", 2, [&](const VectorXad& x) {
    AD v = x[0];
    for (std::size_t i = 0; i < n / 2; ++i) v = 0.999 * v + x[1];
    return one(v);
  });
}

Function nonlinear_chain(std::size_t n) {
  return record("nonlinear_chain", 1, [&](const VectorXad& x) {
    AD v = x[0];
    for (std::size_t i = 0; i < n / 2; ++i) v = sin(v) + x[0];
    return one(v);
  });
}

Function band(std::size_t n) {
  return record("band", n + 2, [&](const VectorXad& x) {
    VectorXad y(static_cast<Index>(n));
    for (Index i = 0; i < y.size(); ++i) y[i] = x[i] * sin(x[i + 1]) - x[i + 2];
    return y;
  });
}

// Outputs that are inputs or constants.
Function leaves(std::size_t n) {
  return record("leaves", n, [](const VectorXad& x) {
    VectorXad y(2 * x.size());
    for (Index i = 0; i < x.size(); ++i) y[2 * i] = x[i], y[2 * i + 1] = static_cast<double>(i);
    return y;
  });
}

std::shared_ptr<const Callee> small_callee() {
  static const auto callee =
      recorded_callee(record("small", 2, [](const VectorXad& x) { return one(x[0] * sin(x[1])); }));
  return callee;
}

Function calls(std::size_t n) {
  const auto callee = small_callee();
  return record("calls", n + 1, [&](const VectorXad& x) {
    VectorXad y(static_cast<Index>(n));
    for (Index i = 0; i < y.size(); ++i) y[i] = call(callee, VectorXad(x.segment(i, 2)))[0];
    return y;
  });
}

Function nested_calls(std::size_t n) {
  const auto callee = small_callee();
  return record("nested_calls", 2, [&](const VectorXad& x) {
    VectorXad v = x;
    for (std::size_t i = 0; i < n; ++i) v[1] = call(callee, v)[0] + static_cast<double>(i);
    return one(v[1]);
  });
}

// Each call is of a callee of its own.
Function callees(std::size_t n) {
  std::vector<std::shared_ptr<const Callee>> all;
  for (std::size_t i = 0; i < n; ++i) {
    const auto add = static_cast<double>(i);
    all.push_back(
        recorded_callee(record("own", 2, [&](const VectorXad& x) { return one(x[0] * sin(x[1]) + add); })));
  }
  return record("callees", n + 1, [&](const VectorXad& x) {
    VectorXad y(static_cast<Index>(n));
    for (Index i = 0; i < y.size(); ++i)
      y[i] = call(all[static_cast<std::size_t>(i)], VectorXad(x.segment(i, 2)))[0];
    return y;
  });
}

// What all outputs use: made of parameters, or of one variable.
Function shared(std::size_t n, bool of_parameters) {
  return record("shared", n / 4, 1, [&](const VectorXad& x, const VectorXad& p) {
    const AD start = of_parameters ? p[0] : x[0];
    AD v = start;
    for (std::size_t i = 0; i < n / 4; ++i) v = sin(v) + start;
    VectorXad y(x.size());
    for (Index i = 0; i < y.size(); ++i) y[i] = x[i] * v * v;
    return y;
  });
}
Function shared_parameters(std::size_t n) { return shared(n, true); }
Function shared_values(std::size_t n) { return shared(n, false); }

// A dense row, a dense column, and rows that couple neighbours.
Function arrow(std::size_t n) {
  return record("arrow", n / 4, [](const VectorXad& x) {
    VectorXad y(x.size());
    y[0] = 0;
    for (Index i = 1; i < y.size(); ++i) {
      y[0] = y[0] + x[i] * x[i];
      y[i] = x[i - 1] * x[i] + x[0];
    }
    return y;
  });
}

Function guards(std::size_t n) {
  return record("guards", n / 2, [](const VectorXad& x) {
    AD sum = 0;
    for (Index i = 0; i < x.size(); ++i) sum = x[i] > 0.0 ? sum + x[i] * x[i] : sum - x[i];
    return one(sum);
  });
}

Function selects(std::size_t n) {
  return record("selects", 8, [&](const VectorXad& x) {
    AD v = x[0];
    for (std::size_t i = 0; i < n / 4; ++i) {
      const AD t = x[static_cast<Index>(i % 8)];
      v = select(v < t, v * t, sin(v));
    }
    return one(v);
  });
}

// Four equal parts that meet now and then.
Function legs(std::size_t n) {
  return record("legs", 9, [&](const VectorXad& x) {
    VectorXad v = x.head(4);
    for (std::size_t i = 0; i < n / 16; ++i) {
      for (Index k = 0; k < 4; ++k) v[k] = sin(v[k]) * x[4 + k] + (1.5 + static_cast<double>(k)) * v[k];
      if (i % 8 == 0) v = v + VectorXad::Constant(4, v[0] * x[8] + v[1] * v[2] * v[3]);
    }
    return v;
  });
}

// Two parts with many outputs, no two of which are made of the same operators.
Function twins(std::size_t n) {
  return record("twins", 2, [&](const VectorXad& x) {
    VectorXad y(2 * static_cast<Index>(n / 32));
    for (Index k = 0; k < y.size(); ++k) {
      AD v = sin(x[k % 2]) * (2.0 + static_cast<double>(k % 2));
      for (Index bits = k / 2 + 1; bits; bits >>= 1) v = bits & 1 ? sin(v) : cos(v);
      y[k] = v * (1.5 + static_cast<double>(k % 2));
    }
    return y;
  });
}

// --- stages ---

double processor_seconds() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

struct Measured {
  double nodes = 0, seconds = 0;
};
using Stages = std::vector<std::pair<std::string, Measured>>;

// Runs stages and keeps what each took: the quickest of three runs, since what else the machine does can only add.
// What takes seconds runs once.
class Clock {
 public:
  template <class Stage>
  auto operator()(const char* name, double nodes, Stage&& stage) {
    double quickest = HUGE_VAL;
    auto result = timed(stage, quickest);
    for (int run = 1; run < kRuns && quickest < kLong; ++run) result = timed(stage, quickest);
    stages_.push_back({name, {nodes, quickest}});
    return result;
  }
  Stages stages_;

 private:
  static constexpr int kRuns = 3;
  static constexpr double kLong = 2;  // seconds

  template <class Stage>
  static auto timed(Stage&& stage, double& quickest) {
    const double start = processor_seconds();
    auto result = stage();
    quickest = std::min(quickest, processor_seconds() - start);
    return result;
  }
};

std::vector<codegen::OutputRange> groups_of(const Derivatives& d) {
  return {{0, d.n_y}, {d.n_y, d.n_y + d.jacobian.nnz()}};
}

Stages run_stages(Function (*make)(std::size_t), std::size_t n) {
  Clock clock;
  const Function f = clock("record", static_cast<double>(n), [&] { return make(n); });
  const auto nodes = static_cast<double>(f.graph.size());
  clock("compact", nodes, [&] { return compact(f); });
  clock("hash", nodes, [&] { return content_hash(f, 2); });
  clock("program", nodes, [&] { return Interpreter(f).function().n_y(); });
  clock("sparsity", nodes, [&] { return jacobian_sparsity(f); });
  clock("gradient", nodes, [&] { return vjp(f); });
  clock("second order", nodes, [&] { return derive(f, Order::kSecond); });
  const Derivatives d = clock("first order", nodes, [&] { return derive(f, Order::kFirst); });
  clock("outline", nodes, [&] { return codegen::outlined(d.function); });
  clock("schedule", nodes, [&] { return codegen::schedule(d.function, groups_of(d), 250); });
  clock("text", nodes, [&] { return generate_source(f).text.size(); });
  clock("embedded", nodes, [&] { return generate_embedded(f).source.text.size(); });
  return clock.stages_;
}

// --- tables and settings ---

Stages run_csv(std::size_t n) {
  Clock clock;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < n; ++i) names.push_back("column_" + std::to_string(i));
  io::CsvTable table = clock("make", static_cast<double>(n), [&] { return io::CsvTable(names); });
  table.append(std::vector<double>(n, 0.5));
  const std::string text = clock("write", static_cast<double>(n), [&] { return io::format_csv(table); });
  const io::CsvTable back =
      clock("read", static_cast<double>(n), [&] { return io::parse_csv(text, "table.csv"); });
  clock("find", static_cast<double>(n), [&] {
    int last = 0;
    for (const std::string& name : names) last = back.index(name);
    return last;
  });
  return clock.stages_;
}

Stages run_settings(std::size_t n) {
  Clock clock;
  std::string text = "list\n{\n";
  for (std::size_t i = 0; i < n; ++i)
    text += "  [" + std::to_string(i) + "] name_" + std::to_string(i) + "\n";
  text += "}\n";
  for (std::size_t i = 0; i < n; ++i) text += "block\n{\n  value 1.5\n}\n";
  io::Section top =
      clock("parse", static_cast<double>(n), [&] { return io::Section::parse(text, "settings.info"); });
  clock("ask", static_cast<double>(n), [&] {
    auto sum = static_cast<double>(top.strings_or("list", {}).size());
    for (io::Section& block : top.children("block")) sum += block.get<double>("value");
    return sum;
  });
  clock("finish", static_cast<double>(n), [&] { return top.finish(), 0; });
  return clock.stages_;
}

struct Shape {
  const char* name;
  std::size_t largest;
  std::function<Stages(std::size_t)> run;
};

std::vector<Shape> shapes() {
  const auto graph = [](const char* name, std::size_t largest, Function (*make)(std::size_t)) {
    return Shape{name, largest, [make](std::size_t n) { return run_stages(make, n); }};
  };
  return {graph("chain", 1000000, chain),
          graph("nonlinear_chain", 1000000, nonlinear_chain),
          graph("band", 100000, band),
          graph("leaves", 100000, leaves),
          graph("calls", 100000, calls),
          graph("nested_calls", 100000, nested_calls),
          graph("callees", 10000, callees),
          graph("shared_parameters", 1000000, shared_parameters),
          graph("shared_values", 1000000, shared_values),
          graph("arrow", 1000000, arrow),
          graph("guards", 1000000, guards),
          graph("selects", 1000000, selects),
          graph("legs", 1000000, legs),
          graph("twins", 1000000, twins),
          {"csv", 100000, run_csv},
          {"settings", 100000, run_settings}};
}

constexpr double kSteepest = 1.2, kCounts = 0.1;

bool report(const Shape& shape, const Stages& small, const Stages& large, double ratio) {
  std::string steepest = "none";
  double slope_of_steepest = 0;
  for (std::size_t i = 0; i < large.size(); ++i) {
    const auto& [name, measured] = large[i];
    const double slope = std::log(measured.seconds / small[i].second.seconds) / std::log(ratio);
    std::printf("%s,%s,%.0f,%.3g,%.2f\n", shape.name, name.c_str(), measured.nodes, measured.seconds, slope);
    if (measured.seconds < kCounts || slope <= slope_of_steepest) continue;
    slope_of_steepest = slope, steepest = name;
  }
  std::printf("%s,steepest: %s,,,%.2f\n", shape.name, steepest.c_str(), slope_of_steepest);
  std::fflush(stdout);
  return slope_of_steepest <= kSteepest;
}

bool is_wanted(const Shape& shape, const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    if (name == shape.name) return true;
  }
  return names.empty();
}

int run(std::size_t divisor, const std::vector<std::string>& names) {
  constexpr std::size_t kRatio = 16;
  bool is_linear = true;
  std::printf("shape,stage,nodes,seconds,slope\n");
  for (const Shape& shape : shapes()) {
    if (!is_wanted(shape, names)) continue;
    const std::size_t n = shape.largest / divisor;
    shape.run(n / kRatio);  // memory that is there already costs less
    const Stages small = shape.run(n / kRatio), large = shape.run(n);
    is_linear = report(shape, small, large, kRatio) && is_linear;
  }
  return is_linear ? 0 : 1;
}

}  // namespace
}  // namespace dyntape

int main(int count, char** arguments) {
  // Memory that was returned would be cleared by the system page by page, and only large blocks are returned.
  mallopt(M_MMAP_MAX, 0);
  mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
  std::vector<std::string> names(arguments + 1, arguments + count);
  const bool is_short = !names.empty() && names[0] == "--short";
  if (is_short) names.erase(names.begin());
  try {
    return dyntape::run(is_short ? 4 : 1, names);
  } catch (const std::exception& e) {
    return std::fprintf(stderr, "bench_growth: %s\n", e.what()), 2;
  }
}
