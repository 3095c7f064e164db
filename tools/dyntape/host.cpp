// SPDX-License-Identifier: BSD-3-Clause
#include "host.h"

#include <fstream>

#include <dyntape/codegen/build/compile.h>

namespace dyntape::tools {

std::string processor_name() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

std::string compiler_name() {
  const auto found = codegen::find_compiler("", {});
  return found ? found->version : "none";
}

}  // namespace dyntape::tools
