// SPDX-License-Identifier: BSD-3-Clause
//
// The content-addressed store of compiled libraries.
//
//   std::optional<Cache> cache = Cache::open("");            none: no usable folder; the reason is said once
//   if (auto entry = cache->find(key)) load(entry->library);
//   else cache->publish(folder_with_new_files, key, manifest);
//
// An entry is a folder named by its key, with library.so, source.c and manifest.json:
//
//   - the key covers all that decides the library, so nothing stale can be found and nobody's name matters
//   - an entry appears by one rename: several processes may race, nobody sees half an entry, the first wins
//   - the library is checked against the manifest's checksum, and what is loaded are the bytes that were checked
//   - wrong *content* (truncated, foreign) deletes the entry; an I/O error never deletes anything
//   - loading a library is running it: a folder or entry that the user does not own, that others may write, or
//     that they could exchange for another, is refused.  In a folder that is shared each user has a private one,
//     user-<number>.
//   - what does not carry dyntape's mark, an entry's manifest or the file .dyntape of a folder of work, is not
//     touched
//
// $DYNTAPE_CACHE_LIMIT (bytes, or with K, M, G; default 2G) bounds the store: the entries that were used
// longest ago go first, at most once an hour, by one process at a time; with them goes what builds leave behind that
// were killed.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <dyntape/codegen/store/entry.h>
#include <dyntape/codegen/system/files.h>

namespace dyntape::codegen {

// A folder in which something is or was compiled: at work, of a build that was ended half-way, or the source of one that
// failed, kept for a day.
struct LeftOver {
  std::string folder;
  Left state = Left::kOver;
  std::uint64_t bytes = 0;
  std::int64_t modified = 0;  // seconds since 1970
};

class Cache {
 public:
  // `folder` empty: the usual place.
  static std::optional<Cache> open(const std::string& folder);
  // $DYNTAPE_CACHE, $XDG_CACHE_HOME/dyntape, ~/.cache/dyntape, or "" where there is none of them.
  static std::string usual_folder();

  const std::string& folder() const { return folder_; }

  std::optional<Entry> find(const Key& key) const;
  // Takes over the files of `built`.  The entry is somebody else's equal one if that was faster, unless
  // `replace`.  None: it could not be published (said once) and `built` is still there.
  std::optional<Entry> publish(TemporaryFolder& built, const Key& key, const Manifest& manifest,
                               bool replace) const;
  void remove(const Key& key) const;

  // For people: everything that is stored, what is wrong with an entry, and removal of all.
  std::vector<Entry> list() const;
  std::vector<LeftOver> left_over() const;  // and what is over in the folder for temporary files
  Verdict verify(const std::string& digest) const;
  // With what builds left behind.  Returns the number of entries removed; FileError if one cannot be.
  std::size_t clear() const;
  // Removes what was used longest ago until the rest fits; returns the number of entries removed.
  std::size_t sweep(std::uint64_t limit) const;
  // The same with cache_limit(), unless it was done within the hour or another process is at it.
  void sweep_sometimes() const;

 private:
  explicit Cache(std::string folder) : folder_(std::move(folder)) {}
  std::vector<std::string> entries() const;  // their folders
  void remove_left_over() const;
  std::string folder_of(const std::string& digest) const { return folder_ + "/" + digest; }

  std::string folder_;
};

// $DYNTAPE_CACHE_LIMIT; ArgumentError if it is not a number of bytes.
std::uint64_t cache_limit();

}  // namespace dyntape::codegen
