// SPDX-License-Identifier: BSD-3-Clause
//
// Hashes of what robots' dynamics give by every route, a line a robot, function and route.  The lines are the same on every
// processor (aarch64_bits.sh).
//   same_bits [--compiled N] ROBOT.urdf...      --compiled N: by compiled text too, for robots of at most N degrees of freedom
//
// The configurations are of dyntape's own sines: the C library's differ between processors in the last bit.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include <dyntape/autodiff/own_sines.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/machine/machine_code.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/packs/packed_path.h>
#include <dyntape/interface/robot/robot_functions.h>

using namespace dyntape;

namespace {

constexpr std::size_t kStates = 11;  // whole packs and a rest

template <class T>
std::uint64_t hash(const std::vector<T>& x) {
  std::uint64_t h = 14695981039346656037u;
  for (const T entry : x) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &entry, sizeof entry);
    h = (h ^ bits) * 1099511628211u;
    h ^= h >> 29;
  }
  return h;
}

void add_turn(std::vector<double>& q, double angle, double radius = 1) {
  q.push_back(radius * own::cos(angle));
  q.push_back(radius * own::sin(angle));
}

std::vector<double> states_of(const dynamics::Model<double>& model, std::size_t n_in) {
  std::mt19937_64 random(1);
  const auto number = [&] { return static_cast<double>(random() >> 11) * 0x1p-51 - 2; };  // in [-2, 2)
  std::vector<double> states;
  for (std::size_t k = 0; k < kStates; ++k) {
    for (const auto& joint : model.joints) {
      const std::size_t end = states.size() + static_cast<std::size_t>(dynamics::nq(joint.type));
      switch (joint.type) {
        case dynamics::JointType::kContinuous:
          add_turn(states, number());
          break;
        case dynamics::JointType::kPlanar:
          states.push_back(number()), states.push_back(number());
          add_turn(states, number());
          break;
        case dynamics::JointType::kFreeFlyer:
          for (int i = 0; i < 3; ++i) states.push_back(number());
          [[fallthrough]];
        case dynamics::JointType::kSpherical:
          add_turn(states, number(), 0.6), add_turn(states, number(), 0.8);
          break;
        default:
          while (states.size() < end) states.push_back(number());
      }
    }
    while (states.size() < (k + 1) * n_in) states.push_back(number());
  }
  return states;
}

class Case {
 public:
  Case(std::string robot, const dynamics::Model<double>& model, const RobotFunction& f)
      : robot_(std::move(robot)),
        model_(model),
        f_(f),
        work_(model, f),
        states_(states_of(model, work_.n_in())) {}

  void run(bool compiled) {
    plain();
    narrow();
    packs();
    const Function recorded = record_robot_function(model_, f_);
    CodegenOptions options;
    options.order = Order::kValue;
    options.use_cache = false;
    options.route = Route::kInterpreter;
    whole(recorded, options, "interpreted");
    options.lanes = Lanes::kNative;
    if (codegen::MachineCode::is_possible()) {
      options.route = Route::kMachineCode;
      whole(recorded, options, "machine code");
    }
    if (!compiled) return;
    options.route = Route::kCompiled;
    whole(recorded, options, "compiled");
  }

 private:
  template <class T>
  void say(const char* route, const std::vector<T>& results) const {
    std::printf("%s,%s,%s,%016llx\n", robot_.c_str(), to_string(f_), route,
                static_cast<unsigned long long>(hash(results)));
    std::fflush(stdout);
  }

  void plain() {
    std::vector<double> y(kStates * work_.n_out());
    for (std::size_t k = 0; k < kStates; ++k)
      work_.evaluate(&states_[k * work_.n_in()], y.data() + k * work_.n_out());
    say("double", y);
  }
  void narrow() {
    const dynamics::Model<float> model = model_.cast<float>();
    detail::RobotWorkspace<float> work(model, f_);
    const std::vector<float> x(states_.begin(), states_.end());
    std::vector<float> y(kStates * work.n_out());
    for (std::size_t k = 0; k < kStates; ++k) work.evaluate(&x[k * work.n_in()], y.data() + k * work.n_out());
    say("float", y);
  }
  void packs() {
    const auto path = detail::best_packed_path(model_, f_);
    std::vector<double> y(kStates * path->n_out);
    for (std::size_t k = 0; k < kStates; k += static_cast<std::size_t>(path->lanes))
      path->evaluate(&states_[k * path->n_in], std::min(path->lanes, static_cast<int>(kStates - k)),
                     y.data() + k * path->n_out);
    say("packs", y);
  }
  // One state after the other, and all at once: in lanes where the function has them.
  void whole(const Function& recorded, const CodegenOptions& options, const std::string& route) {
    const CompiledFunction f = CompiledFunction::make(recorded, options);
    CompiledFunction::Workspace workspace(f);
    std::vector<double> y(kStates * f.n_y());
    for (std::size_t k = 0; k < kStates; ++k)
      f.value(&states_[k * f.n_x()], nullptr, y.data() + k * f.n_y(), workspace);
    say((route + " one by one").c_str(), y);
    std::fill(y.begin(), y.end(), 0.0);
    Points points;
    points.count = kStates, points.x = states_.data(), points.y = y.data();
    f.check(f.run(Order::kValue, points, workspace), kStates);
    say((route + " together").c_str(), y);
  }

  const std::string robot_;
  const dynamics::Model<double>& model_;
  const RobotFunction f_;
  detail::RobotWorkspace<double> work_;
  const std::vector<double> states_;
};

}  // namespace

int main(int count, char** arguments) {
  int compiled = 0;
  for (int k = 1; k < count; ++k) {
    const std::string path = arguments[k];
    if (path == "--compiled" && k + 1 < count) {
      compiled = std::atoi(arguments[++k]);
      continue;
    }
    const dynamics::Model<double> model = dynamics::load_urdf(path);
    const std::string robot = path.substr(path.rfind('/') + 1);
    for (const RobotFunction& f : kCoreFunctions) {
      try {
        Case(robot, model, f).run(model.nv <= compiled);
      } catch (const Error& e) {  // no inertia about a joint
        std::printf("%s,%s,%s\n", robot.c_str(), to_string(f), e.what());
      }
    }
  }
}
