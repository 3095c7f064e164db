// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/ocs2/ad_function.h>

#include <chrono>
#include <cstdio>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/stopwatch.h>
#include <dyntape/interface/ocs2/ad_function_model.h>

namespace dyntape {
namespace {

using Clock = std::chrono::steady_clock;

Order order_of(AdFunction::ApproximationOrder order) { return static_cast<Order>(order); }

std::vector<double> recording_point(const vector_t& point) { return {point.begin(), point.end()}; }

AdFunctionSettings settings_of(std::string name, std::string folder, std::vector<std::string> flags) {
  AdFunctionSettings settings;
  settings.name = std::move(name);
  settings.folder = std::move(folder);
  settings.flags = std::move(flags);
  return settings;
}

AdFunction::ad_parameterized_function_t without_parameters(AdFunction::ad_function_t function) {
  if (!function) return nullptr;
  return [f = std::move(function)](const ad_vector_t& x, const ad_vector_t&, ad_vector_t& y) { f(x, y); };
}

// One line about what was made: "norm": compiled, 12 operations (value 4, with Jacobian 12), 0.31 s
void report(const AdFunctionStatistics& s, const std::string& name) {
  static constexpr const char* kKernels[] = {"value ", ", with Jacobian ", ", with Hessian "};
  std::string operations;
  for (std::size_t k = 0; k < s.operations.size(); ++k) {
    operations += kKernels[k] + std::to_string(s.operations[k]);
  }
  const char* how = s.timings.cache_hit ? "loaded from the cache" : s.route.c_str();
  std::fprintf(stderr, "dyntape: \"%s\": %s in %.3f s; operations: %s%s%s\n", name.c_str(), how,
               s.timings.total(), operations.c_str(), s.sourcePath.empty() ? "" : "; ", s.sourcePath.c_str());
}

}  // namespace

std::vector<std::string> AdFunction::defaultCompileFlags() {
  return {"-O3", "-g", "-march=native", "-mtune=native"};
}

AdFunction::AdFunction(ad_parameterized_function_t function, std::size_t variableDim,
                       std::size_t parameterDim, std::string modelName, std::string folderName,
                       std::vector<std::string> compileFlags, const char* file, int line)
    : AdFunction(std::move(function), variableDim, parameterDim,
                 settings_of(std::move(modelName), std::move(folderName), std::move(compileFlags)), file,
                 line) {}

AdFunction::AdFunction(ad_function_t function, std::size_t variableDim, std::string modelName,
                       std::string folderName, std::vector<std::string> compileFlags, const char* file,
                       int line)
    : AdFunction(without_parameters(std::move(function)), variableDim, 0,
                 settings_of(std::move(modelName), std::move(folderName), std::move(compileFlags)), file,
                 line) {}

AdFunction::AdFunction(ad_parameterized_function_t function, std::size_t variableDim,
                       std::size_t parameterDim, AdFunctionSettings settings, const char* file, int line)
    : function_(std::move(function)),
      variable_dim_(variableDim),
      parameter_dim_(parameterDim),
      settings_(std::move(settings)),
      file_(file),
      line_(line) {
  if (!function_) throw ArgumentError("AdFunction \"" + settings_.name + "\" is given no function");
}

Function AdFunction::record_function() const {
  RecordOptions options;
  options.variables = recording_point(settings_.variables);
  options.parameters = recording_point(settings_.parameters);
  return record(
      settings_.name, variable_dim_, parameter_dim_,
      [this](const VectorXad& x, const VectorXad& p) {
        VectorXad y;
        function_(x, p, y);
        return y;
      },
      options, file_, line_);
}

CodegenOptions AdFunction::options(Order order) const {
  CodegenOptions options = settings_.codegen;
  options.order = order;
  options.cache_folder = settings_.folder;
  options.flags = settings_.flags;
  options.label = settings_.name;
  return options;
}

void AdFunction::build(Order order, bool rebuild, bool verbose) {
  const auto start = Clock::now();
  const Function function = record_function();
  const double seconds = seconds_since(start);
  const CodegenOptions chosen = options(order);
  CodegenOptions now = chosen;
  now.force_rebuild = rebuild;
  model_ = std::make_shared<const Model>(CompiledFunction::make(function, now), chosen, settings_.threads,
                                         seconds);
  if (verbose) report(statistics(), settings_.name);
}

void AdFunction::createModels(ApproximationOrder order, bool verbose) {
  build(order_of(order), settings_.forceRebuild, verbose);
}

void AdFunction::loadModelsIfAvailable(ApproximationOrder order, bool verbose) {
  build(order_of(order), false, verbose);
}

// Of the highest order in that range that the cache has; null: it has none.
std::shared_ptr<const AdFunction::Model> AdFunction::cached(const Function& function, Order lowest,
                                                            Order highest, double seconds) const {
  for (int order = static_cast<int>(highest); order >= static_cast<int>(lowest); --order) {
    const CodegenOptions chosen = options(static_cast<Order>(order));
    CodegenOptions look = chosen;
    look.only_cached = true;
    try {
      return std::make_shared<const Model>(CompiledFunction::make(function, look), chosen, settings_.threads,
                                           seconds);
    } catch (const NotCached&) {  // perhaps of a lower one
    }
  }
  return nullptr;
}

void AdFunction::loadModels(bool verbose) {
  const auto start = Clock::now();
  const Function function = record_function();
  auto found = cached(function, Order::kValue, Order::kSecond, seconds_since(start));
  if (!found) {
    throw NotCached("loadModels: the cache has no library of the function \"" + settings_.name +
                    "\" with these flags and this compiler; createModels or loadModelsIfAvailable make one");
  }
  model_ = std::move(found);
  if (verbose) report(statistics(), settings_.name);
}

void AdFunction::loadModelsOfAtLeast(ApproximationOrder order, bool verbose) {
  const Route route = settings_.codegen.route;
  const auto start = Clock::now();
  const Function function = record_function();
  const double seconds = seconds_since(start);
  std::shared_ptr<const Model> found;
  if (route != Route::kInterpreter && route != Route::kMachineCode)  // which no cache keeps
    found = cached(function, order_of(order), Order::kSecond, seconds);
  if (!found) {
    const CodegenOptions chosen = options(order_of(order));
    found = std::make_shared<const Model>(CompiledFunction::make(function, chosen), chosen, settings_.threads,
                                          seconds);
  }
  model_ = std::move(found);
  if (verbose) report(statistics(), settings_.name);
}

AdFunctionStatistics AdFunction::statistics() const {
  const Model& m = model("statistics");
  const CompiledFunction& f = m.compiled();
  AdFunctionStatistics s;
  s.route = to_string(f.route());
  s.timings = f.timings();
  s.timings.record = m.record_seconds;
  for (int k = 0; k <= static_cast<int>(f.order()); ++k) {
    s.operations.push_back(f.operations(static_cast<Order>(k)));
  }
  if (f.order() >= Order::kFirst) s.jacobianNonZeros = f.jacobian_pattern().nnz();
  if (f.order() >= Order::kSecond) s.hessianNonZeros = f.hessian_pattern().nnz();
  s.sourcePath = f.source_path();
  return s;
}

const AdFunction::Model& AdFunction::model(const char* asked_for, Order order) const {
  static constexpr const char* kOrders[] = {"Zero", "First", "Second"};
  if (!model_) {
    throw ArgumentError(std::string(asked_for) + " of \"" + settings_.name +
                        "\": there is no model yet; call createModels or loadModelsIfAvailable first");
  }
  const Order made = model_->compiled().order();
  if (made < order)
    throw ArgumentError(std::string(asked_for) + " of \"" + settings_.name + "\" needs order " +
                        kOrders[static_cast<int>(order)] + ", the model was created with order " +
                        kOrders[static_cast<int>(made)]);
  return *model_;
}

void AdFunction::waitForCompiler() const { model("waitForCompiler").compiled().wait(); }

std::size_t AdFunction::rangeDim() const { return model("rangeDim").compiled().n_y(); }

AdFunction::ApproximationOrder AdFunction::order() const {
  return static_cast<ApproximationOrder>(model("order").compiled().order());
}

const Function& AdFunction::recorded() const { return model("recorded").compiled().function(); }

const Pattern& AdFunction::jacobianPattern() const {
  return model("jacobianPattern", Order::kFirst).compiled().jacobian_pattern();
}

const Pattern& AdFunction::hessianPattern() const {
  return model("hessianPattern", Order::kSecond).compiled().hessian_pattern();
}

}  // namespace dyntape
