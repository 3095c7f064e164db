// SPDX-License-Identifier: BSD-3-Clause
//
// Hashes of the C that is generated for all functions of robots: two builds of the same table print the same text.
//
//   ninja -C build text_hashes && build/bin/text_hashes config/robots/*.urdf >now.csv; diff before.csv now.csv
//
// Columns: robot, function, operations, hash of the text.  Second derivatives of large robots are left out:
// minutes each.  Order 2 stands for what optimal control compiles of the two dynamics (robot_callee.h).
#include <filesystem>
#include <iomanip>
#include <iostream>

#include <dyntape/codegen/pipeline.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/robot_callee.h>
#include <dyntape/interface/robot/robot_functions.h>

namespace dyntape {
namespace {

constexpr int kLarge = 12;  // degrees of freedom

bool is_quick(const std::string& name, int nv) {
  return nv <= kLarge ||
         (name.find("second") == std::string::npos && name.find("hessian") == std::string::npos);
}

std::uint64_t hash_of(const std::string& text) {  // FNV-1a
  std::uint64_t h = 0xcbf29ce484222325u;
  for (const char c : text) h = (h ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return h;
}

void print(const std::string& robot, const std::string& name, const Function& function, Order order) {
  CodegenOptions options;
  options.order = order;
  const codegen::Source source = generate_source(function, options);
  std::cout << robot << "," << name << "," << source.operations.back() << "," << std::hex
            << hash_of(source.text) << std::dec << std::endl;
}

void print(const std::string& path, bool floats) {
  const auto base = floats ? dynamics::Base::kFloating : dynamics::Base::kFixed;
  const dynamics::Model<double> model = dynamics::load_urdf(path, {.base = base});
  const std::string robot = std::filesystem::path(path).stem().string() + (floats ? " floating" : "");
  for (const RobotFunction& function : robot_functions()) {
    const std::string name = to_string(function);
    if (!is_quick(name, model.nv)) continue;
    try {
      print(robot, name, record_robot_function(model, function), Order::kValue);
      if (model.nv <= kLarge && (name == "rnea" || name == "aba"))
        print(robot, name + " to order 2", record_differentiable(model, function), Order::kSecond);
    } catch (const Error& e) {
      std::cout << robot << "," << name << ",refused,\"" << e.what() << "\"" << std::endl;
    }
  }
}

}  // namespace
}  // namespace dyntape

int main(int count, char** arguments) {
  std::cout << "robot,function,operations,hash\n";
  for (int i = 1; i < count; ++i) dyntape::print(arguments[i], false), dyntape::print(arguments[i], true);
}
