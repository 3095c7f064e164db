// SPDX-License-Identifier: BSD-3-Clause
//
// Values and texts as gnuplot reads them, and where things stand (private to the pictures).
#pragma once

#include <string>

namespace dyntape::io {

// An expression for gnuplot: in single quotes, where it substitutes nothing, and quotes of the text itself in double ones;
// control characters become blanks.
std::string gnuplot_quoted(const std::string& text);

// A number with ten digits, NaN if it is not finite.
std::string gnuplot_number(double value);

// About how wide a text comes out in a sans-serif font of that size [px].
double text_width(const std::string& text, double size);

// A rectangle in pixels, y downwards from the top of the picture.
struct Box {
  double left, top, right, bottom;
};

// Pixels to gnuplot's screen coordinates, which go from 0 to 1 and upwards.
struct Canvas {
  double width, height;
  std::string x(double pixel) const { return gnuplot_number(pixel / width); }
  std::string y(double pixel) const { return gnuplot_number(1 - pixel / height); }
  std::string at(double px, double py) const { return "screen " + x(px) + ", screen " + y(py); }
};

}  // namespace dyntape::io
