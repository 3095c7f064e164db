// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/printed/print_loops.h>

#include <algorithm>
#include <functional>

namespace dyntape {

namespace {

std::string text_of(std::size_t n) { return std::to_string(n); }

// "n + i", "i" for n = 0, "n" for no variable.
std::string plus(std::size_t n, const std::string& variable) {
  if (variable.empty()) return text_of(n);
  return n == 0 ? variable : text_of(n) + " + " + variable;
}

// LoopText of C with their indentation.
class LoopText {
 public:
  std::string text;

  void add(const std::string& line) { text += std::string(2 * depth_, ' ') + line + "\n"; }
  void open(const std::string& line) { add(line + " {"), ++depth_; }
  void close() { --depth_, add("}"); }

  // inside(variable): in a loop over `count`, or with no variable for a single turn.
  void loop(const std::string& variable, std::size_t count,
            const std::function<void(const std::string&)>& inside) {
    if (count == 1) return inside("");
    open("for (int " + variable + " = 0; " + variable + " < " + text_of(count) + "; ++" + variable + ")");
    inside(variable);
    close();
  }

 private:
  std::size_t depth_ = 0;
};

// Visits groups of consecutive rows with the same columns.
void for_groups(const SparseRows& a, const std::function<void(std::size_t first, std::size_t count)>& visit) {
  for (std::size_t i = 0; i < a.rows.size();) {
    std::size_t end = i + 1;
    while (end < a.rows.size() && a.rows[end].runs == a.rows[i].runs) ++end;
    if (!a.rows[i].runs.empty()) visit(i, end - i);
    i = end;
  }
}

// Index of a non-zero: of the group's row `row`, run with this offset in the row, and entry.
std::string place(const SparseRow& first, std::size_t in_row, const std::string& row,
                  const std::string& entry) {
  std::string text = plus(first.offset + in_row, entry);
  if (row.empty()) return text;
  const std::string skipped = first.count == 1 ? row : "(" + text_of(first.count) + " * " + row + ")";
  return "(" + text + ") + " + skipped;
}

// visit(row index, entry of the run's column, index of the non-zero), in loops.
using VisitEntry =
    std::function<void(LoopText&, const std::string& row, const std::string& column, const std::string& at)>;

void for_entries(LoopText& out, const SparseRows& a, const VisitEntry& visit) {
  for_groups(a, [&](std::size_t first, std::size_t count) {
    out.loop("s", count, [&](const std::string& s) {
      std::size_t in_row = 0;
      for (const SparseRun& run : a.rows[first].runs) {
        out.loop("j", run.count, [&](const std::string& j) {
          visit(out, plus(first, s), plus(run.first, j), place(a.rows[first], in_row, s, j));
        });
        in_row += run.count;
      }
    });
  });
}

// Of an array that is a parameter; of none, which may be behind the end of another, none is stated.
std::string size(std::size_t n) { return n == 0 ? "" : text_of(n); }

// A function of the non-zeros and two vectors; with none, nothing is done.
std::string print_product(const std::string& name, const SparseRows& a, const char* from, std::size_t n_from,
                          const char* to, std::size_t n_to, const VisitEntry& visit) {
  LoopText out;
  out.open("static void " + name + "(const real a[" + size(a.nnz) + "], const real " + from + "[" +
           size(n_from) + "], real " + to + "[" + size(n_to) + "])");
  if (a.nnz == 0) {
    out.add("(void)a;");
    out.add(std::string("(void)") + from + ";");
    out.add(std::string("(void)") + to + ";");
  }
  for_entries(out, a, visit);
  out.close();
  return out.text + "\n";
}

// q(row, column) += v * a over the lower triangle, for the row s of a group: v(column, non-zero) begins each row.
void print_lower(LoopText& out, const SparseRow& row, const std::string& s,
                 const std::function<std::string(const std::string& column, const std::string& at)>& factor,
                 const std::function<std::string(const std::string& i, const std::string& j)>& target) {
  std::size_t before = 0;
  for (const SparseRun& run : row.runs) {
    out.loop("i", run.count, [&](const std::string& i) {
      const std::string row_index = plus(run.first, i);
      out.open("");
      out.add("const real v = " + factor(row_index, place(row, before, s, i)) + ";");
      std::size_t in_row = 0;
      for (const SparseRun& other : row.runs) {
        if (other.first > run.first) break;
        const bool is_same = other.first == run.first;
        const auto add = [&](const std::string& j) {
          out.add(target(row_index, plus(other.first, j)) + " += v * a[" + place(row, in_row, s, j) + "];");
        };
        if (is_same && run.count > 1) {
          out.open("for (int j = 0; j <= i; ++j)");
          add("j");
          out.close();
        } else {
          out.loop("j", other.count, add);
        }
        in_row += other.count;
      }
      out.close();
    });
    before += run.count;
  }
}

bool is_plain_number(const std::string& text) {
  return text.find_first_not_of("0123456789") == std::string::npos;
}

// An index moved by a number.
std::string moved(std::size_t by, const std::string& index) {
  if (is_plain_number(index)) return text_of(by + std::stoul(index));
  return by == 0 ? index : text_of(by) + " + " + index;
}

std::string in_matrix(const std::string& i, const std::string& j) { return "q[" + i + "][" + j + "]"; }

std::string in_rows(const std::string& i, const std::string& j) {
  if (is_plain_number(i) && is_plain_number(j)) {
    const std::size_t row = std::stoul(i);
    return "h[" + text_of(row * (row + 1) / 2 + std::stoul(j)) + "]";
  }
  return "h[(((" + i + ") * ((" + i + ") + 1)) / 2) + (" + j + ")]";
}

void print_lower_of_rows(LoopText& out, const SparseRows& a, std::size_t array_offset,
                         const std::function<std::string(const std::string& row)>& weight, bool is_matrix) {
  SparseRows shifted = a;
  for (SparseRow& row : shifted.rows) row.offset += array_offset;
  for_groups(shifted, [&](std::size_t first, std::size_t count) {
    out.loop("s", count, [&](const std::string& s) {
      const std::string w = weight(plus(first, s));
      print_lower(
          out, shifted.rows[first], s,
          [&](const std::string&, const std::string& at) {
            return (w.empty() ? "" : w + " * ") + "a[" + at + "]";
          },
          is_matrix ? in_matrix : in_rows);
    });
  });
}

}  // namespace

SparseRows::SparseRows(const Pattern& pattern, std::size_t first, std::size_t last) : cols(pattern.cols) {
  const auto columns = columns_of_rows(pattern);
  for (std::size_t i = 0; i < first; ++i) offset += columns[i].size();
  for (std::size_t i = first; i < last; ++i) {
    SparseRow row{{}, nnz, columns[i].size()};
    for (const std::uint32_t j : columns[i]) {
      const bool goes_on = !row.runs.empty() && row.runs.back().first + row.runs.back().count == j;
      if (goes_on)
        ++row.runs.back().count;
      else
        row.runs.push_back({j, 1});
    }
    nnz += row.count;
    rows.push_back(std::move(row));
  }
}

std::string print_apply(const std::string& name, const SparseRows& a) {
  return print_product(
      name, a, "z", a.cols, "y", a.rows.size(),
      [](LoopText& out, const std::string& row, const std::string& column, const std::string& at) {
        out.add("y[" + row + "] += a[" + at + "] * z[" + column + "];");
      });
}

std::string print_transpose(const std::string& name, const SparseRows& a) {
  return print_product(
      name, a, "v", a.rows.size(), "q", a.cols,
      [](LoopText& out, const std::string& row, const std::string& column, const std::string& at) {
        out.add("q[" + column + "] += a[" + at + "] * v[" + row + "];");
      });
}

std::string print_pull(const std::string& name, const SparseRows& a) {
  return print_product(
      name, a, "v", a.rows.size(), "q", a.cols,
      [](LoopText& out, const std::string& row, const std::string& column, const std::string& at) {
        out.add("q[" + column + "] -= a[" + at + "] * v[" + row + "];");
      });
}

std::string print_square(const std::string& name, const SparseRows& a) {
  LoopText out;
  const std::string n = text_of(a.cols);
  out.open("static void " + name + "(const real a[" + size(a.nnz) + "], const real w[" + size(a.rows.size()) +
           "], real q[" + n + "][" + n + "])");
  if (a.nnz == 0) {
    out.add("(void)a;");
    out.add("(void)w;");
    out.add("(void)q;");
  }
  print_lower_of_rows(
      out, a, 0, [](const std::string& row) { return "w[" + row + "]"; }, true);
  out.close();
  return out.text + "\n";
}

std::string print_transform(const std::string& name, const SparseRows& a) {
  LoopText out;
  const std::string n = text_of(a.cols), rows = text_of(a.rows.size());
  out.open("static void " + name + "(const real a[" + size(a.nnz) + "], real p[" + rows + "][" + rows +
           "], real q[" + n + "][" + n + "])");
  out.add("real m[" + rows + "][" + n + "];");
  out.open("for (int r = 0; r < " + rows + "; ++r)");
  out.open("for (int j = 0; j < " + n + "; ++j)");
  out.add("m[r][j] = (real)0;");
  out.close();
  for_entries(out, a,
              [](LoopText& lines, const std::string& row, const std::string& column, const std::string& at) {
                lines.add("m[r][" + column + "] += p[r][" + row + "] * a[" + at + "];");
              });
  out.close();
  for_groups(a, [&](std::size_t first, std::size_t count) {
    out.loop("s", count, [&](const std::string& s) {
      std::size_t in_row = 0;
      for (const SparseRun& run : a.rows[first].runs) {
        out.loop("i", run.count, [&](const std::string& i) {
          const std::string column = plus(run.first, i);
          out.open("for (int j = 0; j <= (" + column + "); ++j)");
          out.add("q[" + column + "][j] += a[" + place(a.rows[first], in_row, s, i) + "] * m[" +
                  plus(first, s) + "][j];");
          out.close();
        });
        in_row += run.count;
      }
    });
  });
  out.close();
  return out.text + "\n";
}

std::string print_cost(const std::string& name, const CostRows& rows) {
  const std::size_t n = rows.squares.cols;
  LoopText out;
  out.open("static void " + name + "(const real y[], const real a[], real h[" + text_of(n * (n + 1) / 2) +
           "], real g[" + text_of(n) + "])");
  out.open("for (int i = 0; i < " + text_of(n * (n + 1) / 2) + "; ++i)");
  out.add("h[i] = (real)0;");
  out.close();
  out.open("for (int i = 0; i < " + text_of(n) + "; ++i)");
  out.add("g[i] = (real)0;");
  out.close();
  if (rows.squares.nnz == 0) out.add("(void)y;");
  if (rows.squares.nnz + rows.plain.nnz + rows.curvatures.nnz == 0) out.add("(void)a;");
  const auto at_offset = [](SparseRows a) {
    for (SparseRow& row : a.rows) row.offset += a.offset;
    return a;
  };
  for_entries(out, at_offset(rows.squares),
              [&](LoopText& lines, const std::string& row, const std::string& column, const std::string& at) {
                lines.add("g[" + column + "] += a[" + at + "] * y[" + moved(rows.value, row) + "];");
              });
  for_entries(out, at_offset(rows.plain),
              [](LoopText& lines, const std::string&, const std::string& column, const std::string& at) {
                lines.add("g[" + column + "] += a[" + at + "];");
              });
  for (const SparseRows* part : {&rows.squares, &rows.curvatures})
    print_lower_of_rows(
        out, *part, part->offset, [](const std::string&) { return std::string(); }, false);
  out.close();
  return out.text + "\n";
}

}  // namespace dyntape
