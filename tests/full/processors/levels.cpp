// SPDX-License-Identifier: BSD-3-Clause
//
// Hashes of what robots' functions give, a line a robot, function and route: the plain code, packs, the interpreter with
// several states side by side.  The lines are the same on every processor (levels.sh).
//   levels [--small] ROBOT.urdf...       --small: first derivatives at most, for emulators
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/processor_level.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/packs/packed_robot.h>
#include <dyntape/interface/robot/robot_functions.h>

using namespace dyntape;

namespace {

constexpr std::size_t kStates = 11;  // whole packs and a rest
constexpr int kRecordedWhole = 12;   // degrees of freedom up to which second derivatives are recorded

std::uint64_t hash(const std::vector<double>& x) {
  std::uint64_t h = 14695981039346656037u;
  for (const double entry : x) {
    std::uint64_t bits;
    std::memcpy(&bits, &entry, sizeof bits);
    h = (h ^ bits) * 1099511628211u;
    h ^= h >> 29;
  }
  return h;
}

// Derivatives of derivatives, and what is as long.
bool is_second(const RobotFunction& f) {
  const std::string name = to_string(f);
  return name.find("second") != std::string::npos || name.find("hessian") != std::string::npos;
}

std::vector<double> states_of(const dynamics::Model<double>& model, std::size_t n_in) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(-2, 2);
  std::vector<double> states;
  for (std::size_t k = 0; k < kStates; ++k) {
    const Eigen::VectorXd q = dynamics::random_configuration(model, random);
    states.insert(states.end(), q.begin(), q.end());
    for (auto i = static_cast<std::size_t>(model.nq); i < n_in; ++i) states.push_back(uniform(random));
  }
  return states;
}

void say(const std::string& robot, const RobotFunction& f, const char* route,
         const std::vector<double>& results) {
  std::printf("%s,%s,%s,%016llx\n", robot.c_str(), to_string(f), route,
              static_cast<unsigned long long>(hash(results)));
}

void run(const std::string& robot, const dynamics::Model<double>& model, const RobotFunction& f) {
  PackedRobot packs(model, f);
  const std::size_t n_in = packs.n_in(), n_out = packs.n_out();
  const std::vector<double> states = states_of(model, n_in);
  std::vector<double> results(kStates * n_out);
  packs.evaluate(states.data(), kStates, results.data());
  say(robot, f, "packs", results);

  for (std::size_t k = 0; k < kStates; ++k) {
    const Eigen::VectorXd y = evaluate_analytic(
        model, f,
        Eigen::Map<const Eigen::VectorXd>(states.data() + k * n_in, static_cast<Eigen::Index>(n_in)));
    std::copy(y.begin(), y.end(), results.begin() + static_cast<std::ptrdiff_t>(k * n_out));
  }
  say(robot, f, "plain", results);

  if (is_second(f) && model.nv > kRecordedWhole) return;
  const Interpreter interpreter(record_robot_function(model, f), Functions::kPortable);
  Interpreter::Workspace workspace(interpreter, kStates);
  PointRange range;
  range.points = kStates, range.x = states.data(), range.y = results.data();
  interpreter(range, workspace);
  say(robot, f, "interpreted", results);
}

}  // namespace

int main(int count, char** arguments) {
  std::fprintf(stderr, "levels: %s\n", processor_level().c_str());
  bool small = false;
  for (int k = 1; k < count; ++k) {
    const std::string path = arguments[k];
    if (path == "--small") {
      small = true;
      continue;
    }
    const auto model = dynamics::load_urdf(path);
    const std::string robot = path.substr(path.rfind('/') + 1);
    for (const RobotFunction& f : robot_functions()) {
      if (small && is_second(f)) continue;
      try {
        run(robot, model, f);
      } catch (const Error& e) {  // no frame on a body, no inertia about a joint
        std::printf("%s,%s,%s\n", robot.c_str(), to_string(f), e.what());
      }
    }
  }
}
