// SPDX-License-Identifier: BSD-3-Clause
//
// The harness as a program of an operating system.
#include <stdio.h>

#include "harness.h"

void put(const char* text) { fputs(text, stdout); }

int main(void) {
  run();
  return 0;
}
