// SPDX-License-Identifier: BSD-3-Clause
//
// The values of the problems of a batch (ddp_batch.h), one column per problem.  Empty ones are the problem's own:
//
//   DdpBatchValues values{.starts = starts, .parameters = parameters};
#pragma once

#include <Eigen/Core>

namespace dyntape {

struct DdpBatchValues {
  Eigen::MatrixXd starts = {};      // (n_x x count)
  Eigen::MatrixXd parameters = {};  // (n_p x count)
  Eigen::MatrixXd controls = {};    // (n_u N x count)
};

}  // namespace dyntape
