// SPDX-License-Identifier: BSD-3-Clause
//
// What a study is: measured points, and what is to be seen in them.  `dyntape study NAME` runs one and writes NAME.csv, a picture of
// each part and the page NAME.md, all from this.
//
//   Study study{.name = "springs", .title = "Springs by integrators", .question = "Which step is enough?"};
//   study.parts = {{.name = "error", .title = "Error after 1 s", .x_label = "time of a step [us]", .y_label = "error [m]",
//                   .x_scale = 1e6}};
//   study.rows.push_back({.part = "error", .subject = "stiff", .method = "midpoint", .parameter = 1e-3, .seconds = 2e-7,
//                         .value = 3e-5});
//   study.rows.push_back({.part = "error", .subject = "stiff", .method = "explicit", .parameter = 1e-3,
//                         .trouble = "grows without bound"});           // a method that fails is a row, not a gap
//   study.parts[0].findings = {"Midpoint gains two digits where ..."};             // with figures of this run
//
// References never come from what is measured: closed forms, 113 bits, another algorithm.  A new study is a file and a row in
// study.cpp.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <dyntape/interface/report/plot/picture.h>

namespace dyntape::tools {

// A measured point.  NaN: there is none.
struct StudyRow {
  std::string part;     // of StudyPart
  std::string subject;  // a robot or problem: a panel
  std::string method;   // a curve
  double parameter =
      std::numeric_limits<double>::quiet_NaN();  // what varies along the curve: step, intervals, tolerance
  double seconds = std::numeric_limits<double>::quiet_NaN();  // what it takes
  double value = std::numeric_limits<double>::quiet_NaN();    // what it gives
  std::string trouble = {};                                   // why it failed
};

// A row of panels, one for each subject that has points of this part.
struct StudyPart {
  enum X { kSeconds, kParameter };
  std::string name, title;
  X x = kSeconds;
  std::string x_label, y_label;  // with units
  double x_scale = 1;            // of what is drawn: 1e6 for microseconds
  bool log_y = true;
  io::Mark mark = io::Mark::kBoth;
  std::vector<std::string> findings = {};  // sentences to take away, with figures of this run
};

struct Study {
  std::string name, title, question;
  std::vector<StudyPart> parts = {};
  std::vector<StudyRow> rows = {};
  std::vector<std::string> methods = {};   // how it was measured: what is timed, where references come from
  std::vector<std::string> left_out = {};  // with the reason
};

struct StudyOptions {
  bool quick = false;  // fewer points, the same kinds: for tests
  std::uint64_t seed = 1;
  std::string config;  // the folder with robots/ and tasks/
  std::function<void(const std::string& doing)> watch = [](const std::string&) {};
};

// The points of a curve in the order in which they were measured.
std::vector<StudyRow> curve(const Study& study, const std::string& part, const std::string& subject,
                            const std::string& method);
// The only point of a curve, or that of a parameter.  ArgumentError where there is none.
const StudyRow& point(const Study& study, const std::string& part, const std::string& subject,
                      const std::string& method, double parameter = std::numeric_limits<double>::quiet_NaN());

// What a study is before it is measured: names, titles and parts, without points and findings.  Pictures are drawn of these and a table.
Study outline_of_routes();
Study outline_of_integrators();
Study outline_of_slopes();
Study outline_of_compile();
Study outline_of_schemes();
Study outline_of_hessians();
Study outline_of_arithmetic();
Study outline_of_contacts();
Study outline_of_effects();

// One function a study, each in the file of its name.
Study study_routes(const StudyOptions& options);
Study study_integrators(const StudyOptions& options);
Study study_slopes(const StudyOptions& options);
Study study_compile(const StudyOptions& options);
Study study_schemes(const StudyOptions& options);
Study study_hessians(const StudyOptions& options);
Study study_arithmetic(const StudyOptions& options);
Study study_contacts(const StudyOptions& options);
Study study_effects(const StudyOptions& options);

struct StudyEntry {
  const char *name, *what;
  Study (*outline)();
  Study (*run)(const StudyOptions& options);
};
const std::vector<StudyEntry>& studies();

}  // namespace dyntape::tools
