// SPDX-License-Identifier: BSD-3-Clause
//
// Prints the statements of a schedule: one `const real tN = ...;` a line.
// A real is a number, or a vector with a number a lane (print_lanes.h).
//
//   BodyStyle style = {{"x", "p", "w"}, outputs, callees};
//   append_piece(text, function, schedule, 0, style);
#pragma once

#include <map>
#include <string>
#include <vector>

#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/codegen/schedule/schedule.h>

namespace dyntape::codegen {

// Where a range of outputs is written: `array[k - begin] = ...`, or at the places given.
struct OutputArray {
  std::string name;
  std::string heading;  // "Jacobian (96 of 540 entries)"
  std::size_t begin, end;
  std::vector<std::size_t> places = {};
  std::size_t place(std::size_t k) const { return places.empty() ? k - begin : places[k - begin]; }
};

// What the statements are written for.
struct Dialect {
  bool lanes = true;    // for one state and for several: DT_NAME(f), DT_ALL(1.5), reals in memory
  bool single = false;  // numbers are floats: 1.5f
  // For a device (print_device.h), without lanes: sine and cosine of one argument are one call, dt_sincos, and kernels
  // written by hand are those of lanes, where they have such a form.
  bool device = false;
  Functions functions = kDefaultFunctions;  // portable ones of one state are called together: DT_MANY
};

// How a callee is called: its C function, and the slots of the caller's work array that it may write to.
struct CalleeText {
  std::string name;
  std::size_t work = 0;
};

// Where a kernel of a device has its arrays: entry k of a state is array[k * count], in an address space.
struct ArrayPlace {
  std::string space;   // "DT_GLOBAL "
  std::string stride;  // " * count"
};

struct BodyStyle {
  std::array<std::string, kBlocks> inputs;  // names of the arrays that are read
  std::vector<OutputArray> outputs;         // by group of the schedule
  const std::map<const Callee*, CalleeText>& callees;
  Dialect dialect;
  bool constant_parameters = false;  // p is an array of numbers: those of a part
  ArrayPlace read = {}, written = {};
};

// What stands between the braces of the function for one piece, indented by two.
void append_piece(std::string& text, const Function& function, const Schedule& schedule, std::size_t piece,
                  const BodyStyle& style);

}  // namespace dyntape::codegen
