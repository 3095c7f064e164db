// SPDX-License-Identifier: BSD-3-Clause
//
// What stderr is.
#pragma once

namespace dyntape::io {

bool terminal_understands();  // a terminal, and one that moves its cursor when told to
int terminal_width();         // 80 where it is not known

}  // namespace dyntape::io
