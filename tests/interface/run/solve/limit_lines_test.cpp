// SPDX-License-Identifier: BSD-3-Clause
//
// Lines at limits in pictures of curves: each belongs to a curve that comes near it, and says to which if others have another limit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <sstream>

#include <dyntape/interface/run/solve/pictures.h>
#include "interface/files/task/task_text.h"
#include "interface/run/tied_robots.h"

namespace dyntape::limit_lines_test {
namespace {

using Eigen::Index;

class LimitLines : public test::TaskText {
 protected:
  LimitLines() : TaskText("limit_lines") {}
};

struct Range {
  double lower, upper;
  bool has(double value) const { return value == lower || value == upper; }
};

// Of a panel's quantity, by the names of the curves.
std::map<std::string, Range> limits_in(const io::Panel& panel, const dynamics::Model<double>& model) {
  std::map<std::string, Range> limits;
  for (const auto& joint : model.joints) {
    const double v = joint.limits.velocity, tau = joint.limits.effort;
    limits[joint.name] = panel.y_label.starts_with("q")     ? Range{joint.limits.lower, joint.limits.upper}
                         : panel.y_label.starts_with("tau") ? Range{-tau, tau}
                                                            : Range{-v, v};
  }
  return limits;
}

// Sinusoids of all joints, some far below and some beyond their limits.
Trajectory drawn(const Task& task, std::mt19937_64& random) {
  constexpr int kPoints = 41;
  std::uniform_real_distribution<double> unit(0, 1);
  const auto& model = task.scene.model;
  Trajectory motion;
  motion.scheme = task.optimise.mesh.scheme;
  motion.t = Eigen::VectorXd::LinSpaced(kPoints, 0, 1);
  const auto curve = [&](double middle, double half) {
    const double size = half * std::pow(unit(random), 2) * 1.1, phase = 6 * unit(random),
                 speed = 1 + 8 * unit(random);
    return (middle + size * (speed * motion.t.array() + phase).sin()).matrix().transpose().eval();
  };
  const Index n = model.nq;
  motion.x.resize(2 * n, kPoints), motion.a.setZero(n, kPoints), motion.u.resize(n, kPoints);
  for (Index k = 0; k < n; ++k) {
    const auto& l = model.joints[std::size_t(k)].limits;
    motion.x.row(k) = curve((l.lower + l.upper) / 2, (l.upper - l.lower) / 2);
    motion.x.row(n + k) = curve(0, l.velocity);
    motion.u.row(k) = curve(0, l.effort);
  }
  return motion;
}

// "limit of a, b; limit of c +1" -> a, b, c.
std::vector<std::string> owners_of(std::string text) {
  for (const char* word : {"limit of ", ";", ","})
    for (std::size_t at; (at = text.find(word)) != text.npos;)
      text.replace(at, std::string(word).size(), " ");
  std::vector<std::string> owners;
  std::istringstream words(text);
  for (std::string word; words >> word;)
    if (word[0] != '+') owners.push_back(word);
  return owners;
}

bool comes_near(const io::Panel& panel, const io::Series& series, const Range& range, double value) {
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const io::Series& s : panel.series)
    for (const double y : s.y) low = std::min(low, y), high = std::max(high, y);
  const double near = std::max(0.25 * (high - low), 0.25 * (range.upper - range.lower));
  return std::any_of(series.y.begin(), series.y.end(), [&](double y) {
    return std::abs(y - value) <= near || (y > value) == (value == range.upper);
  });
}

TEST_F(LimitLines, BelongToCurvesThatComeNear) {
  load("arm_reaching");
  const Task task = read();
  std::mt19937_64 random(3);
  int labelled = 0, shared = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const io::Plot plot = trajectory_plot(task, drawn(task, random));
    ASSERT_EQ(plot.panels.size(), 3u);
    for (const io::Panel& panel : plot.panels) {
      const auto limits = limits_in(panel, task.scene.model);
      std::map<std::string, int> drawn_limits;
      for (std::size_t k = 0; k < panel.horizontal.size(); ++k) {
        const io::ReferenceLine& line = panel.horizontal[k];
        const std::string where = panel.title + ", " + std::to_string(line.value) + ": '" + line.text + "'";
        std::string text = line.text;
        if (text.empty() && k + 1 < panel.horizontal.size() &&
            panel.horizontal[k + 1].text.find(';') != text.npos)
          text = panel.horizontal[k + 1].text;  // one label for two lines
        if (text.empty() || text == "limit" || text.starts_with("limit of all")) {
          ++shared;
          for (const io::Series& series : panel.series)
            EXPECT_TRUE(limits.at(series.name).has(line.value)) << where;
          continue;
        }
        ++labelled;
        int found = 0;
        for (const std::string& owner : owners_of(text)) {
          const auto series = std::find_if(panel.series.begin(), panel.series.end(),
                                           [&](const auto& s) { return s.name == owner; });
          ASSERT_NE(series, panel.series.end()) << where;
          if (!limits.at(owner).has(line.value)) continue;  // of the other line of this label
          ++found;
          EXPECT_TRUE(comes_near(panel, *series, limits.at(owner), line.value)) << where;
        }
        EXPECT_GT(found, 0) << where;
      }
      // No curve reaches its limit unseen.
      for (const io::Series& series : panel.series) {
        const Range& range = limits.at(series.name);
        const double highest = *std::max_element(series.y.begin(), series.y.end());
        if (highest < range.upper) continue;
        EXPECT_TRUE(std::any_of(panel.horizontal.begin(), panel.horizontal.end(),
                                [&](const auto& line) { return line.value == range.upper; }))
            << panel.title << " " << series.name;
      }
    }
  }
  EXPECT_GT(labelled, 100);
  std::printf("%d lines with their owners, %d of all curves\n", labelled, shared);
}

// Both joints of the two-link arm have the same velocity limit: one label.
TEST_F(LimitLines, OfAllCurvesHaveOneLabel) {
  load("two_link_arm_reaching");
  const Task task = read();
  const auto& model = task.scene.model;
  Trajectory motion;
  motion.scheme = task.optimise.mesh.scheme;
  motion.t = Eigen::VectorXd::LinSpaced(11, 0, 1);
  motion.x = Eigen::MatrixXd::Zero(4, 11), motion.a = Eigen::MatrixXd::Zero(2, 11),
  motion.u = Eigen::MatrixXd::Zero(2, 11);
  const double fast = 0.99 * model.joints[0].limits.velocity;
  motion.x.row(2) = (fast * (6.3 * motion.t.array()).sin()).matrix().transpose();
  const io::Plot plot = trajectory_plot(task, motion);
  const auto panel = std::find_if(plot.panels.begin(), plot.panels.end(),
                                  [](const auto& p) { return p.title.find("velocity") != p.title.npos; });
  ASSERT_NE(panel, plot.panels.end());
  ASSERT_EQ(panel->horizontal.size(), 2u);
  EXPECT_EQ(panel->horizontal[0].text, "limit");
  EXPECT_EQ(panel->horizontal[1].text, "");
}

// b = 2 a - 1 within [-1, 0.4] keeps a within [0, 0.7], which is no limit of a.
TEST_F(LimitLines, OfFollowersStandAtTheFollowers) {
  test::Sliders of;
  of.ratio = 2, of.offset = -1;
  of.limit_a = "lower='-3' upper='3'", of.limit_b = "lower='-1' upper='0.4'";
  write_file_atomically((folder_ / "tied.urdf").string(), of.urdf());
  text_ =
      "robot { urdf tied.urdf  mimic true }\nhorizon { duration 2  intervals 10 }\ncosts { control 1 }\n"
      "start { q { a 0.1 } }\ngoal { q { a 0.4 } }\n";
  for (const char* bounds : {"", "bounds { positions 0.4  velocities 2 }\n"}) {
    text_ += bounds;
    const Task task = read();
    Trajectory motion;
    motion.scheme = task.optimise.mesh.scheme;
    motion.t = Eigen::VectorXd::LinSpaced(11, 0, 1);
    motion.x = Eigen::MatrixXd::Zero(4, 11), motion.a = Eigen::MatrixXd::Zero(2, 11);
    motion.u = Eigen::MatrixXd::Zero(1, 11);
    motion.x.row(0).setLinSpaced(0.2, 0.699), motion.x.row(1) = (2 * motion.x.row(0)).array() - 1;
    motion.x.row(2).setConstant(1.98 / 2), motion.x.row(3).setConstant(1.98);
    const io::Plot plot = trajectory_plot(task, motion);
    std::vector<double> lines;
    for (const io::ReferenceLine& line : plot.panels.at(0).horizontal) {
      lines.push_back(line.value);
      EXPECT_NE(line.value, 0.7);
      EXPECT_TRUE(*bounds || line.text == "limit of b") << line.text;
    }
    EXPECT_TRUE(std::count(lines.begin(), lines.end(), 0.4)) << bounds;
    for (const io::ReferenceLine& line : plot.panels.at(1).horizontal) EXPECT_NE(std::abs(line.value), 1);
  }
}

}  // namespace
}  // namespace dyntape::limit_lines_test
