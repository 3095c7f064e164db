// SPDX-License-Identifier: BSD-3-Clause
//
// A robot with its effects and driven joints: the input of simulation and optimal control.
//
//   RobotScene scene{load_urdf("cart_pole.urdf"), {}, {"slider"}};
//   scene.effects.damping = dynamics::model_damping(scene.model);
//   const std::vector<int> dofs = actuated_dofs(scene);                  // of the commands
//   VectorX<double> tau = torques_at(dofs, commands, scene.model.nv);    // zero for other joints
//
// Only the chosen effects are recorded (dynamics/effects/effects.h).
//
// Mimic joints follow others by the rules of `mimics`.  States contain all joints; the dynamics satisfy the rules.
// Followers have no motors.
//
// Errors.  ArgumentError: a driven joint that is unknown, named twice, of several degrees of freedom, or a follower.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <dyntape/dynamics/effects/effects.h>
#include <dyntape/dynamics/model/mimic_rules.h>
#include <dyntape/interface/robot/scene_constraints.h>

namespace dyntape {

struct RobotScene {
  dynamics::Model<double> model;
  dynamics::Effects<double> effects = {};
  std::vector<std::string> actuated = {};  // joints; empty: all independent ones with one degree of freedom
  // (s) time constant of each motor's torque m: m' = (u - m) / lag; 0 or empty: no lag.
  Eigen::VectorXd lag = {};
  SceneConstraints constraints = {};  // loops, rigid contacts, hard limits
  std::vector<dynamics::MimicRule> mimics = {};
};

// Converts vectors of all joints to vectors of the independent joints and back, by the rules of mimic joints
// (dynamics/model/following.h).  If no joint follows another: is empty, and conversions return their argument.
struct Ties {
  std::vector<dynamics::FollowedEntry> q, v;  // (nq), (nv) the rule of each entry
  std::vector<int> q_owners, v_owners;        // index among all joints, for each independent entry

  bool empty() const { return v.empty(); }
  // For Data::following.
  template <class T>
  std::optional<dynamics::Following<T>> following() const {
    if (empty()) return std::nullopt;
    return dynamics::Following<T>(v, int(v_owners.size()));
  }
  template <class T>
  dynamics::VectorX<T> all_q(const dynamics::VectorX<T>& own) const {
    return expanded(q, own);
  }
  template <class T>
  dynamics::VectorX<T> all_v(const dynamics::VectorX<T>& own) const {
    return expanded(v, own);
  }
  template <class T>
  dynamics::VectorX<T> own_q(const dynamics::VectorX<T>& all) const {
    return owned(q_owners, all);
  }
  template <class T>
  dynamics::VectorX<T> own_v(const dynamics::VectorX<T>& all) const {
    return owned(v_owners, all);
  }
  // Returns the vector with each follower at the value that its leader determines.
  template <class T>
  dynamics::VectorX<T> tied_q(const dynamics::VectorX<T>& all) const {
    return all_q(own_q(all));
  }
  template <class T>
  dynamics::VectorX<T> tied_v(const dynamics::VectorX<T>& all) const {
    return all_v(own_v(all));
  }
  // G^T tau: adds the torques of followers, times their factors, to their leaders, and sets them to zero.
  template <class T>
  dynamics::VectorX<T> gathered(dynamics::VectorX<T> tau) const {
    for (std::size_t k = 0; k < v.size(); ++k) {
      const int leader = v_owners[std::size_t(v[k].index)];
      if (leader == int(k)) continue;
      tau[leader] += T(v[k].factor) * tau[Eigen::Index(k)];
      tau[Eigen::Index(k)] = T(0);
    }
    return tau;
  }
  // J G, for a matrix J (rows x nv).
  Eigen::MatrixXd columns(const Eigen::MatrixXd& J) const;
  // Narrows a leader's bounds of position (nq) or velocity (nv), so that its followers stay within their bounds.
  void narrow_q(Eigen::Ref<Eigen::VectorXd> lower, Eigen::Ref<Eigen::VectorXd> upper) const;
  void narrow_v(Eigen::Ref<Eigen::VectorXd> lower, Eigen::Ref<Eigen::VectorXd> upper) const;

 private:
  template <class T>
  dynamics::VectorX<T> expanded(const std::vector<dynamics::FollowedEntry>& entries,
                                const dynamics::VectorX<T>& own) const {
    if (empty()) return own;
    dynamics::VectorX<T> all = dynamics::VectorX<T>::Constant(Eigen::Index(entries.size()), T(0));
    dynamics::detail::expand<T>(entries, own, all);
    return all;
  }
  template <class T>
  dynamics::VectorX<T> owned(const std::vector<int>& owners, const dynamics::VectorX<T>& all) const {
    if (empty()) return all;
    return all(owners);
  }
};

// ArgumentError for rules that check_mimic_rules refuses.
Ties ties_of(const RobotScene& scene);
// The rule of a joint; null if the joint is independent.
const dynamics::MimicRule* rule_of(const RobotScene& scene, const std::string& joint);
// Independent joints of one degree of freedom.
std::vector<std::string> independent_joints(const RobotScene& scene);

// An ArgumentError that names the robot.
[[noreturn]] void refuse(const dynamics::Model<double>& model, const std::string& what);

// Degrees of freedom that are driven, in the order of the commands.
std::vector<int> actuated_dofs(const RobotScene& scene);

// Joints that are driven, in the same order.
std::vector<std::string> driven_names(const RobotScene& scene);

// (nv) the torques of the drives: drive k at degree of freedom dofs[k].
template <class Drive>
dynamics::VectorX<typename Drive::Scalar> torques_at(const std::vector<int>& dofs, const Drive& drive,
                                                     int nv) {
  using T = typename Drive::Scalar;
  dynamics::VectorX<T> tau = dynamics::VectorX<T>::Constant(nv, T(0));
  for (std::size_t k = 0; k < dofs.size(); ++k) tau[dofs[k]] = drive[Eigen::Index(k)];
  return tau;
}

// Returns true if the base is a free-flyer.
bool floats(const dynamics::Model<double>& model);

// The unit of an entry of (q, v), e.g. " rad/s"; "" for entries of a quaternion, or a cosine and sine.
std::string unit_of_state(const dynamics::Model<double>& model, int index);

// Column names of q ("q") or v ("v") in tables: q.elbow; q0, q1, ... if the joint has several entries.
std::vector<std::string> entry_names(const dynamics::Model<double>& model, const std::string& block);

}  // namespace dyntape
