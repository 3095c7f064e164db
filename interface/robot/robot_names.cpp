// SPDX-License-Identifier: BSD-3-Clause
//
// What the table says of its functions.
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/suggest.h>
#include <dyntape/interface/robot/robot_rows.h>

#include <map>
#include <sstream>

namespace dyntape {
namespace {

using detail::Extent;
using dynamics::Model;

const std::vector<detail::RobotRow<double>>& rows() { return detail::robot_rows<double>(); }

const detail::RobotRow<double>& row_of(const RobotFunction& function) {
  return rows()[static_cast<std::size_t>(function.row())];
}

const char* word(Extent extent) {
  constexpr const char* kInTheirOrder[] = {"1",    "3",    "6",         "nv",        "nv",
                                           "3 nv", "3 nv", "10 bodies", "3 contacts"};
  return kInTheirOrder[static_cast<int>(extent)];
}

std::string shape_text(const detail::BlockShape& shape) {
  std::string text = word(shape.rows);
  if (shape.cols != Extent::kOne) text += std::string(" x ") + word(shape.cols);
  if (shape.pages != Extent::kOne) text += std::string(" x ") + word(shape.pages);
  return text;
}

// One index a dimension that the block has; none for a number.
void append_names(const detail::BlockShape& shape, const RobotBlock& block, std::vector<std::string>& names) {
  for (int i = 0; i < block.rows; ++i) {
    for (int j = 0; j < block.cols; ++j) {
      for (int k = 0; k < block.pages; ++k) {
        std::string name = block.name;
        const bool is_vector = shape.cols == Extent::kOne;
        if (shape.rows != Extent::kOne) name += (is_vector ? "" : "_") + std::to_string(i);
        if (!is_vector) name += "_" + std::to_string(j);
        if (shape.pages != Extent::kOne) name += "_" + std::to_string(k);
        names.push_back(name);
      }
    }
  }
}

// A row's name, for which textbooks may have another one.
std::string row_name(const std::string& given) {
  static const std::map<std::string, std::string> kKnownAs = {
      {"inverse-dynamics", "rnea"},
      {"forward-dynamics", "aba"},
      {"mass-matrix", "crba"},
      {"inverse-mass-matrix", "minverse"},
      {"inverse-dynamics-derivatives", "id-derivatives"},
      {"forward-dynamics-derivatives", "fd-derivatives"}};
  const auto known = kKnownAs.find(given);
  return known == kKnownAs.end() ? given : known->second;
}

}  // namespace

RobotFunction::RobotFunction(const std::string& given) : row_(-1) {
  const std::string name = row_name(given);
  std::vector<std::string> names;
  for (const auto& row : rows()) {
    if (name == row.name) row_ = static_cast<int>(&row - rows().data());
    names.push_back(row.name);
  }
  if (row_ < 0)
    throw ArgumentError("there is no function \"" + name + "\" of a robot" + suggestion(name, names));
}

const std::vector<RobotFunction>& robot_functions() {
  static const std::vector<RobotFunction> all = [] {
    std::vector<RobotFunction> functions;
    for (const auto& row : rows()) functions.emplace_back(row.name);
    return functions;
  }();
  return all;
}

const char* to_string(const RobotFunction& function) { return row_of(function).name; }
const char* description(const RobotFunction& function) { return row_of(function).what; }
bool is_derivative(const RobotFunction& function) { return *row_of(function).of != '\0'; }
bool is_forward(const RobotFunction& function) { return row_of(function).needs & detail::kInertia; }
bool takes_contacts(const RobotFunction& function) { return row_of(function).needs & detail::kContacts; }
bool takes_frame(const RobotFunction& function) {
  return row_of(function).needs & (detail::kFrame | detail::kContacts);
}

RobotFunction value_of(const RobotFunction& derivative) {
  if (!is_derivative(derivative)) throw ArgumentError(std::string(to_string(derivative)) + " is a value");
  RobotFunction value(row_of(derivative).of);
  value.frame = derivative.frame;
  value.in = derivative.in;
  value.contacts = derivative.contacts;
  value.mimics = derivative.mimics;
  return value;
}

std::vector<RobotBlock> inputs(const Model<double>& model, const RobotFunction& function) {
  std::istringstream words(row_of(function).inputs);
  const detail::RobotSizes sizes = detail::sizes_of(model, function);
  std::vector<RobotBlock> blocks;
  for (std::string name; words >> name;) {
    const bool is_q = name == "q";
    blocks.push_back({name, is_q ? "nq" : "nv", is_q ? sizes.nq : sizes.nv});
  }
  return blocks;
}

std::vector<RobotBlock> outputs(const Model<double>& model, const RobotFunction& function) {
  const detail::RobotSizes sizes = detail::sizes_of(model, function);
  std::vector<RobotBlock> blocks;
  for (const auto& shape : row_of(function).outputs) {
    blocks.push_back({shape.name, shape_text(shape), extent(shape.rows, sizes), extent(shape.cols, sizes),
                      extent(shape.pages, sizes)});
  }
  return blocks;
}

std::vector<std::string> input_names(const Model<double>& model, const RobotFunction& function) {
  std::vector<std::string> names;
  for (const RobotBlock& block : inputs(model, function)) {
    append_names({block.name.c_str(), Extent::kNv}, block, names);
  }
  return names;
}

std::vector<std::string> output_names(const Model<double>& model, const RobotFunction& function) {
  std::vector<std::string> names;
  const std::vector<RobotBlock> blocks = outputs(model, function);
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    append_names(row_of(function).outputs[i], blocks[i], names);
  }
  return names;
}

}  // namespace dyntape

namespace dyntape::detail {

std::vector<int> derived_by(const RobotFunction& derivative) {
  const auto& row = robot_rows<double>()[static_cast<std::size_t>(derivative.row())];
  std::istringstream all(row.inputs);
  std::vector<int> indices;
  int index = 0;
  for (std::string input; all >> input; ++index) {
    std::istringstream by(row.by);
    for (std::string word; by >> word;) {
      if (word == input) indices.push_back(index);
    }
  }
  return indices;
}

}  // namespace dyntape::detail
