// SPDX-License-Identifier: BSD-3-Clause
//
// The part that an AdFunction and its copies share: the function, immutable, with workspaces.  Internal.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/ocs2/approximation.h>
#include <dyntape/interface/robot/workspace_pool.h>

namespace dyntape::detail {

// Throws ArgumentError: `jacobian: x has 11 entries, function "arm" expects 12`.
void check_size(const char* asked, const std::string& name, const char* what, Eigen::Index got,
                std::size_t expected);

// Both triangles of a symmetric matrix from its lower triangle, or a Jacobian unchanged.
matrix_t dense(const Pattern& pattern, const std::vector<double>& values, bool symmetric);

// Index of the first entry that is not finite, or -1.
std::ptrdiff_t first_not_finite(const double* values, std::size_t count);

// A function that any number of threads may call.
struct SharedFunction {
  struct Room {
    Room(const CompiledFunction& f, unsigned threads) : workspace(f, threads) {
      if (f.order() >= Order::kFirst) jacobian.resize(f.jacobian_pattern().nnz());
      if (f.order() >= Order::kSecond) hessian.resize(f.hessian_pattern().nnz());
    }
    CompiledFunction::Workspace workspace;
    std::vector<double> jacobian, hessian;
  };

  explicit SharedFunction(CompiledFunction compiled, unsigned share = 1)
      : f(std::move(compiled)), threads(share) {}

  WorkspacePool<Room>::Lease room() const {
    return pool.take([&] { return std::make_unique<Room>(f, threads); });
  }

  const CompiledFunction f;
  const unsigned threads;
  mutable WorkspacePool<Room> pool;
};

// A value that one thread makes at the first request; after an exception the next request tries again.
class OnRequest {
 public:
  template <class Make>
  const SharedFunction& get(Make&& make) const {
    std::call_once(once_, [&] { function_.emplace(make()); });
    return *function_;
  }

 private:
  mutable std::once_flag once_;
  mutable std::optional<SharedFunction> function_;
};

struct AdFunctionModel {
  AdFunctionModel(CompiledFunction f, CodegenOptions o, unsigned threads, double seconds)
      : shared(std::move(f), threads), options(std::move(o)), record_seconds(seconds) {}

  const CompiledFunction& compiled() const { return shared.f; }

  SharedFunction shared;
  CodegenOptions options;
  double record_seconds;
  OnRequest parameter_jacobian, jvp, vjp;
};

}  // namespace dyntape::detail
