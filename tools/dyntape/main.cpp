// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>

#include <dyntape/autodiff/error.h>

#include "commands.h"

int main(int argc, char** argv) {
  using namespace dyntape::tools;
  CLI::App app{
      "dyntape records robot dynamics, derives and simplifies them, prints them as C, compiles and caches "
      "that,\n"
      "and solves trajectories with the exact derivatives.\n\n"
      "A first session:\n"
      "  dyntape info config/robots/panda.urdf\n"
      "  dyntape solve config/tasks/arm_reaching.info --output out/arm_reaching\n"
      "  dyntape bench config/robots/panda.urdf --function fd-derivatives"};
  app.name("dyntape");
  app.set_version_flag("--version", "dyntape " DYNTAPE_VERSION);
  app.require_subcommand(1);
  app.failure_message(CLI::FailureMessage::simple);
  add_info(app);
  add_eval(app);
  add_generate(app);
  add_bench(app);
  add_solve(app);
  add_study(app);
  add_identify(app);
  add_check_config(app);
  add_cache(app);
  add_doctor(app);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    const int status = app.exit(e);
    return status ? 2 : 0;  // 2: the command line itself is wrong
  } catch (const Failure& failure) {
    return failure.status;
  } catch (const dyntape::Error& e) {
    std::cerr << "dyntape: " << e.what() << "\n";
    return 1;
  } catch (const std::exception& e) {
    std::cerr << "dyntape: unexpected failure: " << e.what() << "\n";
    return 1;
  }
  return 0;
}
