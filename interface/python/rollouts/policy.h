// SPDX-License-Identifier: BSD-3-Clause
//
// A recorded function of the state, and of parameters, that closes the loop of a roll-out: u = f(x, p).
//
//   const Policy policy(f, parameters, "rollout", nx, n_u);
//   policy.commands(rows, u);                                  // of many worlds
//   policy.derivatives(model, x, world, slopes);               // of one
//
// Rows of a world that has diverged get NaN.  Any number of threads may use it.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include <dyntape/interface/run/rollout/policy_law.h>
#include <dyntape/interface/run/rollout/scene_rollout.h>

#include "../functions.h"

namespace dyntape::python {

class Policy {
 public:
  // ArgumentError: it does not fit the scene's states and commands; `call` says whose argument it is.
  Policy(std::shared_ptr<const RecordedFunction> f, nb::handle parameters, const std::string& call, int nx,
         int n_u);

  std::size_t n_p() const { return f_->n_p(); }
  std::shared_ptr<const Function> function() const { return {f_, &f_->function}; }
  const nb::object& given() const { return parameters_.array; }  // what parameters() points into
  // Of a world; null without parameters.
  const double* parameters(std::size_t world) const {
    return n_p() == 0 ? nullptr : parameters_.data + (worlds_ ? world * n_p() : 0);
  }

  std::optional<std::size_t> worlds() const {
    return worlds_;
  }  // that parameters are given for; none: one row for all

  void commands(const WorldRows& at, double* u) const;
  void derivatives(const dynamics::Model<double>& model, const double* x, std::size_t world,
                   LawSlopes& slopes) const;
  // Makes what derivatives() needs; before the first of them, without the lock.
  void prepare_derivatives();

 private:
  std::shared_ptr<const RecordedFunction> f_;
  std::shared_ptr<Kernels> values_, slopes_;  // slopes_: with parameters as variables
  Numbers parameters_;
  std::optional<std::size_t> worlds_;
};

}  // namespace dyntape::python
