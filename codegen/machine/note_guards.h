// SPDX-License-Identifier: BSD-3-Clause
//
// The function by which machine code reports violated guards.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace dyntape::codegen {

// Sets status[l] to 1 + the first guard whose condition differs from the recorded one in lane l; 0: none does.
inline void note_guards(const double* conditions, const std::vector<std::uint8_t>* guards,
                        std::uint32_t* status, std::size_t lanes) {
  for (std::size_t l = 0; l < lanes; ++l) status[l] = 0;
  for (std::size_t k = guards->size(); k-- > 0;) {
    for (std::size_t l = 0; l < lanes; ++l) {
      const bool was_taken = conditions[k * lanes + l] != 0;
      if (was_taken != ((*guards)[k] != 0)) status[l] = static_cast<std::uint32_t>(k + 1);
    }
  }
}

}  // namespace dyntape::codegen
