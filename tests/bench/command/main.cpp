// SPDX-License-Identifier: BSD-3-Clause
#include "bench_commands.h"
#include "program.h"

int main(int argc, char** argv) {
  using namespace dyntape::tools;
  CLI::App app{"dyntape-bench measures dyntape, beside peers and against 113 bits."};
  app.name("dyntape");
  app.set_version_flag("--version", "dyntape-bench " DYNTAPE_VERSION);
  add_advise(app);
  add_bench(app);
  add_study(app);
  add_verify(app);
  return run(app, argc, argv);
}
