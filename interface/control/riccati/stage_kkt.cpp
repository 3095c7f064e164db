// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/riccati/stage_kkt.h>

#include <algorithm>
#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/riccati/columns.h>

namespace dyntape {

namespace {

RowKind kind_of(double lower, double upper) {
  if (lower == upper) return RowKind::kEquality;
  return std::isinf(lower) && std::isinf(upper) ? RowKind::kFree : RowKind::kInequality;
}

double farthest_entry(const Eigen::VectorXd& v) { return v.size() > 0 ? v.cwiseAbs().maxCoeff() : 0; }

}  // namespace

StagewiseKkt::StagewiseKkt(const Nlp& nlp, bool puts_in_links) : shape_(nlp.shape()) {
  place_variables();
  place_rows(nlp);
  connect(puts_in_links);
}

bool StagewiseKkt::fits() const {
  for (std::size_t i = 0; i < place_.size(); ++i) {
    if (is_fixed(i) != (shape_.x_lower[i] == shape_.x_upper[i])) return false;
  }
  for (std::size_t j = 0; j < kind_.size(); ++j) {
    if (kind_[j] != kind_of(shape_.g_lower[j], shape_.g_upper[j])) return false;
  }
  return true;
}

void StagewiseKkt::place_variables() {
  const std::size_t n = shape_.n();
  begin_ = shape_.stages.empty() ? std::vector<std::size_t>{0} : shape_.stages;
  if (begin_.front() != 0 || !std::is_sorted(begin_.begin(), begin_.end()) || begin_.back() > n)
    throw ArgumentError("the stages of a program must begin at increasing variables, the first at 0");
  stage_of_.resize(n), place_.assign(n, -1), local_.assign(n, -1);
  sizes_.assign(begin_.size(), {0, 0, 0});
  Eigen::Index place = 0;
  for (std::size_t i = 0, k = 0; i < n; ++i) {
    while (k + 1 < begin_.size() && begin_[k + 1] <= i) ++k;
    stage_of_[i] = k;
    if (shape_.x_lower[i] == shape_.x_upper[i]) continue;
    place_[i] = place++;
    local_[i] = sizes_[k].variables++;
  }
}

void StagewiseKkt::place_rows(const Nlp& nlp) {
  const std::size_t m = shape_.m(), none = begin_.size();
  std::vector<std::size_t> first(m, none), last(m, 0);
  for (std::size_t e = 0; e < shape_.jacobian.nnz(); ++e) {
    const std::size_t row = shape_.jacobian.row[e], col = shape_.jacobian.col[e];
    if (is_fixed(col)) continue;
    first[row] = std::min(first[row], stage_of_[col]);
    last[row] = std::max(last[row], stage_of_[col]);
  }
  kind_.resize(m), row_stage_.resize(m), row_place_.assign(m, -1);
  std::vector<bool> is_link(m);
  std::vector<std::vector<std::size_t>> links(begin_.size()), own(begin_.size());
  std::vector<std::ptrdiff_t> inequality(m, -1);
  for (std::size_t j = 0; j < m; ++j) {
    kind_[j] = kind_of(shape_.g_lower[j], shape_.g_upper[j]);
    row_stage_[j] = last[j];
    if (kind_[j] == RowKind::kFree) continue;
    const std::size_t reach = first[j] == none ? 0 : last[j] - first[j];  // none: a row of the first stage
    if (reach > 1 || (reach == 1 && kind_[j] == RowKind::kInequality))
      throw ArgumentError("\"" + nlp.constraint_name(j) + "\" ties stages " + std::to_string(first[j]) +
                          " and " + std::to_string(last[j]) + " of the program, expected " +
                          (reach > 1 ? "neighbours" : "one stage, as it is an inequality"));
    if (kind_[j] == RowKind::kInequality) {
      inequality[j] = std::ptrdiff_t(inequalities_.size());
      inequalities_.push_back({j, last[j], {}});
    } else {
      (reach == 1 ? links : own)[last[j]].push_back(j);
    }
  }
  Eigen::Index place = 0;
  for (std::size_t k = 0; k < begin_.size(); ++k) {
    for (std::size_t j : links[k]) row_place_[j] = place++;
    for (std::size_t j : own[k]) row_place_[j] = place++;
    sizes_[k].links = int(links[k].size()), sizes_[k].rows = int(own[k].size());
  }
  for (std::size_t e = 0; e < shape_.jacobian.nnz(); ++e) {
    const std::size_t row = shape_.jacobian.row[e], col = shape_.jacobian.col[e];
    if (inequality[row] < 0 || is_fixed(col)) continue;
    inequalities_[std::size_t(inequality[row])].entries.push_back({local_[col], e});
  }
}

// Where each non-zero goes, and where there is any.
void StagewiseKkt::connect(bool puts_in_links) {
  chain_.emplace(sizes_, puts_in_links);
  jacobian_to_.assign(shape_.jacobian.nnz(), nowhere_.data());
  for (std::size_t e = 0; e < shape_.jacobian.nnz(); ++e) {
    const std::size_t row = shape_.jacobian.row[e], col = shape_.jacobian.col[e];
    if (row_place_[row] < 0 || is_fixed(col)) continue;
    const std::size_t k = row_stage_[row];
    const Eigen::Index i = row_place_[row] - chain_->first_row(k), links = sizes_[k].links;
    RiccatiKkt::Stage &own = chain_->stage(k), &before = chain_->stage(k > 0 ? k - 1 : 0);
    double& to = i >= links            ? own.G(i - links, local_[col])
                 : stage_of_[col] == k ? own.D(i, local_[col])
                                       : before.C(i, local_[col]);
    jacobian_to_[e] = &to;
  }
  for (std::size_t e = 0; e < shape_.hessian.nnz(); ++e) {
    const std::size_t row = shape_.hessian.row[e], col = shape_.hessian.col[e];
    if (is_fixed(row) || is_fixed(col)) continue;
    if (stage_of_[row] != stage_of_[col])
      throw ArgumentError("the Hessian of the program ties variables of stages " +
                          std::to_string(stage_of_[col]) + " and " + std::to_string(stage_of_[row]) +
                          ", expected one stage");
    RiccatiKkt::Stage& own = chain_->stage(stage_of_[row]);
    std::vector<Entry>& entries = row == col ? hessian_diagonal_ : hessian_entries_;
    entries.push_back({&own.H(local_[row], local_[col]), e});
    if (row != col) entries.push_back({&own.H(local_[col], local_[row]), e});
  }
  for (std::size_t i = 0; i < place_.size(); ++i) {
    if (is_fixed(i))
      fixed_.push_back(i);
    else
      diagonal_entries_.push_back({&chain_->stage(stage_of_[i]).H(local_[i], local_[i]), i});
  }
  for (std::size_t j = 0; j < kind_.size(); ++j) {
    if (kind_[j] == RowKind::kFree) without_multiplier_.push_back(j);
  }
  for (double* const to : jacobian_to_) *to = 1;
  for (const Entry& entry : hessian_entries_) *entry.to = 1;
  for (const InequalityRow& row : inequalities_) {
    for (const InequalityEntry& a : row.entries) {
      for (const InequalityEntry& b : row.entries) chain_->stage(row.stage).H(b.column, a.column) = 1;
    }
  }
  chain_->take_structure();
  const auto n = Eigen::Index(shape_.n()), m = Eigen::Index(shape_.m());
  J_.setZero(Eigen::Index(shape_.jacobian.nnz())), W_.setZero(Eigen::Index(shape_.hessian.nnz()));
  a_.setZero(chain_->variables()), b_.setZero(chain_->rows());
  row_sigma_.setZero(m);
  for (KktVector* v : {&residual_, &correction_}) v->x.setZero(n), v->s.setZero(m), v->c.setZero(m);
}

void StagewiseKkt::set(const double* jacobian, const double* hessian) {
  std::copy(hessian, hessian + W_.size(), W_.data());
  for (std::size_t e = 0; e < jacobian_to_.size(); ++e) J_[Eigen::Index(e)] = *jacobian_to_[e] = jacobian[e];
}

bool StagewiseKkt::factor(const KktDiagonal& diagonal) {
  diagonal_ = diagonal;
  // Entries that nothing below writes stay zero.
  for (const InequalityRow& row : inequalities_) {
    Eigen::MatrixXd& H = chain_->stage(row.stage).H;
    for (const InequalityEntry& a : row.entries) {
      for (const InequalityEntry& b : row.entries) H(b.column, a.column) = 0;
    }
  }
  for (const Entry& entry : diagonal_entries_) *entry.to = diagonal.sigma_x[Eigen::Index(entry.from)];
  if (diagonal.with_hessian) {
    for (const Entry& entry : hessian_entries_) *entry.to = W_[Eigen::Index(entry.from)];
    for (const Entry& entry : hessian_diagonal_) *entry.to += W_[Eigen::Index(entry.from)];
  } else {
    for (const Entry& entry : hessian_entries_) *entry.to = 0;
  }
  for (const InequalityRow& row : inequalities_) {
    const double sigma = diagonal.sigma_s[Eigen::Index(row.row)];
    const double soft = sigma / (1 + diagonal.elastic * sigma);
    row_sigma_[Eigen::Index(row.row)] = soft;
    Eigen::MatrixXd& H = chain_->stage(row.stage).H;
    for (const InequalityEntry& a : row.entries) {
      const double scaled = soft * J_[Eigen::Index(a.from)];
      for (const InequalityEntry& b : row.entries) H(b.column, a.column) += scaled * J_[Eigen::Index(b.from)];
    }
  }
  return chain_->factor(diagonal.shift, diagonal.elastic);
}

void StagewiseKkt::condensed_solve(const KktVector& right, KktVector& step) {
  const double elastic = diagonal_.elastic;
  for (std::size_t p = 0; p < diagonal_entries_.size(); ++p)
    a_[Eigen::Index(p)] = right.x[Eigen::Index(diagonal_entries_[p].from)];
  for (const InequalityRow& row : inequalities_) {
    const auto j = Eigen::Index(row.row);
    const double bound_multiplier = row_sigma_[j] * (elastic * right.s[j] - right.c[j]) - right.s[j];
    const Eigen::Index first = chain_->first_variable(row.stage);
    for (const InequalityEntry& e : row.entries)
      a_[first + e.column] -= J_[Eigen::Index(e.from)] * bound_multiplier;
  }
  for (std::size_t j = 0; j < row_place_.size(); ++j) {
    if (row_place_[j] >= 0) b_[row_place_[j]] = right.c[Eigen::Index(j)];
  }
  chain_->solve(a_, b_, z_, bound_multipliers_);
  step.x.resize(Eigen::Index(place_.size()));
  for (const std::size_t i : fixed_) step.x[Eigen::Index(i)] = 0;
  for (std::size_t p = 0; p < diagonal_entries_.size(); ++p)
    step.x[Eigen::Index(diagonal_entries_[p].from)] = z_[Eigen::Index(p)];
  for (std::size_t j = 0; j < row_place_.size(); ++j)
    step.c[Eigen::Index(j)] = row_place_[j] >= 0 ? bound_multipliers_[row_place_[j]] : 0;
  for (const InequalityRow& row : inequalities_) {
    const auto j = Eigen::Index(row.row);
    const Eigen::Index first = chain_->first_variable(row.stage);
    double change = elastic * right.s[j] - right.c[j];
    for (const InequalityEntry& e : row.entries) change += J_[Eigen::Index(e.from)] * z_[first + e.column];
    step.c[j] = row_sigma_[j] * change - right.s[j];
    step.s[j] = change / (1 + elastic * diagonal_.sigma_s[j]);
  }
}

void StagewiseKkt::add_transposed(const Eigen::VectorXd& v, Eigen::VectorXd& y) const {
  for (std::size_t e = 0; e < shape_.jacobian.nnz(); ++e)
    y[shape_.jacobian.col[e]] += J_[Eigen::Index(e)] * v[shape_.jacobian.row[e]];
}

// y.x += J^T v.c and y.c += J v.x.
void StagewiseKkt::add_both_products(const KktVector& v, KktVector& y) const {
  const Pattern& at = shape_.jacobian;
  for (std::size_t e = 0; e < at.nnz();) {
    const std::uint32_t row = at.row[e];
    const double bound_multiplier = v.c[row];
    double sum = 0;
    for (; e < at.nnz() && at.row[e] == row; ++e) {
      sum += J_[Eigen::Index(e)] * v.x[at.col[e]];
      y.x[at.col[e]] += J_[Eigen::Index(e)] * bound_multiplier;
    }
    y.c[row] += sum;
  }
}

void StagewiseKkt::add_hessian(const Eigen::VectorXd& v, Eigen::VectorXd& y) const {
  for (std::size_t e = 0; e < shape_.hessian.nnz(); ++e) {
    const auto row = shape_.hessian.row[e], col = shape_.hessian.col[e];
    y[row] += W_[Eigen::Index(e)] * v[col];
    if (row != col) y[col] += W_[Eigen::Index(e)] * v[row];
  }
}

// Of the whole system, into residual_; its largest entry.
double StagewiseKkt::largest_residual(const KktVector& right, const KktVector& step) {
  KktVector& r = residual_;
  const KktDiagonal& d = diagonal_;
  r.x = (d.sigma_x.array() + d.shift) * step.x.array() - right.x.array();
  r.c = -right.c - d.elastic * step.c;
  add_both_products(step, r);
  if (d.with_hessian) add_hessian(step.x, r.x);
  r.x = -r.x, r.c = -r.c;
  for (const std::size_t i : fixed_) r.x[Eigen::Index(i)] = 0;
  for (const std::size_t j : without_multiplier_) r.c[Eigen::Index(j)] = 0;
  double most = 0;
  for (const InequalityRow& row : inequalities_) {
    const auto j = Eigen::Index(row.row);
    r.c[j] += step.s[j];
    r.s[j] = right.s[j] - (d.sigma_s[j] * step.s[j] - step.c[j]);
    most = std::max(most, std::abs(r.s[j]));
  }
  return std::max({most, farthest_entry(r.x), farthest_entry(r.c)});
}

void StagewiseKkt::solve(const KktVector& right, KktVector& step, double good) {
  constexpr int kMost = 20;  // of rows that are springs, each leaves a part of what it misses
  step.x.resize(right.x.size()), step.s.setZero(right.s.size()), step.c.resize(right.c.size());
  condensed_solve(right, step);
  const double size =
      std::max({farthest_entry(right.x), farthest_entry(right.s), farthest_entry(right.c), 1e-300});
  double before = HUGE_VAL;
  for (int i = 0; i < kMost; ++i) {
    const double residual = largest_residual(right, step);
    if (residual > before) step.x -= correction_.x, step.s -= correction_.s, step.c -= correction_.c;
    if (!(residual > good * size) || !(residual < 0.9 * before)) return;
    before = residual;
    condensed_solve(residual_, correction_);
    step.x += correction_.x, step.s += correction_.s, step.c += correction_.c;
  }
}

Eigen::MatrixXd StagewiseKkt::follow(const std::vector<std::size_t>& held) {
  const std::size_t first = begin_.size() > 1 ? begin_[1] : shape_.n();
  std::vector<std::ptrdiff_t> side(shape_.n(), -1);  // of what is held
  for (std::size_t i = 0; i < held.size(); ++i) side[held[i]] = std::ptrdiff_t(i);
  // By what is held, a row each: the right side of the rows and variables of the first two stages, as bounds of the first tie rows of
  // both.
  const Eigen::Index sides = columns::padded(Eigen::Index(held.size()));
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(sides, chain_->rows_before(2));
  Eigen::MatrixXd slopes = Eigen::MatrixXd::Zero(sides, chain_->variables_before(2));
  Eigen::MatrixXd softened = Eigen::MatrixXd::Zero(sides, Eigen::Index(inequalities_.size()));
  std::vector<Eigen::Index> inequality(kind_.size(), -1);
  for (std::size_t r = 0; r < inequalities_.size(); ++r) inequality[inequalities_[r].row] = Eigen::Index(r);
  for (std::size_t e = 0; e < shape_.jacobian.nnz(); ++e) {
    const std::ptrdiff_t i = side[shape_.jacobian.col[e]];
    if (i < 0) continue;
    const std::size_t row = shape_.jacobian.row[e];
    if (row_place_[row] >= 0) rows(i, row_place_[row]) -= J_[Eigen::Index(e)];
    if (inequality[row] >= 0)
      softened(i, inequality[row]) += row_sigma_[Eigen::Index(row)] * J_[Eigen::Index(e)];
  }
  for (std::size_t r = 0; r < inequalities_.size(); ++r) {
    if (inequalities_[r].stage > 1) continue;
    const Eigen::Index before = chain_->first_variable(inequalities_[r].stage);
    for (const InequalityEntry& e : inequalities_[r].entries)
      slopes.col(before + e.column) -= J_[Eigen::Index(e.from)] * softened.col(Eigen::Index(r));
  }
  for (std::size_t e = 0; e < shape_.hessian.nnz() && diagonal_.with_hessian; ++e) {
    const std::size_t row = shape_.hessian.row[e], col = shape_.hessian.col[e];
    const auto add = [&](std::size_t to, std::size_t by) {
      if (side[by] >= 0 && !is_fixed(to)) slopes(side[by], place_[to]) -= W_[Eigen::Index(e)];
    };
    add(row, col);
    if (row != col) add(col, row);
  }
  const Eigen::MatrixXd z = chain_->solve_first(slopes, rows);
  Eigen::MatrixXd derivatives = Eigen::MatrixXd::Zero(Eigen::Index(first), Eigen::Index(held.size()));
  for (std::size_t v = 0; v < first; ++v) {
    if (!is_fixed(v))
      derivatives.row(Eigen::Index(v)) = z.col(place_[v]).head(derivatives.cols()).transpose();
  }
  for (std::size_t i = 0; i < held.size(); ++i) derivatives(Eigen::Index(held[i]), Eigen::Index(i)) = 1;
  return derivatives;
}

}  // namespace dyntape
