// SPDX-License-Identifier: BSD-3-Clause
//
// The model of a robot: a tree of rigid bodies, each with the joint before it.
//
//   Model<double> model = load_urdf("arm.urdf", {.base = Base::kFixed});
//   Model<AD>     taped = model.cast<AD>();           // the same robot with constants on the tape
//
// Numbering.  Joint i carries body i (0 <= i < njoints()).  parent[i] < i; parent[i] == -1 is the world.  Joints are
// in the order of a depth-first walk of the URDF, children by joint name, so q, v, a and tau are interchangeable
// with Pinocchio's.  Fixed joints do not appear: their bodies are merged into the body before, and remain as frames.
//
// Frames.  All data of body i are in the frame of joint i's moving side (frame i), the URDF frame of the link after
// the joint.  `X_PJ[i]` places the fixed side of joint i in the frame of its parent: p_P = R p_J + p.  Units: kg, m,
// rad, s.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

#include <dyntape/autodiff/suggest.h>
#include <dyntape/dynamics/algebra/spatial.h>

namespace dyntape::dynamics {

enum class Base { kFixed, kFloating };

enum class JointType {  // in the order of kJointTraits
  kRevolute,            // nq 1, nv 1: angle about the axis
  kContinuous,          // nq 2, nv 1: (cos, sin) of an unbounded angle
  kPrismatic,           // nq 1, nv 1: displacement along the axis
  kHelical,    // nq 1, nv 1: angle about the axis, with a displacement of pitch times the angle along it
  kSpherical,  // nq 4, nv 3: quaternion (x y z w); angular velocity in the moving frame
  kPlanar,  // nq 4, nv 3: x, y, (cos, sin) of the angle about z; velocity (x, y, angular) in the moving frame
  kFreeFlyer,  // nq 7, nv 6: position, quaternion (x y z w); velocity (linear, angular) in the moving frame
};

// Properties of joint types, as constants; joints.h has the functions that differ by joint type.
struct JointTraits {
  const char* name;  // as `info` prints it
  int nq, nv;
  bool single;     // one column S: it has an axis, limits, an armature, damping and friction
  bool on_a_line;  // q is one number, and q (+) v = q + v
  bool has_angle;  // q is an angle
};
inline constexpr JointTraits kJointTraits[] = {
    {"revolute", 1, 1, true, true, true},     {"continuous", 2, 1, true, false, false},
    {"prismatic", 1, 1, true, true, false},   {"helical", 1, 1, true, true, true},
    {"spherical", 4, 3, false, false, false}, {"planar", 4, 3, false, false, false},
    {"free-flyer", 7, 6, false, false, false}};
constexpr const JointTraits& traits(JointType type) { return kJointTraits[static_cast<int>(type)]; }
constexpr const char* to_string(JointType type) { return traits(type).name; }
constexpr int nq(JointType type) { return traits(type).nq; }
constexpr int nv(JointType type) { return traits(type).nv; }
constexpr bool is_single(JointType type) { return traits(type).single; }

struct JointLimits {
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  double lower = -kNone, upper = kNone;  // position; +-inf if the file has none
  double velocity = kNone;               // >= 0, +inf if the file has none
  double effort = kNone;                 // >= 0, +inf if the file has none
};

template <class T>
struct Joint {
  std::string name;
  JointType type = JointType::kRevolute;
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  // unit length; used by single joints only
  int idx_q = 0, idx_v = 0;                         // where this joint's entries start in q and v
  JointLimits limits;
  T armature = T(0);  // reflected rotor inertia added to the diagonal of M (kg m^2 or kg); single joints only
  T damping = T(0);   // from the file; acts only if an effect uses it (effects.h)
  T friction = T(0);  // likewise
  double pitch = 0;   // displacement per angle of a helical joint (m/rad)
};

// A named frame on a body: a URDF link (or joint) frame.
template <class T>
struct Frame {
  std::string name;
  int body = -1;      // joint index of the body it is attached to, -1 for the world
  Placement<T> X_BF;  // frame in the body
};

template <class T>
struct Model {
  std::string name;
  std::vector<int> parent;                   // (njoints) index of the parent joint, -1 = world
  std::vector<Joint<T>> joints;              // (njoints)
  std::vector<Placement<T>> X_PJ;            // (njoints) fixed side of joint i in the frame of its parent
  std::vector<Inertia<T>> inertias;          // (njoints) of body i, in frame i
  std::vector<Frame<T>> frames;              // every link of the file, in depth-first order
  Vector3<T> gravity{T(0), T(0), T(-9.81)};  // acceleration of free fall, world frame (m/s^2)
  int nq = 0, nv = 0;

  int njoints() const { return static_cast<int>(joints.size()); }

  // Index of the joint or frame of that name; ArgumentError with the nearest name if there is none.
  int joint_index(const std::string& joint_name) const;
  int frame_index(const std::string& frame_name) const;

  // Appends a joint and its body; the only way to extend a model.  Returns its index.
  int add_joint(int parent_joint, const Joint<T>& joint, const Placement<T>& X_PJ, const Inertia<T>& inertia);

  // Appends a universal joint and its body: name_1 turns a massless cross about axis_1, name_2 turns the body about
  // axis_2, an axis of the cross.  q and v are the two angles and their rates; each axis S is constant in its frame.
  // ArgumentError for parallel axes.  Returns the index of the second joint.
  int add_universal(int parent_joint, const std::string& joint_name, const Eigen::Vector3d& axis_1,
                    const Eigen::Vector3d& axis_2, const Placement<T>& X_PJ, const Inertia<T>& inertia);

  // The same robot with constants of scalar S.  S = double needs a static_cast from T to double.
  template <class S>
  Model<S> cast() const;
};

namespace detail {

// Index of `wanted` among n names, or -1.
int place_of(const std::string& wanted, const std::vector<std::string>& names);

// Throws ArgumentError with `what`, the model and the nearest name.
[[noreturn]] void refuse_name(const std::string& what, const std::string& model_name,
                              const std::string& wanted, const std::string& meant);

// Checks the conditions of add_joint: an existing parent, an axis of unit length, a finite pitch.
void check_new_joint(const std::string& name, JointType type, const Eigen::Vector3d& axis, double pitch,
                     int parent, int njoints);
void check_universal(const std::string& name, const Eigen::Vector3d& axis_1, const Eigen::Vector3d& axis_2);

template <class T>
std::vector<std::string> names_of(const std::vector<T>& named) {
  std::vector<std::string> names;
  for (const T& entry : named) names.push_back(entry.name);
  return names;
}

}  // namespace detail

// A suggestion for a name that no frame has, for the end of a message: the link of the joint with this name, else
// the nearest frame.
template <class T>
std::string meant_frame(const Model<T>& model, const std::string& wanted) {
  const int joint = detail::place_of(wanted, detail::names_of(model.joints));
  for (const Frame<T>& frame : model.frames) {
    if (joint >= 0 && frame.body == joint) return "; that is a joint, and its link is '" + frame.name + "'";
  }
  return suggestion(wanted, detail::names_of(model.frames));
}

template <class T>
int Model<T>::joint_index(const std::string& joint_name) const {
  const auto names = detail::names_of(joints);
  const int index = detail::place_of(joint_name, names);
  if (index < 0) detail::refuse_name("joint", name, joint_name, suggestion(joint_name, names));
  return index;
}

template <class T>
int Model<T>::frame_index(const std::string& frame_name) const {
  const int index = detail::place_of(frame_name, detail::names_of(frames));
  if (index < 0) detail::refuse_name("frame", name, frame_name, meant_frame(*this, frame_name));
  return index;
}

template <class T>
int Model<T>::add_joint(int parent_joint, const Joint<T>& joint, const Placement<T>& placement,
                        const Inertia<T>& inertia) {
  detail::check_new_joint(joint.name, joint.type, joint.axis, joint.pitch, parent_joint, njoints());
  parent.push_back(parent_joint);
  joints.push_back(joint);
  joints.back().idx_q = nq;
  joints.back().idx_v = nv;
  X_PJ.push_back(placement);
  inertias.push_back(inertia);
  nq += dynamics::nq(joint.type);
  nv += dynamics::nv(joint.type);
  return njoints() - 1;
}

template <class T>
int Model<T>::add_universal(int parent_joint, const std::string& joint_name, const Eigen::Vector3d& axis_1,
                            const Eigen::Vector3d& axis_2, const Placement<T>& placement,
                            const Inertia<T>& inertia) {
  detail::check_universal(joint_name, axis_1, axis_2);
  Joint<T> joint;
  joint.name = joint_name + "_1";
  joint.axis = axis_1;
  const int cross = add_joint(parent_joint, joint, placement, {});
  joint.name = joint_name + "_2";
  joint.axis = axis_2;
  return add_joint(cross, joint, {}, inertia);
}

template <class T>
template <class S>
Model<S> Model<T>::cast() const {
  Model<S> m;
  m.name = name;
  m.parent = parent;
  m.nq = nq;
  m.nv = nv;
  m.gravity = gravity.template cast<S>();
  for (int i = 0; i < njoints(); ++i) {
    const Joint<T>& j = joints[i];
    m.joints.push_back({j.name, j.type, j.axis, j.idx_q, j.idx_v, j.limits, static_cast<S>(j.armature),
                        static_cast<S>(j.damping), static_cast<S>(j.friction), j.pitch});
    m.X_PJ.push_back(X_PJ[i].template cast<S>());
    m.inertias.push_back(inertias[i].template cast<S>());
  }
  for (const Frame<T>& f : frames) m.frames.push_back({f.name, f.body, f.X_BF.template cast<S>()});
  return m;
}

}  // namespace dyntape::dynamics
