// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape cache: what is stored, whether it is sound, and how to be rid of it.
#include <algorithm>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/store/cache.h>
#include <dyntape/interface/io/table.h>

#include "commands.h"
#include "words.h"

namespace dyntape::tools {
namespace {

using codegen::Cache;
using codegen::Entry;
using codegen::Fault;
using codegen::Left;
using codegen::LeftOver;

struct CacheOptions {
  std::string folder;
  bool json = false;
};

// A folder that is named has to be there: to look at a store does not make it.
Cache open(const CacheOptions& options) {
  const std::string& folder = options.folder;
  if (!folder.empty() && !std::filesystem::exists(folder))
    throw FileError(folder + ": there is no such folder");
  auto cache = Cache::open(folder);
  if (!cache)
    throw FileError("no cache: " + (folder.empty() ? Cache::usual_folder() : folder) + " cannot be used");
  return *cache;
}

std::string digest(const Entry& entry) { return std::filesystem::path(entry.folder).filename().string(); }

std::string day(std::int64_t seconds) {
  const auto time = static_cast<std::time_t>(seconds);
  char text[32];
  std::tm local{};
  localtime_r(&time, &local);
  return std::string(text, std::strftime(text, sizeof text, "%Y-%m-%d %H:%M", &local));
}

const char* to_string(Left state) {
  return state == Left::kInUse ? "at work" : state == Left::kKept ? "failed, source kept" : "interrupted";
}

// "2 builds, 130 KiB: " and each with what became of it.
void list_builds(const std::vector<LeftOver>& builds) {
  if (builds.empty()) return;
  std::uint64_t bytes = 0;
  io::TextTable table({{"build"}, {"state"}, {"size", "KiB", io::Align::kRight}, {"changed"}});
  for (const LeftOver& b : builds) {
    bytes += b.bytes;
    table.append({b.folder, to_string(b.state), io::with_groups(b.bytes / 1024), day(b.modified)});
  }
  std::cout << "\n"
            << table.text() << "\n"
            << builds.size() << (builds.size() == 1 ? " build, " : " builds, ")
            << io::with_groups(bytes / 1024) << " KiB: `dyntape cache clear` removes all "
            << "but those at work\n";
}

nlohmann::json to_json(const std::vector<Entry>& entries) {
  nlohmann::json rows = nlohmann::json::array();
  for (const Entry& e : entries) {
    rows.push_back({{"key", digest(e)},
                    {"name", e.manifest.name},
                    {"order", e.manifest.order},
                    {"compiler", e.manifest.compiler},
                    {"bytes", e.bytes},
                    {"last_used", e.last_used},
                    {"library", e.library()},
                    {"source", e.source()}});
  }
  return rows;
}

nlohmann::json to_json(const std::vector<LeftOver>& builds) {
  nlohmann::json rows = nlohmann::json::array();
  for (const LeftOver& b : builds)
    rows.push_back(
        {{"folder", b.folder}, {"state", to_string(b.state)}, {"bytes", b.bytes}, {"changed", b.modified}});
  return rows;
}

void list_entries(const std::vector<Entry>& entries, const std::string& folder) {
  io::TextTable table({{"function"},
                       {"order", "", io::Align::kRight},
                       {"size", "KiB", io::Align::kRight},
                       {"last used"},
                       {"key"}});
  std::uint64_t bytes = 0;
  for (const Entry& e : entries) {
    bytes += e.bytes;
    table.append({e.manifest.name, std::to_string(e.manifest.order), io::with_groups(e.bytes / 1024),
                  day(e.last_used), digest(e)});
  }
  if (!entries.empty()) std::cout << table.text() << "\n";
  std::cout << entries.size() << (entries.size() == 1 ? " library, " : " libraries, ")
            << io::with_groups(bytes / 1024) << " KiB in " << folder << "\n";
}

void list(const CacheOptions& options) {
  const Cache cache = open(options);
  const std::vector<Entry> entries = cache.list();
  const std::vector<LeftOver> builds = cache.left_over();
  if (options.json)
    return print_json(
        {{"folder", cache.folder()}, {"entries", to_json(entries)}, {"builds", to_json(builds)}});
  list_entries(entries, cache.folder());
  list_builds(builds);
}

nlohmann::json faulty(const Cache& cache, const std::vector<Entry>& entries) {
  nlohmann::json bad = nlohmann::json::array();
  for (const Entry& e : entries) {
    const auto verdict = cache.verify(digest(e));
    if (verdict.fault == Fault::kNone) continue;
    bad.push_back({{"key", digest(e)}, {"name", e.manifest.name}, {"reason", verdict.reason}});
  }
  return bad;
}

void verify(const CacheOptions& options) {
  const Cache cache = open(options);
  const std::vector<Entry> entries = cache.list();
  const nlohmann::json bad = faulty(cache, entries);
  if (options.json) {
    print_json({{"folder", cache.folder()}, {"checked", entries.size()}, {"bad", bad}});
  } else {
    for (const auto& entry : bad) {
      std::cout << entry["key"].get<std::string>() << " (" << entry["name"].get<std::string>()
                << "): " << entry["reason"].get<std::string>() << "\n";
    }
    std::cout << entries.size() - bad.size() << " of " << entries.size() << " libraries sound in "
              << cache.folder() << "\n";
  }
  if (!bad.empty()) throw Failure{};
}

void clear(const CacheOptions& options) {
  const Cache cache = open(options);
  const std::size_t before = cache.left_over().size();
  const std::size_t removed = cache.clear();
  const std::vector<LeftOver> left = cache.left_over();
  const std::size_t builds = before - std::min(before, left.size());
  const auto at_work =
      std::count_if(left.begin(), left.end(), [](const LeftOver& b) { return b.state == Left::kInUse; });
  if (options.json)
    return print_json({{"folder", cache.folder()},
                       {"removed", removed},
                       {"builds_removed", builds},
                       {"builds_at_work", at_work}});
  std::cout << removed << (removed == 1 ? " library" : " libraries") << " removed from " << cache.folder()
            << "\n";
  if (builds)
    std::cout << builds << (builds == 1 ? " interrupted or failed build" : " interrupted or failed builds")
              << " removed\n";
  if (at_work) std::cout << at_work << (at_work == 1 ? " build is" : " builds are") << " at work and stay\n";
}

}  // namespace

void add_cache(CLI::App& app) {
  CLI::App* command = app.add_subcommand("cache", "list, verify or clear the store of compiled libraries");
  command->require_subcommand(1);
  const auto options = std::make_shared<CacheOptions>();
  const auto add = [&](const char* name, const char* help, void (*action)(const CacheOptions&)) {
    CLI::App* sub = command->add_subcommand(name, help);
    add_path(*sub, "--folder", options->folder,
             "the store (default: $DYNTAPE_CACHE, then the user's cache folder)", "DIR");
    sub->add_flag("--json", options->json, "for programs");
    sub->callback([options, action] { action(*options); });
  };
  add("list",
      "every library: function, order, size, when it was last used, key; and builds that were "
      "interrupted",
      list);
  add("verify", "check every library against its manifest; the exit status is 0 only if all are sound",
      verify);
  add("clear", "remove every library, and what interrupted and failed builds left", clear);
}

}  // namespace dyntape::tools
