// SPDX-License-Identifier: BSD-3-Clause
//
// An entry of the cache, its checks, and the check of a folder that may hold libraries.
#pragma once

#include <cstdint>
#include <string>

namespace dyntape::codegen {

struct Key {
  std::string text;    // everything that determines the library
  std::string digest;  // its hash: the name of the entry
};
Key make_key(std::string text);

// The content of the manifest besides key and checksums.
struct Manifest {
  std::string name;  // of the function: a label
  int order = 0;
  std::string generator, compiler;
  std::string text_hash;  // of the C text
};

struct Entry {
  std::string folder;  // absolute path
  Manifest manifest;
  std::uint64_t bytes = 0;     // of all files
  std::int64_t last_used = 0;  // seconds since 1970
  std::string image;           // from find() and publish(): the checked bytes of the library
  std::string library() const { return folder + "/library.so"; }
  std::string source() const { return folder + "/source.c"; }
};

// The fault of an entry.
enum class Fault { kNone, kMissing, kContent, kInputOutput, kRefused };
struct Verdict {
  Fault fault = Fault::kNone;
  std::string reason;
};

// Returns the folder if only this user can write to it, or this user's private folder in it if it is shared (created
// if needed).  Returns "", with a reason, if none is usable, or if others could replace it (owners.h).
std::string private_folder(const std::string& wanted, std::string& reason);

// Reads and checks all of an entry except its source, each file once and through the opened folder.  `library`
// receives the checked bytes; if null, only their number is checked.
Verdict check_entry(const std::string& folder, const std::string& digest, Entry& entry,
                    std::string* library = nullptr);

// Whether a name is a checksum: 32 hexadecimal digits.
bool is_digest(const std::string& name);

// Returns true if a folder is an entry of dyntape, valid or not: its manifest names it, or it has exactly the files
// of an entry.
bool is_entry(const std::string& folder);

std::string manifest_text(const Key& key, const Manifest& manifest, const std::string& library,
                          const std::string& source);

}  // namespace dyntape::codegen
