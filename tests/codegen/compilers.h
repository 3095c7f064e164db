// SPDX-License-Identifier: BSD-3-Clause
//
// Compilers that generated text must please, and a folder of one's own for a test.
#pragma once

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <string>
#include <vector>

#include <dyntape/codegen/files.h>
#include <dyntape/codegen/process.h>

namespace dyntape::testing {

// A folder that is removed when the test ends.
class Scratch {
 public:
  Scratch() : folder_(codegen::system_temporary_folder(), "dyntape-test-") {}
  std::string operator/(const std::string& name) const { return folder_.path() + "/" + name; }
  const std::string& path() const { return folder_.path(); }

 private:
  codegen::TemporaryFolder folder_;
};

inline std::string program(const std::string& name) {
  const std::string path = "/usr/bin/" + name;
  return access(path.c_str(), X_OK) == 0 ? path : "";
}

// Runs a command; its output, with the exit status in the first line if it is not 0.
inline std::string output_of(const std::vector<std::string>& arguments, const Scratch& scratch) {
  const auto outcome =
      codegen::run_all({{arguments, scratch / "log", scratch.path()}}, {1, 120, std::size_t{8} << 30})[0];
  return (outcome.status ? "status " + std::to_string(outcome.status) + "\n" : "") + outcome.output;
}

// Compiles text in every language and with every compiler there is, warnings being errors.
inline void expect_compiles_cleanly(const std::string& text, const std::vector<std::string>& more = {}) {
  const Scratch scratch;
  codegen::write_file(scratch / "a.c", text);
  for (const char* name : {"gcc", "g++", "clang", "clang++"}) {
    const std::string compiler = program(name);
    if (compiler.empty()) {
      std::printf("%s is not installed: not tried\n", name);
      continue;
    }
    const bool is_cpp = std::string(name).ends_with("++");
    for (const char* standard : is_cpp ? std::vector{"-std=c++11", "-std=c++17"} : std::vector{"-std=c99"}) {
      std::vector<std::string> command = {
          compiler, standard, "-x", is_cpp ? "c++" : "c", "-Wall",        "-Wextra", "-Werror", "-pedantic",
          "-O1",    "-c",     "-o", scratch / "a.o",      scratch / "a.c"};
      command.insert(command.end() - 3, more.begin(), more.end());
      EXPECT_EQ(output_of(command, scratch), "") << name << " " << standard;
    }
  }
}

}  // namespace dyntape::testing
