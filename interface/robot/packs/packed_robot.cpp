// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/robot/packs/packed_robot.h>

#include <algorithm>
#include <string>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/robot/check_accelerations.h>
#include <dyntape/interface/robot/packs/packed_path.h>

namespace dyntape {

PackedRobot::PackedRobot(const dynamics::Model<double>& model, const RobotFunction& function, int lanes) {
  detail::check_accelerations(model, function);
  if (lanes != 0 && lanes != 4 && lanes != 8)
    throw ArgumentError("PackedRobot: packs of " + std::to_string(lanes) + " lanes, expected 4 or 8");
  path_ = detail::best_packed_path(model, function);
  if (lanes == 0 || lanes == path_->lanes) return;
  if (lanes == 8)
    path_ = std::make_unique<detail::PathOf<Pack8>>(model, function);
  else
    path_ = std::make_unique<detail::PathOf<Pack4>>(model, function);
}

PackedRobot::~PackedRobot() = default;
PackedRobot::PackedRobot(PackedRobot&&) noexcept = default;
PackedRobot& PackedRobot::operator=(PackedRobot&&) noexcept = default;

std::size_t PackedRobot::n_in() const { return path_->n_in; }
std::size_t PackedRobot::n_out() const { return path_->n_out; }
int PackedRobot::lanes() const { return path_->lanes; }

void PackedRobot::evaluate(const double* states, std::size_t count, double* results) {
  detail::PackedPath& path = *path_;
  const auto lanes = static_cast<std::size_t>(path.lanes);
  for (std::size_t first = 0; first < count; first += lanes) {
    const auto several = static_cast<int>(std::min(lanes, count - first));
    path.evaluate(states + first * path.n_in, several, results + first * path.n_out);
  }
}

}  // namespace dyntape
