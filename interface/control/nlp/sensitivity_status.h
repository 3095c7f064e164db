// SPDX-License-Identifier: BSD-3-Clause
//
// The validity of the derivatives of a solution (sensitivity/solution_sensitivities.h, solve/ddp_sensitivities.h):
//
//   if (s.status != SensitivityStatus::kGood) std::cerr << to_string(s.status) << "\n";
#pragma once

namespace dyntape {

enum class SensitivityStatus {
  kGood,
  kWeaklyActive,
  kDependentRows,
  kNoStrictMinimum,
  kNotASolution,
  kNotFinite
};
const char* to_string(SensitivityStatus status);

}  // namespace dyntape
