// SPDX-License-Identifier: BSD-3-Clause
#include "commands.h"
#include "measuring.h"
#include "program.h"
#include "sweep.h"

#include <string_view>

namespace dyntape::tools {

constexpr const char* kAbout =
    "dyntape records robot dynamics, derives and simplifies them, prints them as C, compiles and caches "
    "that,\n"
    "and solves trajectories with the exact derivatives.\n\n"
    "A first session:\n"
    "  dyntape info config/robots/panda.urdf\n"
    "  dyntape solve config/tasks/arm_reaching.info --output out/arm_reaching\n"
    "  dyntape bench config/robots/panda.urdf --function fd-derivatives";

int command_line(int argc, char** argv) {
  open_standard_streams();
  if (argc > 1 && is_measuring(argv[1])) return run_measuring(argv);
  if (argc > 1 && std::string_view(argv[1]) == "sweep" && is_one_of_several())
    return become("dyntape-mpi", argv);
  CLI::App app{kAbout};
  app.name("dyntape");
  app.set_version_flag("--version", "dyntape " DYNTAPE_VERSION);
#define DYNTAPE_ADD(name) add_##name(app);
  DYNTAPE_COMMANDS(DYNTAPE_ADD)
#undef DYNTAPE_ADD
  add_measuring(app);

  return run(app, argc, argv);
}

}  // namespace dyntape::tools
