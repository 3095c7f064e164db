// SPDX-License-Identifier: BSD-3-Clause
//
// A part of the study `compile`: what it costs to wait for each way to evaluate a recording, and when it has paid.
#pragma once

#include "study.h"

namespace dyntape::tools {

StudyPart outline_of_waiting();
// Appends points and findings to `part`, and what was left out.
void study_waiting(Study& study, StudyPart& part, const StudyOptions& options);

}  // namespace dyntape::tools
