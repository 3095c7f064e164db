// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/solve/limits.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include <dyntape/interface/control/discretize/resampled.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/run/solve/curves.h>

namespace dyntape {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Relative to a limit, or to half of the range if larger, since a limit may be zero.  The solver widens bounds by
// 1e-8 and ends within its tolerance.
constexpr double kExcessCounted = 1e-6;
constexpr int kLooks = 8;  // evaluations between neighbouring points of the mesh
// If two bodies may come too close, they move between evaluations by at most this fraction of the required distance.
// When they pass each other, the distance is then below any evaluated one by less than kContact of the required
// distance.
constexpr double kLookStep = 1. / 16;
constexpr int kMostLooks = 4096;
constexpr double kPath = 1.5;  // of the straight line between two evaluations: length of a curved path
// Fraction of a control's range by which polynomials may exceed its limits, for any allowed defect: smaller excesses
// are not clamped (Trajectory::limit_controls).
constexpr double kControl = 1e-3;
constexpr double kContact =
    1e-3;  // of the required distance of centres: no contact yet, for any allowed defect
constexpr double kLeastGap =
    1e-6;  // m; the widening of bounds has this effect on thin bodies, and no result is more accurate

std::string plain_digits(double value) { return io::with_digits(value, 6); }

// The motion at given times, and the fraction of a limit's range that is not an excess.
struct PlaceLookedAt {
  const Curves& curves;
  const Eigen::VectorXd& times;
  double of_range = 0;
};

double tolerated(double lower, double upper, double limit, double of_range) {
  const double extent = std::isfinite(upper - lower) ? upper - lower : std::abs(limit);
  const double of_limit = kExcessCounted * std::max({std::abs(limit), extent / 2, kExcessCounted});
  return of_range > 0 ? std::max(of_limit, of_range * extent) : of_limit;
}

// Whether values leave [lower, upper], and the worst of them.
template <class Tolerated>
bool find_excess(const Eigen::VectorXd& values, const PlaceLookedAt& look, double lower, double upper,
                 const Tolerated& tolerated_of, LimitExcess& excess) {
  double most = 0;
  for (Eigen::Index p = 0; p < values.size(); ++p) {
    const bool above = values[p] > upper;
    const double limit = above ? upper : lower, beyond = above ? values[p] - upper : lower - values[p];
    if (!(beyond > most) || beyond <= tolerated_of(limit)) continue;
    most = beyond;
    excess.value = values[p];
    excess.limit = limit;
    excess.time = look.times[p];
  }
  return most > 0;
}

double apart_of(const Surroundings::Pair& pair) { return pair.a.radius + pair.b.radius + pair.least; }

// Evenly spaced times between mesh points, `looks` per interval.
std::vector<double> times_between(const Trajectory& motion, const std::vector<int>& looks) {
  std::vector<double> times;
  for (int p = 0; p + 1 < motion.points(); ++p) {
    const int n = looks[std::size_t(p)];
    for (int k = 0; k < n; ++k) times.push_back(motion.t[p] + (motion.t[p + 1] - motion.t[p]) * k / n);
  }
  times.push_back(motion.t[motion.points() - 1]);
  return times;
}

std::vector<int> even_looks(const Trajectory& motion) {
  return std::vector<int>(std::size_t(std::max(motion.points() - 1, 0)), kLooks);
}

// The ends of a capsule's segment at configurations (6 x times): the first, then the second.
MatrixXd ends_of(const dynamics::Model<double>& model, const MatrixXd& q, const Capsule& capsule) {
  MatrixXd ends(6, q.cols());
  if (capsule.frame == kWorld) {
    ends.topRows(3) = capsule.from.replicate(1, q.cols());
    ends.bottomRows(3) = capsule.to.replicate(1, q.cols());
    return ends;
  }
  dynamics::Data<double> data(model);
  const int frame = model.frame_index(capsule.frame);
  for (Eigen::Index p = 0; p < q.cols(); ++p) {
    dynamics::forward_kinematics(model, data, Eigen::VectorXd(q.col(p)));
    const dynamics::Placement<double> X = dynamics::frame_placement(model, data, frame);
    ends.col(p).head(3) = X.R * capsule.from + X.p;
    ends.col(p).tail(3) = X.R * capsule.to + X.p;
  }
  return ends;
}

// Upper bound of the change of two bodies' distance between evaluations: a point of a segment moves by at most as
// much as its ends.
// than its ends do.
VectorXd movements(const Task& task, const MatrixXd& q, const Surroundings::Pair& pair) {
  VectorXd moved = VectorXd::Zero(q.cols() - 1);
  for (const Capsule* body : {&pair.a, &pair.b}) {
    const MatrixXd ends = ends_of(task.scene.model, q, *body);
    const MatrixXd steps = ends.rightCols(q.cols() - 1) - ends.leftCols(q.cols() - 1);
    moved +=
        kPath * steps.topRows(3).colwise().norm().cwiseMax(steps.bottomRows(3).colwise().norm()).transpose();
  }
  return moved;
}

VectorXd clearances(const Task& task, const MatrixXd& q, const Surroundings::Pair& pair) {
  VectorXd values(q.cols());
  for (Eigen::Index p = 0; p < values.size(); ++p)
    values[p] = clearance(task.scene.model, q.col(p), pair.a, pair.b);
  return values;
}

// Number of evaluations between points, so that no contact is missed; `between`: configurations at the times of
// even_looks().
// times of even_looks().
std::vector<int> looks_for_contacts(const Task& task, const Trajectory& motion, const MatrixXd& between) {
  std::vector<int> looks = even_looks(motion);
  for (const Surroundings::Pair& pair : task.around.apart) {
    const VectorXd gaps = clearances(task, between, pair), moved = movements(task, between, pair);
    for (std::size_t p = 0; p < looks.size(); ++p) {
      const Eigen::Index first = Eigen::Index(p) * kLooks;
      // In the worst case the path extends by half its length beyond both of its ends.
      const double most = moved.segment(first, kLooks).maxCoeff();
      if (!(gaps.segment(first, kLooks + 1).minCoeff() - most / 2 < pair.least)) continue;
      const double wanted = std::ceil(kLooks * most / (kLookStep * apart_of(pair)));
      looks[p] = std::max(looks[p], int(std::min(wanted, double(kMostLooks))));
    }
  }
  return looks;
}

// Pairs that come closer than the task allows, each at its worst time.
void find_contacts(const Task& task, const Trajectory& motion, const PlaceLookedAt (&looks)[2],
                   std::vector<LimitExcess>& excesses) {
  if (task.around.apart.empty()) return;
  const MatrixXd& even = looks[1].curves.q;
  const Trajectory fine =
      resampled(task.problem, motion, times_between(motion, looks_for_contacts(task, motion, even)));
  const MatrixXd between = fine.x.topRows(even.rows());
  for (const Surroundings::Pair& pair : task.around.apart) {
    const double apart = apart_of(pair), at_points = kLeastGap + kExcessCounted * apart,
                 on_the_way = std::max(at_points, std::min(kContact, looks[1].of_range) * apart);
    const auto worst = [&](const MatrixXd& q, const PlaceLookedAt& look, double tolerance) {
      LimitExcess excess{"clearance", pair.name(), "m", HUGE_VAL, 0, 0};
      excess.of = LimitOf::kClearance;
      find_excess(
          clearances(task, q, pair), look, pair.least, HUGE_VAL, [&](double) { return tolerance; }, excess);
      return excess;
    };
    const LimitExcess kept = worst(looks[0].curves.q, looks[0], at_points);
    LimitExcess passed = worst(between, {looks[1].curves, fine.t, looks[1].of_range}, on_the_way);
    if (!std::isfinite(std::min(kept.value, passed.value))) continue;
    passed.between_points = !std::isfinite(kept.value);
    excesses.push_back(passed.value < kept.value ? passed : kept);
  }
}

}  // namespace

std::string LimitExcess::text() const {
  const std::string what = quantity.empty() ? joint : quantity + " of " + joint;
  const char* bounded = of == LimitOf::kRobot       ? ", rated for "
                        : of == LimitOf::kClearance ? ", to be at least "
                                                    : ", below the floor at ";
  return what + " is " + plain_digits(value) + (unit.empty() ? "" : " " + unit) + " at " +
         plain_digits(time) + " s" + (between_points ? ", between points of the mesh" : "") + bounded +
         plain_digits(limit);
}

std::vector<LimitExcess> limit_excesses(const Task& task, const Trajectory& motion) {
  if (motion.points() < 2) return {};  // of a closed loop without a first plan
  const Trajectory fine = resampled(task.problem, motion, times_between(motion, even_looks(motion)));
  Curves at_points = curves_of(task, motion);
  const Curves between = curves_of(task, fine);
  // Efforts that the scheme does not use are NaN, which exceeds no limit.
  if (!motion.scheme.uses_first_point()) at_points.tau.col(0).setConstant(std::nan(""));
  if (!motion.scheme.uses_last_point()) at_points.tau.rightCols(1).setConstant(std::nan(""));
  const PlaceLookedAt looks[] = {{at_points, motion.t}, {between, fine.t, task.demands.integration_error}};
  const std::vector<int> driven = actuated_dofs(task.scene);
  std::vector<LimitExcess> excesses;
  for (const dynamics::Joint<double>& joint : task.scene.model.joints) {
    if (!dynamics::is_single(joint.type)) continue;
    const int i = joint.idx_v;
    const bool slides = joint.type == dynamics::JointType::kPrismatic;
    const auto check = [&](const char* quantity, const char* unit, const auto& values_of, double lower,
                           double upper) {
      LimitExcess excess{quantity, joint.name, unit, 0, 0, 0};
      for (const PlaceLookedAt& look : looks) {
        excess.between_points = &look != looks;
        const bool is_control = quantity == std::string_view("effort") && look.of_range > 0;
        const double part = is_control ? std::max(look.of_range, kControl) : look.of_range;
        const auto none = [&](double limit) { return tolerated(lower, upper, limit, part); };
        if (find_excess(values_of(look), look, lower, upper, none, excess)) return excesses.push_back(excess);
      }
    };
    const double velocity = rated(joint.limits.velocity), effort = rated(joint.limits.effort);
    const auto positions = [&](const PlaceLookedAt& look) {
      return Eigen::VectorXd(look.curves.q.row(joint.idx_q));
    };
    const auto velocities = [&](const PlaceLookedAt& look) { return Eigen::VectorXd(look.curves.v.row(i)); };
    if (dynamics::traits(joint.type).on_a_line)
      check("position", slides ? "m" : "rad", positions, joint.limits.lower, joint.limits.upper);
    check("velocity", slides ? "m/s" : "rad/s", velocities, -velocity, velocity);
    const auto at = std::find(driven.begin(), driven.end(), i);
    if (at == driven.end()) continue;
    const auto efforts = [&](const PlaceLookedAt& look) {
      return Eigen::VectorXd(look.curves.tau.row(at - driven.begin()));
    };
    check("effort", slides ? "N" : "N m", efforts, -effort, effort);
  }
  find_contacts(task, motion, looks, excesses);
  return excesses;
}

}  // namespace dyntape
