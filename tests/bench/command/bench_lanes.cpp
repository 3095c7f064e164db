// SPDX-License-Identifier: BSD-3-Clause
#include "bench_lanes.h"

#include <algorithm>
#include <chrono>

#include <dyntape/autodiff/graph/nonzero_outputs.h>
#include <dyntape/codegen/compiled_function.h>

#include "measure.h"

namespace dyntape::tools {
namespace {

// All states in blocks of `width`, the last one repeated where they do not fill the last block.
std::vector<double> in_blocks(const std::vector<Eigen::VectorXd>& states, std::size_t n, std::size_t width) {
  const std::size_t blocks = (states.size() + width - 1) / width;
  std::vector<double> values(blocks * n * width);
  for (std::size_t i = 0; i < blocks * width; ++i) {
    const Eigen::VectorXd& state = states[std::min(i, states.size() - 1)];
    for (std::size_t k = 0; k < n; ++k)
      values[(i / width * n + k) * width + i % width] = state[static_cast<Eigen::Index>(k)];
  }
  return values;
}

// Compiled afresh, with the time that took.
struct Made {
  CompiledFunction function;
  double prepare;
};

Made make(const Function& recorded, Lanes lanes) {
  CodegenOptions options;
  options.order = Order::kValue;
  options.route = Route::kCompiled;
  options.use_cache = false;
  options.functions = Functions::kPortable;
  options.lanes = lanes;
  const auto start = std::chrono::steady_clock::now();
  CompiledFunction f = CompiledFunction::make(recorded, options);
  return {std::move(f), std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()};
}

double seconds_a_state(const CompiledFunction& f, const Points& points,
                       CompiledFunction::Workspace& workspace) {
  return median_seconds([&](std::size_t) { (void)f.run(Order::kValue, points, workspace); }) /
         static_cast<double>(points.count);
}

}  // namespace

std::vector<LaneRow> measure_lanes(const dynamics::Model<double>& model, const RobotFunction& function,
                                   const std::vector<Eigen::VectorXd>& states,
                                   const std::vector<std::vector<double>>& expected) {
  const Function recorded = record_robot_function(model, function);
  const NonzeroOutputs nonzero = nonzero_outputs(recorded);
  struct Asked {
    Lanes lanes;
    bool nonzeros;
  };
  std::vector<LaneRow> rows;
  for (const auto [lanes, nonzeros] :
       {Asked{Lanes::kNone, false}, {Lanes::kNative, false}, {Lanes::kNative, true}}) {
    if (nonzeros && nonzero.function.n_y() == recorded.n_y()) continue;
    const auto [f, prepare] = make(nonzeros ? nonzero.function : recorded, lanes);
    CompiledFunction::Workspace workspace(f);
    LaneRow row;
    row.prepare = prepare;
    row.compile = f.timings().compile;
    row.operations = f.operations(Order::kValue);

    const std::size_t width = f.lane_width(), n = f.n_x(), count = states.size();
    const std::vector<double> x = in_blocks(states, n, 1), blocks = in_blocks(states, n, width);
    const std::size_t padded = blocks.size() / std::max<std::size_t>(n, 1);
    std::vector<double> y(padded * f.n_y()), whole(recorded.n_y());
    Points points{.count = count, .x = x.data(), .y = y.data()};
    const std::string what = nonzeros ? ", non-zeros" : "";
    row.name = width == 1 ? "generated, portable" : "generated, " + std::to_string(width) + " lanes" + what;
    f.check(f.run(Order::kValue, points, workspace), count);
    for (std::size_t i = 0; i < count; ++i) {
      const double* result = &y[i * f.n_y()];
      if (nonzeros) nonzero.expand(result, whole.data()), result = whole.data();
      const double error = relative_error(expected[i], result, outputs(model, function));
      row.error = error <= row.error ? row.error : error;
    }
    row.seconds = seconds_a_state(f, points, workspace);
    rows.push_back(row);
    if (width == 1) continue;
    points.count = padded, points.x = blocks.data(), points.side_by_side = width;
    row.name = "the same, kept in lanes";
    row.seconds = seconds_a_state(f, points, workspace);
    rows.push_back(row);
  }
  return rows;
}

}  // namespace dyntape::tools
