// SPDX-License-Identifier: BSD-3-Clause
//
// Runs a row of the table for a robot with mimic joints: states and results without followers, around a row that
// works on full vectors.  Internal.
//
// With G the multipliers (dynamics/algorithms/mimic.h) a state becomes q_full = G q + offset, v_full = G v, a_full =
// G a, and torques act on leaders.  The factors of linear forms transform like their dual quantities.  Results of
// kind kNv are multiplied by G^T or G (torques; derivatives by q, v, a); in results of kind kNvMoved the entries of
// followers are omitted (accelerations; derivatives by torques).  With Data::following the row's forward dynamics is
// that of the leaders.  Source: docs/math.md (J.11) to (J.16).
#pragma once

#include <dyntape/dynamics/model/following.h>
#include <dyntape/interface/robot/robot_rows.h>

#include <cstring>

namespace dyntape::detail {

template <class T>
class RobotReduction {
 public:
  // sizes: without followers.
  RobotReduction(const dynamics::Model<T>& model, const std::vector<dynamics::MimicRule>& rules,
                 const RobotRow<T>& row, const RobotSizes& sizes)
      : mimic_(model, rules), forward_(row.needs & kInertia) {
    const int behind = inputs_behind_q(row.inputs);
    takes_torques_ = std::strstr(row.inputs, "tau") != nullptr;
    full_.q.resize(model.nq);
    dynamics::VectorX<T>* const rest[] = {&full_.v, &full_.w, &full_.mu};
    for (int i = 0; i < behind; ++i) rest[i]->resize(model.nv);
    int n = 0;
    for (const BlockShape& shape : row.outputs) {
      blocks_.push_back({targets(shape.rows, sizes), targets(shape.cols, sizes), targets(shape.pages, sizes),
                         size_of(shape, sizes)});
      n += blocks_.back().full_size();
    }
    result_.resize(static_cast<std::size_t>(n));
  }

  const dynamics::MimicModel<T>& mimic() const { return mimic_; }

  const RobotState<T>& expanded(const RobotState<T>& s) {
    dynamics::detail::expand<T>(mimic_.q_entries, s.q, full_.q);
    if (s.v.size()) dynamics::detail::expand<T>(mimic_.v_entries, s.v, full_.v);
    if (s.w.size()) put(s.w, takes_torques_, full_.w);
    if (s.mu.size()) put(s.mu, forward_, full_.mu);
    return full_;
  }

  // The buffer for the row's results on full vectors.
  T* full_result() { return result_.data(); }
  void reduce(T* to) const {
    const T* from = result_.data();
    for (const Block& block : blocks_) {
      std::fill(to, to + block.size, T(0));
      for (const Target& i : block.rows) {
        for (const Target& j : block.cols) {
          for (const Target& k : block.pages) {
            const T& entry = *from++;
            if (i.index < 0 || j.index < 0 || k.index < 0) continue;
            const int at = (i.index * j.reduced + j.index) * k.reduced + k.index;
            const double factor = i.factor * j.factor * k.factor;
            to[at] += factor == 1 ? entry : T(entry * T(factor));
          }
        }
      }
      to += block.size;
    }
  }

 private:
  // Destination of an entry, and its factor; index -1: none.
  struct Target {
    int index = -1;
    double factor = 1;
    int reduced = 1;  // extent of the results
  };
  struct Block {
    std::vector<Target> rows, cols, pages;
    int size;  // without followers
    int full_size() const { return static_cast<int>(rows.size() * cols.size() * pages.size()); }
  };

  void put(const dynamics::VectorX<T>& x, bool on_leaders, dynamics::VectorX<T>& full) {
    if (!on_leaders) {
      dynamics::detail::expand<T>(mimic_.v_entries, x, full);
      return;
    }
    full.setZero();
    for (int k = 0; k < mimic_.nv; ++k) full[mimic_.v_owners[static_cast<std::size_t>(k)]] = x[k];
  }

  std::vector<Target> targets(Extent e, const RobotSizes& sizes) const {
    const int reduced = extent(e, sizes);
    std::vector<Target> all;
    const auto add = [&](int first, bool moved) {
      for (int k = 0; k < mimic_.full.nv; ++k) {
        const auto& entry = mimic_.v_entries[static_cast<std::size_t>(k)];
        const bool leads = mimic_.v_owners[static_cast<std::size_t>(entry.index)] == k;
        all.push_back(moved ? Target{leads ? first + entry.index : -1, 1, reduced}
                            : Target{first + entry.index, entry.factor, reduced});
      }
    };
    switch (e) {
      case Extent::kNv:
      case Extent::kNvMoved:
        add(0, e == Extent::kNvMoved);
        break;
      case Extent::k3Nv:
      case Extent::k3NvMoved:
        add(0, false), add(mimic_.nv, false), add(2 * mimic_.nv, e == Extent::k3NvMoved);
        break;
      default:
        for (int k = 0; k < reduced; ++k) all.push_back({k, 1, reduced});
    }
    return all;
  }

  dynamics::MimicModel<T> mimic_;
  bool forward_, takes_torques_;
  RobotState<T> full_;
  std::vector<Block> blocks_;
  std::vector<T> result_;
};

}  // namespace dyntape::detail
