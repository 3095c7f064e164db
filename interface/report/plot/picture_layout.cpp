// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/report/plot/picture_layout.h>

#include <algorithm>
#include <cmath>

namespace dyntape::io {
namespace {

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

// Texts of reference lines stand outside of the frame, where no curve runs: right of it.
double right_margin(const Panel& panel) {
  double margin = kRight;
  for (const ReferenceLine& line : panel.horizontal) {
    if (!line.text.empty()) margin = std::max(margin, 14 + text_width(line.text, kSmallSize));
  }
  return margin;
}

double head_height(const Panel& panel, size_t legend_rows) {
  return kTop + kHeadRow * (static_cast<double>(legend_rows) + (panel.title.empty() ? 0 : 1));
}

}  // namespace

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
      places.push_back({{left, 0, right, 0}, y + kTop, legend_rows(panel, right - left)});
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

}  // namespace dyntape::io
