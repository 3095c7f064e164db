// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/report/plot/gnuplot_text.h>

#include <cmath>
#include <cstring>

#include <dyntape/interface/io/number.h>

namespace dyntape::io {

std::string gnuplot_quoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) {
    const bool control = static_cast<unsigned char>(c) < ' ' || c == 0x7f;
    // A doubled quote would do but at the beginning, where gnuplot 5 takes it for an empty text.
    if (c == '\'')
      quoted += "'.\"'\".'";
    else
      quoted += control ? ' ' : c;
  }
  return quoted + "'";
}

std::string gnuplot_number(double value) { return std::isfinite(value) ? with_digits(value, 10) : "NaN"; }

// Means of letters that are alike; sans-serif fonts differ by some percent.
double text_width(const std::string& text, double size) {
  double ems = 0;
  for (const char c : text) {
    if ((c & 0xC0) == 0x80) continue;  // not the first byte of a character
    const bool narrow = std::strchr("ijltf.,:;|!'()[] ", c) != nullptr;
    const bool broad = std::strchr("mwMW@%&", c) != nullptr;
    ems += narrow ? 0.34 : broad ? 0.9 : std::isupper(static_cast<unsigned char>(c)) ? 0.68 : 0.61;
  }
  return ems * size;
}

}  // namespace dyntape::io
