// SPDX-License-Identifier: BSD-3-Clause
//
// What the units of the peer share: they are several because each takes Pinocchio a minute and gigabytes.
#pragma once

#include <pinocchio/algorithm/proximal.hpp>
#include <pinocchio/constraints.hpp>

#include <string>
#include <vector>

#include "pinocchio_model.h"

namespace peer {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;
using Matrix6 = Eigen::Matrix<double, 6, Eigen::Dynamic>;

struct State {
  Vector q, v, w;
};

struct Peer {
  explicit Peer(const pin::Model& robot);

  pin::Model model;
  pin::Data data;
  std::vector<State> states;

  pin::FrameIndex frame = 0;
  pin::ReferenceFrame in = pin::LOCAL_WORLD_ALIGNED;
  pin::Motion motion, classical;
  Matrix6 J, dV_dq, dA_dq, dA_dv, dA_da, dh_dq, dh_dot_dq, dh_dot_dv, dh_dot_da;

  std::vector<pin::RigidConstraintModel> contacts;
  std::vector<pin::RigidConstraintData> contact_data;
  pin::ProximalSettings settings{1e-14, 0, 1};  // one solve, as for independent rows
};

// Results in dyntape's order: blocks, each row by row.
struct Writer {
  double* y;
  int size, written = 0;

  void operator()(double value) {
    if (written < size) y[written] = value;
    ++written;
  }
  template <class M>
  void block(const M& m) {
    for (Eigen::Index i = 0; i < m.rows(); ++i) {
      for (Eigen::Index j = 0; j < m.cols(); ++j) (*this)(m(i, j));
    }
  }
  // Pinocchio writes the upper triangle only.
  template <class M>
  void symmetric(const M& m) {
    for (Eigen::Index i = 0; i < m.rows(); ++i) {
      for (Eigen::Index j = 0; j < m.cols(); ++j) (*this)(i <= j ? m(i, j) : m(j, i));
    }
  }
  // Page (i, j, k): i the torque, j the first variable, k the second; `swapped`: j the second.
  template <class M>
  void tensor(const M& m, bool swapped = false) {
    for (Eigen::Index i = 0; i < m.dimension(0); ++i) {
      for (Eigen::Index j = 0; j < m.dimension(1); ++j) {
        for (Eigen::Index k = 0; k < m.dimension(2); ++k) (*this)(swapped ? m(i, k, j) : m(i, j, k));
      }
    }
  }
};

struct Function {
  const char* name;
  void (*run)(Peer& peer, const State& s);
  void (*write)(Peer& peer, Writer& to);
};

// One list a unit.
std::vector<Function> dynamics_functions();
std::vector<Function> body_functions();
std::vector<Function> contact_functions();

}  // namespace peer
