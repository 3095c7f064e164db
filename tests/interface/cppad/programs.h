// SPDX-License-Identifier: BSD-3-Clause
//
// What programs written for CppAD begin with, an include changed.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/cppad/cppad.h>

using CppAD::AD;
using CppAD::ADFun;
using CppAD::Independent;
using CppAD::NearEqual;
using ADouble = AD<double>;
using DVector = CPPAD_TESTVECTOR(double);
using AVector = CPPAD_TESTVECTOR(AD<double>);

inline const double kInf = std::numeric_limits<double>::infinity();
inline const double kNan = std::numeric_limits<double>::quiet_NaN();

// What code records at x.
inline void record_into(ADFun<double>& f, const std::vector<double>& x,
                        const std::function<std::vector<ADouble>(const AVector&)>& code) {
  AVector ax(x.size());
  for (std::size_t j = 0; j < x.size(); ++j) ax[j] = x[j];
  Independent(ax);
  const std::vector<ADouble> y = code(ax);
  AVector ay(y.size());
  for (std::size_t i = 0; i < y.size(); ++i) ay[i] = y[i];
  f.Dependent(ax, ay);
}
inline ADFun<double> recorded(const std::vector<double>& x,
                              const std::function<std::vector<ADouble>(const AVector&)>& code) {
  ADFun<double> f;
  record_into(f, x, code);
  return f;
}

// The sentence that is thrown; empty: nothing is.
template <class Error, class Code>
std::string sentence_of(Code&& code) {
  try {
    code();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

inline void expect_near(const DVector& got, const std::vector<double>& expected, double tolerance = 1e-12) {
  ASSERT_EQ(got.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (got[i] == expected[i]) continue;  // infinities too
    EXPECT_NEAR(got[i], expected[i], tolerance * (1 + std::abs(expected[i]))) << "entry " << i;
  }
}
