// SPDX-License-Identifier: BSD-3-Clause
//
// A file's text, read by whatever reads files of its kind.
//
//   const ReadingPlace place(config);
//   place.read(FileKind::kTask, text);           // an Error, or it is read; anything else is a defect
#pragma once

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include <unistd.h>

#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/files/task/task.h>
#include <dyntape/interface/io/csv.h>

namespace dyntape {

enum class FileKind { kRobot, kTable, kScene, kTask };

// Of a file below config/; none: what is read by commands of their own.
inline std::optional<FileKind> kind_of(const std::filesystem::path& path) {
  const std::string extension = path.extension(), folder = path.parent_path().filename();
  if (extension == ".urdf") return FileKind::kRobot;
  if (extension == ".csv") return FileKind::kTable;
  if (extension == ".info" && folder == "scenes") return FileKind::kScene;
  if (extension == ".info" && folder == "tasks") return FileKind::kTask;
  return {};
}

// Where tasks stand, which are read from files beside the folder of their robots; removed at the end.
class ReadingPlace {
 public:
  explicit ReadingPlace(const std::filesystem::path& config)
      : folder_(std::filesystem::temp_directory_path() / ("dyntape-reading-" + std::to_string(getpid()))) {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_ / "tasks");
    std::filesystem::create_directory_symlink(std::filesystem::absolute(config) / "robots",
                                              folder_ / "robots");
  }
  ~ReadingPlace() {
    std::error_code none;
    std::filesystem::remove_all(folder_, none);
  }
  ReadingPlace(const ReadingPlace&) = delete;
  ReadingPlace& operator=(const ReadingPlace&) = delete;

  void read(FileKind kind, const std::string& text) const {
    const std::filesystem::path task = folder_ / "tasks" / "task.info";
    switch (kind) {
      case FileKind::kRobot:
        return void(dynamics::read_urdf_text(text, "robot.urdf", {}));
      case FileKind::kTable:
        return void(io::parse_csv(text, "table.csv"));
      case FileKind::kScene:
        return void(read_scene_text(text, task.string()));
      case FileKind::kTask:
        std::ofstream(task, std::ios::binary) << text;
        return void(read_task(task));
    }
  }

 private:
  std::filesystem::path folder_;
};

}  // namespace dyntape
