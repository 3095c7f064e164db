// SPDX-License-Identifier: BSD-3-Clause
//
// From problems and meshes to a staged program: points, functions, rows, costs.
#include <algorithm>
#include <chrono>
#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/discretize/mesh_size.h>
#include <dyntape/interface/control/discretize/staged_program.h>
#include <dyntape/interface/control/problem/scaled_time.h>
#include <dyntape/interface/io/stopwatch.h>

namespace dyntape {

namespace {

std::size_t intervals_of(const MeshOptions& mesh) {
  if (!mesh.nodes.empty()) return mesh.nodes.size() - 1;
  return static_cast<std::size_t>(std::max(mesh.intervals, 0));
}

// Where the duration is free, nodes say how long it is at first; a solver may have left its range by rounding.
Problem with_duration_of(const std::vector<double>& nodes, Problem problem) {
  if (!problem.free_time || nodes.empty()) return problem;
  const double before = problem.duration;
  problem.duration = std::clamp(nodes.back(), problem.free_time->shortest, problem.free_time->longest);
  if (!problem.guess) return problem;
  problem.guess = [guess = problem.guess, stretch = before / problem.duration](double t) {
    Stage<double> stage = guess(stretch * t);
    stage.t = t;
    return stage;
  };
  return problem;
}

std::vector<double> scaled_to(double duration, std::vector<double> nodes) {
  if (nodes.empty() || nodes.back() == duration) return nodes;
  const double factor = duration / nodes.back();
  for (double& node : nodes) node *= factor;
  return nodes;
}

// Over the time of scaled_time().
MeshOptions in_scaled_time(const Problem& asked, MeshOptions mesh) {
  if (asked.free_time) mesh.nodes = scaled_to(1, mesh.nodes);
  return mesh;
}

// Of a problem over its scaled time.  Where nodes are not even, those of place_points() to the bit; what is no mesh is refused later.
IntervalLength lengths_of(const Problem& scaled, const MeshOptions& mesh) {
  const auto not_later = [](double a, double b) { return !(a < b); };  // NaN included
  const bool is_mesh =
      mesh.nodes.size() >= 2 && mesh.nodes.front() == 0 &&
      std::adjacent_find(mesh.nodes.begin(), mesh.nodes.end(), not_later) == mesh.nodes.end();
  const bool is_uneven = mesh.nodes.empty() && mesh.intervals > 0 && instants_of(scaled).size() > 1;
  if (is_mesh || is_uneven) return interval_lengths(node_times(scaled, mesh));
  return [h = scaled.duration / std::max(mesh.intervals, 1)](double) { return h; };
}

// Variables, constraints and non-zeros of an interval.
double numbers_of_interval(const StagedPhase& phase, const CompiledFunction& node) {
  const auto terms = [](const Eigen::MatrixXd& weights) { return double((weights.array() != 0).count()); };
  const Scheme& scheme = phase.scheme();
  double of_point = double(phase.n_z + phase.stage.path_rows.size()), of_rates = 0;
  for (std::size_t row : node.jacobian_pattern().row) (row < phase.n_x ? of_rates : of_point) += 1;
  if (node.order() == Order::kSecond) of_point += double(node.hessian_pattern().nnz());
  return double(phase.stride) * of_point + double(std::size_t(scheme.rows()) * phase.n_x) +
         terms(scheme.alpha) * double(phase.n_x) + terms(scheme.beta) * of_rates;
}

// Least-squares costs alone.
void check_squares(const Problem& problem) {
  for (const Term& term : problem.terms) {
    if (term.role != Role::kCost || !term.curvature.empty()) continue;
    refuse(problem, "Gauss-Newton needs every cost as squares of residuals, and \"" + term.name +
                        "\" is a plain cost; use the exact Hessian or limited memory");
  }
}

class Discretization {
 public:
  explicit Discretization(std::string name, std::vector<std::string> controls = {}) {
    program_.name = std::move(name), program_.controls = std::move(controls);
  }

  // `ready`: whose functions are taken over, or null.
  void add_phase(const std::string& name, const Problem& problem, const MeshOptions& mesh,
                 const StagedProgram* ready = nullptr) {
    const std::size_t k = program_.phases.size();
    StagedPhase phase = sized(problem, mesh, ready ? &ready->phases[k] : nullptr);
    phase.name = name;
    phase.variable = program_.shape.n(), phase.row = rows_, phase.cost = program_.costs.size();
    add_functions(phase, ready ? &ready->phases[k] : nullptr, ready);
    check_size(phase.problem.name, phase.intervals,
               numbers_of_interval(phase, program_.evaluators[phase.evaluator].function));
    place_points(phase);
    for (std::size_t node = 0; node <= phase.intervals; ++node)
      program_.shape.stages.push_back(phase.variable_of(node == 0 ? 0 : (node - 1) * phase.stride + 1));
    program_.shape.x_lower.resize(phase.variable + phase.variables());
    program_.shape.x_upper.resize(phase.variable + phase.variables());
    program_.shape.hessian_kind = mesh.hessian;
    program_.phases.push_back(std::move(phase));
    add_defects(program_.phases.back());
    add_controls(program_.phases.back());
    add_path(program_.phases.back());
    add_instants(program_.phases.back());
    add_costs(program_.phases.back());
    place_values(program_, k);
  }

  // From a phase that was added to one that may come later.
  void add_link(StagedLink link, const Function* change, const StagedProgram* ready, std::size_t states) {
    const StagedPhase& from = program_.phases[link.from];
    const std::size_t last = from.variable_of(from.points - 1), number = program_.links.size();
    if (change) {
      CodegenOptions options = from.mesh.evaluation;
      options.lanes = Lanes::kNone;
      link.evaluator =
          std::ptrdiff_t(add_evaluator(program_.evaluators, *change, options, {.variable = last}));
    } else if (ready && link.evaluator >= 0) {
      const Evaluator& own = ready->evaluators[std::size_t(link.evaluator)];
      link.evaluator = std::ptrdiff_t(add_evaluator(program_.evaluators, own.function, {.variable = last}));
    }
    begin_block({RowBlock::Kind::kLink, link.from, number, 0}, states);
    add_term(1, LinearTerm::kVariables, 0);  // of the phase behind, which is placed in finish()
    if (link.evaluator >= 0)
      add_term(-1, std::size_t(link.evaluator), program_.evaluators.back().y);
    else
      add_term(-1, LinearTerm::kVariables, last);
    end_block(0, 0);
    program_.links.push_back(std::move(link));
    place_values(program_, program_.links.back().from);
  }

  StagedProgram finish() {
    for (const RowBlock& block : program_.rows) {
      if (block.kind != RowBlock::Kind::kLink) continue;
      const StagedLink& link = program_.links[block.place];
      program_.terms[block.first_term].first = program_.phases[link.to].variable;
    }
    return std::move(program_);
  }

 private:
  StagedPhase sized(const Problem& problem, const MeshOptions& mesh, const StagedPhase* ready) {
    StagedPhase phase;
    phase.asked = problem;
    const Problem scaled = scaled_time(problem);
    phase.length = lengths_of(scaled, in_scaled_time(problem, mesh));
    phase.problem = mesh.scheme.taken_by(scaled, phase.length);
    phase.mesh = mesh;
    phase.mesh.evaluation.order = mesh.hessian == HessianKind::kExact ? Order::kSecond : Order::kFirst;
    const auto begin = std::chrono::steady_clock::now();
    phase.stage = ready ? ready->stage : record_stage(phase.problem);
    if (!ready) program_.record_seconds += seconds_since(begin);
    const Problem& own = phase.problem;
    phase.n_x = std::size_t(own.n_x());
    phase.n_z = phase.n_x + std::size_t(own.n_a() + own.n_u());
    phase.stride = std::size_t(mesh.scheme.points()) - 1;
    phase.intervals = intervals_of(mesh);
    if (const std::string fault = mesh.scheme.fault_on(int(phase.intervals)); !fault.empty())
      refuse(own, fault);
    phase.points = phase.intervals * phase.stride + 1;
    phase.first_used = mesh.scheme.uses_first_point() ? 0 : 1;
    phase.used = phase.points - phase.first_used - (mesh.scheme.uses_last_point() ? 0 : 1);
    phase.instants.resize(phase.stage.instants.size());
    return phase;
  }

  // Of the node and the instants, and with Gauss-Newton's Hessian their residuals.
  void add_functions(StagedPhase& phase, const StagedPhase* before, const StagedProgram* ready) {
    const auto add = [&](std::vector<Evaluator>& to, const std::vector<Evaluator>* made, std::size_t first,
                         const Function& node, const auto& of_instant) {
      const EvaluationPoints at{phase.used, phase.variable_of(phase.first_used), phase.mesh.threads};
      const std::size_t begin = to.size();
      for (std::size_t k = 0; k <= phase.stage.instants.size(); ++k) {
        const EvaluationPoints own = k == 0 ? at : EvaluationPoints{};  // of instants: place_points()
        if (made)
          add_evaluator(to, (*made)[first + k].function, own);
        else
          add_evaluator(to, k == 0 ? node : of_instant(phase.stage.instants[k - 1]), phase.mesh.evaluation,
                        own);
      }
      return begin;
    };
    phase.evaluator =
        add(program_.evaluators, ready ? &ready->evaluators : nullptr, before ? before->evaluator : 0,
            phase.stage.node, [](const RecordedInstant& i) { return i.terms; });
    if (phase.mesh.hessian != HessianKind::kGaussNewton) return;
    check_squares(phase.problem);
    // What is left to compile was compiled for `ready`.
    phase.squares = add(program_.squares, ready ? &ready->squares : nullptr, before ? before->squares : 0,
                        phase.stage.squares, [](const RecordedInstant& i) { return i.squares; });
  }

  void place_points(StagedPhase& phase) {
    const MeshOptions mesh = in_scaled_time(phase.asked, phase.mesh);
    const std::vector<double> nodes = node_times(phase.problem, mesh);
    for (std::size_t k = 0; k < phase.instants.size(); ++k) {
      phase.instants[k] = node_at_share(phase.problem, phase.stage.instants[k].share, nodes) * phase.stride;
      const std::size_t variable = phase.variable_of(phase.instants[k]);
      program_.evaluators[phase.evaluator + 1 + k].at.variable = variable;
      if (mesh.hessian == HessianKind::kGaussNewton)
        program_.squares[phase.squares + 1 + k].at.variable = variable;
    }
    phase.t.assign(phase.points, phase.problem.duration);
    for (std::size_t k = 0; k < phase.intervals; ++k) {
      const double h = nodes[k + 1] - nodes[k];
      for (std::size_t j = 0; j < phase.stride; ++j)
        phase.t[k * phase.stride + j] = nodes[k] + h * phase.scheme().c[long(j)];
    }
  }

  void begin_block(RowBlock block, std::size_t size) {
    block.row = rows_, block.size = size;
    block.first_term = block.last_term = program_.terms.size();
    program_.rows.push_back(block);
  }
  void add_term(double factor, std::size_t evaluator, std::size_t first) {
    if (factor != 0) program_.terms.push_back({factor, evaluator, first});
  }
  // Bounds are those of every row.
  void end_block(double lower, double upper) {
    RowBlock& block = program_.rows.back();
    block.last_term = program_.terms.size();
    rows_ += block.size;
    program_.shape.g_lower.resize(rows_, lower), program_.shape.g_upper.resize(rows_, upper);
  }
  void end_block(const std::vector<ConstraintRow>& rows) {
    for (const ConstraintRow& row : rows) {
      program_.shape.g_lower.push_back(row.lower);
      program_.shape.g_upper.push_back(row.upper);
    }
    end_block(0, 0);
  }

  // Where the results of the node at a point begin.
  std::size_t output(const StagedPhase& phase, std::size_t point) const {
    return program_.evaluators[phase.evaluator].y + (point - phase.first_used) * phase.stage.node.n_y();
  }

  void add_defects(const StagedPhase& phase) {
    const Scheme& scheme = phase.scheme();
    for (std::size_t k = 0; k < phase.intervals; ++k) {
      for (std::size_t r = 0; r < std::size_t(scheme.rows()); ++r) {
        begin_block({RowBlock::Kind::kDefect, number(phase), k, r}, phase.n_x);
        for (std::size_t j = 0; j <= phase.stride; ++j) {
          const std::size_t point = k * phase.stride + j;
          const double beta = phase.step(k) * scheme.beta(long(r), long(j));
          add_term(scheme.alpha(long(r), long(j)), LinearTerm::kVariables, phase.variable_of(point));
          if (beta != 0) add_term(beta, phase.evaluator, output(phase, point));
        }
        end_block(0, 0);
      }
    }
  }

  void add_controls(const StagedPhase& phase) {
    const Eigen::MatrixXd& held = phase.scheme().held;
    const auto n_u = std::size_t(phase.problem.n_u());
    for (std::size_t k = 0; k < phase.intervals; ++k) {
      for (std::size_t r = 0; r < std::size_t(held.rows()); ++r) {
        begin_block({RowBlock::Kind::kControl, number(phase), k, r}, n_u);
        for (std::size_t j = 0; j <= phase.stride; ++j)
          add_term(held(long(r), long(j)), LinearTerm::kVariables,
                   phase.variable_of(k * phase.stride + j + 1) - n_u);
        end_block(0, 0);
      }
    }
  }

  void add_path(const StagedPhase& phase) {
    if (phase.stage.path_rows.empty()) return;
    for (std::size_t p = phase.first_used; p < phase.first_used + phase.used; ++p) {
      begin_block({RowBlock::Kind::kPath, number(phase), p, 0}, phase.stage.path_rows.size());
      add_term(1, phase.evaluator, output(phase, p) + phase.n_x);
      end_block(phase.stage.path_rows);
    }
  }

  void add_instants(const StagedPhase& phase) {
    for (std::size_t k = 0; k < phase.instants.size(); ++k) {
      const std::vector<ConstraintRow>& rows = phase.stage.instants[k].rows;
      if (rows.empty()) continue;
      const std::size_t evaluator = phase.evaluator + 1 + k;
      begin_block({RowBlock::Kind::kInstant, number(phase), k, 0}, rows.size());
      add_term(1, evaluator, program_.evaluators[evaluator].y);
      end_block(rows);
    }
  }

  // The last output of every function is a cost; along the path it is integrated.
  void add_costs(const StagedPhase& phase) {
    const Scheme& scheme = phase.scheme();
    std::vector<double> quadrature(phase.points, 0.0);
    for (std::size_t k = 0; k < phase.intervals; ++k) {
      const double h = phase.step(k);
      for (std::size_t j = 0; j <= phase.stride; ++j)
        quadrature[k * phase.stride + j] += h * scheme.gamma[long(j)];
    }
    for (std::size_t p = phase.first_used; p < phase.first_used + phase.used; ++p)
      program_.costs.push_back(
          {quadrature[p], phase.evaluator, output(phase, p) + phase.stage.node.n_y() - 1});
    for (std::size_t k = 0; k < phase.instants.size(); ++k) {
      const Evaluator& instant = program_.evaluators[phase.evaluator + 1 + k];
      if (instant.function.n_y() > 0)
        program_.costs.push_back({1, phase.evaluator + 1 + k, instant.y_end() - 1});
    }
  }

  std::size_t number(const StagedPhase& phase) const { return std::size_t(&phase - program_.phases.data()); }

  StagedProgram program_;
  std::size_t rows_ = 0;
};

void check_meshes(const Phases& phases, const std::vector<MeshOptions>& meshes) {
  const std::size_t n = phases.phases.size();
  if (meshes.size() != 1 && meshes.size() != n)
    throw ArgumentError("phases \"" + phases.name + "\": " + std::to_string(meshes.size()) + " meshes for " +
                        std::to_string(n) + " phases, expected one each or one for all");
  for (const MeshOptions& mesh : meshes) {
    if (mesh.hessian == meshes.front().hessian) continue;
    throw ArgumentError("phases \"" + phases.name +
                        "\": meshes ask for different Hessians, expected one kind");
  }
}

void add_link(const PhaseLink& link, const Phases& phases, Discretization& all) {
  const Phases::Phase &from = phases.phases[link.from], &to = phases.phases[link.to];
  Function recorded;
  if (!link.change->empty())
    recorded = record_link(from.problem, *link.change, phases.name + " link to " + to.name);
  all.add_link({link.from, link.to, "\"" + from.name + "\" to \"" + to.name + "\"", *link.change,
                from.problem.duration},
               link.change->empty() ? nullptr : &recorded, nullptr, to.problem.states.size());
}

}  // namespace

StagedProgram discretize(const Problem& problem, const MeshOptions& mesh) {
  Discretization all(problem.name);
  all.add_phase("", problem, mesh);
  return all.finish();
}

StagedProgram discretize(const Phases& phases, const std::vector<MeshOptions>& meshes) {
  check(phases);
  check_meshes(phases, meshes);
  const std::vector<Problem> problems = told_of_each_other(phases);
  const std::vector<PhaseLink> links = links_of(phases);
  Discretization all(phases.name, phases.controls);
  for (std::size_t k = 0; k < problems.size(); ++k) {
    all.add_phase(phases.phases[k].name, problems[k], meshes[meshes.size() == 1 ? 0 : k]);
    for (const PhaseLink& link : links)
      if (link.from == k) add_link(link, phases, all);
  }
  return all.finish();
}

StagedProgram discretize(const StagedProgram& ready, const std::vector<std::vector<double>>& nodes) {
  Discretization all(ready.name, ready.controls);
  for (std::size_t k = 0; k < ready.phases.size(); ++k) {
    const StagedPhase& before = ready.phases[k];
    MeshOptions mesh = before.mesh;
    mesh.nodes = nodes.at(k), mesh.evaluation.force_rebuild = false;
    all.add_phase(before.name, with_duration_of(mesh.nodes, before.asked), mesh, &ready);
    for (const StagedLink& link : ready.links) {
      if (link.from == k) all.add_link(link, nullptr, &ready, std::size_t(ready.phases[link.to].asked.n_x()));
    }
  }
  return all.finish();
}

void place_values(StagedProgram& program, std::size_t k) {
  const StagedPhase& phase = program.phases[k];
  const Problem& problem = phase.problem;
  double *lower = program.shape.x_lower.data() + phase.variable,
         *upper = program.shape.x_upper.data() + phase.variable;
  std::size_t i = 0;
  for (std::size_t p = 0; p < phase.points; ++p) {
    for (const Bounds* bounds : {&problem.x, &problem.a, &problem.u}) {
      std::copy(bounds->lower.begin(), bounds->lower.end(), lower + i);
      std::copy(bounds->upper.begin(), bounds->upper.end(), upper + i);
      i += std::size_t(bounds->lower.size());
    }
  }
  const auto fix = [&](std::size_t at, double value) { lower[at] = upper[at] = value; };
  for (std::size_t s = 0; s < phase.n_x; ++s) {
    const double start = problem.start[long(s)], goal = problem.goal[long(s)];
    if (!std::isnan(start)) fix(s, start);
    if (!std::isnan(goal)) fix((phase.points - 1) * phase.n_z + s, goal);
  }
  for (std::size_t p : {std::size_t(0), phase.points - 1}) {
    if (p >= phase.first_used && p < phase.first_used + phase.used) continue;
    const Stage<double> guess = problem.first_guess(phase.t[p]);
    std::size_t at = p * phase.n_z + phase.n_x;
    for (double a : guess.a) fix(at++, a);
    for (double u : guess.u) fix(at++, u);
  }
  // What functions take at a point: its time, and the parameters then.
  const auto give = [&](Evaluator& evaluator, std::size_t first, std::size_t count) {
    evaluator.parameters.clear();
    for (std::size_t p = first; p < first + count; ++p) {
      const Eigen::VectorXd values = parameters_of(problem, phase.t[p]);
      evaluator.parameters.insert(evaluator.parameters.end(), values.begin(), values.end());
    }
  };
  const auto give_all = [&](std::vector<Evaluator>& evaluators, std::size_t node) {
    give(evaluators[node], phase.first_used, phase.used);
    for (std::size_t e = 0; e < phase.instants.size(); ++e)
      give(evaluators[node + 1 + e], phase.instants[e], 1);
  };
  give_all(program.evaluators, phase.evaluator);
  for (StagedLink& link : program.links) {
    if (link.from != k) continue;
    link.time = phase.asked.duration;
    if (link.evaluator < 0) continue;
    const Eigen::VectorXd p = parameters_of(phase.asked, link.time);
    program.evaluators[std::size_t(link.evaluator)].parameters.assign(p.begin(), p.end());
  }
  if (phase.mesh.hessian == HessianKind::kGaussNewton) give_all(program.squares, phase.squares);
}

}  // namespace dyntape
