// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>

namespace dyntape::bench {

// Bytes of machine code (.text) of a shared library; 0 for what is none.
std::size_t text_bytes(const std::string& path);

}  // namespace dyntape::bench
