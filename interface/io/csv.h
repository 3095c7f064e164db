// SPDX-License-Identifier: BSD-3-Clause
//
// Tables of numbers with named columns, as comma-separated text.
//
//   CsvTable table({"t", "q0", "q1"});                 // one header line, then one line a row
//   table.append({0.0, 0.1, -0.2});
//   write_csv("out/trajectory.csv", table);            // atomic: whole or not at all
//
//   const CsvTable states = read_csv("states.csv");
//   for (int i = 0; i < states.rows(); ++i) use(states.row(i));
//   const std::vector<double> q1 = states.column("q1");
//
// Numbers are written with the fewest digits that read back to the same bits and are read alike in every
// locale. The reader accepts a byte order mark, lines ending in CR LF, blanks around entries, a quoted header
// name, and empty lines at the end; nothing else is forgiven.  Time is linear in the text, whatever the number of
// columns.
//
// Errors.  FileError `file:line:column: ...` for the first problem of: no header, an empty or repeated name,
// too few or many entries, an entry that is no finite number; a column that is asked for and that a table which was read does
// not have, with the nearest that there is.  ArgumentError for a row of the wrong size, and for such a column of other tables.
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
                    std::string file = "");  // `file`: where they stand, for messages

  int rows() const { return names_.empty() ? 0 : static_cast<int>(values_.size() / names_.size()); }
  int cols() const { return static_cast<int>(names_.size()); }
  const std::vector<std::string>& names() const { return names_; }
  const std::vector<double>& values() const { return values_; }  // (rows x cols), row after row

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
  std::unordered_map<std::string, int> places_;  // of the names
  std::vector<double> values_;
};

// A table column by column, all of one length.
class CsvColumns {
 public:
  void add(const std::string& name, const std::vector<double>& values);
  // A name for each row of a matrix.
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

// Throws ArgumentError for a number that is not finite unless that is allowed: what is written reads back.
std::string format_csv(const CsvTable& table, NonFinite policy = NonFinite::kRefuse);
void write_csv(const std::string& path, const CsvTable& table, NonFinite policy = NonFinite::kRefuse);

}  // namespace dyntape::io
