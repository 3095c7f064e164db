// SPDX-License-Identifier: BSD-3-Clause
//
// `dyntape sweep`, alone or as one of several processes (tools/mpi).
#pragma once

#include <CLI/CLI.hpp>

#include <dyntape/interface/run/sweep/sweep_workers.h>

namespace dyntape::tools {

// Who else shares the work: none, peers of the one that writes, or the one that writes.
struct SweepSide {
  SweepPeers* peers = nullptr;
  SweepCoordinator* master = nullptr;
};

void add_sweep_command(CLI::App& app, const SweepSide& side);

// Whether mpirun has started this process beside others.
bool is_one_of_several();

}  // namespace dyntape::tools
