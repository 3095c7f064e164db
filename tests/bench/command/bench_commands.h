// SPDX-License-Identifier: BSD-3-Clause
//
// The commands of `dyntape-bench`, which `dyntape` runs as if they were its own.
#pragma once

#include "commands.h"

namespace dyntape::tools {

void add_advise(CLI::App& app);
void add_bench(CLI::App& app);
void add_study(CLI::App& app);
void add_verify(CLI::App& app);

}  // namespace dyntape::tools
