// SPDX-License-Identifier: BSD-3-Clause
//
// Footholds and swings of task files: what is below the floor or out of reach is told before the solve and by the
// verdict, swings keep their clearance between the points of the mesh, and pictures show the ground that feet stand
// on.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <dyntape/interface/control/discretize/resampled.h>
#include <dyntape/interface/files/task/task_phases.h>
#include <dyntape/interface/run/solve/pictures.h>
#include <dyntape/interface/run/solve/solve.h>

#include "interface/files/task/task_text.h"
#include "source_folder.h"

namespace dyntape::footholds_test {
namespace {

class Footholds : public test::TaskText {
 protected:
  Footholds() : TaskText("footholds") {}

  // All feet land there.
  void land_at(const std::string& offset) {
    std::string feet;
    for (const char* foot : {"FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"})
      feet += std::string("      ") + foot + " \"" + offset + "\"\n";
    replace("phase landing {", "phase landing {\n    foothold_offset {\n" + feet + "    }");
  }
  void end_at(const std::string& position) {
    const std::size_t at = text_.rfind("position \"0 0 0.24\"");
    text_.replace(at, 19, "position \"" + position + "\"");
  }
  Task without_expected() const {
    Task task = read();
    task.expected.reset();
    return task;
  }
};

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != text.npos; at = text.find(part, at + 1)) ++count;
  return count;
}

// The least height of feet above the curves of their clearance beyond 10 % of the way, between points too.
double least_room(const Task& task, const SolveReport& report, double clearance) {
  double least = HUGE_VAL;
  const Trajectory& flight = report.solution.phases[1].motion;
  std::vector<double> times;
  for (int k = 0; k <= 20 * flight.intervals(); ++k)
    times.push_back(flight.t[flight.points() - 1] * k / (20 * flight.intervals()));
  const Trajectory fine = resampled(task.parts[1].problem, flight, times);
  const auto& model = task.scene.model;
  dynamics::Data<double> data(model);
  for (const HeldContact& contact : task.robot.contacts) {
    for (int p = 0; p < fine.points(); ++p) {
      dynamics::forward_kinematics<double>(model, data, Eigen::VectorXd(fine.x.col(p).head(model.nq)));
      const Eigen::Vector3d off =
          dynamics::frame_placement(model, data, model.frame_index(contact.frame)).p - *contact.place;
      const double s = off.x() / 0.1;
      if (s > 0.1 && s < 0.9) least = std::min(least, off.z() - 0.02 * s - 4 * clearance * s * (1 - s));
    }
  }
  return least;
}

TEST_F(Footholds, SwingsKeepTheirClearanceBetweenPoints) {
  load("quadruped_jump");
  land_at("0.1 0 0.02");
  end_at("0.1 0 0.26");
  replace("contacts \"\"", "contacts \"\"\n    clearance 0.02");
  const Task task = without_expected();
  const auto& terms = task.parts[1].problem.terms;
  const auto swing = std::find_if(terms.begin(), terms.end(),
                                  [](const Term& t) { return t.name == "FL_FOOT clears its way"; });
  ASSERT_NE(swing, terms.end());
  EXPECT_EQ(swing->length, 0.02);
  const SolveReport report = solve_task(task);
  ASSERT_TRUE(report.success()) << report.verdict();
  EXPECT_GT(least_room(task, report, 0.02), -3e-5);
  // The same motion, as if 0.1 mm more were asked for, would not be verified: a thousandth of the clearance is allowed.
  Task higher = task;
  for (Term& term : higher.parts[1].problem.terms) {
    if (term.length == 0) continue;
    term.function = [f = term.function](const auto& s) {
      auto rows = f(s);
      for (Eigen::Index i = 0; i < rows.size(); ++i) rows[i] -= 1e-4;
      return rows;
    };
  }
  const Verification v = verify(higher.parts[1].problem, report.solution.phases[1].motion);
  ASSERT_FALSE(v.passings.rows.empty());
  EXPECT_GT(v.passings.worst(), 1e-3);
  EXPECT_NE(v.passings.rows.front().text().find("clears its way is -"), std::string::npos)
      << v.passings.rows.front().text();
}

TEST_F(Footholds, TheFloorIsThatOfTheFileOrOfTheLowestContact) {
  load("quadruped_jump");
  Task task = read();
  EXPECT_EQ(floor_of(task).value(), 0.0171);
  task.floor.reset();
  EXPECT_NEAR(floor_of(task).value(), 0.0171, 1e-4);  // where the feet stand
  task.robot.contacts.clear();
  EXPECT_FALSE(floor_of(task).has_value());
}

TEST_F(Footholds, BelowTheFloorIsToldBeforeAndNotVerified) {
  load("quadruped_jump");
  replace("phase landing {", "phase landing { foothold_offset { FL_FOOT \"0 0 -0.05\" }");
  const Task task = without_expected();
  const std::vector<std::string> told = unmet_demands(task);
  const std::string sentence =
      "phase 'landing': the foothold of 'FL_FOOT' is 0.0500 m below the floor, which is at z = 0.0171 m; if "
      "the "
      "ground is lower there, its height is 'contacts.floor'";
  EXPECT_EQ(std::count(told.begin(), told.end(), sentence), 1) << (told.empty() ? "" : told.front());
  const SolveReport report = solve_task(task);
  EXPECT_FALSE(report.success());
  EXPECT_EQ(report.verdict().find("verified"), std::string::npos) << report.verdict();
  ASSERT_TRUE(report.solution.success()) << report.verdict();
  EXPECT_NE(report.verdict().find("puts feet below the floor"), std::string::npos) << report.verdict();
  EXPECT_NE(report.text().find("foothold of FL_FOOT is -0.03"), std::string::npos) << report.text();
}

// With the height of the lower ground, feet that stay stand above it.
TEST_F(Footholds, AStepDownOntoALowerFloorIsNoFault) {
  load("quadruped_jump");
  replace("phase landing {", "phase landing { foothold_offset { FL_FOOT \"0 0 -0.05\" }");
  replace("0.0171", "-0.0329");
  const Task task = without_expected();
  for (const std::string& sentence : unmet_demands(task))
    EXPECT_EQ(sentence.find("below the floor"), std::string::npos) << sentence;
  EXPECT_TRUE(sunken_footholds(task).empty());
}

TEST_F(Footholds, AClearanceBeyondALegIsTold) {
  load("quadruped_jump");
  const auto told = [&] {
    std::string all;
    for (const std::string& sentence : unmet_demands(read())) all += sentence + "\n";
    return all;
  };
  replace("contacts \"\"", "contacts \"\"\n    clearance 5");
  EXPECT_NE(told().find(
                "phase 'flight': 'FL_FOOT' is to clear its way by 5.00 m: in a flight of 0.250 s it comes to "
                "less than 1."),
            std::string::npos)
      << told();
  replace("clearance 5", "clearance 0.05");
  EXPECT_EQ(told().find("clear its way"), std::string::npos) << told();
  // With three feet on the floor the fourth reaches only as far as its leg.
  replace("contacts \"\"", "contacts \"FR_FOOT HL_FOOT HR_FOOT\"");
  EXPECT_EQ(told().find("clear its way"), std::string::npos) << told();
  replace("clearance 0.05", "clearance 1.5");
  EXPECT_NE(told().find("'FL_FOOT' is to clear its way by 1.50 m: halfway no configuration"),
            std::string::npos)
      << told();
}

// One mistake is one sentence: the names of contacts are those of a robot that was not found, or of a list with a mistake.
TEST_F(Footholds, AMistakeElsewhereIsOneSentence) {
  const auto lines_with = [&](const std::string& old, const std::string& with) {
    load("quadruped_jump");
    replace("phase landing {",
            "phase landing {\n    contacts \"FL_FOOT FR_FOOT HL_FOOT HR_FOOT\"\n"
            "    foothold_offset { FL_FOOT \"0.05 0 0\" }");
    replace(old, with);
    return message();
  };
  const std::pair<const char*, const char*> kMistakes[] = {
      {"solo12.urdf", "solo21.urdf"},
      {"points   \"FL_FOOT", "points   \"FL_FOT"},
      {"friction 0.6", "frictoin 0.6"},
      {"duration  0.3", "duration  -0.3"},
      {"control      1e-2", "control      abc"},
      {"base floating", "base flaoting"},
  };
  for (const auto& [old, with] : kMistakes) {
    const std::string message = lines_with(old, with);
    EXPECT_EQ(count_of(message, "\n"), 0u) << message;
    EXPECT_EQ(message.find("foothold_offset"), std::string::npos) << message;
  }
  const std::string message = lines_with("{ FL_FOOT \"0.05", "{ FL_FOTO \"0.05");
  EXPECT_NE(message.find("unknown key 'FL_FOTO' in 'phases.phase.foothold_offset'; did you mean 'FL_FOOT'?"),
            std::string::npos)
      << message;
}

TEST_F(Footholds, PicturesShowTheGroundUnderFeet) {
  load("quadruped_jump");
  const auto remarks = [](const Task& task) {
    Trajectory motion;
    motion.t = Eigen::VectorXd::LinSpaced(3, 0, 1), motion.x = task.start.replicate(1, 3);
    std::string all;
    const io::Plot plot = motion_plot(task, motion);
    for (const io::Remark& remark : plot.panels[0].remarks) all += remark.text + "\n";
    return all;
  };
  EXPECT_EQ(remarks(read()), "");
  land_at("0.1 0 0.02");
  EXPECT_EQ(remarks(read()), "ground at z = 0.0371 m\n");
}

}  // namespace
}  // namespace dyntape::footholds_test
