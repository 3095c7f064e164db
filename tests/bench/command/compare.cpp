// SPDX-License-Identifier: BSD-3-Clause
#include "compare.h"

#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include <dyntape/dynamics/algorithms/check_forward_dynamics.h>
#include <dyntape/interface/io/live_line.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/robot/packs/packed_robot.h>
#include <dyntape/interface/robot/robot_rows.h>

#include "host.h"
#include "measure.h"
#include "peer.h"

namespace dyntape::tools {
namespace {

struct Row {
  std::string function;
  bool in_frame = false;  // in the frame itself, for the peer's sake
  Cost ours, packed, theirs;
  double error = 0;      // against 113 bits
  double agreement = 0;  // with the peer
  bool has_peer = false;
};

constexpr int kReferences = 4;

double error_of(const dynamics::Model<double>& model, const RobotFunction& function,
                const std::vector<Eigen::VectorXd>& states) {
  detail::RobotWorkspace<double> work(model, function);
  std::vector<double> y(work.n_out());
  double worst = 0;
  for (int i = 0; i < kReferences; ++i) {
    work.evaluate(states[i].data(), y.data());
    const double error =
        relative_error(reference(model, function, states[i]), y.data(), outputs(model, function));
    worst = error <= worst ? worst : error;
  }
  return worst;
}

// Derivatives of a frame in the frame itself: in the world's axes at it Pinocchio's are wrong
// (stack-of-tasks/pinocchio, issue 2702).
RobotFunction comparable(RobotFunction function) {
  if (is_derivative(function) && takes_frame(function) && !takes_contacts(function)) {
    function.in = dynamics::ReferenceFrame::kLocal;
  }
  return function;
}

// Ours and each convention of the peer, in turn; the peer's quickest counts.
Row measure(const dynamics::Model<double>& model, const RobotFunction& chosen, Peer* peer,
            const CompareOptions& options) {
  const RobotFunction function = peer ? comparable(chosen) : chosen;
  const auto states = random_states(model, function, options.states, options.seed);
  Row row;
  row.function = to_string(function);
  row.in_frame = function.in != chosen.in;
  row.error = error_of(model, function, states);

  detail::RobotWorkspace<double> work(model, function);
  std::vector<detail::RobotState<double>> prepared;
  for (const auto& state : states) {
    work.read(state.data());
    prepared.push_back(work.state);
  }
  std::vector<Contender> contenders = {[&](int first, int calls) {
    std::size_t i = static_cast<std::size_t>(first) % prepared.size();
    for (int k = 0; k < calls; ++k) {
      work.run(prepared[i]);
      if (++i == prepared.size()) i = 0;
    }
  }};
  // States side by side, as many at a time as there are lanes; the first ones once more behind the last.
  PackedRobot packed(model, function);
  const int lanes = packed.lanes();
  std::vector<double> side_by_side, results(packed.n_out() * static_cast<std::size_t>(lanes));
  for (std::size_t i = 0; i < states.size() + static_cast<std::size_t>(lanes); ++i) {
    const Eigen::VectorXd& state = states[i % states.size()];
    side_by_side.insert(side_by_side.end(), state.begin(), state.end());
  }
  contenders.push_back([&](int first, int calls) {
    for (int k = 0; k < calls; k += lanes) {
      const std::size_t i = static_cast<std::size_t>(first + k) % states.size();
      packed.evaluate(side_by_side.data() + i * packed.n_in(), static_cast<std::size_t>(lanes),
                      results.data());
    }
  });
  const std::vector<int> theirs = peer ? peer->find(to_string(function)) : std::vector<int>{};
  if (!theirs.empty()) {
    peer->choose(model, function);
    peer->load(states);
    std::vector<double> y(work.n_out());
    for (int i = 0; i < kReferences; ++i) {
      work.evaluate(states[i].data(), y.data());
      const std::vector<double> result = peer->result(theirs.front(), i, y.size());
      const double difference =
          result.empty() ? NAN : relative_error(result, y.data(), outputs(model, function));
      row.agreement = difference <= row.agreement ? row.agreement : difference;
    }
  }
  for (int index : theirs) {
    contenders.push_back([peer, index](int first, int calls) { peer->run(index, first, calls); });
  }
  const std::vector<Cost> costs = alternate(contenders);
  row.ours = costs[0];
  row.packed = costs[1];
  row.has_peer = !theirs.empty();
  for (std::size_t i = 2; i < costs.size(); ++i) {
    if (i == 2 || costs[i].median < row.theirs.median) row.theirs = costs[i];
  }
  return row;
}

int nv_of(const dynamics::Model<double>& model, const CompareOptions& options) {
  return model.nv - static_cast<int>(options.functions.front().mimics.size());
}

void print_json(const dynamics::Model<double>& model, const CompareOptions& options, const std::string& peer,
                const std::vector<Row>& rows) {
  nlohmann::json report = {
      {"robot", model.name},  {"nv", nv_of(model, options)},   {"states", options.states},
      {"seed", options.seed}, {"processor", processor_name()}, {"compiler", compiler_name()},
      {"peer", peer}};
  for (const Row& row : rows) {
    nlohmann::json j = {{"function", row.function},
                        {"in_frame", row.in_frame},
                        {"time_s", row.ours.median},
                        {"quickest_s", row.ours.best},
                        {"packed_s", row.packed.median},
                        {"packed_quickest_s", row.packed.best},
                        {"error", row.error}};
    if (row.has_peer) {
      j["peer_s"] = row.theirs.median;
      j["peer_quickest_s"] = row.theirs.best;
      j["ratio"] = row.ours.median / row.theirs.median;
      j["ratio_of_quickest"] = row.ours.best / row.theirs.best;
      j["packed_ratio"] = row.packed.median / row.theirs.median;
      j["packed_ratio_of_quickest"] = row.packed.best / row.theirs.best;
      j["agreement"] = row.agreement;
    }
    report["functions"].push_back(j);
  }
  std::cout << report.dump(2) << "\n";
}

void print(const dynamics::Model<double>& model, const CompareOptions& options, const std::string& peer,
           const std::vector<Row>& rows) {
  std::cout << model.name << ", nv " << nv_of(model, options) << ": median time of one evaluation over "
            << options.states << " states (seed " << options.seed
            << "), in plain double and a state in packs;\n"
            << "error of plain double against 113 bits";
  if (!peer.empty()) std::cout << "; " << peer << " in the same run, ratios to it (of the quickest batches)";
  std::cout << "\n" << processor_name() << ", " << compiler_name() << "\n\n";
  using io::TextColumn;
  std::vector<TextColumn> columns = {{"function"},
                                     {"time", "us", io::Align::kRight},
                                     {"packed", "us", io::Align::kRight},
                                     {"error", "", io::Align::kRight}};
  if (!peer.empty()) {
    for (const char* name : {"peer", "ratio", "packed ratio", "agreement"}) {
      columns.push_back({name, std::string(name) == "peer" ? "us" : "", io::Align::kRight});
    }
  }
  const auto ratio = [](const Cost& ours, const Cost& theirs) {
    return io::significant(ours.median / theirs.median, 2) + " (" +
           io::significant(ours.best / theirs.best, 2) + ")";
  };
  io::TextTable table(columns);
  for (const Row& row : rows) {
    std::vector<std::string> cells = {row.function + (row.in_frame ? " (local)" : ""),
                                      io::significant(row.ours.median * 1e6, 3),
                                      io::significant(row.packed.median * 1e6, 3), io::scientific(row.error)};
    if (row.has_peer) {
      cells.push_back(io::significant(row.theirs.median * 1e6, 3));
      cells.push_back(ratio(row.ours, row.theirs));
      cells.push_back(ratio(row.packed, row.theirs));
      cells.push_back(io::scientific(row.agreement));
    }
    cells.resize(columns.size());
    table.append(cells);
  }
  std::cout << table.text();
}

}  // namespace

void compare(const dynamics::Model<double>& model, const CompareOptions& options) {
  std::optional<PeerLibrary> library;
  std::optional<Peer> peer;
  if (options.peer) {
    std::string reason;
    const bool follows = !options.functions.empty() && !options.functions.front().mimics.empty();
    if (follows) {
      reason = "it is built without joints that follow others; leave --mimic out";
    } else {
      library = PeerLibrary::open(options.peer_prefix, reason);
    }
    if (library) {
      peer.emplace(*library, model);
    } else {
      std::cerr << "without the peer: " << reason << "\n";
    }
  }
  std::vector<Row> rows;
  {
    io::LiveLine line;
    for (const RobotFunction& function : options.functions) {
      line.show(std::string("measuring ") + to_string(function));
      if (is_forward(function)) dynamics::check_forward_dynamics(model);
      rows.push_back(measure(model, function, peer ? &*peer : nullptr, options));
    }
  }
  const std::string name = library ? std::string(library->table().name) + " (" + kPeerFlags + ")" : "";
  (options.json ? print_json : print)(model, options, name, rows);
}

}  // namespace dyntape::tools
