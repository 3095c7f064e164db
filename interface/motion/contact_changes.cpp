// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/motion/contact_changes.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <type_traits>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/contact/constraints.h>
#include <dyntape/interface/motion/of_kinematics.h>
#include <dyntape/interface/motion/robot_terms.h>
#include <dyntape/interface/robot/robot_callee.h>

namespace dyntape {

namespace {

constexpr double kSink = 1e-3;  // m
// Of 4 s (1 - s) at the share s of a way: beside an end a contact may be lower, by half of kSink here.
constexpr double kBesideEnd = 0.05;

bool is_foot(const HeldContact& contact) { return !contact.corners.empty(); }

void check_place(const HeldContact& contact) {
  if (contact.place && (contact.axes || !is_foot(contact))) return;
  throw ArgumentError("contact of \"" + contact.frame +
                      "\": it has no place; expected one, and of a foot its axes");
}

// Of the point, or of a foot's corners, in the contact's frame.
std::vector<Eigen::Vector3d> points_of(const HeldContact& contact) {
  if (is_foot(contact)) return contact.corners;
  return {Eigen::Vector3d::Zero()};
}

// Where they are in the world while the contact is at its place.
std::vector<Eigen::Vector3d> placed_points(const HeldContact& contact) {
  std::vector<Eigen::Vector3d> points = points_of(contact);
  for (Eigen::Vector3d& point : points)
    point = *contact.place + (is_foot(contact) ? Eigen::Vector3d(*contact.axes * point) : point);
  return points;
}

Term at_least(const std::string& name, StageFunction heights, Eigen::Index n, double least) {
  return path_inequality(name, std::move(heights), Eigen::VectorXd::Constant(n, least),
                         Eigen::VectorXd::Constant(n, std::numeric_limits<double>::infinity()));
}

}  // namespace

std::vector<Term> landing(const RobotScene& scene, const HeldContact& contact, Landing how) {
  check_place(contact);
  FrameTarget place{contact.frame, contact.place, {}};
  if (is_foot(contact)) place.orientation = contact.axes;
  const std::vector<int> axes = held_axes(scene.model, contact);
  std::vector<Term> terms = {
      terminal_equality(contact.frame + " lands", entries_of(frame_error(scene, place), axes))};
  if (how == Landing::kImpact) return terms;
  const StageFunction speed =
      frame_velocity(scene, contact.frame, dynamics::ReferenceFrame::kLocalWorldAligned);
  terms.push_back(terminal_equality(contact.frame + " at rest", entries_of(speed, axes)));
  return terms;
}

Term stays_above(const RobotScene& scene, const HeldContact& contact) {
  check_place(contact);
  const std::vector<Eigen::Vector3d> points = points_of(contact);
  double floor = HUGE_VAL;
  for (const Eigen::Vector3d& point : placed_points(contact)) floor = std::min(floor, point.z());
  const auto heights = [points, floor, frame = moving_frame(scene.model, contact.frame)](
                           const auto& model, auto& data, const auto& s) {
    using T = typename std::decay_t<decltype(s.x)>::Scalar;
    const auto at = dynamics::frame_placement(model, data, frame);
    Eigen::Matrix<T, Eigen::Dynamic, 1> z(Eigen::Index(points.size()));
    for (std::size_t i = 0; i < points.size(); ++i) {
      const dynamics::Vector3<T> point = points[i].template cast<T>();
      z[Eigen::Index(i)] = at.p[2] + dynamics::Vector3<T>(at.R * point)[2] - T(floor);
    }
    return z;
  };
  return at_least(contact.frame + " above the floor", of_kinematics(scene, heights),
                  Eigen::Index(points.size()), -kSink);
}

Term swing_clearance(const RobotScene& scene, const HeldContact& contact, const Eigen::Vector3d& next,
                     double clearance) {
  constexpr double kNoWay = 1e-3;  // m
  check_place(contact);
  if (!(clearance > 0 && std::isfinite(clearance)) || !next.allFinite())
    throw ArgumentError("swing_clearance of \"" + contact.frame +
                        "\": expected finite metres and a clearance above 0, got " +
                        std::to_string(clearance) + " m");
  const Eigen::Vector3d way = next - *contact.place;
  const double ground = way.head<2>().norm();
  const bool has_way = ground >= kNoWay;
  const Eigen::Vector2d along =
      has_way ? Eigen::Vector2d(way.head<2>() / (ground * ground)) : Eigen::Vector2d::Zero();
  const auto heights = [=, points = points_of(contact), from = placed_points(contact),
                        frame = moving_frame(scene.model, contact.frame)](const auto& model, auto& data,
                                                                          const auto& s) {
    using T = typename std::decay_t<decltype(s.x)>::Scalar;
    const auto at = dynamics::frame_placement(model, data, frame);
    Eigen::Matrix<T, Eigen::Dynamic, 1> above(Eigen::Index(points.size()));
    for (std::size_t i = 0; i < points.size(); ++i) {
      const dynamics::Vector3<T> p = at.p + dynamics::Vector3<T>(at.R * points[i].template cast<T>());
      const T share = (p[0] - T(from[i][0])) * T(along[0]) + (p[1] - T(from[i][1])) * T(along[1]);
      const T arc = T(4) * share * (T(1) - share);
      const T lower =
          T(kSink * kBesideEnd * kBesideEnd) * (T(1) - arc) / (T(kBesideEnd * kBesideEnd) + arc * arc);
      above[Eigen::Index(i)] = p[2] - T(from[i][2]) - share * T(way[2]) - T(clearance) * arc + lower;
    }
    return above;
  };
  const std::string name = contact.frame + " clears its way";
  const auto n = Eigen::Index(points_of(contact).size());
  if (!has_way) return at_fraction(0.5, at_least(name, of_kinematics(scene, heights), n, clearance));
  Term term = at_least(name, of_kinematics(scene, heights), n, 0);
  term.length = clearance;
  return term;
}

StageFunction impact(const RobotScene& scene, const std::vector<HeldContact>& contacts) {
  std::vector<dynamics::Constraint<double>> held;
  for (const HeldContact& contact : contacts) {
    check_place(contact);
    const int frame = moving_frame(scene.model, contact.frame);
    if (is_foot(contact))
      held.push_back(dynamics::frame_constraint<double>(scene.model, frame, {*contact.axes, *contact.place}));
    else
      held.push_back(dynamics::point_constraint<double>(scene.model, frame, *contact.place));
  }
  // With its analytic derivatives, but for added inertias, which callees do not know.
  std::shared_ptr<const Callee> stuck;
  if (scene.effects.acting().added.count == 0 && scene.mimics.empty() && is_worth_callees(scene.model))
    stuck = impulse_dynamics_callee(dynamics::acting_model(scene.model, scene.effects), held, 0.0);
  return [scene, held, stuck, ties = ties_of(scene)](const auto& s) {
    using T = typename std::decay_t<decltype(s.x)>::Scalar;
    using Vector = Eigen::Matrix<T, Eigen::Dynamic, 1>;
    if constexpr (std::is_same_v<T, AD>) {
      if (stuck) {
        Vector x = s.x;
        x.segment(scene.model.nq, scene.model.nv) = call(stuck, VectorXad(x.head(stuck->n_in)));
        return x;
      }
    }
    const dynamics::Model<T> model = scene.model.template cast<T>();
    dynamics::Data<T> data(model);
    data.following = ties.template following<T>();
    std::vector<dynamics::Constraint<T>> list;
    for (const auto& constraint : held) list.push_back(constraint.template cast<T>());
    dynamics::ConstraintData<T> constraints(model, list);
    Vector x = s.x;
    const Vector q = x.head(model.nq), v = x.segment(model.nq, model.nv);
    const auto effects = scene.effects.template cast<T>();
    x.segment(model.nq, model.nv) =
        dynamics::impulse_dynamics<T>(model, data, constraints, q, v, T(0), effects.acting());
    return x;
  };
}

}  // namespace dyntape
