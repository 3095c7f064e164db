// SPDX-License-Identifier: BSD-3-Clause
//
// What a state costs by every route of ours and of the peers, all in one process and timed in turn.
//
//   ninja -C build bench_kernels
//   build/bin/bench_kernels config/robots/ur5.urdf --functions rnea,id-derivatives --peer >ur5.csv
//   build/bin/bench_kernels config/robots/ur5.urdf --model                        the robot, for other generators
//
// A row a route: time of the quickest batch and median over the batches, error against 113 bits, and what
// making it cost.  tests/bench/run calls it for every robot and makes the page.
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/processor_level.h>
#include <dyntape/codegen/build/compile.h>
#include <dyntape/interface/io/number.h>

#include "commands.h"
#include "model_json.h"
#include "peer.h"
#include "route.h"

namespace dyntape::bench {
namespace {

constexpr int kStates = 256, kReferences = 4, kBatches = 100;

struct Options {
  tools::RobotOptions robot;
  std::vector<std::string> functions = {"rnea"}, plain, generated;
  bool peer = false, model = false, about = false;
  std::string peer_prefix;
  std::uint64_t seed = 1;
};

// What the figures depend on besides the machine.
nlohmann::json about() {
  nlohmann::json j = {{"dyntape", DYNTAPE_VERSION},
                      {"plain code", DYNTAPE_PLAIN_FLAGS ", for " + processor_level()},
                      {"level", processor_level()},
                      {"Pinocchio", tools::kPeerFlags}};
  std::string flags = "-O1";
  if (const auto compiler = codegen::find_compiler("", {})) {
    for (const std::string& flag : compiler->flags)
      if (flag.rfind("-fno-builtin", 0) != 0 && flag.rfind("-O", 0) != 0) flags += " " + flag;
  }
  j["generated C"] = flags;
  return j;
}

std::string cell(double value, double scale = 1) { return value > 0 ? io::shortest(value * scale) : ""; }

void print(const std::string& robot, const std::string& function, const Route& route, const tools::Cost& cost,
           double error) {
  std::cout << robot << "," << function << ",\"" << route.name << "\"," << cell(cost.best, 1e6) << ","
            << cell(cost.median, 1e6) << "," << cell(static_cast<double>(route.operations)) << ","
            << cell(route.compile) << "," << cell(route.made) << "," << cell(route.first, 1e3) << ","
            << cell(route.load, 1e3) << "," << cell(static_cast<double>(route.text)) << ","
            << (route.value ? io::shortest(error) : "") << ",\"" << route.note << "\"" << std::endl;
}

double error_of(const Route& route, const dynamics::Model<double>& model, const RobotFunction& function,
                const std::vector<std::vector<double>>& expected) {
  double worst = 0;
  for (int i = 0; i < static_cast<int>(expected.size()) && route.value; ++i) {
    const std::vector<double> y = route.value(i);
    const auto& wanted = expected[static_cast<std::size_t>(i)];
    if (y.size() != wanted.size()) throw ToolError(route.name + ": a result of another size");
    const double error = tools::relative_error(wanted, y.data(), outputs(model, function));
    worst = error <= worst ? worst : error;
  }
  return worst;
}

// Every convention of the peer's.
std::vector<Route> peer_routes(tools::Peer& peer, const std::string& name,
                               const dynamics::Model<double>& model, const RobotFunction& function,
                               const States& states) {
  const std::vector<int> found = peer.find(to_string(function));
  std::vector<Route> routes;
  if (found.empty()) return routes;
  peer.choose(model, function);
  peer.load(states);
  std::size_t size = 0;
  for (const RobotBlock& block : outputs(model, function)) size += static_cast<std::size_t>(block.size());
  for (int index : found) {
    Route route;
    route.name = "Pinocchio";
    route.note = name;
    route.run = [&peer, index](int first, int calls) { peer.run(index, first, calls); };
    route.value = [&peer, index, size](int i) { return peer.result(index, i, size); };
    routes.push_back(route);
  }
  return routes;
}

void measure(const dynamics::Model<double>& model, const RobotFunction& function, bool plain_only,
             const std::vector<std::string>& generated, tools::Peer* peer, const std::string& peer_name,
             std::uint64_t seed) {
  const States states = tools::random_states(model, function, kStates, seed);
  std::vector<std::vector<double>> expected;
  for (std::size_t i = 0; i < kReferences; ++i)
    expected.push_back(tools::reference(model, function, states[i]));
  std::vector<Route> routes = plain_routes(model, function, states);
  const auto add = [&](const std::vector<Route>& more) {
    routes.insert(routes.end(), more.begin(), more.end());
  };
  if (!plain_only) add(recorded_routes(model, function, states));
  if (peer) add(peer_routes(*peer, peer_name, model, function, states));
  for (const std::string& path : generated) add({generated_route(path, model, function, states)});

  std::vector<double> errors;
  std::vector<tools::Contender> contenders;
  for (const Route& route : routes) {
    errors.push_back(error_of(route, model, function, expected));
    contenders.push_back(route.run);
  }
  const std::vector<tools::Cost> costs = tools::alternate(contenders, kBatches);
  std::map<std::string, std::size_t> quickest;  // of routes of one name
  for (std::size_t i = 0; i < routes.size(); ++i) {
    const auto [at, fresh] = quickest.emplace(routes[i].name, i);
    if (!fresh && costs[i].best < costs[at->second].best) at->second = i;
  }
  for (std::size_t i = 0; i < routes.size(); ++i)
    if (quickest[routes[i].name] == i) print(model.name, to_string(function), routes[i], costs[i], errors[i]);
}

// Descriptions named FUNCTION.json or FUNCTION.something.json.
std::vector<std::string> of_function(const std::vector<std::string>& paths, const std::string& function) {
  std::vector<std::string> chosen;
  for (const std::string& path : paths) {
    const std::string name = path.substr(path.rfind('/') + 1);
    if (name.substr(0, name.find('.')) == function) chosen.push_back(path);
  }
  return chosen;
}

void run(const Options& options) {
  if (options.about) {
    std::cout << about().dump(1) << "\n";
    return;
  }
  const dynamics::Model<double> model = tools::load_robot(options.robot).model;
  if (options.model) {
    std::cout << tools::model_json(model).dump(1) << "\n";
    return;
  }
  std::optional<tools::PeerLibrary> library;
  std::optional<tools::Peer> peer;
  std::string reason;
  if (options.peer && (library = tools::PeerLibrary::open(options.peer_prefix, reason)))
    peer.emplace(*library, model);
  std::cout << "robot,function,route,us,us_median,operations,compile_s,made_s,first_ms,load_ms,text_bytes,"
               "error,note\n";
  if (options.peer && !library)
    std::cout << model.name << ",,\"Pinocchio\",,,,,,,,,,\"absent: " << reason << "\"\n";
  const auto each = [&](const std::vector<std::string>& names, bool plain_only) {
    for (const std::string& name : names)
      measure(model, RobotFunction(name), plain_only, of_function(options.generated, name),
              peer ? &*peer : nullptr, library ? library->table().name : "", options.seed);
  };
  each(options.functions, false);
  each(options.plain, true);
  const Route peak = peak_route();
  print(model.name, "", peak, tools::alternate({peak.run}, kBatches)[0], 0);
}

}  // namespace
}  // namespace dyntape::bench

int main(int argc, char** argv) {
  using namespace dyntape;
  CLI::App app{"What a state costs by every route of ours and of the peers, in turn: a CSV row a route."};
  bench::Options options;
  tools::add_robot_options(app, options.robot);
  app.add_option("--functions", options.functions, "by every route")->delimiter(',')->type_name("F1,F2");
  app.add_option("--plain", options.plain, "in plain double, in packs and by the peer only")
      ->delimiter(',')
      ->type_name("F1,F2");
  app.add_flag("--peer", options.peer, "Pinocchio as well");
  app.add_option("--peer-prefix", options.peer_prefix, "where its headers are")->type_name("DIR");
  app.add_option("--generated", options.generated,
                 "what casadi_peer.py and cppadcodegen_peer.py have made: FUNCTION.json ...");
  app.add_option("--seed", options.seed, "of the random states")->capture_default_str();
  app.add_flag("--model", options.model, "print the robot as JSON, measure nothing");
  app.add_flag("--about", options.about, "print versions and flags as JSON, measure nothing");
  app.get_option("robot")->required(false);
  CLI11_PARSE(app, argc, argv);
  if (!options.plain.empty() && app.count("--functions") == 0) options.functions.clear();
  try {
    bench::run(options);
  } catch (const std::exception& e) {
    return std::cerr << "bench_kernels: " << e.what() << "\n", 1;
  }
}
