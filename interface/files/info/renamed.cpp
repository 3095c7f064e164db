// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/info/renamed.h>

#include <map>

namespace dyntape::io {
namespace {

bool is_tail(std::string_view path, std::string_view tail) {
  return path == tail || (path.ends_with(tail) && path[path.size() - tail.size() - 1] == '.');
}

void replace_below(InfoNode& block, const std::string& path, const std::vector<Renamed>& list,
                   std::vector<Replacement>& replacements) {
  for (InfoNode& node : block.children) {
    const std::string here = path.empty() ? node.key : path + '.' + node.key;
    for (const Renamed& renamed : list) {
      if (!is_tail(here, renamed.path)) continue;
      if (renamed.value.empty()) {
        replacements.push_back({node.where, node.key, std::string(renamed.now)});
        node.key = renamed.now;
      } else if (node.value == renamed.value) {
        replacements.push_back({node.value_where, node.value, std::string(renamed.value_now)});
        node.value = renamed.value_now;
      }
    }
    replace_below(node, here, list, replacements);
  }
}

}  // namespace

std::string to_sentence(const Replacement& replacement) {
  return to_string(replacement.where) + ": '" + replacement.was + "' is now called '" + replacement.now +
         "'; the next version does not read the old name (`dyntape check-config --rename` replaces it)";
}

std::vector<Replacement> replace_old_names(InfoNode& root, const std::vector<Renamed>& list) {
  std::vector<Replacement> replacements;
  replace_below(root, "", list, replacements);
  return replacements;
}

std::string replaced(const std::string& text, const std::string& file,
                     const std::vector<Replacement>& replacements) {
  std::map<std::pair<int, int>, const Replacement*> places;
  for (const Replacement& r : replacements) {
    if (r.where.file && *r.where.file == file) places[{r.where.line, r.where.column}] = &r;
  }
  std::string result;
  std::size_t kept = 0, start = 0;  // how far the text is copied; where the line begins
  int line = 1;
  for (const auto& [place, r] : places) {
    for (; line < place.first; ++line) start = text.find('\n', start) + 1;
    std::size_t at = start + static_cast<std::size_t>(place.second) - 1;
    if (text[at] == '"') ++at;
    if (text.compare(at, r->was.size(), r->was) != 0) continue;  // written with escapes
    result += text.substr(kept, at - kept) + r->now;
    kept = at + r->was.size();
  }
  return result + text.substr(kept);
}

}  // namespace dyntape::io
