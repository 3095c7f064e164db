// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/file_kind.h>

#include <vector>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/files/info/info.h>

namespace dyntape {
namespace {

struct KindOfFile {
  FileKind kind;
  const char *name, *command;
  std::vector<const char*> blocks;  // that no other kind has
};

const std::vector<KindOfFile>& kinds_of_files() {
  static const std::vector<KindOfFile> all = {
      {FileKind::kTask, "a task", "dyntape solve", {"goal", "phases", "terms", "waypoints", "verify"}},
      {FileKind::kScene, "a scene", "dyntape simulate", {"simulation", "commands", "constraints"}},
      {FileKind::kSweep, "a sweep", "dyntape sweep", {"vary"}},
      {FileKind::kCentroidal, "a file about a robot as one mass", "dyntape mpc", {"centroidal"}}};
  return all;
}

}  // namespace

void check_file_kind(std::string_view text, const std::string& path, FileKind wanted) {
  const io::InfoNode root = io::scan_info(text, path).root;
  const KindOfFile *found = nullptr, *asked = nullptr;
  const char* block = "";
  for (const KindOfFile& kind : kinds_of_files()) {
    if (kind.kind == wanted) asked = &kind;
    for (const char* name : kind.blocks) {
      if (!root.child(name)) continue;
      if (found && found != &kind) return;  // of two kinds: its reader tells what is wrong
      found = &kind, block = name;
      break;
    }
  }
  if (!found || found == asked) return;
  throw FileError(path + ": this is " + found->name + " ('" + block + "' is in it), not " + asked->name +
                  "; " + found->command + " takes it");
}

}  // namespace dyntape
