// SPDX-License-Identifier: BSD-3-Clause
//
// A motion as a panel: one series a frame.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/report/plot/picture_layout.h>

namespace dyntape::io {
namespace {

constexpr const char* kStart = "#009e73";
constexpr const char* kGoal = "#d55e00";
constexpr const char* kTrace = "#8a6d9c";
constexpr const char *kLight = "#c6d9ec", *kDark = "#163e6e";  // of frames in between
constexpr const char* kScenery = "#b5b5b5";
constexpr const char* kObstacle = "#8a8a8a";
constexpr int kObstacleLayer = -1;

// Several lines in one series: a NaN lifts the pen.
Series series_of(const std::vector<Polyline>& lines) {
  Series series;
  for (const Polyline& line : lines) {
    if (!series.x.empty()) {
      series.x.push_back(std::nan(""));
      series.y.push_back(std::nan(""));
    }
    for (const auto& [x, y] : line) {
      series.x.push_back(x);
      series.y.push_back(y);
    }
  }
  return series;
}

// The frames nearest to evenly spaced times.
std::vector<const MotionFrame*> selected(const Motion& motion) {
  const double begin = motion.frames.front().time, end = motion.frames.back().time;
  const int count = std::max(2, motion.most_frames);
  std::vector<const MotionFrame*> frames;
  for (int k = 0; k < count; ++k) {
    const double wanted = begin + (end - begin) * k / (count - 1);
    const MotionFrame* nearest = &motion.frames.front();
    for (const MotionFrame& frame : motion.frames) {
      if (std::abs(frame.time - wanted) < std::abs(nearest->time - wanted)) nearest = &frame;
    }
    if (k == count - 1) nearest = &motion.frames.back();
    if (frames.empty() || frames.back() != nearest) frames.push_back(nearest);
  }
  return frames;
}

std::string at_time(const char* what, double time) {
  return std::string(what) + " (t = " + significant(time, 3) + " s)";
}

Series frame_series(const std::vector<Polyline>& parts, const std::string& color, bool emphasized) {
  Series series = series_of(parts);
  series.mark = Mark::kBoth;
  series.color = color;
  series.width = emphasized ? 4 : 2.2;
  series.point = emphasized ? 1.1 : 0.6;
  return series;
}

void add_scenery(const Motion& motion, Panel& panel) {
  for (const Polyline& line : motion.scenery) {
    Series series = series_of({line});
    series.color = kScenery;
    series.width = 3;
    panel.series.push_back(std::move(series));
  }
  for (const Obstacle& obstacle : motion.obstacles) {
    Series series = series_of({obstacle.outline});
    series.color = kObstacle;
    series.width = 1.5;
    series.filled = obstacle.is_solid;
    series.layer = kObstacleLayer;
    panel.series.push_back(std::move(series));
  }
}

struct Rectangle {
  double left = std::numeric_limits<double>::infinity(), right = -left, low = left, high = -left;
  void add(const std::array<double, 2>& p) {
    left = std::min(left, p[0]), right = std::max(right, p[0]);
    low = std::min(low, p[1]), high = std::max(high, p[1]);
  }
  bool contains(double x, double y) const { return x > left && x < right && y > low && y < high; }
};

// Along all lines that are drawn, so that a text can keep clear of them.
std::vector<std::array<double, 2>> drawn_points(const Panel& panel) {
  constexpr int kPieces = 20;
  std::vector<std::array<double, 2>> points;
  for (const Series& s : panel.series) {
    for (size_t i = 1; i < s.x.size(); ++i) {
      for (int k = 0; k <= kPieces; ++k) {
        const double part = double(k) / kPieces;
        points.push_back(
            {s.x[i - 1] + part * (s.x[i] - s.x[i - 1]), s.y[i - 1] + part * (s.y[i] - s.y[i - 1])});
      }
    }
  }
  return points;
}

// Beside, above or below its obstacle: within the picture if possible, and where the fewest lines run.
Remark name_beside(const Obstacle& obstacle, const std::vector<std::array<double, 2>>& points,
                   const Rectangle& picture, double pixel) {
  Rectangle box;
  for (const auto& p : obstacle.outline) box.add(p);
  const double w = 0.5 * pixel * (text_width(obstacle.text, kSmallSize) + 12), h = 0.5 * pixel * 18;
  const double x = 0.5 * (box.left + box.right), y = 0.5 * (box.low + box.high);
  Remark best;
  std::pair<bool, long> least{true, std::numeric_limits<long>::max()};
  for (const auto& [cx, cy] : {std::array{box.right + w, y}, std::array{box.left - w, y},
                               std::array{x, box.high + h}, std::array{x, box.low - h}}) {
    const Rectangle text{cx - w, cx + w, cy - h, cy + h};
    const long met =
        std::count_if(points.begin(), points.end(), [&](const auto& p) { return text.contains(p[0], p[1]); });
    const bool is_cut = !(picture.contains(text.left, text.low) && picture.contains(text.right, text.high));
    if (std::pair{is_cut, met} < least) least = {is_cut, met}, best = {cx, cy, obstacle.text};
  }
  return best;
}

void add_names(const Motion& motion, Panel& panel) {
  const std::vector<std::array<double, 2>> points = drawn_points(panel);
  Rectangle all;
  for (const auto& p : points) all.add(p);
  // A pixel in the units of the axes, in a frame of about that size.
  const double pixel = 1.1 * std::max((all.right - all.left) / 750, (all.high - all.low) / panel.height);
  for (const Obstacle& obstacle : motion.obstacles)
    panel.remarks.push_back(name_beside(obstacle, points, all, pixel));
}

// What obstacles hide lies below them; of that, what is before them is drawn again.
void add_frame(const MotionFrame& frame, Series parts, Panel& panel) {
  const auto with_look = [&](const std::vector<Polyline>& lines, Mark mark, int layer) {
    Series series = series_of(lines);
    series.mark = mark, series.layer = layer;
    series.color = parts.color, series.width = parts.width, series.point = parts.point;
    return series;
  };
  const int layer = parts.layer;
  if (!frame.behind.empty()) panel.series.push_back(with_look(frame.behind, Mark::kBoth, kObstacleLayer - 1));
  if (!frame.in_front.empty()) panel.series.push_back(with_look(frame.in_front, Mark::kLine, layer));
  panel.series.push_back(std::move(parts));
}

}  // namespace

std::string shade(const std::string& first, const std::string& last, double s) {
  unsigned from[3] = {}, to[3] = {}, rgb[3];
  std::sscanf(first.c_str(), "#%2x%2x%2x", &from[0], &from[1], &from[2]);
  std::sscanf(last.c_str(), "#%2x%2x%2x", &to[0], &to[1], &to[2]);
  for (int k = 0; k < 3; ++k) rgb[k] = unsigned(std::lround(from[k] + s * (double(to[k]) - from[k])));
  char text[8];
  std::snprintf(text, sizeof text, "#%02x%02x%02x", rgb[0] & 255, rgb[1] & 255, rgb[2] & 255);
  return text;
}

Panel motion_panel(const Motion& motion) {
  if (motion.frames.empty())
    throw ArgumentError("motion_panel: the motion '" + motion.title + "' has no frames");
  Panel panel{.title = motion.title, .x_label = motion.x_label, .y_label = motion.y_label};
  panel.equal_axes = panel.wide = true;
  add_scenery(motion, panel);
  const std::vector<const MotionFrame*> frames = selected(motion);
  // The start is wider, so that it shows under an end at the same place.
  const auto add_end = [&](const char* what, const MotionFrame& frame, const char* color, double wider = 0) {
    Series series = frame_series(frame.parts, color, true);
    series.width += wider;
    series.name = at_time(what, frame.time);
    series.layer = 2;
    add_frame(frame, std::move(series), panel);
  };
  add_end("start", *frames.front(), kStart, frames.size() > 1 ? 4 : 0);
  for (size_t k = 1; k + 1 < frames.size(); ++k) {
    const double s = static_cast<double>(k) / static_cast<double>(frames.size() - 1);
    Series series = frame_series(frames[k]->parts, shade(kLight, kDark, s), false);
    if (k == frames.size() / 2) series.name = "in between, light to dark";
    add_frame(*frames[k], std::move(series), panel);
  }
  if (frames.size() > 1) add_end("end", *frames.back(), kGoal);
  for (const Trace& trace : motion.traces) {
    Series series = series_of({trace.points});
    series.name = trace.name;
    series.color = kTrace;
    series.width = 1.5;
    series.dashed = true;
    series.layer = 1;
    panel.series.push_back(std::move(series));
  }
  panel.height = 400;
  add_names(motion, panel);
  return panel;
}

}  // namespace dyntape::io
