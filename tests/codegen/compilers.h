// SPDX-License-Identifier: BSD-3-Clause
//
// Compilers that generated text must please, and a folder of one's own for a test.
#pragma once

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <string>
#include <vector>

#include <dyntape/codegen/build/compile.h>
#include <dyntape/codegen/machine/machine_code.h>
#include <dyntape/codegen/system/files.h>
#include <dyntape/codegen/system/process.h>

namespace dyntape::testing {

// How functions are evaluated where none is compiled.
inline Route without_compiler() {
  return codegen::MachineCode::is_possible() ? Route::kMachineCode : Route::kInterpreter;
}

// The compiler's flag for a processor older than this one.
#if defined(__aarch64__)
inline constexpr const char* kOldProcessor = "-mcpu=cortex-a53";
#else
inline constexpr const char* kOldProcessor = "-march=x86-64";
#endif

// A folder that is removed when the test ends.
class Scratch {
 public:
  Scratch() : folder_(codegen::system_temporary_folder(), "dyntape-test-") {}
  std::string operator/(const std::string& name) const { return folder_.path() + "/" + name; }
  const std::string& path() const { return folder_.path(); }

 private:
  codegen::TemporaryFolder folder_;
};

// The words that run a program which a compiler of PATH has made.  If the processor is emulated, the emulator is the value of
// DYNTAPE_TEST_EMULATOR (tests/full/processors/aarch64_suite.sh).
inline std::vector<std::string> run_words(const std::string& made) {
  const char* emulator = std::getenv("DYNTAPE_TEST_EMULATOR");
  return emulator ? std::vector<std::string>{emulator, made} : std::vector<std::string>{made};
}

// Runs a command; its output, with the exit status in the first line if it is not 0.
inline std::string output_of(const std::vector<std::string>& arguments, const Scratch& scratch) {
  const auto outcome =
      codegen::run_all({{arguments, scratch / "log", scratch.path()}}, {1, 120, std::size_t{8} << 30})[0];
  return (outcome.status ? "status " + std::to_string(outcome.status) + "\n" : "") + outcome.output;
}

// A program that behaves as a compiler would that fails in some way; asked what it is, it answers.
inline std::string fake_compiler(const Scratch& scratch, const std::string& behaviour) {
  const std::string path = scratch / "fake-cc";
  codegen::write_file(
      path, "#!/bin/sh\ncase \"$*\" in *-###*) echo 'fake version 1'; exit 0;; *' -E '*) exit 1;; esac\n" +
                behaviour + "\n");
  chmod(path.c_str(), 0700);
  return path;
}

// What a child process finds, as its exit status; 99 if it throws, 128 and more if a signal ends it.
template <class Work>
int in_child(Work&& work) {
  const pid_t child = fork();
  if (child == 0) {
    try {
      _exit(static_cast<int>(work()));
    } catch (const std::exception& e) {
      std::fprintf(stderr, "%s\n", e.what());
      _exit(99);
    }
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

// Compiles texts in every language and with every compiler there is, warnings being errors.
inline void expect_compiles_cleanly(const std::vector<std::string>& texts,
                                    const std::vector<std::string>& more = {}) {
  const Scratch scratch;
  std::vector<codegen::Command> commands;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    const std::string source = scratch / (std::to_string(i) + ".c");
    codegen::write_file(source, texts[i]);
    for (const auto& [name, standard] :
         {std::pair("gcc", "-std=c99"), std::pair("g++", "-std=c++11"), std::pair("clang", "-std=c99"),
          std::pair("clang++", "-std=c++17")}) {
      const std::string compiler = codegen::in_path(name);
      if (compiler.empty()) {
        std::printf("%s is not installed: not tried\n", name);
        continue;
      }
      const std::string log = scratch / ("log" + std::to_string(commands.size()));
      const char* language = std::string(name).ends_with("++") ? "c++" : "c";
      commands.push_back(
          {{compiler, standard, "-x", language, "-Wall", "-Wextra", "-Werror", "-pedantic", "-O1", "-S"},
           log,
           scratch.path()});
      auto& arguments = commands.back().arguments;
      arguments.insert(arguments.end(), more.begin(), more.end());
      for (const std::string& last : {std::string("-o"), log + ".s", source}) arguments.push_back(last);
    }
  }
  const auto outcomes = codegen::run_all(commands, {2, 120, std::size_t{8} << 30});
  for (std::size_t i = 0; i < commands.size(); ++i) {
    EXPECT_EQ(outcomes[i].status, 0) << codegen::to_text(commands[i].arguments);
    EXPECT_EQ(outcomes[i].output, "");
  }
}

}  // namespace dyntape::testing
