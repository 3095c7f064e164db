// SPDX-License-Identifier: BSD-3-Clause
//
// Old names of keys of task, scene, sweep and centroidal files, from the previous version.  The next version empties
// the list.
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/files/info/section.h>

namespace dyntape {

const std::vector<io::Renamed>& old_names();

// A sentence for each old name in the file.
void note_old_names(std::vector<std::string>& notes, const io::Section& file);

}  // namespace dyntape
