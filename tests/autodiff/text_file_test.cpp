// SPDX-License-Identifier: BSD-3-Clause
//
// Whole files in and out, where the path is more than a file: links, pipes, devices, folders.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <future>
#include <set>
#include <thread>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>

namespace dyntape::text_file_test {
namespace {

namespace fs = std::filesystem;

class TextFile : public ::testing::Test {
 protected:
  TextFile() {
    char name[] = "/tmp/dyntape_text_file_XXXXXX";
    folder_ = mkdtemp(name);
  }
  ~TextFile() override { fs::remove_all(folder_); }
  std::string at(const std::string& name) const { return (folder_ / name).string(); }
  std::size_t entries() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }
  std::string pipe(const std::string& name) const {
    EXPECT_EQ(mkfifo(at(name).c_str(), 0600), 0);
    return at(name);
  }

  fs::path folder_;
};

template <class F>
std::string sentence(F&& f) {
  try {
    f();
  } catch (const FileError& e) {
    return e.what();
  }
  return "no error";
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != text.npos; }

TEST_F(TextFile, LinksStayAndTheirTargetsAreReplaced) {
  fs::create_directories(folder_ / "below");
  write_file_atomically(at("below/target"), "old");
  fs::create_symlink("below/target", at("one"));  // relative to its own folder
  fs::create_symlink(at("one"), at("two"));
  write_file_atomically(at("two"), "new");
  EXPECT_EQ(read_file(at("below/target")), "new");
  EXPECT_TRUE(fs::is_symlink(at("one")) && fs::is_symlink(at("two")));

  fs::create_symlink("below/later", at("dangling"));
  write_file_atomically(at("dangling"), "made");
  EXPECT_EQ(read_file(at("below/later")), "made");

  fs::create_symlink("b", at("a"));
  fs::create_symlink("a", at("b"));
  EXPECT_TRUE(has(sentence([&] { write_file_atomically(at("a"), ""); }), "circle"));
  EXPECT_EQ(entries(), 6u);  // and no temporary file
}

TEST_F(TextFile, PipesAreWrittenTo) {
  const std::string path = pipe("pipe"), text(200000, 'x');  // more than a pipe holds
  auto reader = std::async(std::launch::async, [&] { return read_file(path); });
  write_file_atomically(path, text);
  EXPECT_EQ(reader.get(), text);
  EXPECT_TRUE(fs::is_fifo(path));
}

TEST_F(TextFile, DevicesAreWrittenTo) {
  write_file_atomically("/dev/null", "x");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  fs::create_symlink("/dev/full", at("full"));
  EXPECT_TRUE(has(sentence([&] { write_file_atomically(at("full"), "x"); }), "No space left"));
}

// What is written there already stays, and what follows comes behind.
TEST_F(TextFile, OwnDescriptorsAreWrittenTo) {
  const int file = open(at("log").c_str(), O_CREAT | O_WRONLY, 0600);
  ASSERT_EQ(write(file, "a", 1), 1);
  write_file_atomically("/dev/fd/" + std::to_string(file), "b");
  fs::create_symlink("/proc/self/fd/" + std::to_string(file), at("link"));
  write_file_atomically(at("link"), "c");
  ASSERT_EQ(write(file, "d", 1), 1);
  close(file);
  EXPECT_EQ(read_file(at("log")), "abcd");
}

TEST_F(TextFile, PermissionsStay) {
  write_file_atomically(at("secret"), "old");
  fs::permissions(at("secret"), fs::perms(0600));
  write_file_atomically(at("secret"), "new");
  EXPECT_EQ(fs::status(at("secret")).permissions(), fs::perms(0600));
}

TEST_F(TextFile, NamesMayBeAsLongAsTheSystemTakes) {
  std::string name(255, 'n');
  name.replace(251, 4, ".csv");
  const std::string path = at(name);
  write_file_atomically(path, "x");
  EXPECT_EQ(read_file(path), "x");
  EXPECT_EQ(entries(), 1u);
}

// In containers every process has the number 1, and what a killed one left is still there.
TEST_F(TextFile, ProcessesOfTheSameNumberUseDifferentNames) {
  std::set<std::string> names;
  for (int i = 0; i < 3; ++i) {
    const pid_t outer = fork();
    if (outer == 0) {
      if (unshare(CLONE_NEWPID) != 0) _exit(0);
      const pid_t inner = fork();
      if (inner == 0)
        std::ofstream(at("name")) << getpid() << fs::path(temporary_name_beside("x")).filename().string();
      if (inner != 0) waitpid(inner, nullptr, 0);
      _exit(0);
    }
    waitpid(outer, nullptr, 0);
    if (!fs::exists(at("name"))) GTEST_SKIP() << "process namespaces are not allowed here";
    names.insert(read_file(at("name")));
  }
  EXPECT_EQ(names.size(), 3u);
}

// A user's name may have all that ours have, but the checksum.
TEST_F(TextFile, TemporaryNamesAreTold) {
  for (const char* path : {"out/sweep.csv", "000001.rows", "no_extension", ".hidden", "a.b.c", "x-1-2.csv"}) {
    const std::string name = fs::path(temporary_name_beside(path)).filename().string();
    EXPECT_TRUE(is_temporary_name_beside(path, name)) << name;
    EXPECT_FALSE(is_temporary_name_beside("other.csv", name)) << name;
    for (std::size_t k = 0; k < name.size(); ++k) {
      std::string changed = name;
      changed[k] = changed[k] == '7' ? '8' : '7';
      if (changed == name) continue;
      EXPECT_FALSE(is_temporary_name_beside(path, changed)) << changed;
    }
  }
  for (const char* name : {".sweep.2026-11-25.tmp.csv", ".sweep.1-2-3.tmp.csv", ".sweep.1-2-3-4.tmp.csv",
                           ".sweep.-.tmp.csv", "sweep.csv", "", ".", "-", ".sweep."})
    EXPECT_FALSE(is_temporary_name_beside("sweep.csv", name)) << name;
}

TEST_F(TextFile, FoldersAreRefused) {
  EXPECT_TRUE(has(sentence([&] { read_file(folder_.string()); }), "it is a folder; expected a file"));
  EXPECT_TRUE(
      has(sentence([&] { write_file_atomically(folder_.string(), "x"); }), "it is a folder; expected"));
  EXPECT_EQ(entries(), 0u);
}

TEST_F(TextFile, APipeWithoutAWriterIsRefused) {
  const std::string path = pipe("pipe");
  EXPECT_TRUE(has(sentence([&] { read_file(path); }), "nothing writes to"));
}

TEST_F(TextFile, AWriterMayComeLaterAndTakeItsTime) {
  const std::string path = pipe("pipe");
  std::thread writer([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    std::ofstream to(path);
    std::this_thread::sleep_for(
        std::chrono::milliseconds(1300));  // longer than a pipe without writer is waited for
    to << "one" << std::flush;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    to << " two";
  });
  EXPECT_EQ(read_file(path), "one two");
  writer.join();
}

TEST_F(TextFile, WhatIsNoTextIsRefused) {
  EXPECT_TRUE(has(sentence([&] { read_file("/dev/zero"); }), "zero byte; expected a text file"));
  EXPECT_EQ(read_file("/dev/null"), "");
}

TEST(Errors, StandOnOneLine) {
  EXPECT_STREQ(ArgumentError("no joint \"a\nb\t\x7f\"").what(), "no joint \"a b  \"");
  EXPECT_STREQ(FileError(std::vector<std::string>{"f:1: \"a\r\nb\"", "f:2: c"}).what(),
               "f:1: \"a  b\"\nf:2: c");
}

}  // namespace
}  // namespace dyntape::text_file_test
