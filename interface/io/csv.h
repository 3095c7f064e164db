// SPDX-License-Identifier: BSD-3-Clause
//
// Reads and writes tables of numbers with named columns as comma-separated text.
//
//   CsvTable table({"t", "q0", "q1"});                 // one header line, then one line per row
//   table.append({0.0, 0.1, -0.2});
//   write_csv("out/trajectory.csv", table);            // atomic: the whole file or nothing
//
//   const CsvTable states = read_csv("states.csv");
//   for (int i = 0; i < states.rows(); ++i) use(states.row(i));
//   const std::vector<double> q1 = states.column("q1");
//
// Writing.  Numbers have the fewest digits that read back to the same bits, independent of the locale.
//
// Reading.  Accepted are a byte order mark, lines that end in CR LF, blanks around entries, quoted header names and
// empty lines at the end.  The time is linear in the length of the text, for any number of columns.
//
// Errors:
//
// - FileError `file:line:column: ...` for the first problem: no header, an empty or repeated name, too few or too
// many entries, an entry that is not a finite number.
// - FileError, with the nearest name, if a column of a table that was read from a file does not exist; ArgumentError
// for other tables.
// - ArgumentError for a row of the wrong size.
#pragma once

#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace dyntape::io {

enum class NonFinite { kRefuse, kAllow };

class CsvTable {
 public:
  CsvTable() = default;
  explicit CsvTable(std::vector<std::string> names,
                    std::string file = "");  // `file`: the origin, for error messages

  int rows() const { return names_.empty() ? 0 : static_cast<int>(values_.size() / names_.size()); }
  int cols() const { return static_cast<int>(names_.size()); }
  const std::vector<std::string>& names() const { return names_; }
  const std::vector<double>& values() const { return values_; }  // (rows x cols), row by row

  double operator()(int row, int col) const { return values_[offset(row) + static_cast<size_t>(col)]; }
  std::span<const double> row(int i) const { return std::span(values_).subspan(offset(i), names_.size()); }
  std::vector<double> column(const std::string& name) const;
  bool has(const std::string& name) const { return places_.count(name) > 0; }
  int index(const std::string& name) const;  // of a column

  void append(std::span<const double> row);
  void append(std::initializer_list<double> row) { append(std::span(row.begin(), row.size())); }

 private:
  size_t offset(int row) const { return static_cast<size_t>(row) * names_.size(); }

  std::string file_;
  std::vector<std::string> names_;
  std::unordered_map<std::string, int> places_;  // index of each name
  std::vector<double> values_;
};

// Builds a table column by column; all columns have one length.
class CsvColumns {
 public:
  void add(const std::string& name, const std::vector<double>& values);
  // Adds each row of a matrix as a column.
  template <class Matrix>
  void add(const std::vector<std::string>& names, const Matrix& rows) {
    for (std::size_t i = 0; i < names.size(); ++i) {
      std::vector<double> values;
      for (std::ptrdiff_t k = 0; k < rows.cols(); ++k) values.push_back(rows(std::ptrdiff_t(i), k));
      add(names[i], values);
    }
  }
  CsvTable table() const;

 private:
  std::vector<std::string> names_;
  std::vector<std::vector<double>> columns_;
};

CsvTable parse_csv(std::string_view text, const std::string& file_name);
CsvTable read_csv(const std::string& path);

// With kRefuse, throws ArgumentError for a number that is not finite, since read_csv does not accept it.
std::string format_csv(const CsvTable& table, NonFinite policy = NonFinite::kRefuse);
void write_csv(const std::string& path, const CsvTable& table, NonFinite policy = NonFinite::kRefuse);

}  // namespace dyntape::io
