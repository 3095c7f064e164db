// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/motion/capsules.h>

#include <cmath>

#include <dyntape/interface/motion/of_kinematics.h>

namespace dyntape {

namespace {

// Squared sine of the angle between bars below which they count as parallel: the nearest points are then told by
// rounding.  The first bar's first end then stands for all of it, which makes the distance too large by half of the sine
// (1e-7) of its length at most.
constexpr double kParallel = 1e-14;

template <class T>
struct Segment {
  dynamics::Vector3<T> from, along;  // from + s along, 0 <= s <= 1
  double length2;                    // of the segment, which does not change when it is moved
};

// A capsule with its frame looked up; frame -1: the world.
struct PlacedCapsule {
  int frame, body;
  Eigen::Vector3d from, along;
  double radius;

  template <class T>
  Segment<T> at(const dynamics::Model<T>& model, const dynamics::Data<T>& data) const {
    const dynamics::Vector3<T> p(from.cast<T>()), d(along.cast<T>());
    if (frame < 0) return {p, d, along.squaredNorm()};
    const dynamics::Placement<T> X = dynamics::frame_placement(model, data, frame);
    return {X.R * p + X.p, X.R * d, along.squaredNorm()};
  }
};

PlacedCapsule placed(const dynamics::Model<double>& model, const Capsule& capsule) {
  const auto refuse = [&](const std::string& what) {
    dyntape::refuse(model, "capsule \"" + capsule.name + "\": " + what);
  };
  if (!capsule.from.allFinite() || !capsule.to.allFinite())
    refuse("an end has an entry that is no finite number");
  if (!(capsule.radius > 0 && std::isfinite(capsule.radius)))
    refuse("the radius is " + std::to_string(capsule.radius) + ", expected a number above zero");
  PlacedCapsule p{-1, -1, capsule.from, capsule.to - capsule.from, capsule.radius};
  if (capsule.frame == kWorld) return p;
  p.frame = model.frame_index(capsule.frame);
  p.body = model.frames[std::size_t(p.frame)].body;
  return p;
}

template <class T>
T within_unit(const T& x) {
  using dynamics::select;
  return select(x < T(0), T(0), select(x > T(1), T(1), x));
}

// Squared distance of two segments.  Whether one is a point is plain data, so those are cases of the code; the rest is
// the minimum of a convex quadratic over a square.
template <class T>
T squared_distance(const Segment<T>& a, const Segment<T>& b) {
  using dynamics::select;
  const double aa = a.length2, bb = b.length2;
  const dynamics::Vector3<T> r = a.from - b.from;
  if (aa == 0 && bb == 0) return r.squaredNorm();
  if (bb == 0) return (r + a.along * within_unit(T(a.along.dot(r) * T(-1 / aa)))).squaredNorm();
  if (aa == 0) return (r - b.along * within_unit(T(b.along.dot(r) * T(1 / bb)))).squaredNorm();
  const T ab = a.along.dot(b.along), ar = a.along.dot(r), br = b.along.dot(r);
  const T free = T(aa * bb) - ab * ab;  // (|a| |b| sin)^2
  const auto crossing = free > T(kParallel * aa * bb);
  const T inside = (ab * br - ar * T(bb)) / select(crossing, free, T(1));
  const T s = within_unit(T(select(crossing, inside, T(0))));
  const T t = (ab * s + br) * T(1 / bb);
  // Where t leaves the other bar, the nearest end of that bar decides.
  const T at_begin = within_unit(T(ar * T(-1 / aa))), at_end = within_unit(T((ab - ar) * T(1 / aa)));
  const T u = select(t < T(0), at_begin, select(t > T(1), at_end, s));
  return (r + a.along * u - b.along * within_unit(t)).squaredNorm();
}

}  // namespace

Capsule sphere(std::string name, std::string frame, const Eigen::Vector3d& center, double radius) {
  return {std::move(name), std::move(frame), center, center, radius};
}

Capsule capsule(std::string name, std::string frame, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                double radius) {
  return {std::move(name), std::move(frame), from, to, radius};
}

Term keep_clear(const RobotScene& scene, const Capsule& a, const Capsule& b, double least) {
  const PlacedCapsule one = placed(scene.model, a), other = placed(scene.model, b);
  const std::string name = a.name + " clear of " + b.name;
  if (!(least >= 0 && std::isfinite(least)))
    refuse(scene.model, "\"" + name + "\" by " + std::to_string(least) + " m, expected zero or more");
  if (one.body == other.body)
    refuse(scene.model, "no joint moves \"" + a.name + "\" against \"" + b.name +
                            "\"; expected capsules on different bodies");
  const double apart = one.radius + other.radius + least;
  const StageFunction gap = of_kinematics(scene, [=](const auto& model, const auto& data, const auto&) {
    const auto d2 = squared_distance(one.at(model, data), other.at(model, data));
    using T = std::decay_t<decltype(d2)>;
    return T(d2 * T(0.5 / apart) - T(0.5 * apart));
  });
  return path_not_negative(name, gap);
}

double clearance(const dynamics::Model<double>& model, const Eigen::VectorXd& q, const Capsule& a,
                 const Capsule& b) {
  dynamics::Data<double> data(model);
  dynamics::forward_kinematics(model, data, q);
  const double d2 = squared_distance(placed(model, a).at(model, data), placed(model, b).at(model, data));
  return std::sqrt(d2) - a.radius - b.radius;
}

}  // namespace dyntape
