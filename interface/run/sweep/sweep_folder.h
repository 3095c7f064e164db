// SPDX-License-Identifier: BSD-3-Clause
//
// The intermediate files of a running sweep: one atomic file per chunk of rows.
//
//   SweepFolder folder("out/drop", sweep, Restart::kNo);      // locked; refuses another sweep's chunks
//   if (!folder.has(12)) folder.keep(12, chunk_text(sweep, folder.identity(), 12, computed));
//   folder.rows(); folder.failures();                          // of all chunks, in order
//   folder.clear();                                            // after the results are written
//
// Chunks carry the identity of their sweep: identity_of is a checksum of everything that the rows depend on.  After
// a process is killed, its finished chunks stay, and the next process continues from there.
//
// Errors.  FileError if the folder has another sweep, is in use by another process, or cannot be written.
#pragma once

#include <string>
#include <vector>

#include <dyntape/codegen/system/descriptor.h>
#include <dyntape/interface/run/sweep/sweep_rows.h>

namespace dyntape {

// The result files of a finished sweep.
inline constexpr const char *kSweepTable = "sweep.csv", *kSweepFailures = "failures.txt",
                            *kSweepUnderstood = "effective.info", *kSweepPicture = "sweep.svg",
                            *kSweepReport = "report.json";
std::vector<std::string> sweep_files();

// Checksum of the sources that determine rows.
const char* program_fingerprint();

// Checksum of the program, values, scene, text of the robot and seed; not of lanes, threads and paths.
std::string identity_of(const SceneSweep& sweep, const std::string& program = program_fingerprint());

struct ChunkRange {
  long first = 0, count = 0;  // rows
};
long chunks_of(const SceneSweep& sweep);
ChunkRange range_of(const SceneSweep& sweep, long chunk);

// The complete file of a chunk, with a checksum at its end.
std::string chunk_text(const SceneSweep& sweep, const std::string& identity, long chunk,
                       const ComputedRows& rows);

// kYes: removes files of any sweep, and no others: chunks carry a mark, results are in a list (io/result_folder.h).
enum class Restart { kNo, kYes };

class SweepFolder {
 public:
  SweepFolder(const std::string& folder, const SceneSweep& sweep, Restart restart);

  const std::string& identity() const { return identity_; }
  // Returns true if an earlier run wrote its results and they are unchanged.
  bool is_finished() const { return is_finished_; }
  bool has(long chunk) const { return chunks_[std::size_t(chunk)] != 0; }
  long kept() const;  // chunks

  // Throws FileError if `text` is not the text of this chunk, or cannot be written.
  void keep(long chunk, const std::string& text);

  // Of all chunks, which must be complete.
  ComputedRows all() const;
  void clear();

 private:
  std::string path_of(long chunk) const;
  void refuse_others_chunks() const;
  void begin_anew();
  void remove_empty_chunks() const;
  void look();
  void refuse_other(const std::string& other) const;

  const SceneSweep& sweep_;
  std::string folder_, identity_;
  std::vector<char> chunks_;
  bool is_finished_ = false;
  codegen::Descriptor lock_, lock_of_results_;
};

}  // namespace dyntape
