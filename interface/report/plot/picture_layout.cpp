// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/report/plot/picture_layout.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace dyntape::io {
namespace {

double entry_width(const Series& series) { return kSample + 24 + text_width(series.name, kTextSize); }

// One after the other.
std::vector<LegendRow> legend_rows(const Panel& panel, size_t number, double left, double width) {
  std::vector<LegendRow> rows;
  double used = 0;
  for (size_t i = 0; i < panel.series.size(); ++i) {
    if (panel.series[i].name.empty()) continue;
    const double need = entry_width(panel.series[i]);
    if (rows.empty() || used + need > width) {
      rows.emplace_back();
      used = 0;
    }
    rows.back().push_back({number, i, left + used});
    used += need;
  }
  return rows;
}

// In columns of one width, each name once.
std::vector<LegendRow> legend_of_all(const Plot& plot) {
  std::set<std::string> names = {""};
  LegendRow entries;
  double need = 1;
  for (size_t p = 0; p < plot.panels.size(); ++p) {
    for (size_t k = 0; k < plot.panels[p].series.size(); ++k) {
      const Series& series = plot.panels[p].series[k];
      if (!names.insert(series.name).second) continue;
      entries.push_back({p, k, 0});
      need = std::max(need, entry_width(series));
    }
  }
  const auto columns = size_t(std::max(1.0, std::floor((plot.width - kLeft - kRight) / need)));
  std::vector<LegendRow> rows;
  for (size_t i = 0; i < entries.size(); ++i) {
    if (i % columns == 0) rows.emplace_back();
    entries[i].x = kLeft + double(i % columns) * need;
    rows.back().push_back(entries[i]);
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

// Panels below each other have frames of one width, so that their times are in line: the margin of each panel.
std::vector<double> right_margins(const Plot& plot) {
  std::vector<double> margins, of_column(std::size_t(plot.columns), kRight);
  std::vector<std::size_t> columns;
  std::size_t column = 0;
  for (const Panel& panel : plot.panels) {
    if (panel.wide || panel.starts_row || column == of_column.size()) column = 0;
    columns.push_back(column);
    margins.push_back(right_margin(panel));
    if (!panel.wide) of_column[column] = std::max(of_column[column], margins.back());
    column = panel.wide ? of_column.size() : column + 1;
  }
  for (std::size_t i = 0; i < margins.size(); ++i) {
    if (!plot.panels[i].wide) margins[i] = of_column[columns[i]];
  }
  return margins;
}

double head_height(const Panel& panel, size_t legend_rows) {
  return kTop + kHeadRow * (static_cast<double>(legend_rows) + (panel.title.empty() ? 0 : 1));
}

// The last byte of a character is where the next one begins.
std::vector<size_t> starts_of_characters(const std::string& text) {
  std::vector<size_t> starts;
  for (size_t i = 0; i < text.size(); ++i)
    if ((text[i] & 0xC0) != 0x80) starts.push_back(i);
  starts.push_back(text.size());
  return starts;
}

}  // namespace

std::string shortened(const std::string& text, double size, double width) {
  if (text_width(text, size) <= width) return text;
  const std::vector<size_t> starts = starts_of_characters(text);
  std::string some;
  for (size_t half = 0; 2 * half + 1 < starts.size(); ++half) {
    const std::string longer =
        text.substr(0, starts[half]) + "..." + text.substr(*(starts.end() - 1 - std::ptrdiff_t(half)));
    if (text_width(longer, size) > width) break;
    some = longer;
  }
  return some;
}

Layout arrange(const Plot& plot) {
  Layout layout;
  const double cell = static_cast<double>(plot.width) / plot.columns;
  const std::vector<double> margins = right_margins(plot);
  double y = plot.title.empty() ? 6 : kTitleRow + 6;
  if (plot.one_legend) {
    layout.legend = legend_of_all(plot);
    layout.legend_top = y + kTop / 2;
    y += kHeadRow * static_cast<double>(layout.legend.size());
  }
  size_t i = 0;
  while (i < plot.panels.size()) {
    double head = 0, height = 0;
    const size_t first = i;
    for (int column = 0; column < plot.columns && i < plot.panels.size(); ++column, ++i) {
      const Panel& panel = plot.panels[i];
      if ((panel.wide || panel.starts_row) && column > 0) break;
      const double left = column * cell + kLeft,
                   right = (panel.wide ? plot.width : (column + 1) * cell) - margins[i];
      Place place{{left, 0, right, 0}, y + kTop, {}};
      if (!plot.one_legend) place.legend = legend_rows(panel, i, left, right - left);
      head = std::max(head, head_height(panel, place.legend.size()));
      height = std::max(height, static_cast<double>(panel.height));
      layout.places.push_back(std::move(place));
      if (panel.wide) column = plot.columns;
    }
    for (size_t k = first; k < i; ++k) {
      layout.places[k].frame.top = y + head;
      layout.places[k].frame.bottom = y + head + height;
    }
    y += head + height + kBottom;
  }
  layout.height = std::ceil(y + 4);
  return layout;
}

}  // namespace dyntape::io
