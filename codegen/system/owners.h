// SPDX-License-Identifier: BSD-3-Clause
//
// Whether somebody else could put a file of theirs in the place of one that we are going to run.
//
//   if (std::string reason = exchangeable("/home/me/.cache"); !reason.empty()) ...   "/home may be written by others"
//
// Who owns a folder, or may write it, can rename what is in it.  So every folder on the way to our files belongs to
// root (or to whoever owns /, where a user namespace does not map root) or to this user; and where others may write, as in /tmp, it has the sticky bit, which keeps their hands off what
// is ours.
#pragma once

#include <string>

namespace dyntape::codegen {

// Why what lies in the folder could be exchanged by others, "" if only root and this user can: the folder and all above it
// are looked at, from the root, each opened in the one before.  The path is absolute and free of links.
std::string exchangeable(const std::string& folder);

// Why an open file or folder is not this user's alone, "" if it is: owned by another, or others may write it.
// `path` is for the sentence.
std::string shared_with_others(int file, const std::string& path);

}  // namespace dyntape::codegen
