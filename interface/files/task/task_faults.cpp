// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/task/task_faults.h>

#include <algorithm>
#include <cmath>

#include <dyntape/interface/files/lists.h>

namespace dyntape {

namespace {

using Eigen::Index;
using Eigen::VectorXd;

class SpecCheck {
 public:
  explicit SpecCheck(const TaskSpec& spec) : spec_(spec) {}

  std::vector<SpecFault> faults() {
    check_sizes();
    if (!faults_.empty()) return std::move(faults_);
    check_followers();
    for (std::size_t k = 0; k < spec_.phases.size(); ++k) check_phase(k);
    check_what_phases_exclude();
    check_tracking();
    check_time_cost();
    for (const TermSpec& term : spec_.terms) check_term(term);
    check_ddp();
    check_rigid_contacts();
    if (spec_.periodic) take(periodic_faults(spec_));
    return std::move(faults_);
  }

 private:
  void note(const std::string& key, const std::string& message) { faults_.push_back({key, message}); }
  // A sentence that begins with the key.
  void refuse(const std::string& key, const std::string& what) { note(key, "'" + key + "' " + what); }
  void take(const std::vector<SpecFault>& faults) {
    faults_.insert(faults_.end(), faults.begin(), faults.end());
  }

  void check_size(const std::string& key, const VectorXd& values, Index n) {
    if (values.size() != n)
      refuse(key, "has " + std::to_string(values.size()) + " entries, expected " + std::to_string(n));
  }

  void check_sizes() {
    const Index nq = spec_.scene.model.nq, nv = spec_.scene.model.nv;
    check_size("start", spec_.start, nq + nv);
    check_size("goal", spec_.goal, nq + nv);
    for (const TaskSpec::Phase& phase : spec_.phases) check_size("phases", phase.goal, nq + nv);
    const TaskSpec::Costs& c = spec_.costs;
    check_size("costs.tracking.q", c.tracking_q, nv), check_size("costs.tracking.v", c.tracking_v, nv);
    check_size("costs.tracking.end.q", c.end_q, nv), check_size("costs.tracking.end.v", c.end_v, nv);
  }

  // A follower is where its leader puts it, at both ends.
  void check_followers() {
    if (spec_.scene.mimics.empty()) return;
    const Ties ties = ties_of(spec_.scene);
    const auto& model = spec_.scene.model;
    const VectorXd q = spec_.start.head(model.nq), v = spec_.start.tail(model.nv);
    const VectorXd to_q = spec_.goal.head(model.nq), to_v = spec_.goal.tail(model.nv);
    for (const dynamics::MimicRule& rule : spec_.scene.mimics) {
      const auto& joint = model.joints[std::size_t(model.joint_index(rule.joint))];
      const auto differs = [](double given, double tied) {
        return !(std::abs(given - tied) <= 1e-9 * std::max(1.0, std::abs(tied)));
      };
      const double by_leader = ties.tied_q(q)[joint.idx_q];
      if (std::isnan(by_leader))
        refuse("start", "leaves joint '" + rule.leader + "' free, which '" + rule.joint +
                            "' follows; expected its position");
      else if (differs(q[joint.idx_q], by_leader) || differs(v[joint.idx_v], ties.tied_v(v)[joint.idx_v]))
        refuse("start", "has joint '" + rule.joint + "' elsewhere than its leader '" + rule.leader +
                            "' puts it; expected what that one gives it");
      if (!std::isnan(to_q[joint.idx_q]) && differs(to_q[joint.idx_q], ties.tied_q(to_q)[joint.idx_q]))
        refuse("goal", "has a position of its own for joint '" + rule.joint + "', which follows '" +
                           rule.leader + "'; expected one for '" + rule.leader + "'");
    }
    if (spec_.periodic)
      refuse("periodic", "is not for robots whose joints follow others; expected 'robot.mimic false'");
  }

  void check_phase(std::size_t k) {
    const TaskSpec::Phase& phase = spec_.phases[k];
    const std::string key = "phases.phase#" + std::to_string(k);
    for (std::size_t i = 0; i < k; ++i)
      if (spec_.phases[i].name == phase.name) note(key, "two phases are called '" + phase.name + "'");
    const auto lands = [&](const std::string& name) {
      return k > 0 && contains(phase.hold, name) && !contains(spec_.phases[k - 1].hold, name);
    };
    for (const auto& [name, by] : phase.moved) {
      if (!lands(name))
        note(key + ".foothold_offset", "'" + name + "' does not land at the beginning of phase '" +
                                           phase.name +
                                           "': it is not held in it, held before, or from the start");
    }
    const auto swings = [&](const HeldContact& contact) {
      return !contains(phase.hold, contact.frame) &&
             std::any_of(spec_.phases.begin() + std::ptrdiff_t(k), spec_.phases.end(),
                         [&](const TaskSpec::Phase& later) { return contains(later.hold, contact.frame); });
    };
    const std::vector<HeldContact>& contacts = spec_.robot.contacts;
    if (phase.clearance > 0 && std::none_of(contacts.begin(), contacts.end(), swings))
      note(key + ".clearance", "no contact is in the air in phase '" + phase.name +
                                   "' and lands in a later one; expected such a contact, or no 'clearance'");
    if (phase.impact && std::none_of(phase.hold.begin(), phase.hold.end(), lands))
      note(key + ".impact", "nothing lands at the beginning of phase '" + phase.name +
                                "'; expected a contact that the phase before does not hold");
  }

  void check_what_phases_exclude() {
    if (spec_.has_soft_goal && !spec_.by_ddp)
      refuse("goal.soft",
             "is of the method ddp; with other methods a goal is met, or left open by 'free' and drawn to by "
             "costs.tracking");
    if (spec_.phases.empty()) return;
    if (spec_.gait) note("gait", "'gait' and 'phases' both say when contacts hold, expected one of them");
    if (!spec_.waypoints.empty())
      refuse("waypoints", "are of motions without phases; expected a 'goal' of the phase that ends there");
    if (spec_.reference) refuse("reference", "is of motions without phases");
  }

  // Distances to what the goal does not say.
  void check_tracking() {
    const TaskSpec::Costs& c = spec_.costs;
    const auto check = [&](bool weighs, bool known, const std::string& key, const std::string& of) {
      if (weighs && !known)
        refuse("costs.tracking." + key, "weighs a distance to '" + of + "', which the file does not give");
    };
    const auto& target = spec_.target;
    const bool has_q = !target && !spec_.periodic;
    check(c.tracking_position > 0, target && target->position, "position", "goal.frame.position");
    check(c.tracking_orientation > 0, target && target->orientation, "orientation", "goal.frame.orientation");
    check(!c.tracking_q.isZero(0), has_q, "q", "goal.q");
    check(!c.end_q.isZero(0), has_q, "end.q", "goal.q");
    const bool has_base = floats(spec_.scene.model) && !target;
    check(c.tracking_base_position > 0, has_base && !std::isnan(spec_.goal[0]), "base_position",
          "goal.base.position");
    check(c.tracking_base_orientation > 0, has_base && !std::isnan(spec_.goal[3]), "base_orientation",
          "goal.base.roll_pitch_yaw");
  }

  // A weight of a duration that is not free.
  void check_time_cost() {
    const auto is_free = [](const TaskSpec::Phase& phase) { return phase.free_time.has_value(); };
    if (spec_.costs.time == 0 || spec_.free_time ||
        std::any_of(spec_.phases.begin(), spec_.phases.end(), is_free))
      return;
    refuse("costs.time",
           "weighs the duration, which is given; expected 'min_duration' and 'max_duration' in 'horizon', "
           "between which it may be found");
  }

  void check_term(const TermSpec& term) {
    if (term.moves && (spec_.free_time || !spec_.phases.empty()))
      note("terms", "'" + term.name + "' moves its target; expected no phases, a given duration");
    if (!spec_.phases.empty() && term.at && *term.at > 0 && *term.at < 1)
      note("terms",
           "'terms." + term.name + "' is at a fraction of a motion in phases; expected running, start, end");
  }

  void check_ddp() {
    if (!spec_.by_ddp) return;
    const std::string method = ", which the method ddp does not support; expected ";
    if (spec_.free_time)
      refuse("horizon.min_duration", "is of a duration to be found" + method + "a given one");
    if (spec_.periodic) refuse("periodic", "is not supported by the method ddp");
    if (!spec_.phases.empty()) refuse("phases", "are not supported by the method ddp");
    if (spec_.robot.form == DynamicsForm::kInverse)
      refuse("transcription.dynamics", "has accelerations and equations for them" + method + "forward");
    if (spec_.optimise.mesh.hessian == HessianKind::kLimitedMemory)
      refuse("transcription.hessian", "is limited_memory" + method + "exact or gauss_newton");
    if (!spec_.robot.contacts.empty())
      refuse("contacts.points",
             "are constraints" + method + "a task without contacts, or the method riccati");
    if (!spec_.around.apart.empty() && spec_.around.barrier == 0)
      refuse(spec_.around.obstacles.empty() ? "bodies" : "obstacles",
             "are to be kept clear of" + method + "a task without them, or the method riccati");
    if (!spec_.optimise.solver.extra.empty())
      refuse("solver.ipopt", "has options of Ipopt" + method + "the method ipopt");
    const auto is_number = [](const Limit& limit) { return !limit.robot && std::isfinite(limit.value); };
    if (is_number(spec_.bounds.positions)) faults_.push_back(limits_of_states("bounds.positions"));
    if (is_number(spec_.bounds.velocities)) faults_.push_back(limits_of_states("bounds.velocities"));
    const TaskSpec::Costs& c = spec_.costs;
    if (spec_.terms.empty() && !spec_.reference && c.tracking_q.isZero(0) && c.tracking_v.isZero(0) &&
        c.end_q.isZero(0) && c.end_v.isZero(0) &&
        c.tracking_position + c.tracking_orientation + c.tracking_base_position +
                c.tracking_base_orientation ==
            0)
      refuse("goal", "is to be met at the end" + method +
                         "weights of the distance from it, in costs.tracking or costs.tracking.end");
  }

  void check_rigid_contacts() {
    if (!spec_.simulated) return;
    const std::string found =
        ", and the scene has rigid contacts, whose times are found; expected one of them";
    if (spec_.by_ddp)
      refuse("solver.method", "is ddp, which knows no rigid contacts; expected riccati or ipopt");
    if (spec_.optimise.mesh.scheme.name != kRigidScheme)
      refuse("transcription.scheme",
             std::string("has to be ") + kRigidScheme +
                 " where the scene has rigid contacts: others do not land within a step");
    if (!spec_.robot.contacts.empty()) refuse("contacts", "are held all along" + found);
    if (!spec_.robot.thrusters.empty())
      refuse("thrusters", "are not simulated in a scene with rigid contacts");
    if (!spec_.phases.empty()) refuse("phases", "say when contacts hold" + found);
    if (spec_.periodic) refuse("periodic", "says when contacts hold" + found);
  }

  const TaskSpec& spec_;
  std::vector<SpecFault> faults_;
};

}  // namespace

std::vector<SpecFault> faults_of(const TaskSpec& spec) { return SpecCheck(completed(spec)).faults(); }

TaskSpec completed(TaskSpec spec) {
  const Index nv = spec.scene.model.nv, nx = spec.scene.model.nq + nv;
  const auto fill = [](VectorXd& values, Index n, double value) {
    if (values.size() == 0) values = VectorXd::Constant(n, value);
  };
  fill(spec.start, nx, Problem::kFree), fill(spec.goal, nx, Problem::kFree);
  for (TaskSpec::Phase& phase : spec.phases) {
    fill(phase.goal, nx, Problem::kFree);
    if (phase.duration == 0) phase.duration = spec.robot.duration;
    if (phase.intervals == 0) phase.intervals = spec.optimise.mesh.intervals;
  }
  for (VectorXd* weights :
       {&spec.costs.tracking_q, &spec.costs.tracking_v, &spec.costs.end_q, &spec.costs.end_v})
    fill(*weights, nv, 0);
  if (spec.periodic) fill(spec.periodic->step.advance, nx - nv, 0);
  for (TaskSpec::Control::Disturbance& push : spec.control.disturbances) fill(push.v, nv, 0);
  for (HeldContact& contact : spec.robot.contacts)
    contact.has_schedule = contact.has_schedule || spec.gait.has_value();
  if (spec.simulated)
    spec.demands.integration_error = spec.demands.between = spec.demands.cost_error =
        std::numeric_limits<double>::infinity();
  return spec;
}

SpecFault limits_of_states(const std::string& key) {
  return {key, "'" + key +
                   "' are limits of states, which the method ddp does not support; expected none, or the "
                   "method riccati"};
}

}  // namespace dyntape
