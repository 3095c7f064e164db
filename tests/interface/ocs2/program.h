// SPDX-License-Identifier: BSD-3-Clause
//
// What the programs share: the alias by which they move over, and a folder for their models.
#pragma once

#include <gtest/gtest.h>

#include <dyntape/interface/ocs2/ocs2.h>

#include "interface/message_of.h"
#include "interface/temporary_cache.h"

namespace ocs2 = dyntape::ocs2;
namespace CppAD = dyntape::ocs2::cppad_names;

class Program : public ::testing::Test {
 protected:
  const std::string& folder() const { return cache_.path(); }

 private:
  dyntape::TemporaryCache cache_;
};

// Every entry within a share of the largest.
inline void expect_near(const ocs2::matrix_t& got, const ocs2::matrix_t& expected, double share = 1e-14) {
  ASSERT_EQ(got.rows(), expected.rows());
  ASSERT_EQ(got.cols(), expected.cols());
  const double scale = expected.size() ? 1 + expected.cwiseAbs().maxCoeff() : 1;
  EXPECT_LE((got - expected).cwiseAbs().sum(),
            share * scale * static_cast<double>(std::max<Eigen::Index>(1, got.size())))
      << "got\n"
      << got << "\nexpected\n"
      << expected;
}
