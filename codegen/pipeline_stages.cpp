// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/pipeline_stages.h>

#include <chrono>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/dump.h>
#include <dyntape/codegen/passes/outline.h>
#include <dyntape/codegen/print/print_c.h>
#include <dyntape/codegen/system/warn_once.h>

namespace dyntape::codegen {
namespace {

// Runs a stage and adds the time it took.
template <class Stage>
auto timed(double& seconds, Stage&& stage) {
  struct Clock {
    double& seconds;
    std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
    ~Clock() { seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); }
  } clock{seconds};
  return stage();
}

std::vector<Derivatives> derive_all(const Function& function, const CodegenOptions& options) {
  std::vector<Derivatives> derivatives;
  for (int order = 0; order <= static_cast<int>(options.order); ++order)
    derivatives.push_back(dyntape::derive(function, static_cast<Order>(order)));
  return derivatives;
}

// Repeated parts as functions fit the cache, and cost a tenth more instructions: several lanes spend those, one
// state is limited by instruction fetch (docs/architecture.md).
std::vector<KernelPlan> schedule_all(std::vector<Derivatives> derivatives, const CodegenOptions& options,
                                     bool outlines, StatementOrder order) {
  std::vector<KernelPlan> plans;
  for (Derivatives& d : derivatives) {
    std::vector<OutputRange> groups = {{0, d.n_y}};
    if (d.order >= Order::kFirst) groups.push_back({d.n_y, d.n_y + d.jacobian.nnz()});
    if (d.order >= Order::kSecond) groups.push_back({groups.back().end, d.function.n_y()});
    if (outlines) d.function = outlined(d.function);
    Schedule s = schedule(d.function, groups, options.piece_statements, options.functions, order);
    plans.push_back({std::move(d), std::move(s)});
  }
  return plans;
}

Product with_library(Product product, Loaded loaded) {
  product.library = std::move(loaded.library);
  product.source_path = std::move(loaded.source_path);
  return product;
}

// What stage() returns.  Where the surroundings do not allow it, and nobody insists, nothing, and why is said.
template <class Stage>
auto unless_unavailable(const CodegenOptions& options, Stage&& stage) -> decltype(stage()) {
  try {
    return stage();
  } catch (const Unavailable& e) {
    if (options.route == Route::kCompiled) throw;
    const std::string reason = e.what();
    warn_once(reason.substr(0, reason.find('\n')) + "; functions are not compiled");
    return std::nullopt;
  }
}

// Between stages: a derivation or text whose caller is gone is not begun.
void check_stop(const Product& product, const CodegenOptions& options) {
  if (options.stop.stop_requested())
    throw ToolError("the compilation of \"" + product.function.name + "\" was interrupted");
}

std::optional<LibraryBuilder> found(Product& product, const CodegenOptions& options) {
  Timings& t = product.timings;
  auto builder = timed(t.hash, [&] { return LibraryBuilder::open(product.function, options); });
  if (!builder) return std::nullopt;
  product.compiler = builder->compiler().version;
  if (auto loaded = timed(t.load, [&] { return builder->find(); })) {
    t.cache_hit = true;
    product = with_library(std::move(product), std::move(*loaded));
  }
  return builder;
}

}  // namespace

Product begin(const Function& recorded) {
  Product product;
  product.function = compact(recorded);
  Dump(product.function.name).graph("recorded", product.function);
  return product;
}

std::optional<LibraryBuilder> find(Product& product, const CodegenOptions& options) {
  if (options.route == Route::kInterpreter || options.route == Route::kMachineCode) return std::nullopt;
  return unless_unavailable(options, [&] { return found(product, options); });
}

std::vector<Derivatives> derive(Product& product, const CodegenOptions& options) {
  auto derived = timed(product.timings.derive, [&] { return derive_all(product.function, options); });
  Dump(product.function.name).graphs("derived", derived);
  return derived;
}

KernelSets plan(Product& product, std::vector<Derivatives> derived, const std::string& content,
                const CodegenOptions& options, bool outlines, StatementOrder order) {
  const Function& f = product.function;
  auto plans = timed(product.timings.schedule,
                     [&] { return schedule_all(std::move(derived), options, outlines, order); });
  Dump(f.name).schedules(plans);
  return {f,
          options.label.empty() ? f.name : options.label,
          content,
          std::move(plans),
          options.piece_statements,
          options.functions};
}

Source print(Product& product, std::vector<Derivatives> derived, const std::string& content,
             const CodegenOptions& options) {
  const KernelSets sets = plan(product, std::move(derived), content, options, options.lanes == Lanes::kNone);
  Source source = timed(product.timings.print, [&] { return print_c(sets); });
  Dump(product.function.name).text("c", source.text);
  return source;
}

Product make(Product product, const Source& source, const LibraryBuilder& builder) {
  Timings& t = product.timings;
  Draft draft = timed(t.compile, [&] { return builder.compile(source); });
  Loaded loaded = timed(t.load, [&] { return builder.load(std::move(draft)); });
  return with_library(std::move(product), std::move(loaded));
}

Product make_at_once(Product product, std::vector<Derivatives> derived, const CodegenOptions& options) {
  if (options.route != Route::kInterpreter && MachineCode::is_possible()) {
    try {
      product.machine = timed(product.timings.compile, [&] { return MachineCode::make(derived, options); });
      Dump(product.function.name).machine(*product.machine);
    } catch (const Unavailable& e) {
      warn_once(std::string(e.what()) + "; derivatives are interpreted");
    }
  }
  product.derived = std::move(derived);
  return product;
}

Product produce(const Function& recorded, const CodegenOptions& options) {
  Product product = begin(recorded);
  const std::optional<LibraryBuilder> builder = find(product, options);
  if (product.library) return product;
  const bool may_compile = options.route != Route::kInterpreter && options.route != Route::kMachineCode;
  if (options.only_cached && may_compile)
    throw NotCached("the cache has no library of \"" + product.function.name + "\"");
  check_stop(product, options);
  auto derived = derive(product, options);
  check_stop(product, options);
  const auto made = unless_unavailable(options, [&]() -> std::optional<Product> {
    if (!builder) return std::nullopt;
    const Source source = print(product, derived, builder->content(), options);
    check_stop(product, options);
    return make(product, source, *builder);
  });
  if (made) return *made;
  return make_at_once(std::move(product), std::move(derived), options);
}

}  // namespace dyntape::codegen
