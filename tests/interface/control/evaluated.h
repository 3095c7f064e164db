// SPDX-License-Identifier: BSD-3-Clause
//
// All that a nonlinear program gives at a point, with multipliers of its own.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include <dyntape/interface/control/nlp/nlp.h>

namespace dyntape {

struct Evaluated {
  double cost = 0;
  std::vector<double> gradient, g, jacobian, hessian;
  bool operator==(const Evaluated&) const = default;
};

inline Evaluated evaluated(Nlp& nlp, const std::vector<double>& x) {
  const NlpShape& shape = nlp.shape();
  Evaluated all{0, std::vector<double>(shape.n()), std::vector<double>(shape.m()),
                std::vector<double>(shape.jacobian.nnz()), std::vector<double>(shape.hessian.nnz())};
  std::vector<double> lambda(shape.m());
  for (std::size_t j = 0; j < lambda.size(); ++j) lambda[j] = std::cos(double(j));
  EXPECT_TRUE(nlp.objective(x.data(), all.cost) && nlp.gradient(x.data(), all.gradient.data()));
  EXPECT_TRUE(nlp.constraints(x.data(), all.g.data()) && nlp.jacobian(x.data(), all.jacobian.data()));
  EXPECT_TRUE(nlp.hessian(x.data(), 0.7, lambda.data(), all.hessian.data()));
  return all;
}

}  // namespace dyntape
