// SPDX-License-Identifier: BSD-3-Clause
#include "measuring.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <utility>

namespace dyntape::tools {
namespace {

constexpr std::array<std::pair<const char*, const char*>, 4> kCommands = {
    {{"advise", "measure which options solve a task fastest on this machine, for a required accuracy"},
     {"bench", "measure a function of a robot by every route, and compare with Pinocchio"},
     {"study", "studies of accuracy and cost: tables and pictures of errors and times"},
     {"verify", "check a robot numerically: derivatives by all routes, identities, inertia, limits"}}};

}  // namespace

bool is_measuring(const std::string& command) {
  return std::any_of(kCommands.begin(), kCommands.end(), [&](const auto& c) { return command == c.first; });
}

void add_measuring(CLI::App& app) {
  for (const auto& [name, what] : kCommands) app.add_subcommand(name, what);
}

int run_measuring(char** argv) { return become("dyntape-bench", argv); }

int become(const char* program, char** argv) {
  std::error_code none;
  const std::filesystem::path beside =
      std::filesystem::read_symlink("/proc/self/exe", none).replace_filename(program);
  execv(beside.c_str(), argv);
  if (errno == ENOENT) execvp(program, argv);
  std::cerr << "dyntape: " << argv[1] << " here is a command of " << program << ", which is not there ("
            << std::strerror(errno) << "); tools/build " << program << " makes it\n";
  return 1;
}

}  // namespace dyntape::tools
