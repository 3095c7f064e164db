// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape doctor: is everything there that dyntape uses, and does the way from a recording to a library work?
#include <boost/version.hpp>

#include <sundials/sundials_config.h>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <tuple>

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

Function sample() {
  return record("doctor", 2, [](const VectorXad& x) {
    VectorXad y(1);
    y[0] = sin(x[0]) * exp(x[1]) / (1.0 + x[0] * x[0]);
    return y;
  });
}

CompiledFunction sample_by(Route route) {
  CodegenOptions options;
  options.order = Order::kSecond;
  options.use_cache = false;
  options.route = route;
  return CompiledFunction::make(sample(), options);
}

bool equals_interpreter(const CompiledFunction& f) {
  const auto evaluate = [](const CompiledFunction& g) {
    const auto all = g.evaluate(Order::kSecond, {0.3, -1.2}, {}, {1});
    return std::tuple(all.y, all.jacobian, all.hessian);
  };
  return evaluate(f) == evaluate(sample_by(Route::kInterpreter));
}

Finding judged(const char* what, const CompiledFunction& made) {
  const bool same = equals_interpreter(made);
  return {what,
          same ? "generated code equals the interpreter bit for bit (made in " +
                     io::duration(made.timings().compile) + ")"
               : "generated code differs from the interpreter",
          same};
}

// The whole way, outside the cache: record, derive, print, compile, load, and the same bits as the interpreter.
Finding pipeline() { return judged("pipeline", sample_by(Route::kCompiled)); }

Finding machine_code() {
  const CompiledFunction made = sample_by(Route::kMachineCode);
  if (made.route() == Route::kMachineCode) return judged("machine code", made);
  return {"machine code", "none on this processor; functions are interpreted until they are compiled"};
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
      attempt("machine code", machine_code),
      attempt("pictures", pictures),
      {"Eigen", std::to_string(EIGEN_WORLD_VERSION) + "." + std::to_string(EIGEN_MAJOR_VERSION) + "." +
                    std::to_string(EIGEN_MINOR_VERSION)},
      {"Boost", std::to_string(BOOST_VERSION / 100000) + "." + std::to_string(BOOST_VERSION / 100 % 1000)},
      {"Ipopt", DYNTAPE_IPOPT_VERSION},
      {"SUNDIALS", SUNDIALS_VERSION},
      {"urdfdom", DYNTAPE_URDFDOM_VERSION}};
}

void report(const std::vector<Finding>& findings, bool json) {
  bool ok = true;
  nlohmann::json rows = nlohmann::json::array();
  io::TextTable table({{""}, {"part"}, {"found"}});
  for (const Finding& f : findings) {
    ok = ok && f.ok;
    rows.push_back({{"part", f.what}, {"found", f.found}, {"ok", f.ok}});
    table.append({f.ok ? "ok" : "FAILS", f.what, f.found});
  }
  std::cout << (json ? nlohmann::json{{"ok", ok}, {"findings", rows}}.dump(2) + "\n" : table.text());
  if (!ok) throw Failure{};
}

}  // namespace

void add_doctor(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "doctor",
      "check compiler, cache folder, processor and libraries, and record, compile and load a function");
  const auto json = std::make_shared<bool>(false);
  command->add_flag("--json", *json, "print JSON");
  command->callback([json] { report(examine(), *json); });
}

}  // namespace dyntape::tools
