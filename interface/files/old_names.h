// SPDX-License-Identifier: BSD-3-Clause
//
// What keys of task, scene, sweep and centroidal files were called in the version before.  To be emptied with the next one.
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/files/info/section.h>

namespace dyntape {

const std::vector<io::Renamed>& old_names();

// A sentence for each that the file uses.
void note_old_names(std::vector<std::string>& notes, const io::Section& file);

}  // namespace dyntape
