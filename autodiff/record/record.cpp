// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/record/record.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <ostream>
#include <thread>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/tape.h>

namespace dyntape {
namespace detail {

struct Recording : Tape {
  std::string name, place;  // ", begun at spring.cpp:12"
  RecordOptions::Branches branches;
};

}  // namespace detail

namespace {

using detail::Recording;

// The recordings that this thread has open, and the one that its last operation was recorded in.
constinit thread_local bool thread_ends = false;
struct Opened {
  ~Opened() { thread_ends = true; }
  std::vector<Recording*> recordings;
};
thread_local Opened opened;
[[gnu::tls_model("initial-exec")]] constinit thread_local Recording* current = nullptr;

std::string titled(const Recording& recording) { return "\"" + recording.name + "\"" + recording.place; }

Recording* open_recording(std::uint32_t tape) {
  for (Recording* recording : opened.recordings) {
    if (recording->serial == tape) return recording;
  }
  return nullptr;
}

[[noreturn]] void refuse(std::uint32_t tape, std::uint32_t other) {
  const Recording *a = open_recording(tape), *b = open_recording(other);
  if (a && b) {
    throw RecordingError("values of two recordings meet: of " + titled(*a) + ", and of " + titled(*b) +
                         "; use the value() of one, or pass it as a parameter");
  }
  if (opened.recordings.empty()) {
    throw RecordingError("a recorded value is used after its recording has ended, or in another thread");
  }
  const Recording& here = a ? *a : b ? *b : *opened.recordings.back();
  throw RecordingError("a value of another recording is used while \"" + here.name + "\" is recorded" +
                       here.place +
                       ": values do not outlive their recording; use its value() or pass it as a parameter");
}

// The open recording of values that depend on inputs, at least one of which is given; from now on the current one.
template <class... Values>
[[gnu::cold, gnu::noinline]] Recording* other_recording(const Values&... values) {
  Recording* open = nullptr;
  const auto look_for = [&](const AD& a) {
    if (!open && a.is_recorded()) open = open_recording(a.tape());
  };
  (look_for(values), ...);
  const auto check = [&](const AD& a) {
    if (a.is_recorded() && !(open && a.tape() == open->serial))
      refuse(open ? open->serial : a.tape(), a.tape());
  };
  (check(values), ...);
  return current = open;
}

struct Policy {
  using Value = AD;
  using Base = double;
  using Tape = Recording;

  static Recording* current() { return dyntape::current; }
  template <class... Values>
  static Recording* other(const Values&... values) {
    return other_recording(values...);
  }
  static NodeId outside(Recording& recording, const AD& a) {
    if (a.is_recorded()) refuse(recording.serial, a.tape());
    return recording.graph.constant(a.value());
  }
  static bool is_plain(const AD&) { return true; }
  static double number(const AD& a) { return a.value(); }
  static bool is_constant(const AD&, const AD& b) { return !b.is_recorded(); }
  template <Op op>
  static double evaluate(double x, double y, double z) {
    return dyntape::evaluate<op>(x, y, z);
  }
  static void check(const Recording&) {}
};
using Arithmetic = detail::RecordedArithmetic<Policy>;

std::vector<double> recording_point(const std::vector<double>& given, std::size_t n, const std::string& what,
                                    double offset) {
  if (!given.empty() && given.size() != n) {
    throw ArgumentError("record: the recording point has " + std::to_string(given.size()) + " " + what +
                        ", the function has " + std::to_string(n));
  }
  if (!given.empty()) return given;
  std::vector<double> point(n);
  for (std::size_t i = 0; i < n; ++i) {  // the fractional parts of multiples of the golden ratio
    const double t = (static_cast<double>(i) + offset) * 0.6180339887498949;
    point[i] = 0.3 + 0.8 * (t - std::floor(t));
  }
  return point;
}

}  // namespace

namespace detail {

template <Op op>
AD apply(AD a) {
  return Arithmetic::apply<op>(a);
}
template <Op op>
AD apply(AD a, AD b) {
  return Arithmetic::apply<op>(a, b);
}
template <Op op>
AD apply(AD a, AD b, AD c) {
  return Arithmetic::apply<op>(a, b, c);
}

#define OP(name, fn, n, ...) DYNTAPE_APPLY_##n(name)
#define DYNTAPE_APPLY_1(name) template AD apply<Op::name>(AD);
#define DYNTAPE_APPLY_2(name) template AD apply<Op::name>(AD, AD);
#define DYNTAPE_APPLY_3(name) template AD apply<Op::name>(AD, AD, AD);
#include <dyntape/autodiff/graph/ops.def>
#undef DYNTAPE_APPLY_1
#undef DYNTAPE_APPLY_2
#undef DYNTAPE_APPLY_3

}  // namespace detail

Condition::operator bool() const {
  const bool taken = truth_.value() != 0;
  if (!truth_.is_recorded()) return taken;
  Recording& r = *Arithmetic::tape_of(truth_);
  if (r.branches == RecordOptions::Branches::kError) {
    throw RecordingError(std::string(file_) + ":" + std::to_string(line_) + ": \"" + r.name +
                         "\" branches on a recorded value; use select(condition, a, b)");
  }
  r.guard(Arithmetic::node(r, truth_), taken, file_, line_);
  return taken;
}

std::ostream& operator<<(std::ostream& out, const AD& a) { return out << a.value(); }

// Open for as long as it lives, however its scope is left.
struct Recorder::Open {
  explicit Open() : thread(std::this_thread::get_id()) {
    opened.recordings.push_back(&recording);
    current = &recording;
  }
  ~Open() {
    std::erase(opened.recordings, &recording);
    current = opened.recordings.empty() ? nullptr : opened.recordings.back();
  }

  Recording recording;
  std::thread::id thread;
};

namespace {

void check_names(const Recording& recording, const std::vector<std::string>& names, std::size_t n,
                 const char* what) {
  if (names.empty() || names.size() == n) return;
  throw ArgumentError("record(\"" + recording.name + "\"): " + std::to_string(names.size()) + " names for " +
                      std::to_string(n) + " " + what);
}

}  // namespace

Recorder::Recorder(const std::string& name, std::size_t n_x, std::size_t n_p, const RecordOptions& options,
                   const char* file, int line)
    : options_(options), name_(name) {
  open_ = std::make_unique<Open>();
  Recording& recording = open_->recording;
  recording.name = name;
  recording.place = file ? ", begun at " + std::string(file) + ":" + std::to_string(line) : "";
  recording.branches = options.branches;
  check_names(recording, options.variable_names, n_x, "variables");
  check_names(recording, options.parameter_names, n_p, "parameters");
  const std::vector<double> x = recording_point(options.variables, n_x, "variables", 1),
                            p = recording_point(options.parameters, n_p, "parameters", 1.5);
  x_ = make_inputs(Block::kVariables, x);
  p_ = make_inputs(Block::kParameters, p);
}

// Another thread must not touch the list of this one, nor is there a list once the thread ends: what is destroyed then
// stays open, and is kept to the end.
Recorder::~Recorder() {
  if (!open_ || (open_->thread == std::this_thread::get_id() && !thread_ends)) return;
  static std::mutex mutex;
  static std::vector<std::unique_ptr<Open>>& kept = *new std::vector<std::unique_ptr<Open>>;
  const std::scoped_lock lock(mutex);
  kept.push_back(std::move(open_));
}

VectorXad Recorder::make_inputs(Block block, const std::vector<double>& values) {
  Recording& recording = open_->recording;
  VectorXad inputs(static_cast<Eigen::Index>(values.size()));
  for (std::size_t i = 0; i < values.size(); ++i) {
    const NodeId id = recording.graph.input(block, static_cast<std::uint32_t>(i));
    inputs[static_cast<Eigen::Index>(i)] = AD(values[i], id, recording.serial);
  }
  return inputs;
}

Function Recorder::end(const VectorXad& y) {
  if (!open_) throw RecordingError("Recorder: the recording \"" + name_ + "\" is over already");
  if (open_->thread != std::this_thread::get_id())
    throw RecordingError("Recorder: the recording of " + titled(open_->recording) +
                         " ends in another thread than it began");
  const std::unique_ptr<Open> ending = std::move(open_);
  Recording& recording = ending->recording;
  std::vector<NodeId> outputs;
  outputs.reserve(static_cast<std::size_t>(y.size()));
  for (const AD& entry : y) outputs.push_back(Arithmetic::node(recording, entry));
  check_names(recording, options_.output_names, outputs.size(), "outputs");
  Function function = live_part(recording.graph, outputs, recording.guards, std::move(recording.memory));
  function.name = recording.name;
  function.inputs = {static_cast<std::size_t>(x_.size()), static_cast<std::size_t>(p_.size()), 0};
  function.input_names = {options_.variable_names, options_.parameter_names, {}};
  function.output_names = options_.output_names;
  return function;
}

Function record(const std::string& name, std::size_t n_x, std::size_t n_p,
                const std::function<VectorXad(const VectorXad&, const VectorXad&)>& f,
                const RecordOptions& options, const char* file, int line) {
  Recorder recorder(name, n_x, n_p, options, file, line);
  return recorder.end(f(recorder.x(), recorder.p()));
}

Function record(const std::string& name, std::size_t n_x, const std::function<VectorXad(const VectorXad&)>& f,
                const RecordOptions& options, const char* file, int line) {
  return record(
      name, n_x, 0, [&f](const VectorXad& x, const VectorXad&) { return f(x); }, options, file, line);
}

VectorXad call(const std::shared_ptr<const Callee>& callee, const VectorXad& arguments) {
  std::vector<double> in, out(callee->n_out);
  for (const AD& a : arguments) in.push_back(a.value());
  if (in.size() != callee->n_in) {
    throw ArgumentError("call of \"" + callee->name + "\": got " + std::to_string(in.size()) +
                        " arguments, expected " + std::to_string(callee->n_in));
  }
  const Kernel* const kernel = callee->kernel();
  if (kernel ? !kernel->evaluate : !callee->recorded()->derivative) {
    throw ArgumentError("call of \"" + callee->name + "\": " +
                        (kernel ? "its kernel has no `evaluate`" : "it was not made by recorded_callee()"));
  }
  evaluate(*callee, in.data(), out.data());
  VectorXad results(static_cast<Eigen::Index>(out.size()));
  for (std::size_t i = 0; i < out.size(); ++i) results[static_cast<Eigen::Index>(i)] = out[i];
  const auto some =
      std::find_if(arguments.begin(), arguments.end(), [](const AD& a) { return a.is_recorded(); });
  if (some == arguments.end()) return results;

  Recording& recording = *Arithmetic::tape_of(*some);
  std::vector<NodeId> ids;
  for (const AD& a : arguments) ids.push_back(Arithmetic::node(recording, a));
  const std::vector<NodeId> nodes = recording.graph.call(callee, ids);
  for (std::size_t i = 0; i < out.size(); ++i) {
    results[static_cast<Eigen::Index>(i)] = AD(out[i], nodes[i], recording.serial);
  }
  return results;
}

}  // namespace dyntape
