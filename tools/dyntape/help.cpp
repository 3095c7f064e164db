// SPDX-License-Identifier: BSD-3-Clause
#include "help.h"

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <sstream>

#include <dyntape/interface/io/number.h>

namespace dyntape::tools {
namespace {

constexpr std::size_t kUsualWidth = 80, kLeast = 60, kMost = 160;
constexpr std::size_t kRight = 24;  // where what options mean begins

// CLI11 appends what validators say of themselves to the type: "INT:2 to 50".
std::string type_of(const CLI::Option& option) {
  const std::string name = option.get_type_size() == 0 ? "" : option.get_type_name();
  return name.substr(0, name.find(':'));
}

// "2 to 50"; of a list of words the type says it already.
std::string range_of(const CLI::Option& option) {
  const std::string name = option.get_type_size() == 0 ? "" : option.get_type_name();
  const std::size_t colon = name.find(':');
  if (colon == std::string::npos || name.find('|') < colon) return {};
  const std::string range = name.substr(colon + 1);
  return range.starts_with('{') ? "" : range;
}

// "(2 to 50; default: 5)"
std::string remarks_on(const CLI::Option& option, bool is_positional) {
  std::vector<std::string> remarks;
  if (const std::string range = range_of(option); !range.empty()) remarks.push_back(range);
  if (!option.get_default_str().empty() && option.get_type_size() != 0)
    remarks.push_back("default: " + option.get_default_str());
  if (option.get_required() && !is_positional) remarks.push_back("required");
  for (const CLI::Option* other : option.get_needs()) remarks.push_back("with " + other->get_name());
  std::string text;
  for (const std::string& remark : remarks) text += (text.empty() ? " (" : "; ") + remark;
  return text.empty() ? text : text + ")";
}

// What a list of commands says of each, without the point at its end.
std::string first_sentence(const std::string& description) {
  std::istringstream lines(description);
  std::string sentence;
  for (std::string line; std::getline(lines, line) && !line.empty() && line[0] != ' ';) {
    sentence += (sentence.empty() ? "" : " ") + line;
    if (line.ends_with('.')) break;
  }
  if (sentence.ends_with('.')) sentence.pop_back();
  return sentence;
}

class Help : public CLI::Formatter {
 public:
  std::string make_description(const CLI::App* app) const override {
    const std::string text = app->get_description();
    return text.empty() ? "" : flowing(text) + "\n";
  }

  std::string make_usage(const CLI::App* app, std::string name) const override {
    std::string usage = CLI::Formatter::make_usage(app, std::move(name));
    usage.erase(usage.find_last_not_of('\n') + 1);
    return wrapped(usage, 7, help_width()) + "\n";
  }

  std::string make_subcommand(const CLI::App* command) const override {
    return help_entry(command->get_name(), first_sentence(command->get_description()));
  }

  // A table, laid out by whoever wrote it.
  std::string make_footer(const CLI::App* app) const override {
    const std::string text = app->get_footer();
    return text.empty() ? "" : text + "\n";
  }

  std::string make_option(const CLI::Option* option, bool is_positional) const override {
    const std::string type = type_of(*option);
    std::string left = is_positional ? type : make_option_name(option, false);
    if (!is_positional && !type.empty()) left += " " + type;
    return help_entry(left, option->get_description() + remarks_on(*option, is_positional));
  }

  std::string make_option_usage(const CLI::Option* option) const override { return type_of(*option); }
};

void set_formatter(CLI::App& app, const std::shared_ptr<Help>& help) {
  app.formatter(help);
  for (CLI::App* command : app.get_subcommands({})) set_formatter(*command, help);
}

}  // namespace

std::size_t help_width() {
  const char* const columns = std::getenv("COLUMNS");
  const auto width = io::parse_number<unsigned>(columns ? columns : "");
  return width && *width >= kLeast && *width <= kMost ? *width : kUsualWidth;
}

std::string wrapped(const std::string& text, std::size_t indent, std::size_t width) {
  std::istringstream words(text);
  std::string result;
  std::size_t column = indent;
  for (std::string word; words >> word;) {
    const bool is_first = column == indent;
    if (!is_first && column + 1 + word.size() > width) {
      result += "\n" + std::string(indent, ' ');
      column = indent;
    } else if (!is_first) {
      result += ' ';
      ++column;
    }
    result += word;
    column += word.size();
  }
  return result;
}

std::string help_entry(const std::string& left, const std::string& right) {
  const std::size_t width = help_width();
  const std::size_t indent = 2 + std::min(left.find_first_not_of(' '), left.size());
  std::string text = std::string(indent, ' ') + wrapped(left, indent + 2, width);
  if (right.empty()) return text + "\n";
  const bool fits = text.size() + 2 <= kRight;
  text += fits ? std::string(kRight - text.size(), ' ') : "\n" + std::string(kRight, ' ');
  return text + wrapped(right, kRight, width) + "\n";
}

std::string flowing(const std::string& text) {
  std::istringstream lines(text);
  std::string result, paragraph;
  const auto flush = [&] {
    if (!paragraph.empty()) result += wrapped(paragraph, 0, help_width()) + "\n";
    paragraph.clear();
  };
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty() && line[0] != ' ') {
      paragraph += (paragraph.empty() ? "" : " ") + line;
      if (line.ends_with('.')) flush();
      continue;
    }
    flush();
    result += line + "\n";
  }
  flush();
  return result;
}

void set_help(CLI::App& app) { set_formatter(app, std::make_shared<Help>()); }

}  // namespace dyntape::tools
