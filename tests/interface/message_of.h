// SPDX-License-Identifier: BSD-3-Clause
//
// What something says when it refuses: message_of<ArgumentError>([&] { act(); }).
#pragma once

#include <string>

namespace dyntape {

template <class E, class F>
std::string message_of(F f) {
  try {
    f();
  } catch (const E& e) {
    return e.what();
  }
  return "nothing thrown";
}

}  // namespace dyntape
