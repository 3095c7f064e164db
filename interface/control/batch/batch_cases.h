// SPDX-License-Identifier: BSD-3-Clause
//
// Loads the problems of a batch: start, parameters and first guess, or solution.
//
//   BatchCases cases(problem, options, values);            // throws what DdpBatch::solve() throws
//   cases.load(work, slot, i);                             // from its first guess
//   cases.load_solution(work, slot, i, solutions[i]);
//
// A copy has its own memory.
#pragma once

#include <string>

#include <dyntape/interface/control/batch/batch_values.h>
#include <dyntape/interface/control/batch/lane_work.h>
#include <dyntape/interface/control/problem/problem.h>
#include <dyntape/interface/control/solve/ddp_solution.h>

namespace dyntape {

class BatchCases {
 public:
  // Problem, options and values must outlive the object.
  BatchCases(const Problem& problem, const DdpOptions& options, const DdpBatchValues& values);

  std::size_t count() const { return std::size_t(count_); }
  Problem problem(std::size_t i) const;  // with the values of problem i
  void load(LaneWork& work, int slot, std::size_t i);
  // For the problem whose states are followed by offsets of parameters, all zero (solve/ddp_sensitivities.h).
  void load_solution(LaneWork& work, int slot, std::size_t i, const DdpSolution& solution);

 private:
  Eigen::VectorXd start(Eigen::Index i) const;
  [[noreturn]] void refuse(const std::string& what) const;
  void find_count();
  void check_starts() const;
  void take_parameters(Eigen::Index i);

  const Problem& problem_;
  const DdpBatchValues& values_;
  int N_;
  bool is_at_nodes_;
  Eigen::Index count_ = 0;
  Eigen::MatrixXd parameters_, x_, u_;
  Eigen::VectorXd at_end_;
};

}  // namespace dyntape
