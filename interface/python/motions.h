// SPDX-License-Identifier: BSD-3-Clause
//
// What scenes, tasks and problems have in common: .info files that are read, and results with samples first.
//
//   read_with(read_scene, file, set)                                 without the lock
//   given_or_read<PythonScene>(read_scene, scene, set, "simulate")   what was read before, or the file of that name
//
//   def_array(type, "q", "(samples, nq).", [](const PythonSimulation& s) { return rows_of(s.report.motion.q); });
//   def_report(type, "..."), def_page(type, page), def_files(type, write, "motion.csv, report.json");
#pragma once

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/shared_ptr.h>

#include <filesystem>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/files/info/settings.h>

#include "arrays.h"

namespace dyntape::python {

// --- Files ------------------------------------------------------------------------------------------------

// "--set" of a command line, from a dict of key paths and values; numbers, words, bools and lists of numbers.
std::vector<io::Setting> settings_from(nb::handle given);

template <class Read>
auto read_with(const Read& read, const std::filesystem::path& file, nb::handle set) {
  const std::vector<io::Setting> settings = settings_from(set);
  const nb::gil_scoped_release unlocked;
  return read(file.string(), settings);
}

// `word`: what is done, "simulate".
template <class Held, class Read>
std::shared_ptr<Held> given_or_read(const Read& read, nb::handle given, nb::handle set,
                                    const std::string& word) {
  if (!nb::isinstance<Held>(given))
    return std::make_shared<Held>(read_with(read, nb::cast<std::filesystem::path>(given), set));
  const auto held = nb::cast<std::shared_ptr<Held>>(given);
  if (!set.is_none())
    throw ArgumentError(word + ": set is for files; a " +
                        nb::cast<std::string>(given.type().attr("__name__")) + " was read with its own");
  return held;
}

template <class Held, class Read>
void def_read(nb::class_<Held>& type, Read read) {
  type.def(
      "__init__",
      [read](Held* self, const std::filesystem::path& file, nb::handle set) {
        new (self) Held(read_with(read, file, set));
      },
      nb::arg("file"), nb::kw_only(), nb::arg("set") = nb::none(),
      nb::sig("def __init__(self, file: str | os.PathLike[str], *, set: Mapping[str, Any] | None = None) "
              "-> None"));
}

// --- Results ----------------------------------------------------------------------------------------------

// (samples, entries) of a matrix with a sample a column, as numpy has it.
inline nb::object rows_of(const Eigen::MatrixXd& columns) {
  return copy_of(columns.data(), {columns.cols(), columns.rows()});
}
inline nb::object entries_of(const Eigen::VectorXd& values) {
  return copy_of(values.data(), {values.size()});
}
inline nb::object entries_of(const std::vector<double>& values) {
  return copy_of(values.data(), {static_cast<std::ptrdiff_t>(values.size())});
}

template <class S, class Of>
void def_array(nb::class_<S>& type, const char* name, const char* what, const Of& of) {
  type.def_prop_ro(name, of, nb::sig(kept(std::string("def ") + name + "(self) -> Array")), what);
}

// Of S::report.
template <class S>
void def_report(nb::class_<S>& type, const char* success) {
  type.def_prop_ro(
          "success", [](const S& s) { return s.report.success(); }, success)
      .def_prop_ro(
          "json", [](const S& s) { return s.report.json(); }, "The report for programs.")
      .def(
          "text", [](const S& s) { return s.report.text(); }, "The report for people.");
}

// `write(result, folder)` makes `files`, without the lock; S::report then says what it could not write.
template <class S, class Write>
void def_files(nb::class_<S>& type, const Write& write, const std::string& files) {
  type.def(
          "write",
          [write](S& s, const std::filesystem::path& folder) {
            const nb::gil_scoped_release unlocked;
            std::filesystem::create_directories(folder);
            write(s, folder.string());
            return s.report.unwritten;
          },
          nb::arg("folder"), nb::sig("def write(self, folder: str | os.PathLike[str]) -> list[str]"),
          kept(files + ", pictures and motion.html.\nReturns a sentence for each that could not be written."))
      .def(
          "plot", [](nb::handle self) { return pictures_of(self); }, nb::sig("def plot(self) -> Pictures"),
          "The pictures that `write` makes, by name, as SVG; a notebook shows them.\n\n"
          "Raises RuntimeError where gnuplot is not installed.");
}

// What holds recorded functions cannot be pickled; `instead` says what to pass on.
template <class S>
void def_no_pickle(nb::class_<S>& type, const std::string& instead) {
  const char* const sentence =
      kept("a " + nb::cast<std::string>(type.attr("__name__")) + " cannot be pickled: " + instead);
  type.def(
      "__reduce_ex__", [sentence](const S&, int) -> nb::object { throw nb::type_error(sentence); },
      nb::arg("protocol"));
}

// Without the lock; Ctrl-C ends the wait for it.
template <class S>
std::string made_page(const S& s, std::string (*page)(const S&)) {
  return left_alone(nb::find(s), [&s, page](const std::stop_token&) { return page(s); });
}

template <class S>
void def_page(nb::class_<S>& type, std::string (*page)(const S&)) {
  type.def(
          "page", [page](const S& s) { return made_page(s, page); }, "The motion in 3D, an HTML page.")
      .def(
          "_repr_html_", [page](const S& s) { return in_notebook(made_page(s, page)); },
          "The page, within that of a notebook.");
}

}  // namespace dyntape::python
