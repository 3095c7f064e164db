// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/run/threads.h>

#include <pthread.h>

#include <atomic>
#include <charconv>
#include <condition_variable>
#include <cstdlib>
#include <exception>
#include <memory>
#include <mutex>
#include <new>
#include <string_view>
#include <system_error>
#include <thread>
#include <vector>

#include <dyntape/autodiff/error.h>

namespace dyntape::codegen {
namespace {

using Task = std::function<void(std::size_t)>;

thread_local bool inside_task = false;

// What there is to do: whoever takes part draws numbers until there are none left.
struct Job {
  const Task* task = nullptr;
  std::size_t n = 0;
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::exception_ptr error;

  void help() {
    inside_task = true;
    for (std::size_t k; (k = next.fetch_add(1)) < n;) {
      try {
        (*task)(k);
      } catch (...) {
        const std::scoped_lock lock(mutex);
        if (!error) error = std::current_exception();
      }
    }
    inside_task = false;
  }
};

class Pool {
 public:
  // Threads that cannot be made are done without, all of them if need be: a caller does what nobody else does.
  explicit Pool(unsigned workers) {
    try {
      for (unsigned i = 0; i < workers; ++i) workers_.emplace_back([this] { serve(); });
    } catch (const std::system_error&) {
    } catch (const std::bad_alloc&) {
    }
  }

  ~Pool() {
    {
      const std::scoped_lock lock(mutex_);
      stops_ = true;
    }
    wake_.notify_all();
    for (std::thread& worker : workers_) worker.join();
  }

  // False: the pool is somebody else's now.
  bool run(Job& job) {
    const std::unique_lock turn(turn_, std::try_to_lock);
    if (!turn) return false;
    {
      const std::scoped_lock lock(mutex_);
      job_ = &job;
      ++number_;
    }
    wake_.notify_all();
    job.help();
    // Who has not come by now finds nothing; those who have are waited for.
    std::unique_lock lock(mutex_);
    job_ = nullptr;
    gone_.wait(lock, [&] { return helpers_ == 0; });
    return true;
  }

 private:
  void serve() {
    std::unique_lock lock(mutex_);
    for (std::size_t seen = 0;;) {
      wake_.wait(lock, [&] { return stops_ || (job_ && number_ != seen); });
      if (stops_) return;
      seen = number_;
      Job& job = *job_;
      ++helpers_;
      lock.unlock();
      job.help();
      lock.lock();
      if (--helpers_ == 0) gone_.notify_all();
    }
  }

  std::mutex turn_, mutex_;
  std::condition_variable wake_, gone_;
  Job* job_ = nullptr;
  std::size_t number_ = 0;  // of the job
  int helpers_ = 0;
  bool stops_ = false;
  std::vector<std::thread> workers_;
};

// The pool of this process, made when it is first needed and ended with the process.
std::atomic<Pool*> the_pool = nullptr;

Pool& pool() {
  Pool* found = the_pool;
  if (found) return *found;
  auto made = std::make_unique<Pool>(thread_count() - 1);
  return the_pool.compare_exchange_strong(found, made.get()) ? *made.release() : *found;
}

struct EndOfProcess {
  ~EndOfProcess() { delete the_pool.exchange(nullptr); }
} const end_of_process;

// A forked child has none of its parent's threads, and their locks as they happened to be: it leaves that pool where it
// is, and makes its own.
[[maybe_unused]] const int forget_the_pool = pthread_atfork(nullptr, nullptr, [] { the_pool = nullptr; });

}  // namespace

unsigned thread_count() {
  const char* const text = std::getenv("DYNTAPE_THREADS");
  if (!text || !*text) return std::max(1u, std::thread::hardware_concurrency());
  const std::string_view word(text);
  unsigned count = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), count);
  if (error != std::errc() || end != word.data() + word.size() || count < 1 || count > 1024)
    throw ArgumentError("DYNTAPE_THREADS is \"" + std::string(word) +
                        "\"; a number from 1 to 1024 was expected");
  return count;
}

void run_tasks(std::size_t n, const std::function<void(std::size_t)>& task) {
  Job job;
  job.task = &task;
  job.n = n;
  const bool alone = n < 2 || inside_task;
  const bool was_inside = inside_task;
  if (!alone) {
    if (!pool().run(job)) job.help();
  } else {
    job.help();
  }
  inside_task = was_inside;
  if (job.error) std::rethrow_exception(job.error);
}

}  // namespace dyntape::codegen
