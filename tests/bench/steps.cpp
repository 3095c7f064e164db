// SPDX-License-Identifier: BSD-3-Clause
//
// How long a step of a scene takes: alone, with its Jacobians, and many states in lanes, from states along its motion; and
// where the states stay in lanes.
//
//   bench_steps SCENE.info INTEGRATOR        one JSON object; seconds a state, the quickest of many batches
//
// tests/bench/peers/mujoco_steps.py runs it beside MuJoCo.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <string>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/run/simulate/simulate.h>
#include <dyntape/interface/system/scene_system.h>

namespace {

using namespace dyntape;
using Clock = std::chrono::steady_clock;
using Eigen::MatrixXd;

constexpr int kStates = 256;

// Quickest of the rounds, each of all states.
double seconds_a_state(const std::function<void()>& all) {
  double least = HUGE_VAL;
  for (int round = 0; round < 60; ++round) {
    const auto begin = Clock::now();
    all();
    least = std::min(least, std::chrono::duration<double>(Clock::now() - begin).count());
  }
  return least / kStates;
}

// States of the motion, evenly in time.
MatrixXd states_of(const Scene& scene, int nx) {
  const SimulatedMotion motion = simulate(scene);
  if (!motion.trouble.empty()) throw ArgumentError(motion.trouble);
  MatrixXd x = MatrixXd::Zero(nx, kStates);
  for (int k = 0; k < kStates; ++k) {
    const int sample = k * (motion.samples() - 1) / (kStates - 1);
    x.col(k).head(motion.q.rows()) = motion.q.col(sample);
    x.col(k).segment(motion.q.rows(), motion.v.rows()) = motion.v.col(sample);
  }
  return x;
}

void run(const std::string& file, const std::string& word) {
  Scene scene = read_scene(file);
  for (Integrator integrator : kIntegrators) {
    if (word == to_string(integrator)) scene.integrator = integrator;
  }
  CodegenOptions options;
  options.lanes = Lanes::kNative;
  options.functions = Functions::kPortable;
  const System system = system_of(scene.robot);
  Stepper one(system, scene.integrator, {}, true), many(system, scene.integrator, options);
  const MatrixXd x = states_of(scene, one.nx());
  MatrixXd next = x, A, B, P;
  const Eigen::VectorXd u = Eigen::VectorXd::Zero(one.n_u());
  const double h = scene.step;
  const double step = seconds_a_state([&] {
    for (int k = 0; k < kStates; ++k) one.step(0, h, x.col(k).data(), u.data(), nullptr, next.col(k).data());
  });
  const double jacobians = seconds_a_state([&] {
    for (int k = 0; k < kStates; ++k)
      one.jacobians(0, h, x.col(k).data(), u.data(), nullptr, next.col(k).data(), A, B, P);
  });
  const std::vector<double> t(kStates, 0.0);
  const double batch = seconds_a_state([&] {
    StateRows rows;
    rows.count = kStates, rows.t = t.data(), rows.x = x.data(), rows.u = u.data(), rows.stride_u = 0;
    rows.x_next = next.data();
    many.steps(h, rows);
  });
  const std::size_t W = many.lane_width(), width = 2 + std::size_t(many.n_u());
  std::vector<double> in(kStates * std::size_t(many.nx())), out(in.size()), arguments(kStates * width);
  std::vector<std::uint32_t> status(kStates);
  for (std::size_t k = 0; k < kStates; ++k) {
    for (std::size_t i = 0; i < std::size_t(many.nx()); ++i)
      in[(k / W * std::size_t(many.nx()) + i) * W + k % W] = x(Eigen::Index(i), Eigen::Index(k));
    arguments[(k / W * width + 1) * W + k % W] = h;
  }
  const double kept = seconds_a_state(
      [&] { many.steps_side_by_side(kStates, in.data(), arguments.data(), out.data(), status.data()); });
  std::printf(
      "{\"integrator\": \"%s\", \"step\": %.4g, \"jacobians\": %.4g, \"lanes\": %.4g, \"in_lanes\": %.4g, "
      "\"h\": %g}\n",
      to_string(scene.integrator), step, jacobians, batch, kept, h);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "bench_steps: expected SCENE.info INTEGRATOR\n");
    return 2;
  }
  try {
    run(argv[1], argv[2]);
  } catch (const dyntape::Error& e) {
    std::fprintf(stderr, "bench_steps: %s\n", e.what());
    return 1;
  }
}
