// SPDX-License-Identifier: BSD-3-Clause
//
// Long work that Python can watch and interrupt.
//
//   const SimulatedMotion motion = watched(progress, [&](const Watch& watch) { return simulate(scene, {watch.stop, watch.tell}); });
//
// The work runs in a thread of its own without the lock; the calling one looks every fiftieth of a second whether a signal
// came (Ctrl-C: the work is asked to stop, and KeyboardInterrupt is raised when it has) and hands on what the work last
// said to `progress`: a callable of one string,
// True for a line on stderr (dyntape/_progress.py), or None.
//
//   interruptible(is_long, [&](const std::stop_token& stop) { ... });    // a batch: short ones run in the calling thread
//   left_alone(owner, [copies](const std::stop_token& stop) { ... });     // work that cannot end within a tenth of a second
//   left_alone(owner, progress, [copies](const Watch& watch) { ... });
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>

namespace dyntape::python {

namespace nb = nanobind;

struct Watch {
  std::stop_token stop;
  std::function<void(const std::string&)> tell;  // from any thread
};

// What the work says, for the thread that may touch Python.
class LatestWord {
 public:
  void say(const std::string& word) {
    const std::scoped_lock lock(mutex_);
    word_ = word;
    is_new_ = true;
  }
  bool take(std::string& word) {
    const std::scoped_lock lock(mutex_);
    if (!is_new_) return false;
    word = word_;
    is_new_ = false;
    return true;
  }

 private:
  std::mutex mutex_;
  std::string word_;
  bool is_new_ = false;
};

// Where progress goes: nowhere, to a callable, or to a line of the terminal, which is removed at the end.
class Listener {
 public:
  explicit Listener(nb::handle progress) {
    if (!progress.is_valid() || progress.is_none() || progress.is(Py_False)) return;
    is_line_ = progress.is(Py_True);
    listener_ = is_line_ ? nb::module_::import_("dyntape._progress").attr("Line")() : nb::borrow(progress);
  }
  ~Listener() {
    if (!is_line_) return;
    const nb::error_scope kept;  // an exception may be on its way
    try {
      listener_.attr("erase")();
    } catch (nb::python_error&) {  // the terminal is gone
    }
  }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  bool listens() const { return listener_.is_valid(); }
  void operator()(const std::string& word) const { listener_(word); }

 private:
  nb::object listener_;
  bool is_line_ = false;
};

// Waits for work in another thread: hands on what it says, and calls on_interrupt before it raises.
template <class Result, class End>
void await(std::future<Result>& result, const Listener& listener, LatestWord& latest,
           const End& on_interrupt) {
  std::string word;
  try {
    for (bool is_done = false; !is_done;) {
      {
        const nb::gil_scoped_release unlocked;
        is_done = result.wait_for(std::chrono::milliseconds(20)) == std::future_status::ready;
      }
      if (PyErr_CheckSignals() != 0) nb::raise_python_error();
      if (latest.take(word)) listener(word);  // the last one too
    }
  } catch (...) {
    on_interrupt();
    throw;
  }
}

template <class Work>
auto watched(nb::handle progress, const Work& work) {
  const Listener listener(progress);
  std::stop_source stop;
  LatestWord latest;
  Watch watch{stop.get_token(), {}};
  if (listener.listens()) watch.tell = [&](const std::string& word) { latest.say(word); };
  auto result = std::async(std::launch::async, [&] { return work(watch); });
  await(result, listener, latest, [&] {  // the work refers to what is here: it ends before this does
    stop.request_stop();
    const nb::gil_scoped_release unlocked;
    result.wait();
  });
  return result.get();
}

// Runs the work without the lock.  Long work can be interrupted and has to look at `stop`; a thread costs short work more
// than it takes.
template <class Work>
void interruptible(bool is_long, const Work& work) {
  if (is_long) return watched(nb::none(), [&](const Watch& watch) { work(watch.stop); });
  const nb::gil_scoped_release unlocked;
  work(std::stop_token());
}

// Keeps work that was left alone, with what it uses, until it has ended; the interpreter waits for it when it ends.
void keep_until_done(nb::object owner, std::function<bool(std::chrono::milliseconds)> is_done);  // module.cpp

// Runs work that does not look at `stop` often enough.  Ctrl-C asks it to stop and raises KeyboardInterrupt at once; the work
// goes on by itself, and what it finds is dropped.  The work owns what it uses, or `owner` does; it runs without the lock.
template <class Work>
auto left_alone(nb::object owner, nb::handle progress, Work work) {
  const Listener listener(progress);
  std::stop_source stop;
  const auto latest = std::make_shared<LatestWord>();
  Watch watch{stop.get_token(), {}};
  if (listener.listens()) watch.tell = [latest](const std::string& word) { latest->say(word); };
  auto result =
      std::async(std::launch::async, [work = std::move(work), watch]() mutable { return work(watch); });
  await(result, listener, *latest, [&] {
    stop.request_stop();
    keep_until_done(std::move(owner), [left = result.share()](std::chrono::milliseconds patience) {
      return left.wait_for(patience) == std::future_status::ready;
    });
  });
  return result.get();
}

template <class Work>
auto left_alone(nb::object owner, Work work) {
  return left_alone(std::move(owner), nb::none(),
                    [work = std::move(work)](const Watch& watch) mutable { return work(watch.stop); });
}

}  // namespace dyntape::python
