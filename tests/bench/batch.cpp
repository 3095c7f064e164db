// SPDX-License-Identifier: BSD-3-Clause
//
// Many solves of one problem: one after another (DdpSolver) and side by side (DdpBatch), in one run on one core.
//
//   bench_batch cart-pole|arm [COUNT [INTERVALS]]            one JSON object a line; microseconds a problem
//
// with_sensitivities: by four parameters, the place where the motion is to end, and by the start.
// Swing-ups of a cart-pole, and reaches of an arm of two links in the plane, from random starts.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/batch/ddp_batch.h>
#include <dyntape/interface/io/stopwatch.h>

namespace {

using namespace dyntape;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Four parameters that the motion is to end at.
void add_goal(Problem& p, const Eigen::Vector4d& place) {
  const Parameter goal = p.parameters.add("goal", place);
  p.add(terminal_squares("there", [goal](const auto& s) { return (30.0 * (s.x - goal(s))).eval(); }));
}

// Cart 1 kg, point mass 0.3 kg on a rod of 0.5 m that hangs at th = 0; u pushes the cart.
Problem cart_pole() {
  Problem p("cart-pole", {"p", "th", "pd", "thd"}, {"u"}, 2, [](const auto& s) {
    using std::cos, std::sin;
    const double m1 = 1, m2 = 0.3, l = 0.5, g = 9.81;
    const auto &th = s.x[1], &w = s.x[3], &u = s.u[0];
    const auto c = cos(th), n = sin(th), d = m1 + m2 * n * n;
    using T = std::decay_t<decltype(d)>;
    const T push = (l * m2 * n * w * w + u + m2 * g * c * n) / d,
            spin = -(l * m2 * c * n * w * w + u * c + (m1 + m2) * g * n) / (l * d);
    return vector(T(s.x[2]), T(w), push, spin);
  });
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));
  add_goal(p, {1, std::numbers::pi, 0, 0});
  return p;
}

// Links of 1 kg and 0.5 m, their masses at their ends; torques at both joints, gravity along the plane.
Problem arm() {
  Problem p("arm", {"a", "b", "ad", "bd"}, {"s", "e"}, 1, [](const auto& s) {
    using std::cos, std::sin;
    const double l = 0.5, g = 9.81;
    const auto &a = s.x[0], &b = s.x[1], &ad = s.x[2], &bd = s.x[3];
    using T = std::decay_t<decltype(cos(b))>;
    const T c = cos(b), h = l * l * sin(b), m11 = l * l * (3.0 + 2.0 * c), m12 = l * l * (1.0 + c),
            f2 = g * l * sin(a + b), r1 = s.u[0] + h * bd * (2.0 * ad + bd) - 2.0 * g * l * sin(a) - f2,
            r2 = s.u[1] - h * ad * ad - f2, m22(l * l), d = m11 * m22 - m12 * m12;
    return vector(T(ad), T(bd), T((m22 * r1 - m12 * r2) / d), T((m11 * r2 - m12 * r1) / d));
  });
  p.add(running_squares("effort", [](const auto& s) { return (0.1 * s.u).eval(); }));
  add_goal(p, {1.5, 0.8, 0, 0});
  return p;
}

void measure(Problem p, DdpHessian hessian, Functions functions, int count, int intervals) {
  p.start.setZero(), p.goal.setConstant(Problem::kFree);
  const Eigen::Index n_u = p.n_u();
  p.guess = [n_u](double t) { return Stage<double>{t, VectorXd::Zero(4), {}, VectorXd::Constant(n_u, 0.1)}; };
  DdpOptions options{.intervals = intervals, .hessian = hessian, .verify = false};
  options.evaluation.functions = functions;
  std::mt19937_64 numbers(1);
  const MatrixXd starts =
      MatrixXd::NullaryExpr(4, count, [&] { return double(numbers() >> 11) * 0x1p-53 - 0.5; });
  DdpSolver solver(p, options);
  const DdpBatch batch(p, options);
  double begin = thread_seconds();
  const std::vector<DdpSolution> all = batch.solve({.starts = starts});
  const double together = thread_seconds() - begin;
  DdpOptions derived = options;
  derived.sensitivities = SensitivitiesOf::kMotion;
  const DdpBatch with_sensitivities(p, derived);
  begin = thread_seconds();
  with_sensitivities.solve({.starts = starts});
  const double with = thread_seconds() - begin;
  Problem now = p;
  int same = 0, solved = 0;
  std::size_t iterations = 0;
  begin = thread_seconds();
  for (int i = 0; i < count; ++i) {
    now.start = starts.col(i);
    solver.set_values(now);
    const DdpSolution s = solver.solve();
    const DdpSolution& other = all[std::size_t(i)];
    same += s.status == other.status && std::abs(s.cost - other.cost) <= 1e-6 * (1 + s.cost);
    solved += s.success(), iterations += s.iterations.size();
  }
  const double alone = thread_seconds() - begin;
  std::printf(
      "{\"problem\": \"%s\", \"hessian\": \"%s\", \"functions\": \"%s\", \"count\": %d, \"lanes\": %d, "
      "\"solved\": %d, "
      "\"same\": %d, \"iterations\": %.1f, \"alone_us\": %.1f, \"batch_us\": %.1f, \"times\": %.2f, "
      "\"with_sensitivities_us\": %.1f}\n",
      p.name.c_str(), hessian == DdpHessian::kExact ? "exact" : "gauss-newton", to_string(functions), count,
      batch.lanes(), solved, same, double(iterations) / count, 1e6 * alone / count, 1e6 * together / count,
      alone / together, 1e6 * with / count);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string name = argc > 1 ? argv[1] : "";
  if (argc > 4 || (name != "cart-pole" && name != "arm")) {
    std::fprintf(stderr, "usage: bench_batch cart-pole|arm [COUNT [INTERVALS]]\n");
    return 2;
  }
  try {
    const int count = argc > 2 ? std::max(1, std::atoi(argv[2])) : 1000,
              intervals = argc > 3 ? std::max(1, std::atoi(argv[3])) : 50;
    for (const DdpHessian hessian : {DdpHessian::kExact, DdpHessian::kGaussNewton})
      for (const Functions functions : {Functions::kPortable, Functions::kLibm})
        measure(name == "arm" ? arm() : cart_pole(), hessian, functions, count, intervals);
  } catch (const dyntape::Error& e) {
    std::fprintf(stderr, "bench_batch: %s\n", e.what());
    return 1;
  }
  return 0;
}
