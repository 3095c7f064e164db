// SPDX-License-Identifier: BSD-3-Clause
//
// What an entry of the cache is, its checks, and whether a folder may hold libraries that we run.
#pragma once

#include <cstdint>
#include <string>

namespace dyntape::codegen {

struct Key {
  std::string text;    // everything that decides the library, in words
  std::string digest;  // its hash: the name of the entry
};
Key make_key(std::string text);

// What the manifest records besides key and checksums.
struct Manifest {
  std::string name;  // of the function: a label
  int order = 0;
  std::string profile, generator, compiler;
  std::string text_hash;  // of the C text
};

struct Entry {
  std::string folder;  // absolute path
  Manifest manifest;
  std::uint64_t bytes = 0;     // of all files
  std::int64_t last_used = 0;  // seconds since 1970
  std::string image;           // of find() and publish(): the bytes of the library that were checked
  std::string library() const { return folder + "/library.so"; }
  std::string source() const { return folder + "/source.c"; }
};

// What is wrong with an entry.
enum class Fault { kNone, kMissing, kContent, kInputOutput, kRefused };
struct Verdict {
  Fault fault = Fault::kNone;
  std::string reason;
};

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
