// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/report/plot/series_looks.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>

namespace dyntape::io {
namespace {

// M. Okabe and K. Ito, "Color Universal Design", without the yellow, too light for lines on white.
constexpr const char* kPalette[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                    "#e69f00", "#56b4e9", "#444444"};
constexpr int kColors = 7;
// Filled; one less is the same shape hollow (and 2 a cross beside the star of 3).
constexpr int kPointTypes[] = {7, 5, 9, 13, 11, 15, 3};
constexpr int kShapes = 2 * kColors;  // rounds until a shape comes again

std::string darker(const std::string& color, int steps) {
  unsigned r = 0, g = 0, b = 0;
  if (steps == 0 || std::sscanf(color.c_str(), "#%2x%2x%2x", &r, &g, &b) != 3) return color;
  const auto scaled = [steps](unsigned part) {
    return unsigned(std::lround(part / (1 + 0.3 * steps))) & 255;
  };
  char text[8];
  std::snprintf(text, sizeof text, "#%02x%02x%02x", scaled(r), scaled(g), scaled(b));
  return text;
}

// Those that gnuplot has, then a dash that gets longer, with one to three dots.
std::string dash_of(int round) {
  constexpr const char* kDashes[] = {"1", "2", "4", "5"};
  if (round < 4) return kDashes[round];
  std::string dash = "(" + std::to_string(16 + 8 * ((round - 4) / 3)) + ",4";
  for (int dots = 0; dots <= (round - 4) % 3; ++dots) dash += ",2,4";
  return dash + ")";
}

// The look of a number: a series with a colour of its own takes a round of dashes and shapes a number.
Look look_of(const Series& series, int number) {
  const bool own = !series.color.empty();
  const int round = (own ? number : number / kColors) + (series.dashed ? 1 : 0);
  const int index = own ? 0 : number % kColors;
  const std::string color = darker(own ? series.color : kPalette[index], round / kShapes);
  const int shape = round % kShapes;
  return {color, dash_of(round), kPointTypes[(index + shape / 2) % kColors] - shape % 2};
}

// Of what a series shall be: its colour, and dots that no other series has.
Look target_look(Look look, int number) {
  look.dash = "(1," + std::to_string(2 + number / kColors) + ")";
  return look;
}

// Rounds differ in dashes whatever the mark, so these two tell looks apart.
std::string key_of(const Look& look) { return look.color + ' ' + look.dash; }

std::string identity_of(const Series& series) {
  return series.name + '\n' + series.color + (series.dashed ? "\ndashed" : "");
}

class Looks {
 public:
  explicit Looks(const Plot& plot) {
    std::set<std::string> all;
    for (const Panel& panel : plot.panels) {
      std::set<std::string> here;
      for (const Series& series : panel.series)
        if (!series.name.empty()) here.insert(identity_of(series));
      for (const std::string& name : here) beside_[name].insert(here.begin(), here.end());
      all.insert(here.begin(), here.end());
    }
    if (!plot.one_legend) return;
    for (auto& [name, others] : beside_) others = all;
  }

  // The wanted look, or the next that no series beside this one has.
  Look named(const Series& series) {
    const std::string name = identity_of(series);
    if (const auto known = chosen_.find(name); known != chosen_.end()) return known->second;
    std::set<std::string> taken;
    for (const std::string& other : beside_.at(name)) {
      if (const auto look = chosen_.find(other); look != chosen_.end()) taken.insert(key_of(look->second));
    }
    int number = std::max(series.style, 0);
    while (taken.contains(key_of(look_of(series, number)))) ++number;
    targets_[series.name] = target_look(look_of(series, number), number);
    return chosen_[name] = look_of(series, number);
  }
  // Of a name that the plot does not have: that of the first colour.
  Look target(const Series& series) const {
    const auto found = targets_.find(series.target_of);
    return found != targets_.end() ? found->second : target_look(look_of({}, 0), 0);
  }

 private:
  std::map<std::string, std::set<std::string>> beside_;  // series in a common panel or legend
  std::map<std::string, Look> chosen_;
  std::map<std::string, Look> targets_;  // by name
};

// Nobody looks for them in a legend: the first that its panel does not have.
Look unnamed(const Series& series, std::set<std::string>& used) {
  int number = std::max(series.style, 0);
  if (series.color.empty() && series.style < 0)
    while (used.contains(key_of(look_of(series, number)))) ++number;
  const Look look = look_of(series, number);
  used.insert(key_of(look));
  return look;
}

void choose_unnamed(const Panel& panel, const Looks& looks, std::vector<Look>& chosen) {
  std::set<std::string> used;
  for (std::size_t k = 0; k < chosen.size(); ++k)
    if (!panel.series[k].name.empty()) used.insert(key_of(chosen[k]));
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    const Series& series = panel.series[k];
    if (!series.name.empty()) continue;
    chosen[k] = series.target_of.empty() ? unnamed(series, used) : looks.target(series);
  }
}

}  // namespace

std::vector<std::vector<Look>> looks_of(const Plot& plot) {
  std::vector<std::vector<Look>> all;
  for (const Panel& panel : plot.panels) all.emplace_back(panel.series.size());
  Looks looks(plot);
  for (const bool wanted : {true, false}) {  // those that ask for a look choose first
    for (std::size_t p = 0; p < all.size(); ++p) {
      for (std::size_t k = 0; k < all[p].size(); ++k) {
        const Series& series = plot.panels[p].series[k];
        const bool asks = series.style >= 0 || !series.color.empty();
        if (!series.name.empty() && asks == wanted) all[p][k] = looks.named(series);
      }
    }
  }
  for (std::size_t p = 0; p < all.size(); ++p) choose_unnamed(plot.panels[p], looks, all[p]);
  return all;
}

}  // namespace dyntape::io
