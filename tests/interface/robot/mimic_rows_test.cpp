// SPDX-License-Identifier: BSD-3-Clause
//
// Every row of the table on robots whose joints follow others, against the projection by brute force in 113 bits:
// explicit products with G, and forward dynamics by dense solves of what they give.
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>

#include <Eigen/Dense>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algebra/float128.h>
#include <dyntape/dynamics/algorithms/mimic.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/robot_evaluator.h>
#include <dyntape/interface/robot/robot_rows.h>
#include "dynamics/random_robots.h"
#include "interface/temporary_cache.h"
#include "packed.h"
#include "source_folder.h"

namespace dyntape::mimic_rows_test {
namespace {

using namespace dynamics;  // NOLINT: the tests speak its language
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Quad = Float128;
using Vectorq = VectorX<Quad>;
using Matrixq = Eigen::Matrix<Quad, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr double kEps = std::numeric_limits<double>::epsilon();

Vectorq run(const Model<Quad>& model, const RobotFunction& function, const Vectorq& state) {
  dyntape::detail::RobotWorkspace<Quad> work(model, function);
  Vectorq y(static_cast<Eigen::Index>(work.n_out()));
  EXPECT_EQ(static_cast<std::size_t>(state.size()), work.n_in());
  work.evaluate(state.data(), y.data());
  return y;
}

class MimicRows : public ::testing::TestWithParam<unsigned long> {
 protected:
  MimicRows() : random(GetParam()) {
    full = random_tree(random, {.joints = 8, .base = GetParam() % 2 ? Base::kFloating : Base::kFixed});
    rules = random_rules(full, random);
    exact = full.cast<Quad>();
    const MimicModel<double> mimic(full, rules);
    nq = mimic.nq, nv = mimic.nv;
    G = Matrixq(full.nv, nv);
    for (int k = 0; k < nv; ++k) G.col(k) = expand_tangent<Quad>(mimic.cast<Quad>(), Vectorq::Unit(nv, k));
    q = random_configuration(mimic, random.engine);
    q_full = expand_configuration<double>(mimic, q);
    rest = random.vector(3 * nv, 3);
    cond = condition();
  }

  // One row on the full robot, at v = G v, a = G a; mu and tau are taken as of the full robot.
  Vectorq on_full(const std::string& name, const ReferenceFrame in = ReferenceFrame::kLocal,
                  const Vectorq& w = {}) const {
    RobotFunction function(name);
    function.in = in;
    const int behind = static_cast<int>(inputs(full, function).size()) - 1;
    Vectorq state(full.nq + behind * full.nv);
    state.head(full.nq) = q_exact();
    for (int i = 0; i < behind; ++i) {
      const bool given = i == 1 && w.size();
      state.segment(full.nq + i * full.nv, full.nv) = given ? w : Vectorq(G * part(i));
    }
    return run(exact, function, state);
  }
  Vectorq q_exact() const {
    return expand_configuration<Quad>(MimicModel<Quad>(exact, rules), q.cast<Quad>());
  }
  Vectorq part(int i) const { return rest.segment(i * nv, nv).cast<Quad>(); }
  Matrixq matrix(const Vectorq& y, int rows, int cols, int first = 0) const {
    return Eigen::Map<const Matrixq>(y.data() + first, rows, cols);
  }
  Matrixq M() const { return G.transpose() * matrix(on_full("crba"), full.nv, full.nv) * G; }
  double condition() const {
    return Eigen::JacobiSVD<MatrixXd>(M().cast<double>()).singularValues()[0] *
           M().cast<double>().inverse().norm();
  }

  RobotFunction reduced(const RobotFunction& row) const {
    RobotFunction function = row;
    function.mimics = rules;
    return function;
  }
  VectorXd state_of(const RobotFunction& function) const {
    VectorXd state(static_cast<Eigen::Index>(input_names(full, function).size()));
    state << q, rest.head(state.size() - nq);
    return state;
  }
  VectorXd on_leaders(const std::string& name) const {
    const RobotFunction function = local(name);
    return evaluate_analytic(full, function, state_of(function));
  }
  RobotFunction local(const std::string& name) const {
    RobotFunction function = reduced(RobotFunction(name));
    function.in = ReferenceFrame::kLocal;
    return function;
  }
  static void expect_near(const VectorXd& got, const Vectorq& expected, double tolerance) {
    ASSERT_EQ(got.size(), expected.size());
    EXPECT_LE(relative_error(got, VectorXd(expected.cast<double>())), tolerance) << "seed " << GetParam();
  }
  static Vectorq flat(const Matrixq& m) { return Eigen::Map<const Vectorq>(m.data(), m.size()); }

  Random random;
  Model<double> full;
  Model<Quad> exact;
  std::vector<MimicRule> rules;
  int nq = 0, nv = 0;
  Matrixq G;
  VectorXd q, q_full, rest;  // rest: v | a or tau | mu
  double cond = 1;
};

// The n rows of x, each of `size` numbers, gathered by G^T: row r of G says where row r goes.
std::vector<Quad> gathered(const std::vector<Quad>& x, const Matrixq& map) {
  const auto n = static_cast<std::size_t>(map.rows()), size = x.size() / n;
  std::vector<Quad> y(static_cast<std::size_t>(map.cols()) * size, Quad(0));
  for (std::size_t r = 0; r < n; ++r) {
    for (std::size_t c = 0; c < static_cast<std::size_t>(map.cols()); ++c) {
      const Quad& factor = map(static_cast<long>(r), static_cast<long>(c));
      if (factor == 0) continue;
      for (std::size_t k = 0; k < size; ++k) y[c * size + k] += factor * x[r * size + k];
    }
  }
  return y;
}

// (i, rest) -> (rest, i)
std::vector<Quad> turned(const std::vector<Quad>& x, std::size_t rows) {
  std::vector<Quad> y;
  for (std::size_t k = 0; k < x.size() / rows; ++k) {
    for (std::size_t i = 0; i < rows; ++i) y.push_back(x[i * (x.size() / rows) + k]);
  }
  return y;
}

// Along each dimension of a block, by what its shape says: entries times G^T.
Vectorq projected(const Vectorq& y, const std::vector<RobotBlock>& blocks, const Matrixq& G) {
  Matrixq three = Matrixq::Zero(3 * G.rows(), 3 * G.cols());
  for (int i = 0; i < 3; ++i) three.block(i * G.rows(), i * G.cols(), G.rows(), G.cols()) = G;
  std::vector<Quad> out;
  const Quad* from = y.data();
  for (const RobotBlock& block : blocks) {
    std::vector<Quad> x(from, from + block.size());
    from += block.size();
    std::string shape = block.shape;
    for (std::size_t at; (at = shape.find(" x ")) != std::string::npos;) shape.replace(at, 3, "|");
    std::istringstream words(shape);
    for (int size : {block.rows, block.cols, block.pages}) {  // once around
      std::string word;
      std::getline(words, word, '|');
      if (word == "nv" || word == "3 nv") {
        const Matrixq& map = word == "nv" ? G : three;
        x = gathered(x, map);
        size = static_cast<int>(map.cols());
      }
      x = turned(x, static_cast<std::size_t>(size));
    }
    out.insert(out.end(), x.begin(), x.end());
  }
  EXPECT_EQ(from, y.data() + y.size());
  return Eigen::Map<const Vectorq>(out.data(), static_cast<Eigen::Index>(out.size()));
}

TEST_P(MimicRows, RowsThatSolveForNothingAreProjections) {
  int rows = 0;
  for (const RobotFunction& row : robot_functions()) {
    if (is_forward(row)) continue;
    SCOPED_TRACE(to_string(row));
    const RobotFunction function = local(to_string(row));
    const Vectorq expected = projected(on_full(to_string(row)), outputs(full, row), G);
    expect_near(evaluate_analytic(full, function, state_of(function)), expected, 1e-12);
    ++rows;
  }
  EXPECT_GT(rows, 25);
}

// M a = tau - h, and with contacts M a - J^T lambda = tau - h, J a = -gamma; an impact M v+ - J^T f = M v.
TEST_P(MimicRows, ForwardDynamicsSolvesTheProjectedEquations) {
  const Matrixq mass = M();
  const auto solver = mass.partialPivLu();
  const Vectorq h = G.transpose() * on_full("nonlinear-effects"), tau = part(1), v = part(0);
  expect_near(on_leaders("aba"), solver.solve(Vectorq(tau - h)), 30 * kEps * cond);
  expect_near(on_leaders("minverse"), flat(solver.inverse()), 30 * kEps * cond);

  const Matrixq J6 = matrix(on_full("frame-jacobian"), 6, full.nv) * G, J = J6.topRows(3);
  const Vectorq bias = on_full("frame-acceleration", ReferenceFrame::kLocal, Vectorq::Zero(full.nv));
  const Matrixq mobility = J * solver.solve(Matrixq(J.transpose()));
  const VectorXd s = Eigen::JacobiSVD<MatrixXd>(mobility.cast<double>()).singularValues();
  ASSERT_GT(s[2], 1e-3 * s[0]) << "forces of rows that hang together are not unique: choose another seed";
  const double bound = 100 * kEps * cond * s[0] / s[2];
  Matrixq K = Matrixq::Zero(nv + 3, nv + 3);
  K.topLeftCorner(nv, nv) = mass;
  K.topRightCorner(nv, 3) = -J.transpose();
  K.bottomLeftCorner(3, nv) = J;
  Vectorq rhs(nv + 3);
  rhs << tau - h, -bias.segment(6, 3);
  expect_near(on_leaders("constrained-dynamics"), K.partialPivLu().solve(rhs), bound);
  rhs << mass * v, Vectorq::Zero(3);
  expect_near(on_leaders("impulse-dynamics"), K.partialPivLu().solve(rhs), bound);

  const Matrixq inverse = J6 * solver.solve(Matrixq(J6.transpose()));
  const VectorXd y = on_leaders("operational-space");
  expect_near(y.head(36), flat(inverse), 30 * kEps * cond);
  const MatrixXd Lambda = Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(y.data() + 36);
  const Vectorq push = J6 * solver.solve(h) - matrix(on_full("frame-jacobian-rate"), 6, full.nv) * G * v;
  const MatrixXd J_bar = solver.solve(Matrixq(J6.transpose() * Lambda.cast<Quad>())).cast<double>();
  const double large = 100 * kEps * cond * Lambda.norm();
  EXPECT_LE((y.segment(72, 6) - Lambda * push.cast<double>()).norm(), large * push.cast<double>().norm());
  EXPECT_LE((y.tail(6 * nv) - MatrixXd(J_bar.transpose()).reshaped()).norm(), large * J_bar.norm());
}

// Of the values above, in 113 bits.
TEST_P(MimicRows, DerivativesAreTheSlopesOfTheirValues) {
  const Quad step(1e-11);
  int rows = 0;
  for (const RobotFunction& row : robot_functions()) {
    if (!is_derivative(row)) continue;
    SCOPED_TRACE(to_string(row));
    if (takes_contacts(row) && nv < 8) continue;
    const RobotFunction function = local(to_string(row)), value = value_of(function);
    const MimicModel<Quad> mimic(exact, rules);
    const Vectorq at = state_of(function).cast<Quad>();
    const auto n = static_cast<Eigen::Index>(outputs(full, value).size());
    const std::vector<int> by = dyntape::detail::derived_by(function);
    std::vector<Matrixq> derivatives;
    for (int input : by) {
      Matrixq slope;
      for (int k = 0; k < nv; ++k) {
        const auto moved = [&](const Quad& h) {
          Vectorq x = at;
          if (input == 0) {
            x.head(nq) = integrate<Quad>(mimic, at.head(nq), Vectorq(h * Vectorq::Unit(nv, k)));
          } else {
            x[nq + (input - 1) * nv + k] += h;
          }
          return run(exact, value, x);
        };
        const Vectorq column = (moved(step) - moved(-step)) / (2 * step);
        if (k == 0) slope.resize(column.size(), nv);
        slope.col(k) = column;
      }
      derivatives.push_back(slope);
    }
    std::vector<Quad> expected;
    Eigen::Index first = 0;
    for (const RobotBlock& block : outputs(full, value)) {
      for (const Matrixq& slope : derivatives) {
        const Matrixq part = slope.middleRows(first, block.size());
        expected.insert(expected.end(), part.data(), part.data() + part.size());
      }
      first += block.size();
    }
    EXPECT_GT(n, 0);
    expect_near(evaluate_analytic(full, function, state_of(function)),
                Eigen::Map<const Vectorq>(expected.data(), static_cast<Eigen::Index>(expected.size())),
                is_forward(row) ? 1e4 * kEps * cond : 1e-12);
    ++rows;
  }
  EXPECT_GT(rows, 10);
}

TEST_P(MimicRows, RecordingsAndDifferencesAgree) {
  for (const RobotFunction& row : robot_functions()) {
    if (takes_contacts(row) && nv < 8) continue;
    SCOPED_TRACE(to_string(row));
    const RobotFunction function = reduced(row);
    const VectorXd state = state_of(function), plain = evaluate_analytic(full, function, state);
    const double bound = is_forward(row) ? 1e4 * kEps * cond : 1e-12;
    RobotEvaluator tape(full, function, RobotRoute::kTape);
    ASSERT_EQ(tape.n_out(), output_names(full, function).size());
    EXPECT_LE(relative_error(tape(state), plain), bound);
    if (!is_derivative(row)) continue;
    RobotEvaluator central(full, function, RobotRoute::kFdCentral);
    EXPECT_LE(relative_error(central(state), plain), 1e-5);
  }
}

TEST_P(MimicRows, PacksAgree) {
  for (const RobotFunction& row : robot_functions()) {
    if (takes_contacts(row) && nv < 8) continue;
    const RobotFunction function = reduced(row);
    const VectorXd state = state_of(function);
    EXPECT_LE(
        relative_error(evaluate_packed(full, function, state), evaluate_analytic(full, function, state)),
        is_forward(row) ? 1e4 * kEps * cond : 1e-12)
        << to_string(row);
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, MimicRows, ::testing::Range(1UL, 6UL));

// Joints on lines only, so that second tangent derivatives are plain ones.
Model<double> on_lines(Random& random, int joints) {
  Model<double> full;
  full.name = "lines";
  for (int i = 0; i < joints; ++i) {
    const JointType types[] = {JointType::kRevolute, JointType::kPrismatic, JointType::kHelical};
    full.add_joint(i == 0 ? -1 : random.below(i),
                   random_joint(random, "joint " + std::to_string(i), types[random.below(3)]),
                   random_placement(random), random_inertia(random));
  }
  return full;
}

TEST(MimicRowsOnLines, SecondOrderIsTheSlopeOfFirstOrder) {
  for (unsigned long seed = 1; seed <= 3; ++seed) {
    Random random(seed);
    const Model<double> full = on_lines(random, 6);
    const auto rules = random_rules(full, random);
    ASSERT_FALSE(rules.empty()) << "seed " << seed;
    const int nv = full.nv - static_cast<int>(rules.size());
    const Model<Quad> exact = full.cast<Quad>();
    RobotFunction first("fd-derivatives"), second("fd-second-derivatives"), hessian("fd-hessian");
    first.mimics = second.mimics = hessian.mimics = rules;
    const VectorXd state = random.vector(3 * nv), lambda = random.vector(nv);
    const Quad step(1e-11);
    const auto slope = [&](int k) {
      Vectorq up = state.cast<Quad>(), down = up;
      up[k] += step, down[k] -= step;
      return VectorXd(((run(exact, first, up) - run(exact, first, down)) / (2 * step)).cast<double>());
    };
    const VectorXd tensors = evaluate_analytic(full, second, state);
    VectorXd expected(tensors.size());
    const auto at = [nv](int block, int i, int j, int k) { return ((block * nv + i) * nv + j) * nv + k; };
    MatrixXd H = MatrixXd::Zero(3 * nv, 3 * nv);
    for (int k = 0; k < 3 * nv; ++k) {
      const VectorXd d = slope(k);  // of ddq_dq | ddq_dv | ddq_dtau
      for (int i = 0; i < nv; ++i) {
        for (int j = 0; j < 3 * nv; ++j) H(j, k) += lambda[i] * d[((j / nv) * nv + i) * nv + j % nv];
        for (int j = 0; j < nv; ++j) {
          if (k < nv) expected[at(0, i, j, k)] = d[at(0, 0, i, j)];
          if (k >= nv && k < 2 * nv) expected[at(1, i, j, k - nv)] = d[at(0, 0, i, j)];
          if (k >= nv && k < 2 * nv) expected[at(2, i, j, k - nv)] = d[nv * nv + at(0, 0, i, j)];
          if (k < nv) expected[at(3, i, j, k)] = d[2 * nv * nv + at(0, 0, i, j)];
        }
      }
    }
    EXPECT_LE(relative_error(tensors, expected), 1e-10) << "seed " << seed;
    VectorXd with_lambda(4 * nv);
    with_lambda << state, lambda;
    const VectorXd got = evaluate_analytic(full, hessian, with_lambda);
    EXPECT_LE(relative_error(got, H.reshaped()), 1e-10) << "seed " << seed;
  }
}

// A point that is held, of a robot some of whose joints follow others.
TEST(MimicRowsOnLines, ConstrainedHessianIsTheSlopeOfFirstOrder) {
  int compared = 0;
  for (unsigned long seed = 1; seed <= 6; ++seed) {
    Random random(seed);
    Model<double> full = on_lines(random, 10);
    full.frames.push_back({"held", 9, random_placement(random)});
    RobotFunction first("constrained-derivatives"), hessian("constrained-hessian");
    first.mimics = hessian.mimics = random_rules(full, random);
    ASSERT_FALSE(first.mimics.empty());
    const int nv = full.nv - static_cast<int>(first.mimics.size());
    const VectorXd state = random.vector(4 * nv);
    const Model<Quad> exact = full.cast<Quad>();
    // The product of two factors is rounded to double (following.hxx): with a follower among the joints that hold the point,
    // rows that depend on each other in double do not in 113 bits, and there is nothing to compare.
    const Vectorq at = state.head(3 * nv).cast<Quad>();
    if (relative_error(evaluate_analytic(full, first, state.head(3 * nv)),
                       VectorXd(run(exact, first, at).cast<double>())) > 1e-9)
      continue;
    MatrixXd H = MatrixXd::Zero(3 * nv, 3 * nv);
    for (int k = 0; k < 3 * nv; ++k) {
      const auto moved = [&](double h) {
        Vectorq x = at;
        x[k] += Quad(h);
        return run(exact, first, x);
      };
      const VectorXd d = ((moved(1e-11) - moved(-1e-11)) / Quad(2e-11)).cast<double>();
      for (int i = 0; i < nv; ++i) {
        for (int j = 0; j < 3 * nv; ++j) H(j, k) += state[3 * nv + i] * d[((j / nv) * nv + i) * nv + j % nv];
      }
    }
    EXPECT_LE(relative_error(evaluate_analytic(full, hessian, state), H.reshaped()), 1e-10)
        << "seed " << seed;
    ++compared;
  }
  EXPECT_GE(compared, 4);
}

// The fingers of a real file: one joint fewer, and generated code that knows it.
TEST(MimicRowsOfFiles, FingersOfThePanda) {
  const auto root = std::filesystem::path(test::source_folder());
  const UrdfRobot robot = read_urdf((root / "config/robots/panda.urdf").string(), {.mimic = true});
  const TemporaryCache cache;
  RobotEvaluatorOptions options;
  options.codegen.cache_folder = cache.path();
  options.codegen.flags = {"-O1"};
  Random random(7);
  const VectorXd state = random.vector(24);
  VectorXd torque;
  for (const char* name : {"rnea", "aba", "id-derivatives"}) {
    RobotFunction function(name);
    function.mimics = robot.mimics;
    const auto in = input_names(robot.model, function), out = output_names(robot.model, function);
    EXPECT_EQ(in.size(), 24u);
    EXPECT_EQ(in.back(), std::string(name) == "aba" ? "tau7" : "a7");
    RobotEvaluator generated(robot.model, function, RobotRoute::kGenerated, options);
    VectorXd x = state;
    if (torque.size()) x.tail(8) = torque;
    const VectorXd y = evaluate_analytic(robot.model, function, x);
    EXPECT_EQ(static_cast<std::size_t>(y.size()), out.size());
    EXPECT_LE(relative_error(generated(x), y), 1e-12) << name;
    if (std::string(name) == "rnea") torque = y;
    if (std::string(name) == "aba") {
      EXPECT_LE(relative_error(y, VectorXd(state.tail(8))), 1e-11);
      torque.resize(0);
    }
  }
  RobotFunction wrong("rnea");
  wrong.mimics = {{"panda_finger_joint2", "panda_finger_joint3"}};
  EXPECT_THROW(evaluate_analytic(robot.model, wrong, state), ArgumentError);
}

}  // namespace
}  // namespace dyntape::mimic_rows_test
