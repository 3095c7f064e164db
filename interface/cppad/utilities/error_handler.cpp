// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/utilities/error_handler.h>

#include <string>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/cppad/detail/recording.h>

namespace CppAD::inline dyntape_names {

namespace {
thread_local ErrorHandler::Handler current_handler = nullptr;
}

ErrorHandler::ErrorHandler(Handler handler) : before_(current_handler) { current_handler = handler; }
ErrorHandler::~ErrorHandler() { current_handler = before_; }

void ErrorHandler::Call(bool known, int line, const char* file, const char* exp, const char* msg) {
  if (current_handler) current_handler(known, line, file, exp, msg);
  throw dyntape::ArgumentError(std::string(file) + ":" + std::to_string(line) + ": " +
                               (*msg ? msg : "an assumption does not hold") + "; expected " + exp);
}

namespace detail {

void refuse(const std::string& sentence) {
  if (current_handler) current_handler(true, 0, "dyntape", "", sentence.c_str());
  throw ArgumentError(sentence);
}
void refuse_recording(const std::string& sentence) {
  if (current_handler) current_handler(true, 0, "dyntape", "", sentence.c_str());
  throw RecordingError(sentence);
}

}  // namespace detail
}  // namespace CppAD::inline dyntape_names
