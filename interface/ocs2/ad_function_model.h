// SPDX-License-Identifier: BSD-3-Clause
//
// The part that an AdFunction and its copies share: the function, immutable, with workspaces.  Internal.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/run/workspace_pool.h>
#include <dyntape/interface/ocs2/approximation.h>

namespace dyntape::detail {

// Throws ArgumentError: `jacobian: x has 11 entries, function "arm" expects 12`.
void check_size(const char* asked, const std::string& name, const char* what, Eigen::Index got,
                std::size_t expected);

// Both triangles of a symmetric matrix from its lower triangle, or a Jacobian unchanged.
matrix_t dense(const Pattern& pattern, const double* values, bool symmetric);

// Index of the first entry that is not finite, or -1.
std::ptrdiff_t first_not_finite(const double* values, std::size_t count);

// A function that any number of threads may call.
struct SharedFunction {
  explicit SharedFunction(CompiledFunction compiled, unsigned share = 1)
      : f(std::move(compiled)), threads(share) {}

  // A short function needs no workspace for one point.  Throws GuardViolation.
  void evaluate(Order order, const Points& points) const {
    Violation violation;
    if (points.count != 1 || !f.run_without_workspace(order, points, violation)) {
      const auto workspace =
          pool.take([&] { return std::make_unique<CompiledFunction::Workspace>(f, threads); });
      violation = f.run(order, points, *workspace);
    }
    if (violation) f.check(violation, points.count);
  }

  const CompiledFunction f;
  const unsigned threads;
  mutable WorkspacePool<CompiledFunction::Workspace> pool;
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
