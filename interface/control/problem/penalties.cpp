// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/problem/penalties.h>

#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

void check_positive(const Term& term, const std::string& what, double value) {
  if (value > 0 && std::isfinite(value)) return;
  throw ArgumentError("the soft term \"" + term.name + "\" has a " + what + " of " + io::shortest(value) +
                      ", expected a positive number");
}

// Both smooth penalties: the residual whose square is weight r^2 2 / (sqrt(1 + (r/width)^2) + 1).
struct SmoothRoot {
  double root, width;  // of the weight

  template <class T>
  T operator()(const T& r) const {
    using std::sqrt;
    if (std::isinf(width)) return r * T(root);
    const T y = r * T(1 / width);
    return r * T(root) * sqrt(T(2) / (sqrt(T(1) + y * y) + T(1)));
  }
};

// Entry i of what lies beyond its bounds.
struct Bounded {
  StageFunction values;
  Eigen::VectorXd lower, upper;
  std::string name;

  template <class T>
  typename Stage<T>::Vector values_at(const Stage<T>& s) const {
    typename Stage<T>::Vector r = values(s);
    if (r.size() == lower.size() && r.size() == upper.size()) return r;
    throw ArgumentError("the soft term \"" + name + "\" has " + std::to_string(r.size()) +
                        " entries, its bounds have " + std::to_string(lower.size()) + " and " +
                        std::to_string(upper.size()));
  }
};

StageFunction beyond(const Bounded& term) {
  return [term](const auto& s) {
    auto r = term.values_at(s);
    using T = typename decltype(r)::Scalar;
    using ops::select;
    for (Eigen::Index i = 0; i < r.size(); ++i) {
      const T below = r[i] - T(term.lower[i]), above = r[i] - T(term.upper[i]);
      T lacks(0);
      if (term.upper[i] < HUGE_VAL) lacks = select(above > T(0), above, lacks);
      if (term.lower[i] > -HUGE_VAL) lacks = select(below < T(0), below, lacks);
      r[i] = lacks;
    }
    return r;
  };
}

// The room to each finite bound.
template <class T>
std::vector<T> rooms_of(const Bounded& term, const Stage<T>& s) {
  const auto r = term.values_at(s);
  std::vector<T> rooms;
  for (Eigen::Index i = 0; i < r.size(); ++i) {
    if (term.lower[i] > -HUGE_VAL) rooms.push_back(r[i] - T(term.lower[i]));
    if (term.upper[i] < HUGE_VAL) rooms.push_back(T(term.upper[i]) - r[i]);
  }
  return rooms;
}

// The logarithm is taken of what is positive on either side, so that the side not taken has derivatives as well.
template <class T>
T barrier_of(const T& h, const RelaxedBarrier& b) {
  using ops::select;
  using std::log;
  const auto within = h > T(b.delta);
  const T far = select(within, h, T(b.delta)), near = (h - T(2 * b.delta)) * T(1 / b.delta);
  return select(within, T(log(far) * T(-b.mu)),
                T((near * near - T(1)) * T(b.mu / 2) - T(b.mu * std::log(b.delta))));
}

// Its slope squared is half of the barrier's second derivative: mu / (2 h^2), below delta mu / (2 delta^2).
template <class T>
T barrier_curvature_of(const T& h, const RelaxedBarrier& b) {
  using ops::select;
  using std::log;
  const auto within = h > T(b.delta);
  const T far = select(within, h, T(b.delta));
  const T c = select(within, T(log(far * T(1 / b.delta))), T(h * T(1 / b.delta) - T(1)));
  return c * T(std::sqrt(b.mu / 2));
}

Term with_role(Term term, Role role) {
  term.role = role, term.lower = term.upper = {};
  return term;
}

Term barrier_term(const Term& term, const Bounded& bounded, const RelaxedBarrier& b) {
  check_positive(term, "mu", b.mu), check_positive(term, "delta", b.delta);
  Term result = with_role(term, Role::kCost);
  result.function = [bounded, b](const auto& s) {
    using T = std::decay_t<decltype(s.t)>;
    T sum(0);
    for (const T& h : rooms_of(bounded, s)) sum += barrier_of(h, b);
    return sum;
  };
  result.curvature = [bounded, b](const auto& s) {
    using T = std::decay_t<decltype(s.t)>;
    const std::vector<T> all = rooms_of(bounded, s);
    typename Stage<T>::Vector c(Eigen::Index(all.size()));
    for (std::size_t i = 0; i < all.size(); ++i) c[Eigen::Index(i)] = barrier_curvature_of(all[i], b);
    return c;
  };
  return result;
}

struct RootOf {
  const Term& term;

  SmoothRoot operator()(const Quadratic& p) const {
    check_positive(term, "weight", p.weight);
    return {std::sqrt(p.weight), HUGE_VAL};
  }
  SmoothRoot operator()(const Huber& p) const {
    check_positive(term, "weight", p.weight), check_positive(term, "width", p.width);
    return {std::sqrt(p.weight), p.width};
  }
  SmoothRoot operator()(const SmoothAbsolute& p) const {
    check_positive(term, "weight", p.weight), check_positive(term, "width", p.width);
    return {std::sqrt(p.weight / (2 * p.width)), p.width};
  }
  SmoothRoot operator()(const RelaxedBarrier&) const {
    throw ArgumentError("the soft term \"" + term.name +
                        "\" has a barrier and no bounds; expected an inequality, or another penalty");
  }
};

}  // namespace

Term soft(const Term& term, const Penalty& penalty) {
  if (term.role == Role::kCost)
    throw ArgumentError("the term \"" + term.name +
                        "\" is a cost already; expected an inequality, an equality or squares to make soft");
  StageFunction residual = term.function;
  if (term.role == Role::kInequality) {
    const Bounded bounded{term.function, term.lower, term.upper, term.name};
    if (const auto* b = std::get_if<RelaxedBarrier>(&penalty)) return barrier_term(term, bounded, *b);
    residual = beyond(bounded);
  }
  const SmoothRoot root = std::visit(RootOf{term}, penalty);
  Term result = with_role(term, Role::kSquares);
  result.function = [residual, root](const auto& s) {
    auto r = residual(s);
    for (Eigen::Index i = 0; i < r.size(); ++i) r[i] = root(r[i]);
    return r;
  };
  return result;
}

}  // namespace dyntape
