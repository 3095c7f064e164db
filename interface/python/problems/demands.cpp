// SPDX-License-Identifier: BSD-3-Clause
//
// What a robot's problem demands and its robot cannot do: warnings before a solve.
#include <algorithm>
#include <cmath>
#include <set>

#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/motion/standing.h>

#include "../problems.h"

namespace dyntape::python {
namespace {

void warn(const std::string& sentence) {
  if (sentence.empty()) return;
  if (PyErr_WarnEx(PyExc_UserWarning, sentence.c_str(), 1) < 0) nb::raise_python_error();
}

std::string noun(bool is_foothold) { return is_foothold ? "foothold" : "target"; }

// The robot with the problem's bounds for the limits of its joints, or its own limits if joints follow others.  Those that
// follow move freely here, so that nothing within reach is said to be beyond it.
RobotScene with_bounds(const PythonProblem& p) {
  RobotScene scene = p.scene;
  if (p.tied) return scene;
  for (auto& joint : scene.model.joints) {
    if (!dynamics::traits(joint.type).on_a_line) continue;
    joint.limits.lower = p.problem.x.lower[joint.idx_q];
    joint.limits.upper = p.problem.x.upper[joint.idx_q];
  }
  return scene;
}

// Of all joints.
Eigen::VectorXd start_of(const PythonProblem& p) {
  const Eigen::VectorXd q = p.all_q(p.problem.start.head(p.nq()));
  return q.allFinite() ? q : dynamics::neutral(p.scene.model);
}

using Feet = std::vector<std::pair<std::string, Eigen::Vector3d>>;

// Positions that are demanded at that share of the duration; without a share: at all times.
Feet demanded_at(const PythonProblem& p, std::optional<double> share, bool& are_footholds) {
  Feet feet;
  are_footholds = true;
  for (const PythonProblem::Demand& demand : p.demands) {
    if (demand.share && demand.share != share) continue;
    const std::pair<std::string, Eigen::Vector3d> foot{demand.at.frame, demand.at.position};
    if (std::find(feet.begin(), feet.end(), foot) == feet.end()) feet.push_back(foot);
    are_footholds = are_footholds && demand.is_foothold;
  }
  return feet;
}

void warn_of_footholds(const PythonProblem& p) {
  for (const PythonProblem::Demand& demand : p.demands) {
    if (demand.floor)
      warn(below_floor(demand.at.frame, demand.at.position, *demand.floor, noun(demand.is_foothold)));
  }
  if (p.demands.empty()) return;
  std::set<std::optional<double>> shares;
  for (const PythonProblem::Demand& demand : p.demands) shares.insert(demand.share);
  if (shares.size() > 1) shares.erase(std::nullopt);  // part of every instant
  const RobotScene scene = with_bounds(p);
  const Eigen::VectorXd q = start_of(p);
  for (const std::optional<double>& share : shares) {
    bool are_footholds = false;
    const Feet feet = demanded_at(p, share, are_footholds);
    const std::string missed = missed_feet(scene, q, feet, noun(are_footholds));
    if (!missed.empty()) warn((share ? "at " + name_of_instant(*share) : "all along") + ": " + missed);
  }
}

// Heights in the middle of swings that no configuration reaches, or of a floating robot no flight.
void warn_of_clearances(const PythonProblem& p) {
  constexpr double kOfFlight = 1. / 8;
  const double duration = p.problem.free_time ? p.problem.free_time->longest : p.problem.duration;
  const Eigen::VectorXd q = start_of(p);
  for (const PythonProblem::Demand& demand : p.demands) {
    if (!(demand.clearance > 0)) continue;
    const std::string head =
        "swing_clearance of '" + demand.at.frame + "' by " + io::significant(demand.clearance, 3) + " m: ";
    if (floats(p.scene.model)) {
      const double most = kOfFlight * p.scene.model.gravity.norm() * duration * duration +
                          2 * limb_length(p.scene.model, demand.at.frame);
      if (demand.clearance > most)
        warn(head + "in " + io::significant(duration, 3) + " s it comes to less than " +
             io::significant(most, 3) + " m");
      continue;
    }
    const Eigen::Vector3d top =
        0.5 * (demand.from + demand.at.position) + Eigen::Vector3d(0, 0, demand.clearance);
    const std::string missed = missed_feet(with_bounds(p), q, {{demand.at.frame, top}}, "place");
    if (!missed.empty()) warn(head + "halfway " + missed);
  }
}

// Constraints that the start violates, whatever the controls and accelerations there are.
void warn_of_start(const Problem& problem) {
  constexpr double kRounding = 1e-6;
  if (!problem.start.allFinite()) return;
  const Stage<double> guess = problem.first_guess(0);
  const auto value_at = [&](const Term& term, double change) {
    return term.function(problem.stage(0, problem.start, (guess.a.array() + change).matrix(),
                                       (guess.u.array() + change).matrix()));
  };
  for (const Term& term : problem.terms) {
    const bool is_there = term.where == Where::kRunning || (term.where == Where::kInstant && term.share == 0);
    if (!is_constraint(term.role) || !is_there) continue;
    const Eigen::VectorXd r = value_at(term, 0), other = value_at(term, 1);
    for (Eigen::Index i = 0; i < r.size(); ++i) {
      const double lower = term.role == Role::kEquality ? 0 : term.lower[i],
                   upper = term.role == Role::kEquality ? 0 : term.upper[i];
      const double off = std::max(lower - r[i], r[i] - upper);
      if (r[i] != other[i] || !(off > kRounding * std::max(1.0, std::abs(r[i])))) continue;
      const std::string entry = r.size() > 1 ? "[" + std::to_string(i) + "]" : "";
      warn("the start contradicts \"" + term.name + "\": " + term.name + entry + " is " +
           io::significant(r[i], 4) + " there, expected " +
           (lower == upper ? io::significant(lower, 4)
            : r[i] < lower ? "at least " + io::significant(lower, 4)
                           : "at most " + io::significant(upper, 4)));
      break;
    }
  }
}

// A floating robot's swing is between footholds, which nothing holds in a problem without contacts.
void warn_of_missing_contacts(const PythonProblem& p) {
  const bool has_swings =
      std::any_of(p.demands.begin(), p.demands.end(), [](const auto& d) { return d.is_foothold; });
  const bool has_contacts = !p.options.contacts.empty() || !p.scene.effects.contacts.empty() ||
                            !p.scene.constraints.rigid.contacts.empty();
  if (!has_swings || has_contacts || !floats(p.scene.model)) return;
  warn("swing_clearance: '" + p.scene.model.name +
       "' floats, and this problem has no contacts, so that it falls; expected Scene.problem of a scene with "
       "effects.contacts, or a task file with contacts and phases");
}

}  // namespace

std::optional<double> floor_under(const RobotScene& scene, const Eigen::Vector3d& position) {
  constexpr double kFloor = 0.5;  // of a normal's z; steeper ones are walls
  std::optional<double> lowest;
  const auto add = [&](const dynamics::Ground<double>& ground) {
    const auto below = ground.below(position);
    if (!(below.normal.z() > kFloor)) return;
    const double height = position.z() - below.distance / below.normal.z();
    lowest = std::min(lowest.value_or(height), height);
  };
  if (!scene.effects.contacts.empty()) add(scene.effects.contacts.ground);
  for (const dynamics::RigidContact& contact : scene.constraints.rigid.contacts) {
    if (contact.plane_body >= 0) continue;
    dynamics::Ground<double> plane;
    plane.normal = contact.normal, plane.offset = contact.offset;
    add(plane);
  }
  return lowest;
}

void warn_of_unmet_demands(const PythonProblem& p) {
  warn_of_start(p.problem);
  if (!p.is_robot) return;
  warn(weak_motors(p.scene, p.options, p.problem, p.problem.start));
  warn(short_duration(p.scene, p.problem));
  warn_of_missing_contacts(p);
  warn_of_clearances(p);
  warn_of_footholds(p);
}

}  // namespace dyntape::python
