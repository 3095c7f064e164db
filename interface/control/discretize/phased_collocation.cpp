// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/discretize/phased_collocation.h>

#include <algorithm>
#include <cmath>
#include <map>

#include <dyntape/autodiff/error.h>

namespace dyntape {

namespace {

template <class T>
void append_all(std::vector<T>& to, const std::vector<T>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

std::vector<double> piece(const std::vector<double>& of, std::size_t first, std::size_t count) {
  return {of.begin() + long(first), of.begin() + long(first + count)};
}

}  // namespace

PhasedCollocation::PhasedCollocation(const Phases& phases, const std::vector<MeshOptions>& meshes) {
  check(phases);
  const std::size_t n = phases.phases.size();
  if (meshes.size() != 1 && meshes.size() != n)
    throw ArgumentError("phases \"" + phases.name + "\": " + std::to_string(meshes.size()) + " meshes for " +
                        std::to_string(n) + " phases, expected one each or one for all");
  for (const MeshOptions& mesh : meshes) {
    if (mesh.hessian == meshes.front().hessian) continue;
    throw ArgumentError("phases \"" + phases.name +
                        "\": meshes ask for different Hessians, expected one kind");
  }
  const std::vector<Problem> problems = told_of_each_other(phases);
  std::vector<std::unique_ptr<Collocation>> programs;
  for (std::size_t k = 0; k < n; ++k)
    programs.push_back(std::make_unique<Collocation>(problems[k], meshes[meshes.size() == 1 ? 0 : k]));
  of_links_ = meshes.front().evaluation;
  place(phases, std::move(programs));
}

PhasedCollocation::PhasedCollocation(const PhasedCollocation& ready, const Phases& phases,
                                     const std::vector<std::vector<double>>& nodes)
    : of_links_(ready.of_links_) {
  std::vector<std::unique_ptr<Collocation>> programs;
  for (std::size_t k = 0; k < ready.phases(); ++k)
    programs.push_back(std::make_unique<Collocation>(ready.phase(k), nodes.at(k)));
  place(phases, std::move(programs));
}

// Rows and variables of phases and links, in the order of time.
void PhasedCollocation::place(const Phases& phases, std::vector<std::unique_ptr<Collocation>> programs) {
  shape_.hessian_kind = programs.front()->shape().hessian_kind;
  const std::vector<PhaseLink> links = links_of(phases);
  for (std::size_t k = 0; k < programs.size(); ++k) {
    const NlpShape& own = programs[k]->shape();
    for (std::size_t begin : own.stages) shape_.stages.push_back(shape_.n() + begin);
    parts_.push_back({phases.phases[k].name, std::move(programs[k]), shape_.n(), shape_.m(), 0, {}, {}});
    append_all(shape_.x_lower, own.x_lower), append_all(shape_.x_upper, own.x_upper);
    append_all(shape_.g_lower, own.g_lower), append_all(shape_.g_upper, own.g_upper);
    for (const PhaseLink& link : links) {
      if (link.from == k) place_link(phases, link);
    }
  }
  for (std::size_t l = 0; l < links.size(); ++l) links_[l].to = parts_[links[l].to].variable;
  lay_out_jacobian();
  lay_out_hessian();
}

void PhasedCollocation::place_link(const Phases& phases, const PhaseLink& link) {
  const Phases::Phase &from = phases.phases[link.from], &to = phases.phases[link.to];
  Link placed;
  placed.from = parts_[link.from].variable + parts_[link.from].program->last_point();
  placed.row = shape_.m(), placed.n_x = to.problem.states.size();
  placed.name = "\"" + from.name + "\" to \"" + to.name + "\"";
  placed.states = to.problem.states;
  shape_.g_lower.resize(placed.row + placed.n_x, 0.0), shape_.g_upper.resize(placed.row + placed.n_x, 0.0);
  if (!link.change->empty()) {
    const Function recorded = record_link(from.problem, *link.change, phases.name + " link to " + to.name);
    CodegenOptions of_link = of_links_;
    of_link.order = shape_.hessian_kind == HessianKind::kExact ? Order::kSecond : Order::kFirst;
    of_link.lanes = Lanes::kNone;
    placed.change = std::make_unique<CompiledFunction>(CompiledFunction::make(recorded, of_link));
    placed.workspace = std::make_unique<CompiledFunction::Workspace>(*placed.change);
    const Eigen::VectorXd p = parameters_of(from.problem, from.problem.duration);
    placed.p.assign(p.begin(), p.end());
    placed.y.resize(placed.n_x), placed.w.resize(placed.n_x);
    placed.J.resize(placed.change->jacobian_pattern().nnz());
    if (of_link.order == Order::kSecond) placed.H.resize(placed.change->hessian_pattern().nnz());
  }
  links_.push_back(std::move(placed));
}

// Row by row; of a link those of x(T) and the one of x(0), in the order of variables.
void PhasedCollocation::lay_out_jacobian() {
  Pattern& J = shape_.jacobian;
  J = {shape_.m(), shape_.n(), {}, {}};
  const auto add = [&](std::size_t row, std::size_t col) {
    J.row.push_back(std::uint32_t(row)), J.col.push_back(std::uint32_t(col));
    return J.nnz() - 1;
  };
  auto link = links_.begin();
  for (Part& part : parts_) {
    const Pattern& own = part.program->shape().jacobian;
    part.jacobian = J.nnz();
    for (std::size_t e = 0; e < own.nnz(); ++e) add(part.row + own.row[e], part.variable + own.col[e]);
    const std::size_t end = part.row + part.program->shape().m();
    if (link == links_.end() || link->row != end) continue;
    std::size_t e = 0;
    for (std::size_t i = 0; i < link->n_x; ++i) {
      const std::size_t row = link->row + i;
      const bool is_back = link->to < link->from;
      if (is_back) link->of_one.push_back(add(row, link->to + i));
      if (!link->change) {
        link->of_J.push_back(add(row, link->from + i));
      } else {
        const Pattern& own_link = link->change->jacobian_pattern();
        for (; e < own_link.nnz() && own_link.row[e] == i; ++e)
          link->of_J.push_back(add(row, link->from + own_link.col[e]));
      }
      if (!is_back) link->of_one.push_back(add(row, link->to + i));
    }
    ++link;
  }
}

// Those of the phases side by side; what a link adds at the end of one may be new there.
void PhasedCollocation::lay_out_hessian() {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> places;
  const auto collect = [&](const Pattern& own, std::size_t first) {
    for (std::size_t e = 0; e < own.nnz(); ++e)
      places[{std::uint32_t(first + own.row[e]), std::uint32_t(first + own.col[e])}] = 0;
  };
  const auto find = [&](const Pattern& own, std::size_t first, std::vector<std::size_t>& to) {
    for (std::size_t e = 0; e < own.nnz(); ++e)
      to.push_back(places.at({std::uint32_t(first + own.row[e]), std::uint32_t(first + own.col[e])}));
  };
  const auto is_curved = [](const Link& link) { return !link.H.empty(); };
  for (const Part& part : parts_) collect(part.program->shape().hessian, part.variable);
  for (const Link& link : links_) {
    if (is_curved(link)) collect(link.change->hessian_pattern(), link.from);
  }
  shape_.hessian = {shape_.n(), shape_.n(), {}, {}};
  for (auto& [place, number] : places) {
    number = shape_.hessian.nnz();
    shape_.hessian.row.push_back(place.first), shape_.hessian.col.push_back(place.second);
  }
  for (Part& part : parts_) {
    find(part.program->shape().hessian, part.variable, part.hessian);
    part.curvature.resize(part.hessian.size());
  }
  for (Link& link : links_) {
    if (is_curved(link)) find(link.change->hessian_pattern(), link.from, link.of_H);
  }
}

// False where what a link gives is not finite, or a recorded branch is left.
bool PhasedCollocation::evaluate(Link& link, Order order, const double* x) {
  const Points point{.x = x + link.from,
                     .p = link.p.data(),
                     .w = link.w.data(),
                     .y = link.y.data(),
                     .jacobian = order >= Order::kFirst ? link.J.data() : nullptr,
                     .hessian = order >= Order::kSecond ? link.H.data() : nullptr};
  if (link.change->run(order, point, *link.workspace)) return false;
  const auto finite = [](const std::vector<double>& values) {
    return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
  };
  return finite(link.y) && (order < Order::kFirst || finite(link.J)) &&
         (order < Order::kSecond || finite(link.H));
}

bool PhasedCollocation::objective(const double* x, double& value) {
  value = 0;
  for (Part& part : parts_) {
    double own = 0;
    if (!part.program->objective(x + part.variable, own)) return false;
    value += own;
  }
  return true;
}

bool PhasedCollocation::gradient(const double* x, double* gradient) {
  return std::all_of(parts_.begin(), parts_.end(), [&](Part& part) {
    return part.program->gradient(x + part.variable, gradient + part.variable);
  });
}

bool PhasedCollocation::constraints(const double* x, double* g) {
  for (Part& part : parts_) {
    if (!part.program->constraints(x + part.variable, g + part.row)) return false;
  }
  for (Link& link : links_) {
    if (link.change && !evaluate(link, Order::kValue, x)) return false;
    for (std::size_t i = 0; i < link.n_x; ++i)
      g[link.row + i] = x[link.to + i] - (link.change ? link.y[i] : x[link.from + i]);
  }
  return true;
}

bool PhasedCollocation::jacobian(const double* x, double* nonzeros) {
  for (Part& part : parts_) {
    if (!part.program->jacobian(x + part.variable, nonzeros + part.jacobian)) return false;
  }
  for (Link& link : links_) {
    if (link.change && !evaluate(link, Order::kFirst, x)) return false;
    for (std::size_t e = 0; e < link.of_J.size(); ++e) nonzeros[link.of_J[e]] = link.change ? -link.J[e] : -1;
    for (std::size_t e : link.of_one) nonzeros[e] = 1;
  }
  return true;
}

bool PhasedCollocation::hessian(const double* x, double sigma, const double* lambda, double* nonzeros) {
  std::fill(nonzeros, nonzeros + shape_.hessian.nnz(), 0.0);
  for (Part& part : parts_) {
    if (!part.program->hessian(x + part.variable, sigma, lambda + part.row, part.curvature.data()))
      return false;
    for (std::size_t e = 0; e < part.hessian.size(); ++e) nonzeros[part.hessian[e]] += part.curvature[e];
  }
  for (Link& link : links_) {
    if (link.of_H.empty()) continue;
    for (std::size_t i = 0; i < link.n_x; ++i) link.w[i] = -lambda[link.row + i];
    if (!evaluate(link, Order::kSecond, x)) return false;
    for (std::size_t e = 0; e < link.of_H.size(); ++e) nonzeros[link.of_H[e]] += link.H[e];
  }
  return true;
}

NlpScaling PhasedCollocation::of_phase(std::size_t k, const NlpScaling& scaling) const {
  if (scaling.x.empty()) return scaling;
  const Part& part = parts_[k];
  const NlpShape& own = part.program->shape();
  return {scaling.objective, piece(scaling.x, part.variable, own.n()), piece(scaling.g, part.row, own.m())};
}

// A row of a link is as large as the state that it sets; costs of phases add up.
NlpScaling PhasedCollocation::scaling(const std::vector<double>& at, const NlpScaling& before) {
  NlpScaling all{0};
  all.g.resize(shape_.m());
  for (std::size_t k = 0; k < parts_.size(); ++k) {
    Part& part = parts_[k];
    const NlpScaling own =
        part.program->scaling(piece(at, part.variable, part.program->shape().n()), of_phase(k, before));
    if (own.x.empty()) return before;
    append_all(all.x, own.x);
    std::copy(own.g.begin(), own.g.end(), all.g.begin() + long(part.row));
    const auto& terms = part.program->problem().terms;
    const bool costs = std::any_of(terms.begin(), terms.end(), [](const Term& term) {
      return term.role == Role::kCost || term.role == Role::kSquares;
    });
    if (costs) all.objective += own.objective;
  }
  if (all.objective == 0) all.objective = 1;
  for (const Link& link : links_)
    std::copy_n(all.x.begin() + long(link.to), link.n_x, all.g.begin() + long(link.row));
  return all;
}

std::vector<double> PhasedCollocation::start() const {
  std::vector<double> x;
  for (const Part& part : parts_) append_all(x, part.program->start());
  return x;
}

std::vector<Trajectory> PhasedCollocation::trajectories(const std::vector<double>& x) const {
  std::vector<Trajectory> motions;
  for (const Part& part : parts_)
    motions.push_back(part.program->trajectory(piece(x, part.variable, part.program->shape().n())));
  return motions;
}

std::vector<double> PhasedCollocation::variables(const std::vector<Trajectory>& motions) const {
  std::vector<double> x;
  for (std::size_t k = 0; k < parts_.size(); ++k) append_all(x, parts_[k].program->variables(motions.at(k)));
  return x;
}

void PhasedCollocation::check_finite(const std::vector<double>& x) {
  for (Part& part : parts_) part.program->check_finite(piece(x, part.variable, part.program->shape().n()));
  for (Link& link : links_) {
    if (!link.change || evaluate(link, Order::kFirst, x.data())) continue;
    std::string what = "leaves a branch that was recorded, or is not finite,";
    for (std::size_t i = 0; i < link.n_x; ++i) {
      if (!std::isfinite(link.y[i])) what = "gives " + link.states[i] + " = " + std::to_string(link.y[i]);
    }
    const Pattern& at = link.change->jacobian_pattern();
    for (std::size_t e = 0; e < at.nnz(); ++e) {
      if (std::isfinite(link.y[at.row[e]]) && !std::isfinite(link.J[e]))
        what = "has a slope of " + link.states[at.row[e]] + " by " +
               link.change->function().input_names[0][at.col[e]] + " that is " + std::to_string(link.J[e]);
    }
    throw NumericalError("the link from " + link.name + " " + what + " at the start");
  }
}

BuildReport PhasedCollocation::build() const {
  BuildReport all;
  for (const Part& part : parts_) {
    const BuildReport own = part.program->build();
    all.seconds += own.seconds;
    all.compiled += own.compiled, all.from_cache += own.from_cache, all.interpreted += own.interpreted;
    append_all(all.sources, own.sources);
  }
  for (const Link& link : links_) {
    if (link.change) add_to(all, *link.change);
  }
  return all;
}

// One phase alone needs no name.
std::string PhasedCollocation::prefix(const Part& part) const {
  return parts_.size() > 1 ? part.name + ": " : "";
}

std::string PhasedCollocation::variable_name(std::size_t i) const {
  const auto part =
      std::find_if(parts_.rbegin(), parts_.rend(), [&](const Part& p) { return p.variable <= i; });
  return prefix(*part) + part->program->variable_name(i - part->variable);
}

std::string PhasedCollocation::constraint_name(std::size_t j) const {
  for (const Link& link : links_) {
    if (j >= link.row && j < link.row + link.n_x)
      return "link from " + link.name + ": " + link.states[j - link.row];
  }
  const auto part = std::find_if(parts_.rbegin(), parts_.rend(), [&](const Part& p) { return p.row <= j; });
  return prefix(*part) + part->program->constraint_name(j - part->row);
}

}  // namespace dyntape
