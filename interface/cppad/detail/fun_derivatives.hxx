// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace CppAD::inline dyntape_names::detail {

template <class Base>
std::vector<Base> Fun<Base>::slopes(const Values& direction) {
  inputs_.resize(1);
  inputs_[0].resize(1);
  inputs_[0].push_back(direction);
  orders_ = 2;
  stale_ = true;
  run_all();
  Values dy;
  for (std::size_t i = 0; i < range(); ++i) dy.push_back(runs_[0]->taylor.output(i).at(1));
  return dy;
}

template <class Base>
std::vector<Base> unit(std::size_t n, std::size_t j) {
  std::vector<Base> e(n, Base(0));
  e[j] = Base(1);
  return e;
}

// One of all lines of a colour.
template <class Base>
std::vector<Base> seed_of(const Colors& colors, std::size_t color, std::size_t n) {
  std::vector<Base> seed(n, Base(0));
  for (std::size_t s = 0; s < n; ++s) {
    if (colors.color[s] == color) seed[s] = Base(1);
  }
  return seed;
}

// Back to the point, as if nothing but order zero had been asked for.
template <class Fun, class Values>
void settle(Fun& fun, const Values& x) {
  fun.start_at(x);
}

template <class Base>
std::vector<Base> Fun<Base>::jacobian(const Values& x) {
  const std::size_t n = domain(), m = range();
  check_size("Jacobian: x", x.size(), n);
  start_at(x);
  Values J(m * n);
  std::size_t results = 0;
  for (std::size_t i = 0; i < m; ++i) results += !is_parameter(i);
  // What users give of an atomic function is order one in reverse rather than forward.
  if (recording_->kernels.empty() ? n <= results : n < results) {
    for (std::size_t j = 0; j < n; ++j) {
      const Values dy = slopes(unit<Base>(n, j));
      for (std::size_t i = 0; i < m; ++i) J[i * n + j] = dy[i];
    }
    settle(*this, x);
  } else {
    for (std::size_t i = 0; i < m; ++i) {
      if (is_parameter(i)) {
        std::fill_n(J.begin() + static_cast<std::ptrdiff_t>(i * n), n, Base(0));
        continue;
      }
      const Values dx = reverse(1, unit<Base>(m, i));
      std::copy(dx.begin(), dx.end(), J.begin() + static_cast<std::ptrdiff_t>(i * n));
    }
  }
  return J;
}

template <class Base>
std::vector<Base> Fun<Base>::second_order(const Values& directions, const Values& w) {
  const std::size_t n = domain();
  Values second(directions.size());
  if constexpr (std::is_same_v<Base, double>) {
    // Deriving takes as long as about a hundred sweeps.
    swept_ += directions.size() / n;
    if (directions.size() > n && swept_ > 100 && recording_->kernels.empty()) {
      if (!products_) products_ = std::make_unique<HessianProducts>(*recording_->function, range());
      if ((*products_)(Values(inputs_[0][0]), dynamics_, w, directions, second)) return second;
    }
  }
  for (std::size_t l = 0; l * n < directions.size(); ++l) {
    const auto from = directions.begin() + static_cast<std::ptrdiff_t>(l * n);
    slopes(Values(from, from + static_cast<std::ptrdiff_t>(n)));
    const Values both = reverse(2, w);
    for (std::size_t k = 0; k < n; ++k) second[l * n + k] = both[k * 2 + 1];
  }
  return second;
}

template <class Base>
std::vector<Base> Fun<Base>::hessian(const Values& x, const Values& w) {
  const std::size_t n = domain();
  check_size("Hessian: x", x.size(), n);
  check_size("Hessian: w", w.size(), range());
  start_at(x);
  Values directions(n * n, Base(0));
  for (std::size_t j = 0; j < n; ++j) directions[j * n + j] = Base(1);
  const Values columns = second_order(directions, w);
  Values H(n * n);
  for (std::size_t j = 0; j < n; ++j) {
    for (std::size_t k = 0; k < n; ++k) H[k * n + j] = columns[j * n + k];
  }
  settle(*this, x);
  return H;
}

template <class Base>
std::vector<Base> Fun<Base>::for_one(const Values& x, std::size_t j) {
  check_size("ForOne: x", x.size(), domain());
  check_index("ForOne: variable", j, domain());
  start_at(x);
  return slopes(unit<Base>(domain(), j));
}

template <class Base>
std::vector<Base> Fun<Base>::rev_one(const Values& x, std::size_t i) {
  check_size("RevOne: x", x.size(), domain());
  check_index("RevOne: result", i, range());
  start_at(x);
  return reverse(1, unit<Base>(range(), i));
}

template <class Base>
std::vector<Base> Fun<Base>::for_two(const Values& x, const std::vector<std::size_t>& j,
                                     const std::vector<std::size_t>& k) {
  const std::size_t n = domain(), m = range(), p = j.size();
  check_size("ForTwo: x", x.size(), n);
  check_size("ForTwo: k", k.size(), p);
  Values second(m * p);
  const auto half = [&](const Values& direction) {  // of the second derivative along it
    start_at(x);
    slopes(direction);
    inputs_[0].push_back(Values(n, Base(0)));
    orders_ = 3;
    stale_ = true;
    run_all();
    Values y;
    for (std::size_t i = 0; i < m; ++i) y.push_back(runs_[0]->taylor.output(i).at(2));
    return y;
  };
  for (std::size_t l = 0; l < p; ++l) {
    check_index("ForTwo: variable", j[l], n);
    check_index("ForTwo: variable", k[l], n);
    Values both = unit<Base>(n, j[l]);
    both[k[l]] = Base(1);
    const Values along = half(both);
    if (j[l] == k[l]) {
      for (std::size_t i = 0; i < m; ++i) second[i * p + l] = Base(2) * along[i];
      continue;
    }
    const Values a = half(unit<Base>(n, j[l])), b = half(unit<Base>(n, k[l]));
    for (std::size_t i = 0; i < m; ++i) second[i * p + l] = along[i] - a[i] - b[i];
  }
  settle(*this, x);
  return second;
}

template <class Base>
std::vector<Base> Fun<Base>::rev_two(const Values& x, const std::vector<std::size_t>& i,
                                     const std::vector<std::size_t>& j) {
  const std::size_t n = domain(), p = i.size();
  check_size("RevTwo: x", x.size(), n);
  check_size("RevTwo: j", j.size(), p);
  start_at(x);
  Values second(n * p);
  for (std::size_t l = 0; l < p; ++l) {
    check_index("RevTwo: result", i[l], range());
    check_index("RevTwo: variable", j[l], n);
    const Values column = second_order(unit<Base>(n, j[l]), unit<Base>(range(), i[l]));
    for (std::size_t k = 0; k < n; ++k) second[k * p + l] = column[k];
  }
  settle(*this, x);
  return second;
}

template <class Base>
std::size_t Fun<Base>::sparse_jacobian(const Values& x, const Entries& entries, const Pattern& pattern,
                                       bool forward, Colors& colors, Values& values) {
  const std::size_t n = domain(), m = range();
  check_size("sparse_jac: x", x.size(), n);
  color_lines("sparse_jac", entries, pattern, m, n, !forward, colors);
  start_at(x);
  values.assign(entries.row.size(), Base(0));
  for (std::size_t c = 0; c < colors.count(); ++c) {
    const Values seed = seed_of<Base>(colors, c, forward ? n : m);
    const Values found = forward ? slopes(seed) : reverse(1, seed);
    for (const Colors::Source& source : colors.sources[c]) values[source.entry] = found[source.at];
  }
  settle(*this, x);
  return colors.count();
}

template <class Base>
std::size_t Fun<Base>::sparse_hessian(const Values& x, const Values& w, const Entries& entries,
                                      const Pattern& pattern, bool use_symmetry, Colors& colors,
                                      Values& values) {
  const std::size_t n = domain();
  check_size("sparse_hes: x", x.size(), n);
  check_size("sparse_hes: w", w.size(), range());
  if (use_symmetry) {
    color_symmetric("sparse_hes", entries, pattern, n, colors);
  } else {
    color_lines("sparse_hes", entries, pattern, n, n, false, colors);
  }
  start_at(x);
  values.assign(entries.row.size(), Base(0));
  Values seeds;
  for (std::size_t c = 0; c < colors.count(); ++c) {
    const Values seed = seed_of<Base>(colors, c, n);
    seeds.insert(seeds.end(), seed.begin(), seed.end());
  }
  const Values found = second_order(seeds, w);
  for (std::size_t c = 0; c < colors.count(); ++c) {
    for (const Colors::Source& source : colors.sources[c]) values[source.entry] = found[c * n + source.at];
  }
  settle(*this, x);
  return colors.count();
}

template <class Base>
void Fun<Base>::subgraph_reverse(std::size_t q, std::size_t i, const std::vector<bool>& of_domain,
                                 std::vector<std::size_t>& col, Values& dw) {
  check_index("subgraph_reverse: result", i, range());
  Values w(range() * q, Base(0));
  w[i * q + q - 1] = Base(1);
  const Values all = reverse(q, w);
  col.clear();
  dw.assign(all.size(), Base(0));
  const Pattern& pattern = kept_pattern(false);
  const auto first = std::lower_bound(pattern.row.begin(), pattern.row.end(), i) - pattern.row.begin();
  for (auto e = static_cast<std::size_t>(first); e < pattern.nnz() && pattern.row[e] == i; ++e) {
    const std::size_t j = pattern.col[e];
    if (!of_domain[j]) continue;
    col.push_back(j);
    for (std::size_t k = 0; k < q; ++k) dw[j * q + k] = all[j * q + k];
  }
}

template <class Base>
Pattern Fun<Base>::jacobian_pattern(bool dependency) const {
  return first_order_pattern(*recording_->function, range(), dependency, recording_->kernels);
}

template <class Base>
Pattern Fun<Base>::hessian_pattern(const std::vector<bool>& of_range) const {
  return second_order_pattern(*recording_->function, range(), of_range, recording_->kernels);
}

template <class Base>
const Pattern& Fun<Base>::kept_pattern(bool dependency) {
  auto& kept = kept_patterns_[dependency];
  if (!kept) kept = jacobian_pattern(dependency);
  return *kept;
}

template <class Base>
std::size_t Fun<Base>::kept_bytes() const {
  std::size_t bytes = 0;
  for (const auto& kept : kept_patterns_) bytes += kept ? sizeof(Pattern) + 8 * kept->nnz() : 0;
  return bytes;
}

template <class Base>
void Fun<Base>::optimize(bool without_compare, bool without_print) {
  auto shorter = std::make_shared<Recording<Base>>(*recording_);
  Function function = *recording_->function;
  if (without_compare) function.guards.clear(), shorter->guard_counts.clear();
  shorter->guard_places.clear();
  if (without_print) function.outputs.resize(range()), shorter->prints.clear();
  shorter->function = std::make_shared<const Function>(compact(function));
  recording_ = shorter;
  sizes_.reset();
  runs_.clear();
  products_.reset();
  stale_ = true;
  orders_ = 0;
}

template <class Base>
std::shared_ptr<Fun<AD<Base>>> on_recorded(const Fun<Base>& fun) {
  const Recording<Base>& from = fun.recording();
  auto recording = std::make_shared<Recording<AD<Base>>>();
  recording->function = from.function;
  recording->range = from.range;
  recording->prints = from.prints;
  recording->guard_counts = from.guard_counts;
  recording->kernels = from.kernels;
  recording->captured.assign(from.captured.begin(), from.captured.end());
  recording->variables.assign(from.variables.begin(), from.variables.end());
  recording->dynamics.assign(fun.dynamics().begin(), fun.dynamics().end());
  return std::make_shared<Fun<AD<Base>>>(std::move(recording));
}

}  // namespace CppAD::inline dyntape_names::detail
