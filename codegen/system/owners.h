// SPDX-License-Identifier: BSD-3-Clause
//
// Checks whether another user could replace a file that this process will run.
//
//   if (std::string reason = exchangeable("/home/me/.cache"); !reason.empty()) ...   "/home may be written by others"
//
// The owner of a folder, and users who may write it, can rename its contents.  Therefore every folder on the path
// must belong to this user or to root (or to the owner of /, if a user namespace does not map root).  A folder that
// others may write, as /tmp, must have the sticky bit, which prevents others from renaming our files.
#pragma once

#include <string>

namespace dyntape::codegen {

// Why other users could replace the contents of a folder; "" if only root and this user can.  Checks the folder and
// all folders above, from the root, each opened in the previous one.  The path must be absolute and without links.
std::string exchangeable(const std::string& folder);

// Why an open file or folder is not this user's alone: another owner, or others may write it; "" if it is.  `path`
// is for the message.
std::string shared_with_others(int file, const std::string& path);

}  // namespace dyntape::codegen
