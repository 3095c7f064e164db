// SPDX-License-Identifier: BSD-3-Clause
//
// The content-addressed store of compiled libraries, shared by all processes of a user.  Use it to find a library
// before compiling, and to publish a new library.
//
//   std::optional<Cache> cache = Cache::open("");            nullopt: no usable folder; the reason is reported once
//   if (auto entry = cache->find(key)) load(entry->library);
//   else cache->publish(folder_with_new_files, key, manifest);
//
// An entry is a folder named by its key.  It holds library.so, source.c and manifest.json.
//
// - The key covers everything that determines the library.  A stale library is never found; names of functions do
// not matter.
// - An entry is published by one rename.  If several processes race, the first wins; half an entry is never visible.
// - The library is compared with the checksum of the manifest, and exactly the checked bytes are loaded.
// - Wrong content (truncated, foreign) deletes the entry.  An I/O error never deletes anything.
// - Loading a library runs its code.  A folder or entry is refused if the user does not own it, if others may write
// to it, or if others could replace it.  In a shared folder each user has a private folder, user-<number>.
// - Only files with dyntape's mark are touched: an entry's manifest, or the file .dyntape of a temporary folder.
//
// $DYNTAPE_CACHE_LIMIT bounds the size of the store: bytes, or a number with K, M or G; default 2G.  The least
// recently used entries are removed first, at most once per hour, by one process at a time.  Folders of builds that
// were killed are removed at the same time.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <dyntape/codegen/store/entry.h>
#include <dyntape/codegen/system/files.h>

namespace dyntape::codegen {

// A folder of a compilation: in use, abandoned by a build that was killed, or kept for a day because the compiler
// failed.
struct LeftOver {
  std::string folder;
  Left state = Left::kOver;
  std::uint64_t bytes = 0;
  std::int64_t modified = 0;  // seconds since 1970
};

class Cache {
 public:
  // If `folder` is empty: usual_folder().
  static std::optional<Cache> open(const std::string& folder);
  // $DYNTAPE_CACHE, $XDG_CACHE_HOME/dyntape or ~/.cache/dyntape, the first that is set; else "".
  static std::string usual_folder();

  const std::string& folder() const { return folder_; }

  std::optional<Entry> find(const Key& key) const;
  // Moves the files of `built` into the store.  If another process published the same entry first, returns that
  // entry, unless `replace`.  If publishing fails, returns nullopt, reports the reason once, and keeps `built`.
  std::optional<Entry> publish(TemporaryFolder& built, const Key& key, const Manifest& manifest,
                               bool replace) const;
  void remove(const Key& key) const;

  // --- inspection and removal ---
  std::vector<Entry> list() const;
  std::vector<LeftOver> left_over() const;  // also of the folder for temporary files
  Verdict verify(const std::string& digest) const;
  // Removes all entries and leftover folders.  Returns the number of entries removed; FileError if an entry stays.
  std::size_t clear() const;
  // Removes the least recently used entries until the rest fits; returns the number of entries removed.
  std::size_t sweep(std::uint64_t limit) const;
  // Calls sweep(cache_limit()), unless it ran within the last hour or another process runs it.
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
