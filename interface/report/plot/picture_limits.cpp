// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include <dyntape/interface/io/number.h>
#include <dyntape/interface/report/plot/picture_layout.h>

namespace dyntape::io {

double drawn_y(const Panel& panel, double y) { return y == 0 && std::isfinite(panel.zero) ? panel.zero : y; }

bool drawable(const Panel& panel, double x, double y) {
  return std::isfinite(x) && std::isfinite(y) && (!panel.log_x || x > 0) && (!panel.log_y || y > 0);
}

namespace {

constexpr double kLeastSpan = 1e-9;  // of their size: axes give what differs by less one number

struct DataExtent {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

void data_extent(const Panel& panel, DataExtent& x, DataExtent& y) {
  for (const Series& s : panel.series) {
    for (size_t i = 0; i < s.x.size(); ++i) {
      const double at = drawn_y(panel, s.y[i]);
      if (!drawable(panel, s.x[i], at)) continue;
      x.add(s.x[i]);
      y.add(at);
    }
  }
}

// Makes room around the data and then widens the axis that is too short for its side of the frame.
void equalize(const Panel& panel, const Box& frame, Limits& x_limits, Limits& y_limits) {
  DataExtent x, y;
  data_extent(panel, x, y);
  for (const double given : {panel.y_limits.low, panel.y_limits.high}) {
    if (std::isfinite(given)) y.add(given);
  }
  const double width = frame.right - frame.left, height = frame.bottom - frame.top;
  const double span = std::max(x.high - x.low, y.high - y.low);
  const double size = std::max({std::abs(x.low), std::abs(x.high), std::abs(y.low), std::abs(y.high)});
  const double metre_per_pixel =
      span <= kLeastSpan * size || span == 0
          ? 1 / width  // one point: a metre around it
          : 1.1 * std::max({(x.high - x.low) / width, (y.high - y.low) / height, 1e-3 * span / width});
  const auto centred = [&](const DataExtent& e, double pixels) {
    const double middle = 0.5 * (e.low + e.high), half = 0.5 * pixels * metre_per_pixel;
    return Limits{middle - half, middle + half};
  };
  x_limits = centred(x, width);
  y_limits = centred(y, height);
}

// Gnuplot looks at data only, and leaves no height to a constant: both are mended here.
Limits widened(const DataExtent& data, const std::vector<ReferenceLine>& lines, bool log, bool pad) {
  DataExtent all = data;
  for (const ReferenceLine& line : lines) {
    if (!log || line.value > 0) all.add(line.value);
  }
  const double size = std::max(std::abs(all.low), std::abs(all.high));
  if (all.high - all.low <= kLeastSpan * size) {
    const double half = size > 0 ? 0.1 * size : 1;
    return log ? Limits{all.low / 3, all.high * 3} : Limits{all.low - half, all.high + half};
  }
  if (all.low >= data.low && all.high <= data.high && !pad) return {};
  if (log)
    return {std::pow(10, std::floor(std::log10(all.low))), std::pow(10, std::ceil(std::log10(all.high)))};
  const double room = 0.08 * (all.high - all.low);
  return {all.low - room, all.high + room};
}

// 1, 2, 5, 10, 20, ... times a power of ten, from the first that is at least as large as asked for.
double round_step(double least, int further) {
  const double power = std::pow(10, std::floor(std::log10(least)));
  constexpr double kRound[] = {1, 2, 5};
  int k = 0;
  const auto step = [&](int i) { return power * kRound[i % 3] * std::pow(10, i / 3); };
  while (step(k) < least * (1 - 1e-9)) ++k;
  return step(k + further);
}

bool given(const Limits& limits) { return std::isfinite(limits.low) || std::isfinite(limits.high); }

}  // namespace

void choose_limits(const Panel& panel, const Box& frame, Limits& x, Limits& y) {
  if (panel.equal_axes) return equalize(panel, frame, x, y);
  DataExtent x_data, y_data;
  data_extent(panel, x_data, y_data);
  x = widened(x_data, {}, panel.log_x, false);
  y = given(panel.y_limits) ? panel.y_limits
                            : widened(y_data, panel.horizontal, panel.log_y, !panel.horizontal.empty());
}

double tick_step(const Panel& panel, const Box& frame, const Limits& x) {
  constexpr int kMostTicks = 8;
  constexpr double kGap = 10;  // px between two numbers
  DataExtent shown;
  if (std::isfinite(x.low) && std::isfinite(x.high)) {
    shown.add(x.low), shown.add(x.high);
  } else {
    DataExtent y;
    data_extent(panel, shown, y);
  }
  const double width = frame.right - frame.left;
  if (panel.log_x) {
    const double decades = std::ceil(std::log10(shown.high)) - std::floor(std::log10(shown.low));
    const double label = text_width("10", kSmallSize) + text_width("-10", 0.8 * kSmallSize) + kGap;
    return std::pow(10, std::max(1.0, std::ceil(decades * label / width)));
  }
  const double span = shown.high - shown.low;
  for (int further = 0; further < 12; ++further) {
    const double step = round_step(span / kMostTicks, further);
    double widest = 0;
    const double first = std::floor(shown.low / step), last = std::ceil(shown.high / step);
    for (int k = 0; k <= kMostTicks + 2 && first + k <= last; ++k)
      widest = std::max(widest, text_width(with_digits((first + k) * step, 6), kSmallSize + 1));
    // Gnuplot may widen the axis to whole steps.
    if (widest + kGap <= width / std::max(last - first, 1.0)) return step;
  }
  return span;  // one number
}

}  // namespace dyntape::io
