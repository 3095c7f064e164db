// SPDX-License-Identifier: BSD-3-Clause
//
// C that CasADi or CppADCodeGen has generated, each through its own interface: arrays of pointers to what goes in and
// comes out; CasADi's results are sparse by columns, the numbers of the other stand where its description says.
#include <dlfcn.h>

#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>

#include <dyntape/autodiff/error.h>

#include "route.h"
#include "text_bytes.h"

namespace dyntape::bench {
namespace {

using Call = int (*)(const double** in, double** out, long long* integers, double* room, int memory);
using Sizes = int (*)(long long* in, long long* out, long long* integers, long long* room);
using Sparsity = const long long* (*)(long long index);

struct Kernel {
  Call call = nullptr;
  Sparsity sparsity = nullptr;
  std::vector<long long> integers;
  std::vector<double> room;
  std::vector<std::size_t> offsets;          // of each input in a state
  std::vector<std::vector<double>> results;  // the non-zeros of each block
  std::vector<const double*> in;
  std::vector<double*> out;

  void run(const Eigen::VectorXd& state) {
    for (std::size_t i = 0; i < offsets.size(); ++i) in[i] = state.data() + offsets[i];
    for (std::size_t i = 0; i < results.size(); ++i) out[i] = results[i].data();
    call(in.data(), out.data(), integers.data(), room.data(), 0);
  }
  // Blocks row by row.
  std::vector<double> dense() const {
    std::vector<double> y;
    for (std::size_t b = 0; b < results.size(); ++b) {
      // rows, columns, then a one for a full block, or where columns start and the row of each entry
      const long long* s = sparsity(static_cast<long long>(b));
      const auto rows = static_cast<std::size_t>(s[0]), cols = static_cast<std::size_t>(s[1]);
      const bool full = s[2] == 1;
      const std::size_t at = y.size();
      y.resize(at + rows * cols);
      for (std::size_t j = 0; j < cols; ++j) {
        const auto first = full ? j * rows : static_cast<std::size_t>(s[2 + j]);
        const auto end = full ? first + rows : static_cast<std::size_t>(s[3 + j]);
        for (std::size_t k = first; k < end; ++k) {
          const std::size_t i = full ? k - first : static_cast<std::size_t>(s[3 + cols + k]);
          y[at + i * cols + j] = results[b][k];
        }
      }
    }
    return y;
  }
};

// The functions that CppADCodeGen prints take what stands in one row, then weights, and an unused table of atomic
// functions by value.
struct AtomicFunctions {
  void *library, *forward, *reverse;
};
using DenseCall = void (*)(const double* const* in, double* const* out, AtomicFunctions);

struct DenseKernel {
  DenseCall call = nullptr;
  std::size_t weights = 0;      // where they begin in a state
  std::vector<std::size_t> at;  // of each number in a dense result
  std::vector<double> results, y;

  void run(const Eigen::VectorXd& state) {
    const double* const in[] = {state.data(), state.data() + weights};
    double* const out[] = {results.data()};
    call(in, out, {});
  }
  const std::vector<double>& dense() {
    for (std::size_t k = 0; k < at.size(); ++k) y[at[k]] = results[k];
    return y;
  }
};

template <class F>
F symbol(void* library, const std::string& name) {
  void* found = library ? dlsym(library, name.c_str()) : nullptr;
  if (!found) throw ToolError(name + ": " + dlerror());
  return reinterpret_cast<F>(found);
}

template <class K>
void take(const std::shared_ptr<K>& kernel, const States& states, Route& route) {
  route.run = [kernel, &states](int first, int calls) {
    for (int k = 0; k < calls; ++k) kernel->run(states[static_cast<std::size_t>(first + k) % states.size()]);
  };
  route.value = [kernel, &states](int i) {
    kernel->run(states[static_cast<std::size_t>(i)]);
    return kernel->dense();
  };
}

std::shared_ptr<DenseKernel> cppadcodegen_kernel(void* library, const nlohmann::json& about,
                                                 const dynamics::Model<double>& model,
                                                 const RobotFunction& function) {
  const auto kernel = std::make_shared<DenseKernel>();
  kernel->call = symbol<DenseCall>(library, about.at("symbol"));
  if (!about.at("weights_from").is_null()) kernel->weights = about.at("weights_from");
  kernel->at = about.at("at").get<std::vector<std::size_t>>();
  kernel->results.resize(kernel->at.size());
  std::size_t size = 0;
  for (const RobotBlock& block : outputs(model, function)) size += static_cast<std::size_t>(block.size());
  kernel->y.resize(size);
  return kernel;
}

std::shared_ptr<Kernel> casadi_kernel(void* handle, const nlohmann::json& about,
                                      const dynamics::Model<double>& model, const RobotFunction& function) {
  const std::string name = about.at("symbol");
  const auto kernel = std::make_shared<Kernel>();
  kernel->call = symbol<Call>(handle, name);
  kernel->sparsity = symbol<Sparsity>(handle, name + "_sparsity_out");
  long long n_in = 0, n_out = 0, n_integers = 0, n_room = 0;
  symbol<Sizes>(handle, name + "_work")(&n_in, &n_out, &n_integers, &n_room);
  kernel->integers.resize(static_cast<std::size_t>(n_integers));
  kernel->room.resize(static_cast<std::size_t>(n_room));
  kernel->in.resize(static_cast<std::size_t>(n_in));
  kernel->out.resize(static_cast<std::size_t>(n_out));
  std::size_t offset = 0;
  for (const RobotBlock& block : inputs(model, function)) {
    kernel->offsets.push_back(offset);
    offset += static_cast<std::size_t>(block.size());
  }
  for (const RobotBlock& block : outputs(model, function))
    kernel->results.emplace_back(static_cast<std::size_t>(block.size()));
  if (kernel->in.size() < kernel->offsets.size() || kernel->out.size() < kernel->results.size()) {
    throw ToolError(name + ": takes other arguments than " + to_string(function));
  }
  return kernel;
}

}  // namespace

Route generated_route(const std::string& path, const dynamics::Model<double>& model,
                      const RobotFunction& function, const States& states) {
  std::ifstream file(path);
  const auto about = nlohmann::json::parse(file);
  const std::string library = about.at("library");
  void* handle = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);  // for as long as the program runs
  Route route;
  if (about.contains("at")) {
    take(cppadcodegen_kernel(handle, about, model, function), states, route);
  } else {
    take(casadi_kernel(handle, about, model, function), states, route);
  }
  route.name = about.at("route");
  route.operations = about.value("operations", std::size_t{0});
  route.compile = about.at("compile_s");
  route.made = about.at("made_s");
  route.text = text_bytes(library);
  return route;
}

}  // namespace dyntape::bench
