// SPDX-License-Identifier: BSD-3-Clause
//
// Handles errors of this layer's calls: by an exception (autodiff/error.h), or by a handler that the program
// installs.
//
//   void handler(bool known, int line, const char* file, const char* exp, const char* msg);   // throws, or ends the program
//   CppAD::ErrorHandler info(handler);                    // in this thread, until info is destroyed
//   CPPAD_ASSERT_KNOWN(n > 0, "there are no entries");    // checked in every build
#pragma once

namespace CppAD::inline dyntape_names {

class ErrorHandler {
 public:
  using Handler = void (*)(bool known, int line, const char* file, const char* exp, const char* msg);

  explicit ErrorHandler(Handler handler);
  ErrorHandler(const ErrorHandler&) = delete;
  ErrorHandler& operator=(const ErrorHandler&) = delete;
  ~ErrorHandler();

  // Calls the handler of this thread.  If there is none, or if it returns, throws ArgumentError with place and
  // message.
  [[noreturn]] static void Call(bool known, int line, const char* file, const char* exp, const char* msg);

 private:
  Handler before_;
};

}  // namespace CppAD::inline dyntape_names

#define CPPAD_ASSERT_KNOWN(exp, msg)                                              \
  {                                                                               \
    if (!(exp)) ::CppAD::ErrorHandler::Call(true, __LINE__, __FILE__, #exp, msg); \
  }
#define CPPAD_ASSERT_UNKNOWN(exp)                                                 \
  {                                                                               \
    if (!(exp)) ::CppAD::ErrorHandler::Call(false, __LINE__, __FILE__, #exp, ""); \
  }
