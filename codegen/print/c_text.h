// SPDX-License-Identifier: BSD-3-Clause
//
// Pieces of C text.
//
//   append_number(text, 0.1)        0.1          the shortest spelling that reads back as the same double
//   append_number(text, -0.0)       (-0.0)       inf is HUGE_VAL, a NaN is NAN
//   append_single(text, 0.1)        0.1f         the shortest that reads back as the nearest float
//   c_identifier("arm 7-dof")       arm_7_dof; of a long name, its beginning and a checksum: files are named so too
//   c_string("a\"b")                "a\"b"
//   c_comment("a */ b")             a * / b
//
// Nothing here asks the locale.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace dyntape::codegen {

void append_number(std::string& text, double value);
void append_single(std::string& text, double value);
void append_integer(std::string& text, std::uint64_t value);
std::string c_identifier(std::string_view name);
std::string c_string(std::string_view text);
std::string c_comment(std::string_view text);

// "const uint16_t name[3] = {1, 2, 3};" of the head "uint16_t name".
std::string c_numbers(const std::string& head, const std::vector<std::uint32_t>& values);
// "static const uint32_t name[3] = {1, 2, 3};" in lines of bounded width; nothing for no values.
std::string c_table(const std::string& name, const std::vector<std::uint32_t>& values);
std::string c_table(const std::string& name, const std::vector<std::string>& values);

}  // namespace dyntape::codegen
