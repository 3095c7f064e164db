// SPDX-License-Identifier: BSD-3-Clause
//
// A shipped task as text that a test changes and reads again, from a folder of its own.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/files/task/task.h>

#include "source_folder.h"

namespace dyntape::test {

class TaskText : public ::testing::Test {
 protected:
  explicit TaskText(const std::string& name)
      : folder_(std::filesystem::temp_directory_path() /
                ("dyntape-" + name + "-" + std::to_string(getpid()))) {
    std::filesystem::create_directories(folder_);
  }
  ~TaskText() override { std::filesystem::remove_all(folder_); }

  // config/tasks/NAME.info.
  void load(const std::string& name) {
    const std::filesystem::path tasks = std::filesystem::path(test::source_folder()) / "config" / "tasks";
    text_ = read_file((tasks / (name + ".info")).string());
    replace("../robots", (tasks / "../robots").string());
  }
  void replace(const std::string& old, const std::string& with) {
    const std::size_t at = text_.find(old);
    ASSERT_NE(at, std::string::npos) << old;
    text_.replace(at, old.size(), with);
  }
  // Nothing is compiled.
  Task read() const {
    const std::string path = (folder_ / "task.info").string();
    write_file_atomically(path, text_);
    Task task = read_task(path);
    task.optimise.mesh.evaluation.route = Route::kInterpreter;
    return task;
  }
  std::string message() const {
    try {
      read();
    } catch (const Error& e) {
      return e.what();
    }
    return "nothing thrown";
  }

  std::filesystem::path folder_;
  std::string text_;
};

}  // namespace dyntape::test
