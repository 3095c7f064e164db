// SPDX-License-Identifier: BSD-3-Clause
//
// CppADCodeGen's C of a robot's functions, from Pinocchio's templates: another generated peer beside CasADi.
//
//   bench_kernels robot.urdf --model >robot.json
//   bench_cppadcodegen robot.json --output DIR --functions rnea,id-derivatives      DIR/rnea/*.c, DIR/id-derivatives/*.c ...
//
// Prints a description of each as JSON: symbol, folder of sources, seconds, and `at`: where each number of the C stands in
// dyntape's result of that function.  tests/bench/peers/cppadcodegen_peer.py compiles them for bench_kernels --generated.
#include <CLI/CLI.hpp>
#include <chrono>
#include <iostream>
#include <nlohmann/json.hpp>

#include <pinocchio/codegen/cppadcg.hpp>
// Pinocchio's order
#include <pinocchio/algorithm/aba-derivatives.hpp>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/rnea-derivatives.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/multibody.hpp>

#include "pinocchio_model.h"

namespace {

namespace cg = CppAD::cg;
using Json = nlohmann::json;
using Scalar = CppAD::AD<cg::CG<double>>;
using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
using Model = pinocchio::ModelTpl<Scalar>;
using Data = pinocchio::DataTpl<Scalar>;
using Tape = CppAD::ADFun<cg::CG<double>>;

pinocchio::Model robot_of(const Json& j) {
  std::vector<dyntape_peer_joint> joints;
  std::vector<std::string> types;
  for (const Json& joint : j.at("joints")) types.push_back(joint.at("type"));
  const auto copy = [](const Json& from, double* to) {
    for (const Json& x : from) *to++ = x;
  };
  for (std::size_t i = 0; i < types.size(); ++i) {
    const Json& joint = j.at("joints")[i];
    dyntape_peer_joint to{};
    to.type = types[i].c_str();
    to.parent = joint.at("parent");
    copy(joint.at("axis"), to.axis);
    copy(joint.at("rotation"), to.rotation);
    copy(joint.at("translation"), to.translation);
    to.mass = joint.at("mass");
    copy(joint.at("com"), to.com);
    const Json& I = joint.at("inertia");
    int k = 0;
    for (const int entry : {0, 1, 4, 2, 5, 8}) to.inertia[k++] = I[static_cast<std::size_t>(entry)];
    to.armature = joint.at("armature");
    joints.push_back(to);
  }
  const std::vector<double> gravity = j.at("gravity");
  pinocchio::Model model;
  if (!peer::build_model(joints.data(), static_cast<int>(joints.size()), gravity.data(), model))
    throw std::runtime_error("a joint that Pinocchio does not know");
  return model;
}

// --- Functions, and results in dyntape's order: blocks row by row ----------------------------------------------

struct Results {
  std::vector<Scalar> y;

  template <class M>
  void block(const M& m,
             bool symmetric = false) {  // of a symmetric matrix Pinocchio writes the upper triangle
    for (Eigen::Index i = 0; i < m.rows(); ++i)
      for (Eigen::Index j = 0; j < m.cols(); ++j) y.push_back(symmetric && i > j ? m(j, i) : m(i, j));
  }
};

struct State {
  Vector q, v, w;
};

struct Function {
  std::string name, variant;
  int parts;  // of (q, v, a | tau) that it takes
  void (*run)(const Model&, Data&, const State&, Results&);
  int order = 0;  // of derivatives that CppAD takes of it
};

void rnea(const Model& m, Data& d, const State& s, Results& to) {
  to.block(pinocchio::rnea(m, d, s.q, s.v, s.w));
}

const std::vector<Function>& functions() {
  static const std::vector<Function> all = {
      {"rnea", "", 3, rnea},
      {"aba", "", 3,
       [](const Model& m, Data& d, const State& s, Results& to) {
         to.block(pinocchio::aba(m, d, s.q, s.v, s.w));
       }},
      {"crba", "", 1,
       [](const Model& m, Data& d, const State& s, Results& to) {
         to.block(pinocchio::crba(m, d, s.q), true);
       }},
      {"minverse", "", 1,
       [](const Model& m, Data& d, const State& s, Results& to) {
         to.block(pinocchio::computeMinverse(m, d, s.q), true);
       }},
      {"id-derivatives", "analytic", 3,
       [](const Model& m, Data& d, const State& s, Results& to) {
         pinocchio::computeRNEADerivatives(m, d, s.q, s.v, s.w);
         to.block(d.dtau_dq);
         to.block(d.dtau_dv);
         to.block(d.M, true);
       }},
      {"id-derivatives", "", 3, rnea, 1},
      {"fd-derivatives", "analytic", 3,
       [](const Model& m, Data& d, const State& s, Results& to) {
         pinocchio::computeABADerivatives(m, d, s.q, s.v, s.w);
         to.block(d.ddq_dq);
         to.block(d.ddq_dv);
         to.block(d.Minv, true);
       }},
      {"id-hessian", "", 3, rnea, 2},
  };
  return all;
}

void record(const pinocchio::Model& robot, const Function& function, Tape& tape) {
  const Model model = robot.cast<Scalar>();
  Data data(model);
  Eigen::VectorXd point = Eigen::VectorXd::Zero(robot.nq + 2 * robot.nv);
  point.head(robot.nq) = pinocchio::neutral(robot);
  std::vector<Scalar> x(point.data(), point.data() + (function.parts == 1 ? robot.nq : point.size()));
  CppAD::Independent(x);
  const auto all = static_cast<Eigen::Index>(x.size());
  const Eigen::Map<Vector> at(x.data(), all);
  State s{at.head(robot.nq), Vector::Zero(robot.nv), Vector::Zero(robot.nv)};
  if (function.parts == 3) {
    s.v = at.segment(robot.nq, robot.nv);
    s.w = at.tail(robot.nv);
  }
  Results results;
  function.run(model, data, s, results);
  tape.Dependent(x, results.y);
  tape.optimize();
}

// --- C -----------------------------------------------------------------------------------------------------

// Where the rows and columns of a Jacobian by (q, v, a) stand in blocks by q, by v and by a.
std::size_t place_in_blocks(std::size_t row, std::size_t col, std::size_t n) {
  return col / n * n * n + row * n + col % n;
}

Json generate(const pinocchio::Model& robot, const Function& function, const std::string& folder) {
  Tape tape;
  record(robot, function, tape);
  cg::ModelCSourceGen<double> source(tape, "function");
  std::vector<std::size_t> rows, cols, at;
  const auto entries = [&](const auto& pattern) {
    for (std::size_t i = 0; i < pattern.size(); ++i) {
      for (const std::size_t j : pattern[i]) {
        rows.push_back(i);
        cols.push_back(j);
      }
    }
  };
  using Pattern = std::vector<std::set<std::size_t>>;
  const auto n = static_cast<std::size_t>(robot.nv);
  source.setCreateForwardZero(function.order == 0);
  if (function.order == 1) {
    entries(cg::jacobianSparsitySet<Pattern, cg::CG<double>>(tape));
    for (std::size_t k = 0; k < rows.size(); ++k) at.push_back(place_in_blocks(rows[k], cols[k], n));
    source.setCreateSparseJacobian(true);
    source.setCustomSparseJacobianElements(rows, cols);
  } else if (function.order == 2) {
    entries(cg::hessianSparsitySet<Pattern, cg::CG<double>>(tape));
    for (std::size_t k = 0; k < rows.size(); ++k) at.push_back(rows[k] * 3 * n + cols[k]);
    source.setCreateSparseHessian(true);
    source.setCustomSparseHessianElements(rows, cols);
  } else {
    for (std::size_t k = 0; k < tape.Range(); ++k) at.push_back(k);
  }
  cg::ModelLibraryCSourceGen<double> library(source);
  cg::SaveFilesModelLibraryProcessor<double>::saveLibrarySourcesTo(library, folder);
  const char* const symbols[] = {"function_forward_zero", "function_sparse_jacobian",
                                 "function_sparse_hessian"};
  return {{"sources", folder},
          {"symbol", symbols[function.order]},
          {"at", at},
          {"weights_from", function.order == 2 ? Json(robot.nq + 2 * robot.nv) : Json()}};
}

int run(const std::string& path, const std::string& output, const std::vector<std::string>& names) {
  std::ifstream file(path);
  const pinocchio::Model robot = robot_of(Json::parse(file));
  Json list = Json::array();
  for (const Function& function : functions()) {
    if (std::find(names.begin(), names.end(), function.name) == names.end()) continue;
    // Tangents of a base are no differences of its coordinates.
    if (function.order > 0 && robot.nq != robot.nv) continue;
    const std::string name =
        function.name + ".cppadcodegen" + (function.variant.empty() ? "" : "." + function.variant);
    const auto start = std::chrono::steady_clock::now();
    Json about = {{"name", name},
                  {"route", "CppADCodeGen" + (function.variant.empty() ? "" : ", " + function.variant)}};
    try {
      about.update(generate(robot, function, output + "/" + name));
    } catch (const CppAD::cg::CGException& e) {  // of what branches on values
      about["absent"] = std::string("Pinocchio's template is not recorded: ") + e.what();
    }
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    about["generated_s"] = seconds.count();
    list.push_back(about);
  }
  std::cout << list.dump(1) << "\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"CppADCodeGen's C of a robot's functions, from Pinocchio's templates."};
  std::string path, output;
  std::vector<std::string> names = {"rnea"};
  app.add_option("model", path, "what bench_kernels --model prints")->required()->check(CLI::ExistingFile);
  app.add_option("--output", output, "a folder a function")->required()->type_name("DIR");
  app.add_option("--functions", names, "which")->delimiter(',')->type_name("F1,F2");
  CLI11_PARSE(app, argc, argv);
  try {
    return run(path, output, names);
  } catch (const std::exception& e) {
    return std::cerr << "bench_cppadcodegen: " << e.what() << "\n", 1;
  }
}
