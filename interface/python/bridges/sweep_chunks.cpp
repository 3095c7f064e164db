// SPDX-License-Identifier: BSD-3-Clause
//
// A sweep in parts, for other tools' workers (dyntape/bridges/workers.py): which chunks of rows are missing in a folder, and what is
// in one.  The folder is that of dyntape.sweep, which goes on from there.
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <filesystem>
#include <mutex>
#include <optional>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/run/sweep/sweep_folder.h>

#include "../module.h"
#include "../motions.h"
#include "../watch.h"

namespace dyntape::python {
namespace {

class SweepWork {
 public:
  SweepWork(const std::string& file, const std::vector<io::Setting>& settings)
      : sweep_(read_sweep(file, settings)), identity_(identity_of(sweep_)) {}

  const std::string& identity() const { return identity_; }
  long chunks() const { return chunks_of(sweep_); }

  // The text of a chunk; one at a time for each thread that asks.
  std::string compute(long chunk, const std::stop_token& stop) {
    check(chunk);
    std::optional<SweepRows> mine;
    {
      const std::scoped_lock lock(mutex_);
      if (!rows_) rows_.emplace(sweep_, sweep_.evaluation);
      mine.emplace(rows_->twin());
    }
    const ChunkRange range = range_of(sweep_, chunk);
    const std::optional<ComputedRows> computed = mine->compute(range.first, range.count, stop);
    return computed ? chunk_text(sweep_, identity_, chunk, *computed) : "";
  }

  // Chunks that are not there; none where the results are.
  std::vector<long> open(const std::string& folder, bool restart) {
    folder_.emplace(folder, sweep_, restart ? Restart::kYes : Restart::kNo);
    std::vector<long> missing;
    for (long chunk = 0; chunk < chunks() && !folder_->is_finished(); ++chunk)
      if (!folder_->has(chunk)) missing.push_back(chunk);
    return missing;
  }

  void keep(long chunk, const std::string& text) {
    check(chunk);
    if (!folder_) throw ArgumentError("sweep: a chunk is kept where no folder is open");
    if (!folder_->has(chunk)) folder_->keep(chunk, text);
  }

  void close() { folder_.reset(); }

 private:
  void check(long chunk) const {
    if (chunk < 0 || chunk >= chunks())
      throw ArgumentError("sweep: chunk " + std::to_string(chunk) + ", expected 0 to " +
                          std::to_string(chunks() - 1));
  }

  const SceneSweep sweep_;
  const std::string identity_;
  std::mutex mutex_;
  std::optional<SweepRows> rows_;
  std::optional<SweepFolder> folder_;
};

}  // namespace

void bind_sweep_chunks(nb::module_& module) {
  using W = SweepWork;
  nb::class_<W> work(module, "SweepWork", "A sweep file in chunks of rows, for dyntape.bridges.workers.");
  work.def(
      "__init__",
      [](W* self, const std::filesystem::path& file, nb::handle set) {
        new (self) W(file.string(), settings_from(set));
      },
      nb::arg("file"), nb::kw_only(), nb::arg("set") = nb::none(),
      nb::sig("def __init__(self, file: str | os.PathLike[str], *, set: Mapping[str, Any] | None = None) -> "
              "None"));
  work.def_prop_ro("identity", &W::identity, "A checksum of all that the rows depend on.")
      .def_prop_ro("chunks", &W::chunks, "How many there are.")
      .def(
          "compute",
          [](W& self, long chunk) {
            return watched(nb::none(), [&](const Watch& watch) { return self.compute(chunk, watch.stop); });
          },
          nb::arg("chunk"), "The text of a chunk, the same whoever computes it.")
      .def(
          "open",
          [](W& self, const std::filesystem::path& folder, bool restart) {
            return self.open(folder.string(), restart);
          },
          nb::arg("folder"), nb::kw_only(), nb::arg("restart") = false,
          nb::sig("def open(self, folder: str | os.PathLike[str], *, restart: bool = False) -> list[int]"),
          "Locks the folder; returns the chunks that it lacks, none where the sweep is finished.")
      .def("keep", &W::keep, nb::arg("chunk"), nb::arg("text"), "Writes a chunk, whole or not at all.")
      .def("close", &W::close, "Lets go of the folder.");
}

}  // namespace dyntape::python
