// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/build/identity.h>

#include <sys/auxv.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/system/files.h>
#include <dyntape/codegen/system/of_this_process.h>
#include <dyntape/codegen/system/process.h>
#if defined(__x86_64__) || defined(__i386__)
#include <cpuid.h>
#endif

namespace dyntape::codegen {
namespace {

using Json = nlohmann::json;

// What decides what -march=native and -mcpu=native mean, cheaply.
std::string processor() {
  std::ostringstream text;
  text << getauxval(AT_HWCAP) << ' ' << getauxval(AT_HWCAP2);
#if defined(__x86_64__) || defined(__i386__)
  unsigned a = 0, b = 0, c = 0, d = 0;
  for (unsigned leaf : {0u, 1u, 7u, 0x80000001u, 0x80000002u, 0x80000003u, 0x80000004u}) {
    if (!__get_cpuid_count(leaf, 0, &a, &b, &c, &d)) continue;
    text << ' ' << a << ' ' << (leaf == 1 ? 0u : b) << ' ' << c << ' ' << d;  // leaf 1: b names the core
  }
#elif defined(__aarch64__)
  std::string core;  // implementer and part
  std::ifstream("/sys/devices/system/cpu/cpu0/regs/identification/midr_el1") >> core;
  text << ' ' << core;
#endif
  return text.str();
}

// Changes when the file or folder does; of what is not there, a word of its own.
std::string signature(const std::string& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) return "none";
  std::ostringstream text;
  text << status.st_dev << ' ' << status.st_ino << ' ' << status.st_size << ' ' << status.st_mtim.tv_sec
       << '.' << status.st_mtim.tv_nsec << ' ' << status.st_ctim.tv_sec << '.' << status.st_ctim.tv_nsec;
  return text.str();
}

std::map<std::string, std::string> signatures(const std::set<std::string>& paths) {
  std::map<std::string, std::string> all;
  for (const std::string& path : paths) all[path] = signature(path);
  return all;
}

bool is_script(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  char head[2] = {};
  return file.read(head, 2) && head[0] == '#' && head[1] == '!';
}

// An identity, and the files and folders that it came from.
struct Answer {
  Identity identity;
  std::map<std::string, std::string> signatures;
  bool still_holds() const {
    for (const auto& [path, expected] : signatures) {
      if (signature(path) != expected) return false;
    }
    return true;
  }
};

std::string unquoted(std::string word) {
  std::erase(word, '"');
  return word;
}

// The driver's account of itself and of the flags, of which paths are left out; those of programs are collected.
Identity parsed(const std::string& account, std::set<std::string>& programs) {
  Identity identity;
  std::istringstream lines(account);
  for (std::string line; std::getline(lines, line);) {
    const bool names_version = line.find("version ") != std::string::npos && !line.starts_with("Configured");
    if (identity.version.empty() && names_version)
      identity.version = line.substr(0, line.find_last_not_of(' ') + 1);
    if (line.find("cc1") == std::string::npos) continue;
    std::istringstream words(line);
    std::string word;
    if (words >> word && unquoted(word).starts_with('/')) programs.insert(unquoted(word));
    do {
      if (word.find('/') == std::string::npos) identity.text += word + " ";
    } while (words >> word);
  }
  identity.text = identity.version + "\n" + identity.text;
  return identity;
}

// The folders that are looked through for headers.
std::set<std::string> searched_folders(const std::string& account) {
  std::set<std::string> folders;
  std::istringstream lines(account);
  bool is_listed = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("#include <...>")) {
      is_listed = true;
    } else if (line.starts_with("End of search list")) {
      is_listed = false;
    } else if (is_listed && line.starts_with(" ")) {
      folders.insert(line.substr(1));
    }
  }
  return folders;
}

// With those below them in which headers were found, wherever a new file could come before one that was found.
std::set<std::string> with_subfolders(const std::set<std::string>& folders,
                                      const std::set<std::string>& headers) {
  std::set<std::string> all = folders;
  for (const std::string& folder : folders) {
    for (const std::string& header : headers) {
      if (!header.starts_with(folder + "/")) continue;
      const std::string below = header.substr(folder.size(), header.rfind('/') - folder.size());
      for (const std::string& other : folders) all.insert(other + below);
    }
  }
  return all;
}

// Splits preprocessed text into what is compiled, and the files that it came from: # 1 "/usr/include/math.h" 1 3
std::string without_markers(const std::string& preprocessed, std::set<std::string>& headers) {
  std::string text;
  std::istringstream lines(preprocessed);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("# ")) {
      text += line + "\n";
      continue;
    }
    const std::size_t begin = line.find('"'), end = line.rfind('"');
    const std::string file = begin < end ? line.substr(begin + 1, end - begin - 1) : "";
    if (!file.empty() && file[0] != '<') headers.insert(file);
  }
  return text;
}

Outcome run(const std::string& path, const std::vector<std::string>& flags,
            const std::vector<std::string>& more, const TemporaryFolder& folder, double seconds) {
  Command command{{path}, "", folder.path()};
  for (const auto* list : {&flags, &more})
    command.arguments.insert(command.arguments.end(), list->begin(), list->end());
  Outcome outcome = run_all({command}, {1, seconds, std::size_t{8} << 30})[0];
  const bool is_answer = outcome.status == Outcome::kUnknown && !outcome.output.empty();
  if (is_answer) outcome.status = 0;
  return outcome;
}

// Adds the checksum of the headers to the identity.  A compiler that does not find them says so when it compiles.
bool ask_for_headers(const std::string& path, const std::vector<std::string>& flags,
                     const TemporaryFolder& folder, Answer& answer) {
  const std::string source = folder.path() + "/probe.c", result = folder.path() + "/probe.i";
  std::string text;
  for (const std::string& header : included_headers()) text += "#include " + header + "\n";
  write_file(source, text);
  const Outcome outcome = run(path, flags, {"-E", "-dD", "-v", "-o", result, source}, folder, 10);
  int error = 0;
  const auto preprocessed = read_file(result, error);
  if (outcome.status != 0 || !preprocessed) return false;
  std::set<std::string> headers;
  answer.identity.text += "\nheaders " + checksum(without_markers(*preprocessed, headers));
  std::erase_if(headers, [&](const std::string& file) { return file.starts_with(folder.path()); });
  answer.signatures.merge(signatures(with_subfolders(searched_folders(outcome.output), headers)));
  answer.signatures.merge(signatures(headers));
  return true;
}

// `is_complete`: the answer may be remembered.
Answer ask(const std::string& path, const std::vector<std::string>& flags, const TemporaryFolder& folder,
           bool& is_complete) {
  const Outcome outcome = run(path, flags, {"-###", "-E", "-x", "c", "/dev/null"}, folder, 60);
  if (outcome.status != 0) {
    const std::string message = "the compiler " + path + " cannot be asked what it is (exit status " +
                                std::to_string(outcome.status) + ")\n  " + to_text(flags) + "\n" +
                                outcome.output;
    const bool has_run = outcome.status > 0 && outcome.status < 126;  // and does not like the flags
    if (has_run) throw ToolError(message);
    throw Unavailable(message);
  }
  std::set<std::string> programs = {path};
  Answer answer;
  answer.identity = parsed(outcome.output, programs);
  answer.signatures = signatures(programs);
  is_complete = ask_for_headers(path, flags, folder, answer);
  return answer;
}

template <class T>
T get(const Json& json, const char* name) {
  const auto found = json.find(name);
  try {
    return found == json.end() ? T() : found->get<T>();
  } catch (const Json::exception&) {
    return T();
  }
}

// What is remembered of one compiler with one set of flags.
class Memory {
 public:
  Memory(const std::string& path, const std::vector<std::string>& flags, std::string folder)
      : is_script_(is_script(path)), folder_(std::move(folder)) {
    what_ =
        path + "\n" + processor() + "\n" + environment_variable("PATH") + "\n" + environment_variable("HOME");
    for (const std::string& flag : flags) what_ += "\n" + flag;
    name_ = "compiler-" + checksum(what_) + ".json";
  }

  std::optional<Identity> find() const {
    if (is_script_) return std::nullopt;
    auto& [mutex, known] = of_this_process<Known>();
    const std::scoped_lock lock(mutex);
    auto found = known.find(name_);
    if (found == known.end()) {
      auto read = from_file();
      if (!read) return std::nullopt;
      found = known.emplace(name_, std::move(*read)).first;
    }
    if (found->second.still_holds()) return found->second.identity;
    known.erase(found);
    return std::nullopt;
  }

  void keep(const Answer& answer) const {
    if (is_script_) return;
    auto& [mutex, known] = of_this_process<Known>();
    const std::scoped_lock lock(mutex);
    known[name_] = answer;
    if (!folder_.empty()) write(answer);
  }

 private:
  struct Known {
    std::mutex mutex;
    std::map<std::string, Answer> answers;
  };

  std::optional<Answer> from_file() const {
    constexpr std::uint64_t kLongest = 1 << 20;
    int error = 0;
    const auto text = folder_.empty() ? std::nullopt : read_file(folder_ + "/" + name_, error, kLongest);
    if (!text) return std::nullopt;
    const Json json = Json::parse(*text, nullptr, false);
    if (!json.is_object() || get<std::string>(json, "what") != what_) return std::nullopt;
    Answer answer{{get<std::string>(json, "version"), get<std::string>(json, "identity")},
                  get<std::map<std::string, std::string>>(json, "signatures")};
    const bool is_whole = json.contains("version") && json["version"].is_string() &&
                          !answer.identity.text.empty() && !answer.signatures.empty();
    return is_whole ? std::optional(std::move(answer)) : std::nullopt;
  }

  void write(const Answer& answer) const {
    const Json json = {{"what", what_},
                       {"version", answer.identity.version},
                       {"identity", answer.identity.text},
                       {"signatures", answer.signatures}};
    try {
      const TemporaryFolder folder(folder_, "build-");
      const std::string file = folder.path() + "/" + name_;
      write_file(file, json.dump(1, ' ', false, Json::error_handler_t::replace));
      (void)std::rename(file.c_str(), (folder_ + "/" + name_).c_str());
    } catch (const FileError&) {  // it is asked again next time
    }
  }

  bool is_script_;
  std::string folder_, what_, name_;
};

// Of a record that Memory has written, where it is of this processor and these flags.
std::optional<FormerCompiler> former_compiler(const std::string& file,
                                              const std::vector<std::string>& flags) {
  constexpr std::uint64_t kLongest = 1 << 20;
  int error = 0;
  const auto text = read_file(file, error, kLongest);
  const Json json = text ? Json::parse(*text, nullptr, false) : Json();
  if (!json.is_object()) return std::nullopt;
  std::istringstream what(get<std::string>(json, "what"));
  std::vector<std::string> lines;
  for (std::string line; std::getline(what, line);) lines.push_back(line);
  constexpr std::size_t kFlags = 4;  // path, processor, PATH, HOME before them
  if (lines.size() != kFlags + flags.size() || lines[1] != processor() ||
      !std::equal(flags.begin(), flags.end(), lines.begin() + kFlags))
    return std::nullopt;
  FormerCompiler former{lines[0], {get<std::string>(json, "version"), get<std::string>(json, "identity")}};
  return former.identity.text.empty() ? std::nullopt : std::optional(std::move(former));
}

}  // namespace

std::vector<FormerCompiler> former_compilers(const std::vector<std::string>& flags,
                                             const std::string& memory) {
  std::vector<FormerCompiler> all;
  if (memory.empty()) return all;
  for (const std::string& name : names_in(memory)) {
    if (!name.starts_with("compiler-")) continue;
    if (auto former = former_compiler(memory + "/" + name, flags)) all.push_back(std::move(*former));
  }
  return all;
}

const std::vector<std::string>& included_headers() {
  static const std::vector<std::string> headers = {"<math.h>", "<stddef.h>", "<stdint.h>"};
  return headers;
}

std::optional<Identity> remembered_identity(const std::string& path, const std::vector<std::string>& flags,
                                            const std::string& memory) {
  return Memory(path, flags, memory).find();
}

Identity identity_of(const std::string& path, const std::vector<std::string>& flags,
                     const std::string& memory) {
  struct Asking : std::mutex {};  // one thread asks, the others then know
  const std::scoped_lock lock(of_this_process<Asking>());
  const Memory known(path, flags, memory);
  if (auto identity = known.find()) return *identity;
  try {
    const TemporaryFolder folder(system_temporary_folder(), "dyntape-");
    bool is_complete = false;
    const Answer answer = ask(path, flags, folder, is_complete);
    if (is_complete) known.keep(answer);
    return answer.identity;
  } catch (const FileError& e) {
    throw Unavailable(e.what());
  }
}

}  // namespace dyntape::codegen
