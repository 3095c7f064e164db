// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/utilities/error_handler.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <unistd.h>

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

bool has_handler() { return current_handler != nullptr; }
void call_handler(const std::string& message) {
  thread_local std::string last_message;  // handlers throw the pointer to it
  last_message = message;
  if (current_handler) current_handler(true, 0, "dyntape", "", last_message.c_str());
}
void refuse_size(const std::string& what, std::size_t got, std::size_t expected) {
  refuse(what + ": got " + std::to_string(got) + ", expected " + std::to_string(expected));
}
void refuse_index(const std::string& what, std::size_t i, std::size_t n) {
  refuse(what + " " + std::to_string(i) + " does not exist; there are " + std::to_string(n));
}

void refuse(const std::string& sentence) {
  call_handler(sentence);
  throw ArgumentError(sentence);
}
void refuse_recording(const std::string& sentence) {
  call_handler(sentence);
  throw RecordingError(sentence);
}

std::string write_temporary(const void* bytes, std::size_t count) {
  std::string name = (std::filesystem::temp_directory_path() / "check_for_nan_XXXXXX").string();
  const int descriptor = mkstemp(name.data());
  std::FILE* const file = descriptor < 0 ? nullptr : fdopen(descriptor, "wb");
  if (!file) return "";
  const bool written = std::fwrite(bytes, 1, count, file) == count;
  return std::fclose(file) == 0 && written ? name : "";
}
void read_temporary(const std::string& name, void* bytes, std::size_t count) {
  std::ifstream file(name, std::ios::binary);
  if (!file.read(static_cast<char*>(bytes), static_cast<std::streamsize>(count)))
    refuse("get_check_for_nan: \"" + name + "\" does not have " + std::to_string(count) + " bytes");
}

}  // namespace detail
}  // namespace CppAD::inline dyntape_names
