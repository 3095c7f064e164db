// SPDX-License-Identifier: BSD-3-Clause
//
// Sums of short columns, for matrices of ten to fifty rows with contiguous entries, as in recursions over stages.  A
// file that uses them is compiled with -O3 (interface/CMakeLists.txt), which vectorises best if columns are padded()
// with zeros.  Sums have one order for any register width of the processor.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include <dyntape/autodiff/processor.h>

namespace dyntape::columns {

constexpr Eigen::Index kPad = 8;  // entries of the widest register

inline Eigen::Index padded(Eigen::Index n) { return (n + kPad - 1) / kPad * kPad; }

// to += a x
inline void add(double* __restrict to, double a, const double* __restrict x, Eigen::Index n) {
  for (Eigen::Index i = 0; i < n; ++i) to[i] += a * x[i];
}

// to += sum_k b_k A(:, k), n entries of each column.
inline void add_columns(double* __restrict to, const double* __restrict A, Eigen::Index stride,
                        const double* b, Eigen::Index count, Eigen::Index n) {
  Eigen::Index k = 0;
  for (; k + 4 <= count; k += 4, A += 4 * stride) {
    const double b0 = b[k], b1 = b[k + 1], b2 = b[k + 2], b3 = b[k + 3];
    const double *a0 = A, *a1 = A + stride, *a2 = A + 2 * stride, *a3 = A + 3 * stride;
    for (Eigen::Index i = 0; i < n; ++i)
      to[i] = (((to[i] + b0 * a0[i]) + b1 * a1[i]) + b2 * a2[i]) + b3 * a3[i];
  }
  for (; k < count; ++k, A += stride) add(to, b[k], A, n);
}

inline namespace DYNTAPE_VECTORS {

using Register = double __attribute__((vector_size(DYNTAPE_REGISTER), aligned(sizeof(double)), may_alias));

constexpr int kOfRegister = DYNTAPE_REGISTER / sizeof(double);
// Registers per column: with four columns enough to hide the latency, and no more than exist.
constexpr int kRegisters = kOfRegister == kPad ? 1 : 2;
constexpr Eigen::Index kRows = kRegisters * kOfRegister;

// Layout of the factors of a column's entries.  kColumns: a column of B; kRows: a row of B, for a product with its
// transpose; kMinusColumns, kMinusRows: the product is subtracted.
enum class Factors { kColumns, kMinusColumns, kRows, kMinusRows };
constexpr bool are_of_columns(Factors factors) {
  return factors == Factors::kColumns || factors == Factors::kMinusColumns;
}

template <int columns, Factors factors>
void add_block(double* __restrict C, Eigen::Index of_C, const double* __restrict A, Eigen::Index of_A,
               const double* __restrict B, Eigen::Index of_B, Eigen::Index count) {
  Register sum[columns][kRegisters];
  for (int c = 0; c < columns; ++c)
    for (int r = 0; r < kRegisters; ++r)
      sum[c][r] = *reinterpret_cast<const Register*>(C + c * of_C + r * kOfRegister);
  for (Eigen::Index k = 0; k < count; ++k) {
    Register a[kRegisters];
    for (int r = 0; r < kRegisters; ++r)
      a[r] = *reinterpret_cast<const Register*>(A + k * of_A + r * kOfRegister);
    for (int c = 0; c < columns; ++c) {
      const double b = are_of_columns(factors) ? B[k + c * of_B] : B[k * of_B + c];
      for (int r = 0; r < kRegisters; ++r) {
        if constexpr (factors == Factors::kMinusRows || factors == Factors::kMinusColumns)
          sum[c][r] -= a[r] * b;
        else
          sum[c][r] += a[r] * b;
      }
    }
  }
  for (int c = 0; c < columns; ++c)
    for (int r = 0; r < kRegisters; ++r)
      *reinterpret_cast<Register*>(C + c * of_C + r * kOfRegister) = sum[c][r];
}

// The sum of a_i b_i, n = padded(n) terms, grouped by position in the widest register.
inline double padded_dot(const double* a, const double* b, Eigen::Index n) {
  constexpr int kParts = int(kPad) / kOfRegister;
  Register sum[kParts] = {};
  for (Eigen::Index i = 0; i < n; i += kPad) {
    for (int r = 0; r < kParts; ++r) {
      const Eigen::Index at = i + r * kOfRegister;
      sum[r] += *reinterpret_cast<const Register*>(a + at) * *reinterpret_cast<const Register*>(b + at);
    }
  }
  double s[kPad];
  for (int r = 0; r < kParts; ++r) *reinterpret_cast<Register*>(s + r * kOfRegister) = sum[r];
  return ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
}

// Zero times a value that is not finite is NaN.
inline bool are_finite(const double* a, Eigen::Index n) {
  Register sum = {};
  Eigen::Index i = 0;
  for (; i + kOfRegister <= n; i += kOfRegister) sum += 0.0 * *reinterpret_cast<const Register*>(a + i);
  double all = 0;
  for (; i < n; ++i) all += 0 * a[i];
  for (int part = 0; part < kOfRegister; ++part) all += sum[part];
  return all == 0;
}

}  // namespace DYNTAPE_VECTORS

// C += A B: C (rows x columns) and A (rows x count) with padded() rows and the given column strides.  B by columns,
// or by rows; then the product may be subtracted.
template <Factors factors = Factors::kColumns>
void add_product(double* C, Eigen::Index of_C, const double* A, Eigen::Index of_A, const double* B,
                 Eigen::Index of_B, Eigen::Index rows, Eigen::Index count, Eigen::Index columns) {
  const Eigen::Index next = are_of_columns(factors) ? of_B : 1;
  for (Eigen::Index i = 0; i < rows; i += kRows) {
    Eigen::Index j = 0;
    for (; j + 4 <= columns; j += 4)
      add_block<4, factors>(C + i + j * of_C, of_C, A + i, of_A, B + j * next, of_B, count);
    for (; j < columns; ++j)
      add_block<1, factors>(C + i + j * of_C, of_C, A + i, of_A, B + j * next, of_B, count);
  }
}

// The same for a symmetric C: its lower triangle, and the upper part of its diagonal blocks.
template <Factors factors = Factors::kColumns>
void add_symmetric_product(double* C, Eigen::Index of_C, const double* A, Eigen::Index of_A, const double* B,
                           Eigen::Index of_B, Eigen::Index rows, Eigen::Index count, Eigen::Index columns) {
  const Eigen::Index next = are_of_columns(factors) ? of_B : 1;
  for (Eigen::Index j = 0; j < columns; j += kPad)
    add_product<factors>(C + j + j * of_C, of_C, A + j, of_A, B + j * next, of_B, rows - j, count,
                         std::min(kPad, columns - j));
}

// The largest of |a_i|, n = padded(n) of them.
inline double padded_largest(const double* a, Eigen::Index n) {
  double most[kPad] = {};
  for (Eigen::Index i = 0; i < n; i += kPad) {
    for (int part = 0; part < kPad; ++part) {
      const double size = std::abs(a[i + part]);
      most[part] = size > most[part] ? size : most[part];
    }
  }
  return *std::max_element(most, most + kPad);
}

inline double dot(const double* a, const double* b, Eigen::Index n) {
  double sum = 0;
  for (Eigen::Index i = 0; i < n; ++i) sum += a[i] * b[i];
  return sum;
}

}  // namespace dyntape::columns
