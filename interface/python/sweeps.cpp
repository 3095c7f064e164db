// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape.sweep: a scene with many values of some of its numbers.
#include <nanobind/stl/filesystem.h>

#include <filesystem>

#include <dyntape/interface/report/sweep_results.h>
#include <dyntape/interface/run/sweep/run_sweep.h>

#include "module.h"
#include "motions.h"
#include "watch.h"

namespace dyntape::python {
namespace {

// Columns by name.
nb::dict columns_by_name(const io::CsvTable& table) {
  nb::dict columns;
  for (const std::string& name : table.names()) columns[name.c_str()] = entries_of(table.column(name));
  return columns;
}

SweepOutcome swept(const SceneSweep& sweep, const std::string& folder, bool restart, const Watch& watch) {
  SweepFolder chunks(folder, sweep, restart ? Restart::kYes : Restart::kNo);
  if (chunks.is_finished()) return finished_outcome(sweep, folder);
  SweepReport report{sweep, run_sweep(sweep, chunks, {watch.stop, watch.tell, nullptr})};
  if (report.outcome.was_stopped) return report.outcome;
  write_sweep_results(report, folder, watch.stop);
  if (report.unwritten.empty()) chunks.clear();
  return report.outcome;
}

nb::dict sweep_file(const std::filesystem::path& file, const std::filesystem::path& output, nb::handle set,
                    bool restart, nb::handle progress) {
  const SceneSweep sweep = read_sweep(file.string(), settings_from(set));
  const SweepOutcome outcome =
      watched(progress, [&](const Watch& watch) { return swept(sweep, output.string(), restart, watch); });
  return columns_by_name(outcome.table);
}

}  // namespace

void bind_sweeps(nb::module_& module) {
  module.def(
      "sweep", sweep_file, nb::arg("file"), nb::arg("output"), nb::kw_only(), nb::arg("set") = nb::none(),
      nb::arg("restart") = false, nb::arg("progress") = nb::none(),
      nb::sig("def sweep(file: str | os.PathLike[str], output: str | os.PathLike[str], *, "
              "set: Mapping[str, Any] | None = None, restart: bool = False, progress: Progress = None) -> "
              "dict[str, Array]"),
      "A scene with many values of some of its numbers; returns the columns of sweep.csv by name.\n"
      "\n"
      "output: the folder for the results.  Finished samples are on disk at once: repeat the call to\n"
      "continue an interrupted sweep, also after Ctrl-C.  restart: begins anew.  progress: is told how far "
      "it is.\n"
      "\n"
      "Raises FileError for mistakes in the file, and for a folder with another sweep.");
}

}  // namespace dyntape::python
