// SPDX-License-Identifier: BSD-3-Clause
//
// Files about a robot as one mass: what they say, what is wrong with them, the shipped ones, and what a loop leaves.
#include <gtest/gtest.h>

#include <dyntape/interface/io/csv.h>
#include <dyntape/interface/run/mpc/centroidal_control.h>
#include <dyntape/interface/run/mpc/centroidal_pictures.h>
#include "interface/files/task/task_text.h"
#include "interface/message_of.h"
#include "source_folder.h"

namespace dyntape::centroidal_task_test {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::VectorXd;

class CentroidalTasks : public test::TaskText {
 protected:
  CentroidalTasks() : TaskText("centroidal") {}

  void load_control(const std::string& name) {
    const fs::path folder = fs::path(test::source_folder()) / "config" / "control";
    text_ = read_file((folder / (name + ".info")).string());
    replace("../robots", (folder / "../robots").string());
  }
  // Nothing is compiled.
  CentroidalTask task() const {
    const std::string path = (folder_ / "one_mass.info").string();
    write_file_atomically(path, text_);
    CentroidalTask task = read_centroidal_task(path);
    task.optimise.mesh.evaluation.route = Route::kInterpreter;
    return task;
  }
  std::string refusal(const std::string& old, const std::string& with) {
    load_control("solo12_pushed");
    replace(old, with);
    return message_of<Error>([&] { task(); });
  }
};

// As it is shipped, compiled: two disturbances of 0.95 of the limits, none noticed too late.
TEST_F(CentroidalTasks, TheShippedRobotStandsItsPushes) {
  const CentroidalTask task =
      read_centroidal_task(test::source_folder() + "/config/control/solo12_pushed.info");
  EXPECT_NEAR(task.control.disturbances[0].impulse[0] / task.body.mass, 0.95 * 1.38607, 1e-3);
  EXPECT_NEAR(task.control.disturbances[1].impulse[1] / task.body.mass, -0.95 * 1.20309, 1e-3);
  ControlReport report = control_task(task);
  report.most_late = 1;  // of the machine, which others use
  EXPECT_TRUE(report.success()) << report.text();
  EXPECT_LT(report.off_end, 0.01);
  std::printf("step: median %.3f ms, 99 %% %.3f ms, longest %.3f ms\n", 1e3 * report.loop.latency(0.5),
              1e3 * report.loop.latency(0.99), 1e3 * report.loop.latency(1));
  // The disturbances: most of the way to the edge of the support, and not over it.
  double forwards = 0, sideways = 0;
  for (int k = 0; k < report.loop.motion.points(); ++k) {
    const Vector2d away = capture_point(task.body, report.loop.motion.x.col(k)) - task.body.com.head<2>();
    forwards = std::max(forwards, away.x());
    sideways = std::min(sideways, away.y());
  }
  EXPECT_GT(forwards, 0.94 * 0.1946);
  EXPECT_LT(forwards, 0.1946);
  EXPECT_LT(sideways, -0.94 * 0.16891);
  EXPECT_GT(sideways, -0.16891);
}

TEST_F(CentroidalTasks, APushTooHardIsToldWithItsTimeAndVerdict) {
  load_control("solo12_pushed");
  replace("3.292", "3.638");
  replace("duration   4", "duration   0.51");
  replace("    at      2.5", "    at      0.505");
  const ControlReport report = control_task(task());
  EXPECT_FALSE(report.success());
  ASSERT_NE(report.first_unusable(), nullptr);
  EXPECT_NEAR(report.first_unusable()->t, 0.502, 1e-9);
  EXPECT_NE(report.text().find("the first at 0.5020 s: locally infeasible"), std::string::npos)
      << report.text();
  EXPECT_NE(report.json().find("locally infeasible"), std::string::npos);
}

// What stages do not know is not offered, and phases are parts of a period.
TEST_F(CentroidalTasks, RefusesWhatItCannotPlan) {
  load_control("solo12_trots");
  const std::string whole = text_;
  replace("transcription { scheme trapezoid }",
          "transcription {\n  scheme trapezoid\n  hessian limited_memory\n}");
  const std::string hessian = message_of<FileError>([&] { task(); });
  EXPECT_NE(hessian.find("valid are 'exact', 'gauss_newton'"), std::string::npos) << hessian;
  EXPECT_EQ(hessian.find("'gauss_newton', 'limited_memory'"), std::string::npos) << hessian;
  text_ = whole;
  const std::size_t at = text_.find("phase_offsets"), end = text_.find('\n', at);
  text_.replace(at, end - at, "phase_offsets \"0 0.5 0.5 1e300\"");
  const std::string phases = message_of<FileError>([&] { task(); });
  EXPECT_NE(phases.find("'phase_offsets' must be between -1 and 1, got '1e300'"), std::string::npos)
      << phases;
}

TEST_F(CentroidalTasks, TheLoopLeavesItsFiles) {
  load_control("solo12_trots");
  replace("duration   4", "duration   1\n  max_late 1");  // whatever else the machine does
  replace("at      2", "at      0.5");
  const CentroidalTask trot = task();
  ControlReport report = control_task(trot);
  EXPECT_TRUE(report.success()) << report.text();
  const std::string out = (folder_ / "out").string();
  write_control(trot, report, out);
  for (const std::string& sentence : report.unwritten) ADD_FAILURE() << sentence;
  for (const std::string& file : centroidal_files())
    EXPECT_EQ(fs::exists(fs::path(out) / file), file != kLoopFeedback) << file;
  // Two feet at a time, which bear the weight, since the height stays: FR and HL do not, then FL and HR.
  const Trajectory& motion = report.loop.motion;
  const Eigen::MatrixXd forces = forces_on_floor(trot, motion);
  for (int k = 0; k < motion.points(); ++k) {
    const bool is_first_pair = std::fmod(motion.t[k] + 1e-6, 0.4) < 0.2;
    EXPECT_EQ(forces(is_first_pair ? 5 : 2, k), 0) << motion.t[k];
    EXPECT_EQ(forces(is_first_pair ? 8 : 11, k), 0) << motion.t[k];
    EXPECT_NEAR(forces(2, k) + forces(5, k) + forces(8, k) + forces(11, k), trot.body.weight(), 0.5)
        << motion.t[k];
  }
  // Each pair has a support of its own in each step: 0.2 s long, from above a line.
  const std::vector<SupportPhase> phases = support_phases(trot, motion.t);
  EXPECT_NEAR(double(phases.size()), 5, 1);
  const io::Plot support = support_plot(trot, motion), curves = with_pushes(mass_plot(trot, motion), report);
  std::size_t outlines = 0;
  for (const io::Series& series : support.panels[0].series)
    outlines += series.mark == io::Mark::kBoth ? 1 : 0;
  EXPECT_EQ(outlines, phases.size());
  for (const SupportPhase& phase : phases) EXPECT_EQ(phase.corners.size(), 2u);
  // Where the mass shall be, how far it is from there, and when it is pushed.
  EXPECT_EQ(std::count_if(curves.panels[0].series.begin(), curves.panels[0].series.end(),
                          [](const io::Series& series) { return !series.target_of.empty(); }),
            3);
  EXPECT_EQ(curves.panels.back().series[0].y, report.off);
  for (const io::Panel& panel : curves.panels) {
    ASSERT_EQ(panel.vertical.size(), 1u);
    EXPECT_EQ(panel.vertical[0].value, 0.5);
  }
  const PlayerInput page = mass_player(trot, motion);
  EXPECT_EQ(page.q.cols(), page.t.size());
  EXPECT_EQ(page.contacts[3].size(), 2u);
  EXPECT_LT(page.values[1].values.maxCoeff(), 1e-6);  // the legs reach
}

TEST_F(CentroidalTasks, MistakesAreNamedWithTheirPlace) {
  const auto expect = [](const std::string& message, const char* part) {
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  expect(refusal("constant_height       on", "constant_hieght on"), "did you mean 'constant_height'?");
  expect(refusal("base floating", "base fixed"), "must be floating");
  expect(refusal("FL_FOOT FR_FOOT HL_FOOT HR_FOOT", ""), "'contacts.points' is missing");
  expect(refusal("FL_FOOT FR", "FL_FOT FR"), "FL_FOOT");
  expect(refusal("impulse \"3.292 0 0\"", "v 1"), "impulse");
  expect(refusal("end_at_rest           on", "end_at_rest on\n  max_force -3"), "max_force");
  expect(refusal("horizon {", "gait {\n  period 0.4\n  phase_offsets \"0 0.5\"\n}\nhorizon {"),
         "there are 4 feet");
  expect(refusal("period     0.002", "period 0.002\n  delay 0.01"), "less than the period");
  expect(refusal("horizon {",
                 "gait {\n  period 0.4\n  phase_offsets \"0 0 0 0\"\n  velocity \"1 0 0\"\n}\nhorizon {"),
         "2 axes");
  expect(refusal("horizon {", "goal { q 0 }\nhorizon {"), "unknown key 'goal'");
}

TEST(CentroidalPictures, SupportAndCapturePoint) {
  const std::vector<Vector2d> square =
      support_polygon({{0, 0}, {1, 0}, {0.5, 0.5}, {1, 1}, {0, 1}, {0.5, 0}});
  ASSERT_EQ(square.size(), 4u);
  EXPECT_EQ(square[0], Vector2d(0, 0));
  EXPECT_EQ(square[1], Vector2d(1, 0));
  EXPECT_EQ(square[2], Vector2d(1, 1));
  EXPECT_EQ(support_polygon({{0, 0}, {1, 1}, {2, 2}}).size(), 2u);
  EXPECT_EQ(support_polygon({{3, 4}}).size(), 1u);
  CentroidalBody body;
  body.gravity = {0, 0, -10};
  body.feet = {{"a", {0, 0, 0.1}, 1}, {"b", {1, 0, 0.3}, 1}};
  VectorXd state = VectorXd::Zero(9);
  state.head(5) << 1, 2, 2.7, 3, -4;  // 2.5 m above the feet: omega 2 /s
  EXPECT_LT((capture_point(body, state) - Vector2d(2.5, 0)).norm(), 1e-12);
}

}  // namespace
}  // namespace dyntape::centroidal_task_test
