// SPDX-License-Identifier: BSD-3-Clause
//
// The description of a robot: a tree of rigid bodies, one joint before each.
//
//   Model<double> model = load_urdf("arm.urdf", {.base = Base::kFixed});
//   Model<AD>     taped = model.cast<AD>();           // same robot, constants on the tape
//
// Numbering.  Joint i carries body i (0 <= i < njoints()); parent[i] < i, and parent[i] == -1 is the world.
// Joints appear in the order in which a depth-first walk of the URDF meets them, children by joint name, so
// that q, v, a and tau are interchangeable with Pinocchio's.  Fixed joints do not appear: their bodies are
// merged into the body they are fixed to and remain as frames.
//
// Frames.  Everything about body i is expressed in the frame of joint i's moving side (frame i), which is the
// URDF link frame of the link behind it.  `X_PJ[i]` places the fixed side of joint i in the frame of its
// parent: p_P = R p_J + p.  Units: kg, m, rad, s.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include <dyntape/dynamics/spatial.h>

namespace dyntape::dynamics {

enum class Base { kFixed, kFloating };

enum class JointType {
  kRevolute,    // nq 1, nv 1: angle about the axis
  kContinuous,  // nq 2, nv 1: (cos, sin) of an unbounded angle
  kPrismatic,   // nq 1, nv 1: displacement along the axis
  kFreeFlyer,   // nq 7, nv 6: position, quaternion (x y z w); velocity (linear, angular) in the moving frame
};

// Names as `info` prints them.
const char* to_string(JointType type);
int nq(JointType type);
int nv(JointType type);

struct JointLimits {
  double lower, upper;  // position; +-inf where the file gives none
  double velocity;      // >= 0, +inf where the file gives none
  double effort;        // >= 0, +inf where the file gives none
};

template <class T>
struct Joint {
  std::string name;
  JointType type = JointType::kRevolute;
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  // unit length; unused by the free-flyer
  int idx_q = 0, idx_v = 0;                         // where this joint's entries start in q and v
  JointLimits limits;
  T armature = T(0);   // reflected rotor inertia added to the diagonal of M (kg m^2 or kg)
  T damping = T(0);    // from the file; acts only where an effect asks for it (effects.h)
  T friction = T(0);   // likewise
};

// A named place on a body: a URDF link (or joint) frame.
template <class T>
struct Frame {
  std::string name;
  int body = -1;         // joint index of the body it is attached to, -1 for the world
  Placement<T> X_BF;     // frame in the body
};

template <class T>
struct Model {
  std::string name;
  std::vector<int> parent;              // (njoints) index of the parent joint, -1 = world
  std::vector<Joint<T>> joints;         // (njoints)
  std::vector<Placement<T>> X_PJ;       // (njoints) fixed side of joint i in the frame of its parent
  std::vector<Inertia<T>> inertias;     // (njoints) of body i, in frame i
  std::vector<Frame<T>> frames;         // every link of the file, in depth-first order
  Eigen::Matrix<T, 3, 1> gravity{T(0), T(0), T(-9.81)};  // acceleration of free fall, world frame (m/s^2)
  int nq = 0, nv = 0;

  int njoints() const { return static_cast<int>(joints.size()); }

  // Index of the joint or frame of that name; ArgumentError with the nearest name if there is none.
  int joint_index(const std::string& joint_name) const;
  int frame_index(const std::string& frame_name) const;

  // Appends a joint and its body; the one way to grow a model.  Returns its index.
  int add_joint(int parent_joint, const Joint<T>& joint, const Placement<T>& X_PJ, const Inertia<T>& inertia);

  template <class S>
  Model<S> cast() const;
};

}  // namespace dyntape::dynamics
