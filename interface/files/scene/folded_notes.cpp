// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/scene/folded_notes.h>

#include <string_view>

#include <dyntape/interface/io/number.h>

namespace dyntape {
namespace {

constexpr std::string_view kSnapped = " snapped to a right angle, by ";
constexpr std::size_t kFew = 3;  // that are told one by one

// "arm.urdf:41: joint "a" has a rotation snapped to a right angle, by 3.2e-06 rad": "3.2e-06", or "".
std::string snapped_by(const std::string& note) {
  const std::size_t at = note.find(kSnapped);
  if (at == note.npos) return "";
  const std::size_t begin = at + kSnapped.size();
  return note.substr(begin, note.find(' ', begin) - begin);
}

}  // namespace

std::vector<std::string> folded(const std::vector<std::string>& notes) {
  std::vector<std::string> rest;
  std::string first, most;
  std::size_t count = 0;
  for (const std::string& note : notes) {
    const std::string angle = snapped_by(note);
    if (angle.empty()) {
      rest.push_back(note);
      continue;
    }
    if (count++ == 0) first = note;
    if (most.empty() || io::parse_double(angle) > io::parse_double(most)) most = angle;
  }
  if (count <= kFew) return notes;
  const std::string place = first.substr(0, first.find(": ") + 2);
  rest.insert(rest.begin(), place + std::to_string(count) + " rotations and axes" + std::string(kSnapped) +
                                "at most " + most + " rad (dyntape info --verbose lists them)");
  return rest;
}

}  // namespace dyntape
