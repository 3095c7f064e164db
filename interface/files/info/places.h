// SPDX-License-Identifier: BSD-3-Clause
//
// Positions of a file's keys, for messages about values that are wrong only together.
//
//   const Places places = file.places();                     // section.h
//   throw FileError(places.at("start.q.elbow", "arm.info") + ": 'start.q.elbow' is 90 rad, expected ...");
//   // arm.info:7:12, or that of `start.q`, or of `start`, or arm.info
#pragma once

#include <map>
#include <string>

namespace dyntape::io {

struct Places {
  std::map<std::string, std::string> of_keys = {};  // "start.q.elbow": "arm.info:7:12"

  // The position of a key, or of the innermost block around it; `otherwise` if the file has neither.
  std::string at(std::string key, const std::string& otherwise) const {
    for (;;) {
      if (const auto found = of_keys.find(key); found != of_keys.end()) return found->second;
      const std::size_t dot = key.rfind('.');
      if (dot == key.npos) return otherwise;
      key.erase(dot);
    }
  }
};

}  // namespace dyntape::io
