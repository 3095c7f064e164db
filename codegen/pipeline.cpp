// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/pipeline.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <optional>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/dump.h>
#include <dyntape/codegen/files.h>
#include <dyntape/codegen/simplify.h>
#include <dyntape/codegen/workshop.h>

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
    derivatives.push_back(derive(function, static_cast<Order>(order)));
  return derivatives;
}

std::vector<Derivatives> simplify_all(std::vector<Derivatives> derivatives, Profile profile) {
  for (Derivatives& d : derivatives) d = simplify(std::move(d), profile);
  return derivatives;
}

std::vector<KernelPlan> schedule_all(std::vector<Derivatives> derivatives, std::size_t piece_statements) {
  std::vector<KernelPlan> plans;
  for (Derivatives& d : derivatives) {
    std::vector<OutputRange> groups = {{0, d.n_y}};
    if (d.order >= Order::kFirst) groups.push_back({d.n_y, d.n_y + d.jacobian.nnz()});
    if (d.order >= Order::kSecond) groups.push_back({groups.back().end, d.function.n_y()});
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

}  // namespace

Product produce(const Function& recorded, const CodegenOptions& options) {
  Product product;
  Timings& t = product.timings;
  const Function& function = product.function = compact(recorded);
  const Dump dump(function.name);
  dump.graph("recorded", function);

  std::optional<Workshop> workshop;  // none: interpreted
  if (options.route != Route::kInterpreter)
    workshop = timed(t.hash, [&] { return Workshop::open(function, options); });
  if (workshop) {
    product.compiler = workshop->compiler().version;
    if (auto found = timed(t.load, [&] { return workshop->find(); }))
      return t.cache_hit = true, with_library(std::move(product), std::move(*found));
  }
  if (options.only_cached && options.route != Route::kInterpreter)
    throw NotCached("the cache has no library of \"" + function.name + "\"");

  const auto value = timed(t.derive, [&] { return simplify(function, options.profile); });
  auto derived = timed(t.derive, [&] { return derive_all(value, options.order); });
  derived = timed(t.derive, [&] { return simplify_all(std::move(derived), options.profile); });
  dump.graphs("derived", derived);
  if (!workshop) return product.interpreted = std::move(derived), product;

  KernelSets sets = kernel_sets(function, workshop->content(), options);
  sets.kernels =
      timed(t.schedule, [&] { return schedule_all(std::move(derived), options.piece_statements); });
  dump.schedules(sets.kernels);
  const Source source = timed(t.print, [&] { return print_c(sets); });
  dump.text("c", source.text);
  Draft draft = timed(t.compile, [&] { return workshop->compile(source); });
  const auto entry = timed(t.load, [&] { return workshop->publish(draft); });
  Loaded loaded = timed(t.load, [&] { return workshop->load(std::move(draft), entry, source); });
  return with_library(std::move(product), std::move(loaded));
}

}  // namespace codegen

codegen::Source generate_source(const Function& recorded, const CodegenOptions& options) {
  const Function function = compact(recorded);
  codegen::KernelSets sets = codegen::kernel_sets(function, content_hash(function), options);
  const Function value = codegen::simplify(function, options.profile);
  auto derived = codegen::simplify_all(codegen::derive_all(value, options.order), options.profile);
  sets.kernels = codegen::schedule_all(std::move(derived), options.piece_statements);
  return codegen::print_c(sets);
}

std::vector<std::string> write_source(const codegen::Source& source, const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw FileError(folder + ": cannot be made: " + error.message());
  const codegen::TemporaryFolder temporary(folder, ".dyntape-");
  std::vector<std::string> paths;
  for (const auto& [suffix, text] : {std::pair(".c", &source.text), std::pair(".h", &source.header)}) {
    const std::string file = source.name + suffix, draft = temporary.path() + "/" + file;
    codegen::write_file(draft, *text);
    paths.push_back(folder + "/" + file);
    if (std::rename(draft.c_str(), paths.back().c_str()) != 0)
      throw FileError(paths.back() + ": cannot be written");
  }
  return paths;
}

}  // namespace dyntape
