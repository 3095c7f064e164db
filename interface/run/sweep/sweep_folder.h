// SPDX-License-Identifier: BSD-3-Clause
//
// What a sweep has on disk before it is at its end: a file for each chunk of rows, whole or not there.
//
//   SweepFolder folder("out/drop", sweep, Restart::kNo);      // locked; another sweep's chunks are refused
//   if (!folder.has(12)) folder.keep(12, chunk_text(sweep, folder.identity(), 12, computed));
//   folder.rows(); folder.failures();                          // of all chunks, in order
//   folder.clear();                                            // when the results are written
//
// Chunks say which sweep they are of: identity_of is a checksum of all that the rows depend on.  A process that was killed
// leaves what it had finished, and one that begins again goes on from there.
//
// Errors: FileError where the folder holds another sweep, is in use by another process, or cannot be written.
#pragma once

#include <string>
#include <vector>

#include <dyntape/codegen/system/descriptor.h>
#include <dyntape/interface/run/sweep/sweep_rows.h>

namespace dyntape {

// The results that a sweep leaves when it is finished.
inline constexpr const char *kSweepTable = "sweep.csv", *kSweepFailures = "failures.txt",
                            *kSweepUnderstood = "effective.info", *kSweepPicture = "sweep.svg",
                            *kSweepReport = "report.json";
std::vector<std::string> sweep_files();

// Of the sources that decide what rows are.
const char* program_fingerprint();

// Of the program, the values, the scene, the text of its robot, the seed; not of lanes, threads and places in the file system.
std::string identity_of(const SceneSweep& sweep, const std::string& program = program_fingerprint());

struct ChunkRange {
  long first = 0, count = 0;  // rows
};
long chunks_of(const SceneSweep& sweep);
ChunkRange range_of(const SceneSweep& sweep, long chunk);

// The whole of a chunk's file, with a checksum at its end.
std::string chunk_text(const SceneSweep& sweep, const std::string& identity, long chunk,
                       const ComputedRows& rows);

// Yes: what any sweep has left there is removed.  Nothing else ever is: chunks say what they are, results stand in a list
// (io/result_folder.h).
enum class Restart { kNo, kYes };

class SweepFolder {
 public:
  SweepFolder(const std::string& folder, const SceneSweep& sweep, Restart restart);

  const std::string& identity() const { return identity_; }
  // Its results are written, by an earlier run, and nobody has changed them since.
  bool is_finished() const { return is_finished_; }
  bool has(long chunk) const { return chunks_[std::size_t(chunk)] != 0; }
  long kept() const;  // chunks

  // FileError where `text` is not that of this chunk, or cannot be written.
  void keep(long chunk, const std::string& text);

  // Of chunks that are all there.
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
