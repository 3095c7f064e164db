// SPDX-License-Identifier: BSD-3-Clause
//
// Which compiler, and what it is: path, version, and what its flags resolve to on this processor.
#include <sys/auxv.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <sstream>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/compile.h>
#include <dyntape/codegen/files.h>
#include <dyntape/codegen/flags.h>
#include <dyntape/codegen/process.h>
#if defined(__x86_64__) || defined(__i386__)
#include <cpuid.h>
#endif

namespace dyntape::codegen {
namespace {

struct Identity {
  std::string version, text;
};

bool is_program(const std::string& path) {
  struct stat status {};
  return stat(path.c_str(), &status) == 0 && S_ISREG(status.st_mode) && access(path.c_str(), X_OK) == 0;
}

// The full path of a name, or "".
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

std::string program_for(const std::string& wanted) {
  if (!wanted.empty()) return in_path(wanted);
  const char* chosen = std::getenv("DYNTAPE_CC");
  if (chosen && *chosen) return in_path(chosen);
  for (const char* name : {"cc", "gcc", "clang"}) {
    if (std::string path = in_path(name); !path.empty()) return path;
  }
  return {};
}

// What decides what -march=native means, cheaply.
std::string processor() {
  std::ostringstream text;
  text << getauxval(AT_HWCAP) << ' ' << getauxval(AT_HWCAP2);
#if defined(__x86_64__) || defined(__i386__)
  unsigned a = 0, b = 0, c = 0, d = 0;
  for (unsigned leaf : {0u, 1u, 7u, 0x80000001u, 0x80000002u, 0x80000003u, 0x80000004u}) {
    if (!__get_cpuid_count(leaf, 0, &a, &b, &c, &d)) continue;
    text << ' ' << a << ' ' << (leaf == 1 ? 0u : b) << ' ' << c << ' ' << d;  // leaf 1: b names the core
  }
#endif
  return text.str();
}

// The driver's account of itself and of the flags, of which paths are left out.
Identity ask(const std::string& path, const std::vector<std::string>& flags) {
  const TemporaryFolder folder(system_temporary_folder(), "dyntape-");
  Command command{{path}, folder.path() + "/log", folder.path()};
  command.arguments.insert(command.arguments.end(), flags.begin(), flags.end());
  for (const char* more : {"-###", "-E", "-x", "c", "/dev/null"}) command.arguments.push_back(more);
  const Outcome outcome = run_all({command}, {1, 60, std::size_t{8} << 30})[0];
  if (outcome.status != 0) {
    throw ToolError("the compiler cannot be asked what it is (exit status " + std::to_string(outcome.status) +
                    ")\n  " + to_text(command.arguments) + "\n" + outcome.output);
  }
  Identity identity;
  std::istringstream lines(outcome.output);
  for (std::string line; std::getline(lines, line);) {
    const bool names_version = line.find("version ") != std::string::npos && !line.starts_with("Configured");
    if (identity.version.empty() && names_version)
      identity.version = line.substr(0, line.find_last_not_of(' ') + 1);
    if (line.find("cc1") == std::string::npos) continue;
    std::istringstream words(line);
    for (std::string word; words >> word;) {
      if (word.find('/') == std::string::npos) identity.text += word + " ";
    }
  }
  return identity;
}

// Asking costs tens of milliseconds, so the answer is kept: in the process, and in a folder under a name that
// changes with the program, its flags and the processor.
class Identities {
 public:
  Identities(const std::string& path, const std::vector<std::string>& flags, const std::string& memory)
      : path_(path), flags_(flags), memory_(memory) {
    struct stat status {};
    stat(path.c_str(), &status);
    std::ostringstream what;
    what << path << ' ' << status.st_dev << ' ' << status.st_ino << ' ' << status.st_size << ' '
         << status.st_mtim.tv_sec << '.' << status.st_mtim.tv_nsec << ' ' << processor();
    for (const std::string& flag : flags) what << '\n' << flag;
    what_ = what.str();
    name_ = "compiler-" + checksum(what_) + ".json";
  }

  std::optional<Identity> remembered() const {
    const std::scoped_lock lock(mutex());
    return look_up();
  }

  Identity get() const {
    const std::scoped_lock lock(mutex());
    if (auto identity = look_up()) return *identity;
    const Identity identity = ask(path_, flags_);
    if (!memory_.empty()) keep(identity);
    return known()[name_] = identity;
  }

 private:
  static std::mutex& mutex() {
    static std::mutex mutex;
    return mutex;
  }
  static std::map<std::string, Identity>& known() {
    static std::map<std::string, Identity> known;
    return known;
  }

  std::optional<Identity> look_up() const {
    if (const auto found = known().find(name_); found != known().end()) return found->second;
    int error = 0;
    const auto text = memory_.empty() ? std::nullopt : read_file(memory_ + "/" + name_, error);
    if (!text) return std::nullopt;
    const auto json = nlohmann::json::parse(*text, nullptr, false);
    if (!json.is_object() || json.value("what", "") != what_) return std::nullopt;
    return known()[name_] = {json.value("version", ""), json.value("identity", "")};
  }

  void keep(const Identity& identity) const {
    const nlohmann::json json = {{"what", what_}, {"version", identity.version}, {"identity", identity.text}};
    try {
      TemporaryFolder folder(memory_, "build-");
      const std::string file = folder.path() + "/" + name_;
      write_file(file, json.dump(1));
      (void)std::rename(file.c_str(), (memory_ + "/" + name_).c_str());
    } catch (const FileError&) {  // it is asked again next time
    }
  }

  const std::string& path_;
  const std::vector<std::string>& flags_;
  const std::string& memory_;
  std::string what_, name_;
};

}  // namespace

std::string no_compiler(const std::string& wanted) {
  const char* chosen = std::getenv("DYNTAPE_CC");
  if (!wanted.empty()) return "the compiler \"" + wanted + "\" does not exist";
  if (chosen && *chosen) return "the compiler \"" + std::string(chosen) + "\" of DYNTAPE_CC does not exist";
  return "no C compiler (cc, gcc or clang) is found";
}

namespace {

// All but its identity; without a path if there is none.
Compiler chosen_compiler(const std::string& wanted, const std::vector<std::string>& user_flags) {
  Compiler compiler;
  compiler.path = program_for(wanted);
  compiler.flags = {"-std=c99", "-march=native", "-fPIC", "-fvisibility=hidden", "-pipe"};
  for (const auto* more : {&user_flags, &contract_flags()})
    compiler.flags.insert(compiler.flags.end(), more->begin(), more->end());
  compiler.chooses_level = std::none_of(user_flags.begin(), user_flags.end(),
                                        [](const std::string& flag) { return flag.starts_with("-O"); });
  return compiler;
}

}  // namespace

std::optional<Compiler> find_compiler(const std::string& wanted, const std::vector<std::string>& user_flags,
                                      const std::string& memory) {
  Compiler compiler = chosen_compiler(wanted, user_flags);
  if (compiler.path.empty()) return std::nullopt;
  const Identity identity = Identities(compiler.path, compiler.flags, memory).get();
  compiler.version = identity.version;
  compiler.identity = identity.version + "\n" + identity.text;
  return compiler;
}

bool is_known_compiler(const std::string& wanted, const std::vector<std::string>& user_flags,
                       const std::string& memory) {
  const Compiler compiler = chosen_compiler(wanted, user_flags);
  return compiler.path.empty() || Identities(compiler.path, compiler.flags, memory).remembered();
}

}  // namespace dyntape::codegen
