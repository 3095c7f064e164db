// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/tiered_function.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <numeric>
#include <optional>
#include <thread>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/pipeline_stages.h>
#include <dyntape/codegen/system/of_this_process.h>
#include <dyntape/codegen/system/warn_once.h>

namespace dyntape {
namespace {

constexpr std::size_t kTiers = 3;
constexpr const char* kNoException = "what was thrown is no std::exception";

// One function of the process is compiled at a time.
class Turn {
 public:
  explicit Turn(const std::stop_token& stop) {
    std::unique_lock lock(state_.mutex);
    mine_ = state_.free.wait(lock, stop, [this] { return !state_.taken; });
    if (mine_) state_.taken = true;
  }
  ~Turn() {
    if (!mine_) return;
    const std::scoped_lock lock(state_.mutex);
    state_.taken = false;
    state_.free.notify_one();
  }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

 private:
  struct State {
    std::mutex mutex;
    std::condition_variable_any free;
    bool taken = false;
  };
  State& state_ = codegen::of_this_process<State>();
  bool mine_ = false;
};

}  // namespace

// A tier and what it works in.
struct TieredFunction::Room {
  explicit Room(const CompiledFunction& f) : function(f), workspace(f) {}
  CompiledFunction function;
  CompiledFunction::Workspace workspace;
};

// Where one workspace evaluates.  The background fills a room and then points to it; the evaluating thread only
// reads the pointer.  Rooms stay until the workspace goes: it may be evaluating in any of them.
struct TieredFunction::Workspace::Place {
  std::atomic<Room*> current{nullptr};
  std::array<std::unique_ptr<Room>, kTiers> rooms;

  void move_to(std::size_t tier, const CompiledFunction& function) {
    rooms[tier] = std::make_unique<Room>(function);
    current.store(rooms[tier].get(), std::memory_order_release);
  }
};

struct TieredFunction::Tiers {
  Tiers(CompiledFunction function, Tier kind) : first(function), current(std::move(function)), tier(kind) {}

  const CompiledFunction first;
  mutable std::mutex mutex;  // of all below
  mutable std::condition_variable changed;
  CompiledFunction current;
  Tier tier;
  bool settled = false;
  std::exception_ptr failure;
  std::vector<Workspace::Place*> places;  // of the workspaces that there are

  void publish(Tier kind, const CompiledFunction& function) {
    const std::scoped_lock lock(mutex);
    for (Workspace::Place* place : places) place->move_to(static_cast<std::size_t>(kind), function);
    current = function;
    tier = kind;
  }

  void settle(std::exception_ptr reason) {
    const std::scoped_lock lock(mutex);
    settled = true;
    failure = std::move(reason);
    changed.notify_all();
  }
};

// What makes the other tiers, in a thread of its own.  It holds the tiers, and they do not hold it.
struct TieredFunction::Builder {
  ~Builder() {
    stop.request_stop();
    if (thread.joinable()) thread.join();
  }

  std::shared_ptr<Tiers> tiers;
  codegen::Product product;                        // as far as it has come
  std::optional<codegen::LibraryBuilder> builder;  // none: the compiler has to be asked what it is
  std::vector<Derivatives> derived;
  CodegenOptions options;
  std::stop_source stop;       // the options have its token
  std::stop_token also_stops;  // the user's
  std::thread thread;

  void run() {
    const std::stop_callback forward(also_stops, [this] { stop.request_stop(); });
    std::exception_ptr failure;
    try {
      build();
    } catch (const std::exception& e) {
      failure = std::current_exception();
      const std::string reason = e.what();
      if (!stop.stop_requested())
        codegen::warn_once("\"" + tiers->first.name() + "\" stays " + to_string(tiers->tier) + ": " +
                           reason.substr(0, reason.find('\n')));
    } catch (...) {  // a kernel's own functions may throw anything
      failure = std::current_exception();
      codegen::warn_once("\"" + tiers->first.name() + "\" stays " + to_string(tiers->tier) + ": " +
                         kNoException);
    }
    tiers->settle(std::move(failure));
  }

  void build() {
    if (!builder) builder = codegen::find(product, options);
    if (product.library) return serve(Tier::kFinal, std::move(product));
    if (!builder || stop.stop_requested()) return;
    const codegen::Source source = codegen::print(product, std::move(derived), *builder, options);
    if (const auto quick = builder->quick(); quick && is_worth_a_quick_tier(source)) {
      const Turn turn(options.stop);
      if (!stop.stop_requested()) serve(Tier::kQuick, codegen::make(product, source, *quick));
    }
    const Turn turn(options.stop);
    if (!stop.stop_requested()) serve(Tier::kFinal, codegen::make(std::move(product), source, *builder));
  }

  void serve(Tier tier, codegen::Product made) {
    tiers->publish(tier, CompiledFunction::from(std::move(made), options));
  }

  // Short ones are compiled at any level before anybody notices.
  static bool is_worth_a_quick_tier(const codegen::Source& source) {
    constexpr std::size_t kShort = 1000;  // statements
    return std::accumulate(source.pieces.begin(), source.pieces.end(), std::size_t{0}) > kShort;
  }
};

TieredFunction TieredFunction::of(CompiledFunction function) {
  const Tier tier = function.route() == Route::kCompiled ? Tier::kFinal : Tier::kInterpreted;
  auto tiers = std::make_shared<Tiers>(std::move(function), tier);
  tiers->settled = true;
  return TieredFunction(std::move(tiers), nullptr);
}

TieredFunction TieredFunction::make(const Function& function, const CodegenOptions& given) {
  if (given.only_cached) return of(CompiledFunction::make(function, given));

  auto builder = std::make_shared<Builder>();
  builder->also_stops = given.stop;
  CodegenOptions& options = builder->options = given;
  options.stop = builder->stop.get_token();
  codegen::Product& product = builder->product = codegen::begin(function);
  const bool opens_at_once = codegen::LibraryBuilder::opens_at_once(options);
  if (opens_at_once) builder->builder = codegen::find(product, options);
  if (product.library) return of(CompiledFunction::from(std::move(product), given));

  codegen::Product interpreted = product;
  interpreted.interpreted = codegen::derive(interpreted, options);
  builder->derived = interpreted.interpreted;
  CompiledFunction first = CompiledFunction::from(std::move(interpreted), given);
  const bool has_compiler = builder->builder || !opens_at_once;
  if (!has_compiler || given.route == Route::kInterpreter) return of(std::move(first));
  builder->tiers = std::make_shared<Tiers>(std::move(first), Tier::kInterpreted);
  builder->thread = std::thread([b = builder.get()] { b->run(); });
  return TieredFunction(builder->tiers, builder);
}

// --- workspaces ---

TieredFunction::Workspace::Workspace(const TieredFunction& function)
    : tiers_(function.tiers_), place_(std::make_unique<Place>()) {
  const std::scoped_lock lock(tiers_->mutex);
  place_->move_to(static_cast<std::size_t>(tiers_->tier), tiers_->current);
  tiers_->places.push_back(place_.get());
}

TieredFunction::Workspace::~Workspace() {
  if (!tiers_) return;  // moved from
  const std::scoped_lock lock(tiers_->mutex);
  std::erase(tiers_->places, place_.get());
}

TieredFunction::Workspace::Workspace(Workspace&&) noexcept = default;

TieredFunction::Workspace& TieredFunction::Workspace::operator=(Workspace&& other) noexcept {
  std::swap(tiers_, other.tiers_);
  std::swap(place_, other.place_);
  return *this;
}

// --- evaluation ---

TieredFunction::Room& TieredFunction::room(Workspace& workspace) const {
  if (workspace.tiers_ != tiers_)
    throw ArgumentError("\"" + first().name() + "\" is evaluated with the workspace of another function");
  return *workspace.place_->current.load(std::memory_order_acquire);
}

void TieredFunction::value(const double* x, const double* p, double* y, Workspace& workspace) const {
  Room& now = room(workspace);
  now.function.value(x, p, y, now.workspace);
}

void TieredFunction::first_order(const double* x, const double* p, double* y, double* jacobian,
                                 Workspace& workspace) const {
  Room& now = room(workspace);
  now.function.first_order(x, p, y, jacobian, now.workspace);
}

void TieredFunction::second_order(const double* x, const double* p, const double* w, double* y,
                                  double* jacobian, double* hessian, Workspace& workspace) const {
  Room& now = room(workspace);
  now.function.second_order(x, p, w, y, jacobian, hessian, now.workspace);
}

Violation TieredFunction::run(Order order, const Points& points, Workspace& workspace) const {
  Room& now = room(workspace);
  return now.function.run(order, points, now.workspace);
}

void TieredFunction::check(const Violation& violation, std::size_t lanes) const {
  first().check(violation, lanes);
}

// --- questions ---

const CompiledFunction& TieredFunction::first() const { return tiers_->first; }

TieredFunction::Tier TieredFunction::tier() const {
  const std::scoped_lock lock(tiers_->mutex);
  return tiers_->tier;
}

CompiledFunction TieredFunction::serving() const {
  const std::scoped_lock lock(tiers_->mutex);
  return tiers_->current;
}

bool TieredFunction::is_settled() const {
  const std::scoped_lock lock(tiers_->mutex);
  return tiers_->settled;
}

void TieredFunction::wait() const {
  std::unique_lock lock(tiers_->mutex);
  tiers_->changed.wait(lock, [&] { return tiers_->settled; });
  if (tiers_->failure) std::rethrow_exception(tiers_->failure);
}

std::string TieredFunction::trouble() const {
  std::exception_ptr failure;
  {
    const std::scoped_lock lock(tiers_->mutex);
    failure = tiers_->failure;
  }
  try {
    if (failure) std::rethrow_exception(failure);
  } catch (const std::exception& e) {
    return e.what();
  } catch (...) {
    return kNoException;
  }
  return "";
}

const char* to_string(TieredFunction::Tier tier) {
  constexpr const char* kNames[] = {"interpreted", "compiled at -O1", "compiled"};
  return kNames[static_cast<int>(tier)];
}

}  // namespace dyntape
