// SPDX-License-Identifier: BSD-3-Clause
// Does not compile: the header of other bases is missing, and the compiler says which.
#include <dyntape/interface/cppad/cppad.h>

struct Number {
  Number(double) {}  // NOLINT
};

int main() {
  const CppAD::AD<Number> x(1.0);
  return 0;
}
