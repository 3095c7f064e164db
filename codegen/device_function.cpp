// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/device_function.h>

#include <algorithm>
#include <mutex>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/codegen/device_transfer.h>
#include <dyntape/codegen/pipeline.h>

namespace dyntape {
namespace {

using codegen::DeviceKernel;
using codegen::fetch;
using codegen::OpenClDevice;
using codegen::OpenClProgram;
using codegen::send;

std::size_t total(const DeviceKernel& kernel) {
  std::size_t n = 1;  // the status
  for (const std::size_t entries : kernel.inputs) n += entries;
  for (const std::size_t entries : kernel.outputs) n += entries;
  return n;
}

std::size_t largest(const DeviceKernel& kernel) {
  return std::max({*std::max_element(kernel.inputs, kernel.inputs + 3),
                   *std::max_element(kernel.outputs, kernel.outputs + 3), std::size_t{1}});
}

// States that are sent at a time.
std::size_t states_at_once(const DeviceKernel& kernel, const OpenClDevice& device, std::size_t real,
                           std::size_t most) {
  const std::size_t of_part = codegen::kPartBytes / (real * total(kernel)),
                    of_buffer = device.largest_buffer / (real * largest(kernel)),
                    of_memory = device.memory / 2 / (real * total(kernel) + kernel.work);
  const std::size_t fitting =
      std::max<std::size_t>(1, std::min({std::max<std::size_t>(of_part, 1024), of_buffer, of_memory}));
  return most ? std::min(most, fitting) : fitting;
}

}  // namespace

struct DeviceFunction::State {
  Function function;
  Order order;
  DeviceRunOptions how;
  codegen::DeviceSource source;
  std::unique_ptr<OpenClProgram> program;
  mutable std::mutex mutex;  // of the memory below
  mutable std::vector<double> doubles;
  mutable std::vector<float> floats;
  mutable std::vector<std::uint32_t> status;

  template <class Real>
  Violation run(Order order, const Points& points, const Strides& strides, std::vector<Real>& room) const;
  template <class Real>
  void run_part(Order order, const Points& part, const Strides& strides, std::vector<Real>& room) const;

  Strides sizes(const DeviceKernel& k) const {
    return {k.inputs[0], k.inputs[1], k.inputs[2], k.outputs[0], k.outputs[1], k.outputs[2]};
  }
};

template <class Real>
void DeviceFunction::State::run_part(Order wanted, const Points& part, const Strides& strides,
                                     std::vector<Real>& room) const {
  const DeviceKernel& kernel = source.kernels[static_cast<std::size_t>(wanted)];
  room.resize(part.count * total(kernel));
  const double* const inputs[] = {part.x, part.p, part.w};
  double* const outputs[] = {part.y, part.jacobian, part.hessian};
  const std::size_t in_strides[] = {strides.x, strides.p, strides.w},
                    out_strides[] = {strides.y, strides.jacobian, strides.hessian};
  std::vector<OpenClProgram::Array> arrays;
  Real* next = room.data();
  Real* results[3] = {};
  for (std::size_t k = 0; k < 3; ++k) {
    if (kernel.inputs[k] == 0) continue;
    send(inputs[k], in_strides[k], kernel.inputs[k], part.count, next);
    arrays.push_back({.in = next, .bytes = kernel.inputs[k] * part.count * sizeof(Real)});
    next += kernel.inputs[k] * part.count;
  }
  for (std::size_t k = 0; k < 3; ++k) {
    if (kernel.outputs[k] == 0) continue;
    results[k] = next;
    arrays.push_back(
        {.out = outputs[k] ? next : nullptr, .bytes = kernel.outputs[k] * part.count * sizeof(Real)});
    next += kernel.outputs[k] * part.count;
  }
  if (kernel.is_guarded) arrays.push_back({.out = part.status, .bytes = part.count * sizeof(std::uint32_t)});
  program->run(static_cast<std::size_t>(wanted), arrays, part.count);
  for (std::size_t k = 0; k < 3; ++k) {
    if (outputs[k] && results[k])
      fetch(results[k], out_strides[k], kernel.outputs[k], part.count, outputs[k]);
  }
}

template <class Real>
Violation DeviceFunction::State::run(Order wanted, const Points& points, const Strides& strides,
                                     std::vector<Real>& room) const {
  const DeviceKernel& kernel = source.kernels[static_cast<std::size_t>(wanted)];
  const std::size_t most = states_at_once(kernel, program->device(), sizeof(Real), how.most_states);
  Violation first;
  for (std::size_t begin = 0; begin < points.count; begin += most) {
    Points part = codegen::part_of(points, strides, begin, std::min(most, points.count - begin));
    if (!kernel.is_guarded && part.status) std::fill_n(part.status, part.count, 0u);
    if (kernel.is_guarded && !part.status) {
      status.resize(part.count);
      part.status = status.data();
    }
    run_part(wanted, part, strides, room);
    if (!kernel.is_guarded || first) continue;
    const std::uint32_t* const words = part.status;
    const auto* const found =
        std::find_if(words, words + part.count, [](std::uint32_t word) { return word != 0; });
    if (found != words + part.count) first = {*found, begin + static_cast<std::size_t>(found - words)};
  }
  return first;
}

DeviceFunction DeviceFunction::make(const Function& function, const CodegenOptions& options,
                                    const DeviceRunOptions& how) {
  const OpenClDevice device = codegen::device_of_name(how.device, how.single);
  auto state = std::make_shared<State>();
  state->function = function;
  state->order = options.order;
  state->how = how;
  state->source =
      generate_device(function, options, {.single = how.single, .piece_statements = how.piece_statements});
  codegen::DeviceText text;
  text.text = state->source.source.text;
  for (const DeviceKernel& kernel : state->source.kernels) {
    text.kernels.push_back(kernel.name);
    text.memory.push_back(kernel.work);
  }
  text.options = codegen::options_for(device, how.single);
  text.name = state->source.source.name;
  text.order = static_cast<int>(options.order);
  text.use_cache = options.use_cache;
  text.cache_folder = options.cache_folder;
  state->program = std::make_unique<OpenClProgram>(device, text);
  return DeviceFunction(std::move(state));
}

Violation DeviceFunction::run(Order order, const Points& points) const {
  require(order);
  if (points.side_by_side != 1)
    throw ArgumentError("run: \"" + function().name + "\" on a device takes state after state; got " +
                        std::to_string(points.side_by_side) + " side by side");
  const std::scoped_lock lock(state_->mutex);
  const Strides dense = state_->sizes(state_->source.kernels[static_cast<std::size_t>(order)]);
  const Strides& strides = points.strides ? *points.strides : dense;
  return state_->how.single ? state_->run(order, points, strides, state_->floats)
                            : state_->run(order, points, strides, state_->doubles);
}

void DeviceFunction::check(const Violation& violation, std::size_t points) const {
  if (!violation) return;
  throw GuardViolation(describe_guard(function(), violation.guard) +
                       (points > 1 ? " (at point " + std::to_string(violation.point) + ")" : ""));
}

DeviceFunction::Evaluation DeviceFunction::evaluate(Order order, std::size_t count, Numbers x, Numbers p,
                                                    Numbers w) const {
  require(order);
  Strides strides = state_->sizes(state_->source.kernels[static_cast<std::size_t>(order)]);
  const auto expect = [&](const char* block, std::size_t found, std::size_t n, bool may_be_one) {
    if (found == n * count) return n;
    if (may_be_one && found == n) return std::size_t{0};
    throw ArgumentError(std::string("evaluate: ") + block + " has " + std::to_string(found) +
                        " entries, function \"" + function().name + "\" expects " +
                        std::to_string(n * count) + ", " + std::to_string(n) + " a state");
  };
  Evaluation r{std::vector<double>(count * strides.y), std::vector<double>(count * strides.jacobian),
               std::vector<double>(count * strides.hessian)};
  strides.x = expect("x", x.size(), strides.x, false);
  strides.p = expect("p", p.size(), strides.p, true);
  strides.w = expect("w", w.size(), strides.w, true);
  check(run(order, {.count = count,
                    .x = x.data(),
                    .p = p.data(),
                    .w = w.data(),
                    .y = r.y.data(),
                    .jacobian = r.jacobian.data(),
                    .hessian = r.hessian.data(),
                    .strides = &strides}),
        count);
  return r;
}

void DeviceFunction::require(Order wanted) const {
  if (wanted <= order()) return;
  throw ArgumentError("\"" + function().name + "\" was made for order " +
                      std::to_string(static_cast<int>(order())) + " on a device and is evaluated for order " +
                      std::to_string(static_cast<int>(wanted)) +
                      "; make it with options.order = " + std::to_string(static_cast<int>(wanted)));
}

const Function& DeviceFunction::function() const { return state_->function; }
Order DeviceFunction::order() const { return state_->order; }
const Pattern& DeviceFunction::jacobian_pattern() const { return state_->source.jacobian; }
const Pattern& DeviceFunction::hessian_pattern() const { return state_->source.hessian; }
const OpenClDevice& DeviceFunction::device() const { return state_->program->device(); }
const std::string& DeviceFunction::text() const { return state_->source.source.text; }
bool DeviceFunction::was_cached() const { return state_->program->was_cached(); }

}  // namespace dyntape
