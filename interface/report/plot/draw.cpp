// SPDX-License-Identifier: BSD-3-Clause
//
// Runs gnuplot on a script, without a shell.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/codegen/system/files.h>
#include <dyntape/codegen/system/process.h>
#include <dyntape/interface/report/plot/picture.h>

namespace dyntape::io {
namespace {

constexpr char kPictureFolder[] = "dyntape-picture-";  // of gnuplot's script and what it draws

// What `program script` said, and how it ended.
codegen::Outcome run(const std::string& program, const std::string& script, const std::stop_token& stop) {
  // -d: without the user's start-up file; env looks for the program in PATH.
  codegen::Outcome outcome =
      codegen::run_all({{{"/usr/bin/env", program, "-d", script}, "", ""}}, {.stop = stop}).front();
  if (outcome.status != codegen::Outcome::kNotStarted) return outcome;
  throw ToolError("'" + program + "' is not installed, so no picture can be drawn (Debian: gnuplot-nox)");
}

// read_file refuses the zeros of a PNG; empty where there is none.
std::string read_bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// gnuplot may end well on a disk that is full: what it wrote is then cut off, and such a file lacks its end.
bool is_whole(const std::string& picture, const std::string& extension) {
  using namespace std::string_view_literals;
  if (extension == ".png") return picture.ends_with("\0\0\0\0IEND\xae\x42\x60\x82"sv);
  const std::size_t last = picture.find_last_not_of(" \t\r\n");
  return last != std::string::npos && std::string_view(picture).substr(0, last + 1).ends_with("</svg>");
}

// gnuplot leaves > as it is in texts, where XML does not allow it behind ]].
std::string well_formed(const std::string& svg) {
  constexpr std::string_view kBegin = "<![CDATA[", kEnd = "]]>";
  std::string text;
  for (std::size_t at = 0; at < svg.size();) {
    const std::size_t data = std::min(svg.find(kBegin, at), svg.size()),
                      end = std::min(svg.find(kEnd, at), svg.size());
    const std::size_t next = std::min(data, end);
    text.append(svg, at, next - at);
    at = next;
    if (data < end) {
      at = std::min(svg.find(kEnd, data), svg.size() - kEnd.size()) + kEnd.size();
      text.append(svg, data, at - data);
    } else if (end < svg.size()) {
      text += "]]&gt;";
      at = end + kEnd.size();
    }
  }
  return text;
}

}  // namespace

void draw(const Plot& plot, const std::string& path, const std::string& gnuplot,
          const std::stop_token& stop) {
  const std::string extension = std::filesystem::path(path).extension().string();
  if (extension != ".svg" && extension != ".png")
    throw ArgumentError("draw: the picture '" + path + "' must end in .svg or .png");
  const std::string all = codegen::system_temporary_folder();
  codegen::remove_left_over(all, kPictureFolder);
  const codegen::TemporaryFolder folder(all, kPictureFolder);
  const std::string picture = folder.path() + "/picture" + extension, script = folder.path() + "/script";
  codegen::write_file(script, gnuplot_script(plot, extension.substr(1), picture));
  const codegen::Outcome outcome = run(gnuplot, script, stop);
  const std::string text = read_bytes(picture);
  if ((outcome.status != 0 && outcome.status != codegen::Outcome::kUnknown) || text.empty())
    throw ToolError("'" + gnuplot + "' did not draw " + path + " (exit status " +
                    std::to_string(outcome.status) + "): " + outcome.output);
  if (!is_whole(text, extension))
    throw FileError(path + ": '" + gnuplot + "' left a picture of " + std::to_string(text.size()) +
                    " bytes that is cut off; expected room for all of it on the disk");
  write_file_atomically(path, extension == ".svg" ? well_formed(text) : text);
}

std::vector<double> thinned(const std::vector<double>& values) {
  constexpr std::size_t kMost = 2000;
  if (values.size() <= kMost) return values;
  std::vector<double> some;
  for (std::size_t k = 0; k < kMost; ++k) some.push_back(values[k * values.size() / kMost]);
  return some;
}

}  // namespace dyntape::io
