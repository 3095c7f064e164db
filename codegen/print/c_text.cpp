// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/print/c_text.h>

#include <charconv>
#include <cmath>

#include <dyntape/codegen/system/files.h>

namespace dyntape::codegen {
namespace {

constexpr std::size_t kLongestName =
    160;  // a file is named so, with an ending and for a while a mark: 255 in all

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

// "const " head "[n] = {" items "};" with line breaks.
template <class Items, class Append>
std::string table(const std::string& head, const Items& items, Append&& append) {
  if (items.empty()) return {};
  std::string text = "const " + head + "[" + std::to_string(items.size()) + "] = {";
  std::size_t line = text.size();
  for (std::size_t i = 0; i < items.size(); ++i) {
    std::string item;
    append(item, items[i]);
    const bool breaks = line + item.size() > 106;
    text += i ? (breaks ? ",\n    " : ", ") : (breaks ? "\n    " : "");
    line = breaks ? 4 + item.size() : line + item.size() + 2;
    text += item;
  }
  return text + "};\n";
}

template <class Real>
void append_as(std::string& text, Real value, const char* infinity, const char* suffix) {
  const bool negative = std::signbit(value);
  if (negative) text += "(-";
  if (std::isnan(value)) {
    text += "NAN";
  } else if (std::isinf(value)) {
    text += infinity;
  } else {
    char digits[32];
    const auto end = std::to_chars(digits, digits + sizeof digits, std::abs(value)).ptr;
    const std::string_view spelling(digits, static_cast<std::size_t>(end - digits));
    text += spelling;
    if (spelling.find_first_of(".e") == std::string_view::npos) text += ".0";
    text += suffix;
  }
  if (negative) text += ")";
}

}  // namespace

void append_number(std::string& text, double value) { append_as(text, value, "HUGE_VAL", ""); }

void append_single(std::string& text, double value) {
  append_as(text, static_cast<float>(value), "HUGE_VALF", "f");
}

void append_integer(std::string& text, std::uint64_t value) {
  char digits[24];
  text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

std::string c_identifier(std::string_view name) {
  std::string result;
  for (char c : name) result += is_letter(c) || is_digit(c) ? c : '_';
  if (result.empty() || is_digit(result[0]) || result[0] == '_') result.insert(0, "f");
  if (result.size() > kLongestName) result.replace(kLongestName / 2, result.npos, "_" + checksum(name));
  return result;
}

std::string c_string(std::string_view text) {
  std::string result = "\"";
  for (char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\' || c == '?') {  // a question mark could be part of a trigraph
      result += '\\';
      result += c;
    } else if (code < 32 || code == 127) {
      result += '\\';
      for (int shift : {6, 3, 0}) result += static_cast<char>('0' + ((code >> shift) & 7));
    } else {
      result += c;
    }
  }
  return result + "\"";
}

std::string c_comment(std::string_view text) {
  std::string result;
  for (char c : text) {
    const char shown = static_cast<unsigned char>(c) < 32 || c == 127 ? ' ' : c == '\\' ? '/' : c;
    const char last = result.empty() ? ' ' : result.back();
    // Looked at as it will stand there: what ends a comment, and what seems to begin one.
    if ((shown == '/' && last == '*') || (shown == '*' && last == '/')) result += ' ';
    result += shown;
  }
  return result;
}

std::string c_table(const std::string& name, const std::vector<std::uint32_t>& values) {
  return values.empty() ? "" : "static " + c_numbers("uint32_t " + name, values);
}

std::string c_numbers(const std::string& head, const std::vector<std::uint32_t>& values) {
  return table(head, values, [](std::string& text, std::uint32_t value) { append_integer(text, value); });
}

std::string c_table(const std::string& name, const std::vector<std::string>& values) {
  if (values.empty()) return {};
  return "static " + table("char* const " + name, values,
                           [](std::string& text, const std::string& value) { text += c_string(value); });
}

}  // namespace dyntape::codegen
