// SPDX-License-Identifier: BSD-3-Clause
//
// Pictures of curves and of motions, drawn by gnuplot (Debian: gnuplot-nox).
//
//   Plot plot;
//   plot.title = "Cart-pole swing-up";
//   plot.panels = {{.title = "force", .x_label = "time [s]", .y_label = "u [N]",
//                   .series = {{.name = "u", .x = t, .y = u}},
//                   .horizontal = {{20, "limit"}, {-20, ""}}}};
//   draw(plot, "out/force.svg");                                     // or .png
//
//   Motion motion{.title = "arm", .frames = {{0.0, {{{0, 0}, {0.3, 0.4}, {0.7, 0.4}}}}, ...}};
//   draw({.title = "Reaching", .panels = {motion_panel(motion)}}, "out/motion.svg");
//
// Panels stand in a grid, `columns` wide; one that is `wide` takes a row of its own.  Legends stand above the
// data, never on it.  Colours are those of Okabe and Ito, which people with any colour vision tell apart;
// series beyond the seventh differ in dashes and points as well.  In one picture a look belongs to one name.  A value that is not finite, or not positive on a
// logarithmic axis without a place for zeros, leaves a gap.  The same plot gives the same bytes (of SVG), whenever and wherever it is
// drawn by one version of gnuplot.
//
// Errors.  ArgumentError: x and y of different length, nothing to draw, an extension other than .svg and
// .png. ToolError: gnuplot is missing or fails.  The file appears whole or not at all.
#pragma once

#include <array>
#include <limits>
#include <stop_token>
#include <string>
#include <vector>

namespace dyntape::io {

enum class Mark { kLine, kPoints, kBoth };

struct Series {
  std::string name = {};  // in the legend; "" keeps it out
  std::vector<double> x = {}, y = {};
  Mark mark = Mark::kLine;
  std::string color = {};  // "#0072b2"; "" takes the next of the palette
  int style = -1;          // colour, point and dashes by number, so that panels agree; -1: the next free one
  double width = 2;        // of the line [px]
  bool dashed = false;
  std::string target_of = {};  // the name of another series, what that shall be: dotted in its colour
  bool filled = false;         // a closed outline: what lies below it shows through, paler
  double point = 1;            // size of points, relative
  int layer = 0;  // higher ones are drawn over lower ones; the legend keeps the order of the list
};

struct ReferenceLine {
  double value;
  std::string text = {};
};

// A remark in the plane of a panel, centred there.
struct Remark {
  double x, y;
  std::string text;
};

// Shown part of an axis; NaN: as the data need.
struct Limits {
  double low = std::numeric_limits<double>::quiet_NaN();
  double high = std::numeric_limits<double>::quiet_NaN();
};

struct Panel {
  std::string title = {}, x_label = {}, y_label = {};
  std::vector<Series> series = {};
  std::vector<ReferenceLine> horizontal = {};
  std::vector<ReferenceLine> vertical = {};
  std::vector<Remark> remarks = {};
  bool log_x = false, log_y = false;
  Limits y_limits = {};
  // On a logarithmic axis: where exact zeros are drawn, on a line of their own that says 0.  NaN: nowhere.
  double zero = std::numeric_limits<double>::quiet_NaN();
  bool equal_axes = false;  // a metre is as long in x as in y; the limits are then widened to fit
  bool wide = false;
  int height = 230;  // of the frame [px]
};

struct Plot {
  std::string title = {};
  std::vector<Panel> panels = {};
  int columns = 1;
  int width = 860;          // of the picture [px]
  bool one_legend = false;  // above all panels, a name once, in place of one above each
};

void draw(const Plot& plot, const std::string& path, const std::string& gnuplot = "gnuplot",
          const std::stop_token& stop = {});

// What gnuplot is told; `format` is "svg" or "png".
std::string gnuplot_script(const Plot& plot, const std::string& format, const std::string& output);

// A robot at one time as lines in the plane of the picture [m], joints being their corners.
using Polyline = std::vector<std::array<double, 2>>;
struct MotionFrame {
  double time;  // [s]
  std::vector<Polyline> parts;
  std::vector<Polyline> behind = {};    // what obstacles hide, which shows through them paler
  std::vector<Polyline> in_front = {};  // what of that is before them again, without corners
};

struct Trace {
  std::string name;
  Polyline points;
};

struct Obstacle {
  std::string text;  // what it is
  Polyline outline;  // closed
  bool is_solid = true;
};

struct Motion {
  std::string title = {}, x_label = "x [m]", y_label = "z [m]";
  std::vector<MotionFrame> frames = {};  // in the order of time
  std::vector<Trace> traces = {};        // paths of points, dashed
  std::vector<Polyline> scenery = {};    // ground, rails, walls
  std::vector<Obstacle> obstacles = {};
  int most_frames = 15;  // drawn, evenly in time; the first and the last always
};

// A strobe picture: later frames darker, the first and the last in colours of their own.
Panel motion_panel(const Motion& motion);

// From the first colour to the last as s goes from 0 to 1; of #rrggbb.
std::string shade(const std::string& first, const std::string& last, double s);

// At most 2000 of them, evenly: more cannot be told apart in a picture.
std::vector<double> thinned(const std::vector<double>& values);

}  // namespace dyntape::io
