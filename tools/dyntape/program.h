// SPDX-License-Identifier: BSD-3-Clause
//
// What `dyntape` and `dyntape-bench` do alike: one sentence on stderr for whatever goes wrong, and the exit status.
#pragma once

#include <CLI/CLI.hpp>

namespace dyntape::tools {

// A program that is started without some of them would write what it prints into the first files that it opens.  Before any is.
void open_standard_streams();

// Parses the command line and runs the command that it names.  0: done; 1: failed; 2: the command line is wrong.
int run(CLI::App& app, int argc, char** argv);

// All of `dyntape`: what main() does, and the Python package.
int command_line(int argc, char** argv);

}  // namespace dyntape::tools
