// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/planar_keys.h>

#include <cmath>

#include <dyntape/autodiff/suggest.h>
#include <dyntape/interface/files/lists.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

using Eigen::Vector2d;
using io::Section;

struct PlanarState {
  std::string joint;
  Vector2d position{0, 0}, velocity{0, 0};
  double turn = 0, turn_rate = 0;
};

Vector2d read_pair(Section& block, const std::string& key, const io::Range& range) {
  const std::string text = block.get_or(key, "0 0");
  return numbers_in(block, key, text, 2, range, "the plane has two axes", false);
}

PlanarState read_planar_state(Section& block) {
  PlanarState state;
  state.joint = block.about("name of the joint; absent: the only planar joint").get_or("joint", "");
  state.position =
      read_pair(block.about("position along x and y of the joint's plane [m]"), "position", metres());
  state.turn = block.about("angle about the plane's normal [rad]").get_or("angle", 0.0, plain_numbers());
  state.velocity =
      read_pair(block.about("velocity in the moving axes of the joint [m/s]"), "velocity", plain_numbers());
  state.turn_rate = block.about("angular velocity about the plane's normal [rad/s]")
                        .get_or("angular_velocity", 0.0, plain_numbers());
  return state;
}

}  // namespace

std::vector<std::string> planar_names(const dynamics::Model<double>& model) {
  std::vector<std::string> names;
  for (const auto& joint : model.joints) {
    if (joint.type == dynamics::JointType::kPlanar) names.push_back(joint.name);
  }
  return names;
}

std::vector<std::string> read_planar(Section& state, const dynamics::Model<double>* model, Eigen::VectorXd& q,
                                     Eigen::VectorXd& v) {
  if (!state.has("planar")) return {};
  std::vector<std::string> placed;
  const std::vector<std::string> names = model ? planar_names(*model) : std::vector<std::string>{};
  for (Section& block : state.each("planar")) {
    PlanarState s = read_planar_state(block);
    if (!model) continue;
    if (s.joint.empty() && names.size() == 1) s.joint = names[0];
    if (!contains(names, s.joint)) {
      state.problem("planar", names.empty() ? "'" + state.path() + ".planar': this robot has no planar joint"
                                            : "'" + state.path() + ".planar' names no planar joint" +
                                                  suggestion(s.joint, names));
      continue;
    }
    if (contains(placed, s.joint))
      state.problem("planar", "'" + state.path() + ".planar' places '" + s.joint + "' twice");
    placed.push_back(s.joint);
    const auto& joint = model->joints[std::size_t(model->joint_index(s.joint))];
    q.segment<4>(joint.idx_q) << s.position, std::cos(s.turn), std::sin(s.turn);
    v.segment<3>(joint.idx_v) << s.velocity, s.turn_rate;
  }
  return placed;
}

}  // namespace dyntape
