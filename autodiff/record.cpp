// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/record.h>

#include <atomic>
#include <ostream>
#include <random>
#include <unordered_set>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/interpret.h>

namespace dyntape {
namespace {

// The recording that this thread is in the middle of.
struct Recording {
  std::string name, place;
  std::uint32_t serial;
  RecordOptions::Branches branches;
  Graph graph;
  std::vector<Guard> guards;
  std::unordered_set<NodeId> guarded;  // their conditions
};

constinit thread_local Recording* current = nullptr;

// Serial numbers begin at random, so that two copies of this library in one process do not take each other's
// values for their own.
std::uint32_t next_serial() {
  static std::atomic<std::uint32_t> next{std::random_device{}()};
  return next++;
}

// Makes a recording the current one for as long as it lives: it closes however the scope is left.
class Scope {
 public:
  explicit Scope(Recording& recording) {
    if (current) {
      throw RecordingError("record(\"" + recording.name + "\") at " + recording.place +
                           ": this thread is already recording \"" + current->name + "\", begun at " +
                           current->place);
    }
    current = &recording;
  }
  ~Scope() { current = nullptr; }
  Scope(const Scope&) = delete;
  Scope& operator=(const Scope&) = delete;
};

Recording& recording_of(const AD& a) {
  if (!current) throw RecordingError("a recorded value is used after its recording has ended");
  if (a.tape() != current->serial) {
    throw RecordingError(
        "a value of another recording is used while \"" + current->name + "\" is recorded (begun at " +
        current->place +
        "): values do not outlive their recording; use its value() or pass it as a parameter");
  }
  return *current;
}

NodeId node(Recording& recording, const AD& a) {
  if (!a.is_recorded()) return recording.graph.constant(a.value());
  recording_of(a);
  return a.id();
}

AD result(Recording& recording, NodeId id, double value) {
  // What folded to a constant is one: comparisons of it need no guard.
  if (recording.graph.is_constant(id)) return recording.graph.constant_value(id);
  return {value, id, recording.serial};
}

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

AD apply(Op op, const AD& a) {
  const double value = evaluate<double>(op, a.value(), 0, 0);
  if (!a.is_recorded()) return value;
  Recording& r = recording_of(a);
  return result(r, r.graph.make(op, a.id()), value);
}

AD apply(Op op, const AD& a, const AD& b) {
  const double value = evaluate<double>(op, a.value(), b.value(), 0);
  if (!a.is_recorded() && !b.is_recorded()) return value;
  Recording& r = recording_of(a.is_recorded() ? a : b);
  const NodeId x = node(r, a), y = node(r, b);
  return result(r, r.graph.make(op, x, y), value);
}

AD apply(Op op, const AD& a, const AD& b, const AD& c) {
  const double value = evaluate<double>(op, a.value(), b.value(), c.value());
  if (!a.is_recorded() && !b.is_recorded() && !c.is_recorded()) return value;
  Recording& r = recording_of(a.is_recorded() ? a : b.is_recorded() ? b : c);
  const NodeId x = node(r, a), y = node(r, b), z = node(r, c);
  return result(r, r.graph.make(op, x, y, z), value);
}

}  // namespace detail

Condition::operator bool() const {
  const bool taken = truth_.value() != 0;
  if (!truth_.is_recorded()) return taken;
  Recording& r = recording_of(truth_);
  if (r.branches == RecordOptions::Branches::kError) {
    throw RecordingError(std::string(file_) + ":" + std::to_string(line_) + ": \"" + r.name +
                         "\" branches on a recorded value; use select(condition, a, b)");
  }
  if (r.guarded.insert(truth_.id()).second) r.guards.push_back({truth_.id(), taken, file_, line_});
  return taken;
}

std::ostream& operator<<(std::ostream& out, const AD& a) { return out << a.value(); }

Function record(const std::string& name, std::size_t n_x, std::size_t n_p,
                const std::function<VectorXad(const VectorXad&, const VectorXad&)>& f,
                const RecordOptions& options, const char* file, int line) {
  const auto check_names = [&](const std::vector<std::string>& names, std::size_t n, const char* what) {
    if (!names.empty() && names.size() != n) {
      throw ArgumentError("record(\"" + name + "\"): " + std::to_string(names.size()) + " names for " +
                          std::to_string(n) + " " + what);
    }
  };
  check_names(options.variable_names, n_x, "variables");
  check_names(options.parameter_names, n_p, "parameters");

  Recording recording{
      name, std::string(file) + ":" + std::to_string(line), next_serial(), options.branches, {}, {}, {}};
  const std::vector<double> x0 = recording_point(options.variables, n_x, "variables", 1);
  const std::vector<double> p0 = recording_point(options.parameters, n_p, "parameters", 1.5);
  const auto make_inputs = [&](Block block, const std::vector<double>& values) {
    VectorXad inputs(static_cast<Eigen::Index>(values.size()));
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto index = static_cast<std::uint32_t>(i);
      inputs[static_cast<Eigen::Index>(i)] =
          AD(values[i], recording.graph.input(block, index), recording.serial);
    }
    return inputs;
  };

  Function function;
  function.name = name;
  function.inputs = {n_x, n_p, 0};
  {
    const Scope scope(recording);
    const VectorXad x = make_inputs(Block::kVariables, x0), p = make_inputs(Block::kParameters, p0);
    const VectorXad y = f(x, p);
    for (Eigen::Index i = 0; i < y.size(); ++i) function.outputs.push_back(node(recording, y[i]));
  }
  check_names(options.output_names, function.outputs.size(), "outputs");
  function.graph = std::move(recording.graph);
  function.guards = std::move(recording.guards);
  function.input_names = {options.variable_names, options.parameter_names, {}};
  function.output_names = options.output_names;
  return compact(function);
}

Function record(const std::string& name, std::size_t n_x, const std::function<VectorXad(const VectorXad&)>& f,
                const RecordOptions& options, const char* file, int line) {
  return record(
      name, n_x, 0, [&f](const VectorXad& x, const VectorXad&) { return f(x); }, options, file, line);
}

VectorXad call(const std::shared_ptr<const Callee>& callee, const VectorXad& arguments) {
  std::vector<double> in, out(callee->n_out);
  bool recorded = false;
  for (const AD& a : arguments) {
    in.push_back(a.value());
    recorded = recorded || a.is_recorded();
  }
  if (in.size() != callee->n_in) {
    throw ArgumentError("call of \"" + callee->name + "\": got " + std::to_string(in.size()) +
                        " arguments, expected " + std::to_string(callee->n_in));
  }
  evaluate(*callee, in.data(), out.data());
  VectorXad results(static_cast<Eigen::Index>(out.size()));
  for (std::size_t i = 0; i < out.size(); ++i) results[static_cast<Eigen::Index>(i)] = out[i];
  if (!recorded) return results;

  if (!current)
    throw RecordingError("call of \"" + callee->name + "\": a recorded value is used after its recording");
  std::vector<NodeId> ids;
  for (const AD& a : arguments) ids.push_back(node(*current, a));
  const std::vector<NodeId> nodes = current->graph.call(callee, ids);
  for (std::size_t i = 0; i < out.size(); ++i) {
    results[static_cast<Eigen::Index>(i)] = AD(out[i], nodes[i], current->serial);
  }
  return results;
}

}  // namespace dyntape
