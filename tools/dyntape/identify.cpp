// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape identify: what a robot's torques can tell about its masses, and the motion that tells most.
#include <cmath>
#include <iostream>
#include <memory>
#include <optional>
#include <span>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/identification/estimator.h>
#include <dyntape/interface/identification/excitation.h>
#include <dyntape/interface/identification/pictures.h>
#include <dyntape/interface/io/csv.h>
#include <dyntape/interface/io/table.h>

#include "commands.h"
#include "state_columns.h"
#include "words.h"

namespace dyntape::tools {
namespace {

using io::significant;

struct IdentifyOptions {
  RobotOptions robot;
  BaseOptions base;
  ExcitationOptions excitation;
  ColumnOptions columns;
  std::string data, output;
  bool excite = false, condition = false;
  double noise = 0.1;
};

void read_sample(const StateColumns& columns, const io::CsvTable& table, int i,
                 std::span<Eigen::MatrixXd* const> parts) {
  std::vector<double> row;
  columns.read(table, i, row);
  const double* next = row.data();
  for (Eigen::MatrixXd* part : parts) {
    part->col(i) = Eigen::Map<const Eigen::VectorXd>(next, part->rows());
    next += part->rows();
  }
}

// Measured motions, and the torques that they took.
Samples read_samples(const IdentifyOptions& options, const dynamics::UrdfRobot& robot) {
  const io::CsvTable table = io::read_csv(options.data);
  RobotFunction rnea = RobotFunction::kRnea;
  rnea.mimics = robot.mimics;
  std::vector<RobotBlock> blocks = inputs(robot.model, rnea);
  blocks.push_back(outputs(robot.model, rnea).front());
  const StateColumns columns(table, robot, blocks, options.data, options.columns);
  if (table.rows() == 0) throw FileError(options.data + ": no samples; expected a row of numbers for each");
  Samples samples;
  Eigen::MatrixXd* const parts[] = {&samples.q, &samples.v, &samples.a, &samples.tau};
  for (std::size_t k = 0; k < blocks.size(); ++k) parts[k]->resize(blocks[k].size(), table.rows());
  for (int i = 0; i < table.rows(); ++i) read_sample(columns, table, i, parts);
  return samples;
}

void write_motion(const dynamics::Model<double>& model, const Excitation& e, const std::string& path) {
  const Samples s = sample(model, e.series, times_of_period(e.series.period, 500));
  io::CsvColumns table;
  table.add({"t"}, s.time.transpose());
  table.add(numbered("q", model.nq), s.q);
  table.add(numbered("v", model.nv), s.v);
  table.add(numbered("a", model.nv), s.a);
  io::write_csv(path, table.table());
}

void print(const BaseParameters& base, const Eigen::VectorXd& values, const Eigen::VectorXd* error,
           const Eigen::VectorXd* nominal) {
  std::vector<io::TextColumn> columns = {{"value", "", io::Align::kRight}};
  if (error) columns.push_back({"+-", "", io::Align::kRight});
  if (nominal) columns.push_back({"file", "", io::Align::kRight});
  columns.push_back({"base parameter"});
  io::TextTable table(columns);
  for (int k = 0; k < base.rank(); ++k) {
    std::vector<std::string> row = {significant(values[k], 6)};
    if (error) row.push_back(significant((*error)[k], 2));
    if (nominal) row.push_back(significant((*nominal)[k], 6));
    row.push_back(base.names[static_cast<std::size_t>(k)]);
    table.append(row);
  }
  std::cout << "\n" << table.text();
}

// Logarithm of the ratio of the mean semi-axes of the confidence ellipsoids.
double mean_gain(const Excitation& e, const BaseParameters& base) {
  return (e.random_log_det - e.log_det) / (2 * base.rank());
}

void print(const Excitation& e, const BaseParameters& base) {
  std::cout << "\nexcitation of " << significant(e.series.period, 3) << " s, " << e.series.harmonics()
            << " harmonics: " << to_string(e.status) << " after " << e.iterations << " iterations, "
            << io::duration(e.seconds) << "\n  condition " << significant(e.condition, 4)
            << ", of random series " << significant(e.random_condition, 4)
            << " (median)\n  errors on average " << significant(std::exp(mean_gain(e, base)), 3)
            << " times those of the best random series\n";
}

// The motion that tells most; false where the solver did not get there.
bool excite(const IdentifyOptions& options, const dynamics::Model<double>& model, const BaseParameters& base,
            io::ResultFolder* results) {
  const Excitation e = optimal_excitation(model, base, options.excitation);
  print(e, base);
  const Eigen::VectorXd sigma = Eigen::VectorXd::Constant(model.nv, options.noise);
  const Eigen::VectorXd error = BaseEstimator(model, base, e.samples, sigma).standard_deviation();
  const Eigen::VectorXd nominal = base.regrouping * parameter_values(model, base.columns);
  std::cout << "  errors that remain after " << e.samples.count() << " samples with "
            << significant(options.noise, 3) << " N m of noise (Cramer-Rao):\n";
  print(base, nominal, &error, nullptr);
  if (results) {
    results->write("excitation.csv", [&](const std::string& path) { write_motion(model, e, path); });
    results->write("excitation.svg", [&](const std::string& path) { draw_excitation(model, e, path); });
  }
  // A motion within the limits that is better than chance is a result, converged or not.
  return e.status == SolveStatus::kSolved || e.status == SolveStatus::kAcceptable ||
         e.status == SolveStatus::kIterationLimit;
}

void estimate(const IdentifyOptions& options, const dynamics::UrdfRobot& robot, const BaseParameters& base,
              io::ResultFolder* results) {
  const dynamics::Model<double>& model = robot.model;
  const Samples samples = read_samples(options, robot);
  const Identification found = identify(model, base, samples);
  std::cout << "\nfrom " << samples.count() << " samples, condition " << significant(found.condition, 4)
            << ":\n";
  const Eigen::VectorXd nominal = base.regrouping * parameter_values(model, base.columns);
  print(base, found.beta, &found.standard_deviation, &nominal);
  std::cout << "\nnoise of the torques:";
  for (double s : found.sigma) std::cout << " " << significant(s, 3);
  std::cout << "\n";
  if (!results) return;
  io::CsvTable result({"beta", "standard_deviation", "file"});
  for (int k = 0; k < base.rank(); ++k)
    result.append({found.beta[k], found.standard_deviation[k], nominal[k]});
  results->write("base_parameters.csv", [&](const std::string& path) { io::write_csv(path, result); });
}

std::vector<std::string> files_of(const IdentifyOptions& options) {
  std::vector<std::string> files;
  if (options.excite) files = {"excitation.csv", "excitation.svg"};
  if (!options.data.empty()) files.push_back("base_parameters.csv");
  return files;
}

void run(const IdentifyOptions& options) {
  const std::vector<std::string> files = files_of(options);
  const auto robot = load_robot(options.robot);
  const std::string output = files.empty() ? "" : options.output;
  const OutputFolder folder(output, files, {options.robot.path, options.data});
  std::vector<std::string> unwritten;
  std::optional<io::ResultFolder> results;
  if (!output.empty()) results.emplace(output, unwritten);
  io::ResultFolder* const to = results ? &*results : nullptr;
  const dynamics::Model<double>& model = robot.model;
  BaseOptions base_options = options.base;
  base_options.mimics = robot.mimics;
  const BaseParameters base = base_parameters(model, base_options);
  std::cout << model.name << ": " << base.rank() << " base parameters of " << base.regrouping.cols() << ", "
            << base.unidentifiable.size() << " without any effect; gap " << io::scientific(base.least_kept)
            << " against " << io::scientific(base.most_dropped) << "\n";
  bool success = true;
  if (options.excite) success = excite(options, model, base, to);
  if (!options.data.empty()) estimate(options, robot, base, to);
  if (!options.excite && options.data.empty()) {
    print(base, base.regrouping * parameter_values(model, base.columns), nullptr, nullptr);
  }
  if (results) std::cout << "\nresults in " << output << "\n" << std::flush;
  for (const std::string& sentence : unwritten) std::cerr << "dyntape: " << sentence << "\n";
  if (!success || !unwritten.empty()) throw Failure{};
}

}  // namespace

void add_identify(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "identify",
      "identify inertial parameters: base parameters are the combinations that torques determine.\nWithout "
      "options: prints the base parameters.\n--excite: finds the motion within the limits from which they "
      "can be estimated best.\n--data: estimates them from a CSV file with columns q, v, a and tau, in any "
      "order, by number (q0, v0, a0, tau0) or by joint (q.elbow, v.elbow, a.elbow, tau.elbow), as solve "
      "writes them.");
  const auto options = std::make_shared<IdentifyOptions>();
  add_robot_options(*command, options->robot);
  command->add_flag("--armature", options->base.columns.armature, "also identify armatures");
  command->add_flag(
      "--friction",
      [options](std::int64_t) { options->base.columns.viscous = options->base.columns.coulomb = true; },
      "also identify viscous and Coulomb friction");
  command
      ->add_option("--friction-width", options->base.columns.smoothing,
                   "W of --friction: Coulomb friction is F tanh(v / W) [rad/s or m/s]")
      ->check(positive_number())
      ->type_name("W")
      ->capture_default_str();
  command->add_flag("--excite", options->excite,
                    "find the motion from which the parameters can be estimated best; writes excitation.csv, "
                    "excitation.svg");
  command->add_option("--period", options->excitation.period, "duration of the motion [s]")
      ->check(positive_number())
      ->type_name("S")
      ->capture_default_str();
  command
      ->add_option("--harmonics", options->excitation.harmonics,
                   "number of harmonics of each joint's Fourier series")
      ->transform(whole_number(2, 50))
      ->capture_default_str();
  command
      ->add_option("--samples", options->excitation.samples,
                   "number of samples per period at which limits are imposed")
      ->transform(whole_number(8, 100000))
      ->capture_default_str();
  command
      ->add_option("--iterations", options->excitation.max_iterations,
                   "largest number of iterations of the optimiser")
      ->transform(whole_number(1, 1000000))
      ->capture_default_str();
  command->add_option("--seed", options->excitation.seed, "seed of the random initial series")
      ->transform(seed())
      ->capture_default_str();
  command->add_flag("--condition", options->condition,
                    "minimise the condition number instead of the volume of the uncertainty ellipsoid");
  command
      ->add_option("--noise", options->noise,
                   "standard deviation of measured torques [N m or N], for the errors of the parameters")
      ->check(positive_number())
      ->capture_default_str();
  add_path(*command, "--data", options->data, "CSV file with measured samples", "samples.csv");
  add_column_options(*command, options->columns);
  add_path(*command, "--output", options->output, "folder for the results", "DIR");
  command->callback([options] {
    if (options->condition) options->excitation.criterion = ExcitationCriterion::kCondition;
    run(*options);
  });
}

}  // namespace dyntape::tools
