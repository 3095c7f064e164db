// SPDX-License-Identifier: BSD-3-Clause
//
// CasADi's interface, called as CasADi and acados do it: printed and compiled, and in this process, against the interpreter.
#include <dlfcn.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/casadi_program.h>
#include <dyntape/codegen/pipeline.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "compilers.h"
#include "random_function.h"

namespace dyntape::casadi_test {
namespace {

using codegen::CasadiBlocks;
using codegen::CasadiFunction;
using testing::Random;
using testing::Scratch;

// x and a 2 x 3 matrix, to a number and the matrix's transpose, scaled.
Function scaled() {
  return record("scaled", 8, [](const VectorXad& x) {
    VectorXad y(7);
    y[0] = sin(x[0]) * x[1] + x[2] * x[7];
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < 3; ++j) y[1 + 2 * j + i] = x[0] * x[2 + 3 * i + j] * x[2 + 3 * i + j];
    return y;
  });
}
CasadiBlocks blocks_of_scaled() { return {{{"x", 2}, {"A", 2, 3}}, {{"s"}, {"B", 3, 2}}}; }

// Arguments by name, in CasADi's layout, and dense results by name.
using Values = std::map<std::string, std::vector<double>>;

struct Called {
  int status = 0;
  Values out;
};

std::size_t non_zeros(const long long* sparsity) {
  return static_cast<std::size_t>(sparsity[2] == 1 ? sparsity[0] * sparsity[1] : sparsity[2 + sparsity[1]]);
}

std::vector<double> dense_of(const long long* sparsity, const std::vector<double>& values) {
  if (sparsity[2] == 1) return values;
  const long long rows = sparsity[0], cols = sparsity[1];
  std::vector<double> all(static_cast<std::size_t>(rows * cols));
  for (long long j = 0; j < cols; ++j)
    for (long long k = sparsity[2 + j]; k < sparsity[3 + j]; ++k)
      all[static_cast<std::size_t>(j * rows + sparsity[3 + cols + k])] = values[static_cast<std::size_t>(k)];
  return all;
}

// Through the functions of a library, by their names alone.
class Library {
 public:
  explicit Library(const std::string& path) : handle_(dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL)) {
    EXPECT_TRUE(handle_) << dlerror();
  }
  ~Library() { dlclose(handle_); }

  template <class F>
  F* symbol(const std::string& name) const {
    void* const found = dlsym(handle_, name.c_str());
    EXPECT_TRUE(found) << name;
    return reinterpret_cast<F*>(found);
  }

  Called call(const std::string& name, const Values& in) const {
    const long long n_in = symbol<long long()>(name + "_n_in")(),
                    n_out = symbol<long long()>(name + "_n_out")();
    auto* const sparsity_in = symbol<const long long*(long long)>(name + "_sparsity_in");
    auto* const sparsity_out = symbol<const long long*(long long)>(name + "_sparsity_out");
    auto* const name_in = symbol<const char*(long long)>(name + "_name_in");
    auto* const name_out = symbol<const char*(long long)>(name + "_name_out");
    EXPECT_EQ(sparsity_in(n_in), nullptr);
    long long sz_arg = 0, sz_res = 0, sz_iw = 0, sz_w = 0;
    EXPECT_EQ((symbol<int(long long*, long long*, long long*, long long*)>(name + "_work")(&sz_arg, &sz_res,
                                                                                           &sz_iw, &sz_w)),
              0);
    std::vector<const double*> arg(static_cast<std::size_t>(sz_arg));
    std::vector<double*> res(static_cast<std::size_t>(sz_res));
    std::vector<double> w(static_cast<std::size_t>(sz_w), std::nan(""));
    for (long long i = 0; i < n_in; ++i) {
      const auto found = in.find(name_in(i));
      arg[static_cast<std::size_t>(i)] = found == in.end() ? nullptr : found->second.data();
      if (found != in.end()) {
        EXPECT_EQ(found->second.size(), non_zeros(sparsity_in(i)));
      }
    }
    std::vector<std::vector<double>> results;
    for (long long i = 0; i < n_out; ++i) results.emplace_back(non_zeros(sparsity_out(i)) + 1, -7);
    for (long long i = 0; i < n_out; ++i)
      res[static_cast<std::size_t>(i)] = results[static_cast<std::size_t>(i)].data();
    Called called;
    called.status = symbol<int(const double**, double**, long long*, double*, int)>(name)(
        arg.data(), res.data(), nullptr, w.data(), 0);
    for (long long i = 0; i < n_out; ++i) {
      std::vector<double>& values = results[static_cast<std::size_t>(i)];
      EXPECT_EQ(values.back(), -7) << "written behind " << name_out(i);
      values.pop_back();
      called.out[name_out(i)] = dense_of(sparsity_out(i), values);
    }
    return called;
  }

 private:
  void* handle_;
};

Called call(const codegen::CasadiProgram& program, std::size_t which, const Values& in) {
  const CasadiFunction& f = program.functions()[which];
  std::vector<const double*> arg;
  std::vector<double*> res;
  std::vector<std::vector<double>> results;
  for (const auto& argument : f.in) {
    const auto found = in.find(argument.name);
    arg.push_back(found == in.end() ? nullptr : found->second.data());
  }
  for (const auto& argument : f.out) results.emplace_back(non_zeros(argument.sparsity.data()));
  for (auto& values : results) res.push_back(values.data());
  Called called;
  called.status = program.call(which, arg.data(), res.data());
  for (std::size_t i = 0; i < f.out.size(); ++i)
    called.out[f.out[i].name] = dense_of(f.out[i].sparsity.data(), results[i]);
  return called;
}

CodegenOptions of_order(Order order) {
  CodegenOptions options;
  options.order = order;
  return options;
}

constexpr const char* kPrefixes[] = {"", "jac_", "adj1_", "jac_adj1_"};

// Column by column: row r, column c of a matrix with so many rows.
double at(const std::vector<double>& values, std::size_t rows, std::size_t r, std::size_t c) {
  return values[c * rows + r];
}

void expect_scaled(const std::function<Called(std::size_t, const Values&)>& call_which) {
  const std::vector<double> x = {0.5, 2}, A = {1, 4, 2, 5, 3, 6};  // rows 1 2 3 and 4 5 6
  const Values in = {{"x", x}, {"A", A}};
  const Called value = call_which(0, in);
  EXPECT_EQ(value.status, 0);
  EXPECT_EQ(value.out.at("s"), std::vector<double>{own::sin(0.5) * 2 + 1 * 6});
  EXPECT_EQ(value.out.at("B"), (std::vector<double>{0.5, 2, 4.5, 8, 12.5, 18}));

  const Called jacobian = call_which(1, in);
  EXPECT_EQ(jacobian.out.at("jac_s_x"), (std::vector<double>{own::cos(0.5) * 2, own::sin(0.5)}));
  EXPECT_EQ(jacobian.out.at("jac_s_A"), (std::vector<double>{6, 0, 0, 0, 0, 1}));
  // B (3 x 2) by A (2 x 3): B_ji = x0 A_ij^2.
  EXPECT_EQ(at(jacobian.out.at("jac_B_A"), 6, 3, 1), 2 * 0.5 * 4);  // B_01 by A_10
  EXPECT_EQ(at(jacobian.out.at("jac_B_A"), 6, 1, 1), 0);

  Values weighted = in;
  weighted["adj_s"] = {3};
  weighted["adj_B"] = {1, 0, 0, 0, 0, 2};
  const Called gradient = call_which(2, weighted);
  EXPECT_DOUBLE_EQ(gradient.out.at("adj_x")[0], 3 * 2 * std::cos(0.5) + 1 + 2 * 36);
  EXPECT_DOUBLE_EQ(gradient.out.at("adj_A")[5], 3 * 1 + 2 * 2 * 0.5 * 6);

  const Called hessian = call_which(3, weighted);
  EXPECT_DOUBLE_EQ(at(hessian.out.at("jac_adj_x_x"), 2, 0, 0), -3 * 2 * std::sin(0.5));
  EXPECT_DOUBLE_EQ(at(hessian.out.at("jac_adj_x_x"), 2, 1, 0), 3 * std::cos(0.5));
  EXPECT_DOUBLE_EQ(at(hessian.out.at("jac_adj_A_A"), 6, 5, 5), 2 * 2 * 0.5);
  EXPECT_DOUBLE_EQ(at(hessian.out.at("jac_adj_A_A"), 6, 5, 0), 3);
  EXPECT_DOUBLE_EQ(at(hessian.out.at("jac_adj_A_x"), 6, 5, 0), 2 * 2 * 6);
  EXPECT_DOUBLE_EQ(at(hessian.out.at("jac_adj_A_adj_s"), 6, 5, 0), 1);
  EXPECT_EQ(hessian.out.at("jac_adj_A_out_B"), std::vector<double>(36, 0.0));

  Values nothing;  // what is null is zero
  EXPECT_EQ(call_which(0, nothing).out.at("s"), std::vector<double>{0});
}

TEST(Casadi, WhatIsInThisProcess) {
  CodegenOptions options = of_order(Order::kSecond);
  options.route = Route::kMachineCode;
  const codegen::CasadiProgram program(scaled(), blocks_of_scaled(), options);
  ASSERT_EQ(program.functions().size(), 4u);
  expect_scaled([&](std::size_t which, const Values& in) { return call(program, which, in); });
}

TEST(Compiler, CasadisLibraryIsCalledByNames) {
  const Scratch scratch;
  const std::string path = scratch / "scaled.so";
  const codegen::Source source = generate_casadi(scaled(), blocks_of_scaled(), of_order(Order::kSecond));
  EXPECT_TRUE(source.header.empty());
  compile_casadi(source, path);
  const Library library(path);
  expect_scaled(
      [&](std::size_t which, const Values& in) { return library.call(kPrefixes[which] + source.name, in); });
}

TEST(Compiler, CasadisCallsHaveTheBitsOfTheProgram) {
  Random random(3);
  SCOPED_TRACE(random.seed_text());
  const Scratch scratch;
  const Function f = all_as_variables(testing::random_functions(random, 60, 5));
  const CasadiBlocks blocks = {{{"x", f.n_x()}}, {{"y", f.n_y()}}};
  CodegenOptions options = of_order(Order::kSecond);
  options.route = Route::kMachineCode;
  const codegen::CasadiProgram program(f, blocks, options);
  const codegen::Source source = generate_casadi(f, blocks, options);
  compile_casadi(source, scratch / "f.so");
  const Library library(scratch / "f.so");
  const Values in = {{"x", testing::random_arguments(random, f.n_x())},
                     {"adj_y", testing::random_arguments(random, f.n_y())}};
  for (std::size_t which = 0; which < 4; ++which) {
    const Called a = call(program, which, in), b = library.call(kPrefixes[which] + source.name, in);
    ASSERT_EQ(a.status, b.status);
    for (const auto& [name, values] : a.out)
      for (std::size_t k = 0; a.status == 0 && k < values.size(); ++k)
        ASSERT_TRUE(testing::same(values[k], b.out.at(name)[k])) << kPrefixes[which] << name << " " << k;
  }
}

TEST(Casadi, ABranchThatIsLeftFails) {
  const Function f = record("branch", 1, [](const VectorXad& x) {
    if (x[0] < 1) return VectorXad::Constant(1, x[0] * 2).eval();
    return x;
  });
  const codegen::CasadiProgram program(f, {{{"x"}}, {{"y"}}}, of_order(Order::kFirst));
  EXPECT_EQ(call(program, 0, {{"x", {0.5}}}).out.at("y"), std::vector<double>{1});
  EXPECT_EQ(call(program, 0, {{"x", {1.5}}}).status, 1);
  EXPECT_EQ(call(program, 0, {{"x", {0.25}}}).out.at("y"), std::vector<double>{0.5});
}

TEST(Casadi, BlocksThatDoNotFitAreRefused) {
  const auto refused = [](const Function& f, const CasadiBlocks& blocks, const std::string& what) {
    try {
      generate_casadi(f, blocks, {});
      ADD_FAILURE() << what;
    } catch (const ArgumentError& e) {
      EXPECT_NE(std::string(e.what()).find(what), std::string::npos) << e.what();
    }
  };
  refused(scaled(), {{{"x", 2}}, {{"s"}, {"B", 3, 2}}},
          "the blocks have 2 inputs and 7 outputs; expected 8 and 7");
  Random random(4);
  const Function with_parameters = testing::random_functions(random, 10, 2);
  ASSERT_GT(with_parameters.n_p(), 0u);
  refused(with_parameters, {{{"x", with_parameters.n_x()}}, {{"y", with_parameters.n_y()}}},
          "all_as_variables() turns them into variables");
}

}  // namespace
}  // namespace dyntape::casadi_test
