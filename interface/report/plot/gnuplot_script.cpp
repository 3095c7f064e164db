// SPDX-License-Identifier: BSD-3-Clause
//
// The gnuplot script of a plot.  Every margin is set in pixels and the legend is drawn here, so that panels
// line up and nothing depends upon gnuplot's own guesses.
#include <dyntape/interface/report/plot/picture.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/report/plot/gnuplot_text.h>
#include <dyntape/interface/report/plot/picture_layout.h>
#include <dyntape/interface/report/plot/series_looks.h>

namespace dyntape::io {
namespace {

void check(const Plot& plot) {
  if (plot.panels.empty()) throw ArgumentError("draw: the plot '" + plot.title + "' has no panels");
  if (plot.columns < 1) throw ArgumentError("draw: a plot needs at least one column");
  for (const Panel& panel : plot.panels) {
    bool any = false;
    for (const Series& s : panel.series) {
      if (s.x.size() != s.y.size())
        throw ArgumentError("draw: the series '" + s.name + "' has " + std::to_string(s.x.size()) +
                            " x and " + std::to_string(s.y.size()) + " y");
      for (size_t i = 0; i < s.x.size(); ++i) any |= drawable(panel, s.x[i], drawn_y(panel, s.y[i]));
    }
    if (!any) throw ArgumentError("draw: the panel '" + panel.title + "' has no point that can be drawn");
  }
}

class Script {
 public:
  explicit Script(const Canvas& canvas) : canvas_(canvas) {}
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
        const double y = drawn_y(panel, s.y[i]);
        const bool shown = drawable(panel, s.x[i], y);
        add(shown ? gnuplot_number(s.x[i]) + ' ' + gnuplot_number(y) : std::string("NaN NaN"));
      }
      add("EOD");
    }
  }

  void label_axes(const Panel& panel, const Box& frame) {
    const double middle_x = 0.5 * (frame.left + frame.right), middle_y = 0.5 * (frame.top + frame.bottom);
    label(panel.x_label, canvas_.at(middle_x, frame.bottom + 40), kTextSize, "center tc rgb '#333333'");
    label(panel.y_label, canvas_.at(frame.left - 81, middle_y), kTextSize,
          "center rotate by 90 tc rgb '#333333'");
  }

  void axes(const Panel& panel, const Box& frame) {
    add("set lmargin at screen " + canvas_.x(frame.left) + "; set rmargin at screen " +
        canvas_.x(frame.right));
    add("set tmargin at screen " + canvas_.y(frame.top) + "; set bmargin at screen " +
        canvas_.y(frame.bottom));
    Limits x, y;
    choose_limits(panel, frame, x, y);
    axis("x", panel.log_x, x);
    axis("y", panel.log_y, y);
    const double step = tick_step(panel, frame, x);
    if (std::isfinite(step) && step > 0) add("set xtics " + gnuplot_number(step));
    if (std::isfinite(panel.zero)) add("set ytics add ('0' " + gnuplot_number(panel.zero) + ")");
    label_axes(panel, frame);
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
    if (std::isfinite(panel.zero)) {
      const std::string v = gnuplot_number(panel.zero);
      add("set arrow from graph 0, first " + v + " to graph 1, first " + v + look);
    }
    for (const ReferenceLine& line : panel.horizontal) {
      if (panel.log_y && line.value <= 0) continue;
      const std::string v = gnuplot_number(line.value);
      add("set arrow from graph 0, first " + v + " to graph 1, first " + v + look);
      if (line.text.empty()) continue;
      label(line.text, "graph 1, first " + v, kSmallSize, "left offset 0.5, 0 tc rgb '#666666' front");
    }
    for (const ReferenceLine& line : panel.vertical) {
      const std::string v = gnuplot_number(line.value);
      add("set arrow from first " + v + ", graph 0 to first " + v + ", graph 1" + look);
      if (line.text.empty()) continue;
      label(line.text, "first " + v + ", graph 0.97", kSmallSize,
            "right rotate by 90 offset -1, 0 tc rgb '#666666' front");
    }
    for (const Remark& remark : panel.remarks) {
      label(remark.text, "first " + gnuplot_number(remark.x) + ", first " + gnuplot_number(remark.y),
            kSmallSize, "center tc rgb '#444444' front");
    }
  }

  void head(const Plot& plot, size_t number, const Place& place,
            const std::vector<std::vector<Look>>& looks) {
    const Panel& panel = plot.panels[number];
    double y = place.head + 2;
    if (!panel.title.empty()) {
      label(panel.title, canvas_.at(place.frame.left, y), kTextSize + 1, "left tc rgb '#222222'");
      y += kHeadRow;
    }
    legend(plot, place.legend, y, looks);
  }

  void legend(const Plot& plot, const std::vector<LegendRow>& rows, double y,
              const std::vector<std::vector<Look>>& looks) {
    for (const LegendRow& row : rows) {
      for (const LegendEntry& e : row)
        legend_entry(plot.panels[e.panel].series[e.series], looks[e.panel][e.series], e.x, y);
      y += kHeadRow;
    }
  }

  void legend_entry(const Series& s, const Look& style, double x, double y) {
    const std::string color = " lc rgb '" + style.color + "'";
    if (s.mark != Mark::kPoints) {
      add("set arrow from " + canvas_.at(x, y) + " to " + canvas_.at(x + kSample, y) + " nohead lw " +
          gnuplot_number(s.width) + color + " dt " + style.dash);
    }
    if (s.mark == Mark::kPoints || s.mark == Mark::kBoth) {
      add("set label '' at " + canvas_.at(x + kSample / 2, y) + " point pt " + std::to_string(style.point) +
          " ps " + gnuplot_number(0.7 * s.point) + color);
    }
    const double room = canvas_.width - (x + kSample + 12);
    label(shortened(s.name, kTextSize, room), canvas_.at(x + kSample + 6, y), kTextSize,
          "left tc rgb '#333333'");
  }

  void curves(const Panel& panel, const std::vector<Look>& styles) {
    std::vector<size_t> order(panel.series.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(),
                     [&](size_t a, size_t b) { return panel.series[a].layer < panel.series[b].layer; });
    std::string command = "plot ";
    for (const size_t i : order) {
      command += (i != order.front() ? ", \\\n  " : "") + ("$d" + std::to_string(i)) + " using 1:2 with " +
                 style_of(panel.series[i], styles[i]);
    }
    add(command);
  }

  static std::string style_of(const Series& s, const Look& look) {
    if (s.filled)
      return "filledcurves closed fc rgb '#ebebeb' fs transparent solid 0.8 border lc rgb '" + look.color +
             "' lw " + gnuplot_number(s.width);
    const char* with[] = {"lines", "points", "linespoints"};
    std::string style = with[static_cast<int>(s.mark)] + (" lc rgb '" + look.color) + "'";
    if (s.mark != Mark::kPoints) style += " lw " + gnuplot_number(s.width) + " dt " + look.dash;
    const bool dots = s.mark == Mark::kPoints || s.mark == Mark::kBoth;
    if (dots) style += " pt " + std::to_string(look.point) + " ps " + gnuplot_number(0.7 * s.point);
    return style;
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
  const Layout layout = arrange(plot);
  const std::vector<std::vector<Look>> looks = looks_of(plot);
  const Canvas canvas{static_cast<double>(plot.width), layout.height};
  Script script(canvas);
  script.add(terminal(format, canvas));
  script.add("set encoding utf8; set minussign; set output " + gnuplot_quoted(output));
  script.add("set multiplot; unset key; set border 3 lc rgb '#9a9a9a' lw 1");
  script.add("set tics nomirror out scale 0.5 textcolor rgb '#444444' font ',12'");
  script.add("set grid back lt 1 lw 0.8 lc rgb '#e4e4e4'");
  for (size_t i = 0; i < plot.panels.size(); ++i) {
    const Panel& panel = plot.panels[i];
    script.data(panel);
    script.axes(panel, layout.places[i].frame);
    script.references(panel);
    script.head(plot, i, layout.places[i], looks);
    if (i == 0 && !plot.title.empty()) {
      script.label(plot.title, canvas.at(kLeft, kTitleRow / 2 + 6), kTitleSize, "left tc rgb '#111111'");
    }
    if (i == 0) script.legend(plot, layout.legend, layout.legend_top, looks);
    script.curves(panel, looks[i]);
    script.add("unset label; unset arrow; unset logscale; set autoscale; set xtics autofreq");
    if (std::isfinite(panel.zero)) script.add("set ytics autofreq");  // the next panel has no zero there
  }
  script.add("unset multiplot; unset output");
  return script.text();
}

}  // namespace dyntape::io
