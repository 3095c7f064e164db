// SPDX-License-Identifier: BSD-3-Clause
//
// A robot as Python holds it: read once, never changed, shared by any number of threads.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <tuple>
#include <vector>

#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/dynamics/urdf/urdf.h>

#include "robot_routes.h"

namespace dyntape::python {

// What was read, and how: a robot is pickled as this.
struct RobotSourceText {
  std::string text, file;
  dynamics::UrdfOptions options;
  Eigen::Vector3d gravity{0, 0, -9.81};
};

class Robot {
 public:
  explicit Robot(RobotSourceText source);

  const RobotSourceText source;
  const dynamics::UrdfRobot urdf;
  const int nq, nv;  // of states: joints that follow others have no entries

  const dynamics::Model<double>& model() const { return urdf.model; }

  // A function of the table for this robot; `frame` empty: the last.
  RobotFunction function(int row, const std::string& frame, const std::string& axes,
                         const std::vector<std::string>& contacts) const;
  // Made at the first call, then the same; `many` states at a time.
  std::shared_ptr<RobotPath> route(const RobotFunction& function, const std::string& word, bool many) const;
  // The same for the default route of a function without a frame, which is found without any comparison of names.
  RobotPath& default_route(int row, bool many) const;

  // The dynamics to be called in a recording, made once (robot/robot_callee.h); null where they are recorded whole.
  std::shared_ptr<const Callee> callee(const RobotFunction& function) const;

 private:
  using Key = std::tuple<RobotFunction, std::string, bool>;

  mutable std::mutex mutex_;
  mutable std::map<Key, std::shared_ptr<RobotPath>> routes_;
  mutable std::vector<std::shared_ptr<RobotPath>> defaults_[2];
  mutable std::map<int, std::shared_ptr<const Callee>> callees_;
};

// Which route serves where nothing is said: plain double code for one state, lanes for batches.
inline const char* default_word(bool many) { return many ? kLanes : "analytic"; }

void bind_robot(nb::module_& module);
void bind_robot_methods(nb::module_& module, nb::class_<Robot>& robot);
void bind_configurations(nb::class_<Robot>& robot);

}  // namespace dyntape::python
