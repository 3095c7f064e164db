// SPDX-License-Identifier: BSD-3-Clause
//
// The files of a finished piece of work, each whole or not there at all; what cannot be written is said, and the others
// are written all the same.
//
//   const codegen::Descriptor lock = lock_results("out/arm");       // by whoever works for longer: one at a time
//   ResultFolder folder("out/arm", report.unwritten);
//   folder.write("motion.csv", [&](const std::string& path) { write_csv(path, table); });
//   folder.remove("forces.svg");                     // of an earlier piece of work
//
// What dyntape has written is told from what is its user's by a list in the folder, .dyntape-results, of names and checksums.
// Nothing else is replaced or removed: not what was there before, and not what has been changed since.  What stands in the
// list before it is written is known as well to whoever comes after a process that was killed.  Pipes and devices are
// written to.
#pragma once

#include <map>
#include <string>
#include <vector>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/system/descriptor.h>
#include <dyntape/interface/io/csv.h>

namespace dyntape::io {

// Until the descriptor goes.  FileError where another process, or this one, has it; where the file system knows no locks,
// nobody is kept out.
codegen::Descriptor lock_results(const std::string& folder);

class ResultMarks {
 public:
  explicit ResultMarks(std::string folder);

  // dyntape has put a file of this name there, whatever became of it.
  bool knows(const std::string& file) const { return written_.contains(file); }
  // There is a file of this name, and it is as dyntape has written it.
  bool is_as_written(const std::string& file) const;
  // Why a file of this name may not be written, a sentence; "" if it may: none is there, or one as dyntape has written it.
  std::string fault_of(const std::string& file) const;

  // FileError where the list cannot be written.
  void begin(const std::string& file);
  void end(const std::string& file);  // of a file that has been written, or removed

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
