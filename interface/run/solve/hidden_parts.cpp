// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/solve/hidden_parts.h>

#include <algorithm>

namespace dyntape {

namespace {

using Eigen::Vector3d;

constexpr double kDepth =
    0.35355339059327373;  // half of sqrt(1 / 2): what a metre of y is in the oblique view, to the right and up

// The line of sight through p passes a segment nearest at its point `from + u (to - from)`.
bool hides(const Capsule& obstacle, const Vector3d& n, const Vector3d& p) {
  const auto across = [&n](const Vector3d& v) { return Vector3d(v - n * n.dot(v)); };
  const Vector3d along = obstacle.to - obstacle.from, a = across(obstacle.from - p), d = across(along);
  const double length = d.squaredNorm();
  const double u = length > 1e-12 ? std::clamp(-a.dot(d) / length, 0.0, 1.0) : n.dot(along) > 0 ? 1 : 0;
  const bool is_met = (a + u * d).norm() < obstacle.radius;
  return is_met && n.dot(obstacle.from + u * along - p) > 0;
}

void add_bone(View view, const std::vector<Capsule>& obstacles, const Bone& bone, io::MotionFrame& frame) {
  constexpr int kPieces = 60;
  const auto& [from, to] = bone;
  std::vector<io::Polyline> seen;
  bool is_open = false, is_whole = true;
  for (int k = 0; k <= kPieces; ++k) {
    const Vector3d p = from + double(k) / kPieces * (to - from);
    const bool hidden = is_hidden(view, obstacles, p);
    if (!hidden && !is_open) seen.emplace_back();
    if (!hidden) seen.back().push_back(project(view, p));
    is_open = !hidden, is_whole = is_whole && !hidden;
  }
  const io::Polyline whole = {project(view, from), project(view, to)};
  (is_whole ? frame.parts : frame.behind).push_back(whole);
  if (is_whole) return;
  for (io::Polyline& part : seen)
    if (part.size() > 1) frame.in_front.push_back({part.front(), part.back()});
}

}  // namespace

std::array<double, 2> project(View view, const Vector3d& p) {
  switch (view) {
    case View::kXz:
      return {p.x(), p.z()};
    case View::kXy:
      return {p.x(), p.y()};
    case View::kYz:
      return {p.y(), p.z()};
    case View::kOblique:
      break;
  }
  return {p.x() + kDepth * p.y(), p.z() + kDepth * p.y()};
}

Vector3d towards_viewer(View view) {
  switch (view) {
    case View::kXz:
      return -Vector3d::UnitY();
    case View::kXy:
      return Vector3d::UnitZ();
    case View::kYz:
      return Vector3d::UnitX();
    case View::kOblique:
      break;
  }
  return Vector3d(kDepth, -1, kDepth).normalized();
}

bool is_hidden(View view, const std::vector<Capsule>& obstacles, const Vector3d& p) {
  const Vector3d n = towards_viewer(view);
  return std::any_of(obstacles.begin(), obstacles.end(),
                     [&](const Capsule& obstacle) { return hides(obstacle, n, p); });
}

io::MotionFrame frame_of(View view, const std::vector<Capsule>& obstacles, double time,
                         const std::vector<Bone>& bones) {
  io::MotionFrame frame{time, {}};
  for (const Bone& bone : bones) add_bone(view, obstacles, bone, frame);
  return frame;
}

}  // namespace dyntape
