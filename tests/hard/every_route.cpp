// SPDX-License-Identifier: BSD-3-Clause
#include "every_route.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>

namespace dyntape::testing {
namespace {

// Points of one call: more than two blocks of the widest lanes.
constexpr std::size_t kPoints = 19;

Values joined(const CompiledFunction::Evaluation& r) {
  Values all = r.y;
  all.insert(all.end(), r.jacobian.begin(), r.jacobian.end());
  all.insert(all.end(), r.hessian.begin(), r.hessian.end());
  return all;
}

// The point at even places, something harmless between.
Values in_company(const Values& x) {
  Values all;
  for (std::size_t k = 0; k < kPoints; ++k) {
    for (std::size_t i = 0; i < x.size(); ++i) all.push_back(k % 2 == 0 ? x[i] : 0.4 + 0.05 * double(i % 7));
  }
  return all;
}

// Value, Jacobian and Hessian of each point of a crowd, as joined().
std::vector<Values> of_a_crowd(const CompiledFunction& f, Order order, const Values& x,
                               const Values& weights) {
  const std::size_t n_j = order == Order::kValue ? 0 : f.jacobian_pattern().nnz();
  const std::size_t n_h = order == Order::kSecond ? f.hessian_pattern().nnz() : 0;
  const Values crowd = in_company(x);
  Values w, y(kPoints * f.n_y()), J(kPoints * n_j), H(kPoints * n_h);
  for (std::size_t k = 0; k < kPoints; ++k) w.insert(w.end(), weights.begin(), weights.end());
  CompiledFunction::Workspace workspace(f);
  const Violation violation = f.run(order,
                                    {.count = kPoints,
                                     .x = crowd.data(),
                                     .w = w.data(),
                                     .y = y.data(),
                                     .jacobian = J.data(),
                                     .hessian = H.data()},
                                    workspace);
  EXPECT_FALSE(violation) << f.name();
  std::vector<Values> each(kPoints);
  for (std::size_t k = 0; k < kPoints; ++k) {
    const auto add = [&](const Values& all, std::size_t n) {
      each[k].insert(each[k].end(), all.begin() + long(k * n), all.begin() + long((k + 1) * n));
    };
    add(y, f.n_y()), add(J, n_j), add(H, n_h);
  }
  return each;
}

double size_of(const Values& all) {
  double size = 0;
  for (double x : all) size = std::isfinite(x) ? std::max(size, std::abs(x)) : size;
  return size;
}

// Numbers at the places of `has`, at those of `wanted`.
void append_at(const Pattern& wanted, const Pattern& has, const Values& numbers, double near, Values& all) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, double> at;
  for (std::size_t k = 0; k < has.nnz(); ++k) at[{has.row[k], has.col[k]}] = numbers[k];
  for (std::size_t k = 0; k < wanted.nnz(); ++k) {
    const auto found = at.find({wanted.row[k], wanted.col[k]});
    all.push_back(found == at.end() ? 0 : found->second);
    if (found != at.end()) at.erase(found);
  }
  for (const auto& [place, number] : at)
    EXPECT_LE(std::abs(number), near * size_of(numbers)) << place.first << ", " << place.second;
}

}  // namespace

::testing::AssertionResult same_bits(const Values& a, const Values& b) {
  if (a.size() != b.size()) return ::testing::AssertionFailure() << a.size() << " values and " << b.size();
  for (std::size_t i = 0; i < a.size(); ++i) {
    const bool both_nan = std::isnan(a[i]) && std::isnan(b[i]);
    if (!both_nan && std::bit_cast<std::uint64_t>(a[i]) != std::bit_cast<std::uint64_t>(b[i])) {
      return ::testing::AssertionFailure()
             << std::hexfloat << a[i] << " and " << b[i] << " at " << i << " of " << a.size();
    }
  }
  return ::testing::AssertionSuccess();
}

double error_of(const Values& got, const Values& expected, double least_scale) {
  if (got.size() != expected.size()) return HUGE_VAL;
  double error = 0, scale = least_scale;
  for (std::size_t i = 0; i < got.size(); ++i) {
    if (std::isnan(expected[i]) ? std::isnan(got[i]) : got[i] == expected[i]) {
      if (std::isfinite(got[i])) scale = std::max(scale, std::abs(got[i]));
      continue;
    }
    if (!std::isfinite(expected[i])) return HUGE_VAL;
    scale = std::max(scale, std::abs(expected[i]));
    const double difference = std::abs(got[i] - expected[i]);
    if (!(difference <= error)) error = difference;
  }
  return error == 0 ? 0 : error / scale;
}

EveryRoute::EveryRoute(const Function& function, Order order, const RouteOptions& options)
    : order_(order),
      options_(options),
      derived_(derive(function, order)),
      weights_(order == Order::kSecond ? function.n_y() : 0, 1.0) {
  CodegenOptions how;
  how.order = order;
  how.use_cache = false;
  how.route = Route::kInterpreter;
  exact_.push_back(CompiledFunction::make(function, how));
  for (const Functions functions : {Functions::kPortable, Functions::kLibm}) {
    how.functions = functions;
    near_.push_back(CompiledFunction::make(function, how));
  }
  how.functions = kDefaultFunctions;
  if (function.guards.empty() && function.n_p() == 0) {
    const auto callee = recorded_callee(function);
    const Function caller =
        record("caller", function.n_x(), [&](const VectorXad& x) { return call(callee, x); });
    near_.push_back(CompiledFunction::make(caller, how));
  }
  how.route = Route::kCompiled;
  for (const std::string& level : options.levels) {
    how.flags = {level};
    how.lanes = options.lanes && level != "-O0" ? Lanes::kNative : Lanes::kNone;
    exact_.push_back(CompiledFunction::make(function, how));
  }
}

Values EveryRoute::operator()(const Values& x) const {
  const Values expected = joined(exact_.front().evaluate(order_, x, {}, weights_));
  expect_same_bits(x, expected);
  expect_near(x, expected);
  if (order_ != Order::kValue) expect_directions(x, expected);
  return expected;
}

EveryRoute::Parts EveryRoute::parts(const Values& x) const {
  const Values all = (*this)(x);
  const auto y_end = all.begin() + long(derived_.n_y), j_end = y_end + long(derived_.jacobian.nnz());
  return {{all.begin(), y_end}, {y_end, j_end}, {j_end, all.end()}};
}

void EveryRoute::expect_same_bits(const Values& x, const Values& expected) const {
  for (std::size_t i = 0; i < exact_.size(); ++i) {
    if (i > 0) {
      EXPECT_TRUE(same_bits(joined(exact_[i].evaluate(order_, x, {}, weights_)), expected))
          << "route " << i << " of " << exact_[i].name();
    }
    const std::vector<Values> crowd = of_a_crowd(exact_[i], order_, x, weights_);
    for (std::size_t k = 0; k < crowd.size(); k += 2) {
      EXPECT_TRUE(same_bits(crowd[k], expected)) << "route " << i << ", point " << k << " of a crowd";
    }
  }
}

void EveryRoute::expect_parts_near(const Values& got, const Values& expected,
                                   const std::string& route) const {
  double scale = options_.size;  // and a Hessian is no smaller than what its Jacobian's rounding leaves
  const std::size_t ends[] = {0, derived_.n_y, derived_.n_y + derived_.jacobian.nnz(), expected.size()};
  const char* parts[] = {"value", "Jacobian", "Hessian"};
  for (int k = 0; k < 3; ++k) {
    const auto part = [&](const Values& all) {
      return Values(all.begin() + long(ends[k]), all.begin() + long(ends[k + 1]));
    };
    ASSERT_EQ(got.size(), expected.size()) << route;
    EXPECT_LE(error_of(part(got), part(expected), k == 1 ? 0 : scale), options_.near)
        << parts[k] << " by " << route;
    scale = size_of(part(expected));
  }
}

// Of another pattern: places that it does not have are zeros, those that it has besides must be.
void EveryRoute::expect_near(const Values& x, const Values& expected) const {
  for (std::size_t i = 0; i < near_.size(); ++i) {
    const CompiledFunction& f = near_[i];
    const CompiledFunction::Evaluation r = f.evaluate(order_, x, {}, weights_);
    Values all = r.y;
    if (order_ != Order::kValue)
      append_at(derived_.jacobian, f.jacobian_pattern(), r.jacobian, options_.near, all);
    if (order_ == Order::kSecond)
      append_at(derived_.hessian, f.hessian_pattern(), r.hessian, options_.near, all);
    expect_parts_near(all, expected, "route " + std::to_string(i) + " to a tolerance");
  }
}

// Columns by jvp, rows by vjp, columns of the Hessian by jvp of vjp.
void EveryRoute::expect_directions(const Values& x, const Values& expected) const {
  const Function& f = exact_.front().function();
  const std::size_t n = f.n_x(), m = f.n_y(), nnz = derived_.jacobian.nnz();
  const Function forward = jvp(f), reverse = vjp(f);
  Values by_columns(m * n), by_rows(m * n), whole(m * n, 0.0);
  for (std::size_t k = 0; k < nnz; ++k)
    whole[derived_.jacobian.row[k] * n + derived_.jacobian.col[k]] = expected[m + k];
  for (std::size_t j = 0; j < n; ++j) {
    Values unit(n, 0.0);
    unit[j] = 1;
    const Values column = evaluate(forward, x, {}, unit);
    for (std::size_t i = 0; i < m; ++i) by_columns[i * n + j] = column[i];
  }
  for (std::size_t i = 0; i < m; ++i) {
    Values unit(m, 0.0);
    unit[i] = 1;
    const Values row = evaluate(reverse, x, {}, unit);
    std::copy(row.begin(), row.end(), by_rows.begin() + long(i * n));
  }
  EXPECT_LE(error_of(by_columns, whole), options_.near) << "forward mode";
  EXPECT_LE(error_of(by_rows, whole), options_.near) << "reverse mode";
  if (order_ != Order::kSecond) return;
  const Function again = jvp(reverse);
  Values curved(n * n), full(n * n, 0.0);
  for (std::size_t k = 0; k < derived_.hessian.nnz(); ++k) {
    const std::size_t i = derived_.hessian.row[k], j = derived_.hessian.col[k];
    full[i * n + j] = full[j * n + i] = expected[m + nnz + k];
  }
  for (std::size_t j = 0; j < n; ++j) {
    Values seeds(m, 1.0);
    seeds.resize(m + n, 0.0);
    seeds[m + j] = 1;
    const Values column = evaluate(again, x, {}, seeds);
    for (std::size_t i = 0; i < n; ++i) curved[i * n + j] = column[i];
  }
  EXPECT_LE(error_of(curved, full, size_of(whole)), options_.near) << "forward over reverse";
}

std::vector<Float128> graph_in_quad(const Derivatives& derived, const std::vector<Float128>& x) {
  const std::vector<Float128> weights(derived.function.n_w(), Float128(1));
  return evaluate_as<Float128>(derived.function, x, {}, weights);
}

namespace {

double error_in_quad(const Values& got, const Float128* exact, double least_scale = 0) {
  Values rounded;
  for (std::size_t i = 0; i < got.size(); ++i) rounded.push_back(static_cast<double>(exact[i]));
  return error_of(got, rounded, least_scale);
}

}  // namespace

void expect_accurate(const EveryRoute& routes, const Values& x, const std::vector<Float128>& exact_value,
                     const Within& within) {
  const EveryRoute::Parts got = routes.parts(x);
  const std::vector<Float128> exact = graph_in_quad(routes.derived(), {x.begin(), x.end()});
  ASSERT_EQ(got.y.size(), exact_value.size());
  EXPECT_LE(error_in_quad(got.y, exact_value.data()), within.value) << "value";
  EXPECT_LE(error_in_quad(got.jacobian, exact.data() + got.y.size()), within.slope) << "Jacobian";
  EXPECT_LE(
      error_in_quad(got.hessian, exact.data() + got.y.size() + got.jacobian.size(), size_of(got.jacobian)),
      within.curvature)
      << "Hessian";
  for (const Values* part : {&got.y, &got.jacobian, &got.hessian}) {
    for (double number : *part) EXPECT_TRUE(std::isfinite(number));
  }
}

void expect_differences(const EveryRoute& routes, const Values& x,
                        const std::function<VectorOf<Float128>(const VectorOf<Float128>&)>& f,
                        const Within& within) {
  using Matrix = Eigen::MatrixXd;
  const Derivatives& d = routes.derived();
  const std::size_t n = x.size(), m = d.n_y, nnz = d.jacobian.nnz();
  const std::vector<Float128> at(x.begin(), x.end()), here = graph_in_quad(d, at);
  Matrix J = Matrix::Zero(long(m), long(n)), J_expected = J;
  Matrix H = Matrix::Zero(long(n), long(n)), H_expected = H;
  for (std::size_t k = 0; k < nnz; ++k) J(d.jacobian.row[k], d.jacobian.col[k]) = double(here[m + k]);
  for (std::size_t k = 0; k < d.hessian.nnz(); ++k) {
    H(d.hessian.row[k], d.hessian.col[k]) = H(d.hessian.col[k], d.hessian.row[k]) = double(here[m + nnz + k]);
  }
  const Float128 h(within.step);
  for (std::size_t j = 0; j < n; ++j) {
    std::vector<Float128> up = at, down = at;
    up[j] += h, down[j] -= h;
    const auto vector = [](const std::vector<Float128>& v) {
      return VectorOf<Float128>(Eigen::Map<const VectorOf<Float128>>(v.data(), long(v.size())));
    };
    const VectorOf<Float128> slope = (f(vector(up)) - f(vector(down))) / (2 * h);
    J_expected.col(long(j)) = slope.cast<double>();
    if (d.order != Order::kSecond) continue;
    const std::vector<Float128> after = graph_in_quad(d, up), before = graph_in_quad(d, down);
    for (std::size_t k = 0; k < nnz; ++k)
      H_expected(d.jacobian.col[k], long(j)) += double((after[m + k] - before[m + k]) / (2 * h));
  }
  EXPECT_LE((J - J_expected).cwiseAbs().maxCoeff(), within.differences * J.cwiseAbs().maxCoeff())
      << J_expected;
  if (d.order != Order::kSecond || H.size() == 0) return;
  EXPECT_LE((H - H_expected).cwiseAbs().maxCoeff(),
            within.differences * std::max(H.cwiseAbs().maxCoeff(), J.cwiseAbs().maxCoeff()))
      << H_expected;
}

}  // namespace dyntape::testing
