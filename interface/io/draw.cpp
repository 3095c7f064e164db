// SPDX-License-Identifier: BSD-3-Clause
//
// Runs gnuplot on a script, without a shell.
#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/file.h>
#include <dyntape/interface/io/picture.h>

extern char** environ;

namespace dyntape::io {
namespace {

// Removed on every way out.
struct TemporaryFile {
  std::string path;
  ~TemporaryFile() { ::unlink(path.c_str()); }
};

struct Actions {
  posix_spawn_file_actions_t list;
  Actions() { ::posix_spawn_file_actions_init(&list); }
  ~Actions() { ::posix_spawn_file_actions_destroy(&list); }
};

// The exit status of `program script`; what it says goes to the file `messages`.
int run(const std::string& program, const std::string& script, const std::string& messages) {
  Actions actions;
  ::posix_spawn_file_actions_addopen(&actions.list, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_addopen(&actions.list, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  ::posix_spawn_file_actions_addopen(&actions.list, STDERR_FILENO, messages.c_str(), O_WRONLY | O_CREAT,
                                     0600);
  const std::string words[] = {program, "-d", script};  // -d: without the user's start-up file
  char* arguments[] = {const_cast<char*>(words[0].c_str()), const_cast<char*>(words[1].c_str()),
                       const_cast<char*>(words[2].c_str()), nullptr};
  pid_t child = 0;
  const int error = ::posix_spawnp(&child, program.c_str(), &actions.list, nullptr, arguments, environ);
  if (error == ENOENT) {
    throw ToolError("'" + program + "' is not installed, so no picture can be drawn (Debian: gnuplot-nox)");
  }
  if (error != 0) throw ToolError("cannot start '" + program + "': " + std::strerror(error));
  int status = 0;
  while (::waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) throw ToolError("cannot wait for '" + program + "': " + std::strerror(errno));
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

// gnuplot may end well on a disk that is full: what it wrote is then cut off, and such a file lacks its end.
bool is_whole(const std::string& picture, const std::string& extension) {
  using namespace std::string_view_literals;
  if (extension == ".png") return picture.ends_with("\0\0\0\0IEND\xae\x42\x60\x82"sv);
  const std::size_t last = picture.find_last_not_of(" \t\r\n");
  return last != std::string::npos && std::string_view(picture).substr(0, last + 1).ends_with("</svg>");
}

}  // namespace

void draw(const Plot& plot, const std::string& path, const std::string& gnuplot) {
  const std::string extension = std::filesystem::path(path).extension().string();
  if (extension != ".svg" && extension != ".png") {
    throw ArgumentError("draw: the picture '" + path + "' must end in .svg or .png");
  }
  const TemporaryFile picture{temporary_name_beside(path)};
  const TemporaryFile script{picture.path + ".gp"}, messages{picture.path + ".err"};
  write_file_atomically(script.path, gnuplot_script(plot, extension.substr(1), picture.path));
  const int status = run(gnuplot, script.path, messages.path);
  const std::string said = read_file(messages.path);
  std::error_code error;
  const bool drawn = std::filesystem::file_size(picture.path, error) > 0 && !error;
  if (status != 0 || !drawn) {
    throw ToolError("'" + gnuplot + "' did not draw " + path + " (exit status " + std::to_string(status) +
                    "): " + said);
  }
  std::ifstream file(picture.path, std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(file), {});
  if (!is_whole(text, extension)) {
    throw FileError(path + ": '" + gnuplot + "' left a picture of " + std::to_string(text.size()) +
                    " bytes that is cut off; expected room for all of it on the disk");
  }
  write_file_atomically(path, text);
}

}  // namespace dyntape::io
