// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/nlp/lifted_nlp.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace dyntape {

namespace {

// Where a row is to take a variable of another stage.
struct FarEntry {
  std::size_t entry, of, from,
      to;  // non-zero of the Jacobian, its variable, the stages of that and of the row
};

std::vector<FarEntry> far_entries(const NlpShape& shape) {
  const auto stage_of = [&](std::size_t variable) {
    return std::size_t(std::upper_bound(shape.stages.begin(), shape.stages.end(), variable) -
                       shape.stages.begin()) -
           1;
  };
  const auto is_fixed = [&](std::size_t i) { return shape.x_lower[i] == shape.x_upper[i]; };
  const Pattern& J = shape.jacobian;
  std::vector<std::size_t> first(shape.m(), shape.stages.size()), last(shape.m(), 0);
  for (std::size_t e = 0; e < J.nnz() && !shape.stages.empty(); ++e) {
    if (is_fixed(J.col[e])) continue;
    const std::size_t stage = stage_of(J.col[e]);
    first[J.row[e]] = std::min(first[J.row[e]], stage), last[J.row[e]] = std::max(last[J.row[e]], stage);
  }
  std::vector<FarEntry> far;
  for (std::size_t e = 0; e < J.nnz() && !shape.stages.empty(); ++e) {
    const std::size_t row = J.row[e], stage = stage_of(J.col[e]);
    const bool is_equality = shape.g_lower[row] == shape.g_upper[row];
    if (!is_equality || is_fixed(J.col[e]) || last[row] <= first[row] + 1 || stage == last[row]) continue;
    far.push_back({e, J.col[e], stage, last[row]});
  }
  return far;
}

}  // namespace

bool LiftedNlp::is_needed(const NlpShape& shape) { return !far_entries(shape).empty(); }

LiftedNlp::LiftedNlp(Nlp& nlp, const std::vector<double>& start) : nlp_(nlp) {
  std::vector<double> derivatives(nlp.shape().jacobian.nnz());
  nlp.jacobian(start.data(),
               derivatives.data());  // where that fails the solver's first look at the start does
  place(derivatives);
  x_ = start, gradient_.resize(start.size());
}

void LiftedNlp::place(const std::vector<double>& derivatives) {
  const NlpShape& own = nlp_.shape();
  const std::vector<FarEntry> far = far_entries(own);
  struct Way {
    std::size_t from, to;  // stages
  };
  std::map<std::size_t, Way> ways;  // of each variable that is carried
  for (const FarEntry& entry : far) {
    Way& way = ways.try_emplace(entry.of, Way{entry.from, entry.to}).first->second;
    way.to = std::max(way.to, entry.to);
  }
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> places;  // of a variable in a stage
  shape_.hessian_kind = own.hessian_kind;
  for (std::size_t k = 0; k < own.stages.size(); ++k) {
    shape_.stages.push_back(shape_.n());
    const std::size_t end = k + 1 < own.stages.size() ? own.stages[k + 1] : own.n();
    for (std::size_t i = own.stages[k]; i < end; ++i) {
      if (ways.count(i)) places[{i, k}] = shape_.n();
      at_.push_back(shape_.n());
      shape_.x_lower.push_back(own.x_lower[i]), shape_.x_upper.push_back(own.x_upper[i]);
    }
    for (const auto& [of, way] : ways) {
      if (k <= way.from || k > way.to) continue;
      places[{of, k}] = shape_.n();
      copies_.push_back({of, places.at({of, k - 1}), shape_.n()});
      shape_.x_lower.push_back(-HUGE_VAL), shape_.x_upper.push_back(HUGE_VAL);
    }
  }
  shape_.g_lower = own.g_lower, shape_.g_upper = own.g_upper;
  shape_.g_lower.resize(own.m() + copies_.size(), 0), shape_.g_upper.resize(own.m() + copies_.size(), 0);
  shape_.jacobian = {shape_.m(), shape_.n(), own.jacobian.row, own.jacobian.col};
  for (std::uint32_t& col : shape_.jacobian.col) col = std::uint32_t(at_[col]);
  for (const FarEntry& entry : far) {
    const std::size_t at = places.at({entry.of, entry.to});
    shape_.jacobian.col[entry.entry] = std::uint32_t(at);
    carried_.push_back({own.jacobian.row[entry.entry], entry.of, at, derivatives[entry.entry]});
  }
  for (std::size_t c = 0; c < copies_.size(); ++c) {
    for (const std::size_t col : {copies_[c].before, copies_[c].at}) {
      shape_.jacobian.row.push_back(std::uint32_t(own.m() + c));
      shape_.jacobian.col.push_back(std::uint32_t(col));
    }
  }
  shape_.hessian = {shape_.n(), shape_.n(), own.hessian.row, own.hessian.col};
  for (std::vector<std::uint32_t>* side : {&shape_.hessian.row, &shape_.hessian.col}) {
    for (std::uint32_t& i : *side) i = std::uint32_t(at_[i]);
  }
}

std::vector<double> LiftedNlp::start(const std::vector<double>& own) const {
  std::vector<double> x(shape_.n());
  for (std::size_t i = 0; i < at_.size(); ++i) x[at_[i]] = own[i];
  for (const Copy& copy : copies_) x[copy.at] = own[copy.of];
  return x;
}

NlpSolution LiftedNlp::in_own_variables(NlpSolution s) const {
  for (std::vector<double>* part : {&s.x, &s.lower_multiplier, &s.upper_multiplier}) {
    std::vector<double> own(at_.size());
    for (std::size_t i = 0; i < at_.size(); ++i) own[i] = (*part)[at_[i]];
    *part = std::move(own);
  }
  s.g.resize(nlp_.shape().m()), s.lambda.resize(nlp_.shape().m());
  return s;
}

const double* LiftedNlp::own(const double* x) {
  for (std::size_t i = 0; i < at_.size(); ++i) x_[i] = x[at_[i]];
  return x_.data();
}

bool LiftedNlp::objective(const double* x, double& value) { return nlp_.objective(own(x), value); }

bool LiftedNlp::gradient(const double* x, double* gradient) {
  if (!nlp_.gradient(own(x), gradient_.data())) return false;
  std::fill_n(gradient, shape_.n(), 0.0);
  for (std::size_t i = 0; i < at_.size(); ++i) gradient[at_[i]] = gradient_[i];
  return true;
}

bool LiftedNlp::constraints(const double* x, double* g) {
  if (!nlp_.constraints(own(x), g)) return false;
  for (const Carried& c : carried_) g[c.row] += c.slope * (x[c.at] - x_[c.of]);
  double* of_copies = g + nlp_.shape().m();
  for (const Copy& copy : copies_) *of_copies++ = x[copy.at] - x[copy.before];
  return true;
}

bool LiftedNlp::jacobian(const double* x, double* nonzeros) {
  if (!nlp_.jacobian(own(x), nonzeros)) return false;
  double* of_copies = nonzeros + nlp_.shape().jacobian.nnz();
  for (std::size_t c = 0; c < copies_.size(); ++c) *of_copies++ = -1, *of_copies++ = 1;
  return true;
}

bool LiftedNlp::hessian(const double* x, double sigma, const double* lambda, double* nonzeros) {
  return nlp_.hessian(own(x), sigma, lambda, nonzeros);
}

std::string LiftedNlp::variable_name(std::size_t i) const {
  const auto own = std::lower_bound(at_.begin(), at_.end(), i);
  if (own != at_.end() && *own == i) return nlp_.variable_name(std::size_t(own - at_.begin()));
  const auto is_it = [&](const Copy& copy) { return copy.at == i; };
  return "copy of " + nlp_.variable_name(std::find_if(copies_.begin(), copies_.end(), is_it)->of);
}

std::string LiftedNlp::constraint_name(std::size_t j) const {
  const std::size_t m = nlp_.shape().m();
  return j < m ? nlp_.constraint_name(j) : "copy of " + nlp_.variable_name(copies_[j - m].of);
}

}  // namespace dyntape
