// SPDX-License-Identifier: BSD-3-Clause
//
// A file that is given to the wrong reader is told what it is.
#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/files/file_kind.h>
#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/files/sweep/sweep.h>
#include <dyntape/interface/files/task/task.h>
#include <dyntape/interface/io/csv.h>

#include <filesystem>

#include "source_folder.h"

namespace dyntape::file_kind_test {
namespace {

const std::string kConfig = test::source_folder() + "/config/";

template <class Read>
std::string refusal(Read&& read) {
  try {
    read();
  } catch (const FileError& e) {
    return e.what();
  }
  return "";
}

TEST(FileKind, TheWrongReaderSaysWhoTakesIt) {
  const std::string scene = kConfig + "scenes/pendulum.info", task = kConfig + "tasks/arm_reaching.info",
                    sweep = kConfig + "sweeps/pendulum_amplitudes.info";
  EXPECT_EQ(refusal([&] { read_task(scene); }),
            scene + ": this is a scene ('simulation' is in it), not a task; dyntape simulate takes it");
  EXPECT_EQ(refusal([&] { read_scene(task); }),
            task + ": this is a task ('goal' is in it), not a scene; dyntape solve takes it");
  EXPECT_EQ(refusal([&] { read_sweep(scene); }),
            scene + ": this is a scene ('simulation' is in it), not a sweep; dyntape simulate takes it");
  EXPECT_EQ(refusal([&] { read_scene(sweep); }),
            sweep + ": this is a sweep ('vary' is in it), not a scene; dyntape sweep takes it");
}

TEST(FileKind, WhatIsOfNoKindOrOfTwoIsLeftToItsReader) {
  for (const char* text : {"", "robot { urdf a.urdf }", "goal { q 0 }\nsimulation { duration 1 }"})
    for (const FileKind kind : {FileKind::kTask, FileKind::kScene, FileKind::kSweep, FileKind::kCentroidal})
      EXPECT_NO_THROW(check_file_kind(text, "a.info", kind)) << text;
}

TEST(FileKind, ShippedFilesAreOfTheirs) {
  const std::pair<const char*, FileKind> folders[] = {
      {"tasks", FileKind::kTask}, {"scenes", FileKind::kScene}, {"sweeps", FileKind::kSweep}};
  for (const auto& [folder, kind] : folders) {
    for (const auto& entry : std::filesystem::directory_iterator(kConfig + folder)) {
      if (entry.path().extension() != ".info") continue;
      EXPECT_NO_THROW(check_file_kind(read_file(entry.path()), entry.path(), kind));
    }
  }
}

TEST(FileKind, ColumnsBetweenSemicolonsAreTold) {
  EXPECT_EQ(refusal([] { io::parse_csv("q0;v0\n1;2\n", "a.csv"); }),
            "a.csv:1:1: the columns are separated by ';', expected ','");
}

}  // namespace
}  // namespace dyntape::file_kind_test
