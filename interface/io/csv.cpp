// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/io/csv.h>

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/suggest.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/io/number.h>

namespace dyntape::io {
namespace {

struct Entry {
  std::string_view text;  // without blanks around it
  int column;             // of its first byte
};

std::vector<Entry> split_entries(std::string_view line) {
  std::vector<Entry> entries;
  for (size_t begin = 0;;) {
    bool in_quotes = false;
    size_t end = begin;
    for (; end < line.size() && (in_quotes || line[end] != ','); ++end) in_quotes ^= line[end] == '"';
    size_t first = begin, last = end;
    while (first < last && (line[first] == ' ' || line[first] == '\t')) ++first;
    while (last > first && (line[last - 1] == ' ' || line[last - 1] == '\t')) --last;
    entries.push_back({line.substr(first, last - first), static_cast<int>(first) + 1});
    if (end == line.size()) return entries;
    begin = end + 1;
  }
}

class CsvReader {
 public:
  explicit CsvReader(const std::string& file) : file_(file) {}

  CsvTable read(std::string_view text) {
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    if (text.starts_with("<?xml") || text.starts_with("<!--") || text.starts_with("<robot"))
      throw FileError(file_ +
                      ": this is XML, not a table; expected a CSV file, whose first line names the columns");
    for (bool more = true; more;) {
      const size_t end = text.find('\n');
      more = end != std::string_view::npos;
      std::string_view line = text.substr(0, end);
      if (line.ends_with('\r')) line.remove_suffix(1);
      read_line(line);
      if (more) text.remove_prefix(end + 1);
    }
    if (table_.cols() == 0) fail(1, "there is no header line");
    return std::move(table_);
  }

 private:
  [[noreturn]] void fail(int column, const std::string& message, int line = 0) const {
    line = line ? line : line_;
    throw FileError(file_ + ':' + std::to_string(line) + ':' + std::to_string(column) + ": " + message);
  }

  void read_line(std::string_view line) {
    ++line_;
    if (const size_t at = line.find('\r'); at != std::string_view::npos)
      fail(static_cast<int>(at) + 1,
           "a carriage return within a line; expected lines that end in LF or CR LF");
    const bool empty = line.find_first_not_of(" \t") == std::string_view::npos;
    if (empty) {
      first_empty_ = first_empty_ ? first_empty_ : line_;
    } else if (first_empty_) {
      fail(1, "the line is empty, but rows follow", first_empty_);
    } else if (line_ == 1) {
      read_header(split_entries(line));
    } else {
      read_row(split_entries(line));
    }
  }

  void read_header(const std::vector<Entry>& entries) {
    std::vector<std::string> names;
    std::unordered_set<std::string> met;
    const auto is_number = [this](const Entry& entry) { return parse_double(unquoted(entry)).has_value(); };
    if (std::all_of(entries.begin(), entries.end(), is_number))
      fail(1, "the first line must name the columns, but it holds numbers");
    for (const Entry& entry : entries) {
      std::string name = unquoted(entry);
      const int number = static_cast<int>(names.size()) + 1;
      if (name.empty()) fail(entry.column, "column " + std::to_string(number) + " has no name");
      if (!met.insert(name).second) fail(entry.column, "two columns are named '" + name + "'");
      names.push_back(std::move(name));
    }
    if (names.size() == 1 && names[0].find(';') != std::string::npos)
      fail(1, "the columns are separated by ';', expected ','");
    table_ = CsvTable(std::move(names), file_);
  }

  std::string unquoted(const Entry& entry) const {
    if (!entry.text.starts_with('"')) return std::string(entry.text);
    if (entry.text.size() < 2 || !entry.text.ends_with('"'))
      fail(entry.column, "the quoted name is not closed");
    std::string name;
    for (size_t i = 1; i + 1 < entry.text.size(); ++i) {
      name += entry.text[i];
      if (entry.text[i] == '"') ++i;  // "" stands for "
    }
    return name;
  }

  void read_row(const std::vector<Entry>& entries) {
    const size_t expected = table_.names().size();
    if (entries.size() != expected) {
      const Entry& place = entries[std::min(entries.size() - 1, expected)];
      fail(place.column, "the row has " + std::to_string(entries.size()) + " entries, the header names " +
                             std::to_string(expected));
    }
    row_.clear();
    for (const Entry& entry : entries) row_.push_back(number_in(entry, table_.names()[row_.size()]));
    table_.append(row_);
  }

  double number_in(const Entry& entry, const std::string& column) {
    const std::optional<double> value = parse_double(entry.text);
    if (value && std::isfinite(*value)) return *value;
    const char* const expected = value                         ? "a finite number"
                                 : is_out_of_range(entry.text) ? "a number in the range of a double"
                                                               : "a number";
    fail(entry.column,
         "column '" + column + "' expects " + expected + ", got '" + std::string(entry.text) + "'");
  }

  const std::string& file_;
  CsvTable table_;
  std::vector<double> row_;
  int line_ = 0, first_empty_ = 0;
};

std::string quoted_name(const std::string& name) {
  const bool plain =
      name.find_first_of(",\"") == std::string::npos && name.front() != ' ' && name.back() != ' ';
  if (plain) return name;
  std::string text = "\"";
  for (const char c : name) text += c == '"' ? std::string("\"\"") : std::string(1, c);
  return text + '"';
}

}  // namespace

CsvTable::CsvTable(std::vector<std::string> names, std::string file)
    : file_(std::move(file)), names_(std::move(names)) {
  for (const std::string& name : names_) {
    const bool bad = name.empty() || name.find_first_of("\r\n") != std::string::npos;
    if (bad) throw ArgumentError("CsvTable: a column name must be one line of text, got '" + name + "'");
    const bool repeated = !places_.emplace(name, static_cast<int>(places_.size())).second;
    if (repeated) throw ArgumentError("CsvTable: two columns are named '" + name + "'");
  }
}

int CsvTable::index(const std::string& name) const {
  const auto found = places_.find(name);
  if (found != places_.end()) return found->second;
  const std::string what = "there is no column '" + name + "'" + suggestion(name, names_);
  if (!file_.empty()) throw FileError(file_ + ":1: " + what);
  throw ArgumentError("CsvTable: " + what);
}

std::vector<double> CsvTable::column(const std::string& name) const {
  const int col = index(name);
  std::vector<double> values;
  for (int i = 0; i < rows(); ++i) values.push_back((*this)(i, col));
  return values;
}

void CsvTable::append(std::span<const double> row) {
  if (row.size() != names_.size())
    throw ArgumentError("CsvTable: the row has " + std::to_string(row.size()) + " entries, the table " +
                        std::to_string(names_.size()) + " columns");
  values_.insert(values_.end(), row.begin(), row.end());
}

void CsvColumns::add(const std::string& name, const std::vector<double>& values) {
  names_.push_back(name);
  columns_.push_back(values);
}

CsvTable CsvColumns::table() const {
  CsvTable table(names_);
  std::vector<double> row(columns_.size());
  for (std::size_t k = 0; !columns_.empty() && k < columns_.front().size(); ++k) {
    for (std::size_t i = 0; i < row.size(); ++i) row[i] = columns_[i][k];
    table.append(row);
  }
  return table;
}

CsvTable parse_csv(std::string_view text, const std::string& file_name) {
  return CsvReader(file_name).read(text);
}

CsvTable read_csv(const std::string& path) { return parse_csv(read_file(path), path); }

std::string format_csv(const CsvTable& table, NonFinite policy) {
  std::string text;
  for (int j = 0; j < table.cols(); ++j)
    text += (j ? "," : "") + quoted_name(table.names()[static_cast<size_t>(j)]);
  text += '\n';
  for (int i = 0; i < table.rows(); ++i) {
    for (int j = 0; j < table.cols(); ++j) {
      const double value = table(i, j);
      if (policy == NonFinite::kRefuse && !std::isfinite(value))
        throw ArgumentError("format_csv: row " + std::to_string(i) + " of column '" +
                            table.names()[static_cast<size_t>(j)] + "' is " + shortest(value));
      text += (j ? "," : "") + shortest(value);
    }
    text += '\n';
  }
  return text;
}

void write_csv(const std::string& path, const CsvTable& table, NonFinite policy) {
  write_file_atomically(path, format_csv(table, policy));
}

}  // namespace dyntape::io
