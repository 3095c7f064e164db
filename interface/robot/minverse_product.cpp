// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/robot/minverse_product.h>

#include <dyntape/interface/robot/minverse_columns.h>

#include <algorithm>
#include <string>

#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>

namespace dyntape {
namespace {

constexpr int kStep = 8;  // rows at once

// A group of rows is one register.
constexpr char kGroup[] = R"(#if defined(__AVX512F__)
typedef double group __attribute__((vector_size(64), aligned(8), may_alias));
#elif defined(__AVX__)
typedef double group __attribute__((vector_size(32), aligned(8), may_alias));
#else
typedef double group __attribute__((vector_size(16), aligned(8), may_alias));
#endif
)";

std::string table(const char* name, const std::vector<int>& values) {
  std::string text = std::string("static const int ") + name + "[] = {";
  for (std::size_t i = 0; i < values.size(); ++i) {
    text += (i % 24 == 0 ? "\n  " : " ") + std::to_string(values[i]) + (i + 1 < values.size() ? "," : "");
  }
  return text + "};\n";
}

}  // namespace

MinverseProduct::MinverseProduct(const dynamics::Tree& tree, Base base)
    : nv_(static_cast<int>(tree.dofs.size())), path_(tree.path), end_(tree.path_end) {
  if (base == Base::kFree) known_ = {6, 3};
}

bool MinverseProduct::is_worth_a_loop() const {
  constexpr std::size_t kMultiplications = 5000;  // below, straight-line code is as quick
  return nv_ >= kStep && 2 * path_.size() * static_cast<std::size_t>(nv_) >= kMultiplications;
}

std::size_t MinverseProduct::n_in() const {
  const int given = static_cast<int>(path_.size()) - begin(known_[0]) + static_cast<int>(path_.size()) -
                    begin(known_[1]) + (known_[0] ? 6 : 0);
  return static_cast<std::size_t>(nv_ * nv_ + given);
}

VectorXad MinverseProduct::arguments(const MatrixXad& Minv, const MatrixXad& dtau_dq,
                                     const MatrixXad& dtau_dv, const Vector3ad& gravity,
                                     const Vector3ad& turn) const {
  VectorXad in(static_cast<Eigen::Index>(n_in()));
  Eigen::Index next = 0;
  for (int k = 0; k < nv_; ++k) {
    for (int r = 0; r < nv_; ++r) in[next++] = Minv(r, k);
  }
  for (int block = 0; block < 2; ++block) {
    const MatrixXad& D = block ? dtau_dv : dtau_dq;
    for (int j = known_[block], c = begin(j); j < nv_; ++j) {
      for (; c < end_[j]; ++c) in[next++] = D(path_[c], j);
    }
  }
  if (known_[0]) in.tail(6) << gravity, -turn;
  return in;
}

void MinverseProduct::run(const AD* in, AD* out) const {
  const AD *d = in + nv_ * nv_, *u = in + n_in() - 6;
  for (int block = 0; block < 2; ++block, out += nv_ * nv_, u += 3) {
    const int known = known_[block];
    for (int r = 0; r < nv_; ++r) std::fill_n(out + r * nv_, known, AD(0));
    for (int k = 0; k < 3 && known; ++k) {
      out[k * nv_ + known - 3 + (k + 1) % 3] = -u[(k + 2) % 3];
      out[k * nv_ + known - 3 + (k + 2) % 3] = u[(k + 1) % 3];
    }
    for (int j = known; j < nv_; ++j) {
      for (int r = 0; r < nv_; ++r) {
        AD x = -(in[path_[begin(j)] * nv_ + r] * d[0]);
        for (int c = begin(j) + 1; c < end_[j]; ++c) x = x - in[path_[c] * nv_ + r] * d[c - begin(j)];
        out[r * nv_ + j] = x;
      }
      d += end_[j] - begin(j);
    }
  }
}

void MinverseProduct::run(const double* in, double* out, int lanes) const {
  minverse_columns({nv_, known_.data(), path_.data(), end_.data()}, lanes, in, out);
  const double* u = in + (n_in() - 6) * std::size_t(lanes);
  const auto at = [&](double* result, int row, int column) { return result + (row * nv_ + column) * lanes; };
  for (int block = 0; block < 2; ++block, out += nv_ * nv_ * lanes, u += 3 * lanes) {
    const int known = known_[block];
    for (int r = 0; r < nv_; ++r) std::fill_n(at(out, r, 0), known * lanes, 0.0);
    for (int k = 0; k < 3 && known; ++k) {
      for (int l = 0; l < lanes; ++l) {
        at(out, k, known - 3 + (k + 1) % 3)[l] = -u[(k + 2) % 3 * lanes + l];
        at(out, k, known - 3 + (k + 2) % 3)[l] = u[(k + 1) % 3 * lanes + l];
      }
    }
  }
}

// Several rows at once: in one lane groups of a register's entries, as many as stay in registers; in several lanes eight
// vectors.  The last group ends with the last row, and may do some rows of the group before once more.
std::string MinverseProduct::c_loops(const std::string& real, const std::string& body) const {
  const std::string n = std::to_string(nv_), block = std::to_string(nv_ * nv_);
  std::vector<int> row_starts;
  for (const int row : path_) row_starts.push_back(row * nv_);
  std::string text = table("row", row_starts) + table("end", end_) + "const " + real + " *m, *d = in + " +
                     block + ";\nint block, j, c, r, begin;\n";
  std::string columns_known, from = "j = 0, begin = 0";
  if (known_[0]) {
    const std::string twice = std::to_string(2 * nv_);
    text += "const " + real + " *u = in + " + std::to_string(n_in() - 6) + ", zero = {0};\n" + real +
            "* o;\nint known;\n";
    columns_known = "  known = block ? 3 : 6;\n  o = out + known - 3;\n  for (r = 0; r < " + n +
                    "; ++r) {\n    for (j = 0; j < known; ++j) out[r * " + n +
                    " + j] = zero;\n  }\n  o[1] = -u[2], o[2] = u[1];\n  o[" + n + "] = u[2], o[" + n +
                    " + 2] = -u[0];\n  o[" + twice + "] = -u[1], o[" + twice + " + 1] = u[0];\n";
    from = "j = known, begin = end[known - 1]";
  }
  return text + "for (block = 0; block < 2; ++block, out += " + block + (known_[0] ? ", u += 3" : "") +
         ") {\n" + columns_known + "  for (" + from + "; j < " + n +
         "; d += end[j] - begin, begin = end[j++]) {\n" + body + "  }\n}\n";
}

std::string MinverseProduct::c_body() const {
  const std::string n = std::to_string(nv_);
  const auto of_width = [&](const char* condition, int width) {
    return condition + std::string("\n") + c_column(width);
  };
  const std::string body = of_width("#if defined(__AVX512F__)", 8) + of_width("#elif defined(__AVX__)", 4) +
                           of_width("#else", 2) + "#endif\n";
  return kGroup + c_loops("double", "    double x[" + n + "], e;\n" + body + "    for (r = 0; r < " + n +
                                        "; ++r) out[r * " + n + " + j] = x[r];\n");
}

// A column of the result, in groups of `width` rows.
std::string MinverseProduct::c_column(int width) const {
  constexpr int kAtOnce = 6;
  const int groups = (nv_ + width - 1) / width;
  std::string body;
  for (int first = 0; first < groups; first += kAtOnce) {
    std::string declared, started, summed, stored;
    for (int g = first; g < std::min(groups, first + kAtOnce); ++g) {
      const std::string x = "x" + std::to_string(g), at = std::to_string(std::min(g * width, nv_ - width));
      const std::string m = "*(const group*)(m + " + at + ") * e";
      declared += (g == first ? "" : ", ") + x;
      started += "      " + x + " = -(" + m + ");\n";
      summed += "        " + x + " = " + x + " - " + m + ";\n";
      stored += "      *(group*)(x + " + at + ") = " + x + ";\n";
    }
    body += "    {\n      group " + declared + ";\n      m = in + row[begin], e = d[0];\n" + started +
            "      for (c = begin + 1; c < end[j]; ++c) {\n        m = in + row[c], e = d[c - begin];\n" +
            summed + "      }\n" + stored + "    }\n";
  }
  return body;
}

std::string MinverseProduct::c_body_of_lanes() const {
  const std::string n = std::to_string(nv_);
  std::string declared, started, summed, stored;
  for (int k = 0; k < kStep; ++k) {
    const std::string x = "x" + std::to_string(k), m = "m[" + std::to_string(k) + "]";
    declared += ", " + x;
    started += "      " + x + " = -(" + m + " * e);\n";
    summed += "        " + x + " = " + x + " - " + m + " * e;\n";
    stored += "      out[(at + " + std::to_string(k) + ") * " + n + " + j] = " + x + ";\n";
  }
  return c_loops("reals", "    for (r = 0; r < " + n + "; r += " + std::to_string(kStep) +
                              ") {\n      const int at = r < " + std::to_string(nv_ - kStep) +
                              " ? r : " + std::to_string(nv_ - kStep) + ";\n      real e" + declared +
                              ";\n      m = in + row[begin] + at, e = d[0];\n" + started +
                              "      for (c = begin + 1; c < end[j]; ++c) {\n" +
                              "        m = in + row[c] + at, e = d[c - begin];\n" + summed + "      }\n" +
                              stored + "    }\n");
}

// The first row of a column takes a product and a negation, each further one a product and a difference.
std::vector<OperationCount> MinverseProduct::operations() const {
  const auto n = static_cast<std::size_t>(nv_), of_path = n_in() - n * n - (known_[0] ? 6 : 0),
             firsts = n * (2 * n - static_cast<std::size_t>(known_[0] + known_[1])),
             others = n * of_path - firsts, negations = firsts + (known_[0] ? 6 : 0);
  return {{Op::Sub, others}, {Op::Mul, firsts + others}, {Op::Neg, negations}};
}

std::shared_ptr<const Callee> MinverseProduct::callee() const {
  if (nv_ < kStep)
    throw ArgumentError("MinverseProduct: the robot has " + std::to_string(nv_) +
                        " degrees of freedom, a loop is for " + std::to_string(kStep) + " or more");
  const std::string name = "minus_minverse_times";
  const std::size_t n_out = 2 * static_cast<std::size_t>(nv_) * nv_;
  Kernel kernel;
  kernel.operations = operations();
  kernel.c_body = c_body();
  kernel.c_body_of_lanes = c_body_of_lanes();
  kernel.evaluate = [self = *this](const double* in, double* out) { self.run(in, out, 1); };
  kernel.evaluate_lanes = [self = *this](const double* in, double* out, int lanes) {
    self.run(in, out, lanes);
  };
  kernel.unrolled = [=, self = *this] {
    return std::make_shared<const Function>(record(name, self.n_in(), [&](const VectorXad& in) {
      VectorXad out(static_cast<Eigen::Index>(n_out));
      self.run(in.data(), out.data());
      return out;
    }));
  };
  auto callee = std::make_shared<Callee>(name, n_in(), n_out, kernel);
  callee->jvp = [unrolled = kernel.unrolled] { return jvp_callee(recorded_callee(*unrolled())); };
  callee->vjp = [unrolled = kernel.unrolled] { return vjp_callee(recorded_callee(*unrolled())); };
  return callee;
}

}  // namespace dyntape
