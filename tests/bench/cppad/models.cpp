// SPDX-License-Identifier: BSD-3-Clause
//
// Times of the calls of compiled models, for tests/bench/cppad/run: one source for both sides, compiled with
// CppADCodeGen's headers or with dyntape's of the same names.
//
//   models FOLDER [FLAG ...]      compiles the models in FOLDER with these flags; prints rows: function, call, ns
#include <unistd.h>
#include <cppad/cg/cppadcg.hpp>

#include <chrono>
#include <cstdio>
#include <functional>

namespace {

using CGD = CppAD::cg::CG<double>;
using Scalar = CppAD::AD<CGD>;
using Vector = std::vector<Scalar>;
using Doubles = std::vector<double>;

struct Function {
  const char* name;
  std::size_t n;
  std::function<Vector(const Vector&)> f;
};

Vector cart_pole(const Vector& x) {  // position, angle, their velocities, force
  const double cart = 1, pole = 0.2, length = 0.5, gravity = 9.81;
  const Scalar s = sin(x[1]), c = cos(x[1]);
  const Scalar mass = cart + pole * s * s;
  const Scalar pull = pole * length * x[3] * x[3] * s;
  return {x[2], x[3], (x[4] + pull + pole * gravity * s * c) / mass,
          -(x[4] * c + pull * c + (cart + pole) * gravity * s) / (length * mass)};
}

Vector arm(const Vector& q) {
  Scalar angle(0.0), x(0.0), y(0.0);
  for (std::size_t i = 0; i < q.size(); ++i) {
    angle += q[i];
    x += 0.3 * cos(angle);
    y += 0.3 * sin(angle);
  }
  return {x, y};
}

Vector chain(const Vector& x) {
  Scalar sum(0.0);
  for (std::size_t i = 0; i + 1 < x.size(); ++i) {
    const Scalar d = x[i + 1] - x[i] * x[i];
    sum += 100.0 * d * d + (1.0 - x[i]) * (1.0 - x[i]);
  }
  return {sum};
}

Vector cubic(const Vector& x) {
  Scalar sum(0.0);
  for (std::size_t i = 0; i < x.size(); ++i)
    sum += x[i] * x[i] * x[(i + 1) % x.size()] + 0.5 * x[i] * x[(i + 3) % x.size()];
  return {sum};
}

Vector rotations(const Vector& q) {
  Vector v = {Scalar(0.1), Scalar(0.2), Scalar(0.3)};
  for (std::size_t i = 0; i < q.size(); ++i) {
    const std::size_t j = i % 3, k = (i + 1) % 3;
    const Scalar s = sin(q[i]), c = cos(q[i]), a = v[j], b = v[k];
    v[j] = c * a - s * b;
    v[k] = s * a + c * b + 0.1;
  }
  return v;
}

const Function kFunctions[] = {
    {"double integrator", 3,
     [](const Vector& x) {
       return Vector{x[1], x[2]};
     }},
    {"cart-pole", 5, cart_pole},
    {"arm of 6 joints in the plane", 6, arm},
    {"chain of 12 variables", 12, chain},
    {"cubic polynomial of 20 variables", 20, cubic},
    {"six rotations in space", 6, rotations},
};

template <class Call>
double least_ns(const Call& call) {
  using Clock = std::chrono::steady_clock;
  const auto ns = [&](int calls) {
    const auto start = Clock::now();
    for (int i = 0; i < calls; ++i) call();
    return std::chrono::duration<double, std::nano>(Clock::now() - start).count();
  };
  int calls = 16;
  while (ns(calls) < 20e3) calls *= 2;
  double least = 1e300;
  for (int k = 0; k < 400; ++k) least = std::min(least, ns(calls) / calls);
  return least;
}

void measure(const Function& function, const std::vector<std::string>& flags) {
  Vector x(function.n, Scalar(0.3));
  CppAD::Independent(x);
  CppAD::ADFun<CGD> f;
  f.Dependent(x, function.f(x));
  f.optimize();
  std::string name = function.name;
  for (char& c : name)
    if (c == ' ' || c == '-') c = '_';
  CppAD::cg::ModelCSourceGen<double> source(f, name);
  source.setCreateJacobian(true), source.setCreateHessian(true);
  source.setCreateSparseJacobian(true), source.setCreateSparseHessian(true);
  source.setCreateForwardOne(true), source.setCreateReverseOne(true);
  CppAD::cg::ModelLibraryCSourceGen<double> sources(source);
  CppAD::cg::DynamicModelLibraryProcessor<double> processor(sources, "./" + name);
  CppAD::cg::GccCompiler<double> compiler;
  if (!flags.empty()) compiler.setCompileFlags(flags);
  const auto library = processor.createDynamicLibrary(compiler);
  const auto model = library->model(name);

  const std::size_t n = model->Domain(), m = model->Range();
  using In = CppAD::cg::ArrayView<const double>;
  using Out = CppAD::cg::ArrayView<double>;
  Doubles at(n), w(m), y(m), J(n * m), H(n * n), all(n * (n + m));
  for (std::size_t i = 0; i < n; ++i) at[i] = 0.3 + 0.1 * static_cast<double>(i % 5);
  for (std::size_t i = 0; i < m; ++i) w[i] = 1 - 0.25 * static_cast<double>(i);
  std::vector<std::size_t> row, col;
  model->JacobianSparsity(row, col);
  const std::size_t jacobian_entries = row.size();
  model->HessianSparsity(row, col);
  const std::size_t hessian_entries = row.size();
  const std::size_t *rows = nullptr, *cols = nullptr;
  const auto show = [&](const char* call, double ns) {
    std::printf("%s\t%s\t%.3f\n", function.name, call, ns);
  };
  const In in(at.data(), n), weights(w.data(), m);
  show("ForwardZero", least_ns([&] { model->ForwardZero(in, Out(y.data(), m)); }));
  show("sparse Jacobian",
       least_ns([&] { model->SparseJacobian(in, Out(all.data(), jacobian_entries), &rows, &cols); }));
  show("sparse Hessian",
       least_ns([&] { model->SparseHessian(in, weights, Out(all.data(), hessian_entries), &rows, &cols); }));
  show("dense Jacobian", least_ns([&] { model->Jacobian(in, Out(J.data(), n * m)); }));
  show("dense Hessian", least_ns([&] { model->Hessian(in, weights, Out(H.data(), n * n)); }));
  double sum = 0;
  for (const Doubles* values : {&y, &J, &H})
    for (const double value : *values) sum += value * value;
  show("sum", sum);
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 2 || chdir(arguments[1]) != 0)
    return std::fprintf(stderr, "usage: models FOLDER [FLAG ...]\n"), 2;
  for (const Function& function : kFunctions) measure(function, {arguments + 2, arguments + count});
}
