// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/lists.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>

#include <dyntape/interface/io/number.h>

namespace dyntape {

using io::Section;

namespace {

constexpr double kMostSeconds = 1e7, kMostMetres = 1e6, kMostFriction = 1e3, kMostNumber = 1e12;

io::Range above_zero(double most) {
  return {.low = 0, .high = most, .low_open = true, .text = "positive and at most " + io::shortest(most)};
}

// None: the word is no number, or out of range, which is a problem.
std::optional<double> number_in(Section& section, const std::string& key, const std::string& word,
                                const io::Range& range) {
  const std::optional<double> value = io::parse_double(word);
  const std::string fault = !value                   ? "hold numbers"
                            : !std::isfinite(*value) ? "be finite"
                            : !range.holds(*value)   ? "be " + range.text
                                                     : "";
  if (fault.empty()) return value;
  section.problem(key, "'" + key + "' must " + fault + ", got '" + word + "'");
  return std::nullopt;
}

struct ReadNumbers {
  Eigen::VectorXd values;
  bool are_sound = true;  // no problem was found
};

// How many words there are is said of numbers only.
ReadNumbers read_numbers(Section& section, const std::string& key, const std::string& text, Eigen::Index n,
                         const io::Range& range, const std::string& has, bool spreads) {
  ReadNumbers read{Eigen::VectorXd::Zero(n)};
  std::istringstream words(text);
  Eigen::Index count = 0;
  for (std::string word; words >> word; ++count) {
    const std::optional<double> value = number_in(section, key, word, range);
    read.are_sound = read.are_sound && value.has_value();
    if (count < n) read.values[count] = value.value_or(0);
  }
  if (count == 1 && spreads) {
    if (n > 0) read.values.setConstant(read.values[0]);
  } else if (count != n && read.are_sound) {
    read.are_sound = false;
    section.problem(
        key, "'" + key + "' has " + std::to_string(count) + (count == 1 ? " number, " : " numbers, ") + has);
  }
  return read;
}

}  // namespace

io::Range seconds() { return above_zero(kMostSeconds); }
io::Range some_seconds() { return io::between(0, kMostSeconds); }
io::Range metres() { return io::between(-kMostMetres, kMostMetres); }
io::Range some_metres() { return io::between(0, kMostMetres); }
io::Range coefficients() { return above_zero(kMostFriction); }
io::Range plain_numbers() { return io::between(-kMostNumber, kMostNumber); }

Eigen::VectorXd numbers_in(Section& section, const std::string& key, const std::string& text, Eigen::Index n,
                           const io::Range& range, const std::string& has, bool spreads) {
  return read_numbers(section, key, text, n, range, has, spreads).values;
}

Eigen::Vector3d read_vector3(Section& section, const std::string& key,
                             const std::optional<Eigen::Vector3d>& fallback, const io::Range& range) {
  std::string otherwise;
  if (fallback) {
    for (double x : *fallback) otherwise += (otherwise.empty() ? "" : " ") + io::shortest(x);
  }
  section.defer(key, "three numbers \"x y z\"", fallback ? otherwise.c_str() : nullptr);
  std::vector<Section> blocks = section.children(key);
  if (blocks.empty()) return fallback.value_or(Eigen::Vector3d::Zero());
  if (blocks.size() > 1) section.problem(key, "'" + key + "' is given twice");
  Section& block = blocks.front();
  if (const std::string text = block.value(); !text.empty()) {
    const ReadNumbers read = read_numbers(section, key, text, 3, range, "expected three: \"x y z\"", false);
    return read.are_sound ? Eigen::Vector3d(read.values) : fallback.value_or(Eigen::Vector3d::Zero());
  }
  return {block.get<double>("x", range), block.get<double>("y", range), block.get<double>("z", range)};
}

std::vector<std::string> distinct_names(Section& section, const std::string& key,
                                        const std::vector<std::string>& valid) {
  const std::vector<std::string> names = section.strings_or(key, {}, valid);
  for (auto name = names.begin(); name != names.end(); ++name) {
    if (std::find(names.begin(), name, *name) == name) continue;
    section.problem(key, "'" + key + "' names '" + *name + "' twice, expected once");
  }
  return names;
}

}  // namespace dyntape
