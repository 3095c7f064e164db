// SPDX-License-Identifier: BSD-3-Clause
#pragma once

void put(const char* text);  // given by the target
void run(void);
