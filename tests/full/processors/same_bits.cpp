// SPDX-License-Identifier: BSD-3-Clause
//
// Prints hashes of the results of robots' functions: a line for each robot, function and route.  The lines are the
// same on every processor (aarch64_bits.sh), except those of Hessians.
//   same_bits [--all] [--compiled N] [--hessians N] ROBOT.urdf...
//     --all           all functions of the table, by portable functions, in place of the five of optimal control
//     --compiled N    by compiled text too, for robots of at most N degrees of freedom
//     --hessians N    Hessians of the recordings too, likewise, by the interpreter and as machine code
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

struct Wanted {
  bool all = false;
  int compiled = 0, hessians = 0;
};

constexpr int kRecordedWhole = 12;  // degrees of freedom up to which second derivatives are recorded

bool is_second(const RobotFunction& f) {
  const std::string name = to_string(f);
  return name.find("second") != std::string::npos || name.find("hessian") != std::string::npos;
}

class Case {
 public:
  Case(std::string robot, const dynamics::Model<double>& model, const RobotFunction& f)
      : robot_(std::move(robot)),
        model_(model),
        f_(f),
        work_(model, f),
        states_(states_of(model, work_.n_in())) {}

  void run(const Wanted& wanted) {
    plain();
    narrow();
    packs();
    if (is_second(f_) && model_.nv > kRecordedWhole) return;
    const Function recorded = record_robot_function(model_, f_);
    CodegenOptions options;
    options.order = Order::kValue;
    options.functions = wanted.all ? Functions::kPortable : kDefaultFunctions;
    options.use_cache = false;
    options.lanes = Lanes::kNative;
    for (const Route route : {Route::kInterpreter, Route::kMachineCode, Route::kCompiled}) {
      if (route == Route::kMachineCode && !codegen::MachineCode::is_possible()) continue;
      if (route == Route::kCompiled && model_.nv > wanted.compiled) continue;
      options.route = route;
      const char* const name = route == Route::kInterpreter   ? "interpreted"
                               : route == Route::kMachineCode ? "machine code"
                                                              : "compiled";
      whole(CompiledFunction::make(recorded, options), name);
      if (route == Route::kCompiled || model_.nv > wanted.hessians || is_derivative(f_)) continue;
      CodegenOptions second = options;
      second.order = Order::kSecond;
      hessians(CompiledFunction::make(recorded, second), name);
    }
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
  void whole(const CompiledFunction& f, const std::string& route) {
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
  void hessians(const CompiledFunction& f, const std::string& route) {
    CompiledFunction::Workspace workspace(f);
    const std::size_t n_y = f.n_y(), n_j = f.jacobian_pattern().nnz(), n_h = f.hessian_pattern().nnz();
    std::vector<double> all(kStates * (n_y + n_j + n_h)), w(kStates * n_y);
    for (std::size_t i = 0; i < w.size(); ++i) w[i] = 1 - 0.25 * static_cast<double>(i % 7);
    Points points;
    points.count = kStates, points.x = states_.data(), points.w = w.data(), points.y = all.data();
    points.jacobian = all.data() + kStates * n_y, points.hessian = points.jacobian + kStates * n_j;
    f.check(f.run(Order::kSecond, points, workspace), kStates);
    say((route + " Hessians").c_str(), all);
  }

  const std::string robot_;
  const dynamics::Model<double>& model_;
  const RobotFunction f_;
  detail::RobotWorkspace<double> work_;
  const std::vector<double> states_;
};

}  // namespace

int main(int count, char** arguments) {
  Wanted wanted;
  for (int k = 1; k < count; ++k) {
    const std::string path = arguments[k];
    if (path == "--all") {
      wanted.all = true;
      continue;
    }
    if ((path == "--compiled" || path == "--hessians") && k + 1 < count) {
      (path == "--compiled" ? wanted.compiled : wanted.hessians) = std::atoi(arguments[++k]);
      continue;
    }
    const dynamics::Model<double> model = dynamics::load_urdf(path);
    const std::string robot = path.substr(path.rfind('/') + 1);
    const std::vector<RobotFunction> core(std::begin(kCoreFunctions), std::end(kCoreFunctions));
    for (const RobotFunction& f : wanted.all ? robot_functions() : core) {
      try {
        Case(robot, model, f).run(wanted);
      } catch (const Error& e) {  // no frame on a body, no inertia about a joint
        std::printf("%s,%s,%s\n", robot.c_str(), to_string(f), e.what());
      }
    }
  }
}
