// SPDX-License-Identifier: BSD-3-Clause
#include "peer.h"

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/store/cache.h>
#include <dyntape/codegen/system/files.h>
#include <dyntape/codegen/system/process.h>

#include <dlfcn.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <sstream>

#include "peer_files.inc"

namespace dyntape::tools {
namespace {

namespace fs = std::filesystem;
using codegen::Bounds;
using codegen::Command;
using codegen::Outcome;

const Bounds kBounds{1, 1800, std::size_t{16} << 30};

// What Pinocchio's variants of joints and constraints need of Boost.
constexpr const char* kDefinitions[] = {"-DBOOST_MPL_LIMIT_LIST_SIZE=30", "-DBOOST_MPL_LIMIT_VECTOR_SIZE=30",
                                        "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
                                        "-DBOOST_FUSION_INVOKE_MAX_ARITY=12", "-w"};

void copy(const dynamics::Placement<double>& X, double* rotation, double* translation) {
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(rotation);
  Eigen::Map<Eigen::Vector3d> p(translation);
  R = X.R;
  p = X.p;
}

std::vector<std::string> split(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> result;
  for (std::string word; stream >> word;) result.push_back(word);
  return result;
}

Outcome run(const std::vector<std::string>& arguments) {
  const codegen::TemporaryFolder folder(codegen::system_temporary_folder(), "dyntape-");
  return codegen::run_all({{arguments, folder.path() + "/log", folder.path()}}, kBounds)[0];
}

// The include folder of a prefix or a virtual environment, or "": one path, however it is named, since it is part of the
// key of the library that is kept.
std::string include_of(const fs::path& prefix) {
  std::error_code none;
  const auto has = [&](const fs::path& include) {
    return fs::exists(include / "pinocchio/config.hpp", none);
  };
  if (has(prefix / "include")) return fs::canonical(prefix / "include").string();
  for (const auto& python : fs::directory_iterator(prefix / "lib", none)) {
    const fs::path include = python.path() / "site-packages/cmeel.prefix/include";
    if (has(include)) return fs::canonical(include).string();
  }
  return {};
}

// What the interpreter would import, without importing it.
std::string include_of_python() {
  const Outcome asked = run({"/usr/bin/env", "python3", "-c",
                             "import importlib.util as u; print(u.find_spec('pinocchio').origin)"});
  if (asked.status != 0) return {};
  // .../PREFIX/lib/python3.11/site-packages/pinocchio/__init__.py
  fs::path path = asked.output.substr(0, asked.output.find('\n'));
  for (int up = 0; up < 5; ++up) path = path.parent_path();
  return include_of(path);
}

std::string find_include(const std::string& prefix, std::string& reason) {
  if (!prefix.empty()) {
    const std::string include = include_of(prefix);
    if (include.empty()) throw ArgumentError("--peer-prefix: there is no include/pinocchio in " + prefix);
    return include;
  }
  if (const char* named = std::getenv("PINOCCHIO_PREFIX"); named && *named) {
    if (std::string include = include_of(named); !include.empty()) return include;
  }
  if (std::string include = include_of(DYNTAPE_PEERS_FOLDER); !include.empty()) return include;
  if (std::string include = include_of_python(); !include.empty()) return include;
  reason = "no headers of Pinocchio: `python3 -m pip install pin`, or name their place by --peer-prefix";
  return {};
}

std::vector<std::string> compiler_words(const std::string& include) {
  std::vector<std::string> words = {"/usr/bin/env", DYNTAPE_CXX_COMPILER, "-std=c++20", "-fPIC",
                                    "-fvisibility=hidden"};
  for (const std::string& flag : split(kPeerFlags)) words.push_back(flag);
  for (const char* definition : kDefinitions) words.push_back(definition);
  for (const std::string& folder : {include, std::string(DYNTAPE_EIGEN_FOLDER)}) {
    words.push_back("-isystem");
    words.push_back(folder);
  }
  return words;
}

// Gigabytes a unit: no more of them at a time than the machine bears.
unsigned jobs() {
  const auto bytes = static_cast<std::size_t>(sysconf(_SC_PHYS_PAGES)) * sysconf(_SC_PAGE_SIZE);
  return static_cast<unsigned>(
      std::clamp<long>(bytes / (std::size_t{6} << 30), 1, sysconf(_SC_NPROCESSORS_ONLN)));
}

void must_succeed(const Command& command, const Outcome& outcome) {
  if (outcome.status == 0) return;
  throw ToolError("the peer does not compile (exit status " + std::to_string(outcome.status) + ")\n  " +
                  codegen::to_text(command.arguments) + "\n" + outcome.output.substr(0, 4000));
}

// folder/library.so of the files of the peer.
void build(const std::string& folder, const std::vector<std::string>& compiler) {
  std::vector<Command> units;
  Command link{compiler, folder + "/log", folder};
  for (const char* word : {"-shared", "-Wl,-Bsymbolic", "-o"}) link.arguments.push_back(word);
  link.arguments.push_back(folder + "/library.so");
  for (const PeerFile& file : kPeerFiles) {
    const std::string path = folder + "/" + file.name;
    codegen::write_file(path, file.text);
    if (!path.ends_with(".cpp")) continue;
    units.push_back({compiler, path + ".log", folder});
    for (const std::string& word : {std::string("-c"), path, std::string("-o"), path + ".o"}) {
      units.back().arguments.push_back(word);
    }
    link.arguments.push_back(path + ".o");
  }
  Bounds bounds = kBounds;
  bounds.jobs = jobs();
  const std::vector<Outcome> outcomes = codegen::run_all(units, bounds);
  for (std::size_t i = 0; i < units.size(); ++i) must_succeed(units[i], outcomes[i]);
  must_succeed(link, codegen::run_all({link}, bounds)[0]);
}

// The library for those headers, compiled unless it is kept already.
std::string library(const std::string& include) {
  const auto cache = codegen::Cache::open("");
  if (!cache) throw ToolError("the peer needs a cache folder to be kept in");
  const std::vector<std::string> compiler = compiler_words(include);
  const std::string version = run({compiler[0], compiler[1], "--version"}).output;
  std::string text;
  for (const PeerFile& file : kPeerFiles) text += std::string(file.text);
  int error = 0;
  const std::string config = codegen::read_file(include + "/pinocchio/config.hpp", error).value_or("");
  const codegen::Key key =
      codegen::make_key("peer\n" + codegen::to_text(compiler) + "\n" + version + config + text);
  if (const auto entry = cache->find(key)) return entry->library();

  std::cerr << "compiling Pinocchio's algorithms, once: minutes, gigabytes\n";
  codegen::TemporaryFolder folder(cache->folder(), "new-");
  {
    const codegen::TemporaryFolder builder(codegen::system_temporary_folder(), "dyntape-");
    build(builder.path(), compiler);
    fs::copy_file(builder.path() + "/library.so", folder.path() + "/library.so");
  }
  codegen::write_file(folder.path() + "/source.c", text);  // the name that every entry has
  const auto entry =
      cache->publish(folder, key, {"pinocchio-peer", 0, "", version, codegen::checksum(text)}, false);
  if (!entry) throw ToolError("the peer could not be kept in " + cache->folder());
  return entry->library();
}

}  // namespace

std::optional<PeerLibrary> PeerLibrary::open(const std::string& prefix, std::string& reason) {
  const std::string include = find_include(prefix, reason);
  if (include.empty()) return std::nullopt;
  const std::string path = library(include);
  void* handle = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  void* symbol = handle ? dlsym(handle, "dyntape_peer_table") : nullptr;
  if (!symbol) throw ToolError(path + ": " + dlerror());
  return PeerLibrary(reinterpret_cast<decltype(&dyntape_peer_table)>(symbol)());
}

std::vector<dyntape_peer_joint> peer_joints(const dynamics::Model<double>& model) {
  std::vector<dyntape_peer_joint> joints;
  for (int i = 0; i < model.njoints(); ++i) {
    const auto& joint = model.joints[i];
    const auto& body = model.inertias[i];
    const Eigen::Matrix3d& I = body.I_c;
    dyntape_peer_joint to{};
    to.type = dynamics::to_string(joint.type);
    to.parent = model.parent[i];
    Eigen::Map<Eigen::Vector3d>(to.axis) = joint.axis;
    to.pitch = joint.pitch;
    copy(model.X_PJ[i], to.rotation, to.translation);
    to.mass = body.mass;
    Eigen::Map<Eigen::Vector3d>(to.com) = body.com;
    Eigen::Map<dynamics::Vector6<double>>(to.inertia) << I(0, 0), I(0, 1), I(1, 1), I(0, 2), I(1, 2), I(2, 2);
    to.armature = joint.armature;
    joints.push_back(to);
  }
  return joints;
}

Peer::Peer(const PeerLibrary& library, const dynamics::Model<double>& model) : table_(library.table()) {
  const std::vector<dyntape_peer_joint> joints = peer_joints(model);
  peer_ = table_.build(joints.data(), model.njoints(), model.gravity.data());
  if (!peer_) throw ArgumentError("model \"" + model.name + "\" has a joint that the peer does not know");
}

void Peer::choose(const dynamics::Model<double>& model, const RobotFunction& function) {
  const auto frame_of = [&](const std::string& name) {
    const auto& frame = name.empty() ? model.frames.back() : model.frames[model.frame_index(name)];
    dyntape_peer_frame to{};
    to.joint = frame.body;
    copy(frame.X_BF, to.rotation, to.translation);
    return to;
  };
  if (!takes_frame(function)) return;
  const dyntape_peer_frame frame = frame_of(function.frame);
  std::vector<dyntape_peer_frame> contacts;
  for (const std::string& name : function.contacts) contacts.push_back(frame_of(name));
  if (contacts.empty()) contacts.push_back(frame);
  table_.choose(peer_, &frame, static_cast<int>(function.in), contacts.data(),
                static_cast<int>(contacts.size()));
}

void Peer::load(const std::vector<Eigen::VectorXd>& states) {
  const auto width = states.front().size();
  std::vector<double> rows;
  for (const auto& state : states) rows.insert(rows.end(), state.data(), state.data() + width);
  if (table_.load(peer_, rows.data(), static_cast<int>(states.size()), static_cast<int>(width)) != 0) {
    throw ArgumentError("the peer takes no states of " + std::to_string(width) + " entries");
  }
}

std::vector<int> Peer::find(const std::string& function) const {
  std::vector<int> found;
  for (const char* convention : {"", "@world"}) {
    const int index = table_.find(peer_, (function + convention).c_str());
    if (index >= 0) found.push_back(index);
  }
  return found;
}

std::vector<double> Peer::result(int function, int state, std::size_t size) {
  std::vector<double> y(size);
  const int written = table_.result(peer_, function, state, y.data(), static_cast<int>(size));
  if (written != static_cast<int>(size)) y.clear();
  return y;
}

}  // namespace dyntape::tools
