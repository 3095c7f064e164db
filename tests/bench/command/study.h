// SPDX-License-Identifier: BSD-3-Clause
//
// The studies that have a file of their own.
#pragma once

#include "commands.h"

namespace dyntape::tools {

struct SlopesOptions {
  std::string output;
  int bodies = 1024, repeats = 9;
  std::uint64_t seed = 1;
};
void run_slopes(const SlopesOptions& options);
void add_slopes(CLI::App& study);

void add_compile(CLI::App& study);

}  // namespace dyntape::tools
