// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/io/gnuplot_text.h>

#include <charconv>
#include <cmath>

namespace dyntape::io {

std::string gnuplot_quoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) {
    const bool control = static_cast<unsigned char>(c) < ' ' || c == 0x7f;
    if (c == '\'') quoted += '\'';
    quoted += control ? ' ' : c;
  }
  return quoted + "'";
}

std::string gnuplot_number(double value) {
  if (!std::isfinite(value)) return "NaN";
  char buffer[40];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::general, 10).ptr};
}

double text_width(const std::string& text, double size) {
  double letters = 0;
  for (const char c : text) letters += (c & 0xC0) == 0x80 ? 0 : 1;
  return 0.56 * size * letters;
}

}  // namespace dyntape::io
