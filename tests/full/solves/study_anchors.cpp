// SPDX-License-Identifier: BSD-3-Clause
//
// Studies reproduce figures that are known, in their quick form; and what a study is made into.
#include <gtest/gtest.h>

#include <boost/property_tree/info_parser.hpp>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/run/solve/solve.h>

#include "advice.h"
#include "chains.h"
#include "report.h"
#include "source_folder.h"

namespace dyntape::tools {
namespace {

StudyOptions quick() {
  StudyOptions options{.quick = true, .config = test::source_folder() + "/config"};
  options.watch = [](const std::string&) {};
  return options;
}

// Order of convergence along a curve of errors.
double order(const Study& study, const std::string& subject, const std::string& method) {
  std::vector<double> steps, errors;
  for (const StudyRow& row : curve(study, "error", subject, method)) {
    if (!(row.value > 1e-10)) continue;  // there it is rounding
    steps.push_back(row.parameter), errors.push_back(row.value);
  }
  return fitted_slope(steps, errors, 0);
}

TEST(StudyAnchors, Integrators) {
  const Study study = study_integrators(quick());
  const std::string flight = "quadruped in flight";
  EXPECT_NEAR(order(study, flight, "semi-implicit-euler"), 1, 0.15);
  EXPECT_NEAR(order(study, flight, "implicit-midpoint"), 2, 0.1);
  EXPECT_NEAR(order(study, flight, "runge-kutta-4"), 4, 0.2);
  // Figures of an independent implementation, in units of g.
  EXPECT_NEAR(point(study, "drift", "pendulum", "semi-implicit-euler").value, 1.854e-2, 2e-5);
  EXPECT_NEAR(point(study, "drift", "pendulum", "implicit-midpoint").value, 8.197e-5, 1e-7);
  EXPECT_NEAR(point(study, "drift", "pendulum", "runge-kutta-4").value, 9.76e-7, 2e-9);
  EXPECT_GT(point(study, "drift", "free body that tumbles", "semi-implicit-euler").value, 0.1);
  EXPECT_LT(point(study, "drift", "free body that tumbles", "implicit-midpoint").value, 1e-11);
  // x0 / sqrt(1 - (h omega / 2)^2) at h = 6e-5 s; 2 and 2 sqrt(2) are where schemes end to be stable.
  const std::string spring = "spring, 1 g on 1e6 N/m";
  EXPECT_NEAR(point(study, "stiff", spring, "semi-implicit-euler", 1.8973665961).value, 3.162, 0.01);
  EXPECT_NE(point(study, "stiff", spring, "semi-implicit-euler", 2.02).trouble, "");
  EXPECT_EQ(point(study, "stiff", spring, "runge-kutta-4", 2.8).trouble, "");
  EXPECT_NE(point(study, "stiff", spring, "runge-kutta-4", 2.9).trouble, "");
  EXPECT_LE(point(study, "stiff", spring, "implicit-midpoint", 316.2278).value, 1 + 1e-9);
}

// Floors of d FD/dq by differences: 3.3e-8 and 7.2e-11 on the arm, medians of 20 states of an independent implementation, within a
// factor of three there; three states here.
TEST(StudyAnchors, Routes) {
  const Study study = study_routes(quick());
  const auto floor = [&](const char* route) {
    double least = HUGE_VAL;
    for (const StudyRow& row : curve(study, "step", "arm (7 joints)", route))
      least = std::min(least, row.value);
    return least;
  };
  EXPECT_GT(floor("fd-forward"), 3.3e-8 / 10);
  EXPECT_LT(floor("fd-forward"), 3.3e-8 * 10);
  EXPECT_GT(floor("fd-central"), 7.2e-11 / 10);
  EXPECT_LT(floor("fd-central"), 7.2e-11 * 10);
  for (const char* route : {"analytic", "tape", "generated", "generated, lanes"})
    EXPECT_LT(point(study, "time", "arm (7 joints)", route).value, 1e-13) << route;
}

// Errors against the limit of finer meshes by shooting, and misses of the control simulated again: of an independent implementation.
TEST(StudyAnchors, Schemes) {
  const Study study = study_schemes(quick());
  const auto value = [&](const char* part, const char* scheme, double intervals) {
    return point(study, part, "cart-pole swing-up", scheme, intervals).value;
  };
  EXPECT_NEAR(value("cost", "hermite-simpson", 20), 1.05e-1, 1e-3);
  EXPECT_NEAR(value("cost", "hermite-simpson", 40), 9.16e-5, 1e-7);
  EXPECT_NEAR(value("cost", "hermite-simpson", 80), 3.42e-6, 1e-8);
  EXPECT_NEAR(value("miss", "hermite-simpson", 20), 0.710, 1e-3);
  EXPECT_NEAR(value("miss", "hermite-simpson", 40), 1.36e-2, 1e-4);
  EXPECT_NEAR(value("miss", "hermite-simpson", 80), 8.39e-4, 1e-6);
  EXPECT_NEAR(value("cost", "trapezoid", 20), 60.682465 - 58.8076675, 1e-4);
  EXPECT_NEAR(value("cost", "trapezoid", 80), 58.945299 - 58.8076675, 1e-4);
  EXPECT_NEAR(value("cost", "euler", 20), 58.8076675 - 13.639622, 1e-3);
}

// Iterations of Ipopt: at most 16, 30 to 50, more than 150.
TEST(StudyAnchors, Hessians) {
  const Study study = study_hessians(quick());
  for (const char* weight : {"0", "1", "10"}) {
    const auto iterations = [&](const char* method) {
      return point(study, "iterations", std::string("goal demanded, w = ") + weight, method).value;
    };
    EXPECT_LE(iterations("Ipopt, exact"), 16);
    EXPECT_LE(iterations("stages, exact"), 16);
    EXPECT_GE(iterations("Ipopt, limited memory"), 30);
    EXPECT_LE(iterations("Ipopt, limited memory"), 50);
    EXPECT_GT(iterations("Ipopt, Gauss-Newton"), 150);
  }
}

// The rebound of a compliant contact in closed form, and the creep of smooth friction.
TEST(StudyAnchors, Contacts) {
  const Study study = study_contacts(quick());
  const std::string drops = "block that drops: rebound", creeps = "block on 20 degrees: creeps";
  EXPECT_LT(point(study, "error", drops, "compliant, runge-kutta-4", 5e-4).value, 1e-3);
  EXPECT_LT(point(study, "error", creeps, "compliant, runge-kutta-4", 1e-3).value, 1e-9);
  EXPECT_NE(point(study, "error", creeps, "compliant, semi-implicit-euler", 0.01).trouble, "");
}

// Double keeps twelve digits along chains and up to ratios of 1e9; float does not.
TEST(StudyAnchors, Arithmetic) {
  const Study study = study_arithmetic(quick());
  const auto worst = [&](const char* method) {
    double worst = 0;
    for (const StudyRow& row : curve(study, "chain", "accelerations", method))
      worst = std::max(worst, row.value);
    return worst;
  };
  EXPECT_LT(worst("double, 53 bits"), 1e-12);
  EXPECT_LT(worst("113 bits"), 1e-30);
  EXPECT_GT(worst("float, 24 bits"), 1e-7);
}

TEST(StudyReport, FailuresAndZerosAreShown) {
  Study study{.name = "s", .title = "Springs", .question = "Which?"};
  study.parts = {{.name = "error",
                  .title = "Error",
                  .x_label = "time [s]",
                  .y_label = "error [m]",
                  .findings = {"So it is."}}};
  study.rows = {
      {.part = "error", .subject = "a, b", .method = "one", .parameter = 1, .seconds = 1, .value = 1e-3},
      {.part = "error", .subject = "a, b", .method = "one", .parameter = 2, .seconds = 2, .value = 0},
      {.part = "error", .subject = "a, b", .method = "two", .parameter = 1, .trouble = "grows"}};
  const std::string csv = study_csv(study, {}), page = study_page(study, {});
  EXPECT_NE(csv.find("error,\"a, b\",two,1,,,grows,"), std::string::npos) << csv;
  EXPECT_NE(page.find("| error | a, b | two | 1 | grows |"), std::string::npos) << page;
  EXPECT_NE(page.find("- So it is."), std::string::npos) << page;
  const io::Plot plot = study_picture(study, study.parts[0]);
  ASSERT_EQ(plot.panels.size(), 1u);
  ASSERT_EQ(plot.panels[0].series.size(), 1u);  // nothing to draw of what failed
  EXPECT_EQ(plot.panels[0].zero, 1e-4);
  const std::string script = io::gnuplot_script(plot, "svg", "s.svg");
  EXPECT_NE(script.find("set ytics add ('0' 0.0001)"), std::string::npos) << script;
  EXPECT_NE(script.find("2 0.0001"), std::string::npos) << script;
  EXPECT_EQ(point(study, "error", "a, b", "one", 2).value, 0);
  EXPECT_THROW(point(study, "error", "a, b", "three"), std::exception);
}

// Of the swing-up the optimum is known by shooting; each choice keeps what was asked for, and is no slower than what it was taken from.
TEST(Advice, KeepsTheDigitsAndItsKeysAreRead) {
  const std::string config = test::source_folder() + "/config/tasks/";
  Task task = read_task(config + "cart_pole_swing_up.info");
  task.optimise.solver.method = NlpMethod::kIpopt;  // the slower one
  const Advice advice = advise(task, {.digits = 5, .solves = 1e6});
  EXPECT_NEAR(advice.reference, 58.8076674582, 58.8 * (3 * advice.known_to + 1e-9));
  EXPECT_LT(advice.known_to, 1e-7);
  ASSERT_TRUE(advice.reached);
  ASSERT_EQ(advice.choices.size(), 5u);
  EXPECT_EQ(advice.choices[0].what, "as it is");
  EXPECT_GT(advice.choices[0].error, 1e-5);
  for (std::size_t k = 1; k < advice.choices.size(); ++k) {
    EXPECT_LE(advice.choices[k].error, 1e-5) << advice.choices[k].what;
    EXPECT_GT(advice.choices[k].seconds, 0) << advice.choices[k].what;
  }
  EXPECT_LT(advice.choices[1].seconds, advice.choices[0].seconds);
  for (const char* refused : {"stages, gauss_newton", "stages, limited_memory"})
    EXPECT_NE(point(advice.study, "solvers", "cart_pole_swing_up", refused).trouble, "") << refused;

  // The file with these keys is solved to what was promised.
  boost::property_tree::ptree file, keys;
  read_info(config + "cart_pole_swing_up.info", file);
  std::istringstream text(advice.keys);
  read_info(text, keys);
  for (const auto& [section, block] : keys)
    for (const auto& [key, value] : block) file.put(section + "." + key, value.data());
  file.put("robot.urdf", test::source_folder() + "/config/robots/cart_pole.urdf");
  file.erase("expected");
  const std::string path = testing::TempDir() + "advised.info";
  write_info(path, file);
  Task advised = read_task(path);
  std::remove(path.c_str());
  EXPECT_EQ(advised.demands.refinements, 4);
  advised.demands.refinements = 0;
  const SolveReport report = solve_task(advised);
  EXPECT_TRUE(report.success()) << report.verdict();
  EXPECT_NEAR(report.solution.cost(), 58.8076674582, 58.8 * 1e-5);
  EXPECT_LE(report.solution.verification.worst_relative, 1e-5);
}

// The shortest time with a force of 100 N at most, of 1 kg over 0.7 m from 1 m/s to rest: T = (2 sqrt(v^2 / 2 + a d) - v) / a.  Its force
// jumps between points of every mesh, by which all schemes on that mesh are off alike.
TEST(Advice, KnowsHowFarAShortestTimeIsOff) {
  const std::string path = testing::TempDir() + "shortest_time.info";
  {
    std::ofstream file(path);
    file << "robot { urdf " << test::source_folder() << "/config/robots/block.urdf }\n"
         << "horizon { duration 1\nmin_duration 0.02\nmax_duration 5\nintervals 10 }\n"
         << "start { q { slider 0.3 }\nv { slider 1 } }\ngoal { q { slider 1 } }\ncosts { time 1 }\n";
  }
  const Advice advice = advise(read_task(path), {.digits = 6, .seconds = 10});
  std::remove(path.c_str());
  const double shortest = (2 * std::sqrt(0.5 + 70) - 1) / 100;
  EXPECT_LE(std::abs(advice.reference - shortest) / shortest, 3 * advice.known_to);
  EXPECT_LT(advice.known_to, 1e-3);
}

TEST(Advice, TellsWhereThereIsNothingToChoose) {
  Task task = read_task(test::source_folder() + "/config/tasks/cart_pole_ddp.info");
  EXPECT_THROW(advise(task), ArgumentError);
  // Thrusters are no motors of a scene.
  const Task flight = read_task(test::source_folder() + "/config/tasks/quadrotor_flight.info");
  const Advice advice = advise(flight, {.digits = 2, .seconds = 20});
  EXPECT_EQ(advice.choices.back().chosen, "nothing to choose");
  ASSERT_EQ(advice.choices.back().measured.size(), 1u);
  // Another optimum is near, at 13.608: the one that is meant is the file's own.
  EXPECT_NEAR(advice.reference, 13.7251814, 1e-3);
}

}  // namespace
}  // namespace dyntape::tools
