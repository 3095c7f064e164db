// SPDX-License-Identifier: BSD-3-Clause
//
// The loop of MinverseProduct in numbers, for each level of the processor (tools/levels.cmake).
//
//   minverse_columns({nv, known, path.data(), end.data()}, 8, in, out);      // eight lanes, entry i of lane l at [8 i + l]
#pragma once

namespace dyntape {

struct MinverseColumns {
  int nv;
  const int* known;  // (2) the first columns of the two results that need no product
  const int* path;   // the rows of each column, one after the other
  const int* end;    // (nv) where those of a column end
};

// 1, 2, 4 or 8 lanes.  Columns that are known are left to the caller.
void minverse_columns(const MinverseColumns& of, int lanes, const double* in, double* out);

}  // namespace dyntape
