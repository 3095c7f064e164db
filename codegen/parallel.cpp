// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/parallel.h>

#include <algorithm>
#include <functional>
#include <mutex>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/run/threads.h>

namespace dyntape {
namespace {

template <class T>
void advance(T*& pointer, std::size_t by) {
  if (pointer) pointer += by;
}

// Points [begin, end) of all.
Points part_of(const Points& all, const Strides& strides, std::size_t begin, std::size_t end) {
  Points part = all;
  part.lanes = end - begin;
  part.strides = &strides;
  advance(part.x, begin * strides.x);
  advance(part.p, begin * strides.p);
  advance(part.w, begin * strides.w);
  advance(part.y, begin * strides.y);
  advance(part.jacobian, begin * strides.jacobian);
  advance(part.hessian, begin * strides.hessian);
  advance(part.status, begin);
  return part;
}

Strides strides_of(const CompiledFunction& f, Order order, const Points& points) {
  if (points.strides) return *points.strides;
  return {f.n_x(),
          f.n_p(),
          f.n_w() + (order == Order::kSecond ? f.n_y() : 0),
          f.n_y(),
          order >= Order::kFirst ? f.jacobian_pattern().nnz() : 0,
          order == Order::kSecond ? f.hessian_pattern().nnz() : 0};
}

}  // namespace

std::vector<CompiledFunction::Workspace> make_workspaces(const CompiledFunction& function, unsigned threads) {
  if (threads == 0) threads = codegen::thread_count();
  if (threads > 1)
    codegen::run_tasks(threads, [](std::size_t) {});  // they are made now, not by the first evaluation
  return std::vector<CompiledFunction::Workspace>(threads, CompiledFunction::Workspace(function));
}

Violation run_parallel(const CompiledFunction& function, Order order, const Points& points,
                       std::vector<CompiledFunction::Workspace>& workspaces) {
  if (workspaces.empty())
    throw ArgumentError("run_parallel: \"" + function.name() + "\" is evaluated without a workspace");
  const Strides strides = strides_of(function, order, points);
  const std::size_t width = function.lane_width(), blocks = (points.lanes + width - 1) / width,
                    parts = std::clamp<std::size_t>(blocks, 1, workspaces.size());
  std::mutex mutex;
  Violation first;
  const auto run_part = [&](std::size_t k) {
    const auto bound = [&](std::size_t part) {
      return std::min(blocks * part / parts * width, points.lanes);
    };
    const std::size_t begin = bound(k), end = bound(k + 1);
    Violation found = function.run(order, part_of(points, strides, begin, end), workspaces[k]);
    if (!found) return;
    found.lane += begin;
    const std::scoped_lock lock(mutex);
    if (!first || found.lane < first.lane) first = found;
  };
  codegen::run_tasks(parts, std::ref(run_part));  // a reference: nothing is allocated
  return first;
}

}  // namespace dyntape
