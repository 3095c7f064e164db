// SPDX-License-Identifier: BSD-3-Clause
//
// Disks that are full, read-only or not for programs, folders of others, what killed builds leave, and what users keep
// in the folder that they name as cache: work goes on, one sentence says why it is slower, and nobody's data is touched.
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/store/cache.h>
#include <dyntape/codegen/system/owners.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>

#include "compilers.h"

namespace dyntape::accidents_test {
namespace {

namespace fs = std::filesystem;
using codegen::Cache;
using testing::fake_compiler;
using testing::in_child;
using testing::Scratch;

constexpr uid_t kNobody = 65534;
constexpr int kNotAllowed = 77;

Function scaled(double c) {
  return record("scaled", 2,
                [c](const VectorXad& x) { return VectorXad::Constant(1, c * sin(x[0]) * x[1]).eval(); });
}

// Long enough that its library does not fit where its source does.
Function long_function() {
  return record("long", 2, [](const VectorXad& x) {
    AD sum = x[0];
    for (int i = 0; i < 100; ++i) sum = sin(sum * x[1] + 0.01 * i);
    return VectorXad::Constant(1, sum).eval();
  });
}

class Accidents : public ::testing::Test {
 protected:
  CodegenOptions options(const std::string& folder) const {
    CodegenOptions o;
    o.order = Order::kFirst;
    o.cache_folder = folder;
    return o;
  }
  CodegenOptions options() const { return options(scratch_ / "cache"); }
  Cache cache() const { return Cache::open(scratch_ / "cache").value(); }

  // 0: what it computes is right; and how it was made.
  int check(const Function& f, const CodegenOptions& o, Route expected) const {
    const auto c = CompiledFunction::make(f, o);
    const bool is_right = c.evaluate(Order::kValue, {0.5, 2.0}).y == evaluate(f, {0.5, 2.0});
    return is_right ? c.route() == expected ? 0 : 2 : 1;
  }

  // work(folder) in a file system of its own; kNotAllowed without root.
  template <class Work>
  int on_a_disk(const char* how, unsigned long flags, Work&& work) const {
    return in_child([&] {
      const std::string folder = scratch_ / "disk";
      fs::create_directory(folder);
      if (unshare(CLONE_NEWNS) != 0 || mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
          mount("tmpfs", folder.c_str(), "tmpfs", flags, how) != 0)
        return kNotAllowed;
      return work(folder);
    });
  }
  Scratch scratch_;
};

void make_old(const std::string& path) {
  const timespec past[2] = {{1000000, 0}, {1000000, 0}};
  utimensat(AT_FDCWD, path.c_str(), past, 0);
}

TEST_F(Accidents, WhatAUserKeepsInTheFolderIsLeftAlone) {
  const std::string folder = scratch_ / "cache", digest(32, 'a');
  fs::create_directory(folder);
  chmod(folder.c_str(), 0700);
  const std::vector<std::string> names = {
      "build-release", "build-",        "build-1-0", "removed-things", "removed-notes-20240101deadbeef",
      digest,          "dyntape-notes", "user-data"};
  for (const std::string& name : names) {
    fs::create_directory(folder + "/" + name);
    codegen::write_file(folder + "/" + name + "/manifest.json", "{\"schema\": 1}");
    make_old(folder + "/" + name);
  }
  const std::vector<std::string> files = {"compiler-notes.json", "compiler-.json", std::string(32, 'b'),
                                          "build-log"};
  for (const std::string& name : files) {
    codegen::write_file(folder + "/" + name, "mine");
    make_old(folder + "/" + name);
  }
  EXPECT_EQ(check(scaled(1), options(), Route::kCompiled), 0);
  EXPECT_EQ(cache().list().size(), 1u);
  EXPECT_EQ(cache().sweep(0), 1u);
  EXPECT_EQ(check(scaled(1), options(), Route::kCompiled), 0);
  EXPECT_EQ(cache().clear(), 1u);
  for (const std::string& name : names)
    EXPECT_TRUE(fs::exists(folder + "/" + name + "/manifest.json")) << name;
  for (const std::string& name : files) EXPECT_TRUE(fs::exists(folder + "/" + name)) << name;
}

std::vector<std::string> builds_in(const std::string& folder) {
  std::vector<std::string> builds;
  for (const std::string& name : codegen::names_in(folder)) {
    if (name.starts_with("build-") || name.starts_with("removed-")) builds.push_back(name);
  }
  return builds;
}

TEST_F(Accidents, WhatKilledBuildsLeaveIsSwept) {
  const std::string folder = cache().folder();
  const codegen::TemporaryFolder mine(folder, "build-");
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(in_child([&] {
                const codegen::TemporaryFolder build(folder, "build-");
                codegen::write_file(build.path() + "/source.c", "half");
                return kill(getpid(), SIGKILL);
              }),
              128 + SIGKILL);
  }
  EXPECT_EQ(builds_in(folder).size(), 6u);
  cache().sweep(~std::uint64_t{0});
  EXPECT_EQ(builds_in(folder), std::vector<std::string>{fs::path(mine.path()).filename()})
      << "one is at work";
}

TEST_F(Accidents, SourcesThatAPersonWasToldOfStayForADayAndWithinTheLimit) {
  CodegenOptions o = options();
  o.compiler = fake_compiler(scratch_, "exit 3");
  EXPECT_THROW(check(scaled(1), o, Route::kCompiled), ToolError);
  const std::string folder = cache().folder();
  EXPECT_EQ(builds_in(folder).size(), 1u);
  cache().sweep(~std::uint64_t{0});
  ASSERT_EQ(builds_in(folder).size(), 1u);
  make_old(folder + "/" + builds_in(folder)[0] + "/.dyntape");
  cache().sweep(~std::uint64_t{0});
  EXPECT_EQ(builds_in(folder).size(), 0u) << "a day later";
  EXPECT_THROW(check(scaled(1), o, Route::kCompiled), ToolError);
  cache().sweep(0);
  EXPECT_EQ(builds_in(folder).size(), 0u) << "over the limit";
}

TEST_F(Accidents, ALastSweepInTimesToComeCountsAsNone) {
  EXPECT_EQ(check(scaled(1), options(), Route::kCompiled), 0);
  const timespec future[2] = {{2208988800, 0}, {2208988800, 0}};  // 2040
  ASSERT_EQ(utimensat(AT_FDCWD, (cache().folder() + "/last-sweep").c_str(), future, 0), 0);
  setenv("DYNTAPE_CACHE_LIMIT", "1", 1);
  EXPECT_EQ(check(scaled(2), options(), Route::kCompiled), 0);
  unsetenv("DYNTAPE_CACHE_LIMIT");
  EXPECT_EQ(cache().list().size(), 0u);
}

TEST_F(Accidents, WhatStandsInThePlaceOfAnEntry) {
  CodegenOptions o = options();
  o.route = Route::kCompiled;
  EXPECT_EQ(check(scaled(1), o, Route::kCompiled), 0);
  const auto entry = cache().list().at(0);
  const auto huge = [](const std::string& path) { fs::resize_file(path, 3000000000u); };
  const auto fifo = [](const std::string& path) { fs::remove_all(path), mkfifo(path.c_str(), 0600); };
  const std::vector<std::pair<const char*, std::function<void()>>> things = {
      {"a FIFO", [&] { fifo(entry.folder); }},
      {"a FIFO as library", [&] { fifo(entry.library()); }},
      {"a FIFO as manifest", [&] { fifo(entry.folder + "/manifest.json"); }},
      {"3 GB of library", [&] { huge(entry.library()); }},
      {"3 GB of manifest", [&] { huge(entry.folder + "/manifest.json"); }},
      {"3 GB",
       [&] {
         fs::remove_all(entry.folder);
         codegen::write_file(entry.folder, "");
         huge(entry.folder);
       }},
  };
  for (const auto& [what, put] : things) {
    put();
    const auto before = std::chrono::steady_clock::now();
    EXPECT_EQ(check(scaled(1), o, Route::kCompiled), 0) << what;
    EXPECT_LT(std::chrono::steady_clock::now() - before, std::chrono::seconds(20)) << what;
    EXPECT_TRUE(CompiledFunction::make(scaled(1), o).timings().cache_hit) << what;
  }
}

// The size of a library, not its content, is what a sweep looks at.
TEST_F(Accidents, ASweepReadsNoLibrary) {
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(check(scaled(i + 1), options(), Route::kCompiled), 0);
  }
  for (const auto& entry : cache().list()) fs::resize_file(entry.library(), std::uint64_t{1} << 36);
  const auto before = std::chrono::steady_clock::now();
  EXPECT_EQ(cache().sweep(std::uint64_t{1} << 40), 0u);
  EXPECT_EQ(cache().sweep(std::uint64_t{1} << 37), 2u);
  EXPECT_LT(std::chrono::steady_clock::now() - before, std::chrono::seconds(2));
}

TEST_F(Accidents, FolderNamesThatTheLoaderReadsOtherwise) {
  for (const char* name : {"$ORIGIN", "${LIB}", "$LIB x", "a:b"}) {
    CodegenOptions o = options(scratch_ / name);
    o.route = Route::kCompiled;
    EXPECT_EQ(check(scaled(1), o, Route::kCompiled), 0) << name;
    EXPECT_TRUE(CompiledFunction::make(scaled(1), o).timings().cache_hit) << name;
  }
}

TEST_F(Accidents, TemporaryFoldersThatAreMissing) {
  const char* before = std::getenv("TMPDIR");
  const std::string kept = before ? before : "/tmp";
  setenv("TMPDIR", (scratch_ / "nowhere").c_str(), 1);
  CodegenOptions o = options();
  o.use_cache = false;
  ::testing::internal::CaptureStderr();
  EXPECT_EQ(check(scaled(3), o, Route::kCompiled), 0);
  setenv("TMPDIR", kept.c_str(), 1);
  EXPECT_NE(::testing::internal::GetCapturedStderr().find("TMPDIR is not used, /tmp is: "),
            std::string::npos);
}

// Every killed build of a container has the number 1.
TEST_F(Accidents, ProcessesOfTheSameNumber) {
  const std::string folder = cache().folder();
  const auto leave_one = [&] {
    if (unshare(CLONE_NEWPID) != 0) return kNotAllowed;
    return in_child([&] { return codegen::TemporaryFolder(folder, "build-").release(), 0; });
  };
  for (int i = 0; i < 120; ++i) {
    const int status = in_child(leave_one);
    if (status == kNotAllowed) GTEST_SKIP() << "process namespaces are not allowed here";
    ASSERT_EQ(status, 0) << i;
  }
}

TEST_F(Accidents, AFullDisk) {
  // The source fits and the library does not; the source does not; and nothing at all fits.
  for (const char* size : {"size=72k", "size=40k", "size=8k"}) {
    const int status = on_a_disk(size, 0, [&](const std::string& disk) {
      const int found = check(long_function(), options(disk), Route::kCompiled);
      return found ? found : builds_in(disk).empty() ? 0 : 3;
    });
    if (status == kNotAllowed) GTEST_SKIP() << "mounting is not allowed here";
    EXPECT_EQ(status, 0) << size;
  }
}

// Somebody clears the cache by hand while a compiler works in it: another folder will do.
TEST_F(Accidents, AFolderThatIsRemovedWhileACompilerIsAtWork) {
  CodegenOptions o = options();
  o.route = Route::kCompiled;
  o.compiler = fake_compiler(scratch_, "rm -rf " + (scratch_ / "cache") + "\nexec cc \"$@\"");
  EXPECT_EQ(check(scaled(1), o, Route::kCompiled), 0);
}

TEST_F(Accidents, EveryDiskFull) {
  const int status = on_a_disk("size=72k", 0, [&](const std::string& disk) {
    fs::create_directory(disk + "/tmp");
    setenv("TMPDIR", (disk + "/tmp").c_str(), 1);
    CodegenOptions o = options(disk);
    const int found = check(long_function(), o, testing::without_compiler());
    o.route = Route::kCompiled;
    try {
      check(long_function(), o, Route::kCompiled);
    } catch (const ToolError& e) {
      const std::string message = e.what();
      const bool is_clear = message.find("the disk is full") != std::string::npos ||
                            message.find("No space left on device") != std::string::npos;
      return is_clear ? found : 5;
    }
    return 4;
  });
  if (status == kNotAllowed) GTEST_SKIP() << "mounting is not allowed here";
  EXPECT_EQ(status, 0);
}

TEST_F(Accidents, ADiskThatProgramsMayNotBeRunFrom) {
  const int status = on_a_disk("size=10m", MS_NOEXEC, [&](const std::string& disk) {
    fs::create_directory(disk + "/tmp");
    setenv("TMPDIR", (disk + "/tmp").c_str(), 1);
    const CodegenOptions o = options(disk);
    if (const int found = check(scaled(1), o, Route::kCompiled)) return found;
    return CompiledFunction::make(scaled(1), o).timings().cache_hit ? 0 : 3;
  });
  if (status == kNotAllowed) GTEST_SKIP() << "mounting is not allowed here";
  EXPECT_EQ(status, 0);
}

TEST_F(Accidents, AReadOnlyCache) {
  const int status = on_a_disk("size=10m", 0, [&](const std::string& disk) {
    const CodegenOptions o = options(disk);
    if (const int found = check(scaled(1), o, Route::kCompiled)) return found;
    if (mount("tmpfs", disk.c_str(), "tmpfs", MS_REMOUNT | MS_RDONLY, "size=10m") != 0) return kNotAllowed;
    if (!CompiledFunction::make(scaled(1), o).timings().cache_hit) return 3;
    if (const int found = check(scaled(2), o, Route::kCompiled)) return found;
    try {
      Cache::open(disk)->clear();
    } catch (const FileError& e) {
      return std::string(e.what()).find("cannot be removed: Read-only") == std::string::npos ? 4 : 0;
    }
    return 5;
  });
  if (status == kNotAllowed) GTEST_SKIP() << "mounting is not allowed here";
  EXPECT_EQ(status, 0);
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // which take more addresses than that
TEST_F(Accidents, AProcessWithLittleMemory) {
  if (geteuid() != 0) GTEST_SKIP() << "root may raise its limits, and others cannot be tried without root";
  for (const std::size_t megabytes : {4000u, 30u}) {
    const int status = in_child([&] {
      setenv("TMPDIR", "/tmp", 1);
      const Function f = scaled(1);
      if (setgid(kNobody) != 0 || setuid(kNobody) != 0) return kNotAllowed;
      const Scratch own;
      const rlimit limit{megabytes << 20, megabytes << 20};
      setrlimit(RLIMIT_AS, &limit);
      return check(f, options(own / "cache"), Route::kCompiled);
    });
    EXPECT_TRUE(status == 0 || (megabytes == 30 && status == 2)) << megabytes << ": " << status;
  }
}

#endif

// --- folders of others ---

TEST_F(Accidents, FoldersThatOthersCouldExchange) {
  const std::string above = scratch_ / "above", folder = above + "/cache";
  fs::create_directories(folder);
  chmod(folder.c_str(), 0700);
  const auto reason = [&] {
    ::testing::internal::CaptureStderr();
    const bool is_open = Cache::open(folder).has_value();
    const std::string said = ::testing::internal::GetCapturedStderr();
    return is_open ? "open" : said;
  };
  EXPECT_EQ(reason(), "open");
  chmod(above.c_str(), 0770);
  EXPECT_NE(reason().find("above may be written by others"), std::string::npos);
  EXPECT_EQ(check(scaled(1), options(folder), Route::kCompiled), 0);
  EXPECT_TRUE(fs::is_empty(folder));
  chmod(above.c_str(), 01777);
  EXPECT_EQ(reason(), "open") << "the sticky bit keeps others off";
  chmod(above.c_str(), 0755);
  if (geteuid() != 0) return;
  ASSERT_EQ(chown(above.c_str(), kNobody, kNobody), 0);
  EXPECT_NE(reason().find("above belongs to user 65534, not to this one or to root"), std::string::npos);
  chmod(above.c_str(), 01777);
  EXPECT_FALSE(Cache::open(above)) << "a shared folder of another";
  EXPECT_FALSE(Cache::open(above + "/new"));
  setenv("TMPDIR", above.c_str(), 1);
  EXPECT_EQ(codegen::system_temporary_folder(), "/tmp");
  unsetenv("TMPDIR");
}

TEST_F(Accidents, FoldersAreMadeForNobodyElse) {
  const mode_t before = umask(0);
  EXPECT_EQ(check(scaled(1), options(scratch_ / "a/b/cache"), Route::kCompiled), 0);
  umask(before);
  EXPECT_EQ(fs::status(scratch_ / "a").permissions(), fs::perms::owner_all);
  EXPECT_EQ(Cache::open(scratch_ / "a/b/cache")->list().size(), 1u);
}

}  // namespace
}  // namespace dyntape::accidents_test
