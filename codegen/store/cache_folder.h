// SPDX-License-Identifier: BSD-3-Clause
//
// Whether a folder may hold libraries that we run, and the checks of one entry.
#pragma once

#include <string>

#include <dyntape/codegen/store/cache.h>

namespace dyntape::codegen {

// The folder itself if it is this user's alone, the private one in it if it is shared, made if need be.
// Empty, with a reason: there is no usable one, or others could exchange it (owners.h).
std::string private_folder(const std::string& wanted, std::string& reason);

// Reads and checks everything of an entry but its source, each file once and through the opened folder.  `library`
// receives the bytes that were checked; without it they are not read, and only their number is.
Verdict check_entry(const std::string& folder, const std::string& digest, Entry& entry,
                    std::string* library = nullptr);

// Whether a name is a checksum: 32 hexadecimal digits.
bool is_digest(const std::string& name);

// Whether a folder is an entry of ours, sound or not: its manifest names it, or it holds what an entry does and
// nothing else.  Whatever lies beside entries is somebody else's.
bool is_entry(const std::string& folder);

std::string manifest_text(const Key& key, const Manifest& manifest, const std::string& library,
                          const std::string& source);

}  // namespace dyntape::codegen
