// SPDX-License-Identifier: BSD-3-Clause
//
// A robot as Python holds it: read once, never changed, shared by any number of threads.
#pragma once

#include <compare>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/dynamics/urdf/collisions.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/dynamics/urdf/visuals.h>

#include "robot_routes.h"

namespace dyntape::python {

struct RobotBodies;  // bridges/bodies.h

// What was read, and how: a robot is pickled as this.
struct RobotSourceText {
  std::string text, file;
  dynamics::UrdfOptions options;
  Eigen::Vector3d gravity{0, 0, -9.81};
  std::shared_ptr<const RobotBodies> bodies = nullptr;  // in the place of all but gravity
};

// A call of a function of the table: what the caller says in words.
struct RobotCall {
  int row = 0;
  bool many = false;    // states at a time
  std::string route{};  // or a device
  RobotDevice device{};
  std::string frame{}, axes = "aligned";  // frame: empty, the last
  std::vector<std::string> contacts{};
  auto operator<=>(const RobotCall&) const = default;
};

class Robot {
 public:
  explicit Robot(RobotSourceText source);

  const RobotSourceText source;
  const dynamics::UrdfRobot urdf;
  const int nq, nv;  // of states: joints that follow others have no entries

  const dynamics::Model<double>& model() const { return urdf.model; }
  // Its shapes, read anew; `what` says which.
  dynamics::UrdfVisuals visuals(const dynamics::VisualOptions& what = {}) const;
  // Where it touches, likewise.
  dynamics::UrdfCollisions collisions() const;

  // What is called; ArgumentError for words that say nothing.
  RobotFunction function(const RobotCall& call) const;
  // Made at the first such call, then the same.
  std::shared_ptr<RobotPath> route(const RobotCall& call) const;
  // The same for a call that says nothing, found without any comparison of words.
  RobotPath& default_route(int row, bool many) const;

  // The dynamics to be called in a recording, made once (robot/robot_callee.h); null where they are recorded whole.
  std::shared_ptr<const Callee> callee(const RobotFunction& function) const;

 private:
  mutable std::mutex mutex_;
  mutable std::map<RobotCall, std::shared_ptr<RobotPath>> routes_;
  mutable std::vector<std::shared_ptr<RobotPath>> defaults_[2];
  mutable std::map<int, std::shared_ptr<const Callee>> callees_;
};

// Which route serves where nothing is said: plain double code for one state, lanes for batches.
inline const char* default_word(bool many) { return many ? kLanes : "analytic"; }

void bind_robot(nb::module_& module);
void bind_robot_methods(nb::module_& module, nb::class_<Robot>& robot);
void bind_configurations(nb::class_<Robot>& robot);
void bind_nonzeros(nb::module_& module, nb::class_<Robot>& robot);
void bind_casadi(nb::class_<Robot>& robot);                       // bridges/casadi.cpp
void bind_bodies(nb::module_& module, nb::class_<Robot>& robot);  // bridges/robot_of_bodies.cpp
void bind_shapes(nb::class_<Robot>& robot);                       // bridges/shapes.cpp

}  // namespace dyntape::python
