// SPDX-License-Identifier: BSD-3-Clause
//
// The gnuplot script of a plot.  Every margin is set in pixels and the legend is drawn here, so that panels
// line up and nothing depends upon gnuplot's own guesses.
#include <dyntape/interface/io/picture.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/gnuplot_text.h>

namespace dyntape::io {
namespace {

// M. Okabe and K. Ito, "Color Universal Design", without the yellow, too light for lines on white.
constexpr const char* kPalette[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                    "#e69f00", "#56b4e9", "#444444"};
constexpr int kColors = 7;
constexpr int kPointTypes[] = {7, 5, 9, 13, 11, 15, 3};
constexpr int kDashes[] = {1, 2, 4, 5};

constexpr double kTextSize = 13, kSmallSize = 11.5, kTitleSize = 17;
constexpr double kLeft = 78, kRight = 26, kBottom = 58, kTop = 14;  // around the frame of a panel [px]
constexpr double kHeadRow = 24, kTitleRow = 40, kTextRow = 16;
constexpr double kSample = 26;  // the line in the legend [px]

struct Style {
  std::string color;
  int dash, point;
};

// What stands where: one entry a panel.
struct Place {
  Box frame;
  std::vector<std::vector<size_t>> legend;  // rows of indices into series
};

std::vector<Style> styles_of(const Panel& panel) {
  std::vector<Style> styles;
  int next = 0;
  for (const Series& series : panel.series) {
    const bool own = !series.color.empty();
    const int round = own ? 0 : next / kColors, index = own ? 0 : next % kColors;
    const int dash = series.dashed ? 2 : kDashes[round % 4];
    styles.push_back({own ? series.color : kPalette[index], dash, kPointTypes[index]});
    if (!own) ++next;
  }
  return styles;
}

std::vector<std::vector<size_t>> legend_rows(const Panel& panel, double width) {
  std::vector<std::vector<size_t>> rows;
  double used = 0;
  for (size_t i = 0; i < panel.series.size(); ++i) {
    if (panel.series[i].name.empty()) continue;
    const double need = kSample + 24 + text_width(panel.series[i].name, kTextSize);
    if (rows.empty() || used + need > width) {
      rows.emplace_back();
      used = 0;
    }
    rows.back().push_back(i);
    used += need;
  }
  return rows;
}

// Texts of reference lines stand outside of the frame, where no curve runs: right of it and above it.
double right_margin(const Panel& panel) {
  double margin = kRight;
  for (const ReferenceLine& line : panel.horizontal) {
    if (!line.text.empty()) margin = std::max(margin, 14 + text_width(line.text, kSmallSize));
  }
  return margin;
}

double head_height(const Panel& panel, size_t legend_rows) {
  const bool texts = std::any_of(panel.vertical.begin(), panel.vertical.end(),
                                 [](const ReferenceLine& line) { return !line.text.empty(); });
  const double rows = static_cast<double>(legend_rows) + (panel.title.empty() ? 0 : 1);
  return kTop + kHeadRow * rows + (texts ? kTextRow : 0);
}

// Fills `places`, row by row of the grid; returns the height of the picture.
double arrange(const Plot& plot, std::vector<Place>& places) {
  const double cell = static_cast<double>(plot.width) / plot.columns;
  double y = plot.title.empty() ? 6 : kTitleRow + 6;
  size_t i = 0;
  while (i < plot.panels.size()) {
    double head = 0, height = 0;
    const size_t first = i;
    for (int column = 0; column < plot.columns && i < plot.panels.size(); ++column, ++i) {
      const Panel& panel = plot.panels[i];
      if (panel.wide && column > 0) break;
      const double left = column * cell + kLeft,
                   right = (panel.wide ? plot.width : (column + 1) * cell) - right_margin(panel);
      places.push_back({{left, 0, right, 0}, legend_rows(panel, right - left)});
      head = std::max(head, head_height(panel, places.back().legend.size()));
      height = std::max(height, static_cast<double>(panel.height));
      if (panel.wide) column = plot.columns;
    }
    for (size_t k = first; k < i; ++k) {
      places[k].frame.top = y + head;
      places[k].frame.bottom = y + head + height;
    }
    y += head + height + kBottom;
  }
  return std::ceil(y + 4);
}

bool drawable(const Panel& panel, double x, double y) {
  return std::isfinite(x) && std::isfinite(y) && (!panel.log_x || x > 0) && (!panel.log_y || y > 0);
}

void check(const Plot& plot) {
  if (plot.panels.empty()) throw ArgumentError("draw: the plot '" + plot.title + "' has no panels");
  if (plot.columns < 1) throw ArgumentError("draw: a plot needs at least one column");
  for (const Panel& panel : plot.panels) {
    bool any = false;
    for (const Series& s : panel.series) {
      if (s.x.size() != s.y.size()) {
        throw ArgumentError("draw: the series '" + s.name + "' has " + std::to_string(s.x.size()) +
                            " x and " + std::to_string(s.y.size()) + " y");
      }
      for (size_t i = 0; i < s.x.size(); ++i) any |= drawable(panel, s.x[i], s.y[i]);
    }
    if (!any) throw ArgumentError("draw: the panel '" + panel.title + "' has no point that can be drawn");
  }
}

struct Extent {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

void data_extent(const Panel& panel, Extent& x, Extent& y) {
  for (const Series& s : panel.series) {
    for (size_t i = 0; i < s.x.size(); ++i) {
      if (!drawable(panel, s.x[i], s.y[i])) continue;
      x.add(s.x[i]);
      y.add(s.y[i]);
    }
  }
}

// Makes room around the data and then widens the axis that is too short for its side of the frame.
void equalize(const Panel& panel, const Box& frame, Limits& x_limits, Limits& y_limits) {
  Extent x, y;
  data_extent(panel, x, y);
  for (const double given : {panel.x_limits.low, panel.x_limits.high}) {
    if (std::isfinite(given)) x.add(given);
  }
  for (const double given : {panel.y_limits.low, panel.y_limits.high}) {
    if (std::isfinite(given)) y.add(given);
  }
  const double width = frame.right - frame.left, height = frame.bottom - frame.top;
  const double span = std::max({x.high - x.low, y.high - y.low, 1e-9});
  const double metre_per_pixel =
      1.1 * std::max({(x.high - x.low) / width, (y.high - y.low) / height, 1e-3 * span / width});
  const auto centred = [&](const Extent& e, double pixels) {
    const double middle = 0.5 * (e.low + e.high), half = 0.5 * pixels * metre_per_pixel;
    return Limits{middle - half, middle + half};
  };
  x_limits = centred(x, width);
  y_limits = centred(y, height);
}

// A constant curve would be drawn in a range of no height.
void open_up(const Panel& panel, bool log, bool vertical, Limits& limits) {
  if (std::isfinite(limits.low) || std::isfinite(limits.high)) return;
  Extent x, y;
  data_extent(panel, x, y);
  Extent& e = vertical ? y : x;
  for (const ReferenceLine& line : vertical ? panel.horizontal : panel.vertical) e.add(line.value);
  const double size = std::max(std::abs(e.low), std::abs(e.high));
  const bool flat = e.high - e.low <= 1e-12 * size;
  if (log && flat) limits = {e.low / 3, e.high * 3};
  if (!log && flat) limits = {e.low - (size > 0 ? 0.1 * size : 1), e.high + (size > 0 ? 0.1 * size : 1)};
  // Reference lines are no data to gnuplot: the range has to be told about them.
  if (!log && !flat && vertical && !panel.horizontal.empty()) {
    limits = {e.low - 0.08 * (e.high - e.low), e.high + 0.08 * (e.high - e.low)};
  }
}

class Script {
 public:
  Script(const Canvas& canvas) : canvas_(canvas) {}
  const std::string& text() const { return text_; }
  void add(const std::string& line) { text_ += line + '\n'; }

  void label(const std::string& text, const std::string& at, double size, const std::string& rest) {
    add("set label " + gnuplot_quoted(text) + " at " + at + " noenhanced font '," + gnuplot_number(size) +
        "' " + rest);
  }

  void data(const Panel& panel) {
    for (size_t k = 0; k < panel.series.size(); ++k) {
      const Series& s = panel.series[k];
      add("$d" + std::to_string(k) + " << EOD");
      for (size_t i = 0; i < s.x.size(); ++i) {
        const bool shown = drawable(panel, s.x[i], s.y[i]);
        add(shown ? gnuplot_number(s.x[i]) + ' ' + gnuplot_number(s.y[i]) : std::string("NaN NaN"));
      }
      add("EOD");
    }
  }

  void axes(const Panel& panel, const Box& frame) {
    add("set lmargin at screen " + canvas_.x(frame.left) + "; set rmargin at screen " +
        canvas_.x(frame.right));
    add("set tmargin at screen " + canvas_.y(frame.top) + "; set bmargin at screen " +
        canvas_.y(frame.bottom));
    Limits x = panel.x_limits, y = panel.y_limits;
    open_up(panel, panel.log_x, false, x);
    open_up(panel, panel.log_y, true, y);
    if (panel.equal_axes) equalize(panel, frame, x, y);
    axis("x", panel.log_x, x);
    axis("y", panel.log_y, y);
    const double middle_x = 0.5 * (frame.left + frame.right), middle_y = 0.5 * (frame.top + frame.bottom);
    label(panel.x_label, canvas_.at(middle_x, frame.bottom + 40), kTextSize, "center tc rgb '#333333'");
    label(panel.y_label, canvas_.at(frame.left - 60, middle_y), kTextSize,
          "center rotate by 90 tc rgb '#333333'");
    const bool dots = std::any_of(panel.series.begin(), panel.series.end(), [](const Series& s) {
      return s.mark == Mark::kPoints || s.mark == Mark::kBoth;
    });
    if (!dots) add("set autoscale xfix");
  }

  void axis(const std::string& name, bool log, const Limits& limits) {
    const auto end = [](double value) {
      return std::isfinite(value) ? gnuplot_number(value) : std::string("*");
    };
    add(log ? "set logscale " + name + "; set format " + name + " '10^{%T}'"
            : "set format " + name + " '%h'");
    add("set " + name + "range [" + end(limits.low) + ":" + end(limits.high) + "]");
  }

  void references(const Panel& panel) {
    const std::string look = " nohead back lc rgb '#8a8a8a' lw 1.2 dt 2";
    for (const ReferenceLine& line : panel.horizontal) {
      const std::string v = gnuplot_number(line.value);
      add("set arrow from graph 0, first " + v + " to graph 1, first " + v + look);
      if (line.text.empty()) continue;
      label(line.text, "graph 1, first " + v, kSmallSize, "left offset 0.5, 0 tc rgb '#666666' front");
    }
    for (const ReferenceLine& line : panel.vertical) {
      const std::string v = gnuplot_number(line.value);
      add("set arrow from first " + v + ", graph 0 to first " + v + ", graph 1" + look);
      if (line.text.empty()) continue;
      label(line.text, "first " + v + ", graph 1", kSmallSize, "center offset 0, 0.6 tc rgb '#666666' front");
    }
    for (const Annotation& note : panel.notes) {
      label(note.text, "first " + gnuplot_number(note.x) + ", first " + gnuplot_number(note.y), kSmallSize,
            "left offset 0.7, 0.5 point pt 7 ps 0.6 lc rgb '#333333' tc rgb '#333333' front");
    }
  }

  void head(const Panel& panel, const Place& place, const std::vector<Style>& styles) {
    double y = place.frame.top - head_height(panel, place.legend.size()) + kTop + 2;
    if (!panel.title.empty()) {
      label(panel.title, canvas_.at(place.frame.left, y), kTextSize + 1, "left tc rgb '#222222'");
      y += kHeadRow;
    }
    for (const auto& row : place.legend) {
      double x = place.frame.left;
      for (const size_t i : row) x = legend_entry(panel.series[i], styles[i], x, y);
      y += kHeadRow;
    }
  }

  double legend_entry(const Series& s, const Style& style, double x, double y) {
    const std::string color = " lc rgb '" + style.color + "'";
    if (s.mark != Mark::kPoints) {
      add("set arrow from " + canvas_.at(x, y) + " to " + canvas_.at(x + kSample, y) + " nohead lw " +
          gnuplot_number(s.width) + color + " dt " + std::to_string(style.dash));
    }
    if (s.mark == Mark::kPoints || s.mark == Mark::kBoth) {
      add("set label '' at " + canvas_.at(x + kSample / 2, y) + " point pt " + std::to_string(style.point) +
          " ps " + gnuplot_number(0.7 * s.point) + color);
    }
    label(s.name, canvas_.at(x + kSample + 6, y), kTextSize, "left tc rgb '#333333'");
    return x + kSample + 24 + text_width(s.name, kTextSize);
  }

  void curves(const Panel& panel, const std::vector<Style>& styles) {
    std::vector<size_t> order(panel.series.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(),
                     [&](size_t a, size_t b) { return panel.series[a].layer < panel.series[b].layer; });
    std::string command = "plot ";
    for (const size_t i : order) {
      const Series& s = panel.series[i];
      const char* with[] = {"lines", "points", "linespoints", "steps"};
      command += (i != order.front() ? ", \\\n  " : "") + ("$d" + std::to_string(i)) + " using 1:2 with " +
                 with[static_cast<int>(s.mark)];
      command += " lc rgb '" + styles[i].color + "'";
      if (s.mark != Mark::kPoints)
        command += " lw " + gnuplot_number(s.width) + " dt " + std::to_string(styles[i].dash);
      const bool dots = s.mark == Mark::kPoints || s.mark == Mark::kBoth;
      if (dots) command += " pt " + std::to_string(styles[i].point) + " ps " + gnuplot_number(0.7 * s.point);
    }
    add(command);
  }

 private:
  Canvas canvas_;
  std::string text_;
};

std::string terminal(const std::string& format, const Canvas& canvas) {
  const auto pixels = [](double size) { return std::to_string(std::lround(size)); };
  if (format == "svg") {
    return "set terminal svg size " + pixels(canvas.width) + "," + pixels(canvas.height) +
           " fixed enhanced rounded font 'sans-serif,13' background '#ffffff' name 'dyntape'";
  }
  return "set terminal pngcairo size " + pixels(2 * canvas.width) + "," + pixels(2 * canvas.height) +
         " enhanced rounded font 'sans,13' fontscale 1.5 linewidth 2 pointscale 2 background '#ffffff'";
}

}  // namespace

std::string gnuplot_script(const Plot& plot, const std::string& format, const std::string& output) {
  check(plot);
  std::vector<Place> places;
  const double height = arrange(plot, places);
  const Canvas canvas{static_cast<double>(plot.width), height};
  Script script(canvas);
  script.add(terminal(format, canvas));
  script.add("set encoding utf8; set minussign; set output " + gnuplot_quoted(output));
  script.add("set multiplot; unset key; set border 3 lc rgb '#9a9a9a' lw 1");
  script.add("set tics nomirror out scale 0.5 textcolor rgb '#444444' font ',12'");
  script.add("set grid back lt 1 lw 0.8 lc rgb '#e4e4e4'");
  for (size_t i = 0; i < plot.panels.size(); ++i) {
    const Panel& panel = plot.panels[i];
    const std::vector<Style> styles = styles_of(panel);
    script.data(panel);
    script.axes(panel, places[i].frame);
    script.references(panel);
    script.head(panel, places[i], styles);
    if (i == 0 && !plot.title.empty()) {
      script.label(plot.title, canvas.at(kLeft, kTitleRow / 2 + 6), kTitleSize, "left tc rgb '#111111'");
    }
    script.curves(panel, styles);
    script.add("unset label; unset arrow; unset logscale; set autoscale");
  }
  script.add("unset multiplot; unset output");
  return script.text();
}

}  // namespace dyntape::io
