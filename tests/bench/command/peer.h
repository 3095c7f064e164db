// SPDX-License-Identifier: BSD-3-Clause
//
// Pinocchio in the same process, for `bench --peer`: tests/bench/peers/, compiled once as its users compile it and kept
// in the cache folder.  Its objects of Eigen are not laid out as dyntape's: it is a library of its own, and only
// plain numbers go in and out.
//
//   std::string reason;
//   if (auto library = PeerLibrary::open("", reason)) {
//     Peer peer(*library, model);
//     peer.load(states);
//     for (int f : peer.find("rnea")) peer.run(f, 0, 200);
//   }
//
// The headers are those of the PyPI package `pin`, looked for in the given prefix, $PINOCCHIO_PREFIX, the
// virtual environment that `tools/test --full` makes, and what `python3` finds.  A prefix is a folder with
// include/pinocchio or a virtual environment.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <dyntape/interface/robot/robot_functions.h>

#include "../peers/pinocchio_peer.h"

namespace dyntape::tools {

inline constexpr char kPeerFlags[] = "-O3 -march=native -DNDEBUG";

class PeerLibrary {
 public:
  // None, with the reason: there is no Pinocchio here.  ToolError: there is one and it does not compile.
  static std::optional<PeerLibrary> open(const std::string& prefix, std::string& reason);

  const dyntape_peer& table() const { return *table_; }

 private:
  explicit PeerLibrary(const dyntape_peer* table) : table_(table) {}
  const dyntape_peer* table_;  // of a library that stays loaded
};

// The robot in plain numbers.
std::vector<dyntape_peer_joint> peer_joints(const dynamics::Model<double>& model);

class Peer {
 public:
  // ArgumentError for a joint that Pinocchio does not have.
  Peer(const PeerLibrary& library, const dynamics::Model<double>& model);
  ~Peer() { table_.destroy(peer_); }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  // States (q, v, a | tau), or as much of that as a function needs.
  void load(const std::vector<Eigen::VectorXd>& states);
  // The frame and the contacts of a function.
  void choose(const dynamics::Model<double>& model, const RobotFunction& function);
  // The numbers of a function: one for each convention that Pinocchio offers, none where it has no such
  // function.
  std::vector<int> find(const std::string& function) const;
  // Evaluates `calls` states from `first` on.
  void run(int function, int first, int calls) { table_.run(peer_, function, first, calls); }
  // Its value at a state; nothing where it is of another size.
  std::vector<double> result(int function, int state, std::size_t size);

 private:
  const dyntape_peer& table_;
  void* peer_;
};

}  // namespace dyntape::tools
