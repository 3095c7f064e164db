// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/task/task_phases.h>

#include <algorithm>
#include <cmath>

#include <dyntape/autodiff/factorisations.h>
#include <dyntape/interface/files/lists.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/motion/contact_changes.h>
#include <dyntape/interface/motion/robot_configuration.h>
#include <dyntape/interface/motion/standing.h>

namespace dyntape {

namespace {

using Eigen::VectorXd;

// Where contacts are while a phase lasts.
std::vector<HeldContact> held_in(const TaskSpec::Phase& phase, std::vector<HeldContact>& all) {
  for (const auto& [frame, by] : phase.moved) {
    for (HeldContact& contact : all)
      if (contact.frame == frame && contact.place) *contact.place += by;
  }
  std::vector<HeldContact> held;
  for (const HeldContact& contact : all)
    if (contains(phase.hold, contact.frame)) held.push_back(contact);
  return held;
}

// Terms of the whole motion: along it, at its start, at its end.
bool is_of_phase(const TermSpec& term, bool is_first, bool is_last) {
  return !term.at || (*term.at == 0 ? is_first : is_last);
}

// Configurations at the ends of phases: what their goals say, and in proportion to time between those.
std::vector<VectorXd> knots(const TaskSpec& task, const VectorXd& from, const VectorXd& to) {
  const auto& model = task.scene.model;
  const std::size_t n = task.phases.size();
  std::vector<VectorXd> q = {from};
  for (const TaskSpec::Phase& phase : task.phases) q.push_back(phase.goal.head(model.nq));
  q.back() = to;
  std::size_t known = 0;
  for (std::size_t k = 1; k <= n; ++k) {
    if (k < n && q[k].array().isNaN().all()) continue;
    fill_free(model, q[known], q[k]);
    double all = 0, so_far = 0;
    for (std::size_t i = known; i < k; ++i) all += task.phases[i].duration;
    for (std::size_t i = known + 1; i < k; ++i) {
      so_far += task.phases[i - 1].duration;
      q[i] = between(model, q[known], q[k], so_far / all);
    }
    known = k;
  }
  return q;
}

}  // namespace

void compose_phases(Task& task, const VectorXd& from, const VectorXd& to) {
  const std::vector<VectorXd> q = knots(task, from, to);
  std::vector<HeldContact> contacts = task.robot.contacts;
  for (std::size_t k = 0; k < task.phases.size(); ++k) {
    const TaskSpec::Phase& phase = task.phases[k];
    const bool is_last = k + 1 == task.phases.size();
    Task part = task;
    part.parts.clear(), part.phases.clear();
    part.name = phase.name, part.impact = phase.impact;
    part.robot.duration = phase.duration;
    part.robot.contacts = held_in(phase, contacts);
    part.optimise.mesh.intervals = phase.intervals;
    part.free_time = phase.free_time;
    if (k > 0) part.start.setConstant(Problem::kFree);
    if (!is_last) part.goal = phase.goal, part.target = phase.target;
    std::erase_if(part.terms, [&](const TermSpec& term) { return !is_of_phase(term, k == 0, is_last); });
    compose_problem(part, {{0, q[k]}, {1, q[k + 1]}});
    draw_to_goal(part, task, is_last);
    for (const HeldContact& contact : contacts) {
      if (!contact.place) continue;
      if (!contains(phase.hold, contact.frame)) part.problem.add(stays_above(task.scene, contact));
      const bool lands =
          k > 0 && contains(phase.hold, contact.frame) && !contains(task.phases[k - 1].hold, contact.frame);
      if (!lands) continue;
      for (Term& term : landing(task.scene, contact, phase.impact ? Landing::kImpact : Landing::kAtRest))
        task.parts.back().problem.add(std::move(term));
    }
    task.parts.push_back(std::move(part));
  }
}

namespace {

std::string metres(double value) { return io::significant(value, 3) + " m"; }

// Of phases whose contacts land elsewhere.
void add_unmet_footholds(const Task& task, std::vector<std::string>& sentences) {
  constexpr double kThere = 1e-3;  // m
  const VectorXd q = task.start.head(task.scene.model.nq);
  if (!q.allFinite()) return;
  std::vector<HeldContact> contacts = task.robot.contacts;
  bool any_moved = false;
  for (const TaskSpec::Phase& phase : task.phases) {
    const std::vector<HeldContact> held = held_in(phase, contacts);
    const std::string head = "phase '" + phase.name + "': ";
    std::vector<std::pair<std::string, Eigen::Vector3d>> feet;
    for (const HeldContact& contact : held)
      if (contact.place) feet.emplace_back(contact.frame, *contact.place);
    for (const auto& [frame, by] : phase.moved) {
      any_moved = true;
      for (const auto& [name, place] : feet) {
        const double below = task.floor.value_or(0) - place.z();
        if (name == frame && by.z() < 0 && below > kThere)
          sentences.push_back(head + "the foothold of '" + frame + "' is " + metres(below) +
                              " below the floor, which is at z = " + metres(task.floor.value_or(0)));
      }
    }
    if (!any_moved || feet.empty()) continue;
    const Posture pose = reaching(task.scene, q, feet);
    if (!(pose.off > kThere)) continue;
    std::string names;
    for (const auto& foot : feet) names += (names.empty() ? "'" : ", '") + foot.first + "'";
    sentences.push_back(head + "no configuration within the limits of the joints was found in which " +
                        names + (feet.size() > 1 ? " are at their footholds" : " is at its foothold") +
                        "; the nearest misses one by " + metres(pose.off));
  }
}

// F(u) = F0 + G u, which is zero where the controls hold the robot at rest in the state x.
struct Holding {
  // |(x, y)| <= friction z of three controls.
  struct Cone {
    Eigen::Index first;
    double friction;
    Eigen::Vector3d nearest(const Eigen::Vector3d& f) const {
      const double across = f.head<2>().norm();
      if (across <= friction * f.z()) return f;
      if (friction * across <= -f.z()) return Eigen::Vector3d::Zero();
      const double z = (friction * across + f.z()) / (1 + friction * friction);
      return {f.x() * friction * z / across, f.y() * friction * z / across, z};
    }
  };

  VectorXd F0, least;  // least: the controls of least norm
  Eigen::MatrixXd G;
  std::vector<Cone> cones;

  Holding(const Problem& p, const VectorXd& x, const std::vector<HeldContact>& contacts, Eigen::Index first) {
    for (const HeldContact& contact : contacts) {
      for (std::size_t point = 0; point < force_points(contact).size(); ++point, first += 3)
        cones.push_back({first, contact.friction});
    }
    const VectorXd none = VectorXd::Zero(p.n_u());
    F0 = rows(p, x, none);
    G.resize(F0.size(), p.n_u());
    for (Eigen::Index k = 0; k < G.cols(); ++k) G.col(k) = rows(p, x, VectorXd::Unit(p.n_u(), k)) - F0;
    for (Eigen::Index i = 0; i < G.rows();
         ++i) {  // in units of the controls, as rows may be divided by limits
      const double size = G.row(i).cwiseAbs().maxCoeff();
      if (size > 0) G.row(i) /= size, F0[i] /= size;
    }
    if (F0.allFinite() && G.allFinite()) least = least_norm_solution(G, -F0);
  }

  // What is left where the controls are within bounds and forces within their cones, relative to F0; descent entry by entry, and
  // cone by cone.
  double left(const VectorXd& lower, const VectorXd& upper, VectorXd& u) const {
    constexpr int kSweeps = 10000;
    constexpr double kNothing = 1e-7;
    u = least.cwiseMax(lower).cwiseMin(upper);
    for (const Cone& cone : cones) u.segment<3>(cone.first) = cone.nearest(u.segment<3>(cone.first));
    VectorXd r = F0 + G * u;
    for (int sweep = 0; sweep < kSweeps && r.norm() > kNothing * F0.norm(); ++sweep) {
      for (Eigen::Index k = 0; k < u.size(); ++k) {
        const double square = G.col(k).squaredNorm();
        if (square == 0 || is_in_cone(k)) continue;
        const double next = std::clamp(u[k] - G.col(k).dot(r) / square, lower[k], upper[k]);
        r += G.col(k) * (next - u[k]);
        u[k] = next;
      }
      for (const Cone& cone : cones) {
        const auto columns = G.middleCols(cone.first, 3);
        const double steepest = (columns.transpose() * columns).trace();
        if (steepest == 0) continue;
        const Eigen::Vector3d before = u.segment<3>(cone.first);
        const Eigen::Vector3d next = cone.nearest(before - columns.transpose() * r / steepest);
        r += columns * (next - before);
        u.segment<3>(cone.first) = next;
      }
    }
    return r.norm() / std::max(F0.norm(), 1e-300);
  }

 private:
  bool is_in_cone(Eigen::Index k) const {
    return !cones.empty() && k >= cones.front().first && k < cones.back().first + 3;
  }
  static VectorXd rows(const Problem& p, const VectorXd& x, const VectorXd& u) {
    if (!p.residual.empty()) return p.residual(p.stage(0, x, VectorXd::Zero(p.n_a()), u));
    return p.rate(p.stage(0, x, {}, u)).tail(x.size() - p.positions);
  }
};

// Motors that cannot hold the robot at rest at the start, by the least factor of all limits with which they can.
void add_weak_motors(const Task& task, std::vector<std::string>& sentences) {
  constexpr double kHeld = 2e-3, kEnough = 1.02, kMost = 1e3;
  const Task& part = task.parts.empty() ? task : task.parts.front();
  const Problem& p = part.problem;
  const auto& model = task.scene.model;
  const std::vector<std::string> driven = driven_names(task.scene);
  const auto motors = Eigen::Index(driven.size());
  const bool is_at_rest = task.start.allFinite() && task.start.tail(model.nv).isZero(0);
  if (!is_at_rest || motors == 0 || p.n_u() < motors) return;
  const auto pushes = Eigen::Index(part.robot.thrusters.size());
  const Holding holding(p, task.start, part.robot.contacts, motors + pushes);
  if (!holding.F0.allFinite() || !holding.G.allFinite() || holding.F0.isZero(0)) return;
  VectorXd u;
  const auto left_with = [&](double factor) {
    VectorXd lower = p.u.lower, upper = p.u.upper;
    lower.head(motors) *= factor, upper.head(motors) *= factor;
    return holding.left(lower, upper, u);
  };
  if (left_with(kEnough) < kHeld || !(left_with(kMost) < kHeld)) return;  // the latter: it falls anyway
  double weak = 1, strong = kMost;
  for (int k = 0; k < 15; ++k) {
    const double factor = std::sqrt(weak * strong);
    (left_with(factor) < kHeld ? strong : weak) = factor;
  }
  left_with(strong);
  Eigen::Index worst = 0;
  (u.head(motors).array().abs() / p.u.upper.head(motors).array().abs()).maxCoeff(&worst);
  const auto& joint = *std::find_if(model.joints.begin(), model.joints.end(),
                                    [&](const auto& of) { return of.name == driven[std::size_t(worst)]; });
  const double gain = task.robot.unit == ControlUnit::kFraction ? joint.limits.effort : 1;
  const char* unit = joint.type == dynamics::JointType::kPrismatic ? " N" : " N m";
  sentences.push_back("at the start the motors cannot hold the robot at rest: '" +
                      driven[std::size_t(worst)] + "' would have to give " +
                      io::significant(std::abs(u[worst]) * gain, 3) + unit + " at least, and its limit is " +
                      io::significant(p.u.upper[worst] * gain, 3) + unit);
}

}  // namespace

std::vector<std::string> unmet_demands(const Task& task) {
  std::vector<std::string> sentences;
  if (!task.unreachable.empty()) sentences.push_back(task.unreachable);
  add_unmet_footholds(task, sentences);
  add_weak_motors(task, sentences);
  return sentences;
}

std::vector<MeshOptions> meshes_of(const Task& task, const MeshOptions& mesh) {
  std::vector<MeshOptions> meshes(std::max<std::size_t>(1, task.parts.size()), mesh);
  for (std::size_t k = 0; k < task.parts.size(); ++k)
    meshes[k].intervals = task.parts[k].optimise.mesh.intervals;
  return meshes;
}

Phases phases_of(const Task& task) {
  Phases phases(task.name);
  if (task.parts.empty()) phases.add(task.name, task.problem);
  for (const Task& phase : task.parts)
    phases.add(phase.name, phase.problem,
               phase.impact ? impact(phase.scene, phase.robot.contacts) : StageFunction());
  if (!task.closing.empty()) phases.close(task.closing);
  phases.controls = task.problem.controls;
  return phases;
}

}  // namespace dyntape
