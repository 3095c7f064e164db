// SPDX-License-Identifier: BSD-3-Clause
//
// On a system with a C library.  Instructions are not counted.
#include <stdio.h>

#include "target.h"

void put(const char* text) { fputs(text, stdout); }
void put_number(const char* name, int32_t number) { printf("%s%d\n", name, (int)number); }
uint32_t instructions(void) { return 0; }

int main(void) {
  run();
  return 0;
}
