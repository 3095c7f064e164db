// SPDX-License-Identifier: BSD-3-Clause
//
// Compiled for each level of the processor that the library has (interface/CMakeLists.txt).
#include <dyntape/interface/robot/packs/packed_path.h>

namespace dyntape::detail {

std::unique_ptr<PackedPath> best_packed_path(const dynamics::Model<double>& model,
                                             const RobotFunction& function) {
  return std::make_unique<PathOf<Pack<double, DYNTAPE_REGISTER == 64 ? 8 : 4>>>(model, function);
}

}  // namespace dyntape::detail
