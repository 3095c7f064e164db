// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/lists.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include <dyntape/interface/io/number.h>

namespace dyntape {

using io::Section;

namespace {

constexpr double kMostSeconds = 1e7, kMostMetres = 1e6, kMostFriction = 1e3, kMostNumber = 1e12;

io::Range above_zero(double most) {
  return {.low = 0, .high = most, .low_open = true, .text = "positive and at most " + io::shortest(most)};
}

double number_in(Section& section, const std::string& key, const std::string& word, const io::Range& range) {
  const std::optional<double> value = io::parse_double(word);
  const std::string fault = !value                   ? "hold numbers"
                            : !std::isfinite(*value) ? "be finite"
                            : !range.holds(*value)   ? "be " + range.text
                                                     : "";
  if (!fault.empty()) section.problem(key, "'" + key + "' must " + fault + ", got '" + word + "'");
  return value.value_or(0);
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
  Eigen::VectorXd values = Eigen::VectorXd::Zero(n);
  std::istringstream words(text);
  Eigen::Index count = 0;
  for (std::string word; words >> word; ++count) {
    const double value = number_in(section, key, word, range);
    if (count < n) values[count] = value;
  }
  if (count == 1 && spreads) {
    if (n > 0) values.setConstant(values[0]);
  } else if (count != n) {
    section.problem(key, "'" + key + "' has " + std::to_string(count) + " numbers, " + has);
  }
  return values;
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
  if (const std::string text = block.value(); !text.empty())
    return numbers_in(section, key, text, 3, range, "expected three: \"x y z\"", false);
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
