// SPDX-License-Identifier: BSD-3-Clause
//
// Transcription schemes by mesh: what the cost is off by, what the motion is, and what a solve takes.
#include <algorithm>
#include <cmath>
#include <set>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/files/task/task.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/table.h>

#include "measure.h"
#include "study.h"

namespace dyntape::tools {
namespace {

constexpr const char* kCartPole = "cart-pole swing-up";
constexpr const char* kArm = "seven-joint arm";
constexpr double kByShooting = 58.8076674582;  // Pontryagin's conditions of the cart-pole, by shooting
constexpr double kOfEffort = 100;              // of (torque / limit)^2 beside (rad/s^2)^2
constexpr double kTolerance = 1e-12;
constexpr double kRounded = 1e-10;  // relative; below, an order is that of the solver

struct Moved {
  std::string label;
  Problem problem;
  double best;                      // the cost of the continuous optimum
  Eigen::VectorXd halfway;          // its state at half the time: another optimum is elsewhere
  std::vector<int> meshes, points;  // numbers of intervals, and of points on a single one
  std::set<std::pair<std::string, double>> below = {};  // methods and parameters whose cost is below the best
};

SolverOptions by_stages() {
  return {.method = NlpMethod::kRiccati, .tolerance = kTolerance, .bound_relaxation = 0};
}

Solution solved(StagedNlp& program, bool verified) {
  return optimise(program, program.start(),
                  {.solver = by_stages(), .check_derivatives = false, .verify = verified});
}

// The state at a time, along the line between the points beside it.
Eigen::VectorXd state_at(const Trajectory& motion, double t) {
  const Eigen::Index after = std::clamp<Eigen::Index>(
      std::lower_bound(motion.t.begin(), motion.t.end(), t) - motion.t.begin(), 1, motion.t.size() - 1);
  const double share = (t - motion.t[after - 1]) / (motion.t[after] - motion.t[after - 1]);
  return (1 - share) * motion.x.col(after - 1) + share * motion.x.col(after);
}

// The optimum on so fine a mesh that nothing is left to see.
Solution finest(const Problem& problem, const Scheme& scheme, int intervals) {
  StagedNlp program = discretize(problem, {.scheme = scheme, .intervals = intervals});
  const Solution solution = solved(program, false);
  if (solution.nlp.status != SolveStatus::kSolved && solution.nlp.status != SolveStatus::kAcceptable)
    throw NumericalError("study schemes: the reference by " + scheme.name +
                         " is not found: " + describe(solution.nlp.status));
  return solution;
}

Moved cart_pole(const StudyOptions& options) {
  const Task task = read_task(options.config + "/tasks/cart_pole_swing_up.info");
  Moved moved{kCartPole, task.problem, kByShooting, {}, {10, 20, 40, 80, 160}, {16, 21, 31, 41}};
  if (!options.quick) {
    moved.meshes.insert(moved.meshes.end(), {320, 640});
    moved.points.insert(moved.points.end(), {51, 61, 71, 81, 101, 121});
  }
  const Trajectory motion = finest(task.problem, lobatto(5), 80).motion;
  moved.halfway = state_at(motion, task.problem.duration / 2);
  return moved;
}

// Reaching with little acceleration and little torque, of which the second makes the optimum one of the arm's own and the first
// leaves one optimum.  Without limits: where a limit begins to hold the control has a kink, which bounds every order.
Moved arm(const StudyOptions& options, double& between_families) {
  const Task task = read_task(options.config + "/tasks/arm_reaching.info");
  Moved moved{kArm, task.problem, 0, {}, {5, 10, 20, 40}, {6, 9}};
  moved.problem.add(squared_fractions(task.scene, kOfEffort, task.robot.unit));
  for (Bounds* bounds : {&moved.problem.x, &moved.problem.u})
    bounds->lower.setConstant(-HUGE_VAL), bounds->upper.setConstant(HUGE_VAL);
  if (!options.quick) {
    moved.meshes.insert(moved.meshes.end(), {80, 160, 320});
    moved.points.insert(moved.points.end(), {13, 17, 21, 25});
  }
  const Solution reference = finest(moved.problem, lobatto(5), options.quick ? 20 : 80);
  const Solution other = finest(moved.problem, radau(5), options.quick ? 20 : 60);
  moved.best = reference.cost();
  moved.halfway = state_at(reference.motion, moved.problem.duration / 2);
  between_families = std::abs(reference.cost() - other.cost());
  return moved;
}

std::vector<Scheme> chosen_schemes() {
  return {euler(), trapezoid(), hermite_simpson(), lobatto(4), radau(3), scheme_by_name("runge-kutta-4")};
}

// A row of each part; `parameter`: of intervals, or of points on a single one.
void add_rows(Study& study, Moved& moved, const std::string& method, double parameter, const Solution& s,
              double seconds) {
  const Eigen::VectorXd away = state_at(s.motion, moved.problem.duration / 2) - moved.halfway;
  if (s.cost() < moved.best) moved.below.emplace(method, parameter);
  std::string trouble;
  if (s.nlp.status != SolveStatus::kSolved && s.nlp.status != SolveStatus::kAcceptable)
    trouble = describe(s.nlp.status);
  else if (away.norm() > 0.5 * moved.halfway.norm())
    trouble = "another optimum: its cost is " + io::with_digits(s.cost(), 7);
  const std::pair<const char*, double> values[] = {{"cost", std::abs(s.cost() - moved.best)},
                                                   {"defect", s.verification.worst_defect},
                                                   {"miss", s.verification.miss}};
  for (const auto& [part, value] : values) {
    StudyRow row{part, moved.label, method, parameter, seconds};
    row.trouble = trouble;
    if (trouble.empty()) row.value = value;
    study.rows.push_back(row);
  }
}

void measure(Study& study, Moved& moved, const std::string& method, double parameter, StagedNlp& program,
             const StudyOptions& options) {
  options.watch(moved.label + ", " + method + ", " + io::shortest(parameter));
  const Solution s = solved(program, true);
  std::vector<double> seconds = {s.nlp.times.total};
  for (int run = 1; run < (options.quick ? 3 : 7) && s.nlp.times.total < 2; ++run)
    seconds.push_back(solve_nlp(program, program.start(), by_stages()).times.total);
  add_rows(study, moved, method, parameter, s, median(seconds));
}

void measure(Study& study, Moved& moved, const StudyOptions& options) {
  for (const Scheme& scheme : chosen_schemes()) {
    try {
      StagedNlp program = discretize(moved.problem, {.scheme = scheme, .intervals = moved.meshes.front()});
      for (const int intervals : moved.meshes) {
        const MeshOptions mesh{.scheme = scheme, .intervals = intervals};
        StagedNlp finer = discretize(program, node_times(moved.problem, mesh));
        measure(study, moved, scheme.name, intervals, finer, options);
      }
    } catch (const ArgumentError& refused) {
      for (const char* part : {"cost", "defect", "miss"})
        study.rows.push_back(
            {.part = part, .subject = moved.label, .method = scheme.name, .trouble = refused.what()});
    }
  }
  for (const int points : moved.points) {
    StagedNlp program = discretize(moved.problem, {.scheme = pseudospectral(points), .intervals = 1});
    measure(study, moved, "pseudospectral", points, program, options);
  }
}

// log2 of what a mesh twice as fine gains, from the finest pair that is not rounding; NaN: there is none.
double order_of(const std::vector<StudyRow>& rows, double rounded) {
  for (std::size_t k = rows.size(); k-- > 1;) {
    if (rows[k].value > rounded && rows[k - 1].value > 0 && rows[k].parameter == 2 * rows[k - 1].parameter)
      return std::log2(rows[k - 1].value / rows[k].value);
  }
  return std::nan("");
}

std::string orders(const Study& study, const std::string& part, const Moved& moved) {
  std::string text;
  const double rounded = kRounded * (part == "cost" ? std::abs(moved.best) : 1);
  for (const Scheme& scheme : chosen_schemes()) {
    const double order = order_of(curve(study, part, moved.label, scheme.name), rounded);
    if (std::isnan(order)) continue;
    text += (text.empty() ? "" : ", ") + scheme.name + " " + io::with_digits(order, 3);
  }
  return text;
}

std::string quickest_to(const Study& study, const Moved& moved, double error) {
  const StudyRow* best = nullptr;
  for (const StudyRow& row : study.rows) {
    if (row.part == "cost" && row.subject == moved.label && row.value <= error &&
        (!best || row.seconds < best->seconds))
      best = &row;
  }
  if (!best) return "none";
  return best->method + " with " + io::shortest(best->parameter) + " (" + io::duration(best->seconds) + ")";
}

// Of the cart-pole; a cost that is too low has a sign.
std::string values_of(const Study& study, const Moved& moved, const std::string& part,
                      const std::string& method, const std::vector<int>& parameters) {
  std::string text;
  for (const int parameter : parameters) {
    const StudyRow& row = point(study, part, moved.label, method, parameter);
    const bool below = part == "cost" && moved.below.count({method, parameter}) > 0;
    text += (text.empty() ? "" : ", ") +
            (row.trouble.empty() ? (below ? "-" : "") + io::scientific(row.value, 3) : "another optimum");
  }
  return text;
}

void add_findings(Study& study, const std::vector<Moved>& all) {
  const std::vector<int> meshes = {20, 40, 80, 160};
  std::vector<std::string>& cost = study.parts[0].findings;
  cost.push_back("Hermite-Simpson on the cart-pole with 20, 40, 80, 160 intervals: the cost is off by " +
                 values_of(study, all[0], "cost", "hermite-simpson", meshes) + ", trapezoid by " +
                 values_of(study, all[0], "cost", "trapezoid", meshes) +
                 ", one interval of pseudospectral with 16, 21, 41 points by " +
                 values_of(study, all[0], "cost", "pseudospectral", {16, 21, 41}) + ".");
  for (const Moved& moved : all) {
    cost.push_back(moved.label +
                   ": observed orders of the cost, by halving the finest interval that is not "
                   "rounding: " +
                   orders(study, "cost", moved) + ".");
    const double scale = std::abs(moved.best);
    cost.push_back(
        moved.label + ": quickest to a relative error of 1e-3 is " + quickest_to(study, moved, 1e-3 * scale) +
        ", to 1e-6 " + quickest_to(study, moved, 1e-6 * scale) + ", to 1e-8 " +
        quickest_to(study, moved, 1e-8 * scale) + " (number of intervals, pseudospectral: of points).");
  }
  for (const Moved& moved : all)
    study.parts[1].findings.push_back(moved.label +
                                      ": observed orders of the true defect, one more than those of "
                                      "the motion: " +
                                      orders(study, "defect", moved) + ".");
  study.parts[2].findings.push_back(
      "Re-simulated, the control of Hermite-Simpson misses the upright cart-pole by " +
      values_of(study, all[0], "miss", "hermite-simpson", meshes) +
      " with 20, 40, 80, 160 intervals, that of the trapezoid by " +
      values_of(study, all[0], "miss", "trapezoid", meshes) + ".");
  study.parts[2].findings.push_back(
      "A small cost error says little about the motion: with 40 intervals of Hermite-Simpson the cost is "
      "right to " +
      io::scientific(point(study, "cost", kCartPole, "hermite-simpson", 40).value / kByShooting) +
      " of itself, and its control alone misses by " +
      io::scientific(point(study, "miss", kCartPole, "hermite-simpson", 40).value) + ".");
}

}  // namespace

Study outline_of_schemes() {
  Study study{.name = "schemes",
              .title = "Transcription schemes: what a mesh loses, and what a solve takes",
              .question = "Which scheme, on which mesh, for which digits?"};
  study.parts = {{.name = "cost",
                  .title = "Error of the optimal cost",
                  .x_label = "time of a solve [ms]",
                  .y_label = "|J - J*| [unit of the cost]",
                  .x_scale = 1e3},
                 {.name = "defect",
                  .title = "Largest true defect: an interval re-simulated",
                  .x_label = "time of a solve [ms]",
                  .y_label = "defect [m, rad, m/s, rad/s]",
                  .x_scale = 1e3},
                 {.name = "miss",
                  .title = "Miss of the whole motion re-simulated",
                  .x_label = "time of a solve [ms]",
                  .y_label = "miss [m, rad, m/s, rad/s]",
                  .x_scale = 1e3}};
  return study;
}

Study study_schemes(const StudyOptions& options) {
  Study study = outline_of_schemes();
  double between_families = 0;
  options.watch("references");
  std::vector<Moved> all = {cart_pole(options), arm(options, between_families)};
  for (Moved& moved : all) measure(study, moved, options);
  study.left_out = {
      "semi-implicit-euler and hermite-simpson-linear: near relatives of euler and hermite-simpson.",
      "Limits of the arm: where a limit begins to hold, the control has a kink, and no scheme keeps its "
      "order on "
      "an even mesh.",
      "The arm's dynamics in their forward form, the only one that runge-kutta-4 knows."};
  study.methods = {
      "config/tasks/cart_pole_swing_up.info; config/tasks/arm_reaching.info without limits, with " +
          io::shortest(kOfEffort) +
          " |torque / limit|^2 added to the cost. Even meshes, from the straight line; solver `stages` to "
          "1e-12, "
          "compiled functions, the time of the solve alone, median of several. The parameter in the table is "
          "the "
          "number of intervals, of pseudospectral that of the points of its one interval.",
      "euler and runge-kutta-4 hold the control over an interval, which costs order whatever the steps are.",
      "The cart-pole's reference is 58.8076674582, by shooting on Pontryagin's conditions. A solve that ends "
      "in "
      "another optimum is told by its state at half the time.",
      "The arm's reference, " + io::with_digits(all[1].best, 10) +
          ", is that of lobatto-5, which is not among the schemes, on a fine mesh; radau-5 on another one "
          "differs "
          "by " +
          io::scientific(between_families) + "."};
  add_findings(study, all);
  return study;
}

}  // namespace dyntape::tools
