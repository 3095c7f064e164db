// SPDX-License-Identifier: BSD-3-Clause
//
// Counts what C text does at most: for bounds on the time of printed functions.
//
//   TextCount c = CountedText(text).of("lift_step");
//   c.operations, c.loads, c.stores, c.turns
//
// The text is the C that generators print: functions of declarations, assignments, `if`, and `for` loops of an int from
// a constant or an enclosing loop's variable up to such a bound, calls of functions of the text.  Of an `if` the dearer
// side counts, a `break` never leaves early.
//
//   operations   + - * / comparisons, logic, conversions, and arithmetic of array indices
//   loads        reads of arrays and members;  stores: writes
//   turns        of loops (count, compare, branch), and calls
//
// Errors.  ArgumentError with the line: a loop without such bounds (while, do, goto, recursion), a call of a function
// that is not in the text.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace dyntape {

struct TextCount {
  double operations = 0, loads = 0, stores = 0, turns = 0;
  double sum() const { return operations + loads + stores + turns; }
};
TextCount operator+(const TextCount& a, const TextCount& b);
TextCount operator*(double times, const TextCount& a);

class CountedText {
 public:
  // `constants` replaces the values of #define NAME NUMBER.
  explicit CountedText(const std::string& text, const std::map<std::string, double>& constants = {});
  TextCount of(const std::string& function) const;

 private:
  std::map<std::string, TextCount> functions_;
};

}  // namespace dyntape
