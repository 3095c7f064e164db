// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/solve/contact_simulation.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/run/simulate/scene_plant.h>

namespace dyntape {

using Eigen::VectorXd;

namespace {

constexpr double kOfLargest = 0.05, kLeast = 0.02;  // fraction of the largest movement; m or rad
constexpr double kAfar = 10, kLeastAfar = 1e-3;     // relaxations; m

// (nq) The reference of each position's error.
VectorXd movements(const Task& task, const Trajectory& motion) {
  const Eigen::Index nq = task.problem.positions;
  const auto kind = [&](Eigen::Index i) { return unit_of_state(task.scene.model, int(i)) == " m"; };
  std::map<bool, double> largest;
  VectorXd movement(nq);
  for (Eigen::Index i = 0; i < nq; ++i) {
    const auto row = motion.x.row(i);
    movement[i] = row.maxCoeff() - row.minCoeff();
    largest[kind(i)] = std::max(largest[kind(i)], movement[i]);
  }
  for (Eigen::Index i = 0; i < nq; ++i)
    movement[i] = std::max({movement[i], kOfLargest * largest[kind(i)], kLeast});
  return movement;
}

// The fraction of the normal impulses with a wide gap.
double impulse_from_afar(const Task& task, const Trajectory& motion, double wide) {
  const auto& model = task.scene.model;
  const auto& rigid = task.scene.constraints.rigid;
  dynamics::Data<double> data(model);
  double all = 0, afar = 0;
  for (int k = 1; k < motion.points(); ++k) {
    const VectorXd q = motion.x.col(k).head(model.nq);
    const auto rows = dynamics::unilateral_rows<double>(model, data, rigid, q);
    const VectorXd f = motion.u.col(k).tail(rows.J.rows());
    const double h = motion.t[k] - motion.t[k - 1];
    Eigen::Index row = 0;
    for (std::size_t i = 0; i < rigid.contacts.size(); ++i) {
      const double impulse = h * std::max(f[row], 0.0);
      all += impulse;
      if (rows.gap[Eigen::Index(i)] > wide) afar += impulse;
      row += rigid.contacts[i].friction > 0 ? 3 : 1;
    }
  }
  return all > 0 ? afar / all : 0;
}

// Torques of the interval that ends at point k, plus position control at x, at a fraction of the interval.
class Torques {
 public:
  Torques(const Task& task, const Trajectory& motion)
      : task_(task),
        motion_(motion),
        torque_(joint_torque(task.scene, task.robot.unit)),
        dofs_(actuated_dofs(task.scene)) {
    const Eigen::Index driven = Eigen::Index(dofs_.size());
    Stage<double> stage = task.problem.stage(0, {}, {}, task.problem.u.lower);
    lower_ = torque_(stage).head(driven);
    stage.u = task.problem.u.upper;
    upper_ = torque_(stage).head(driven);
    for (const int dof : dofs_) {
      for (const auto& joint : task.scene.model.joints)
        if (joint.idx_v == dof && dynamics::is_single(joint.type)) entries_.push_back(joint.idx_q);
    }
  }

  VectorXd at(int k, double share, const VectorXd& x) const {
    const Problem& problem = task_.problem;
    VectorXd tau = torque_(problem.stage(motion_.t[k], motion_.x.col(k), motion_.a.col(k), motion_.u.col(k)));
    const double stiffness = task_.demands.servo_stiffness, damping = task_.demands.servo_damping;
    for (std::size_t j = 0; j < dofs_.size() && (stiffness > 0 || damping > 0); ++j) {
      const Eigen::Index q = entries_[j], v = problem.positions + dofs_[j];
      const double wanted = motion_.x(q, k - 1) + share * (motion_.x(q, k) - motion_.x(q, k - 1));
      tau[Eigen::Index(j)] += stiffness * (wanted - x[q]) + damping * (motion_.x(v, k) - x[v]);
    }
    return tau.cwiseMax(lower_).cwiseMin(upper_);
  }

 private:
  const Task& task_;
  const Trajectory& motion_;
  StageFunction torque_;
  std::vector<int> dofs_, entries_;
  VectorXd lower_, upper_;
};

// From point k - 1 to k, in steps of the scene.
std::string move(const Torques& torques, const Trajectory& motion, int k, double step, ScenePlant& plant,
                 VectorXd& x) {
  const double from = motion.t[k - 1], h = motion.t[k] - from;
  const int steps = std::max(1, int(std::ceil(h / step * (1 - 1e-9))));
  for (int i = 0; i < steps; ++i) {
    const VectorXd tau = torques.at(k, double(i) / steps, x);
    const double begin = from + h * i / steps, end = from + h * (i + 1) / steps;
    const std::string why = plant.move(x, begin, end, [&](double) { return tau; });
    if (!why.empty()) return "at t = " + io::significant(begin, 3) + " s: " + why;
  }
  return "";
}

// The largest error, from point to point.
void follow(const Task& task, const Trajectory& motion, const std::stop_token& stop,
            ContactSimulation& result) {
  const Problem& problem = task.problem;
  const Torques torques(task, motion);
  const VectorXd movement = movements(task, motion);
  VectorXd x = motion.x.col(0);
  ScenePlant plant(*task.simulated, x, stop);
  for (int k = 1; k < motion.points() && result.trouble.empty(); ++k) {
    result.trouble = stop.stop_requested() ? "the simulation was interrupted"
                                           : move(torques, motion, k, task.simulated->step, plant, x);
    const VectorXd planned = motion.x.col(k);
    const VectorXd d = problem.difference ? problem.difference(planned, x) : VectorXd(x - planned);
    Eigen::Index worst = 0;
    const double error = (d.head(movement.size()).array() / movement.array()).abs().maxCoeff(&worst);
    if (error <= result.error) continue;
    result.error = error, result.off = std::abs(d[worst]), result.time = motion.t[k];
    result.state = problem.states[std::size_t(worst)];
    result.unit = unit_of_state(task.scene.model, int(worst));
  }
}

}  // namespace

std::string ContactSimulation::sentence() const {
  if (!trouble.empty()) return trouble;
  const std::string afar =
      io::significant(100 * from_afar, 2) + " % of the contacts' impulse acts from a distance";
  if (state.empty()) return "nothing is off; " + afar;
  return state + " is off by " + io::significant(off, 3) + unit + " at " + io::significant(time, 3) + " s, " +
         io::significant(100 * error, 2) + " % of its movement; " + afar;
}

ContactSimulation simulate_contacts(const Task& task, const Trajectory& motion, double relaxation,
                                    const std::stop_token& stop) {
  ContactSimulation result;
  result.from_afar = impulse_from_afar(task, motion, std::max(kAfar * relaxation, kLeastAfar));
  try {
    follow(task, motion, stop, result);
  } catch (const Error& e) {
    result.trouble = e.what();
  }
  if (!result.trouble.empty()) result.error = std::numeric_limits<double>::infinity();
  return result;
}

void check_contacts_at_start(const Task& task, const std::stop_token& stop) {
  if (task.problem.start.allFinite()) ScenePlant(*task.simulated, task.problem.start, stop);
}

}  // namespace dyntape
