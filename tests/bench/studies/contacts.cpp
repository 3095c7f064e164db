// SPDX-License-Identifier: BSD-3-Clause
//
// Contact that gives way and contact that does not: what steps lose, and what they take.
#include <algorithm>
#include <cmath>

#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/table.h>

#include "contact_worlds.h"
#include "study.h"

namespace dyntape::tools {
namespace {

using Eigen::VectorXd;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegree = 3.14159265358979323846 / 180;
constexpr double kFriction = 0.5;
constexpr Integrator kOfRigid[] = {Integrator::kSemiImplicitEuler, Integrator::kRungeKutta4,
                                   Integrator::kImplicitMidpoint};
constexpr double kSteps[] = {1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5};

// A motion of a block: compliant by `values`, or rigid, for so long; what is looked at, and what it should be.
struct Motion {
  std::string label = {};
  BlockValues values = {};
  double restitution = 0;  // of the rigid contact
  double seconds = 1;
  double height = kHalfHeight;   // of compliant ones at the start
  double falls = 0, slides = 0;  // m/s, at the start
  std::function<double(const VectorXd& x)> error = {};
  double finest = 1e-5;  // s
};

// d v - ln(1 + d v) = - d e v - ln(1 - d e v), v = 1: Hunt and Crossley, whatever the stiffness, its exponent and the mass.
double rebound_of(double d) {
  const double lost = d - std::log1p(d);
  double low = 0, high = std::min(1.0, 1 / d);
  for (int k = 0; k < 100; ++k) {
    const double e = 0.5 * (low + high);
    (-d * e - std::log1p(-d * e) < lost ? low : high) = e;
  }
  return low;
}

std::vector<Motion> motions(bool is_rigid) {
  std::vector<Motion> all;
  const double d = 0.3, e = rebound_of(d);
  Motion drop{
      .label = "block that drops: rebound", .values = {.gravity = 0, .dissipation = d}, .restitution = e};
  drop.seconds = 0.06, drop.height = kHalfHeight + 1e-3, drop.falls = 1;
  drop.error = [e](const VectorXd& x) { return std::abs(x[9] - e) / e; };
  all.push_back(drop);

  Motion creep{.label = "block on 20 degrees: creeps"};
  creep.values = {.tilt = 20 * kDegree, .dissipation = 2, .friction = kFriction};
  creep.seconds = 2, creep.finest = 5e-5;
  creep.height -= kMass * 9.81 * std::cos(creep.values.tilt) / (4 * creep.values.stiffness);
  // What lies still on a slope, lies still.
  const double speed = is_rigid ? 0 : std::atanh(std::tan(creep.values.tilt) / kFriction);
  creep.error = [speed](const VectorXd& x) { return std::abs(block_velocity(x)[0] / kSlip - speed); };
  all.push_back(creep);

  Motion slide{.label = "block on 35 degrees: slides"};
  slide.values = {.tilt = 35 * kDegree, .dissipation = 2, .friction = kFriction};
  slide.seconds = 2, slide.finest = 5e-5;
  slide.height -= kMass * 9.81 * std::cos(slide.values.tilt) / (4 * slide.values.stiffness);
  // Much faster than where friction is smooth; what rocks at first changes no impulse.
  slide.slides = 10 * kSlip;
  const double fast =
      slide.slides +
      9.81 * slide.seconds * (std::sin(slide.values.tilt) - kFriction * std::cos(slide.values.tilt));
  slide.error = [fast](const VectorXd& x) { return std::abs(block_velocity(x)[0] / fast - 1); };
  all.push_back(slide);
  return all;
}

// The worst of several places of the onset within a step.
StudyRow measured(Mover& mover, const Motion& motion, bool is_rigid, double step, bool is_adaptive) {
  StudyRow row{"error", motion.label, ""};
  const long steps = is_adaptive ? 1 : std::lround(motion.seconds / step);
  const int onsets = motion.falls > 0 ? 5 : 1;
  double worst = 0, seconds = 0;
  for (int k = 0; k < onsets; ++k) {
    const double later = is_adaptive ? 0 : step * motion.falls * k / onsets;
    VectorXd x = block_at((is_rigid ? std::max(motion.height, kHalfHeight) : motion.height) + later);
    x[7] = motion.slides, x[9] = -motion.falls;
    const Moved moved = mover.run(x, motion.seconds / double(steps), steps,
                                  is_rigid ? VectorXd() : motion.values.parameters());
    seconds += moved.seconds / onsets;
    if (!moved.trouble.empty()) {
      row.trouble = moved.trouble;
      return row;
    }
    const double error = motion.error(moved.x);
    worst = error <= worst ? worst : error;
  }
  row.seconds = seconds / motion.seconds;
  if (worst < 1)
    row.value = worst;
  else
    row.trouble = "its error is " + io::scientific(worst) + ": it is lost";
  return row;
}

void measure_block(Study& study, const StudyOptions& options) {
  const ContactWorld soft = compliant_block(options.config);
  const auto add = [&](StudyRow row, const std::string& method, double parameter) {
    row.method = method, row.parameter = parameter;
    study.rows.push_back(row);
  };
  const auto add_all = [&](Mover& mover, const Motion& motion, bool is_rigid, const std::string& method) {
    for (double step : kSteps) {
      if (step < (options.quick ? 5e-4 : is_rigid ? 1e-4 : motion.finest)) break;
      add(measured(mover, motion, is_rigid, step, false), method, step);
    }
  };
  for (Integrator integrator : kIntegrators) {
    options.watch(std::string("compliant block, ") + to_string(integrator));
    const std::string method = std::string("compliant, ") + to_string(integrator);
    if (is_adaptive(integrator)) {
      for (int digits = 4; digits <= (options.quick ? 6 : 10); digits += 2) {
        Mover mover(soft, integrator, std::pow(10, -digits));
        for (const Motion& motion : motions(false))
          add(measured(mover, motion, false, 0, true), method, std::pow(10, -digits));
      }
      continue;
    }
    Mover mover(soft, integrator);
    for (const Motion& motion : motions(false)) add_all(mover, motion, false, method);
  }
  for (const Motion& motion : motions(true)) {
    const ContactWorld hard = rigid_block(options.config, motion.values, motion.restitution);
    for (Integrator integrator : kOfRigid) {
      options.watch(std::string("rigid block, ") + to_string(integrator));
      Mover mover(hard, integrator);
      add_all(mover, motion, true, std::string("rigid, ") + to_string(integrator));
      if (options.quick) break;
    }
  }
}

// Whether a small turn about y stays small.
bool is_stable(Mover& mover, double stiffness, double step, double* seconds) {
  const double sunk = kMass * 9.81 / (4 * stiffness), omega = block_pitch_frequency(stiffness);
  VectorXd x = block_at(kHalfHeight - sunk);
  const double start = 1e-3 * sunk * omega / 0.15;
  x[11] = start;
  const long at_once = 50;
  *seconds = 0;
  for (int k = 0; k < 40; ++k) {
    const Moved moved = mover.run(x, step, at_once, BlockValues{.stiffness = stiffness}.parameters());
    if (!moved.trouble.empty() || !(std::abs(moved.x[11]) < 30 * start)) return false;
    x = moved.x;
    *seconds += moved.seconds / (40 * double(at_once) * step);
  }
  return true;
}

void measure_limits(Study& study, const StudyOptions& options) {
  const ContactWorld soft = compliant_block(options.config);
  for (Integrator integrator : kIntegrators) {
    if (is_adaptive(integrator)) continue;
    options.watch(std::string("largest step, ") + to_string(integrator));
    Mover mover(soft, integrator);
    for (double stiffness = 1e4; stiffness < (options.quick ? 2e4 : 2e8); stiffness *= 10) {
      const double omega = block_pitch_frequency(stiffness);
      StudyRow row{"limit", "block at rest, d = 0", std::string("compliant, ") + to_string(integrator),
                   stiffness};
      double low = 0.01 / omega, high = 100 / omega, seconds = 0;
      if (is_stable(mover, stiffness, high, &seconds)) {
        row.value = high, row.seconds = seconds;
      } else if (!is_stable(mover, stiffness, low, &row.seconds)) {
        row.trouble = "no step down to 0.01 / omega is stable";
      } else {
        while (high > low * 1.002) {
          const double middle = std::sqrt(low * high);
          if (is_stable(mover, stiffness, middle, &seconds))
            low = middle, row.seconds = seconds;
          else
            high = middle;
        }
        row.value = low;
      }
      study.rows.push_back(row);
    }
  }
}

void measure_standing(Study& study, const StudyOptions& options) {
  const double seconds = 6;
  for (bool is_rigid : {false, true}) {
    const ContactWorld world = quadruped(options.config, is_rigid);
    const VectorXd start = quadruped_touching(world);
    for (Integrator integrator : kIntegrators) {
      if (is_adaptive(integrator) || integrator == Integrator::kVariational) continue;
      const bool is_short = integrator == Integrator::kSemiImplicitEuler ||
                            (!is_rigid && integrator == Integrator::kImplicitVelocity);
      if (options.quick && (!is_short || is_rigid)) continue;
      if (is_rigid && integrator == Integrator::kImplicitVelocity) continue;
      const std::string method = std::string(is_rigid ? "rigid, " : "compliant, ") + to_string(integrator);
      options.watch("quadruped, " + method);
      Mover mover(world, integrator);
      for (double step : kSteps) {
        if (step < (options.quick ? 1e-3 : is_rigid ? 5e-4 : 1e-4)) break;
        const Moved moved = mover.run(start, step, std::lround(seconds / step));
        StudyRow row{"stand",      "quadruped: weight on its feet", method,
                     step,         moved.seconds / seconds,         kNone,
                     moved.trouble};
        StudyRow depth = row;
        depth.subject = "quadruped: its lowest foot [m]";
        if (moved.trouble.empty()) {
          const VectorXd depths = foot_depths(world, moved.x);
          const double carried =
              is_rigid ? moved.pushed : kFootStiffness * depths.cwiseMax(0).array().pow(1.5).sum();
          row.value = std::abs(carried / weight(world) - 1);
          depth.value = std::abs(depths.maxCoeff());
          if (!(row.value < 0.1)) {
            row.trouble = "does not stand: its feet carry " + io::significant(carried / weight(world), 3) +
                          " of its weight";
            depth.trouble = row.trouble, row.value = depth.value = kNone;
          }
        }
        study.rows.push_back(row), study.rows.push_back(depth);
      }
    }
  }
}

// --- What is to be seen -----------------------------------------------------------------------------------

std::vector<std::string> methods_of(const Study& study, const std::string& part, const std::string& subject) {
  std::vector<std::string> names;
  for (const StudyRow& row : study.rows)
    if (row.part == part && row.subject == subject && (names.empty() || names.back() != row.method))
      names.push_back(row.method);
  return names;
}

std::string at(const StudyRow& row) {
  const bool adaptive = row.method.find("adaptive") != std::string::npos;
  return (adaptive ? "tolerance " + io::scientific(row.parameter)
                   : "steps of " + io::duration(row.parameter)) +
         ", " + io::duration(row.seconds) + ", error " + io::scientific(row.value);
}

// Of all compliant points, or rigid ones, the one that takes least for so small an error.
std::string quickest_told(const Study& study, const std::string& subject, const std::string& model,
                          double error) {
  const StudyRow* best = nullptr;
  for (const StudyRow& row : study.rows) {
    if (row.part != "error" || row.subject != subject || row.method.find(model) != 0) continue;
    if (row.value <= error && (!best || row.seconds < best->seconds)) best = &row;
  }
  return "to " + io::scientific(error, 1) + " " + (best ? best->method + " (" + at(*best) + ")" : "none");
}

// The longest step of each method that stands.
std::string longest_told(const Study& study, const std::string& part, const std::string& subject) {
  std::string text;
  for (const std::string& method : methods_of(study, part, subject)) {
    std::vector<StudyRow> rows = curve(study, part, subject, method);
    std::erase_if(rows, [](const StudyRow& row) { return !row.trouble.empty(); });
    text += (text.empty() ? "" : "; ") + method + (rows.empty() ? " never" : " " + at(rows.front()));
  }
  return text;
}

std::string limits_told(const Study& study, double stiffness) {
  const std::string subject = "block at rest, d = 0";
  const double omega = block_pitch_frequency(stiffness);
  std::string text = "Corners of " + io::scientific(stiffness) +
                     " N/m, omega = " + io::significant(omega, 4) + " rad/s, largest step times omega: ";
  for (const std::string& method : methods_of(study, "limit", subject)) {
    const StudyRow& row = point(study, "limit", subject, method, stiffness);
    text += (text.back() == ' ' ? "" : ", ") + method + " " +
            (row.trouble.empty() ? io::significant(row.value * omega, 4) : std::string("none"));
  }
  return text + ". Known: 2 of semi-implicit Euler, 2.828 of Runge-Kutta; 100 is the largest that was tried.";
}

}  // namespace

Study outline_of_contacts() {
  Study study{.name = "contacts",
              .title = "Contacts: compliant and rigid",
              .question = "What does a contact lose, by which model, which scheme and which step?"};
  study.parts = {{.name = "error",
                  .title = "A block that drops, creeps and slides: error against closed forms",
                  .x_label = "time of a simulated second [s]",
                  .y_label = "error, relative or of the slip speed [1]"},
                 {.name = "limit",
                  .title = "The largest stable step",
                  .x = StudyPart::kParameter,
                  .x_label = "stiffness of a corner [N/m]",
                  .y_label = "largest step [s]"},
                 {.name = "stand",
                  .title = "A quadruped that stands",
                  .x_label = "time of a simulated second [s]",
                  .y_label = "error of the weight [1], depth [m]"}};
  return study;
}

Study study_contacts(const StudyOptions& options) {
  Study study = outline_of_contacts();
  measure_block(study, options);
  measure_limits(study, options);
  measure_standing(study, options);
  for (const Motion& motion : motions(false)) {
    std::string text = motion.label + ", quickest (time of a simulated second): ";
    for (double error : {1e-2, 1e-4, 1e-6})
      text += quickest_told(study, motion.label, "compliant", error) + ", ";
    study.parts[0].findings.push_back(text + quickest_told(study, motion.label, "rigid", 1e-6) + ".");
  }
  study.parts[0].findings.push_back(
      "Compliant contact creeps with " + io::significant(std::atanh(std::tan(20 * kDegree) / kFriction), 6) +
      " of the speed over which its friction is smooth, whatever the scheme; rigid "
      "contact lies still.");
  study.parts[1].findings.push_back(limits_told(study, options.quick ? 1e4 : 1e6));
  study.parts[2].findings = {
      "The longest step with which it stands (time of a simulated second, error of the "
      "weight): " +
          longest_told(study, "stand", "quadruped: weight on its feet") + ".",
      "Its lowest foot is so far below ground, or above [m]: " +
          longest_told(study, "stand", "quadruped: its lowest foot [m]") + "."};
  study.methods = {
      "Rebound: no gravity, 1 m/s, d = 0.3 s/m, corners of 1e4 N/m; the speed after it against d v - ln(1 + "
      "d v) = "
      "- d e v - ln(1 - d e v), e = " +
          io::significant(rebound_of(0.3), 12) +
          "; the worst of five places of the onset within a step. Rigid contact is given this e.",
      "Creep: friction 0.5 that is smooth over eps = 1e-2 m/s; (v - eps atanh(tan 20 deg / 0.5)) / eps after "
      "2 s, "
      "known: 0.924332 eps. Rigid contact does not creep: v / eps.",
      "Slide: the speed after 2 s, from 0.1 m/s, ten times that over which friction is smooth, against 0.1 "
      "m/s + g (sin 35 deg - mu cos 35 deg) t.",
      "Standing: 6 s from where the feet touch. Weight: sum of k x^1.5 of the depths by kinematics, or of "
      "the rigid "
      "contacts' forces, over m g; off by more than a tenth is a failure.",
      "Largest step: a block on undamped corners, turned by a thousandth of its depth; 2000 steps, to 0.2 %.",
      "The parameter in the table is the step in s, of adaptive schemes the relative tolerance (the whole "
      "motion is "
      "one step of theirs)."};
  study.left_out = {
      "Rigid contact by the other schemes, and the quadruped by the variational and the adaptive ones."};
  return study;
}

}  // namespace dyntape::tools
