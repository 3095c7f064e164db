// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/discretize/stage_functions.h>

namespace dyntape {

namespace {

CompiledFunction made(const Function& function, CodegenOptions options) {
  if (function.n_y() == 0) options.route = Route::kInterpreter;  // there is nothing to compile
  return CompiledFunction::make(function, options);
}

}  // namespace

StageFunctions::StageFunctions(const Function& node, const std::vector<Function>& instants,
                               const CodegenOptions& options, std::size_t points, unsigned threads)
    : node_(made(node, options)), of_nodes_(node_, threads), points_(points) {
  for (const Function& instant : instants) instants_.push_back({made(instant, options), 0, 0, 0});
  place();
}

StageFunctions::StageFunctions(const StageFunctions& ready, std::size_t points, unsigned threads)
    : node_(ready.node_), of_nodes_(node_, threads), instants_(ready.instants_), points_(points) {
  place();
}

// Instants stand behind the points, one after another.
void StageFunctions::place() {
  const bool has_first = node_.order() >= Order::kFirst, has_second = node_.order() >= Order::kSecond;
  values_ = points_ * node_.n_y();
  jacobians_ = has_first ? points_ * node_.jacobian_pattern().nnz() : 0;
  hessians_ = has_second ? points_ * node_.hessian_pattern().nnz() : 0;
  for (Instant& instant : instants_) {
    instant.y = values_, instant.jacobian = jacobians_, instant.hessian = hessians_;
    values_ += instant.function.n_y();
    if (has_first) jacobians_ += instant.function.jacobian_pattern().nnz();
    if (has_second) hessians_ += instant.function.hessian_pattern().nnz();
    of_instants_.emplace_back(instant.function);
  }
}

bool StageFunctions::run(Order order, Points points, std::span<const At> instants) {
  points.count = points_;
  if (node_.run(order, points, of_nodes_)) return false;
  const auto behind = [](auto* start, std::size_t offset) { return start ? start + offset : nullptr; };
  for (std::size_t k = 0; k < instants_.size(); ++k) {
    const Instant& instant = instants_[k];
    Points at{.x = instants[k].z,
              .p = instants[k].p,
              .w = behind(points.w, instant.y),
              .y = behind(points.y, instant.y)};
    if (order >= Order::kFirst) at.jacobian = behind(points.jacobian, instant.jacobian);
    if (order >= Order::kSecond) at.hessian = behind(points.hessian, instant.hessian);
    if (instant.function.run(order, at, of_instants_[k])) return false;
  }
  return true;
}

void add_to(BuildReport& report, const CompiledFunction& function) {
  report.seconds += function.timings();
  const bool interpreted = function.route() == Route::kInterpreter, cached = function.timings().cache_hit;
  report.interpreted += interpreted && function.n_y() > 0;
  report.from_cache += cached;
  report.compiled += !interpreted && !cached;
  if (!function.source_path().empty()) report.sources.push_back(function.source_path());
}

void StageFunctions::add_to(BuildReport& report) const {
  dyntape::add_to(report, node_);
  for (const Instant& instant : instants_) dyntape::add_to(report, instant.function);
}

}  // namespace dyntape
