// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/pipeline.h>

#include <chrono>
#include <optional>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/codegen/dump.h>
#include <dyntape/codegen/flags.h>
#include <dyntape/codegen/passes/outline.h>
#include <dyntape/codegen/passes/simplify.h>
#include <dyntape/codegen/pipeline_stages.h>
#include <dyntape/codegen/system/files.h>
#include <dyntape/codegen/system/warn_once.h>

namespace dyntape {
namespace codegen {
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

std::vector<Derivatives> derive_all(const Function& function, Order highest) {
  std::vector<Derivatives> derivatives;
  for (int order = 0; order <= static_cast<int>(highest); ++order)
    derivatives.push_back(dyntape::derive(function, static_cast<Order>(order)));
  return derivatives;
}

// Value and derivatives up to options.order.
std::vector<Derivatives> derive_simplified(const Function& function, const CodegenOptions& options,
                                           bool has_fma) {
  std::vector<Derivatives> derivatives =
      derive_all(simplify(function, options.profile, has_fma), options.order);
  for (Derivatives& d : derivatives) d = simplify(std::move(d), options.profile, has_fma);
  return derivatives;
}

// Repeated parts as functions fit the cache, and cost a tenth more instructions: several lanes spend those, one
// state is bound by the fetching of code (docs/architecture.md).
std::vector<KernelPlan> schedule_all(std::vector<Derivatives> derivatives, std::size_t piece_statements,
                                     bool outlines) {
  std::vector<KernelPlan> plans;
  for (Derivatives& d : derivatives) {
    std::vector<OutputRange> groups = {{0, d.n_y}};
    if (d.order >= Order::kFirst) groups.push_back({d.n_y, d.n_y + d.jacobian.nnz()});
    if (d.order >= Order::kSecond) groups.push_back({groups.back().end, d.function.n_y()});
    if (outlines) d.function = outlined(d.function);
    Schedule s = schedule(d.function, groups, piece_statements);
    plans.push_back({std::move(d), std::move(s)});
  }
  return plans;
}

KernelSets kernel_sets(const Function& function, const std::string& content, const CodegenOptions& options) {
  return {function,
          options.label.empty() ? function.name : options.label,
          content,
          options.profile,
          {},
          options.piece_statements,
          options.functions};
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
    warn_once(reason.substr(0, reason.find('\n')) + "; derivatives are interpreted");
    return std::nullopt;
  }
}

// Between stages: a derivation or a text that nobody waits for any more is not begun.
void check_stop(const Product& product, const CodegenOptions& options) {
  if (options.stop.stop_requested())
    throw ToolError("the compilation of \"" + product.function.name + "\" was told to stop");
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
  if (options.route == Route::kInterpreter) return std::nullopt;
  return unless_unavailable(options, [&] { return found(product, options); });
}

std::vector<Derivatives> derive(Product& product, const CodegenOptions& options) {
  Timings& t = product.timings;
  auto derived =
      timed(t.derive, [&] { return derive_simplified(product.function, options, has_fma(options.flags)); });
  Dump(product.function.name).graphs("derived", derived);
  return derived;
}

Source print(Product& product, std::vector<Derivatives> derived, const LibraryBuilder& builder,
             const CodegenOptions& options) {
  Timings& t = product.timings;
  const Dump dump(product.function.name);
  KernelSets sets = kernel_sets(product.function, builder.content(), options);
  sets.kernels = timed(t.schedule, [&] {
    return schedule_all(std::move(derived), options.piece_statements, options.lanes == Lanes::kNone);
  });
  dump.schedules(sets.kernels);
  Source source = timed(t.print, [&] { return print_c(sets); });
  dump.text("c", source.text);
  return source;
}

Product make(Product product, const Source& source, const LibraryBuilder& builder) {
  Timings& t = product.timings;
  Draft draft = timed(t.compile, [&] { return builder.compile(source); });
  Loaded loaded = timed(t.load, [&] { return builder.load(std::move(draft)); });
  return with_library(std::move(product), std::move(loaded));
}

Product produce(const Function& recorded, const CodegenOptions& options) {
  Product product = begin(recorded);
  const std::optional<LibraryBuilder> builder = find(product, options);
  if (product.library) return product;
  if (options.only_cached && options.route != Route::kInterpreter)
    throw NotCached("the cache has no library of \"" + product.function.name + "\"");
  check_stop(product, options);
  auto derived = derive(product, options);
  check_stop(product, options);
  const auto made = unless_unavailable(options, [&]() -> std::optional<Product> {
    if (!builder) return std::nullopt;
    const Source source = print(product, derived, *builder, options);
    check_stop(product, options);
    return make(product, source, *builder);
  });
  if (made) return *made;
  product.interpreted = std::move(derived);
  return product;
}

}  // namespace codegen

namespace {

// Derived, simplified, scheduled; then print(sets).
template <class Print>
auto generate(const Function& recorded, const CodegenOptions& options, bool has_fma, bool outlines,
              Print&& print) {
  const Function function = compact(recorded);
  codegen::KernelSets sets = codegen::kernel_sets(function, content_hash(function), options);
  auto derived = codegen::derive_simplified(function, options, has_fma);
  sets.kernels = codegen::schedule_all(std::move(derived), options.piece_statements, outlines);
  return print(sets);
}

}  // namespace

codegen::Source generate_source(const Function& recorded, const CodegenOptions& options) {
  return generate(recorded, options, codegen::has_fma(options.flags), options.lanes == Lanes::kNone,
                  [](const codegen::KernelSets& sets) { return codegen::print_c(sets); });
}

codegen::EmbeddedSource generate_embedded(const Function& recorded, const CodegenOptions& options,
                                          const codegen::EmbeddedOptions& how) {
  // The target is another one, and may have to do without.
  return generate(recorded, options, false, false,
                  [&](const codegen::KernelSets& sets) { return codegen::print_embedded(sets, how); });
}

std::vector<std::string> write_source(const codegen::Source& source, const std::string& folder) {
  std::vector<std::string> paths;
  for (const auto& [suffix, text] : {std::pair(".c", &source.text), std::pair(".h", &source.header)}) {
    paths.push_back((folder.empty() ? "" : folder + "/") + source.name + suffix);  // "": the current folder
    write_file_atomically(paths.back(), *text);
  }
  return paths;
}

}  // namespace dyntape
