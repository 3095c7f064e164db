// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/record/record.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <ostream>
#include <random>
#include <thread>
#include <unordered_set>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/graph/smooth_products.h>

namespace dyntape {
namespace detail {

struct Recording {
  std::string name, place;  // ", begun at spring.cpp:12"
  std::uint32_t serial;
  RecordOptions::Branches branches;
  Graph graph;
  std::vector<Guard> guards;
  std::unordered_set<NodeId> guarded;  // their conditions
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

// Memory of this thread's last recording, for the next one; much is given back.
thread_local Graph spare;
constexpr std::size_t kSpareBytes = std::size_t{1} << 24;

// Serial numbers begin at random, so that two copies of this library in one process do not take each other's
// values for their own.
std::uint32_t next_serial() {
  static std::atomic<std::uint32_t> next{std::random_device{}()};
  return next++;
}

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

// Whether a value that depends on an input is of the current recording.
bool is_current(const AD& a) { return current && current->serial == a.tape(); }

// The open recording of values that depend on inputs, at least one of which is given; from now on the current one.
template <class... Values>
[[gnu::cold, gnu::noinline]] Recording& other_recording(const Values&... values) {
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
  return *(current = open);
}

// The recording of values that depend on inputs, at least one of which is given.
template <class... Values>
Recording& recording_of(const Values&... values) {
  return ((!values.is_recorded() || is_current(values)) && ...) ? *current : other_recording(values...);
}

// A value of a recording is a node or, with this bit in its number, the negation of one, which need not be there: signs go
// through sums, products and quotients without nodes of their own.
constexpr NodeId kNegated = 0x80000000u;
static_assert(kMostNodes < kNegated);

NodeId node(Recording& recording, const AD& a) {
  if (!a.is_recorded()) return recording.graph.constant(a.value());
  if (a.tape() != recording.serial) refuse(recording.serial, a.tape());
  const NodeId id = a.id() & ~kNegated;
  return id == a.id() ? id : recording.graph.negation(id);
}

AD result(Recording& recording, NodeId id, double value) {
  // What folded to a constant is one: comparisons of it need no guard.
  if (recording.graph.is_constant(id)) return recording.graph.constant_value(id);
  const Node& node = recording.graph[id];
  return {value, node.op == Op::Neg ? node.a | kNegated : id, recording.serial};
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

[[gnu::noinline]] AD negation(double value, AD x) {
  Recording& r = recording_of(x);
  if (x.id() & kNegated || !Graph::absorbs_negation(r.graph[x.id()].op))
    return {value, x.id() ^ kNegated, r.serial};
  return result(r, r.graph.negation(x.id()), value);
}

template <Op op>
AD apply(AD a) {
  if (op == Op::Neg && a.is_recorded()) return negation(-a.value(), a);
  const double value = evaluate<op>(a.value(), 0.0, 0.0);
  if (!a.is_recorded()) return value;
  Recording& r = recording_of(a);
  return result(r, r.graph.make(op, node(r, a)), value);
}

// Functions that end in one another: what most operations take has no call within, and keeps all in registers.

template <Op op>
[[gnu::noinline]] AD apply_by_laws(AD a, AD b) {
  Recording& r = recording_of(a, b);
  const NodeId x = node(r, a), y = node(r, b);
  return result(r, r.graph.make(op, x, y), evaluate<op>(a.value(), b.value(), 0.0));
}

[[gnu::noinline, gnu::flatten]] AD add_node(double value, Op op, NodeId a, NodeId b, Recording& r) {
  return {value, r.graph.make_plain(op, a, b), r.serial};
}
// At least one is a negation.
[[gnu::noinline]] AD add_node_of_negations(double value, Op op, NodeId a, NodeId b, Recording& r) {
  const auto [id, is_negated] =
      r.graph.make_signed(op, {a & ~kNegated, (a & kNegated) != 0}, {b & ~kNegated, (b & kNegated) != 0});
  return {value, is_negated ? id | kNegated : id, r.serial};
}
template <bool left>
[[gnu::noinline]] AD add_node_of_constant(double value, Op op, double c, NodeId x, Recording& r) {
  const NodeId constant = r.graph.constant(c);
  return {value, left ? r.graph.make_plain(op, constant, x) : r.graph.make_plain(op, x, constant), r.serial};
}

// One argument is a constant.  Zeros and ones, most of the constants of a robot, are looked at before the graph
// is asked.
template <Op op, bool left>
[[gnu::noinline]] AD apply_to_constant(AD a, AD b) {
  constexpr std::uint32_t laws = info(op).laws;
  constexpr bool absorbs = laws & (left ? kAbsorbLeft : kAbsorbRight),
                 zero = laws & (left ? kZeroLeft : kZeroRight), one = laws & (left ? kOneLeft : kOneRight);
  const double c = left ? a.value() : b.value(), value = evaluate<op>(a.value(), b.value(), 0.0);
  const AD x = left ? b : a;
  if (!is_current(x)) return apply_by_laws<op>(a, b);
  Recording& r = *current;
  if (absorbs && c == 0) return 0.0;
  if ((zero && c == 0) || (one && c == 1)) return {value, x.id(), x.tape()};
  if ((op == Op::Sub && left && c == 0) || (op == Op::Mul && c == -1)) return negation(value, x);
  // Other zeros and divisors have laws of their own.
  if (c == 0 || (op == Op::Div && !left)) return apply_by_laws<op>(a, b);
  const NodeId id = x.id() & ~kNegated;
  if (id == x.id()) return add_node_of_constant<left>(value, op, c, id, r);
  if (op == Op::Mul || op == Op::Div) return add_node_of_constant<left>(value, op, -c, id, r);
  return apply_by_laws<op>(a, b);
}

// The sign of a NaN is no result (graph.h): a constant one would be folded to either.
[[gnu::noinline]] void refuse_sign_of_nan() {
  throw RecordingError("copysign: the second argument is NaN, whose sign is not defined; expected a number");
}

template <Op op>
AD apply(AD a, AD b) {
  if constexpr (op == Op::Copysign) {
    if (!b.is_recorded() && std::isnan(b.value())) refuse_sign_of_nan();
  }
  if (!a.is_recorded() && !b.is_recorded()) return evaluate<op>(a.value(), b.value(), 0.0);
  if constexpr (Graph::is_arithmetic(op)) {
    if (!a.is_recorded()) return apply_to_constant<op, true>(a, b);
    if (!b.is_recorded()) return apply_to_constant<op, false>(a, b);
    if (is_current(a) && is_current(b)) {
      if (op == Op::Mul && share_a_root(current->graph, a.id() & ~kNegated, b.id() & ~kNegated)) [[unlikely]]
        return apply_by_laws<op>(a, b);
      const double value = evaluate<op>(a.value(), b.value(), 0.0);
      return (a.id() | b.id()) & kNegated ? add_node_of_negations(value, op, a.id(), b.id(), *current)
                                          : add_node(value, op, a.id(), b.id(), *current);
    }
  }
  return apply_by_laws<op>(a, b);
}

template <Op op>
AD apply(AD a, AD b, AD c) {
  const double value = evaluate<op>(a.value(), b.value(), c.value());
  if (!a.is_recorded() && !b.is_recorded() && !c.is_recorded()) return value;
  Recording& r = recording_of(a, b, c);
  const NodeId x = node(r, a), y = node(r, b), z = node(r, c);
  return result(r, r.graph.make(op, x, y, z), value);
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
  Recording& r = recording_of(truth_);
  if (r.branches == RecordOptions::Branches::kError) {
    throw RecordingError(std::string(file_) + ":" + std::to_string(line_) + ": \"" + r.name +
                         "\" branches on a recorded value; use select(condition, a, b)");
  }
  const NodeId condition = node(r, truth_);
  if (r.guarded.insert(condition).second) r.guards.push_back({condition, taken, file_, line_});
  return taken;
}

std::ostream& operator<<(std::ostream& out, const AD& a) { return out << a.value(); }

// Open for as long as it lives, however its scope is left.
struct Recorder::Open {
  explicit Open(Recording r) : recording(std::move(r)), thread(std::this_thread::get_id()) {
    std::swap(recording.graph, spare);
    opened.recordings.push_back(&recording);
    current = &recording;
  }
  ~Open() {
    std::erase(opened.recordings, &recording);
    current = opened.recordings.empty() ? nullptr : opened.recordings.back();
    if (recording.graph.bytes() > kSpareBytes) return;
    recording.graph.clear();
    std::swap(recording.graph, spare);
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
  Recording recording;
  recording.name = name;
  recording.place = file ? ", begun at " + std::string(file) + ":" + std::to_string(line) : "";
  recording.serial = next_serial();
  recording.branches = options.branches;
  check_names(recording, options.variable_names, n_x, "variables");
  check_names(recording, options.parameter_names, n_p, "parameters");
  const std::vector<double> x = recording_point(options.variables, n_x, "variables", 1),
                            p = recording_point(options.parameters, n_p, "parameters", 1.5);
  open_ = std::make_unique<Open>(std::move(recording));
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
  for (const AD& entry : y) outputs.push_back(node(recording, entry));
  check_names(recording, options_.output_names, outputs.size(), "outputs");
  Function function = live_part(recording.graph, outputs, recording.guards);
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

  Recording& recording = recording_of(*some);
  std::vector<NodeId> ids;
  for (const AD& a : arguments) ids.push_back(node(recording, a));
  const std::vector<NodeId> nodes = recording.graph.call(callee, ids);
  for (std::size_t i = 0; i < out.size(); ++i) {
    results[static_cast<Eigen::Index>(i)] = AD(out[i], nodes[i], recording.serial);
  }
  return results;
}

}  // namespace dyntape
