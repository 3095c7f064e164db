// SPDX-License-Identifier: BSD-3-Clause
//
// Makes physical parameters of a robot differentiable (co-design): masses, inertias, lengths, armatures, gravity.
//
//   ModelParameters design(arm, {"mass:forearm_link", "length:wrist_1_joint", "armature:elbow_joint", "gravity:z"});
//   Function f = record_design(arm, design, 18, [](const Model<AD>& robot, const VectorXad& x) {
//     Data<AD> data(robot);
//     return VectorXad(rnea<AD>(robot, data, x.head(6), x.segment(6, 6), x.tail(6)));
//   });                                                         // variables: design (4), parameters: state (18)
//   SparseFunction J = sparse_jacobian(f);                      // dtau/d(design)
//   evaluate(f, design.nominal(), state);
//
//   name                meaning                                                             unit
//   mass:B              mass; centre of mass and inertia about it stay                      kg
//   comx:B  comy:  comz:      centre of mass in the frame of the body                       m
//   Ixx:B  Ixy:  Iyy:  Ixz:  Iyz:  Izz:    inertia about the centre of mass                 kg m^2
//   length:J            factor on the translation from the parent's frame to joint J        1
//   armature:J          reflected rotor inertia, single joints only                         kg m^2 or kg
//   gravity:x  :y  :z   acceleration of free fall in the world                              m/s^2
//
// B names a joint, or a link: then the body that carries it, with all that is fixed to it.  A length changes no
// mass.  Parameters that are not chosen are constants of the recording and cost nothing.
//
// Errors.  ArgumentError: an unknown name (with the nearest), a repeated name, the length of a joint at its parent's
// origin, the armature of a joint that cannot have one.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <dyntape/autodiff/graph/function.h>
#include <dyntape/autodiff/record/eigen.h>
#include <dyntape/dynamics/model/model.h>

namespace dyntape {

class ModelParameters {
 public:
  ModelParameters(const dynamics::Model<double>& model, const std::vector<std::string>& names);

  const std::vector<std::string>& names() const { return names_; }
  std::size_t size() const { return names_.size(); }
  std::vector<double> nominal() const;  // (size) the values of the given robot

  // Returns the robot with other values (size).
  template <class T>
  dynamics::Model<T> apply(const dynamics::VectorRef<T>& values) const {
    dynamics::Model<T> robot = model_.cast<T>();
    for (std::size_t k = 0; k < size(); ++k) set(robot, parts_[k], values[static_cast<Eigen::Index>(k)]);
    return robot;
  }

 private:
  enum class Kind { kMass, kCom, kInertia, kLength, kArmature, kGravity };
  struct Part {
    Kind kind;
    int index = 0;         // of the joint
    int row = 0, col = 0;  // entry of a vector or matrix
  };

  Part part_from(const std::string& name) const;

  // All kinds except lengths.
  template <class Model>
  static auto& entry(Model& robot, const Part& part) {
    switch (part.kind) {
      case Kind::kMass:
        return robot.inertias[part.index].mass;
      case Kind::kCom:
        return robot.inertias[part.index].com[part.row];
      case Kind::kInertia:
        return robot.inertias[part.index].I_c(part.row, part.col);
      case Kind::kArmature:
        return robot.joints[part.index].armature;
      default:
        return robot.gravity[part.row];
    }
  }

  template <class T>
  static void set(dynamics::Model<T>& robot, const Part& part, const T& value) {
    if (part.kind == Kind::kLength) {
      robot.X_PJ[part.index].p = robot.X_PJ[part.index].p * value;
      return;
    }
    entry(robot, part) = value;
    if (part.kind == Kind::kInertia) robot.inertias[part.index].I_c(part.col, part.row) = value;
  }

  dynamics::Model<double> model_;
  std::vector<std::string> names_;
  std::vector<Part> parts_;
};

// Whether the design or the state is the variable of the recording; the other becomes a parameter.  all_as_variables
// (function.h) turns both into variables.
enum class DesignAs { kVariables, kParameters };

using RobotProgram = std::function<VectorXad(const dynamics::Model<AD>& robot, const VectorXad& state)>;

Function record_design(const dynamics::Model<double>& model, const ModelParameters& design,
                       std::size_t n_state, const RobotProgram& program, DesignAs as = DesignAs::kVariables,
                       const char* file = __builtin_FILE(), int line = __builtin_LINE());

}  // namespace dyntape
