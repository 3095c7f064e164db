// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/error.h>
#include <dyntape/interface/function/robot_functions.h>

namespace dyntape {
namespace {

void append(std::vector<std::string>& names, const std::string& stem, int n) {
  for (int i = 0; i < n; ++i) names.push_back(stem + std::to_string(i));
}

void append_matrix(std::vector<std::string>& names, const std::string& stem, int n) {
  for (int i = 0; i < n; ++i) append(names, stem + "_" + std::to_string(i) + "_", n);
}

}  // namespace

const char* to_string(RobotFunction function) {
  switch (function) {
    case RobotFunction::kRnea:
      return "rnea";
    case RobotFunction::kAba:
      return "aba";
    case RobotFunction::kCrba:
      return "crba";
    case RobotFunction::kIdDerivatives:
      return "id-derivatives";
    case RobotFunction::kFdDerivatives:
      break;
  }
  return "fd-derivatives";
}

RobotFunction robot_function_from(const std::string& word) {
  std::string choices;
  for (RobotFunction function : kRobotFunctions) {
    if (word == to_string(function)) return function;
    choices += std::string(choices.empty() ? "" : ", ") + to_string(function);
  }
  throw ArgumentError("there is no function \"" + word + "\" of a robot; choose one of " + choices);
}

bool is_derivative(RobotFunction function) {
  return function == RobotFunction::kIdDerivatives || function == RobotFunction::kFdDerivatives;
}

bool is_forward(RobotFunction function) {
  return function == RobotFunction::kAba || function == RobotFunction::kFdDerivatives;
}

std::vector<std::string> input_names(const dynamics::Model<double>& model, RobotFunction function) {
  std::vector<std::string> names;
  append(names, "q", model.nq);
  if (function == RobotFunction::kCrba) return names;
  append(names, "v", model.nv);
  append(names, is_forward(function) ? "tau" : "a", model.nv);
  return names;
}

std::vector<std::string> output_names(const dynamics::Model<double>& model, RobotFunction function) {
  std::vector<std::string> names;
  const int n = model.nv;
  switch (function) {
    case RobotFunction::kRnea:
      append(names, "tau", n);
      break;
    case RobotFunction::kAba:
      append(names, "ddq", n);
      break;
    case RobotFunction::kCrba:
      append_matrix(names, "M", n);
      break;
    case RobotFunction::kIdDerivatives:
      for (const char* stem : {"dtau_dq", "dtau_dv", "dtau_da"}) append_matrix(names, stem, n);
      break;
    case RobotFunction::kFdDerivatives:
      for (const char* stem : {"ddq_dq", "ddq_dv", "ddq_dtau"}) append_matrix(names, stem, n);
      break;
  }
  return names;
}

}  // namespace dyntape
