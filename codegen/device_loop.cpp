// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/device_loop.h>

#include <algorithm>
#include <mutex>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/device_transfer.h>
#include <dyntape/codegen/pipeline.h>

namespace dyntape {

using codegen::OpenClProgram;

namespace {

// Of a launch, so that it ends within about a second on a processor, and within the patience of a card's driver.
constexpr double kLaunchOperations = 4e9;

}  // namespace

struct DeviceLoop::State {
  std::size_t n_x = 0, shared = 0, rest = 0, constants = 0, work = 0;
  double operations = 1;
  DeviceRunOptions how;
  std::string text;
  std::unique_ptr<OpenClProgram> program;
  mutable std::mutex mutex;  // of the program's arrays, which are kept from launch to launch

  template <class Real>
  void run(const Run& all, const std::stop_token& stop) const;
  template <class Real>
  void run_part(const Run& part, std::size_t steps_at_once, const std::stop_token& stop) const;
  std::size_t states_at_once(std::size_t real) const;
};

// States that are on the device together: those of one step at least, in a quarter of what is sent at a time.
std::size_t DeviceLoop::State::states_at_once(std::size_t real) const {
  const std::size_t of_state = real * (2 * n_x + rest + constants);
  const std::size_t fitting =
      std::min({codegen::kPartBytes / 4 / of_state, program->device().largest_buffer / of_state,
                program->device().memory / 2 / (of_state + work)});
  return how.most_states ? std::min(how.most_states, std::max<std::size_t>(1, fitting))
                         : std::max<std::size_t>(1, fitting);
}

template <class Real>
void DeviceLoop::State::run_part(const Run& part, std::size_t steps_at_once,
                                 const std::stop_token& stop) const {
  const std::size_t count = part.count, kept = part.steps / part.every;
  const std::size_t constants_count = part.stride_constants == 0 ? 1 : count;
  std::vector<Real> x(count * n_x), both, own, fixed(constants_count * constants), states;
  codegen::send(part.x, part.stride_x, n_x, count, x.data());
  codegen::send(part.constants, part.stride_constants, constants, constants_count, fixed.data());
  std::size_t done = 0;  // states that are kept
  for (std::size_t first = 0; first < part.steps && !stop.stop_requested(); first += steps_at_once) {
    const std::size_t steps = std::min(steps_at_once, part.steps - first),
                      here = (first + steps) / part.every - first / part.every;
    const std::size_t p_count = part.stride_p == 0 ? 1 : count;
    const std::uint64_t loop[] = {steps, part.every, first, p_count, constants_count};
    both.assign(part.shared + first * shared, part.shared + (first + steps) * shared);
    own.resize(p_count * steps * rest);
    codegen::send(part.p + first * rest, part.stride_p, steps * rest, p_count, own.data());
    states.resize(std::max<std::size_t>(1, here * n_x * count));
    std::vector<OpenClProgram::Array> arrays = {
        {.in = first == 0 ? x.data() : nullptr, .bytes = x.size() * sizeof(Real)}};
    if (shared) arrays.push_back({.in = both.data(), .bytes = both.size() * sizeof(Real)});
    if (rest) arrays.push_back({.in = own.data(), .bytes = own.size() * sizeof(Real)});
    if (constants)
      arrays.push_back({.in = first == 0 ? fixed.data() : nullptr, .bytes = fixed.size() * sizeof(Real)});
    arrays.push_back({.out = here ? states.data() : nullptr, .bytes = states.size() * sizeof(Real)});
    arrays.push_back({.in = loop, .bytes = sizeof loop});
    program->run(0, arrays, count);
    if (here) codegen::fetch(states.data(), kept * n_x, here * n_x, count, part.states + done * n_x);
    done += here;
  }
}

template <class Real>
void DeviceLoop::State::run(const Run& all, const std::stop_token& stop) const {
  const std::size_t most = states_at_once(sizeof(Real)), kept = all.steps / all.every;
  for (std::size_t first = 0; first < all.count && !stop.stop_requested(); first += most) {
    Run part = all;
    part.count = std::min(most, all.count - first);
    part.x += first * all.stride_x;
    if (part.p) part.p += first * all.stride_p;
    if (part.constants) part.constants += first * all.stride_constants;
    part.states += first * kept * n_x;
    const auto count = static_cast<double>(part.count);
    const auto buffer =
        static_cast<double>(std::min<std::uint64_t>(codegen::kPartBytes, program->device().largest_buffer));
    const double of_step = sizeof(Real) * count * double(rest + n_x);
    const double steps =
        std::min({kLaunchOperations / (operations * count), buffer / of_step, double(all.steps)});
    const auto fitting = std::max<std::size_t>(1, static_cast<std::size_t>(steps));
    run_part<Real>(part, how.most_steps ? std::min(how.most_steps, fitting) : fitting, stop);
  }
}

DeviceLoop DeviceLoop::make(const Function& step, const codegen::LoopParameters& parameters,
                            const CodegenOptions& options, const DeviceRunOptions& how) {
  const codegen::OpenClDevice device = codegen::device_of_name(how.device, how.single);
  CodegenOptions value = options;
  value.order = Order::kValue;
  const codegen::DeviceSource source = generate_device(
      step, value, {.single = how.single, .piece_statements = how.piece_statements, .loop = parameters});
  const codegen::DeviceKernel& kernel = source.kernels[0];
  auto state = std::make_shared<State>();
  state->n_x = step.n_x(), state->shared = parameters.shared, state->constants = parameters.constants;
  state->rest = step.n_p() - state->shared - state->constants;
  state->work = kernel.work;
  state->operations = std::max(1.0, double(source.source.operations[0]));
  state->how = how;
  state->text = source.source.text;
  state->program = std::make_unique<OpenClProgram>(
      device, codegen::DeviceText{.text = state->text,
                                  .kernels = {kernel.name},
                                  .options = codegen::options_for(device, how.single),
                                  .name = source.source.name,
                                  .memory = {kernel.work},
                                  .use_cache = options.use_cache,
                                  .cache_folder = options.cache_folder});
  return DeviceLoop(std::move(state));
}

void DeviceLoop::run(const Run& all, const std::stop_token& stop) const {
  if (all.every == 0) throw ArgumentError("loop: every is 0, expected 1 or more");
  const std::scoped_lock lock(state_->mutex);
  state_->how.single ? state_->run<float>(all, stop) : state_->run<double>(all, stop);
}

const codegen::OpenClDevice& DeviceLoop::device() const { return state_->program->device(); }
const std::string& DeviceLoop::text() const { return state_->text; }

}  // namespace dyntape
