// SPDX-License-Identifier: BSD-3-Clause
//
// A function by every route there is, held to itself in 113 bits.
//
//   struct Sinc { template <class T> VectorX<T> operator()(const VectorX<T>& x) const { ... } };
//   expect_by_every_route("sinc", Sinc(), x, {.value = 4e-15});
//
// Routes.  Bit-equal: the interpreter point by point and in lanes, C at -O0 and at -O3, point by point and in lanes,
// with a harmless point beside each hard one.  To a tolerance: the template in double, the interpreter with portable
// functions and with libm's, the function as a callee of another, forward mode, reverse mode, forward over reverse.
// References: the template in 113 bits for values; the derived graph in 113 bits for derivatives, itself held to differences
// of the template there.
#pragma once

#include <gtest/gtest.h>

#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/eigen.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/dynamics/algebra/float128.h>

#include <Eigen/Dense>
#include <functional>
#include <string>
#include <vector>

namespace dyntape::testing {

using Values = std::vector<double>;
using dynamics::Float128;
template <class T>
using VectorOf = Eigen::Matrix<T, Eigen::Dynamic, 1>;

::testing::AssertionResult same_bits(const Values& a, const Values& b);

// Largest difference over the largest entry expected, or over `least_scale`; what is not finite has to be so in both.
double error_of(const Values& got, const Values& expected, double least_scale = 0);

struct RouteOptions {
  std::vector<std::string> levels = {"-O0", "-O3"};
  bool lanes = true;    // kernels of several lanes as well
  double near = 1e-13;  // of routes that are not bit-equal, over the largest entry of a part
  double size = 0;      // of what values are differences of, where that is more than they are
};

// A function by every route; the routes must agree.
class EveryRoute {
 public:
  EveryRoute(const Function& function, Order order, const RouteOptions& options = {});

  // Values, Jacobian and Hessian non-zeros one after the other, by the interpreter; a Hessian of all outputs' sum.
  Values operator()(const Values& x) const;

  struct Parts {
    Values y, jacobian, hessian;
  };
  Parts parts(const Values& x) const;
  const Derivatives& derived() const { return derived_; }

 private:
  void expect_same_bits(const Values& x, const Values& expected) const;
  void expect_near(const Values& x, const Values& expected) const;
  void expect_directions(const Values& x, const Values& expected) const;
  void expect_parts_near(const Values& got, const Values& expected, const std::string& route) const;

  Order order_;
  RouteOptions options_;
  Derivatives derived_;
  Values weights_;
  std::vector<CompiledFunction> exact_, near_;
};

// What expect_by_every_route allows: errors over the largest entry.
struct Within {
  double value = 4e-15, slope = 1e-13, curvature = 1e-12;
  double step = 1e-9;  // of differences in 113 bits; 0: none, where the function is not smooth so far around
  double differences = 1e-11;  // what those may be off by
  Order order = Order::kSecond;
  RouteOptions routes = {};
};

// The graph's value, Jacobian and Hessian in 113 bits.
std::vector<Float128> graph_in_quad(const Derivatives& derived, const std::vector<Float128>& x);

void expect_accurate(const EveryRoute& routes, const Values& x, const std::vector<Float128>& exact_value,
                     const Within& within);
void expect_differences(const EveryRoute& routes, const Values& x,
                        const std::function<VectorOf<Float128>(const VectorOf<Float128>&)>& f,
                        const Within& within);

template <class F>
void expect_by_every_route(const std::string& name, const F& f, const Eigen::VectorXd& at,
                           const Within& within = {}) {
  const Values x(at.begin(), at.end());
  const auto in_quad = [&f](const VectorOf<Float128>& y) { return VectorOf<Float128>(f(y)); };
  const VectorOf<Float128> exact = in_quad(at.cast<Float128>());
  const Eigen::VectorXd direct = f(at), rounded = exact.template cast<double>();
  EXPECT_LE(error_of({direct.begin(), direct.end()}, {rounded.begin(), rounded.end()}), within.value)
      << "template in double";
  const Function recorded = record(name, x.size(), [&f](const VectorXad& y) { return VectorXad(f(y)); });
  const EveryRoute routes(recorded, within.order, within.routes);
  expect_accurate(routes, x, {exact.begin(), exact.end()}, within);
  if (within.step > 0) expect_differences(routes, x, in_quad, within);
}

}  // namespace dyntape::testing
