// SPDX-License-Identifier: BSD-3-Clause
//
// Folders that are exchanged while libraries are loaded from them: nothing runs but what was checked.
//
// A thousand times each: a second user exchanges folders below one of his own while root opens a cache there; and a process
// of the same user exchanges a sound entry for one whose library it has replaced.  The foreign library makes a file as
// soon as it is loaded.  Needs root and a compiler; without, it is skipped (exit status 77).
#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/store/cache.h>
#include <dyntape/codegen/store/library.h>
#include <dyntape/codegen/system/process.h>

namespace dyntape {
namespace {

namespace fs = std::filesystem;
using codegen::Cache;
using codegen::Library;

constexpr uid_t kNobody = 65534;
constexpr int kTimes = 1000, kSkipped = 77;

Function sine() {
  return record("f", 1, [](const VectorXad& x) { return VectorXad::Constant(1, sin(x[0])).eval(); });
}

void demand(bool holds, const char* what) {
  if (!holds) throw Error(what);
}

// Two caches with an entry of the same function; the library of the second makes a file when it is loaded.
struct Scene {
  std::string sound, foreign, marker, digest;

  explicit Scene(const std::string& folder)
      : sound(folder + "/sound"), foreign(folder + "/foreign"), marker(folder + "/foreign-code-ran") {
    CodegenOptions options;
    options.route = Route::kCompiled;
    for (const std::string& cache : {sound, foreign}) {
      options.cache_folder = cache;
      CompiledFunction::make(sine(), options);
    }
    digest = fs::path(Cache::open(sound)->list().at(0).folder).filename();
    const std::string source = folder + "/foreign.c", library = foreign + "/" + digest + "/library.so";
    codegen::write_file(
        source, "#include <fcntl.h>\n__attribute__((constructor)) static void run(void) {\n  open(\"" +
                    marker + "\", O_CREAT | O_WRONLY, 0600);\n}\n");
    fs::remove(library);
    const auto cc =
        codegen::run_all({{{"/usr/bin/cc", "-shared", "-fPIC", "-o", library, source}, "", ""}}, {})[0];
    demand(cc.status == 0, cc.output.c_str());
  }
  bool foreign_code_ran() const { return fs::exists(marker); }
};

// A process of that user that exchanges two folders for as long as this lives.
class Exchanging {
 public:
  Exchanging(uid_t user, const std::string& a, const std::string& b) : child_(fork()) {
    if (child_ != 0) return;
    if (setgid(user) != 0 || setuid(user) != 0) _exit(1);
    for (;;) renameat2(AT_FDCWD, a.c_str(), AT_FDCWD, b.c_str(), RENAME_EXCHANGE);
  }
  ~Exchanging() {
    kill(child_, SIGKILL);
    waitpid(child_, nullptr, 0);
  }

 private:
  pid_t child_;
};

// Below a folder of the second user no cache is opened, and what is asked for is compiled elsewhere.
void exchanged_by_another_user(const std::string& folder, const Scene& scene) {
  const std::string below = folder + "/of-another";
  for (const auto& [from, to] : {std::pair(scene.sound, "/cache"), std::pair(scene.foreign, "/other")})
    fs::copy(from, below + to, fs::copy_options::recursive),
        fs::permissions(below + to, fs::perms::owner_all);
  demand(chown(below.c_str(), kNobody, kNobody) == 0, "chown");
  const Exchanging attack(kNobody, below + "/cache", below + "/other");
  for (int i = 0; i < kTimes; ++i)
    demand(!Cache::open(below + "/cache"), "a folder of another user was accepted");
  CodegenOptions options;
  options.cache_folder = below + "/cache";
  const auto f = CompiledFunction::make(sine(), options);
  demand(f.evaluate(Order::kValue, {0.5}).y == evaluate(sine(), {0.5}), "the value is wrong");
}

// What was checked is what is loaded, whatever lies at the path the next moment.
void exchanged_by_this_user(const Scene& scene) {
  const std::string content = content_hash(compact(sine())), entry_folder = scene.sound + "/" + scene.digest;
  int loaded = 0, refused = 0;
  const Exchanging attack(geteuid(), entry_folder, scene.foreign + "/" + scene.digest);
  for (int i = 0; i < kTimes || (loaded < 10 || refused < 10); ++i) {
    demand(i < 1000 * kTimes, "the folders were not exchanged");
    codegen::Entry entry;
    const auto verdict = codegen::check_entry(entry_folder, scene.digest, entry, &entry.image);
    if (verdict.fault == codegen::Fault::kNone) Library::load(entry.image, entry.library(), content);
    ++(verdict.fault == codegen::Fault::kNone ? loaded : refused);
  }
  std::printf("%d sound libraries loaded, %d foreign ones refused\n", loaded, refused);
}

void run() {
  const codegen::TemporaryFolder folder(codegen::system_temporary_folder(), "dyntape-exchange-");
  fs::permissions(folder.path(), fs::perms(0755));
  fs::create_directory(folder.path() + "/of-another");
  const Scene scene(folder.path());
  exchanged_by_another_user(folder.path(), scene);
  exchanged_by_this_user(scene);
  demand(!scene.foreign_code_ran(), "foreign code ran");
  // And the trap is one, wherever the last exchange has left it.
  for (const std::string& cache : {scene.sound, scene.foreign}) {
    try {
      Library::load(cache + "/" + scene.digest + "/library.so", "");
    } catch (const ToolError&) {
    }
  }
  demand(scene.foreign_code_ran(), "the foreign library does not tell that it is loaded");
}

}  // namespace
}  // namespace dyntape

int main() {
  if (geteuid() != 0) return std::puts("needs root"), dyntape::kSkipped;
  try {
    dyntape::run();
  } catch (const std::exception& e) {
    return std::fprintf(stderr, "exchange: %s\n", e.what()), 1;
  }
  return 0;
}
