// SPDX-License-Identifier: BSD-3-Clause
//
// Writes the result files of finished work, each atomically.  A file that cannot be written is reported, and the
// others are still written.
//
//   const codegen::Descriptor lock = lock_results("out/arm");       // for long work: one process at a time
//   ResultFolder folder("out/arm", report.unwritten);
//   folder.write("motion.csv", [&](const std::string& path) { write_csv(path, table); });
//   folder.remove("forces.svg");                     // of earlier work
//
// A list in the folder, .dyntape-results, has names and checksums of the files that dyntape wrote.  Other files, and
// files that were changed since, are never replaced or removed.  A file is listed before it is written, so that the
// list is right even if the process is killed.  Pipes and devices are written directly.
#pragma once

#include <map>
#include <string>
#include <vector>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/system/descriptor.h>
#include <dyntape/interface/io/csv.h>

namespace dyntape::io {

// Locks until the descriptor is closed.  FileError if another process, or this one, has the lock.  File systems
// without locks are not protected.
codegen::Descriptor lock_results(const std::string& folder);

class ResultMarks {
 public:
  explicit ResultMarks(std::string folder);

  // Returns true if dyntape has written a file of this name, whatever its current state.
  bool knows(const std::string& file) const { return written_.contains(file); }
  // Returns true if a file of this name exists and is as dyntape wrote it.
  bool is_as_written(const std::string& file) const;
  // Returns why a file of this name must not be written; "" if none exists, or it is as dyntape wrote it.
  std::string fault_of(const std::string& file) const;

  // FileError if the list cannot be written.
  void begin(const std::string& file);
  void end(const std::string& file);  // after a file is written, or removed

 private:
  std::string path(const std::string& file) const { return folder_ + "/" + file; }
  void append(const std::string& state, const std::string& file);
  void shorten() const;

  std::string folder_;
  bool is_list_foreign_ = false;
  std::map<std::string, std::string> written_;  // name: checksum, or kBegun
};

class ResultFolder {
 public:
  // `unwritten` gets a sentence for each file that is not where it belongs.
  ResultFolder(std::string folder, std::vector<std::string>& unwritten)
      : folder_(std::move(folder)), unwritten_(unwritten), marks_(folder_) {}

  std::string path(const char* file) const { return folder_ + "/" + file; }

  template <class Write>
  void write(const char* file, const Write& write) {
    try {
      if (const std::string fault = marks_.fault_of(file); !fault.empty()) throw FileError(fault);
      marks_.begin(file);
      write(path(file));
      marks_.end(file);
    } catch (const Error& e) {
      unwritten_.push_back(e.what());
      remove(file);
    }
  }

  void write_text(const char* file, const std::string& text);
  void write_table(const char* file, const CsvTable& table);  // numbers that are not finite too

  // Should it be there, as a plain file that dyntape has written.
  void remove(const char* file);

 private:
  std::string folder_;
  std::vector<std::string>& unwritten_;
  ResultMarks marks_;
};

// What a process that was killed was about to put in the place of these files.  For who holds the lock.
void remove_abandoned(const std::string& folder, const std::vector<std::string>& files);

}  // namespace dyntape::io
