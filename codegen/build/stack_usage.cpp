// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/build/stack_usage.h>

#include <algorithm>
#include <map>
#include <set>
#include <sstream>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/options/flags.h>
#include <dyntape/codegen/system/files.h>
#include <dyntape/codegen/system/process.h>

namespace dyntape::codegen {
namespace {

struct CallGraph {
  std::map<std::string, std::size_t> bytes;  // of the functions that are in the text
  std::map<std::string, std::vector<std::string>> calls;
};

// The text between the quotes that follow `key` in a line; "" if it is not there.
std::string quoted(const std::string& line, const std::string& key) {
  const std::size_t at = line.find(key + ": \"");
  if (at == std::string::npos) return {};
  const std::size_t begin = at + key.size() + 3;
  return line.substr(begin, line.find('"', begin) - begin);
}

CallGraph parse(const std::string& text) {
  CallGraph graph;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("node:")) {
      const std::string label = quoted(line, "label");
      const std::size_t end = label.find(" bytes (");
      const std::size_t begin = end == std::string::npos ? end : label.rfind("\\n", end);
      if (begin != std::string::npos)
        graph.bytes[quoted(line, "title")] = std::stoul(label.substr(begin + 2, end - begin - 2));
    } else if (line.starts_with("edge:")) {
      graph.calls[quoted(line, "sourcename")].push_back(quoted(line, "targetname"));
    }
  }
  return graph;
}

// Deepest chain below a function.  Generated functions do not call themselves; calls nest a few levels.
std::size_t deepest(const CallGraph& graph, const std::string& function,
                    std::map<std::string, std::size_t>& known, std::set<std::string>& beyond) {
  const auto own = graph.bytes.find(function);
  if (own == graph.bytes.end()) return beyond.insert(function), 0;
  if (const auto found = known.find(function); found != known.end()) return found->second;
  std::size_t below = 0;
  if (const auto calls = graph.calls.find(function); calls != graph.calls.end()) {
    for (const std::string& callee : calls->second)
      below = std::max(below, deepest(graph, callee, known, beyond));
  }
  return known[function] = own->second + below;
}

std::string run(const std::vector<std::string>& words, const TemporaryFolder& folder) {
  std::vector<std::string> arguments = {"/usr/bin/env"};
  arguments.insert(arguments.end(), words.begin(), words.end());
  const Outcome outcome =
      run_all({{arguments, folder.path() + "/log", folder.path()}}, {1, 600, std::size_t{8} << 30})[0];
  if (outcome.status != 0)
    throw ToolError("stack use: exit status " + std::to_string(outcome.status) + " of " + to_text(words) +
                    "\n" + outcome.output);
  return outcome.output;
}

std::string version_of(const std::string& compiler, const TemporaryFolder& folder) {
  std::string version = run({compiler, "-dumpfullversion"}, folder);
  version.erase(version.find_last_not_of("\n") + 1);
  return version;
}

}  // namespace

StackUse read_call_graph(const std::string& call_graph, const std::vector<std::string>& entries) {
  const CallGraph graph = parse(call_graph);
  StackUse use;
  std::map<std::string, std::size_t> known;
  std::set<std::string> beyond;
  for (const std::string& entry : entries) use.bytes.push_back(deepest(graph, entry, known, beyond));
  use.beyond.assign(beyond.begin(), beyond.end());
  for (const std::string& entry : entries) {
    if (beyond.contains(entry)) throw ToolError("stack use: the compiler says nothing of " + entry);
  }
  return use;
}

StackUse measure_stack(const EmbeddedSource& embedded, std::vector<std::string> compiler) {
  const TemporaryFolder folder(system_temporary_folder(), "dyntape-");
  const bool has_level = std::any_of(compiler.begin() + 1, compiler.end(),
                                     [](const std::string& flag) { return flag.starts_with("-O"); });
  if (!has_level) compiler.push_back("-O2");
  const std::string version = version_of(compiler[0], folder);
  std::vector<std::string> words = compiler;
  words.insert(words.end(), contract_flags().begin(), contract_flags().end());
  const std::string stem = folder.path() + "/" + embedded.source.name;
  write_file(stem + ".c", embedded.source.text);
  words.insert(words.end(), {"-fcallgraph-info=su", "-c", "-o", stem + ".o", stem + ".c"});
  run(words, folder);
  int error = 0;
  StackUse use = read_call_graph(read_file(stem + ".ci", error).value_or(""), embedded.entries);
  use.with = compiler[0] + " " + version;
  for (std::size_t i = 1; i < compiler.size(); ++i) use.with += " " + compiler[i];
  return use;
}

}  // namespace dyntape::codegen
