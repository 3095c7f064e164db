// SPDX-License-Identifier: BSD-3-Clause
//
// Formats aligned text tables for a terminal.
//
//   TextTable table({{"route"}, {"time", "us", Align::kRight}, {"error", "", Align::kRight}});
//   table.append({"generated", significant(1.2345, 3), scientific(3e-16)});
//   std::cout << table.text();
//
//   route      time [us]    error
//   ---------  ---------  -------
//   generated       1.23  3.0e-16
//
// Columns are separated by two blanks; UTF-8 counts characters, not bytes.  ArgumentError for a row of the wrong
// size.
#pragma once

#include <string>
#include <vector>

namespace dyntape::io {

enum class Align { kLeft, kRight };

struct TextColumn {
  std::string name;
  std::string unit = {};
  Align align = Align::kLeft;
};

class TextTable {
 public:
  explicit TextTable(std::vector<TextColumn> columns) : columns_(std::move(columns)) {}
  void append(std::vector<std::string> row);
  std::string text() const;

 private:
  std::string line_of(const std::vector<std::string>& cells, const std::vector<size_t>& widths) const;

  std::vector<TextColumn> columns_;
  std::vector<std::vector<std::string>> rows_;
};

std::string significant(double value, int digits);     // 1234.5 with 3 digits: "1230"; 0.00012345: "0.000123"
std::string scientific(double value, int digits = 2);  // "3.0e-16"
std::string duration(double seconds);                  // "1.23 us", "45.6 ms", "7.89 s", "2 min 03 s"
std::string with_groups(long long count);              // "1 234 567"

}  // namespace dyntape::io
