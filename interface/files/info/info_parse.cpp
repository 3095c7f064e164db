// SPDX-License-Identifier: BSD-3-Clause
//
// The format is one of lines: a word never spans two, and a directive or a comment ends with its line.  Words
// are cut by LineCursor; TreeBuilder remembers the open blocks and what the next word means.
#include <dyntape/interface/files/info/info.h>

#include <unistd.h>

#include <filesystem>
#include <list>
#include <optional>

#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/files/info/info_line.h>
#include <dyntape/interface/io/number.h>

namespace dyntape::io {
namespace {

// What outlives a single file: the included ones add to the same lists.
struct Scan {
  std::vector<Problem> problems;
  std::list<InfoNode> dropped;  // blocks that belong to no key, kept only to go on reading
  bool stopped = false;         // nothing sensible can follow
  std::size_t includes = 0;     // lines so far
  std::size_t included = 0;     // bytes that they brought in
  std::vector<std::string> files;
};

struct OpenBlock {
  InfoNode* node;
  Where brace;
  int last_key_line = 0;  // where this block last got a key or a closed block
  int last = -1;          // the child that a value or a block would belong to, -1 if none
};

class TreeBuilder {
 public:
  TreeBuilder(Scan& scan, InfoNode& into, std::string file, int depth, int includes)
      : scan_(scan),
        file_(std::make_shared<const std::string>(std::move(file))),
        depth_(depth),
        includes_(includes) {
    blocks_.push_back({&into, {}, 0, -1});
  }

  void read(std::string_view text) {
    while (!scan_.stopped) {
      const size_t end = text.find('\n');
      ++line_;
      read_line(text.substr(0, end));
      if (end == std::string_view::npos) break;
      text.remove_prefix(end + 1);
    }
    if (!scan_.stopped) check_end();
  }

 private:
  enum class Expect { kKey, kValue, kContinuation };

  Where at(size_t offset) const { return {file_, line_, static_cast<int>(offset) + 1}; }
  void problem(size_t offset, std::string message) {
    scan_.problems.push_back({at(offset), std::move(message)});
  }
  void stop(size_t offset, std::string message) {
    problem(offset, std::move(message));
    scan_.stopped = true;
  }
  InfoNode& last_node() { return blocks_.back().node->children[static_cast<size_t>(blocks_.back().last)]; }

  void read_line(std::string_view line) {
    const size_t zero = line.find('\0');
    if (zero != std::string_view::npos) {
      problem(zero, "the file contains the byte zero: it is not text");
      line = line.substr(0, zero);
    }
    LineCursor cursor(line);
    if (cursor.peek() == '#') return read_directive(cursor);
    while (!scan_.stopped && !cursor.at_end()) read_token(cursor);
    if (expect_ == Expect::kValue) expect_ = Expect::kKey;  // a key without value; a block may still follow
  }

  void read_token(LineCursor& cursor) {
    if (expect_ == Expect::kContinuation) return read_continuation(cursor);
    if (cursor.peek() == '{') return open_block(cursor);
    if (cursor.peek() == '}') return close_block(cursor);
    if (expect_ == Expect::kValue) return read_value(cursor);
    read_key(cursor);
  }

  // The text of a word or quoted string, escapes resolved.
  std::string text_of(const Word& word) {
    if (!word.closed) problem(word.offset, "the quoted text is not closed on its line");
    std::string text;
    if (const std::string wrong = expand_escapes(word.raw, text); !wrong.empty()) problem(word.offset, wrong);
    return text;
  }

  void read_key(LineCursor& cursor) {
    const Word word = cursor.word();
    if (!word.quoted && word.raw.starts_with("//")) return reject_comment(cursor, word, "//");
    if (!word.quoted && word.raw.starts_with("#")) return reject_comment(cursor, word, "#");
    OpenBlock& block = blocks_.back();
    if (block.last_key_line == line_ && block.last >= 0 && !word.quoted &&
        parse_double(std::string(word.raw))) {
      problem(word.offset, "'" + std::string(word.raw) + "' follows the value of '" + last_node().key +
                               "' on its line; write a list of numbers in quotes");
    }
    if (!word.quoted) check_word(word, "key");
    block.last_key_line = line_;
    block.last = static_cast<int>(block.node->children.size());
    InfoNode node;
    node.key = text_of(word);
    node.where = node.value_where = at(word.offset);
    block.node->children.push_back(std::move(node));
    if (word.quoted && cursor.peek() == '\\') {
      problem(cursor.offset(), "a backslash may follow a value, not a key");
      cursor.skip_line();
    }
    expect_ = Expect::kValue;
  }

  void read_value(LineCursor& cursor) {
    const Word word = cursor.word();
    if (!word.quoted && word.raw.starts_with("//")) return reject_comment(cursor, word, "//");
    if (!word.quoted && word.raw == "#") return reject_comment(cursor, word, "#");
    if (!word.quoted && word.raw == "=") {
      problem(word.offset, "'=' would be the value: in this format a blank stands between key and value");
      return;  // what follows is the value that was meant
    }
    if (!word.quoted) check_word(word, "value");
    InfoNode& node = last_node();
    node.value = text_of(word);
    node.value_where = at(word.offset);
    node.has_value = true;
    expect_ = Expect::kKey;
    if (word.quoted) read_line_join(cursor);
  }

  void read_continuation(LineCursor& cursor) {
    expect_ = Expect::kKey;
    if (cursor.peek() != '"') {
      return problem(cursor.offset(),
                     "a quoted text was expected, since the value before ends in a backslash");
    }
    last_node().value += text_of(cursor.word());
    read_line_join(cursor);
  }

  // A backslash after a quoted value: the next line continues it.
  void read_line_join(LineCursor& cursor) {
    if (cursor.peek() != '\\') return;
    const size_t offset = cursor.offset();
    cursor.skip_character();
    expect_ = Expect::kContinuation;
    if (cursor.at_end()) return;
    problem(offset, "after a backslash the line must end");
    cursor.skip_line();
    expect_ = Expect::kKey;
  }

  void reject_comment(LineCursor& cursor, const Word& word, const std::string& sign) {
    problem(
        word.offset,
        "'" + sign + "' does not start a comment in this format, ';' does (quote a value that starts so)");
    cursor.skip_line();
  }

  void check_word(const Word& word, const char* role) {
    const std::string text(word.raw);
    if (text.find_first_of("{}") != std::string::npos) {
      problem(word.offset,
              "the brace is part of the " + std::string(role) + " '" + text + "'; put a blank between");
    } else if (role == std::string_view("key") && text.find('=') != std::string::npos) {
      problem(word.offset,
              "the key '" + text + "' contains '='; in this format a blank stands between key and value");
    }
  }

  void open_block(LineCursor& cursor) {
    const size_t offset = cursor.offset();
    cursor.skip_character();
    expect_ = Expect::kKey;
    if (depth_ + static_cast<int>(blocks_.size()) > kMaxDepth)
      return stop(offset, "blocks are nested deeper than " + std::to_string(kMaxDepth));
    if (blocks_.back().last < 0) problem(offset, "'{' without a key before it");
    InfoNode* const node = blocks_.back().last < 0 ? &scan_.dropped.emplace_back() : &last_node();
    node->has_block = true;
    blocks_.push_back({node, at(offset), 0, -1});
  }

  void close_block(LineCursor& cursor) {
    const size_t offset = cursor.offset();
    cursor.skip_character();
    expect_ = Expect::kKey;
    if (blocks_.size() == 1) return problem(offset, "'}' closes nothing");
    blocks_.pop_back();
    blocks_.back().last = -1;
    blocks_.back().last_key_line = line_;
  }

  void read_directive(LineCursor& cursor) {
    const size_t offset = cursor.offset();
    cursor.skip_character();
    const std::string directive = text_of(cursor.plain_word());
    if (directive != "include")
      return problem(offset, "unknown directive '#" + directive +
                                 "'; only #include is known, and a comment begins with ';'");
    if (cursor.peek() != '"') return problem(cursor.offset(), "#include expects a file name in quotes");
    const Word name = cursor.word();
    const std::string path = text_of(name);
    if (cursor.peek() != '\0')
      return problem(cursor.offset(), "nothing may follow the file name of #include");
    include(name.offset, path);
  }

  void include(size_t offset, const std::string& path) {
    if (includes_ >= kMaxDepth)
      return stop(offset, "files include each other deeper than " + std::to_string(kMaxDepth) +
                              "; does one include itself?");
    const std::optional<std::string> found = locate(path);
    if (!found) return problem(offset, "cannot open the included file '" + path + "'");
    const std::string text = read_file(*found);
    scan_.files.push_back(*found);
    scan_.included += text.size();
    if (++scan_.includes > kMaxIncludes || scan_.included > kMaxIncluded)
      return stop(offset, "#include lines bring in more than " + std::to_string(kMaxIncludes) + " files or " +
                              std::to_string(kMaxIncluded >> 20) +
                              " MiB; do files include each other many times?");
    const int depth = depth_ + static_cast<int>(blocks_.size()) - 1;
    TreeBuilder(scan_, *blocks_.back().node, *found, depth, includes_ + 1).read(text);
  }

  std::optional<std::string> locate(const std::string& path) const {
    const std::filesystem::path beside = std::filesystem::path(*file_).parent_path() / path;
    for (const std::filesystem::path& candidate : {beside, std::filesystem::path(path)}) {
      const bool readable = ::access(candidate.c_str(), R_OK) == 0;
      if (readable && !std::filesystem::is_directory(candidate)) return candidate.string();
    }
    return std::nullopt;
  }

  void check_end() {
    for (size_t i = 1; i < blocks_.size(); ++i) {
      const std::string& key = blocks_[i].node->key;
      scan_.problems.push_back({blocks_[i].brace, "the block of '" + key + "' is never closed"});
    }
    if (expect_ == Expect::kContinuation) problem(0, "the file ends where a value was to be continued");
  }

  Scan& scan_;
  std::shared_ptr<const std::string> file_;
  int depth_, includes_;  // of blocks and files around this one
  int line_ = 0;
  Expect expect_ = Expect::kKey;
  std::vector<OpenBlock> blocks_;
};

}  // namespace

InfoScan scan_info(std::string_view text, const std::string& file_name) {
  Scan scan;
  InfoScan result;
  result.root.where = {std::make_shared<const std::string>(file_name), 0, 0};
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  TreeBuilder(scan, result.root, file_name, 0, 0).read(text);
  result.problems = std::move(scan.problems);
  result.included = std::move(scan.files);
  return result;
}

InfoNode parse_info(std::string_view text, const std::string& file_name) {
  InfoScan scan = scan_info(text, file_name);
  throw_if_any(std::move(scan.problems));
  return std::move(scan.root);
}

}  // namespace dyntape::io
