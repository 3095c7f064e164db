// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/system/files.h>

#include "route.h"
#include "text_bytes.h"

namespace dyntape::bench {
namespace {

constexpr std::size_t kBatch = 32;  // points a call, where a call takes several

double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// A compiled function with all states, one after the other and in lanes.
struct Batch {
  Batch(CompiledFunction function, const States& states)
      : f(std::move(function)), workspace(f), count(states.size()), width(f.lane_width()) {
    const std::size_t n = f.n_x();
    x.resize(count * n), in_lanes.resize(count * n), y.resize(kBatch * f.n_y());
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t k = 0; k < n; ++k)
        x[i * n + k] = in_lanes[(i / width * n + k) * width + i % width] =
            states[i][static_cast<Eigen::Index>(k)];
  }

  void one_by_one(std::size_t first, std::size_t points) {
    for (std::size_t i = first; i < first + points; ++i)
      f.value(&x[i % count * f.n_x()], nullptr, y.data(), workspace);
  }
  // As many calls as the end of the states and of the room for results want.
  template <class Call>
  void in_batches(std::size_t first, std::size_t points, Call call) {
    while (points) {
      const std::size_t i = first % count, n = std::min({kBatch, points, count - i});
      call(i, n);
      first += n, points -= n;
    }
  }
  void many(std::size_t first, std::size_t points) {
    in_batches(first, points, [&](std::size_t i, std::size_t n) {
      f.check(f.run(Order::kValue, {.count = n, .x = &x[i * f.n_x()], .y = y.data()}, workspace), n);
    });
  }
  void many_kept(std::size_t first, std::size_t points) {
    in_batches(first, points, [&](std::size_t i, std::size_t n) {
      const Points kept{.count = n, .x = &in_lanes[i * f.n_x()], .y = y.data(), .side_by_side = width};
      f.check(f.run(Order::kValue, kept, workspace), n);
    });
  }

  CompiledFunction f;
  CompiledFunction::Workspace workspace;
  std::size_t count, width;
  std::vector<double> x, in_lanes, y;
};

using Way = void (Batch::*)(std::size_t, std::size_t);

Route route(const std::string& name, const std::shared_ptr<Batch>& batch, Way way) {
  Route r;
  r.name = name;
  r.run = [batch, way](int first, int calls) {
    ((*batch).*way)(static_cast<std::size_t>(first), static_cast<std::size_t>(calls));
  };
  r.value = [batch, way](int state) {
    const auto i = static_cast<std::size_t>(state);
    const std::size_t n = batch->f.n_y();
    std::vector<double> y(n);
    if (way == &Batch::one_by_one) {
      batch->one_by_one(i, 1);
      return std::vector<double>(batch->y.begin(), batch->y.begin() + static_cast<std::ptrdiff_t>(n));
    }
    const std::size_t width = way == &Batch::many_kept ? batch->width : 1;  // of the results
    ((*batch).*way)(i / 8 * 8, 8);
    const std::size_t at = i % 8;
    for (std::size_t k = 0; k < n; ++k) y[k] = batch->y[(at / width * n + k) * width + at % width];
    return y;
  };
  r.operations = batch->f.operations(Order::kValue);
  return r;
}

struct Variant {
  const char* name;
  Functions functions;
  Lanes lanes = Lanes::kNone;
};
constexpr Variant kVariants[] = {{"generated", kDefaultFunctions},
                                 {"generated, libm", Functions::kLibm},
                                 {"lanes", Functions::kPortable, Lanes::kNative}};

CodegenOptions options_of(const Variant& variant, const std::string& cache) {
  CodegenOptions options;
  options.order = Order::kValue;
  options.route = dyntape::Route::kCompiled;
  options.functions = variant.functions;
  options.lanes = variant.lanes;
  options.cache_folder = cache;
  return options;
}

// Seconds from the robot to its first result while a compiler works; nothing is cached.
double first_result(const dynamics::Model<double>& model, const RobotFunction& function,
                    const Eigen::VectorXd& state) {
  const codegen::TemporaryFolder cold(codegen::system_temporary_folder(), "dyntape-");
  CodegenOptions options = options_of(kVariants[0], cold.path());
  options.route = dyntape::Route::kTiered;
  std::vector<double> y;
  std::optional<CompiledFunction> tiers;  // to end the compiler is not part of it
  return seconds_of([&] {
    const Function recorded = record_robot_function(model, function);
    tiers = CompiledFunction::make(recorded, options);
    CompiledFunction::Workspace room(*tiers);
    y.resize(recorded.n_y());
    tiers->value(state.data(), nullptr, y.data(), room);
  });
}

// Seconds from the recorded function to its first result, out of the cache.
double cached_result(const Function& recorded, const CodegenOptions& options, const Eigen::VectorXd& state) {
  std::vector<double> y(recorded.n_y());
  return seconds_of([&] {
    const auto f = CompiledFunction::make(recorded, options);
    CompiledFunction::Workspace room(f);
    f.value(state.data(), nullptr, y.data(), room);
  });
}

double least(int repetitions, const std::function<double()>& seconds) {
  double best = seconds();
  for (int i = 1; i < repetitions; ++i) best = std::min(best, seconds());
  return best;
}

}  // namespace

std::vector<Route> recorded_routes(const dynamics::Model<double>& model, const RobotFunction& function,
                                   const States& states) {
  std::vector<Route> routes;
  const Function recorded = record_robot_function(model, function);

  CodegenOptions interpreted = options_of(kVariants[0], "");
  interpreted.route = dyntape::Route::kInterpreter;
  const auto tape = std::make_shared<Batch>(CompiledFunction::make(recorded, interpreted), states);
  routes.push_back(route("interpreted", tape, &Batch::one_by_one));
  routes.back().first = least(5, [&] { return first_result(model, function, states[0]); });
  routes.push_back(route("interpreted, several", tape, &Batch::many));

  for (const Variant& variant : kVariants) {
    const codegen::TemporaryFolder cold(codegen::system_temporary_folder(), "dyntape-");
    const CodegenOptions options = options_of(variant, cold.path());
    std::shared_ptr<Batch> batch;
    const double made = seconds_of([&] {
      const Function again = record_robot_function(model, function);
      batch = std::make_shared<Batch>(CompiledFunction::make(again, options), states);
    });
    const bool many = variant.lanes != Lanes::kNone;
    Route r = route(variant.name, batch, many ? &Batch::many : &Batch::one_by_one);
    r.made = made;
    r.compile = batch->f.timings().compile;
    r.load = least(5, [&] { return cached_result(recorded, options, states[0]); });
    r.text = text_bytes(std::filesystem::path(batch->f.source_path()).replace_filename("library.so"));
    routes.push_back(r);
    if (many) routes.push_back(route(std::string(variant.name) + ", kept", batch, &Batch::many_kept));
  }
  return routes;
}

}  // namespace dyntape::bench
