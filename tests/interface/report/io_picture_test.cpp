// SPDX-License-Identifier: BSD-3-Clause
//
// Pictures are drawn by the installed gnuplot and looked into as XML.
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/report/plot/picture.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <random>
#include <regex>
#include <set>
#include <sstream>

namespace dyntape::io::io_picture_test {
namespace {

class Picture : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  int count() const {
    return static_cast<int>(std::distance(std::filesystem::directory_iterator(folder_), {}));
  }
  std::string drawn(const Plot& plot) {
    draw(plot, folder_ / "p.svg");
    return read_file(folder_ / "p.svg");
  }
  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("dyntape-picture-test-" + std::to_string(::getpid()));
};

Plot sample() {
  Plot plot{.title = "Title"};
  plot.columns = 2;
  plot.panels = {{.title = "left",
                  .x_label = "t [s]",
                  .y_label = "q [rad]",
                  .series = {{.name = "a", .x = {0, 1, 2}, .y = {0, 1, 0}},
                             {.name = "b", .x = {0, 1, 2}, .y = {1, 0, 1}, .mark = Mark::kBoth}},
                  .horizontal = {{2, "limit"}}},
                 {.title = "right",
                  .series = {{.name = "c", .x = {1, 10, 100}, .y = {1e-3, 1e-9, 1e-15}}},
                  .horizontal = {{1e-20, ""}},
                  .log_x = true,
                  .log_y = true}};
  return plot;
}

TEST_F(Picture, shows_every_text_and_nothing_of_place_or_time) {
  const std::string svg = drawn(sample());
  for (const char* text : {"Title", "left", "right", "t [s]", "q [rad]", ">a<", ">b<", ">c<", "limit"}) {
    EXPECT_NE(svg.find(text), std::string::npos) << text;
  }
  EXPECT_EQ(svg.find(folder_.string()), std::string::npos);
  EXPECT_FALSE(std::regex_search(svg, std::regex("20[0-9][0-9]-|[0-9]+:[0-9]+:[0-9]+")));
  EXPECT_EQ(count(), 1) << "a script or a temporary file was left behind";
}

TEST_F(Picture, is_the_same_bytes_each_time) { EXPECT_EQ(drawn(sample()), drawn(sample())); }

TEST_F(Picture, colours_follow_the_palette) {
  Plot plot;
  plot.panels.resize(1);
  for (int k = 0; k < 9; ++k)
    plot.panels[0].series.push_back({.name = std::to_string(k), .x = {0, 1}, .y = {0.0, k + 1.0}});
  const std::string svg = drawn(plot);
  for (const char* rgb : {"0, 114, 178", "213,  94,   0", "0, 158, 115", "204, 121, 167", "230, 159,   0"}) {
    EXPECT_NE(svg.find(rgb), std::string::npos) << rgb;
  }
}

// What the curves of a script look like: all behind "with" but the sizes.
std::vector<std::string> looks_in(const std::string& script) {
  std::vector<std::string> looks;
  const std::regex look("\\$d[0-9]+ using 1:2 with ([^\\\\\n]*)");
  for (std::sregex_iterator it(script.begin(), script.end(), look), end; it != end; ++it) {
    std::string text = (*it)[1];
    while (!text.empty() && (text.back() == ' ' || text.back() == ',')) text.pop_back();
    looks.push_back(text);
  }
  return looks;
}

// The studies of derivatives have a dozen methods in a panel.
TEST_F(Picture, no_two_names_of_a_legend_look_alike) {
  for (const Mark mark : {Mark::kLine, Mark::kPoints, Mark::kBoth}) {
    Plot plot{.one_legend = true};
    plot.panels.resize(3);
    constexpr int kSeries = 300;
    for (int k = 0; k < kSeries; ++k) {
      Series series{.name = std::to_string(k), .x = {0, 1}, .y = {0.0, k + 1.0}, .mark = mark};
      if (k % 10 == 7) series.color = "#0072b2";  // the first of the palette, or one that others have
      if (k % 10 == 8) series.dashed = true;
      if (k % 10 == 9) series.style = k / 2;
      plot.panels[std::size_t(k % 3)].series.push_back(std::move(series));
    }
    std::vector<std::string> looks = looks_in(gnuplot_script(plot, "svg", "x.svg"));
    EXPECT_EQ(looks.size(), kSeries);
    EXPECT_EQ(std::set<std::string>(looks.begin(), looks.end()).size(), kSeries) << int(mark);
    plot.one_legend = false;
    looks = looks_in(gnuplot_script(plot, "svg", "x.svg"));
    for (auto panel = looks.begin(); panel != looks.end(); panel += kSeries / 3)
      EXPECT_EQ(std::set<std::string>(panel, panel + kSeries / 3).size(), kSeries / 3) << int(mark);
  }
}

TEST_F(Picture, a_name_looks_alike_in_all_panels_and_its_target_is_dotted_in_its_colour) {
  Plot plot;
  plot.panels = {
      {.series = {{.name = "a", .x = {0, 1}, .y = {0, 1}}, {.name = "b", .x = {0, 1}, .y = {1, 0}}}},
      {.series = {{.name = "b", .x = {0, 1}, .y = {1, 0}},
                  {.x = {0, 1}, .y = {1, 1}, .target_of = "b"},
                  {.name = "c", .x = {0, 1}, .y = {2, 0}}}}};
  const std::vector<std::string> looks = looks_in(gnuplot_script(plot, "svg", "x.svg"));
  ASSERT_EQ(looks.size(), 5u);
  EXPECT_EQ(looks[1], looks[2]);
  EXPECT_EQ(std::set<std::string>(looks.begin(), looks.begin() + 2).size(), 2u);
  EXPECT_EQ(std::set<std::string>(looks.begin() + 2, looks.end()).size(), 3u);
  const std::size_t dashes = looks[2].find(" dt ");
  EXPECT_EQ(looks[2].substr(0, dashes), looks[3].substr(0, dashes));
}

// Four limbs in panels of their own had seven colours and three kinds of dashes for three joints.
TEST_F(Picture, panels_without_common_names_have_the_same_looks) {
  Plot plot;
  plot.panels = {{.series = {{.name = "left hip", .x = {0, 1}, .y = {0, 1}},
                             {.name = "left knee", .x = {0, 1}, .y = {1, 0}}}},
                 {.series = {{.name = "right hip", .x = {0, 1}, .y = {0, 1}},
                             {.name = "right knee", .x = {0, 1}, .y = {1, 0}}}}};
  std::vector<std::string> looks = looks_in(gnuplot_script(plot, "svg", "x.svg"));
  ASSERT_EQ(looks.size(), 4u);
  EXPECT_EQ(looks[0], looks[2]);
  EXPECT_EQ(looks[1], looks[3]);
  EXPECT_NE(looks[0], looks[1]);
  plot.one_legend = true;
  looks = looks_in(gnuplot_script(plot, "svg", "x.svg"));
  EXPECT_EQ(std::set<std::string>(looks.begin(), looks.end()).size(), 4u);
}

struct Text {
  double x, y;
  std::string anchor, text;
  // About, in pixels: of characters, of which a minus has three bytes.
  double width() const {
    return 0.56 * 12 *
           double(std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
  }
  double left() const { return x - (anchor == "middle" ? 0.5 : anchor == "end" ? 1 : 0) * width(); }
};

std::vector<Text> texts_of(const std::string& svg) {
  std::vector<Text> texts;
  const std::regex pattern(
      "translate\\(([-0-9.]+),([-0-9.]+)\\)\"[^>]*text-anchor=\"([a-z]+)\">\\s*<text>(<tspan[^>]*>)?([^<]*)"
      "<");
  for (std::sregex_iterator it(svg.begin(), svg.end(), pattern), end; it != end; ++it)
    texts.push_back({std::stod((*it)[1]), std::stod((*it)[2]), (*it)[3], (*it)[5]});
  return texts;
}

// Ten methods of long names took ten rows above the first of three panels.
TEST_F(Picture, one_legend_stands_in_columns_above_all_panels) {
  Plot plot{.title = "Title", .columns = 3, .width = 1280, .one_legend = true};
  for (int p = 0; p < 3; ++p) {
    Panel panel{.title = "panel " + std::to_string(p)};
    for (int k = 0; k < 10; ++k)
      panel.series.push_back(
          {.name = "compliant, implicit-midpoint " + std::to_string(k), .x = {0, 1}, .y = {0.0, k + 1.0}});
    plot.panels.push_back(std::move(panel));
  }
  std::set<double> rows, columns;
  double top = 1e9;
  int names = 0;
  for (const Text& text : texts_of(drawn(plot))) {
    if (text.text.starts_with("panel")) top = std::min(top, text.y);
    if (!text.text.starts_with("compliant")) continue;
    ++names, rows.insert(text.y), columns.insert(text.x);
    EXPECT_LT(text.x + text.width(), plot.width);
  }
  ASSERT_EQ(names, 10);
  EXPECT_LE(rows.size(), 3u);
  EXPECT_LE(columns.size(), 5u);
  EXPECT_LT(*rows.rbegin(), top);
}

TEST_F(Picture, a_name_that_is_longer_than_the_picture_ends_inside) {
  Plot plot = sample();
  plot.panels[1].series[0].name = "a " + std::string(200, 'x') + " z";
  for (const Text& text : texts_of(drawn(plot)))
    EXPECT_LE(text.left() + 0.9 * text.width(), plot.width) << text.text;
}

// A long name of a limit made its panel narrower than those above and below.
TEST_F(Picture, panels_below_each_other_have_their_times_in_line) {
  Plot plot{.columns = 1, .width = 700};
  for (const char* limit : {"", "limit of a joint with a long name", "limit"}) {
    plot.panels.push_back({.series = {{.x = {0, 6}, .y = {0, 1}}}});
    if (*limit) plot.panels.back().horizontal = {{0.5, limit}};
  }
  std::map<std::string, std::set<double>> columns;
  for (const Text& text : texts_of(drawn(plot)))
    if (text.anchor == "middle") columns[text.text].insert(text.x);
  EXPECT_EQ(columns["0"].size(), 1u);
  EXPECT_EQ(columns["6"].size(), 1u);
}

// The last panel of a sweep has bars from -0.17 to 0.24: numbers of five letters each twentieth.
TEST_F(Picture, numbers_along_an_axis_do_not_meet) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int k = 0; k < 40; ++k) {
    const double size = std::pow(10, 5 * uniform(random)), low = size * uniform(random);
    const bool log = k % 4 == 3;
    Plot plot{.columns = 3, .width = 760};
    plot.panels.resize(3);
    for (Panel& panel : plot.panels) {
      panel.log_x = log;
      panel.series = {
          {.x = {log ? size : low, log ? size * 1e14 : low + size * (1 + uniform(random)) + 1e-3 * size},
           .y = {0, 1},
           .mark = k % 2 ? Mark::kLine : Mark::kPoints}};
    }
    std::map<double, std::vector<Text>> lines;
    for (const Text& text : texts_of(drawn(plot)))
      if (text.anchor == "middle") lines[text.y].push_back(text);
    ASSERT_FALSE(lines.empty());
    for (auto& [y, line] : lines) {
      std::sort(line.begin(), line.end(), [](const Text& a, const Text& b) { return a.x < b.x; });
      for (std::size_t i = 1; i < line.size(); ++i) {
        EXPECT_LT(line[i - 1].left() + line[i - 1].width(), line[i].left())
            << line[i - 1].text << " " << line[i].text;
      }
    }
  }
}

TEST_F(Picture, numbers_of_a_vertical_axis_do_not_meet_its_label) {
  const std::regex rotated("translate\\(([-0-9.]+),[-0-9.]+\\) rotate\\(-90");
  for (const double size : {1.5e-5, 1.5e-4, 1.5e-3, 0.15, 15.0, 1.5e4, 1.5e5, 1.5e6, 1.5e9}) {
    const Plot plot{.panels = {{.y_label = "q [rad]", .series = {{.x = {0, 1}, .y = {-size, size}}}}}};
    const std::string svg = drawn(plot);
    std::smatch label;
    ASSERT_TRUE(std::regex_search(svg, label, rotated));
    constexpr double kHalfHeight = 7;
    int numbers = 0;
    for (const Text& text : texts_of(svg)) {
      if (text.anchor != "end") continue;
      ++numbers;
      EXPECT_GT(text.left(), std::stod(label[1]) + kHalfHeight) << text.text;
    }
    EXPECT_GT(numbers, 3) << size;
  }
}

TEST_F(Picture, texts_cannot_break_out) {
  Plot plot = sample();
  plot.title = "it's `id` $(id) \"x\" <b> & \n system('id') %f _sub ^sup {br}";
  plot.panels[0].series[0].name = plot.title;
  const std::string svg = drawn(plot);
  EXPECT_NE(svg.find("`id` $(id)"), std::string::npos);
  EXPECT_NE(svg.find("&lt;b> &amp;"), std::string::npos);
  EXPECT_NE(svg.find("_sub ^sup {br}"), std::string::npos);
  EXPECT_EQ(svg.find("uid="), std::string::npos);
}

// Of the signs that gnuplot and XML have a meaning for.
TEST_F(Picture, random_texts_are_told_letter_by_letter) {
  const std::string signs = "'\"]]>>]<&`$\\a %{}^_@~#";
  std::mt19937 random(5);
  std::vector<std::string> texts = {
      "'", "''", "'a", "a'", "'a'b'", "]]>", "a]]>b]]>", "]]]>", "<![CDATA[x]]>", "'; exit #"};
  while (texts.size() < 40) {
    std::string text;
    for (int k = 0; k < 8; ++k) text += signs[random() % signs.size()];
    texts.push_back(text);
  }
  for (const std::string& text : texts) {
    Plot plot = sample();
    plot.title = text;
    plot.panels[0].x_label = text;
    plot.panels[1].series[0].name = text;
    const std::string svg = drawn(plot);
    std::string written;
    for (const char c : text) written += c == '&' ? "&amp;" : c == '<' ? "&lt;" : std::string(1, c);
    for (std::size_t at = 0; (at = written.find("]]>", at)) != std::string::npos;)
      written.replace(at, 3, "]]&gt;");
    std::size_t count = 0;
    for (std::size_t at = svg.find(">" + written + "<"); at != std::string::npos;
         at = svg.find(">" + written + "<", at + 1))
      ++count;
    EXPECT_EQ(count, 3u) << text;
    EXPECT_EQ(svg.find("]]>"), std::string::npos) << text;
  }
}

TEST_F(Picture, values_that_no_axis_can_show_leave_gaps) {
  Plot plot = sample();
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  plot.panels[1].series[0] = {.name = "c", .x = {1, 2, 3, 4, 5, 6}, .y = {1, nan, inf, 0, -1, 2}};
  EXPECT_NO_THROW(drawn(plot));
  plot.panels[1].series[0].y = {nan, nan, inf, 0, -1, -2};
  EXPECT_THROW(drawn(plot), ArgumentError);
}

TEST_F(Picture, constants_and_single_points_can_be_drawn) {
  for (const bool log : {false, true}) {
    for (const double y : {1.0, 1e-300, 1e300}) {
      Plot plot;
      plot.panels = {{.series = {{.x = {1}, .y = {y}, .mark = Mark::kPoints}}, .log_x = log, .log_y = log}};
      EXPECT_NO_THROW(drawn(plot)) << log << " " << y;
      plot.panels = {{.series = {{.x = {1, 2}, .y = {y, y}}}, .log_x = log, .log_y = log}};
      EXPECT_NO_THROW(drawn(plot)) << log << " " << y;
    }
  }
}

TEST_F(Picture, wrong_use_is_refused) {
  EXPECT_THROW(draw({}, folder_ / "p.svg"), ArgumentError);
  EXPECT_THROW(draw(sample(), folder_ / "p.pdf"), ArgumentError);
  Plot plot = sample();
  plot.panels[0].series[0].x.pop_back();
  EXPECT_THROW(draw(plot, folder_ / "p.svg"), ArgumentError);
  EXPECT_THROW(motion_panel({}), ArgumentError);
  EXPECT_EQ(count(), 0);
}

TEST_F(Picture, a_missing_or_failing_gnuplot_is_a_tool_error_and_leaves_nothing) {
  try {
    draw(sample(), folder_ / "p.svg", "no-such-gnuplot");
    FAIL() << "drawn by a program that does not exist";
  } catch (const ToolError& error) {
    EXPECT_NE(std::string(error.what()).find("gnuplot-nox"), std::string::npos) << error.what();
  }
  EXPECT_THROW(draw(sample(), folder_ / "p.svg", "false"), ToolError);
  EXPECT_THROW(draw(sample(), folder_ / "p.svg", "true"), ToolError) << "success without a picture";
  EXPECT_EQ(count(), 0);
}

TEST_F(Picture, png_on_request) {
  draw(sample(), folder_ / "p.png");
  std::string start(4, ' ');
  std::ifstream(folder_ / "p.png", std::ios::binary).read(start.data(), 4);
  EXPECT_EQ(start, "\x89PNG");
}

Motion swing(int frames) {
  Motion motion{.title = "swing"};
  for (int i = 0; i < frames; ++i) {
    const double angle = 0.02 * i;
    motion.frames.push_back({0.1 * i, {{{0, 0}, {std::cos(angle), std::sin(angle)}}}});
  }
  return motion;
}

TEST_F(Picture, a_motion_keeps_its_ends_and_thins_out_between) {
  for (const int frames : {1, 2, 3, 14, 15, 16, 400}) {
    const Motion motion = swing(frames);
    const Panel panel = motion_panel(motion);
    EXPECT_EQ(static_cast<int>(panel.series.size()), std::min(frames, motion.most_frames));
    EXPECT_EQ(panel.series.front().x[1], 1.0);
    const bool has_end = std::any_of(panel.series.begin(), panel.series.end(), [&](const Series& s) {
      return s.x[1] == motion.frames.back().parts[0][1][0];
    });
    EXPECT_TRUE(has_end);
    EXPECT_NO_THROW(drawn({.panels = {panel}}));
  }
}

// A part of each frame is behind the obstacle, and a part of that before it again.
TEST_F(Picture, obstacles_have_names_and_hide_what_is_behind_them) {
  Motion motion = swing(2);
  motion.obstacles = {{"post, r = 0.1 m", {{0.4, -0.1}, {0.6, -0.1}, {0.6, 0.1}, {0.4, 0.1}, {0.4, -0.1}}}};
  for (MotionFrame& frame : motion.frames)
    std::swap(frame.parts, frame.behind), frame.in_front = {{{0, 0}, {0.3, 0}}};
  const Panel panel = motion_panel(motion);
  int below = 0, filled = 0, above = 0;
  for (const Series& series : panel.series) {
    if (series.filled)
      ++filled;
    else if (series.layer < -1)
      ++below;
    else if (series.x.size() > 0)
      ++above;
  }
  EXPECT_EQ(filled, 1);
  EXPECT_EQ(below, 2);
  EXPECT_EQ(above, 2);
  const std::string svg = drawn({.panels = {panel}});
  EXPECT_NE(svg.find(">post, r = 0.1 m<"), std::string::npos);
  EXPECT_NE(svg.find("fill-opacity"), std::string::npos);
}

// The ranges in the script divided by the sides of the frame: a metre is as long in x as in y.
TEST_F(Picture, a_motion_has_equal_axes) {
  for (const double stretch : {0.01, 1.0, 50.0}) {
    Motion motion = swing(5);
    for (MotionFrame& frame : motion.frames) frame.parts[0][1][0] *= stretch;
    const Plot plot{.panels = {motion_panel(motion)}};
    const std::string script = gnuplot_script(plot, "svg", "x.svg");
    const auto number = [&](const std::string& pattern, int group) {
      std::smatch match;
      EXPECT_TRUE(std::regex_search(script, match, std::regex(pattern))) << pattern;
      return std::stod(match[static_cast<size_t>(group)]);
    };
    const std::string value = "([-+0-9.e]+)";
    const auto span = [&](const char* axis) {
      const std::string pattern = std::string("set ") + axis + "range \\[" + value + ":" + value + "\\]";
      return number(pattern, 2) - number(pattern, 1);
    };
    const auto screen = [&](const char* margin) {
      return number(std::string(margin) + " at screen " + value, 1);
    };
    const double width = number("size ([0-9]+),([0-9]+)", 1), height = number("size ([0-9]+),([0-9]+)", 2);
    const double x_scale = span("x") / (width * (screen("rmargin") - screen("lmargin")));
    const double y_scale = span("y") / (height * (screen("tmargin") - screen("bmargin")));
    EXPECT_NEAR(x_scale / y_scale, 1, 1e-6);
  }
}

}  // namespace
}  // namespace dyntape::io::io_picture_test
