// SPDX-License-Identifier: BSD-3-Clause
//
// A coroutine that is part of an algorithm and may be awaited by other parts:
//
//   Piece<bool> leave() { ...; co_return true; }
//   Piece<int> run() { if (co_await leave()) co_return 1; ... }
//   Piece<int> whole = run();
//   whole.handle().resume();            // runs until an awaited object suspends it, or to its end
//   whole.result()                      // at its end; rethrows its exception
#pragma once

#include <coroutine>
#include <exception>
#include <utility>

namespace dyntape {

template <class T>
class Piece {
 public:
  struct promise_type {
    T result{};
    std::exception_ptr failure;
    std::coroutine_handle<> caller = std::noop_coroutine();

    Piece get_return_object() { return Piece(Handle::from_promise(*this)); }
    std::suspend_always initial_suspend() noexcept { return {}; }
    struct Back {
      bool await_ready() noexcept { return false; }
      std::coroutine_handle<> await_suspend(std::coroutine_handle<promise_type> own) noexcept {
        return own.promise().caller;
      }
      void await_resume() noexcept {}
    };
    Back final_suspend() noexcept { return {}; }
    void return_value(T value) { result = std::move(value); }
    void unhandled_exception() { failure = std::current_exception(); }
  };
  using Handle = std::coroutine_handle<promise_type>;

  Piece() = default;
  explicit Piece(Handle handle) : handle_(handle) {}
  Piece(Piece&& other) noexcept : handle_(std::exchange(other.handle_, {})) {}
  Piece& operator=(Piece&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~Piece() {
    if (handle_) handle_.destroy();
  }

  bool await_ready() const { return false; }
  std::coroutine_handle<> await_suspend(std::coroutine_handle<> caller) {
    handle_.promise().caller = caller;
    return handle_;
  }
  T await_resume() { return result(); }

  std::coroutine_handle<> handle() const { return handle_; }
  T result() {
    if (handle_.promise().failure) std::rethrow_exception(handle_.promise().failure);
    return std::move(handle_.promise().result);
  }

 private:
  Handle handle_;
};

}  // namespace dyntape
