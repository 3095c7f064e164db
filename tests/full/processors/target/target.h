// SPDX-License-Identifier: BSD-3-Clause
//
// What a target defines: output, and a count of instructions that wraps.
#pragma once

#include <stdint.h>

void put(const char* text);
void put_number(const char* name, int32_t number);
uint32_t instructions(void);
void run(void);
