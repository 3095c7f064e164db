// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/cg/compiler.h>

#include <filesystem>
#include <iostream>

#include <dyntape/codegen/build/compile.h>
#include <dyntape/codegen/system/files.h>
#include <dyntape/codegen/system/process.h>

namespace CppAD::inline dyntape_names::cg {

using namespace dyntape;
namespace files = std::filesystem;

namespace {

void run_compiler(const std::string& name, std::vector<std::string> arguments) {
  const auto compiler = codegen::find_compiler(name, {});
  if (!compiler) throw ToolError(codegen::no_compiler(name));
  arguments.insert(arguments.begin(), compiler->path);
  const auto done = codegen::run_all({{arguments, "", ""}}, {});
  if (done[0].status != 0)
    throw ToolError("`" + codegen::to_text(arguments) + "` ends with status " +
                    std::to_string(done[0].status) + ": " + done[0].output);
}

}  // namespace

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
