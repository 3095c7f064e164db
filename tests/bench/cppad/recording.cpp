// SPDX-License-Identifier: BSD-3-Clause
//
// Times of recording and of interpreted calls, for tests/bench/cppad/run: one source for both sides, compiled with
// CppAD's headers or with dyntape's of the same names.
//
//   recording      prints rows: function, call, ns
//
// A function has 50 variables, 10 results and 1000 or 64 000 operations: products, sums, differences, sines, and
// products and sums with a constant, in random order.  Arguments are at random among the last 100 values (near) or
// among all (far); then few operations are needed, and optimize() removes the others.
#include <chrono>
#include <cppad/cppad.hpp>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

namespace {

using Scalar = CppAD::AD<double>;
using Scalars = std::vector<Scalar>;
using Doubles = std::vector<double>;

constexpr std::size_t kVariables = 50, kResults = 10;

struct Step {
  int kind;
  std::size_t a, b;
  double c;
};

std::vector<Step> random_steps(std::size_t count, bool near) {
  std::mt19937_64 random(1);
  std::vector<Step> steps;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t all = kVariables + i, from = near && all > 100 ? all - 100 : 0;
    const auto argument = [&] { return from + random() % (all - from); };
    const int kind = static_cast<int>(random() % 10);
    const std::size_t a = argument(), b = argument();
    steps.push_back({kind, a, b, static_cast<double>(random() % 1000) / 500 - 1.0013});
  }
  return steps;
}

void take(const std::vector<Step>& steps, Scalars& v) {
  std::size_t i = kVariables;
  for (const Step& step : steps) {
    const Scalar &a = v[step.a], &b = v[step.b];
    Scalar& result = v[i++];
    switch (step.kind) {
      case 0:
      case 1:
      case 2:
        result = a * b;
        break;
      case 3:
      case 4:
        result = a + b;
        break;
      case 5:
      case 6:
        result = a - b;
        break;
      case 7:
        result = step.c * a;
        break;
      case 8:
        result = sin(a);
        break;
      default:
        result = a + step.c;
    }
  }
}

void record(const std::vector<Step>& steps, const Doubles& at, CppAD::ADFun<double>& f) {
  Scalars x(at.begin(), at.end()), v(kVariables + steps.size());
  CppAD::Independent(x);
  std::copy(x.begin(), x.end(), v.begin());
  take(steps, v);
  const Scalars y(v.end() - kResults, v.end());
  f.Dependent(x, y);
}

template <class Call>
double least_ns(const Call& call) {
  using Clock = std::chrono::steady_clock;
  double least = 1e300;
  const auto begin = Clock::now();
  for (Clock::duration all{}; all < std::chrono::milliseconds(400); all = Clock::now() - begin) {
    const auto start = Clock::now();
    call();
    least = std::min(least, std::chrono::duration<double, std::nano>(Clock::now() - start).count());
  }
  return least;
}

void measure(std::size_t count, bool near) {
  const auto steps = random_steps(count, near);
  const std::string name = std::to_string(count) + (near ? " near" : " far");
  const auto show = [&](const char* call, double ns) {
    std::printf("%s\t%s\t%.1f\n", name.c_str(), call, ns);
  };
  Doubles at(kVariables), w(kResults, 0.5);
  for (std::size_t i = 0; i < at.size(); ++i) at[i] = 0.1 + 0.01 * static_cast<double>(i);
  show("record", least_ns([&] {
         CppAD::ADFun<double> f;
         record(steps, at, f);
       }));
  show("record and optimize", least_ns([&] {
         CppAD::ADFun<double> f;
         record(steps, at, f);
         f.optimize();
       }));
  CppAD::ADFun<double> f;
  record(steps, at, f);
  f.optimize();
  show("Forward(0)", least_ns([&] { f.Forward(0, at); }));
  show("Reverse(1)", least_ns([&] { f.Reverse(1, w); }));
  show("Jacobian", least_ns([&] { f.Jacobian(at); }));
  double sum = 0;
  for (const double y : f.Forward(0, at)) sum += y;
  for (const double d : f.Reverse(1, w)) sum += d;
  show("sum", sum);
}

}  // namespace

int main() {
  for (const bool near : {true, false}) {
    for (const std::size_t count : {1000, 64000}) measure(count, near);
  }
}
