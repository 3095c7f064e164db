// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/robot/packed_robot.h>

#include <algorithm>
#include <string>
#include <vector>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/scalars/pack_eigen.h>
#include <dyntape/autodiff/scalars/pack_lanes.h>
#include <dyntape/interface/robot/check_accelerations.h>
#include <dyntape/interface/robot/robot_rows.h>

namespace dyntape {
namespace {

#if defined(DYNTAPE_HAS_AVX512F)
constexpr int kBestLanes = 8;
#else
constexpr int kBestLanes = 4;
#endif

}  // namespace

struct PackedRobot::Path {
  virtual ~Path() = default;
  // At most `lanes` states.
  virtual void evaluate(const double* states, int count, double* results) = 0;

  std::size_t n_in = 0, n_out = 0;
  int lanes = 0;
};

template <class Pack>
struct PackedRobot::Lanes final : Path {
  Lanes(const dynamics::Model<double>& robot, const RobotFunction& function)
      : model(robot.cast<Pack>()), work(model, function), x(work.n_in()), y(work.n_out()) {
    n_in = x.size();
    n_out = y.size();
    lanes = Pack::kLanes;
  }

  void evaluate(const double* states, int count, double* results) override {
    gather_lanes(states, n_in, count, x.data(), n_in);
    work.evaluate(x.data(), y.data());
    scatter_lanes(y.data(), n_out, results, n_out, count);
  }

  const dynamics::Model<Pack> model;
  detail::RobotWorkspace<Pack> work;
  std::vector<Pack> x, y;
};

PackedRobot::PackedRobot(const dynamics::Model<double>& model, const RobotFunction& function, int lanes) {
  detail::check_accelerations(model, function);
  if (lanes == 0) lanes = kBestLanes;
  if (lanes == 8) {
    path_ = std::make_unique<Lanes<Pack8>>(model, function);
  } else if (lanes == 4) {
    path_ = std::make_unique<Lanes<Pack4>>(model, function);
  } else {
    throw ArgumentError("PackedRobot: packs of " + std::to_string(lanes) + " lanes, expected 4 or 8");
  }
}

PackedRobot::~PackedRobot() = default;
PackedRobot::PackedRobot(PackedRobot&&) noexcept = default;
PackedRobot& PackedRobot::operator=(PackedRobot&&) noexcept = default;

std::size_t PackedRobot::n_in() const { return path_->n_in; }
std::size_t PackedRobot::n_out() const { return path_->n_out; }
int PackedRobot::lanes() const { return path_->lanes; }

void PackedRobot::evaluate(const double* states, std::size_t count, double* results) {
  Path& path = *path_;
  const auto lanes = static_cast<std::size_t>(path.lanes);
  for (std::size_t first = 0; first < count; first += lanes) {
    const auto several = static_cast<int>(std::min(lanes, count - first));
    path.evaluate(states + first * path.n_in, several, results + first * path.n_out);
  }
}

}  // namespace dyntape
