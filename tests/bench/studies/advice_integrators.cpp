// SPDX-License-Identifier: BSD-3-Clause
//
// Which integrator follows a motion: its controls held over each interval of its mesh, against order 8 to 1e-13.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/system/scene_system.h>
#include <dyntape/interface/system/steps/stepper.h>

#include "advice.h"

namespace dyntape::tools {
namespace {

constexpr double kReference = 1e-13;  // tolerance
constexpr int kMostHalvings = 12;     // of an interval of the mesh

// What of a task a scene's step does not know.
std::string beyond_a_step(const Task& task) {
  if (!task.phases.empty() || !task.closing.empty()) return "the motion has phases";
  if (!task.robot.contacts.empty()) return "held contacts are forces of the plan";
  if (!task.robot.thrusters.empty()) return "thrusters are no motors";
  if (task.robot.unit != ControlUnit::kPhysical) return "controls are fractions (transcription.controls)";
  return "";
}

// The motion of held controls, and how far each state moves.
struct Held {
  std::vector<double> nodes;
  Eigen::MatrixXd u, x;    // (n_u x intervals), (n_x x nodes)
  Eigen::VectorXd extent;  // (n_x)
};

Held held(const Problem& problem, const Trajectory& motion) {
  Held held{motion.nodes(), {}, {}, {}};
  const int n = motion.intervals();
  held.u.resize(motion.u.rows(), n), held.x.resize(motion.x.rows(), n + 1);
  held.x.col(0) = motion.x.col(0);
  for (int k = 0; k < n; ++k) {
    held.u.col(k) = motion.control(k, 0.5);
    const Simulation next = simulate(
        problem, held.x.col(k), held.nodes[std::size_t(k)], held.nodes[std::size_t(k) + 1],
        [&](double) { return Eigen::VectorXd(held.u.col(k)); }, kReference);
    if (!next.trouble.empty()) throw NumericalError(next.trouble);
    held.x.col(k + 1) = next.x;
  }
  held.extent = held.x.rowwise().maxCoeff() - held.x.rowwise().minCoeff();
  held.extent = held.extent.cwiseMax(0.01 * held.extent.maxCoeff());
  return held;
}

struct Run {
  double error = 0, seconds = 0;
  std::string trouble = {};
};

Run run(Stepper& stepper, const Held& held, int steps) {
  Run run;
  const auto begin = std::chrono::steady_clock::now();
  Eigen::VectorXd x = held.x.col(0);
  for (Eigen::Index k = 0; k < held.u.cols() && run.trouble.empty(); ++k) {
    const double from = held.nodes[std::size_t(k)], h = (held.nodes[std::size_t(k) + 1] - from) / steps;
    for (int i = 0; i < steps; ++i)
      if (!stepper.step(from + i * h, h, x.data(), held.u.col(k).data(), nullptr, x.data(), &run.trouble))
        break;
    run.error =
        std::max(run.error, (x - held.x.col(k + 1)).cwiseQuotient(held.extent).lpNorm<Eigen::Infinity>());
  }
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() /
                (held.nodes.back() - held.nodes.front());
  if (run.trouble.empty() && !std::isfinite(run.error)) run.trouble = "the state is not finite";
  return run;
}

}  // namespace

Choice advise_integrator(Study& study, const FollowedMotion& followed) {
  const Task& task = followed.task;
  Choice choice{"integrator", "nothing to choose", NAN, NAN};
  const std::string why = beyond_a_step(task);
  if (!why.empty()) {
    choice.measured = {why};
    return choice;
  }
  study.parts.push_back({.name = "integrators",
                         .title = "Integrators along the motion, its controls held over each interval",
                         .x_label = "time of a simulated second [ms]",
                         .y_label = "largest error, of how far a state moves",
                         .x_scale = 1e3});
  study.methods.push_back(
      "Integrators: their reference is a method of order 8, tolerance 1e-13; the parameter is the step in "
      "seconds, of adaptive ones the relative tolerance.");
  const Held along = held(task.problem, followed.motion);
  const double length = (along.nodes.back() - along.nodes.front()) / double(along.u.cols());
  bool kept = false;
  Timed chosen_again;
  for (const Integrator integrator : kIntegrators) {
    const std::string name = to_string(integrator);
    StudyRow best{"integrators", task.name, name};
    Timed again;
    try {
      std::shared_ptr<Stepper> stepper;
      double spent = 0;
      for (int k = 0; k <= kMostHalvings && spent < followed.per_method; ++k) {
        StudyRow row{"integrators", task.name, name};
        int steps = 1;
        if (is_adaptive(integrator)) {
          row.parameter = followed.error * std::pow(10.0, 1 - k);
          if (row.parameter < 1e-13) break;
          stepper = std::make_shared<Stepper>(
              system_of(task.scene), integrator, task.optimise.mesh.evaluation, false, 1,
              Tolerances{.relative = row.parameter, .absolute = 1e-3 * row.parameter});
        } else {
          steps = 1 << k;
          row.parameter = length / steps;
          if (!stepper)
            stepper =
                std::make_shared<Stepper>(system_of(task.scene), integrator, task.optimise.mesh.evaluation);
        }
        if (stepper->report().step_operations == 0) throw ArgumentError("there is no step");
        const Run now = run(*stepper, along, steps);
        spent += now.seconds;
        row.seconds = now.seconds;
        if (now.trouble.empty())
          row.value = now.error;
        else
          row.trouble = now.trouble;
        study.rows.push_back(row);
        if (now.trouble.empty() && !(row.value >= best.value)) {
          best = row;
          again = [stepper, &along, steps] { return run(*stepper, along, steps).seconds; };
        }
        if (now.trouble.empty() && now.error <= followed.error) break;
      }
    } catch (const Error& refused) {
      study.rows.push_back(
          {.part = "integrators", .subject = task.name, .method = name, .trouble = refused.what()});
    }
    if (std::isnan(best.value)) continue;
    const std::string chosen =
        name + (is_adaptive(integrator) ? ", tolerance " : ", step ") +
        (is_adaptive(integrator) ? io::scientific(best.parameter) : io::duration(best.parameter));
    choice.measured.push_back(chosen + ": " + io::scientific(best.value) + ", " + io::duration(best.seconds) +
                              " a second");
    const bool keeps = best.value <= followed.error;
    const bool first = std::isnan(choice.error);
    if (first || (keeps && !kept) ||
        (keeps == kept && (keeps ? is_quicker(best.seconds, choice.seconds) && is_quicker(again, chosen_again)
                                 : best.value < choice.error))) {
      choice.chosen = chosen, choice.seconds = best.seconds, choice.error = best.value;
      kept = keeps, chosen_again = again;
    }
  }
  study.parts.back().findings = choice.measured;
  return choice;
}

}  // namespace dyntape::tools
