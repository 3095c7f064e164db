// SPDX-License-Identifier: BSD-3-Clause
//
// The limits that an excitation keeps, one entry a joint, margin taken off.  Internal.
#pragma once

#include <dyntape/interface/identification/excitation.h>

namespace dyntape::detail {

struct ExcitationLimits {
  Eigen::VectorXd middle;  // of the range of positions (nv)
  Eigen::MatrixXd reach;   // (nv x 3): distance of position from `middle`, |velocity|, |acceleration|
};

ExcitationLimits excitation_limits(const dynamics::Model<double>& model, const ExcitationOptions& options);

}  // namespace dyntape::detail
