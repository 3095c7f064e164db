// SPDX-License-Identifier: BSD-3-Clause
//
// What the problems of a batch (ddp_batch.h) differ by, a column a problem; what is left out is the problem's own:
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
