// SPDX-License-Identifier: BSD-3-Clause
//
// What is shown while work goes on, and pictures that are cut off.
#include <gtest/gtest.h>

#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <stop_token>
#include <thread>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/io/live_line.h>
#include <dyntape/interface/report/plot/picture.h>

namespace dyntape::io::io_live_line_test {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

TEST(LiveLine, OneLineOnATerminalThatIsErased) {
  ::testing::internal::CaptureStderr();
  {
    LiveLine line(LiveLine::Kind::kTerminal, 1h);
    line.show("first");
    line.show("too soon");
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "\rfirst\033[K\r\033[K");
}

TEST(LiveLine, PlainLinesNowAndThenElsewhere) {
  ::testing::internal::CaptureStderr();
  {
    LiveLine line(LiveLine::Kind::kPlain, 1h);
    line.show("work of less than an hour leaves none");
  }
  {
    LiveLine line(LiveLine::Kind::kPlain, 0ms);
    line.show("one");
    line.show("two");
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "dyntape: one\ndyntape: two\n");
}

// A gnuplot that ends well and leaves this.
std::string gnuplot_that_leaves(const fs::path& folder, const std::string& text) {
  const std::string path = (folder / "gnuplot").string();
  write_file_atomically((folder / "text").string(), text);
  write_file_atomically(path, "#!/bin/sh\ncp '" + (folder / "text").string() +
                                  "' \"$(sed -n 's/.*set output .\\(.*\\).$/\\1/p' \"$2\")\"\n");
  fs::permissions(path, fs::perms::owner_all);
  return path;
}

TEST(Draw, APictureThatIsCutOffIsAnErrorAndLeavesNothing) {
  const fs::path folder = fs::temp_directory_path() / ("dyntape-draw-" + std::to_string(getpid()));
  fs::create_directories(folder);
  Plot plot;
  plot.panels = {Panel{.series = {{.name = "c", .x = {0, 1}, .y = {0, 1}}}}};
  const std::string svg = (folder / "p.svg").string(), png = (folder / "p.png").string();
  EXPECT_THROW(draw(plot, svg, gnuplot_that_leaves(folder, "<svg><path d='0")), FileError);
  EXPECT_THROW(draw(plot, png, gnuplot_that_leaves(folder, "\x89PNG and half of it")), FileError);
  EXPECT_FALSE(fs::exists(svg) || fs::exists(png));
  draw(plot, svg, gnuplot_that_leaves(folder, "<svg></svg>\n\n"));
  EXPECT_EQ(read_file(svg), "<svg></svg>\n\n");
  fs::remove_all(folder);
}

// Who interrupts does not wait for gnuplot.
TEST(Draw, EndsWithARequest) {
  const fs::path folder = fs::temp_directory_path() / ("dyntape-draw-stop-" + std::to_string(getpid()));
  fs::create_directories(folder);
  const std::string slow = (folder / "gnuplot").string(), svg = (folder / "p.svg").string();
  write_file_atomically(slow, "#!/bin/sh\nexec sleep 60\n");
  fs::permissions(slow, fs::perms::owner_all);
  Plot plot;
  plot.panels = {Panel{.series = {{.name = "c", .x = {0, 1}, .y = {0, 1}}}}};
  std::stop_source stop;
  const std::jthread request([&] { std::this_thread::sleep_for(200ms), stop.request_stop(); });
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_THROW(draw(plot, svg, slow, stop.get_token()), Error);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 20s);
  EXPECT_FALSE(fs::exists(svg));
  fs::remove_all(folder);
}

}  // namespace
}  // namespace dyntape::io::io_live_line_test
