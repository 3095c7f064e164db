// SPDX-License-Identifier: BSD-3-Clause
//
// Draws plots of curves and strobe pictures of motions with gnuplot (Debian: gnuplot-nox).
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
// Layout and style:
//
// - Panels are in a grid with `columns` columns.  A `wide` panel fills a row.
// - Legends are above the data, never on it.
// - Colours are from the palette of Okabe and Ito, which is safe for colour-blind readers.  From the eighth series
// on, dashes and points differ as well.  Within a picture, one style belongs to one name.
// - Values that are not finite leave a gap.  On a logarithmic axis so do values <= 0, unless `zero` is set.
// - The same plot gives the same SVG bytes with the same version of gnuplot.
//
// Errors.  ArgumentError: x and y of different length, no data, an extension other than .svg and .png.  ToolError:
// gnuplot is missing or fails.  The file is written atomically.
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
  std::string color = {};  // "#0072b2"; "" takes the next colour of the palette
  int style = -1;          // index of colour, point and dashes, to match panels; -1: the next free index
  double width = 2;        // of the line [px]
  bool dashed = false;
  std::string target_of = {};  // name of the series whose target this is; drawn dotted in its colour
  bool filled = false;         // a closed outline, filled with a paler, transparent colour
  double point = 1;            // relative size of points
  int layer = 0;  // higher layers are drawn over lower ones; the legend keeps the order of the list
};

struct ReferenceLine {
  double value;
  std::string text = {};
};

// A text in a panel, centred at (x, y).
struct Remark {
  double x, y;
  std::string text;
};

// The visible range of an axis; NaN: automatic.
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
  // On a logarithmic axis: the position of a separate line, labelled 0, for exact zeros.  NaN: no such line.
  double zero = std::numeric_limits<double>::quiet_NaN();
  bool equal_axes = false;  // same scale in x and y; widens the limits to fit
  bool wide = false;
  bool starts_row = false;  // of the grid
  int height = 230;         // of the frame [px]
};

struct Plot {
  std::string title = {};
  std::vector<Panel> panels = {};
  int columns = 1;
  int width = 860;          // of the picture [px]
  bool one_legend = false;  // one legend above all panels, in place of one per panel
};

void draw(const Plot& plot, const std::string& path, const std::string& gnuplot = "gnuplot",
          const std::stop_token& stop = {});

// The gnuplot script; `format` is "svg" or "png".
std::string gnuplot_script(const Plot& plot, const std::string& format, const std::string& output);

// A robot at one time, as lines in the plane of the picture [m].  Corners of the lines are joints.
using Polyline = std::vector<std::array<double, 2>>;
struct MotionFrame {
  double time;  // [s]
  std::vector<Polyline> parts;
  std::vector<Polyline> behind = {};    // parts hidden by obstacles, drawn paler
  std::vector<Polyline> in_front = {};  // parts of `behind` that are in front again, without corners
};

struct Trace {
  std::string name;
  Polyline points;
};

struct Obstacle {
  std::string text;  // name of the obstacle
  Polyline outline;  // closed
  bool is_solid = true;
};

struct Motion {
  std::string title = {}, x_label = "x [m]", y_label = "z [m]";
  std::vector<MotionFrame> frames = {};  // in the order of time
  std::vector<Trace> traces = {};        // paths of points, dashed
  std::vector<Polyline> scenery = {};    // ground, rails, walls
  std::vector<Obstacle> obstacles = {};
  int most_frames = 15;  // frames drawn, evenly in time, always with the first and the last
};

// A strobe picture: later frames are darker; the first and the last frame have their own colours.
Panel motion_panel(const Motion& motion);

// Interpolates from colour `first` (s = 0) to `last` (s = 1), both #rrggbb.
std::string shade(const std::string& first, const std::string& last, double s);

// At most 2000 of the values, evenly spaced; a picture cannot show more.
std::vector<double> thinned(const std::vector<double>& values);

}  // namespace dyntape::io
