// SPDX-License-Identifier: BSD-3-Clause
//
// Commands that measure live in a program of their own, `dyntape-bench` (tests/bench/command), which takes every number
// type along: it is looked for beside `dyntape`, then in PATH.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace dyntape::tools {

bool is_measuring(const std::string& command);
// Lists them in the help.
void add_measuring(CLI::App& app);
// Becomes dyntape-bench.  Returns only if there is none: the exit status.
int run_measuring(char** argv);
// Becomes a program that is beside this one, or in PATH.
int become(const char* program, char** argv);

}  // namespace dyntape::tools
