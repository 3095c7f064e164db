// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape doctor: is everything there that dyntape uses, and does the way from a recording to a library work?
#include <boost/version.hpp>

#include <sundials/sundials_config.h>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/processor_level.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/build/compile.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/store/cache.h>
#include <dyntape/codegen/system/files.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/report/plot/picture.h>

#include "commands.h"
#include "host.h"

namespace dyntape::tools {
namespace {

struct Finding {
  std::string what, found;
  bool ok = true;
};

Finding compiler() {
  const auto found = codegen::find_compiler("", {});
  if (!found) return {"compiler", codegen::no_compiler(""), false};
  return {"compiler", found->path + ", " + found->version};
}

Finding cache() {
  const auto found = codegen::Cache::open("");
  if (!found) return {"cache", "the folder " + codegen::Cache::usual_folder() + " cannot be used", false};
  return {"cache", found->folder() + ", " + std::to_string(found->list().size()) + " libraries"};
}

// The whole way, outside the cache: record, derive, print, compile, load, and the same bits as the interpreter.
Finding pipeline() {
  const Function f = record("doctor", 2, [](const VectorXad& x) {
    VectorXad y(1);
    y[0] = sin(x[0]) * exp(x[1]) / (1.0 + x[0] * x[0]);
    return y;
  });
  CodegenOptions options;
  options.order = Order::kSecond;
  options.use_cache = false;
  options.route = Route::kCompiled;
  const auto compiled = CompiledFunction::make(f, options);
  options.route = Route::kInterpreter;
  const auto interpreted = CompiledFunction::make(f, options);
  const double x[] = {0.3, -1.2}, w[] = {1};
  const auto evaluate = [&](const CompiledFunction& g) {
    std::vector<double> result(1 + g.jacobian_pattern().nnz() + g.hessian_pattern().nnz());
    CompiledFunction::Workspace workspace(g);
    g.second_order(x, nullptr, w, result.data(), result.data() + 1,
                   result.data() + 1 + g.jacobian_pattern().nnz(), workspace);
    return result;
  };
  const bool same = evaluate(compiled) == evaluate(interpreted);
  return {"pipeline",
          same ? "generated code equals the interpreter bit for bit (compiled in " +
                     io::duration(compiled.timings().compile) + ")"
               : "generated code differs from the interpreter",
          same};
}

Finding pictures() {
  const codegen::TemporaryFolder folder(codegen::system_temporary_folder(), "dyntape-");
  io::Plot plot;
  plot.panels = {{.title = "doctor", .series = {{.name = "y", .x = {0, 1}, .y = {0, 1}}}}};
  io::draw(plot, folder.path() + "/plot.svg");
  return {"pictures", "gnuplot draws"};
}

Finding attempt(const char* what, Finding (*examine)()) {
  try {
    return examine();
  } catch (const Error& e) {
    return {what, e.what(), false};
  }
}

std::vector<Finding> examine() {
  return {
      {"dyntape", DYNTAPE_VERSION},
      {"processor", processor_name() + "; dyntape's code for " + processor_level()},
      attempt("compiler", compiler),
      attempt("cache", cache),
      attempt("pipeline", pipeline),
      attempt("pictures", pictures),
      {"Eigen", std::to_string(EIGEN_WORLD_VERSION) + "." + std::to_string(EIGEN_MAJOR_VERSION) + "." +
                    std::to_string(EIGEN_MINOR_VERSION)},
      {"Boost", std::to_string(BOOST_VERSION / 100000) + "." + std::to_string(BOOST_VERSION / 100 % 1000)},
      {"Ipopt", DYNTAPE_IPOPT_VERSION},
      {"SUNDIALS", SUNDIALS_VERSION},
      {"urdfdom", DYNTAPE_URDFDOM_VERSION}};
}

}  // namespace

void add_doctor(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "doctor",
      "check compiler, cache folder, processor and libraries, and the whole way from recording to library");
  const auto json = std::make_shared<bool>(false);
  command->add_flag("--json", *json, "for programs");
  command->callback([json] {
    const std::vector<Finding> findings = examine();
    bool ok = true;
    nlohmann::json rows = nlohmann::json::array();
    io::TextTable table({{""}, {"part"}, {"found"}});
    for (const Finding& f : findings) {
      ok = ok && f.ok;
      rows.push_back({{"part", f.what}, {"found", f.found}, {"ok", f.ok}});
      table.append({f.ok ? "ok" : "FAILS", f.what, f.found});
    }
    std::cout << (*json ? nlohmann::json{{"ok", ok}, {"findings", rows}}.dump(2) + "\n" : table.text());
    if (!ok) throw Failure{};
  });
}

}  // namespace dyntape::tools
