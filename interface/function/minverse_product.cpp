// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/function/minverse_product.h>

#include <algorithm>
#include <string>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record.h>

namespace dyntape {
namespace {

constexpr int kStep = 8;  // rows at once

std::string table(const char* name, const std::vector<int>& values) {
  std::string text = std::string("static const int ") + name + "[] = {";
  for (std::size_t i = 0; i < values.size(); ++i) {
    text += (i % 24 == 0 ? "\n  " : " ") + std::to_string(values[i]) + (i + 1 < values.size() ? "," : "");
  }
  return text + "};\n";
}

}  // namespace

MinverseProduct::MinverseProduct(const dynamics::Tree& tree)
    : nv_(static_cast<int>(tree.dofs.size())), path_(tree.path), end_(tree.path_end) {}

bool MinverseProduct::is_worth_a_loop() const {
  constexpr std::size_t kMultiplications = 5000;  // below, straight-line code is as quick
  return nv_ >= kStep && 2 * path_.size() * static_cast<std::size_t>(nv_) >= kMultiplications;
}

VectorXad MinverseProduct::arguments(const MatrixXad& Minv, const MatrixXad& dtau_dq,
                                     const MatrixXad& dtau_dv) const {
  VectorXad in(nv_ * nv_ + 2 * static_cast<Eigen::Index>(path_.size()));
  Eigen::Index next = 0;
  for (int k = 0; k < nv_; ++k) {
    for (int r = 0; r < nv_; ++r) in[next++] = Minv(r, k);
  }
  for (const MatrixXad* D : {&dtau_dq, &dtau_dv}) {
    for (int j = 0, c = 0; j < nv_; ++j) {
      for (; c < end_[j]; ++c) in[next++] = (*D)(path_[c], j);
    }
  }
  return in;
}

template <class T>
void MinverseProduct::run(const T* in, T* out) const {
  const T* d = in + nv_ * nv_;
  for (int block = 0; block < 2; ++block, out += nv_ * nv_) {
    for (int j = 0, begin = 0; j < nv_; begin = end_[j++]) {
      for (int r = 0; r < nv_; ++r) {
        T x = -(in[path_[begin] * nv_ + r] * d[0]);
        for (int c = begin + 1; c < end_[j]; ++c) x = x - in[path_[c] * nv_ + r] * d[c - begin];
        out[r * nv_ + j] = x;
      }
      d += end_[j] - begin;
    }
  }
}

// Eight rows at once: in one lane groups of eight entries, as many as stay in registers; in several lanes eight
// vectors.  The last group ends with the last row, and may do some rows of the group before once more.
std::string MinverseProduct::c_loops(const std::string& real, const std::string& body) const {
  const std::string n = std::to_string(nv_), block = std::to_string(nv_ * nv_);
  std::vector<int> row_starts;
  for (const int row : path_) row_starts.push_back(row * nv_);
  return table("row", row_starts) + table("end", end_) + "const " + real + " *m, *d = in + " + block +
         ";\nint block, j, c, r, begin;\nfor (block = 0; block < 2; ++block, out += " + block +
         ") {\n  for (j = 0, begin = 0; j < " + n + "; d += end[j] - begin, begin = end[j++]) {\n" + body +
         "  }\n}\n";
}

std::string MinverseProduct::c_body() const {
  constexpr int kAtOnce = 6;
  const int groups = (nv_ + kStep - 1) / kStep;
  const std::string n = std::to_string(nv_);
  std::string body = "    double x[" + n + "], e;\n";
  for (int first = 0; first < groups; first += kAtOnce) {
    std::string declared, started, summed, stored;
    for (int g = first; g < std::min(groups, first + kAtOnce); ++g) {
      const std::string x = "x" + std::to_string(g), at = std::to_string(std::min(g * kStep, nv_ - kStep));
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
  return "typedef double group __attribute__((vector_size(64), aligned(8), may_alias));\n" +
         c_loops("double", body + "    for (r = 0; r < " + n + "; ++r) out[r * " + n + " + j] = x[r];\n");
}

std::string MinverseProduct::c_body_of_lanes() const {
  const std::string n = std::to_string(nv_);
  std::string declared, started, summed, stored;
  for (int k = 0; k < kStep; ++k) {
    const std::string x = "x" + std::to_string(k), m = "m[" + std::to_string(k) + "] * e";
    declared += ", " + x;
    started += "      " + x + " = -(" + m + ");\n";
    summed += "        " + x + " = " + x + " - " + m + ";\n";
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

std::shared_ptr<const Callee> MinverseProduct::callee() const {
  if (nv_ < kStep) {
    throw ArgumentError("MinverseProduct: the robot has " + std::to_string(nv_) +
                        " degrees of freedom, a loop is for " + std::to_string(kStep) + " or more");
  }
  auto callee = std::make_shared<Callee>();
  callee->name = "minus_minverse_times";
  callee->n_in = static_cast<std::size_t>(nv_) * nv_ + 2 * path_.size();
  callee->n_out = 2 * static_cast<std::size_t>(nv_) * nv_;
  callee->evaluate = [self = *this](const double* in, double* out) { self.run(in, out); };
  callee->c_body = c_body();
  callee->c_body_of_lanes = c_body_of_lanes();
  callee->unrolled = [self = *this, n_in = callee->n_in, n_out = callee->n_out] {
    return std::make_shared<const Function>(record("minus_minverse_times", n_in, [&](const VectorXad& in) {
      VectorXad out(static_cast<Eigen::Index>(n_out));
      self.run(in.data(), out.data());
      return out;
    }));
  };
  callee->jvp = [unrolled = callee->unrolled] { return jvp_callee(recorded_callee(*unrolled())); };
  callee->vjp = [unrolled = callee->unrolled] { return vjp_callee(recorded_callee(*unrolled())); };
  return callee;
}

}  // namespace dyntape
