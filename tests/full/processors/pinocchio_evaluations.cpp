// SPDX-License-Identifier: BSD-3-Clause
//
// Evaluates a function of Pinocchio so many times, for counters of instructions (instructions.py).
//   pinocchio_evaluations ROBOT.json FUNCTION N      ROBOT.json: what `evaluations --model` prints
#include <pinocchio/algorithm/aba-derivatives.hpp>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/rnea-derivatives.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

#include "../../bench/peers/pinocchio_model.h"

namespace {

namespace pin = pinocchio;

void read(const nlohmann::json& from, double* to) {
  for (const auto& number : from) *to++ = number.get<double>();
}

pin::Model read_model(const char* path) {
  nlohmann::json robot;
  std::ifstream(path) >> robot;
  std::vector<dyntape_peer_joint> joints;
  std::vector<std::string> types;
  for (const auto& joint : robot.at("joints")) types.push_back(joint.at("type"));
  for (const auto& joint : robot.at("joints")) {
    dyntape_peer_joint to{};
    to.type = types[joints.size()].c_str();
    to.parent = joint.at("parent"), to.mass = joint.at("mass"), to.armature = joint.at("armature");
    read(joint.at("axis"), to.axis), read(joint.at("rotation"), to.rotation);
    read(joint.at("translation"), to.translation), read(joint.at("com"), to.com);
    double I[9];
    read(joint.at("inertia"), I);
    const double upper[] = {I[0], I[1], I[4], I[2], I[5], I[8]};
    std::copy(upper, upper + 6, to.inertia);
    joints.push_back(to);
  }
  double gravity[3];
  read(robot.at("gravity"), gravity);
  pin::Model model;
  if (!peer::build_model(joints.data(), static_cast<int>(joints.size()), gravity, model)) std::exit(1);
  return model;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 4) return 2;
  const pin::Model model = read_model(arguments[1]);
  pin::Data data(model);
  const std::string function = arguments[2];
  const long n = std::atol(arguments[3]);
  Eigen::VectorXd x(model.nq + 2 * model.nv);
  for (Eigen::Index i = 0; i < x.size(); ++i) x[i] = 0.3 + 0.01 * static_cast<double>(i % 100);
  const Eigen::VectorXd q = x.head(model.nq), v = x.segment(model.nq, model.nv), w = x.tail(model.nv);
  const auto repeat = [n](const auto& call) {
    call();
    close(-31415);  // a mark for the counter (instructions.c)
    for (long k = 0; k < n; ++k) call();
    close(-31415);
    return 0;
  };
  if (function == "rnea") return repeat([&] { pin::rnea(model, data, q, v, w); });
  if (function == "aba") return repeat([&] { pin::aba(model, data, q, v, w, pin::Convention::LOCAL); });
  if (function == "aba@world") return repeat([&] { pin::aba(model, data, q, v, w, pin::Convention::WORLD); });
  if (function == "crba") return repeat([&] { pin::crba(model, data, q, pin::Convention::LOCAL); });
  if (function == "crba@world") return repeat([&] { pin::crba(model, data, q, pin::Convention::WORLD); });
  if (function == "id-derivatives") return repeat([&] { pin::computeRNEADerivatives(model, data, q, v, w); });
  if (function == "fd-derivatives") return repeat([&] { pin::computeABADerivatives(model, data, q, v, w); });
  return 1;
}
