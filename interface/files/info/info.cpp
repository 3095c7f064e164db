// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/info/info.h>

#include <algorithm>
#include <tuple>

#include <dyntape/autodiff/error.h>

namespace dyntape::io {
namespace {

// Without quotes only what no reader could take for something else.
bool needs_quotes(const std::string& word) {
  if (word.empty() || word.front() == '#' || word.starts_with("//")) return true;
  return std::any_of(word.begin(), word.end(), [](char c) {
    return static_cast<unsigned char>(c) <= ' ' ||
           std::string_view(";{}\"\\=\x7f").find(c) != std::string_view::npos;
  });
}

std::string quoted(const std::string& word) {
  constexpr std::string_view kValues("\0\a\b\f\n\r\t\v\"\\", 10);
  constexpr std::string_view kLetters = "0abfnrtv\"\\";
  std::string text = "\"";
  for (const char c : word) {
    const size_t which = kValues.find(c);
    if (which == std::string_view::npos) {
      text += c;
    } else {
      text += '\\';
      text += kLetters[which];
    }
  }
  return text + "\"";
}

std::string printable(const std::string& word) { return needs_quotes(word) ? quoted(word) : word; }

std::string line_of(const InfoNode& node, std::size_t width) {
  std::string line = printable(node.key);
  if (node.has_value || !node.value.empty()) {
    if (node.children.empty()) line.resize(std::max(line.size(), width), ' ');
    line += ' ' + printable(node.value);
  }
  return node.comment.empty() ? line : line + "  ; " + node.comment;
}

void write_children(const InfoNode& node, const std::string& indent, std::string& text) {
  size_t width = 0;  // values stand in one column
  for (const InfoNode& child : node.children) {
    if (child.children.empty()) width = std::max(width, printable(child.key).size());
  }
  for (const InfoNode& child : node.children) {
    text += indent + line_of(child, width) + '\n';
    if (child.children.empty() && !child.has_block) continue;
    text += indent + "{\n";
    write_children(child, indent + "  ", text);
    text += indent + "}\n";
  }
}

}  // namespace

std::string to_string(const Where& where) {
  std::string text = where.file ? *where.file : std::string("(no file)");
  if (where.line > 0) text += ':' + std::to_string(where.line) + ':' + std::to_string(where.column);
  return text;
}

std::string write_info(const InfoNode& root) {
  std::string text;
  write_children(root, "", text);
  return text;
}

void throw_if_any(std::vector<Problem> problems) {
  if (problems.empty()) return;
  std::stable_sort(problems.begin(), problems.end(), [](const Problem& a, const Problem& b) {
    if (a.where.file != b.where.file && a.where.file && b.where.file && *a.where.file != *b.where.file) {
      return *a.where.file < *b.where.file;
    }
    // What the whole file lacks comes last: it may follow from what is wrong in a line.
    const bool a_is_of_file = a.where.line == 0, b_is_of_file = b.where.line == 0;
    return std::tie(a_is_of_file, a.where.line, a.where.column) <
           std::tie(b_is_of_file, b.where.line, b.where.column);
  });
  std::vector<std::string> sentences;
  for (const Problem& problem : problems)
    sentences.push_back(to_string(problem.where) + ": " + problem.message);
  throw FileError(sentences);
}

}  // namespace dyntape::io
