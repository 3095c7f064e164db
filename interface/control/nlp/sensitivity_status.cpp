// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/nlp/sensitivity_status.h>

namespace dyntape {

const char* to_string(SensitivityStatus status) {
  switch (status) {
    case SensitivityStatus::kGood:
      return "good";
    case SensitivityStatus::kWeaklyActive:
      return "weakly active";
    case SensitivityStatus::kDependentRows:
      return "dependent rows";
    case SensitivityStatus::kNoStrictMinimum:
      return "no strict minimum";
    case SensitivityStatus::kNotASolution:
      return "not a solution";
    case SensitivityStatus::kNotFinite:
      return "not finite";
  }
  return "";
}

}  // namespace dyntape
