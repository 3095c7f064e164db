// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/kernels.h>

#include <algorithm>
#include <utility>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/options/lane_widths.h>

namespace dyntape::codegen {
namespace {

constexpr std::size_t kInterpretedTogether = 8;  // points

std::size_t at(Order order) { return static_cast<std::size_t>(order); }

Pattern pattern_from(const dyntape_pattern& p) {
  return {p.rows, p.cols, {p.row, p.row + p.nnz}, {p.col, p.col + p.nnz}};
}

void copy_out(const double*& from, std::size_t n, double* to) {
  if (to) std::copy(from, from + n, to);
  from += n;
}

void run_kernel(const dyntape_kernel& kernel, const Points& points, double* work) {
  kernel.run(points.x, points.p, points.w, points.y, points.jacobian, points.hessian, work, points.count,
             points.strides, points.status);
}

Violation first_violation(const std::uint32_t* status, std::size_t count) {
  const std::uint32_t* const end = status + count;
  const auto* const found = std::find_if(status, end, [](std::uint32_t word) { return word != 0; });
  if (found == end) return {};
  return {*found, static_cast<std::size_t>(found - status)};
}

PointRange range_of(const Points& points, const Strides& s, double* y) {
  PointRange range;
  range.points = points.count;
  range.x = points.x, range.stride_x = s.x;
  range.p = points.p, range.stride_p = s.p;
  range.w = points.w, range.stride_w = s.w;
  range.y = y;
  range.status = points.status;
  return range;
}

}  // namespace

Kernels::Kernels(Product made, const CodegenOptions& options)
    : product(std::move(made)),
      name(options.label.empty() ? product.function.name : options.label),
      order(options.order) {
  std::vector<Derivatives> derived = std::exchange(product.derived, {});
  if (product.library)
    take_kernels(product.library->descriptor(), options.widest_lanes);
  else if (product.machine)
    take_kernels(product.machine->descriptor(), options.widest_lanes);
  else
    take_interpreters(std::move(derived), options.functions);
}

Tier Kernels::tier() const {
  return product.library ? Tier::kFinal : product.machine ? Tier::kMachineCode : Tier::kInterpreted;
}

// Those of one point, and of the most lanes that the processor has.
void Kernels::take_kernels(const dyntape_descriptor& descriptor, std::size_t widest) {
  for (const dyntape_kernel* k = descriptor.kernels; k != descriptor.kernels + descriptor.n_kernels; ++k) {
    if (k->lane_width == 1) {
      code_.push_back(*k);
      operations.push_back(k->operations);
    } else if (k->lane_width <= widest && has_lanes(k->lane_width)) {
      if (!wide_.empty() && wide_.back().lane_width < k->lane_width) wide_.clear();
      wide_.push_back(*k);
    }
  }
  jacobian = pattern_from(descriptor.jacobian);
  hessian = pattern_from(descriptor.hessian);
  const std::size_t orders = at(order) + 1;
  if (code_.size() == orders && (wide_.empty() || wide_.size() == orders)) return;
  throw ToolError("a library of \"" + name + "\" has " + std::to_string(descriptor.n_kernels) + " kernels");
}

void Kernels::take_interpreters(std::vector<Derivatives> derivatives, Functions functions) {
  for (Derivatives& d : derivatives) {
    operations.push_back(total_operations(d.function));
    jacobian = std::move(d.jacobian);
    hessian = std::move(d.hessian);
    interpreters_.emplace_back(std::move(d.function), functions);
  }
}

Strides Kernels::sizes(Order wanted) const {
  const Function& f = product.function;
  return {f.n_x(),
          f.n_p(),
          f.n_w() + (wanted == Order::kSecond ? f.n_y() : 0),
          f.n_y(),
          wanted >= Order::kFirst ? jacobian.nnz() : 0,
          wanted == Order::kSecond ? hessian.nnz() : 0};
}

Kernels::Room::Room(const Kernels& kernels) {
  std::size_t work = 0, lanes = 0;
  for (const dyntape_kernel& kernel : kernels.code_) work = std::max(work, kernel.work);
  for (const dyntape_kernel& kernel : kernels.wide_)
    lanes = std::max(lanes, room_for_lanes(kernel, kernels.sizes(static_cast<Order>(kernel.order))));
  for (const Interpreter& interpreter : kernels.interpreters_) {
    work = std::max(work, interpreter.function().n_y() * kInterpretedTogether);
    interpreters_.emplace_back(interpreter, kInterpretedTogether);
  }
  work_.resize(work);
  lanes_.resize(lanes);
}

Violation Kernels::run_many(Order wanted, const Points& points, Room& room) const {
  const Strides n = sizes(wanted);
  Points all = points;
  if (!all.strides && all.side_by_side == 1) all.strides = &n;
  const bool guarded = !product.function.guards.empty();
  std::uint32_t one = 0;
  if (guarded && !all.status) {
    if (all.count > 1 && all.count > room.status_.size()) room.status_.resize(all.count);
    all.status = all.count > 1 ? room.status_.data() : &one;
  }
  if (!code_.empty())
    run_code(wanted, all, n, room);
  else
    run_interpreted(wanted, all, n, room);
  if (product.machine) rethrow_thrown();
  return guarded ? first_violation(all.status, all.count) : Violation{};
}

// A single point that is left over goes through the kernel of one.
void Kernels::run_code(Order wanted, const Points& points, const Strides& sizes, Room& room) const {
  if (points.side_by_side > 1) return run_kernel(wide_[at(wanted)], points, room.lanes_.data());
  const std::size_t width = lane_width(),
                    together = width == 1 ? 0 : points.count - (points.count % width == 1);
  if (together)
    run_in_lanes(wide_[at(wanted)], sizes, part_of(points, *points.strides, 0, together), room.lanes_.data());
  if (together < points.count)
    run_kernel(code_[at(wanted)], part_of(points, *points.strides, together, points.count - together),
               room.work_.data());
}

void Kernels::run_interpreted(Order wanted, const Points& points, const Strides& n, Room& room) const {
  const Strides& s = *points.strides;
  for (std::size_t i = 0; i < points.count; i += kInterpretedTogether) {
    const Points part = part_of(points, s, i, std::min(points.count - i, kInterpretedTogether));
    const PointRange range = range_of(part, s, room.work_.data());
    interpreters_[at(wanted)](range, room.interpreters_[at(wanted)]);
    const double* out = room.work_.data();
    for (std::size_t k = 0; k < part.count; ++k) {
      const Points to = part_of(part, s, k, 1);
      copy_out(out, n.y, to.y);
      copy_out(out, n.jacobian, to.jacobian);
      copy_out(out, n.hessian, to.hessian);
    }
  }
}

}  // namespace dyntape::codegen
