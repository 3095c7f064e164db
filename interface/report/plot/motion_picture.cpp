// SPDX-License-Identifier: BSD-3-Clause
//
// A motion as a panel: one series a frame.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/report/plot/picture.h>

namespace dyntape::io {
namespace {

constexpr const char* kStart = "#009e73";
constexpr const char* kGoal = "#d55e00";
constexpr const char* kTrace = "#8a6d9c";
constexpr const char* kScenery = "#b5b5b5";

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

// From light to dark blue as s goes from 0 to 1.
std::string shade(double s) {
  const double light[3] = {198, 217, 236}, dark[3] = {22, 62, 110};
  int rgb[3];
  for (int k = 0; k < 3; ++k) rgb[k] = static_cast<int>(std::lround(light[k] + s * (dark[k] - light[k])));
  char text[8];
  std::snprintf(text, sizeof text, "#%02x%02x%02x", rgb[0] & 255, rgb[1] & 255, rgb[2] & 255);
  return text;
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

Series frame_series(const MotionFrame& frame, const std::string& color, bool emphasized) {
  Series series = series_of(frame.parts);
  series.mark = Mark::kBoth;
  series.color = color;
  series.width = emphasized ? 4 : 2.2;
  series.point = emphasized ? 1.1 : 0.6;
  return series;
}

}  // namespace

Panel motion_panel(const Motion& motion) {
  if (motion.frames.empty())
    throw ArgumentError("motion_panel: the motion '" + motion.title + "' has no frames");
  Panel panel{.title = motion.title, .x_label = motion.x_label, .y_label = motion.y_label};
  panel.equal_axes = panel.wide = true;
  for (const Polyline& line : motion.scenery) {
    Series series = series_of({line});
    series.color = kScenery;
    series.width = 3;
    panel.series.push_back(std::move(series));
  }
  const std::vector<const MotionFrame*> frames = selected(motion);
  // The start is wider, so that it shows under an end at the same place.
  const auto add_end = [&](const char* what, const MotionFrame& frame, const char* color, double wider = 0) {
    Series series = frame_series(frame, color, true);
    series.width += wider;
    series.name = at_time(what, frame.time);
    series.layer = 2;
    panel.series.push_back(std::move(series));
  };
  add_end("start", *frames.front(), kStart, frames.size() > 1 ? 4 : 0);
  for (size_t k = 1; k + 1 < frames.size(); ++k) {
    const double s = static_cast<double>(k) / static_cast<double>(frames.size() - 1);
    panel.series.push_back(frame_series(*frames[k], shade(s), false));
    if (k == frames.size() / 2) panel.series.back().name = "in between, light to dark";
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
  return panel;
}

}  // namespace dyntape::io
