// SPDX-License-Identifier: BSD-3-Clause
#include "random_program.h"

#include <array>
#include <cmath>
#include <sstream>

#include <dyntape/autodiff/record/record.h>

namespace dyntape::testing {
namespace {

AD apply_by_name(Op op, const AD& a, const AD& b, const AD& c) {
  switch (op) {
#define OP(name, fn, n, ...) \
  case Op::name:             \
    return DYNTAPE_TEST_##n(fn);
#define DYNTAPE_TEST_1(fn) fn(a)
#define DYNTAPE_TEST_2(fn) fn(a, b)
#define DYNTAPE_TEST_3(fn) fn(a, b, c)
#include <dyntape/autodiff/graph/ops.def>
#undef DYNTAPE_TEST_1
#undef DYNTAPE_TEST_2
#undef DYNTAPE_TEST_3
    default:
      return a + b + c;
  }
}

constexpr double kNeighbourhood = 4e-6;  // wider than the differences of quad.h

// A program in the making, with its values in double, in quad, and in quad at the corners of a neighbourhood.
class Builder {
 public:
  explicit Builder(Random& random) : random_(random) {
    const std::size_t n_x = 1 + random.below(5), n_p = random.below(3);
    program_.x = random.vector(n_x, 0.3, 1.7);
    program_.p = random.vector(n_p, 0.3, 1.7);
    for (double special : {0.0, 1.0, -1.0, 2.0, 0.5, -3.0}) {
      if (random.below(2)) program_.constants.push_back(special);
    }
    program_.constants.push_back(random.uniform(-2, 2));
    value_ = run_all(program_, program_.x, program_.p);
    quads_.push_back(run_all(program_, to_quad(program_.x), to_quad(program_.p)));
    for (std::size_t j = 0; j < n_x; ++j) {
      for (int sign : {-1, 1}) {
        std::vector<Quad> x = to_quad(program_.x);
        x[j] += sign * Quad(kNeighbourhood);
        quads_.push_back(run_all(program_, x, to_quad(program_.p)));
      }
    }
    wild_.assign(value_.size(), false);
    exact_.assign(value_.size(), true);
    kind_.assign(n_x + n_p, Kind::kVaries);
    kind_.resize(value_.size(), Kind::kConstant);
  }

  // Draws one instruction; most are kept.
  void step() {
    const Op op = static_cast<Op>(random_.below(static_cast<std::size_t>(kTableOps)));
    const Instruction instruction{op, operand(op), operand(op), operand(op)};
    bool wild;
    if (!admits(instruction, wild)) return;
    if (wild && random_.below(3)) return;
    program_.instructions.push_back(instruction);
    value_.push_back(apply(instruction, value_));
    for (auto& q : quads_) q.push_back(apply(instruction, q));
    wild_.push_back(wild);
    exact_.push_back(is_exact(instruction));
    kind_.push_back(all_of(instruction, Kind::kConstant) ? Kind::kFolded : Kind::kVaries);
  }

  Program finish() {
    const std::size_t n = 1 + random_.below(4);
    for (std::size_t i = 0; i < n; ++i) {
      std::size_t k;
      do k = value_.size() - 1 - random_.below(std::min<std::size_t>(value_.size(), 12 + 10 * i));
      while (wild_[k]);
      program_.outputs.push_back(k);
    }
    return program_;
  }

 private:
  enum class Kind { kConstant, kFolded, kVaries };

  // Recent results more often than old ones; wild values for selections only.
  std::size_t operand(Op op) {
    while (true) {
      const std::size_t n = value_.size();
      const std::size_t k =
          random_.below(2) ? n - 1 - random_.below(std::min<std::size_t>(n, 6)) : random_.below(n);
      if (!wild_[k] || op == Op::Select) return k;
    }
  }

  template <class T>
  T apply(const Instruction& i, const std::vector<T>& v) const {
    return evaluate<T>(i.op, v[i.a], v[i.b], v[i.c]);
  }
  template <class T>
  T slope_at(const Instruction& i, int argument, const std::vector<T>& v) const {
    return slope<T>(i.op, argument, v[i.a], v[i.b], v[i.c], apply(i, v), T(1));
  }

  bool all_of(const Instruction& i, Kind kind) const {
    const int n = info(i.op).arity;
    return kind_[i.a] <= kind && (n < 2 || kind_[i.b] <= kind) && (n < 3 || kind_[i.c] <= kind);
  }

  bool admits(const Instruction& i, bool& wild) const {
    // Folded once, in double, a constant stays within the error bound of one operation.
    if (all_of(i, Kind::kFolded) && !all_of(i, Kind::kConstant)) return false;
    wild = false;
    if (i.op == Op::Select) {  // what is taken must be tame, and so must the condition
      if (wild_[i.a] || wild_[value_[i.a] != 0 ? i.b : i.c]) return false;
    }
    // The sign of a zero is not kept by the laws; a constant integer power becomes products.
    if ((i.op == Op::Copysign && value_[i.b] == 0) || (i.op == Op::Atan2 && value_[i.a] == 0)) return false;
    if (i.op == Op::Pow && value_[i.b] == std::floor(value_[i.b])) return false;
    const double v = apply(i, value_);
    wild = !std::isfinite(v) || std::abs(v) > 1e4;
    const Quad q = apply(i, quads_[0]);
    if (!wild && !(abs(q - Quad(v)) <= 1e-9 * (1 + abs(q)))) return false;
    for (int k = 0; k < info(i.op).arity && !wild; ++k) {
      const Quad s = slope_at(i, k, quads_[0]);
      if (!isfinite(s) || abs(s) > 1e4) wild = true;
    }
    return wild || (smooth(i, q) && steady(i, q));
  }

  // Values and derivatives hardly move within the neighbourhood: no pole, kink or jump is near.
  bool smooth(const Instruction& i, const Quad& q) const {
    for (const auto& near : quads_) {
      if ((near[i.a] != 0) != (quads_[0][i.a] != 0) && i.op == Op::Select) return false;
      if (!is_alike(i, {near[i.a], near[i.b], near[i.c]}, q)) return false;
    }
    return true;
  }

  // Nor are they where rounding alone may have taken the arguments, which the neighbourhood does not show where
  // they do not vary: log(exp(x)) <= x, fmod(1, sinh(asinh(1))).
  bool steady(const Instruction& i, const Quad& q) const {
    // Equal but for rounding, as x and tan(atan(x)) are: what moves one of them away does not show it.
    const Quad &a = quads_[0][i.a], &b = quads_[0][i.b];
    const bool may_be_equal = i.a != i.b && abs(a - b) <= Quad(kNeighbourhood) * (1 + abs(a));
    if ((i.op == Op::Eq || i.op == Op::Ne) && may_be_equal && !(exact_[i.a] && exact_[i.b])) return false;
    for (std::size_t moved : {i.a, i.b, i.c}) {
      if (exact_[moved]) continue;
      for (int sign : {-1, 1}) {
        const auto at = [&](std::size_t k) {
          const Quad& v = quads_[0][k];
          return k == moved ? Quad(v + sign * Quad(kNeighbourhood) * (1 + abs(v))) : v;
        };
        if (!is_alike(i, {at(i.a), at(i.b), at(i.c)}, q)) return false;
      }
    }
    return true;
  }

  // Value and derivatives at other arguments are close to those at the point, where the value is q.
  bool is_alike(const Instruction& i, const std::array<Quad, 3>& v, const Quad& q) const {
    const Quad near = evaluate<Quad>(i.op, v[0], v[1], v[2]);
    if (!(abs(near - q) <= Quad(1e-2) * (1 + abs(q)))) return false;
    for (int k = 0; k < info(i.op).arity; ++k) {
      const Quad s = slope_at(i, k, quads_[0]), there = slope<Quad>(i.op, k, v[0], v[1], v[2], near, Quad(1));
      if (!(abs(there - s) <= Quad(1e-2) * (1 + abs(s)))) return false;
      // Jumps by a small divisor are small, and there may be thousands of them.
      if (i.op == Op::Fmod && k == 1 && there != s) return false;
    }
    return true;
  }

  // Given, or a small integer: not rounded.
  bool is_exact(const Instruction& i) const {
    switch (i.op) {
      case Op::Sign:
      case Op::Floor:
      case Op::Ceil:
      case Op::Trunc:
      case Op::Round:
      case Op::Lt:
      case Op::Le:
      case Op::Eq:
      case Op::Ne:
        return true;
      case Op::Neg:
      case Op::Abs:
        return exact_[i.a];
      case Op::Min:
      case Op::Max:
        return exact_[i.a] && exact_[i.b];
      default:
        return false;
    }
  }

  Random& random_;
  Program program_;
  std::vector<double> value_;
  std::vector<std::vector<Quad>> quads_;
  std::vector<bool> wild_, exact_;
  std::vector<Kind> kind_;
};

}  // namespace

Program random_program(Random& random, std::size_t instructions) {
  Builder builder(random);
  for (std::size_t i = 0; i < instructions; ++i) builder.step();
  return builder.finish();
}

Function recorded(const Program& program) {
  RecordOptions options;
  options.variables = program.x;
  options.parameters = program.p;
  return record(
      "random", program.x.size(), program.p.size(),
      [&](const VectorXad& x, const VectorXad& p) {
        std::vector<AD> v(x.begin(), x.end());
        v.insert(v.end(), p.begin(), p.end());
        for (double c : program.constants) v.emplace_back(c);
        for (const Instruction& i : program.instructions)
          v.push_back(apply_by_name(i.op, v[i.a], v[i.b], v[i.c]));
        VectorXad y(static_cast<Eigen::Index>(program.outputs.size()));
        for (std::size_t i = 0; i < program.outputs.size(); ++i)
          y[static_cast<Eigen::Index>(i)] = v[program.outputs[i]];
        return y;
      },
      options);
}

std::string text(const Program& program) {
  const std::size_t first = program.first_instruction(), n_x = program.x.size(), n_p = program.p.size();
  std::vector<bool> needed(first + program.instructions.size(), false);
  for (std::size_t k : program.outputs) needed[k] = true;
  for (std::size_t k = needed.size(); k-- > first;) {
    const Instruction& i = program.instructions[k - first];
    if (needed[k]) needed[i.a] = needed[i.b] = needed[i.c] = true;
  }
  std::ostringstream out;
  out.precision(17);
  for (std::size_t k = 0; k < first; ++k) {
    if (!needed[k]) continue;
    out << "  v" << k << " = ";
    if (k < n_x)
      out << "x[" << k << "]  (" << program.x[k] << ")\n";
    else if (k < n_x + n_p)
      out << "p[" << k - n_x << "]  (" << program.p[k - n_x] << ")\n";
    else
      out << program.constants[k - n_x - n_p] << "\n";
  }
  for (std::size_t k = first; k < needed.size(); ++k) {
    if (!needed[k]) continue;
    const Instruction& i = program.instructions[k - first];
    const int n = info(i.op).arity;
    out << "  v" << k << " = " << info(i.op).name << "(v" << i.a;
    if (n > 1) out << ", v" << i.b;
    if (n > 2) out << ", v" << i.c;
    out << ")\n";
  }
  for (std::size_t k : program.outputs) out << "  -> v" << k << "\n";
  return out.str();
}

Program shrunk(Program program, const std::function<bool(const Program&)>& fails) {
  for (std::size_t i = program.outputs.size(); i-- > 0 && program.outputs.size() > 1;) {
    Program less = program;
    less.outputs.erase(less.outputs.begin() + static_cast<std::ptrdiff_t>(i));
    if (fails(less)) program = less;
  }
  // An instruction gives way to its first argument.
  const std::size_t first = program.first_instruction();
  for (std::size_t k = first + program.instructions.size(); k-- > first;) {
    Program less = program;
    const std::size_t other = program.instructions[k - first].a;
    const auto replace = [&](std::size_t& operand) { operand = operand == k ? other : operand; };
    for (Instruction& i : less.instructions) replace(i.a), replace(i.b), replace(i.c);
    for (std::size_t& output : less.outputs) replace(output);
    if (fails(less)) program = less;
  }
  return program;
}

}  // namespace dyntape::testing
