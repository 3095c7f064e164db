// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/io/table.h>

#include <algorithm>
#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/number.h>

namespace dyntape::io {
namespace {

// Characters, not bytes: continuation bytes of UTF-8 take no room.
size_t width_of(const std::string& text) {
  return static_cast<size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

std::string padded(const std::string& text, size_t width, Align align) {
  const std::string blanks(width - width_of(text), ' ');
  return align == Align::kLeft ? text + blanks : blanks + text;
}

std::string head_of(const TextColumn& column) {
  return column.unit.empty() ? column.name : column.name + " [" + column.unit + "]";
}

std::string with_format(double value, std::chars_format format, int precision) {
  char buffer[400];  // the longest double in fixed notation has 309 digits before the point
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, value, format, precision).ptr};
}

}  // namespace

void TextTable::append(std::vector<std::string> row) {
  if (row.size() != columns_.size())
    throw ArgumentError("TextTable: the row has " + std::to_string(row.size()) + " entries, the table " +
                        std::to_string(columns_.size()) + " columns");
  for (std::string& cell : row) cell = one_line(std::move(cell));
  rows_.push_back(std::move(row));
}

std::string TextTable::line_of(const std::vector<std::string>& cells,
                               const std::vector<size_t>& widths) const {
  std::string line;
  for (size_t j = 0; j < cells.size(); ++j)
    line += (j ? "  " : "") + padded(cells[j], widths[j], columns_[j].align);
  line.erase(line.find_last_not_of(' ') + 1);
  return line + '\n';
}

std::string TextTable::text() const {
  std::vector<std::string> heads;
  std::vector<size_t> widths;
  for (size_t j = 0; j < columns_.size(); ++j) {
    heads.push_back(head_of(columns_[j]));
    widths.push_back(width_of(heads[j]));
    for (const auto& row : rows_) widths[j] = std::max(widths[j], width_of(row[j]));
  }
  std::vector<std::string> rules;
  for (const size_t width : widths) rules.emplace_back(width, '-');
  std::string text = line_of(heads, widths) + line_of(rules, widths);
  for (const auto& row : rows_) text += line_of(row, widths);
  return text;
}

std::string significant(double value, int digits) {
  if (value == 0 || !std::isfinite(value)) return shortest(value);
  const std::string rounded = with_format(value, std::chars_format::scientific, digits - 1);
  const int exponent = parse_number<int>(std::string_view(rounded).substr(rounded.find('e') + 1)).value_or(0);
  const double shown = parse_double(rounded).value_or(value);
  return with_format(shown, std::chars_format::fixed, std::max(0, digits - 1 - exponent));
}

std::string scientific(double value, int digits) {
  return std::isfinite(value) ? with_format(value, std::chars_format::scientific, digits - 1)
                              : shortest(value);
}

std::string duration(double seconds) {
  if (!std::isfinite(seconds)) return shortest(seconds) + " s";
  const double size = std::abs(seconds);
  if (size < 999.5e-9) return significant(seconds * 1e9, 3) + " ns";
  if (size < 999.5e-6) return significant(seconds * 1e6, 3) + " us";
  if (size < 999.5e-3) return significant(seconds * 1e3, 3) + " ms";
  if (size < 119.5) return significant(seconds, 3) + " s";
  const long long whole = std::llround(seconds);
  const std::string rest = std::to_string(std::abs(whole % 60));
  return std::to_string(whole / 60) + " min " + (rest.size() < 2 ? "0" : "") + rest + " s";
}

std::string with_groups(long long count) {
  std::string digits = std::to_string(count);
  const int first = count < 0 ? 1 : 0;
  for (int i = static_cast<int>(digits.size()) - 3; i > first; i -= 3)
    digits.insert(static_cast<size_t>(i), 1, ' ');
  return digits;
}

}  // namespace dyntape::io
