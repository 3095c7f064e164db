// SPDX-License-Identifier: BSD-3-Clause
#include "program.h"

int main(int argc, char** argv) { return dyntape::tools::command_line(argc, argv); }
