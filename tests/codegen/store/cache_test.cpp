// SPDX-License-Identifier: BSD-3-Clause
//
// The cache: hits, misses, and accidents.
#include <dyntape/codegen/store/cache.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <thread>

#include "codegen/compilers.h"

namespace dyntape::cache_test {
namespace {

namespace fs = std::filesystem;
using codegen::Cache;
using codegen::Entry;
using codegen::Fault;
using testing::Scratch;

Function with_constant(double c) {
  return record("scaled", 2,
                [c](const VectorXad& x) { return VectorXad::Constant(1, c * sin(x[0]) * x[1]).eval(); });
}

class CacheFolder : public ::testing::Test {
 protected:
  CodegenOptions options() const {
    CodegenOptions o;
    o.order = Order::kFirst;
    o.route = Route::kCompiled;
    o.cache_folder = scratch_ / "cache";
    return o;
  }
  Cache cache() const { return Cache::open(scratch_ / "cache").value(); }
  Entry only_entry() const {
    const auto entries = cache().list();
    EXPECT_EQ(entries.size(), 1u);
    return entries.at(0);
  }
  // Makes it, looks whether it was compiled, and whether it computes what it should.
  void expect(bool hit, const Function& f, const CodegenOptions& o, const std::string& why) const {
    const CompiledFunction c = CompiledFunction::make(f, o);
    EXPECT_EQ(c.timings().cache_hit, hit) << why;
    EXPECT_EQ(c.timings().compile == 0, hit) << why;
    EXPECT_EQ(c.evaluate(Order::kValue, {0.5, 2.0}).y, evaluate(f, {0.5, 2.0})) << why;
  }
  std::vector<std::string> files_of(const std::string& folder) const {
    std::vector<std::string> names;
    for (const auto& file : fs::directory_iterator(folder)) names.push_back(file.path().filename());
    std::sort(names.begin(), names.end());
    return names;
  }

  Scratch scratch_;
};

TEST_F(CacheFolder, TheSameGraphIsCompiledOnce) {
  expect(false, with_constant(0.1), options(), "first time");
  expect(true, with_constant(0.1), options(), "second time");
  Function renamed = with_constant(0.1);
  renamed.name = "another name";
  expect(true, renamed, options(), "a name is a label");
  const Entry entry = only_entry();
  EXPECT_EQ(files_of(entry.folder), (std::vector<std::string>{"library.so", "manifest.json", "source.c"}));
  EXPECT_EQ(cache().verify(fs::path(entry.folder).filename()).reason, "");
  EXPECT_EQ(CompiledFunction::make(renamed, options()).source_path(), entry.source());
  struct stat status {};
  ASSERT_EQ(stat(cache().folder().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0700u);
}

TEST_F(CacheFolder, WhatDecidesTheLibraryEntersTheKey) {
  const double c = 0.1;
  expect(false, with_constant(c), options(), "first time");
  expect(false, with_constant(std::nextafter(c, 1.0)), options(), "a constant changed in its last bit");
  CodegenOptions o = options();
  o.order = Order::kSecond;
  expect(false, with_constant(c), o, "another order");
  o = options();
  o.flags = {"-O3"};
  expect(false, with_constant(c), o, "another flag");
  o.flags = {"-DNAME=1"};
  expect(false, with_constant(c), o, "a definition");
  o = options();
  o.flags = {testing::kOldProcessor};
  expect(false, with_constant(c), o, "another processor");
  o = options();
  o.piece_statements = 4;
  expect(false, with_constant(c), o, "cut otherwise");
  if (!codegen::in_path("clang").empty()) {
    o = options();
    o.compiler = "clang";
    expect(false, with_constant(c), o, "another compiler");
    expect(true, with_constant(c), o, "the same again");
  }
  expect(true, with_constant(c), options(), "the first is still there");
}

TEST_F(CacheFolder, ForceRebuildCompilesAnyway) {
  expect(false, with_constant(1), options(), "first time");
  const auto before = fs::last_write_time(only_entry().source());
  CodegenOptions o = options();
  o.force_rebuild = true;
  expect(false, with_constant(1), o, "forced");
  EXPECT_NE(fs::last_write_time(only_entry().source()), before);
  expect(true, with_constant(1), options(), "afterwards");
}

TEST_F(CacheFolder, WhatACompilerHasLeftServesWithoutIt) {
  CodegenOptions o = options();
  o.compiler = scratch_ / "cc";
  fs::create_symlink(codegen::in_path("cc"), o.compiler);
  expect(false, with_constant(0.1), o, "compiled");
  fs::remove(o.compiler);
  expect(true, with_constant(0.1), o, "found without its compiler");
  o.flags = {"-O2"};
  EXPECT_THROW(CompiledFunction::make(with_constant(0.1), o), ToolError) << "other flags";
  o.flags.clear();
  EXPECT_THROW(CompiledFunction::make(with_constant(0.2), o), ToolError) << "another function";
  o.compiler = scratch_ / "another-cc";
  EXPECT_THROW(CompiledFunction::make(with_constant(0.1), o), ToolError) << "another compiler";
  o.compiler = scratch_ / "cc";
  o.only_cached = true;
  expect(true, with_constant(0.1), o, "looked for");
}

TEST_F(CacheFolder, DamagedEntriesAreBuiltAgain) {
  const Function f = with_constant(2);
  expect(false, f, options(), "first time");
  const Entry entry = only_entry();
  // Each damage leaves a new file, as a half-finished copy does: the old one may still be loaded.
  const auto rewrite = [](const std::string& path, const std::string& text) {
    fs::remove(path);
    codegen::write_file(path, text);
  };
  int error = 0;
  const std::string library = codegen::read_file(entry.library(), error).value(),
                    manifest = codegen::read_file(entry.folder + "/manifest.json", error).value();
  const std::vector<std::pair<std::string, std::function<void()>>> damages = {
      {"truncated", [&] { rewrite(entry.library(), library.substr(0, library.size() / 2)); }},
      {"empty", [&] { rewrite(entry.library(), ""); }},
      {"one bit",
       [&] {
         auto text = library;
         text[text.size() / 2] ^= 1;
         rewrite(entry.library(), text);
       }},
      {"missing", [&] { fs::remove(entry.library()); }},
      {"manifest truncated", [&] { rewrite(entry.folder + "/manifest.json", manifest.substr(0, 20)); }},
      {"manifest missing", [&] { fs::remove(entry.folder + "/manifest.json"); }},
      {"manifest of another type",
       [&] { rewrite(entry.folder + "/manifest.json", "{\"schema\": \"x\", \"key\": 3}"); }},
      {"a file in its place",
       [&] {
         fs::remove_all(entry.folder);
         codegen::write_file(entry.folder, "x");
       }},
      {"an empty folder",
       [&] {
         fs::remove_all(entry.folder + "/library.so");
         fs::remove_all(entry.folder + "/source.c");
         fs::remove_all(entry.folder + "/manifest.json");
       }},
      {"a link",
       [&] {
         fs::remove(entry.library());
         fs::create_symlink("/dev/null", entry.library());
       }},
  };
  for (const auto& [what, damage] : damages) {
    damage();
    EXPECT_NE(cache().verify(fs::path(entry.folder).filename()).reason, "") << what;
    expect(false, f, options(), what);
    expect(true, f, options(), what + ", afterwards");
  }
  EXPECT_EQ(cache().list().size(), 1u);
}

TEST_F(CacheFolder, AForeignLibraryIsRefusedAndReplaced) {
  const Function f = with_constant(3), other = with_constant(4);
  expect(false, f, options(), "first time");
  const Entry entry = only_entry();
  CodegenOptions elsewhere = options();
  elsewhere.cache_folder = scratch_ / "other";
  expect(false, other, elsewhere, "first time");
  const Entry foreign = Cache::open(scratch_ / "other")->list().at(0);
  // As if somebody had copied a library over another, checksum and all.
  const auto manifest_of = [](const Entry& e) {
    int error = 0;
    return codegen::read_file(e.folder + "/manifest.json", error).value();
  };
  fs::remove(entry.library());
  fs::copy_file(foreign.library(), entry.library());
  expect(false, f, options(), "another library");
  expect(true, f, options(), "afterwards");

  std::string manifest = manifest_of(entry);
  for (const char* field : {"library_bytes", "library_checksum"}) {
    const auto line_of = [&](const std::string& text) {
      const std::size_t at = text.find("\"" + std::string(field));
      return std::pair(at, text.find('\n', at) - at);
    };
    const std::string theirs = manifest_of(foreign);
    const auto [to, length] = line_of(manifest);
    const auto [from, size] = line_of(theirs);
    manifest.replace(to, length, theirs.substr(from, size));
  }
  fs::remove(entry.library());
  fs::copy_file(foreign.library(), entry.library());
  codegen::write_file(entry.folder + "/manifest.json", manifest);
  expect(false, f, options(), "another library with its checksum");
  expect(true, f, options(), "afterwards");
}

TEST_F(CacheFolder, ProcessesMayRace) {
  const Function f = with_constant(5);
  std::vector<pid_t> children;
  for (int i = 0; i < 4; ++i) {
    const pid_t child = fork();
    if (child == 0) {
      const CompiledFunction c = CompiledFunction::make(f, options());
      _exit(c.evaluate(Order::kValue, {0.5, 2.0}).y == evaluate(f, {0.5, 2.0}) ? 0 : 1);
    }
    children.push_back(child);
  }
  for (pid_t child : children) {
    int status = -1;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_EQ(status, 0);
  }
  expect(true, f, options(), "afterwards");
  for (const std::string& name : files_of(cache().folder())) EXPECT_FALSE(name.starts_with("build-")) << name;
  EXPECT_EQ(cache().list().size(), 1u);
}

TEST_F(CacheFolder, ThreadsMayRace) {
  std::vector<std::thread> threads;
  std::vector<int> wrong(6, 1);
  for (std::size_t i = 0; i < wrong.size(); ++i) {
    threads.emplace_back([&, i] {
      const Function f = with_constant(50 + double(i % 3));
      const CompiledFunction c = CompiledFunction::make(f, options());
      wrong[i] = c.evaluate(Order::kValue, {0.5, 2.0}).y != evaluate(f, {0.5, 2.0});
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, std::vector<int>(6, 0));
  EXPECT_EQ(cache().list().size(), 3u);
}

TEST_F(CacheFolder, WithoutAUsableFolderItWorksAndSaysSoOnce) {
  codegen::write_file(scratch_ / "file", "");
  CodegenOptions o = options();
  for (const char* folder : {"file", "file/below"}) {
    o.cache_folder = scratch_ / folder;
    ::testing::internal::CaptureStderr();
    expect(false, with_constant(6), o, "no folder");
    EXPECT_NE(::testing::internal::GetCapturedStderr().find("compiled derivatives are not kept"),
              std::string::npos);
    ::testing::internal::CaptureStderr();
    expect(false, with_constant(6), o, "no folder, again");
    EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  }
  EXPECT_EQ(fs::file_size(scratch_ / "file"), 0u);
}

TEST_F(CacheFolder, InASharedFolderEachUserHasAPrivateOne) {
  const std::string shared = scratch_ / "cache";
  fs::create_directory(shared);
  ASSERT_EQ(chmod(shared.c_str(), 01777), 0);
  expect(false, with_constant(7), options(), "first time");
  expect(true, with_constant(7), options(), "second time");
  const std::string own = cache().folder();
  EXPECT_EQ(own, fs::canonical(shared).string() + "/user-" + std::to_string(geteuid()));
  // If somebody else may write there too, nothing is loaded from it.
  ASSERT_EQ(chmod(own.c_str(), 0777), 0);
  EXPECT_FALSE(Cache::open(shared));
  expect(false, with_constant(7), options(), "private folder open to others");
}

TEST_F(CacheFolder, EntriesThatOthersMayWriteAreRefused) {
  const Function f = with_constant(8);
  expect(false, f, options(), "first time");
  const Entry entry = only_entry();
  for (const std::string& path : {entry.folder, entry.library(), entry.folder + "/manifest.json"}) {
    struct stat status {};
    ASSERT_EQ(stat(path.c_str(), &status), 0);
    ASSERT_EQ(chmod(path.c_str(), status.st_mode | 0022), 0);
    EXPECT_EQ(cache().verify(fs::path(entry.folder).filename()).fault, Fault::kRefused) << path;
    ASSERT_EQ(chmod(path.c_str(), status.st_mode & 07777), 0);
  }
  ASSERT_EQ(chmod(entry.folder.c_str(), 0777), 0);
  expect(false, f, options(), "open to others: compiled again");
  if (geteuid() == 0) {  // another owner
    const Function g = with_constant(9);
    expect(false, g, options(), "first time");
    const std::string path = CompiledFunction::make(g, options()).source_path();
    const std::string folder = fs::path(path).parent_path();
    ASSERT_EQ(chown(folder.c_str(), 65534, 65534), 0);
    EXPECT_EQ(cache().verify(fs::path(folder).filename()).fault, Fault::kRefused);
    expect(false, g, options(), "another owner");
    EXPECT_TRUE(fs::exists(folder)) << "what belongs to somebody else is left alone";
  }
}

TEST_F(CacheFolder, TheLongestUnusedGoFirst) {
  std::vector<std::string> folders;
  for (int i = 0; i < 3; ++i) {
    const Function f = with_constant(10 + i);
    expect(false, f, options(), "first time");
    folders.push_back(fs::path(CompiledFunction::make(f, options()).source_path()).parent_path());
    const timespec age[2] = {{1000000 + i, 0}, {1000000 + i, 0}};
    ASSERT_EQ(utimensat(AT_FDCWD, (folders.back() + "/manifest.json").c_str(), age, 0), 0);
  }
  expect(true, with_constant(10), options(), "the oldest is used");
  const auto entries = cache().list();
  ASSERT_EQ(entries.size(), 3u);
  std::uint64_t total = 0;
  for (const Entry& entry : entries) total += entry.bytes;
  EXPECT_EQ(cache().sweep(total), 0u);
  EXPECT_EQ(cache().sweep(total - 1), 1u);
  EXPECT_FALSE(fs::exists(folders[1]));
  EXPECT_TRUE(fs::exists(folders[0]) && fs::exists(folders[2]));
  EXPECT_EQ(cache().sweep(0), 2u);
}

TEST_F(CacheFolder, TheLimitIsKeptAtMostOnceAnHour) {
  setenv("DYNTAPE_CACHE_LIMIT", "1", 1);
  expect(false, with_constant(20), options(), "first time");
  EXPECT_EQ(cache().list().size(), 0u) << "swept when it was published";
  expect(false, with_constant(20), options(), "swept away, so compiled again");
  EXPECT_EQ(cache().list().size(), 1u) << "no second sweep within the hour";
  const timespec past[2] = {{1000000, 0}, {1000000, 0}};
  ASSERT_EQ(utimensat(AT_FDCWD, (cache().folder() + "/last-sweep").c_str(), past, 0), 0);
  expect(false, with_constant(21), options(), "first time");
  EXPECT_EQ(cache().list().size(), 0u);
  setenv("DYNTAPE_CACHE_LIMIT", "500M", 1);
  EXPECT_EQ(codegen::cache_limit(), std::uint64_t{500} << 20);
  setenv("DYNTAPE_CACHE_LIMIT", "much", 1);
  EXPECT_THROW(codegen::cache_limit(), ArgumentError);
  unsetenv("DYNTAPE_CACHE_LIMIT");
}

TEST_F(CacheFolder, ListVerifyClear) {
  expect(false, with_constant(30), options(), "first time");
  expect(false, with_constant(31), options(), "first time");
  for (const Entry& entry : cache().list()) {
    EXPECT_EQ(entry.manifest.name, "scaled");
    EXPECT_EQ(entry.manifest.order, 1);
    EXPECT_NE(entry.manifest.compiler.find("version"), std::string::npos);
    EXPECT_GT(entry.bytes, 5000u);
    EXPECT_EQ(cache().verify(fs::path(entry.folder).filename()).fault, Fault::kNone);
  }
  std::ofstream(cache().list()[0].source(), std::ios::app) << " ";
  EXPECT_EQ(cache().verify(fs::path(cache().list()[0].folder).filename()).fault, Fault::kContent);
  EXPECT_EQ(cache().verify(std::string(32, '0')).fault, Fault::kMissing);
  EXPECT_EQ(cache().clear(), 2u);
  EXPECT_TRUE(cache().list().empty());
}

TEST_F(CacheFolder, TheUsualPlaceIsChosenByTheEnvironment) {
  const auto with = [](const char* dyntape, const char* xdg, const char* home) {
    for (const auto& [name, value] :
         {std::pair("DYNTAPE_CACHE", dyntape), std::pair("XDG_CACHE_HOME", xdg), std::pair("HOME", home)})
      value ? setenv(name, value, 1) : unsetenv(name);
    return Cache::usual_folder();
  };
  const char* home = std::getenv("HOME");
  const std::string before = home ? home : "/";
  EXPECT_EQ(with("/a", "/b", "/c"), "/a");
  EXPECT_EQ(with(nullptr, "/b", "/c"), "/b/dyntape");
  EXPECT_EQ(with(nullptr, "relative", "/c"), "/c/.cache/dyntape");
  EXPECT_EQ(with(nullptr, nullptr, "/c"), "/c/.cache/dyntape");
  EXPECT_EQ(with(nullptr, nullptr, nullptr), "");
  setenv("HOME", before.c_str(), 1);
}

}  // namespace
}  // namespace dyntape::cache_test
