// SPDX-License-Identifier: BSD-3-Clause
//
// Formats values and texts for gnuplot, and positions (private to the pictures).
#pragma once

#include <string>

namespace dyntape::io {

// A gnuplot expression: in single quotes, where nothing is substituted, with quotes of the text in double ones;
// control characters become blanks.
std::string gnuplot_quoted(const std::string& text);

// A number with ten digits, NaN if it is not finite.
std::string gnuplot_number(double value);

// The approximate width of a text in a sans-serif font of that size [px].
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
