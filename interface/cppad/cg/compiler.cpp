// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/cg/compiler.h>

#include <dlfcn.h>

#include <filesystem>
#include <iostream>
#include <sstream>

#include <dyntape/autodiff/text_file.h>
#include <dyntape/codegen/build/compile.h>
#include <dyntape/codegen/system/files.h>
#include <dyntape/codegen/system/process.h>
#include <dyntape/interface/cppad/cg/dll_lib.h>

namespace CppAD::inline dyntape_names::cg {

using namespace dyntape;
namespace files = std::filesystem;

namespace {

void run_compiler(const std::string& name, const std::vector<std::string>& arguments) {
  const auto compiler = codegen::find_compiler(name, {});
  if (!compiler) throw ToolError(codegen::no_compiler(name));
  system::callExecutable(compiler->path, arguments);
}

}  // namespace

std::string system::getWorkingDirectory() { return files::current_path().string(); }

std::string system::createPath(std::initializer_list<std::string> folders, const std::string& file) {
  files::path path;
  for (const std::string& folder : folders) path /= folder;
  return (path / file).string();
}

void system::callExecutable(const std::string& executable, const std::vector<std::string>& arguments) {
  std::vector<std::string> command = arguments;
  command.insert(command.begin(), executable);
  const auto done = codegen::run_all({{command, "", ""}}, {});
  if (done[0].status != 0)
    throw ToolError("`" + codegen::to_text(command) + "` ends with status " + std::to_string(done[0].status) +
                    ": " + done[0].output);
}

std::string readStringFromFile(const std::string& path) { return read_file(path); }

void CompilerOfC::compileSources(const std::map<std::string, std::string>& sources,
                                 bool position_independent) {
  for (const auto& [name, text] : sources) {
    if (verbose_) std::cout << "compiling " << name << std::endl;
    const files::path file = files::path(saves_ ? sources_ : temporary_) / name,
                      object = files::path(temporary_) / (name + ".o");
    files::create_directories(file.parent_path());
    files::create_directories(object.parent_path());
    codegen::write_file(file.string(), text);
    std::vector<std::string> arguments = {"-x", "c"};
    arguments.insert(arguments.end(), flags_.begin(), flags_.end());
    if (position_independent) arguments.push_back("-fPIC");
    arguments.insert(arguments.end(), {"-c", file.string(), "-o", object.string()});
    run_compiler(path_, arguments);
    names_.insert(name), objects_.insert(object.string());
    if (!saves_) files::remove(file);
  }
}

void CompilerOfC::buildDynamic(const std::string& library) {
  std::vector<std::string> arguments = library_flags_;
  for (const std::string& flag : link_flags_) arguments.push_back("-Wl," + flag);
  arguments.insert(arguments.end(), {"-o", library});
  arguments.insert(arguments.end(), objects_.begin(), objects_.end());
  arguments.push_back("-lm");
  if (const auto folder = files::path(library).parent_path(); !folder.empty())
    files::create_directories(folder);
  run_compiler(path_, arguments);
}

void CompilerOfC::cleanup() {
  std::error_code ignored;
  for (const std::string& object : objects_) files::remove(object, ignored);
  if (!objects_.empty()) files::remove(temporary_, ignored);  // where it is empty now
  objects_.clear(), names_.clear();
}

}  // namespace CppAD::inline dyntape_names::cg

namespace CppAD::inline dyntape_names {

namespace {

using CommandWords = std::vector<std::string>;

void run_command(const std::map<std::string, std::string>& options, const std::string& step,
                 const std::string& usual, const CommandWords& more) {
  const auto given = options.find(step);
  std::istringstream words(given == options.end() ? usual : given->second);
  CommandWords arguments;
  for (std::string word; words >> word;) arguments.push_back(word);
  if (arguments.empty()) throw dyntape::ArgumentError("create_dll_lib: the command to " + step + " is empty");
  const std::string program = arguments[0];
  arguments.erase(arguments.begin());
  arguments.insert(arguments.end(), more.begin(), more.end());
  cg::run_compiler(program, arguments);
}

}  // namespace

std::string detail::make_library(const std::string& library, const CommandWords& sources,
                                 const std::map<std::string, std::string>& options) {
  CommandWords objects;
  std::string wrong;
  try {
    for (const std::string& source : sources) {
      objects.push_back(library + "." + std::to_string(objects.size()) + ".o");
      run_command(options, "compile", "gcc -c -fPIC -O2", {source, "-o", objects.back()});
    }
    CommandWords arguments = {"-o", library};
    arguments.insert(arguments.end(), objects.begin(), objects.end());
    arguments.push_back("-lm");
    run_command(options, "link", "gcc -shared", arguments);
  } catch (const dyntape::Error& error) {
    wrong = std::string("create_dll_lib: \"") + library + "\": " + error.what();
  }
  std::error_code ignored;
  for (const std::string& object : objects) std::filesystem::remove(object, ignored);
  return wrong;
}

link_dll_lib::link_dll_lib(const std::string& library, std::string& error)
    : path_(library),
      handle_(dlopen(library.find('/') == std::string::npos ? ("./" + library).c_str() : library.c_str(),
                     RTLD_NOW),
              [](void* handle) {
                if (handle) dlclose(handle);
              }) {
  error = handle_ ? "" : "link_dll_lib: \"" + library + "\" is not loaded: " + dlerror();
}

void* link_dll_lib::operator()(const std::string& function, std::string& error) const {
  void* const found = handle_ ? dlsym(handle_.get(), function.c_str()) : nullptr;
  error = found ? "" : "link_dll_lib: \"" + path_ + "\" has no function \"" + function + "\"";
  return found;
}

}  // namespace CppAD::inline dyntape_names
