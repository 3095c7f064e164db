// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/tiers.h>

#include <algorithm>
#include <numeric>
#include <optional>
#include <thread>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/system/of_this_process.h>
#include <dyntape/codegen/system/warn_once.h>

namespace dyntape::codegen {
namespace {

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
  State& state_ = of_this_process<State>();
  bool mine_ = false;
};

std::string reason_of(const std::exception_ptr& failure) {
  try {
    if (failure) std::rethrow_exception(failure);
  } catch (const std::exception& e) {
    return e.what();
  } catch (...) {  // a kernel's own functions may throw anything
    return kNoException;
  }
  return "";
}

std::size_t index_of(Tier tier) { return static_cast<std::size_t>(tier); }

// Short ones are compiled at any level before anybody notices.
bool is_worth_a_quick_tier(const Source& source) {
  constexpr std::size_t kShort = 1000;  // statements
  return std::accumulate(source.pieces.begin(), source.pieces.end(), std::size_t{0}) > kShort;
}

}  // namespace

// --- places ---

Place::Place(std::shared_ptr<Tiers> tiers) : tiers_(std::move(tiers)) {
  const std::scoped_lock lock(tiers_->mutex_);
  move_to(tiers_->tier_, *tiers_->kernels_[index_of(tiers_->tier_)]);
  tiers_->places_.push_back(this);
}

Place::~Place() {
  const std::scoped_lock lock(tiers_->mutex_);
  std::erase(tiers_->places_, this);
}

void Place::move_to(Tier tier, const Kernels& kernels) {
  auto& room = rooms_[index_of(tier)];
  room = std::make_unique<Room>(kernels);
  now_.store(room.get(), std::memory_order_release);
}

// --- tiers ---

Tiers::Tiers(std::unique_ptr<const Kernels> first, bool settled)
    : tier_(first->tier()), settled_(settled), first_(*first) {
  kernels_[index_of(tier_)] = std::move(first);
}

void Tiers::publish(Tier tier, std::unique_ptr<const Kernels> kernels) {
  const std::scoped_lock lock(mutex_);
  for (Place* place : places_) place->move_to(tier, *kernels);
  kernels_[index_of(tier)] = std::move(kernels);
  tier_ = tier;
}

void Tiers::settle(std::exception_ptr failure) {
  const std::scoped_lock lock(mutex_);
  settled_ = true;
  failure_ = std::move(failure);
  changed_.notify_all();
}

const Kernels& Tiers::serving() const {
  const std::scoped_lock lock(mutex_);
  return *kernels_[index_of(tier_)];
}

Tier Tiers::tier() const {
  const std::scoped_lock lock(mutex_);
  return tier_;
}

bool Tiers::is_settled() const {
  const std::scoped_lock lock(mutex_);
  return settled_;
}

void Tiers::wait() const {
  if (process_ != getpid() && !is_settled())
    throw ToolError("\"" + first_.name +
                    "\" is compiled by the process that this one was forked from; it stays " +
                    to_string(tier()));
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return settled_; });
  if (failure_) std::rethrow_exception(failure_);
}

std::string Tiers::trouble() const {
  std::exception_ptr failure;
  {
    const std::scoped_lock lock(mutex_);
    failure = failure_;
  }
  return reason_of(failure);
}

// --- what makes them ---

// It holds the tiers, and they do not hold it.
class TierBuilder {
 public:
  TierBuilder(const Function& function, const CodegenOptions& options)
      : options_(options), also_stops_(options.stop), product_(begin(function)) {
    options_.stop = stop_.get_token();
  }

  ~TierBuilder() {
    stop_.request_stop();
    if (thread_.joinable()) thread_.join();
  }

  // The tiers; more of them are to come if there is a thread then.
  std::shared_ptr<Tiers> start() {
    const bool opens_at_once = LibraryBuilder::opens_at_once(options_);
    if (opens_at_once) builder_ = find(product_, options_);
    if (product_.library) return tiers_of(std::move(product_), true);
    derived_ = derive(product_, options_);
    Product at_once = make_at_once(product_, derived_, options_);
    const bool has_compiler = builder_ || !opens_at_once;
    tiers_ = tiers_of(std::move(at_once), !has_compiler);
    if (has_compiler) thread_ = std::thread([this] { run(); });
    return tiers_;
  }

  bool is_at_work() const { return thread_.joinable(); }

 private:
  std::shared_ptr<Tiers> tiers_of(Product product, bool settled) const {
    return std::make_shared<Tiers>(std::make_unique<const Kernels>(std::move(product), options_), settled);
  }

  void run() {
    const std::stop_callback forward(also_stops_, [this] { stop_.request_stop(); });
    std::exception_ptr failure;
    try {
      build();
    } catch (...) {
      failure = std::current_exception();
      const std::string reason = reason_of(failure);
      if (!stop_.stop_requested())
        warn_once("\"" + tiers_->first().name + "\" stays " + to_string(tiers_->tier()) + ": " +
                  reason.substr(0, reason.find('\n')));
    }
    tiers_->settle(std::move(failure));
  }

  void build() {
    if (builder_ ? serve_cached() : is_done()) return;
    go_on();
    const Source source = print(product_, std::move(derived_), builder_->content(), options_);
    const auto quick = tiers_->tier() == Tier::kInterpreted ? builder_->quick() : std::nullopt;
    if (quick && is_worth_a_quick_tier(source)) {
      const Turn turn(options_.stop);
      go_on();
      if (is_done()) return;
      serve(Tier::kQuick, make(product_, source, *quick));
    }
    const Turn turn(options_.stop);
    go_on();
    if (is_done()) return;
    serve(Tier::kFinal, make(std::move(product_), source, *builder_));
  }

  // There may be no compiler, or a library by now: an equal function has had its turn.
  bool is_done() {
    builder_ = find(product_, options_);
    return serve_cached() || !builder_;
  }

  bool serve_cached() {
    if (!product_.library) return false;
    serve(Tier::kFinal, std::move(product_));
    return true;
  }

  void go_on() const {
    if (stop_.stop_requested()) throw ToolError("the compiler was interrupted");
  }

  void serve(Tier tier, Product made) {
    // Points that lie side by side do so for the first tier's lanes.
    CodegenOptions options = options_;
    if (const std::size_t width = tiers_->first().lane_width(); width > 1) options.widest_lanes = width;
    tiers_->publish(tier, std::make_unique<const Kernels>(std::move(made), options));
  }

  CodegenOptions options_;      // with this one's stop
  std::stop_token also_stops_;  // the user's
  std::stop_source stop_;
  Product product_;                        // as far as it has come
  std::optional<LibraryBuilder> builder_;  // none: the compiler has to be asked what it is
  std::vector<Derivatives> derived_;
  std::shared_ptr<Tiers> tiers_;
  std::thread thread_;
};

std::pair<std::shared_ptr<Tiers>, std::shared_ptr<TierBuilder>> make_tiers(const Function& function,
                                                                           const CodegenOptions& options) {
  if (options.route != Route::kTiered || options.only_cached) {
    auto kernels = std::make_unique<const Kernels>(produce(function, options), options);
    return {std::make_shared<Tiers>(std::move(kernels), true), nullptr};
  }
  auto builder = std::make_shared<TierBuilder>(function, options);
  auto tiers = builder->start();
  if (!builder->is_at_work()) builder.reset();
  return {std::move(tiers), std::move(builder)};
}

}  // namespace dyntape::codegen
