// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/graph/callee.h>

#include <algorithm>
#include <mutex>
#include <string>
#include <utility>

#include <dyntape/autodiff/error.h>

namespace dyntape {
namespace {

bool are_numbers(const Seeds& seeds) {
  return std::all_of(seeds.begin(), seeds.end(), [](SeedKind kind) { return kind == SeedKind::kNumber; });
}

void check_given(const Callee& callee, bool is_forward, const Callee* made) {
  const std::size_t n_in = callee.n_in + (is_forward ? callee.n_in : callee.n_out),
                    n_out = is_forward ? callee.n_out : callee.n_in;
  if (made && made->n_in == n_in && made->n_out == n_out) return;
  const auto sizes = [](std::size_t in, std::size_t out) {
    return std::to_string(in) + " -> " + std::to_string(out);
  };
  throw ArgumentError(std::string(is_forward ? "jvp" : "vjp") + " of \"" + callee.name + "\" is " +
                      (made ? sizes(made->n_in, made->n_out) : "null") + ", expected " + sizes(n_in, n_out));
}

std::shared_ptr<const Callee> derivative(const Callee& callee, AdMode mode, const Seeds& seeds) {
  static std::recursive_mutex mutex;  // a derivative may ask for others
  const std::scoped_lock lock(mutex);
  const Seeds by = are_numbers(seeds) ? Seeds() : seeds;
  auto& made = callee.made.derivatives[{mode, by}];
  if (auto existing = made.lock()) return existing;
  const bool is_forward = mode == AdMode::kForward;
  const CalleeMaker& given = is_forward ? callee.jvp : callee.vjp;
  const Recorded* const recorded = callee.recorded();
  if (!given && !(recorded && recorded->derivative)) {
    throw ArgumentError("kernel \"" + callee.name + "\" is differentiated but gives no " +
                        (is_forward ? "jvp" : "vjp"));
  }
  auto result = given ? given() : recorded->derivative(*recorded, mode, by);
  if (given) check_given(callee, is_forward, result.get());
  made = result;
  return result;
}

}  // namespace

bool derivatives_follow(const Callee& callee) {
  return callee.recorded() && callee.recorded()->derivative && !callee.jvp && !callee.vjp;
}

void check_pattern(const Callee& callee) {
  const Pattern& p = callee.pattern;
  if (p.rows == 0) return;
  const auto refuse = [&](const std::string& what) {
    throw ArgumentError("pattern of \"" + callee.name + "\": " + what);
  };
  const auto size = [](std::size_t rows, std::size_t cols) {
    return std::to_string(rows) + " x " + std::to_string(cols);
  };
  if (p.rows != callee.n_out || p.cols != callee.n_in)
    refuse("it is " + size(p.rows, p.cols) + ", expected outputs x inputs, " +
           size(callee.n_out, callee.n_in));
  if (p.row.size() != p.col.size())
    refuse(std::to_string(p.row.size()) + " rows for " + std::to_string(p.col.size()) +
           " columns of entries, expected as many");
  const auto entry = [&](std::size_t k) {
    return "(" + std::to_string(p.row[k]) + ", " + std::to_string(p.col[k]) + ")";
  };
  for (std::size_t k = 0; k < p.nnz(); ++k) {
    if (p.row[k] >= p.rows || p.col[k] >= p.cols)
      refuse("entry " + entry(k) + " is beyond " + size(p.rows, p.cols));
    if (k && std::pair(p.row[k - 1], p.col[k - 1]) >= std::pair(p.row[k], p.col[k]))
      refuse("entry " + entry(k) + " stands behind " + entry(k - 1) +
             ", expected each once, sorted by row and then by column");
  }
}

std::shared_ptr<const Callee> jvp_callee(const std::shared_ptr<const Callee>& callee, const Seeds& seeds) {
  return derivative(*callee, AdMode::kForward, seeds);
}

std::shared_ptr<const Callee> vjp_callee(const std::shared_ptr<const Callee>& callee, const Seeds& seeds) {
  return derivative(*callee, AdMode::kReverse, seeds);
}

}  // namespace dyntape
