// SPDX-License-Identifier: BSD-3-Clause
#include "routes.h"

#include <array>
#include <limits>
#include <set>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/derive/sparsity.h>
#include <dyntape/autodiff/evaluate/interpret.h>

namespace dyntape::testing {
namespace {

// A node of a program or of a graph with its value.
struct Line {
  Op op;
  std::array<std::size_t, 3> arguments;
  Quad value;
};

// First-order bound on the rounding errors of a line's value in double: every line errs by at most a few units in
// the last place of its value, passed on by the derivatives.
Quad error_bound(const std::vector<Line>& lines, std::size_t output) {
  std::vector<Quad> adjoint(output + 1, 0);
  adjoint[output] = 1;
  Quad bound = 1e-26;  // products of rounding errors, which first order does not see
  for (std::size_t k = output + 1; k-- > 0;) {
    const Line& line = lines[k];
    if (adjoint[k] == 0 || line.op == Op::Input) continue;
    if (line.value != 0) bound += abs(adjoint[k] * line.value) * Quad(4 * 0x1p-52);
    if (line.op == Op::Const) continue;
    const auto& [a, b, c] = line.arguments;
    for (int i = 0; i < info(line.op).arity; ++i) {
      if (!has_slope(line.op, i)) continue;
      const Quad s =
          slope<Quad>(line.op, i, lines[a].value, lines[b].value, lines[c].value, line.value, adjoint[k]);
      adjoint[line.arguments[static_cast<std::size_t>(i)]] += abs(s);
    }
  }
  return isnan(bound) ? std::numeric_limits<Quad>::infinity() : bound;  // on the edge of a pole
}

std::vector<Line> lines_of(const Function& f, const std::vector<double>& x, const std::vector<double>& p,
                           const std::vector<double>& w) {
  const std::vector<double>* blocks[] = {&x, &p, &w};
  std::vector<Line> lines;
  for (const Node& n : f.graph.nodes()) {
    Line line{n.op, {}, 0};
    if (n.op == Op::Const) {
      line.value = f.graph.constants()[n.a];
    } else if (n.op == Op::Input) {
      line.value = (*blocks[n.a])[n.b];
    } else {
      for (int i = 0; i < info(n.op).arity; ++i) line.arguments[static_cast<std::size_t>(i)] = n.argument(i);
      const auto& [a, b, c] = line.arguments;
      line.value = evaluate<Quad>(n.op, lines[a].value, lines[b].value, lines[c].value);
    }
    lines.push_back(line);
  }
  return lines;
}

// As written: without what recording folds.
std::vector<Line> lines_of(const Program& program) {
  const std::vector<Quad> values = run_all(program, to_quad(program.x), to_quad(program.p));
  std::vector<Line> lines;
  for (std::size_t k = 0; k < program.first_instruction(); ++k) lines.push_back({Op::Input, {}, values[k]});
  for (const Instruction& i : program.instructions)
    lines.push_back({i.op, {i.a, i.b, i.c}, values[lines.size()]});
  return lines;
}

// One program through all routes: the first disagreement in words, or nothing.
class Routes {
 public:
  Routes(const Program& program, std::uint64_t seed) : program_(program), random_(seed) {}

  std::string disagreement() {
    f_ = recorded(program_);
    l_ = random_.vector(f_.n_y(), -1, 1);
    dx_ = random_.vector(f_.n_x(), -1, 1);
    for (auto step : {&Routes::values, &Routes::first_order, &Routes::second_order, &Routes::patterns}) {
      (this->*step)();
      if (!found_.empty()) break;
    }
    return found_;
  }

 private:
  // The double evaluation against quad, within its error bound; returns the quad values.
  std::vector<Quad> evaluated(const Function& f, const std::vector<double>& w, const std::string& what) {
    const std::vector<double> got = evaluate(f, program_.x, program_.p, w);
    std::vector<Quad> expected = evaluate_as<Quad>(f, to_quad(program_.x), to_quad(program_.p), to_quad(w));
    const std::vector<Line> lines = lines_of(f, program_.x, program_.p, w);
    for (std::size_t i = 0; i < got.size(); ++i) {
      if (!(abs(Quad(got[i]) - expected[i]) <= error_bound(lines, f.outputs[i]))) {
        report(what + " in double", i, Quad(got[i]), expected[i]);
      }
    }
    return expected;
  }

  void compare(const std::string& what, const std::vector<Quad>& got, const std::vector<Quad>& expected,
               double tolerance) {
    if (got.size() != expected.size()) report(what + ": size", 0, Quad(got.size()), Quad(expected.size()));
    for (std::size_t i = 0; i < got.size() && found_.empty(); ++i) {
      if (!(abs(got[i] - expected[i]) <= tolerance * (1 + abs(expected[i])))) {
        report(what, i, got[i], expected[i]);
      }
    }
  }

  void report(const std::string& what, std::size_t i, const Quad& got, const Quad& expected) {
    if (found_.empty())
      found_ =
          what + " [" + std::to_string(i) + "]: " + to_text(got, 25) + " instead of " + to_text(expected, 25);
  }

  void values() {
    const std::vector<double> direct = run(program_, program_.x, program_.p);
    const std::vector<double> interpreted = evaluate(f_, program_.x, program_.p);
    for (std::size_t i = 0; i < direct.size(); ++i) {  // bit for bit, but for the sign of zero
      if (direct[i] != interpreted[i]) report("interpreter against direct run", i, interpreted[i], direct[i]);
    }
    evaluated(f_, {}, "value");
    // Constants are folded in double: the quad routes may differ by what that rounds.
    const std::vector<Quad> got = evaluate_as<Quad>(f_, to_quad(program_.x), to_quad(program_.p));
    const std::vector<Quad> expected = run(program_, to_quad(program_.x), to_quad(program_.p));
    const std::vector<Line> lines = lines_of(program_);
    for (std::size_t i = 0; i < got.size(); ++i) {
      if (!(abs(got[i] - expected[i]) <= error_bound(lines, program_.outputs[i])))
        report("value in quad", i, got[i], expected[i]);
    }
  }

  void first_order() {
    for (std::size_t j = 0; j < f_.n_x(); ++j) columns_.push_back(difference(f_, program_.x, j, program_.p));
    std::vector<Quad> forward(f_.n_y(), 0), reverse(f_.n_x(), 0);
    for (std::size_t j = 0; j < f_.n_x(); ++j) {
      for (std::size_t i = 0; i < f_.n_y(); ++i) {
        forward[i] += columns_[j][i] * Quad(dx_[j]);
        reverse[j] += columns_[j][i] * Quad(l_[i]);
      }
    }
    compare("jvp", evaluated(jvp(f_), dx_, "jvp"), forward, 1e-12);
    gradient_ = vjp(f_);
    compare("vjp", evaluated(gradient_, l_, "vjp"), reverse, 1e-12);
    derived_ = derive(f_, Order::kSecond);
    all_ = evaluated(derived_.function, l_, "derive");
    std::vector<Quad> dense(f_.n_y() * f_.n_x(), 0), expected = dense;
    for (std::size_t k = 0; k < derived_.jacobian.nnz(); ++k) {
      dense[derived_.jacobian.row[k] * f_.n_x() + derived_.jacobian.col[k]] = all_[f_.n_y() + k];
    }
    for (std::size_t i = 0; i < f_.n_y(); ++i) {
      for (std::size_t j = 0; j < f_.n_x(); ++j) expected[i * f_.n_x() + j] = columns_[j][i];
    }
    compare("sparse Jacobian", dense, expected, 1e-12);
  }

  void second_order() {
    const std::size_t n = f_.n_x();
    std::vector<Quad> product(n, 0), from_sparse(n, 0);
    for (std::size_t j = 0; j < n; ++j) {
      const std::vector<Quad> column = difference(gradient_, program_.x, j, program_.p, l_);
      for (std::size_t i = 0; i < n; ++i) product[i] += column[i] * Quad(dx_[j]);
    }
    for (std::size_t k = 0; k < derived_.hessian.nnz(); ++k) {
      const std::size_t i = derived_.hessian.row[k], j = derived_.hessian.col[k];
      const Quad h = all_[f_.n_y() + derived_.jacobian.nnz() + k];
      from_sparse[i] += h * Quad(dx_[j]);
      if (i != j) from_sparse[j] += h * Quad(dx_[i]);
    }
    std::vector<double> l_dx = l_, dx_l = dx_;
    l_dx.insert(l_dx.end(), dx_.begin(), dx_.end());
    dx_l.insert(dx_l.end(), l_.begin(), l_.end());
    compare("jvp of vjp", evaluated(jvp(gradient_), l_dx, "jvp of vjp"), product, 1e-10);
    compare("vjp of jvp", evaluated(vjp(jvp(f_)), dx_l, "vjp of jvp"), product, 1e-10);
    compare("sparse Hessian", from_sparse, product, 1e-10);
  }

  // What moves is in the pattern; what is in the pattern has a path of derivatives.
  void patterns() {
    const Pattern path = jacobian_sparsity(f_);
    std::set<std::pair<std::uint32_t, std::uint32_t>> listed, possible;
    for (std::size_t k = 0; k < path.nnz(); ++k) possible.emplace(path.row[k], path.col[k]);
    for (std::size_t k = 0; k < derived_.jacobian.nnz(); ++k) {
      listed.emplace(derived_.jacobian.row[k], derived_.jacobian.col[k]);
      if (!possible.contains({derived_.jacobian.row[k], derived_.jacobian.col[k]})) {
        report("Jacobian entry without a path", k, 1, 0);
      }
    }
    for (std::uint32_t i = 0; i < f_.n_y(); ++i) {
      for (std::uint32_t j = 0; j < f_.n_x(); ++j) {
        if (abs(columns_[j][i]) > 1e-18 && !listed.contains({i, j})) {
          report("Jacobian entry missing", i, 0, columns_[j][i]);
        }
      }
    }
    for (std::size_t k = 0; k < derived_.hessian.nnz(); ++k) {
      if (derived_.hessian.col[k] > derived_.hessian.row[k])
        report("Hessian entry above the diagonal", k, 1, 0);
    }
  }

  const Program& program_;
  Random random_;
  Function f_, gradient_;
  Derivatives derived_;
  std::vector<double> l_, dx_;
  std::vector<std::vector<Quad>> columns_;  // the Jacobian by differences
  std::vector<Quad> all_;
  std::string found_;
};

}  // namespace

std::string disagreement(const Program& program, std::uint64_t seed) {
  return Routes(program, seed).disagreement();
}

std::string shrunk_disagreement(const Program& program, std::uint64_t seed) {
  const auto kind = [](const std::string& words) { return words.substr(0, words.find('[')); };
  const std::string found = kind(disagreement(program, seed));
  const Program small =
      shrunk(program, [&](const Program& p) { return kind(disagreement(p, seed)) == found; });
  return disagreement(small, seed) + ":\n" + text(small);
}

}  // namespace dyntape::testing
