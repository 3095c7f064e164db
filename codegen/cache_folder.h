// SPDX-License-Identifier: BSD-3-Clause
//
// Whether a folder may hold libraries that we run, and the checks of one entry.
#pragma once

#include <string>

#include <dyntape/codegen/cache.h>

namespace dyntape::codegen {

// The folder itself if it is this user's alone, the private one in it if it is shared, made if need be.
// Empty, with a reason: there is no usable one.
std::string private_folder(const std::string& wanted, std::string& reason);

// Reads and checks everything of an entry but its source.
Verdict check_entry(const std::string& folder, const std::string& digest, Entry& entry);

std::string manifest_text(const Key& key, const Manifest& manifest, const std::string& library,
                          const std::string& source);

// Whether a file or folder is ours and nobody else may write it.
bool is_ours_alone(const std::string& path, bool folder, std::string& reason);

}  // namespace dyntape::codegen
