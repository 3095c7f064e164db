// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape verify: whether the functions of one robot can be relied on, and how far.
#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <numbers>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/inertia_condition.h>
#include <dyntape/interface/control/nlp/worst.h>
#include <dyntape/interface/io/live_line.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/robot/robot_evaluator.h>
#include <dyntape/interface/robot/robot_rows.h>

#include "bench_commands.h"
#include "function_options.h"
#include "host.h"
#include "measure.h"
#include "words.h"

namespace dyntape::tools {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kRounding = 0x1p-52;
constexpr double kPlaceholder = 1000, kMostTurns = 3;  // limits of no real motor or joint

struct Options {
  RobotOptions robot;
  int states = 20;
  std::uint64_t seed = 1;
};

// One line of the passport: what was looked at, the worst that was seen, what is allowed.
struct Finding {
  std::string what;
  double worst = 0, allowed = 0;
  std::string advice;  // where it is not kept
  bool good() const { return worst <= allowed; }
};

void raise(double& most, double value) { most = worst(most, value); }  // a NaN stays

// Of all results together: at states near one they weigh alike, and a part of them may be nothing but rounding, as what the
// velocity of a wheel does to torques.
double error_of(const std::vector<double>& expected, const std::vector<double>& got) {
  const auto n = Eigen::Index(expected.size());
  const auto exact = VectorXd::Map(expected.data(), n), found = VectorXd::Map(got.data(), n);
  double most = 0, error = 0;
  for (Eigen::Index i = 0; i < n; ++i)
    most = std::max(most, std::abs(exact[i])), raise(error, std::abs(found[i] - exact[i]));
  return most > 0 ? error / most : error;
}

class Passport {
 public:
  Passport(const dynamics::UrdfRobot& robot, const Options& options) : robot_(robot), options_(options) {
    condition_ = dynamics::worst_inertia_condition(robot.model);
  }

  double condition() const { return condition_; }

  // Errors of every route against 113 bits, and the bits of what is generated.
  std::vector<Finding> routes(io::LiveLine& line) const {
    std::vector<Finding> findings;
    double bits = 0;
    for (const char* name : {"rnea", "crba", "aba", "minverse", "id-derivatives", "fd-derivatives"}) {
      const RobotFunction function = of(name);
      const std::vector<VectorXd> states =
          random_states(robot_.model, function, options_.states, options_.seed);
      std::vector<std::vector<double>> expected;
      for (const VectorXd& state : states) expected.push_back(reference(robot_.model, function, state));
      RobotEvaluatorOptions interpreted;
      interpreted.codegen.route = Route::kInterpreter;
      RobotEvaluator same(robot_.model, function, RobotRoute::kGenerated, interpreted);
      for (RobotRoute route :
           {RobotRoute::kAnalytic, RobotRoute::kTape, RobotRoute::kGenerated, RobotRoute::kMachineCode}) {
        line.show(std::string("verifying ") + name + ", " + to_string(route));
        RobotEvaluator evaluate(robot_.model, function, route);
        std::vector<double> result(evaluate.n_out());
        Finding finding{std::string(name) + ", " + to_string(route), 0, allowed(name),
                        "errors beyond what the condition of the inertia explains"};
        for (std::size_t i = 0; i < states.size(); ++i) {
          evaluate.evaluate(states[i].data(), result.data());
          raise(finding.worst, error_of(expected[i], result));
          if (route != RobotRoute::kGenerated && route != RobotRoute::kMachineCode) continue;
          const VectorXd strict = same(states[i]);
          bits += double(!std::equal(result.begin(), result.end(), strict.data()));
        }
        findings.push_back(finding);
      }
    }
    findings.push_back({"results of generated or machine code that differ from the interpreter's", bits, 0,
                        "report it, with the compiler's version"});
    return findings;
  }

  // What holds for any robot, in double, with a, tau random.
  std::vector<Finding> identities() const {
    RobotEvaluator id(robot_.model, of("rnea"), RobotRoute::kAnalytic),
        M_of(robot_.model, of("crba"), RobotRoute::kAnalytic),
        fd(robot_.model, of("aba"), RobotRoute::kAnalytic),
        inverse(robot_.model, of("minverse"), RobotRoute::kAnalytic),
        derivatives(robot_.model, of("id-derivatives"), RobotRoute::kAnalytic),
        differences(robot_.model, of("id-derivatives"), RobotRoute::kFdCentral);
    const Eigen::Index n = Eigen::Index(id.n_out()), nq = Eigen::Index(id.n_in()) - 2 * n;
    const bool floats = robot_.model.joints[0].type == dynamics::JointType::kFreeFlyer;
    double moved = 0, linear = 0, there_and_back = 0, product = 0, symmetric = 0, needed = 0, off = 0;
    for (const VectorXd& state : random_states(robot_.model, of("rnea"), options_.states, options_.seed)) {
      VectorXd at_rest = state;
      at_rest.tail(n).setZero();
      const VectorXd tau = id(state), a = state.tail(n), h = id(at_rest);
      const MatrixXd M = MatrixXd(M_of(state.head(nq)).reshaped(n, n));
      const MatrixXd W = MatrixXd(inverse(state.head(nq)).reshaped(n, n));
      raise(linear, (M * a + h - tau).norm() / (M.norm() * a.norm() + h.norm()));
      if (floats) {
        VectorXd far = state;
        far.head<3>().setConstant(1e8);
        moved += double(id(far) != tau);
      }
      VectorXd pushed = state;
      pushed.tail(n) = tau;
      const VectorXd again = fd(pushed);
      // In torques, which do not lose what the condition takes.
      raise(there_and_back, (M * (again - a)).norm() / (M.norm() * a.norm() + h.norm()));
      raise(product, (M * W - MatrixXd::Identity(n, n)).norm() / (M.norm() * W.norm()));
      raise(symmetric, (M - M.transpose()).norm() / M.norm());
      const VectorXd d = M.diagonal().cwiseSqrt().cwiseInverse();
      Eigen::SelfAdjointEigenSolver<MatrixXd> balanced(d.asDiagonal() * M * d.asDiagonal());
      const double least = balanced.eigenvalues()[0];
      raise(needed, least <= 0 ? HUGE_VAL : 1 / least);
      const VectorXd exact = derivatives(state), near = differences(state);
      raise(off, (exact - near).lpNorm<Eigen::Infinity>() / exact.lpNorm<Eigen::Infinity>());
    }
    const double many = 64 * double(n) * kRounding;
    std::vector<Finding> all = {
        {"tau - (M a + h), of its parts", linear, many, "see the errors of rnea and crba above"},
        {"fd(id(a)) - a, as torques", there_and_back, many, "see the condition of the inertia"},
        {"M M^-1 - 1, of the factors", product, many, "see the condition of the inertia"},
        {"M - M^T", symmetric, kRounding, "report it"},
        {"derivatives - central differences", off, 1e-6, "see the errors of id-derivatives above"},
        {"1 / least eigenvalue of M with a diagonal of ones", needed, 1e12,
         "the robot has a motion that moves no inertia: give a link mass, or a joint armature"}};
    if (floats)
      all.push_back({"states whose torques differ with the base 1e8 m away", moved, 0, "report it"});
    return all;
  }

  // Joints whose limits a controller would have to invent.
  std::vector<std::string> limits() const {
    std::vector<std::pair<std::string, std::string>> said;  // what, of which joints
    for (const auto& joint : robot_.model.joints) {
      if (joint.type == dynamics::JointType::kPlanar)
        said.emplace_back("planar, and has no limits", joint.name);
      if (!dynamics::is_single(joint.type)) continue;
      const auto& limit = joint.limits;
      const auto add = [&](const std::string& what) {
        const auto same =
            std::find_if(said.begin(), said.end(), [&](const auto& entry) { return entry.first == what; });
        if (same == said.end())
          said.emplace_back(what, joint.name);
        else
          same->second += ", " + joint.name;
      };
      if (!std::isfinite(limit.effort) || limit.effort == 0)
        add("no limit of effort; give one in the file, or weigh and bound controls in the task");
      if (!std::isfinite(limit.velocity) || limit.velocity == 0) add("no limit of velocity");
      if (std::isfinite(limit.effort) && limit.effort >= kPlaceholder)
        add("efforts up to " + io::significant(limit.effort, 4) + " N m or N, which look like placeholders");
      if (limit.lower == limit.upper) add("no room between lower and upper limit");
      const double turns = (limit.upper - limit.lower) / (2 * std::numbers::pi);
      if (joint.type == dynamics::JointType::kRevolute && std::isfinite(turns) && turns > kMostTurns)
        add(io::significant(turns, 3) + " turns between limits, which look like placeholders");
    }
    std::vector<std::string> sentences;
    for (const auto& [what, joints] : said) sentences.push_back(joints + ": " + what);
    return sentences;
  }

 private:
  RobotFunction of(const std::string& name) const { return chosen(name, {}, robot_); }
  // Accelerations lose what the condition of the inertia takes; torques do not.
  double allowed(const std::string& name) const {
    const bool solves = name == "aba" || name == "minverse" || name == "fd-derivatives";
    return std::min(1e-3, 1e-12 * (solves ? std::max(1.0, condition_) : 1.0));
  }

  const dynamics::UrdfRobot& robot_;
  const Options& options_;
  double condition_;
};

bool print(const std::string& title, const std::vector<Finding>& findings) {
  io::TextTable table({{title}, {"worst", "", io::Align::kRight}, {"allowed", "", io::Align::kRight}, {""}});
  bool good = true;
  for (const Finding& f : findings) {
    table.append(
        {f.what, io::scientific(f.worst), io::scientific(f.allowed), f.good() ? "" : "! " + f.advice});
    good &= f.good();
  }
  std::cout << table.text() << "\n";
  return good;
}

void print(const std::string& title, const std::vector<std::string>& sentences, const std::string& none) {
  std::cout << title << "\n";
  for (const std::string& sentence : sentences) std::cout << "- " << sentence << "\n";
  if (sentences.empty()) std::cout << "- " << none << "\n";
  std::cout << "\n";
}

void run(const Options& options) {
  const dynamics::UrdfRobot robot = load_robot(options.robot);
  check_moves(robot, "there is nothing to verify");
  const Passport passport(robot, options);
  std::vector<Finding> routes, identities;
  {
    io::LiveLine line;
    identities = passport.identities();
    routes = passport.routes(line);
  }
  std::cout << "Numerical passport of " << robot.model.name << ": " << robot.model.njoints() << " joints, nv "
            << robot.model.nv << "; " << options.states << " random states, seed " << options.seed << "\n"
            << processor_name() << ", " << compiler_name() << "\n\n";
  print("What the file says oddly", robot.notes, "nothing");
  print("Limits", passport.limits(), "every joint has its own");
  const double condition = passport.condition();
  std::cout << "Condition of the inertia\n- " << io::scientific(condition) << " at worst: "
            << (condition < 1e4 ? "accelerations keep their digits"
                : condition < 1e10
                    ? "whoever solves with the entries of M loses so much; aba() loses less"
                    : "heavy bodies hang on light ones, or joints nearly coincide; trust no linear "
                      "algebra on M, and see the errors below")
            << "\n\n";
  bool good = print("errors against 113 bits", routes);
  good &= print("identities", identities);
  if (!good) throw Error("'" + robot.model.name + "' is not verified; the lines with ! say what is wrong");
  std::cout << "All routes agree and all identities hold.\n";
}

}  // namespace

void add_verify(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "verify",
      "check a robot numerically: derivatives by all routes against 113-bit arithmetic, identities, "
      "condition\nof its inertia, limits; with advice.  The exit status is 0 only if all checks pass");
  const auto options = std::make_shared<Options>();
  add_robot_options(*command, options->robot);
  command->add_option("--states", options->states, "number of random states")
      ->transform(whole_number(1, 10000))
      ->capture_default_str();
  command->add_option("--seed", options->seed, "seed of the random states")
      ->transform(seed())
      ->capture_default_str();
  command->callback([options] { run(*options); });
}

}  // namespace dyntape::tools
