// SPDX-License-Identifier: BSD-3-Clause
//
// The dynamics of a robot at a stage of its problem, for one scalar; for robot_problem() and problems that are made of it.
//
//   Plant<double> plant(scene, controls);
//   a = plant.forward(stage);                                    // FD(q, v, B u), of x = (q, v) and u
//   tau = plant.inverse(stage) - plant.driving(stage);           // ID(q, v, a) - B u
//
// B u: control k drives joint dof k.  Then follow forces along axes of frames (thrusters), forces at points of held
// contacts (three each, world axes), and forces of the scene's rigid contacts along their rows (rigid_contacts.h).
//
// Contains working memory: not thread-safe.
#pragma once

#include <utility>
#include <vector>

#include <dyntape/dynamics/contact/rigid_contacts.h>
#include <dyntape/dynamics/effects/effects.h>
#include <dyntape/interface/control/problem/stage.h>
#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape::detail {

// The forces of the controls, with indices of their frames.
struct Drives {
  std::vector<int> dofs;  // of driven joints
  Eigen::VectorXd gain;   // factor of each: torque = gain u
  struct Push {
    int frame;
    Eigen::Vector3d force, moment;  // per newton, in the frame's axes
  };
  std::vector<Push> thrusters;
  std::vector<int> contacts;  // frames of their contact forces
  dynamics::UnilateralConstraints rigid = {};
  Ties ties = {};  // of the scene's mimic joints
  int n_held() const { return int(3 * contacts.size()); }
  int n_rigid() const {
    int rows = 0;
    for (const dynamics::ContactBlock& block : dynamics::blocks_of(rigid)) rows += block.rows;
    return rows;
  }
  int n_u() const { return int(dofs.size() + thrusters.size()) + n_held() + n_rigid(); }
  bool push() const { return !thrusters.empty() || !contacts.empty() || !rigid.empty(); }
};

// Residuals of inverse dynamics with mimic joints, of the torques that are missing: those at leaders include their followers';
// those of followers are their accelerations less what the leaders give them.
template <class T>
dynamics::VectorX<T> tied_rows(const Ties& ties, const dynamics::VectorX<T>& missing,
                               const dynamics::VectorX<T>& a) {
  dynamics::VectorX<T> rows = ties.gathered(missing);
  const dynamics::VectorX<T> tied = ties.tied_v(a);
  for (std::size_t k = 0; k < ties.v.size(); ++k) {
    const auto i = Eigen::Index(k);
    if (ties.v_owners[std::size_t(ties.v[k].index)] != int(k)) rows[i] = a[i] - tied[i];
  }
  return rows;
}

// World axes: (m/s^2, rad/s^2), (m/s, rad/s), m and the frame's axes.
template <class T>
struct HeldFrame {
  dynamics::Motion<T> acceleration, velocity;
  dynamics::Placement<T> placement;
};

template <class T>
struct Plant {
  using Vector = dynamics::VectorX<T>;

  Plant(dynamics::Model<T> m, dynamics::Effects<T> e, Drives d)
      : model(std::move(m)),
        effects(std::move(e)),
        data(model),
        torques(model),
        pushed(model),
        drives(std::move(d)) {
    data.following = drives.ties.template following<T>();
    for (const Drives::Push& push : drives.thrusters)
      pushes.push_back(dynamics::wrench_at_frame<T>(model, push.frame, dynamics::FixedIn::kBody, {}));
    for (int frame : drives.contacts)
      pushes.push_back(dynamics::wrench_at_frame<T>(model, frame, dynamics::FixedIn::kWorld, {}));
  }

  dynamics::Model<T> model;
  dynamics::Effects<T> effects;
  dynamics::Data<T> data;
  dynamics::EffectTorques<T> torques;
  dynamics::WrenchTorques<T> pushed;
  Drives drives;
  std::vector<dynamics::Wrench<T>> pushes;  // of thrusters, then of contacts

  // Of a stage of which the independent joints count.
  Vector q(const Stage<T>& s) const { return drives.ties.tied_q(Vector(s.x.head(model.nq))); }
  Vector v(const Stage<T>& s) const { return drives.ties.tied_v(Vector(s.x.segment(model.nq, model.nv))); }

  Vector command(const Stage<T>& s) const {
    const Vector u = s.u.head(drives.gain.size());
    return torques_at(drives.dofs, Vector(drives.gain.template cast<T>().cwiseProduct(u)), model.nv);
  }
  // The torques at the joints for the controls.
  Vector driving(const Stage<T>& s) {
    Vector tau = dynamics::driving_torques<T>(model, torques, effects, command(s));
    return drives.push() ? Vector(tau + push_torques(s)) : tau;
  }
  // J^T F of the forces among the controls.
  Vector push_torques(const Stage<T>& s) {
    Eigen::Index k = drives.gain.size();
    std::size_t i = 0;
    for (const Drives::Push& push : drives.thrusters) {
      const dynamics::Vector3<T> f(push.force.cast<T>()), m(push.moment.cast<T>());
      pushes[i++].value = {f * T(s.u[k]), m * T(s.u[k])};
      ++k;
    }
    for (; i < pushes.size(); ++i, k += 3) pushes[i].value.linear = s.u.template segment<3>(k);
    if (drives.rigid.empty()) return dynamics::wrench_torques<T>(model, data, pushed, pushes, q(s));
    const Vector of_contacts = touching(s, drives.rigid).J.transpose() * s.u.tail(s.u.size() - k);
    if (pushes.empty()) return of_contacts;
    return of_contacts + dynamics::wrench_torques<T>(model, data, pushed, pushes, q(s));
  }
  // Gaps of rigid contacts, and the rows of their velocities.
  dynamics::UnilateralRows<T> touching(const Stage<T>& s, const dynamics::UnilateralConstraints& rigid) {
    return dynamics::unilateral_rows<T>(model, data, rigid, q(s));
  }
  // What callees are given, which know no other than the robot that moves with v.
  Vector seen_v(const Stage<T>& s) const {
    return effects.acting().coriolis ? v(s) : Vector(Vector::Constant(model.nv, T(0)));
  }
  // Effects that the callees do not include.
  Vector passive(const Stage<T>& s) {
    return dynamics::effect_torques<T>(model, data, torques, effects, q(s), v(s));
  }
  Vector forward(const Stage<T>& s) {
    if (!drives.push())
      return dynamics::forward_dynamics<T>(model, data, torques, effects, q(s), v(s), command(s));
    const Vector arrives = driving(s), tau = arrives + passive(s);
    return dynamics::aba<T>(model, data, q(s), v(s), tau, effects.acting());
  }
  Vector inverse(const Stage<T>& s) {
    return dynamics::inverse_dynamics<T>(model, data, torques, effects, q(s), v(s),
                                         drives.ties.tied_v(Vector(s.a)));
  }
  // A frame at the acceleration a.
  HeldFrame<T> held(const Stage<T>& s, const Vector& a, int frame) {
    dynamics::forward_kinematics<T>(model, data, q(s), v(s), a);
    constexpr auto kAxes = dynamics::ReferenceFrame::kLocalWorldAligned;
    return {dynamics::frame_classical_acceleration(model, data, frame, kAxes),
            dynamics::frame_velocity(model, data, frame, kAxes),
            dynamics::frame_placement(model, data, frame)};
  }
};
}  // namespace dyntape::detail
