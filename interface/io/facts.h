// SPDX-License-Identifier: BSD-3-Clause
//
// A report as a table of facts, for people and for programs.
//
//   Facts facts("pendulum: simulated 2 s");
//   facts.say("one step", "1 234 operations");             // a row for people
//   facts["operations"] = 1234;                            // an entry for programs
//   facts.time("load", 1e-3, "from the cache");   // for both: a row of times(), and "seconds": {"load": 0.001}
//   facts.below("\n" + facts.times());                     // lines for people, below the rows
//   std::cout << (json ? facts.json() : facts.text());
//
// Facts are in the order of their calls.  A number that is not finite is null for programs.
#pragma once

#include <nlohmann/json.hpp>

#include <dyntape/interface/io/table.h>

namespace dyntape::io {

class Facts {
 public:
  explicit Facts(const std::string& heading = "", std::vector<TextColumn> columns = {{"quantity"}, {"value"}})
      : heading_(heading.empty() ? "" : heading + "\n\n"), rows_(std::move(columns)) {}

  void say(const std::string& name, const std::string& text) { rows_.append({name, text}); }
  void below(const std::string& lines) { below_ += lines; }
  nlohmann::ordered_json& operator[](const std::string& key) { return entries_[key]; }
  // The key is the name with _ for each blank.
  void time(const std::string& name, double seconds, const std::string& remark = "") {
    times_.append({name, duration(seconds), remark});
    std::string key = name;
    for (char& c : key) c = c == ' ' ? '_' : c;
    entries_["seconds"][key] = seconds;
  }

  std::string times() const { return times_.text(); }
  std::string text() const { return heading_ + rows_.text() + below_; }
  std::string json() const { return entries_.dump(2) + "\n"; }

 private:
  std::string heading_, below_;
  TextTable rows_, times_{{{"step"}, {"time", "", Align::kRight}, {"remark"}}};
  nlohmann::ordered_json entries_;
};

}  // namespace dyntape::io
