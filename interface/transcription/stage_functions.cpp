// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/transcription/stage_functions.h>

namespace dyntape {

namespace {

CompiledFunction made(const Function& function, CodegenOptions options) {
  if (function.n_y() == 0) options.route = Route::kInterpreter;  // there is nothing to compile
  return CompiledFunction::make(function, options);
}

}  // namespace

StageFunctions::StageFunctions(const Function& node, const Function& end, const CodegenOptions& options,
                               std::size_t points, unsigned threads)
    : node_(made(node, options)),
      end_(made(end, options)),
      of_nodes_(node_, threads),
      of_end_(end_),
      points_(points) {}

StageFunctions::StageFunctions(const StageFunctions& ready, std::size_t points, unsigned threads)
    : node_(ready.node_), end_(ready.end_), of_nodes_(node_, threads), of_end_(end_), points_(points) {}

std::size_t StageFunctions::jacobians() const {
  return points_ * node_.jacobian_pattern().nnz() + end_.jacobian_pattern().nnz();
}

std::size_t StageFunctions::hessians() const {
  if (node_.order() < Order::kSecond) return 0;
  return points_ * node_.hessian_pattern().nnz() + end_.hessian_pattern().nnz();
}

bool StageFunctions::run(Order order, Points points, const double* z_end, const double* p_end) {
  points.count = points_;
  if (node_.run(order, points, of_nodes_)) return false;
  const auto behind = [&](auto* start, std::size_t of_point) {
    return start ? start + points_ * of_point : nullptr;
  };
  Points end{.x = z_end, .p = p_end, .w = behind(points.w, node_.n_y()), .y = behind(points.y, node_.n_y())};
  if (order >= Order::kFirst) end.jacobian = behind(points.jacobian, node_.jacobian_pattern().nnz());
  if (order >= Order::kSecond) end.hessian = behind(points.hessian, node_.hessian_pattern().nnz());
  return !end_.run(order, end, of_end_);
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
  for (const CompiledFunction* f : {&node_, &end_}) dyntape::add_to(report, *f);
}

}  // namespace dyntape
