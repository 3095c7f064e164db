// SPDX-License-Identifier: BSD-3-Clause
//
// Which compiler, and with which flags.
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>

#include <dyntape/codegen/build/compile.h>
#include <dyntape/codegen/build/identity.h>
#include <dyntape/codegen/options/flags.h>

namespace dyntape::codegen {
namespace {

bool is_program(const std::string& path) {
  struct stat status {};
  return stat(path.c_str(), &status) == 0 && S_ISREG(status.st_mode) && access(path.c_str(), X_OK) == 0;
}

std::string program_for(const std::string& wanted) {
  if (!wanted.empty()) return in_path(wanted);
  const char* chosen = std::getenv("DYNTAPE_CC");
  if (chosen && *chosen) return in_path(chosen);
  for (const char* name : {"cc", "gcc", "clang"}) {
    if (std::string path = in_path(name); !path.empty()) return path;
  }
  return {};
}

}  // namespace

std::string in_path(const std::string& name) {
  if (name.find('/') != std::string::npos) return is_program(name) ? name : "";
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "/usr/local/bin:/usr/bin:/bin");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const std::string candidate = (folder.empty() ? "." : folder) + "/" + name;
    if (is_program(candidate)) return candidate;
  }
  return {};
}

std::string no_compiler(const std::string& wanted) {
  const char* chosen = std::getenv("DYNTAPE_CC");
  if (!wanted.empty()) return "the compiler \"" + wanted + "\" does not exist";
  if (chosen && *chosen) return "the compiler \"" + std::string(chosen) + "\" of DYNTAPE_CC does not exist";
  return "no C compiler (cc, gcc or clang) is found";
}

namespace {

// Flags for this processor.  On aarch64 a user's own -mcpu or -march replaces them, since cross compilers do not know
// "native".
std::vector<std::string> processor_flags([[maybe_unused]] const std::vector<std::string>& user_flags) {
#if defined(__aarch64__)
  const bool is_named = std::any_of(user_flags.begin(), user_flags.end(), [](const std::string& flag) {
    return flag.starts_with("-mcpu=") || flag.starts_with("-march=");
  });
  if (is_named) return {};
  return {"-mcpu=native"};
#else
  return {"-march=native"};
#endif
}

// All but its identity; without a path if there is none.
Compiler chosen_compiler(const std::string& wanted, const std::vector<std::string>& user_flags) {
  Compiler compiler;
  compiler.path = program_for(wanted);
  compiler.flags = {"-std=c99"};
  const std::vector<std::string> processor = processor_flags(user_flags),
                                 always = {"-fPIC", "-fvisibility=hidden", "-pipe"};
  for (const auto* more : {&processor, &always, &user_flags, &contract_flags()})
    compiler.flags.insert(compiler.flags.end(), more->begin(), more->end());
  compiler.chooses_level = std::none_of(user_flags.begin(), user_flags.end(),
                                        [](const std::string& flag) { return flag.starts_with("-O"); });
  return compiler;
}

void identify(Compiler& compiler, const Identity& identity) {
  compiler.version = identity.version;
  compiler.identity = identity.text;
#if defined(__aarch64__)
  // A constant within 1 MB, behind its function, is loaded by one instruction instead of two.  Neighbours in memory are loaded and stored
  // in pairs.  Kernels' parts know which registers their callees leave alone.  clang does not have the flags.
  if (identity.version.starts_with("gcc "))
    compiler.flags.insert(compiler.flags.end(), {"-mpc-relative-literal-loads", "-fpeephole2", "-fipa-ra"});
#endif
}

}  // namespace

std::optional<Compiler> find_compiler(const std::string& wanted, const std::vector<std::string>& user_flags,
                                      const std::string& memory) {
  Compiler compiler = chosen_compiler(wanted, user_flags);
  if (compiler.path.empty()) return std::nullopt;
  identify(compiler, identity_of(compiler.path, compiler.flags, memory));
  return compiler;
}

std::vector<Compiler> gone_compilers(const std::string& wanted, const std::vector<std::string>& user_flags,
                                     const std::string& memory) {
  const char* chosen = std::getenv("DYNTAPE_CC");
  const std::string name = !wanted.empty() ? wanted : chosen ? chosen : "";
  const Compiler compiler = chosen_compiler(wanted, user_flags);
  std::vector<Compiler> all;
  for (const FormerCompiler& former : former_compilers(compiler.flags, memory)) {
    if (!name.empty() && former.path != name && !former.path.ends_with("/" + name)) continue;
    all.push_back(compiler);
    all.back().path = former.path;
    identify(all.back(), former.identity);
  }
  return all;
}

bool is_known_compiler(const std::string& wanted, const std::vector<std::string>& user_flags,
                       const std::string& memory) {
  const Compiler compiler = chosen_compiler(wanted, user_flags);
  return compiler.path.empty() || remembered_identity(compiler.path, compiler.flags, memory).has_value();
}

}  // namespace dyntape::codegen
