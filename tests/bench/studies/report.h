// SPDX-License-Identifier: BSD-3-Clause
//
// A study as files: the same table, the same way to draw and the same page for all.
#pragma once

#include <string>
#include <vector>

#include "study.h"

namespace dyntape::tools {

// A method has one look in all pictures of a study, and the picture one legend.  Exact zeros stand on a line of their own below all
// else.
io::Plot study_picture(const Study& study, const StudyPart& part);

std::string study_csv(const Study& study, const StudyOptions& options);  // a row a point
std::vector<StudyRow> read_study_csv(const std::string& path);  // FileError where it is no such table
std::string study_page(const Study& study, const StudyOptions& options);  // Markdown
std::string study_text(const Study& study);                               // for a terminal

// NAME_PART.svg of each part; what was written.
std::vector<std::string> draw_study(const Study& study, const std::string& folder);

// NAME.csv, NAME_PART.svg of each part, NAME.md, and what was written.
std::vector<std::string> write_study(const Study& study, const StudyOptions& options,
                                     const std::string& folder);

}  // namespace dyntape::tools
