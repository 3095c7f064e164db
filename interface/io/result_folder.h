// SPDX-License-Identifier: BSD-3-Clause
//
// The files of a finished piece of work, each whole or not there at all; what cannot be written is said, and the others
// are written all the same.
//
//   ResultFolder folder("out/arm", report.unwritten);
//   folder.write("motion.csv", [&](const std::string& path) { write_csv(path, table); });
//   folder.remove("forces.svg");                     // of an earlier piece of work
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <dyntape/autodiff/error.h>

namespace dyntape::io {

class ResultFolder {
 public:
  // `unwritten` gets a sentence for each file that is not where it belongs.
  ResultFolder(std::string folder, std::vector<std::string>& unwritten)
      : folder_(std::move(folder)), unwritten_(unwritten) {}

  std::string path(const char* file) const { return folder_ + "/" + file; }

  template <class Write>
  void write(const char* file, const Write& write) {
    try {
      write(path(file));
    } catch (const Error& e) {
      unwritten_.push_back(e.what());
      remove(file);
    }
  }

  // Should it be there, as a plain file.
  void remove(const char* file) const {
    std::error_code none;
    const std::filesystem::path it = path(file);
    if (std::filesystem::symlink_status(it, none).type() == std::filesystem::file_type::regular)
      std::filesystem::remove(it, none);
  }

 private:
  std::string folder_;
  std::vector<std::string>& unwritten_;
};

}  // namespace dyntape::io
