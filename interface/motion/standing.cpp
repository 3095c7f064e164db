// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/motion/standing.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <dyntape/autodiff/factorisations.h>
#include <dyntape/dynamics/algorithms/centroidal.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/motion/robot_terms.h>

namespace dyntape {

namespace {

constexpr int kMostIterations = 100;
constexpr double kInPlace = 1e-10, kMostDamping = 1e6;  // m

class Stander {
 public:
  Stander(const dynamics::Model<double>& model, const Stand& stand)
      : model_(model), data_(model), whole_(model), stand_(stand) {
    for (const auto& [frame, place] : stand.feet) frames_.push_back(moving_frame(model, frame));
    r.resize(3 + 3 * Eigen::Index(frames_.size()));
    J.resize(r.size(), model.nv);
  }

  Eigen::VectorXd r;  // what is off (m): centre of mass, then feet
  Eigen::MatrixXd J;  // its derivatives; none by turns of the trunk

  void look_at(const Eigen::VectorXd& q) {
    constexpr auto kAxes = dynamics::ReferenceFrame::kLocalWorldAligned;
    J.topRows(3) = dynamics::com_jacobian<double>(model_, data_, whole_, q);
    r.head(3) = whole_.com - stand_.com;
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      const Eigen::Index k = 3 + 3 * Eigen::Index(i);
      J.middleRows(k, 3) = dynamics::frame_jacobian<double>(model_, data_, q, frames_[i], kAxes).topRows(3);
      dynamics::forward_kinematics<double>(model_, data_, q);
      r.segment(k, 3) = dynamics::frame_placement(model_, data_, frames_[i]).p - stand_.feet[i].second;
    }
    J.middleCols(3, 3).setZero();
  }

 private:
  const dynamics::Model<double>& model_;
  dynamics::Data<double> data_;
  dynamics::Centroidal<double> whole_;
  const Stand& stand_;
  std::vector<int> frames_;
};

void check_stand(const RobotScene& scene, const Eigen::VectorXd& q, const Stand& stand) {
  const auto refuse = [&](const std::string& what) { dyntape::refuse(scene.model, what); };
  if (!floats(scene.model)) refuse("its base is fixed; expected a floating one, which stands on its feet");
  if (q.size() != scene.model.nq || !q.allFinite())
    refuse("a configuration to stand near has " + std::to_string(q.size()) + " values, expected " +
           std::to_string(scene.model.nq) + " finite ones");
  if (!(q.segment(3, 4).norm() > 0.5)) refuse("the trunk's quaternion has no direction; expected a unit one");
  const bool has_places = std::all_of(stand.feet.begin(), stand.feet.end(),
                                      [](const auto& foot) { return foot.second.allFinite(); });
  if (!stand.com.allFinite() || !has_places)
    refuse("where it shall stand has an entry that is no finite number");
}

using Feet = std::vector<std::pair<std::string, Eigen::Vector3d>>;

// Feet alone, joints within their limits.
class FeetReacher {
 public:
  FeetReacher(const dynamics::Model<double>& model, const Feet& feet)
      : model_(model), data_(model), feet_(feet) {
    for (const auto& foot : feet) frames_.push_back(moving_frame(model, foot.first));
    r_.resize(3 * Eigen::Index(frames_.size()));
    J_.resize(r_.size(), model.nv);
  }

  Posture reach(Eigen::VectorXd q) {
    q = within(q);
    look_at(q);
    double damping = 1e-6;
    for (int k = 0; k < kMostIterations && damping < kMostDamping; ++k) {
      const double before = r_.squaredNorm();
      if (r_.cwiseAbs().maxCoeff() <= kInPlace) break;
      Eigen::MatrixXd A = J_ * J_.transpose();
      A.diagonal().array() += damping;
      const Eigen::VectorXd step = -J_.transpose() * solve_positive(A, r_);
      const Eigen::VectorXd next = within(dynamics::integrate<double>(model_, q, step));
      look_at(next);
      const bool is_nearer = r_.squaredNorm() < before;
      if (is_nearer) q = next;
      if (!is_nearer) look_at(q);
      damping = is_nearer ? damping / 10 : damping * 10;
    }
    return {q, r_.cwiseAbs().maxCoeff()};
  }

  // Joints with limits anywhere within them, others up to half a turn or half a metre away, a trunk as in drawn_near().
  Eigen::VectorXd drawn(const Eigen::VectorXd& from) {
    std::uniform_real_distribution<double> share(0, 1);
    Eigen::VectorXd q = drawn_near(from);
    for (const auto& joint : model_.joints) {
      if (!dynamics::traits(joint.type).on_a_line) continue;
      const double reach = joint.type == dynamics::JointType::kPrismatic ? 0.5 : std::numbers::pi;
      const double middle = from[joint.idx_q];
      const double low = std::isfinite(joint.limits.lower) ? joint.limits.lower : middle - reach;
      const double high = std::isfinite(joint.limits.upper) ? joint.limits.upper : middle + reach;
      q[joint.idx_q] = low + share(random_) * (high - low);
    }
    return q;
  }

  Eigen::VectorXd drawn_near(const Eigen::VectorXd& from) {
    std::uniform_real_distribution<double> turn(-1, 1);
    Eigen::VectorXd step(model_.nv);
    for (double& entry : step) entry = turn(random_);
    for (const auto& joint : model_.joints)  // a trunk turns and moves less
      if (!dynamics::is_single(joint.type)) step.segment(joint.idx_v, dynamics::nv(joint.type)) *= 0.2;
    return dynamics::integrate<double>(model_, from, step);
  }

 private:
  void look_at(const Eigen::VectorXd& q) {
    constexpr auto kAxes = dynamics::ReferenceFrame::kLocalWorldAligned;
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      const Eigen::Index k = 3 * Eigen::Index(i);
      J_.middleRows(k, 3) = dynamics::frame_jacobian<double>(model_, data_, q, frames_[i], kAxes).topRows(3);
      dynamics::forward_kinematics<double>(model_, data_, q);
      r_.segment(k, 3) = dynamics::frame_placement(model_, data_, frames_[i]).p - feet_[i].second;
    }
  }

  Eigen::VectorXd within(Eigen::VectorXd q) const {
    for (const auto& joint : model_.joints) {
      if (!dynamics::traits(joint.type).on_a_line) continue;
      q[joint.idx_q] = std::max(joint.limits.lower, std::min(joint.limits.upper, q[joint.idx_q]));
    }
    return q;
  }

  const dynamics::Model<double>& model_;
  dynamics::Data<double> data_;
  const Feet& feet_;
  std::vector<int> frames_;
  Eigen::VectorXd r_;
  Eigen::MatrixXd J_;
  std::mt19937_64 random_{1};
};

}  // namespace

Posture reaching(const RobotScene& scene, const Eigen::VectorXd& q, const Feet& feet) {
  constexpr int kNearStarts = 8, kStarts = 32;
  constexpr double kThere = 1e-6;  // m
  FeetReacher reacher(scene.model, feet);
  Posture best = reacher.reach(q);
  for (int k = 1; k < kStarts && best.off > kThere; ++k) {
    const Posture other = reacher.reach(k < kNearStarts ? reacher.drawn_near(q) : reacher.drawn(q));
    if (other.off < best.off) best = other;
  }
  return best;
}

namespace {

constexpr double kAtFoothold = 1e-3;  // m

std::string metres(double value) { return io::significant(value, 3) + " m"; }

}  // namespace

std::string missed_feet(const RobotScene& scene, const Eigen::VectorXd& q, const Feet& feet,
                        const std::string& what) {
  if (feet.empty() || !q.allFinite()) return "";
  const Posture pose = reaching(scene, q, feet);
  if (!(pose.off > kAtFoothold)) return "";
  std::string names;
  for (const auto& foot : feet) names += (names.empty() ? "'" : ", '") + foot.first + "'";
  const bool are_several = feet.size() > 1;
  return "no configuration within the limits of the joints was found in which " + names +
         (are_several ? " are at their " + what + "s" : " is at its " + what) + "; the nearest misses " +
         (are_several ? "one" : "it") + " by " + metres(pose.off);
}

std::string below_floor(const std::string& frame, const Eigen::Vector3d& foothold, double floor,
                        const std::string& what) {
  const double below = floor - foothold.z();
  if (!(below > kAtFoothold)) return "";
  return "the " + what + " of '" + frame + "' is " + metres(below) +
         " below the floor, which is at z = " + metres(floor);
}

double limb_length(const dynamics::Model<double>& model, const std::string& frame) {
  const auto& at = model.frames[std::size_t(model.frame_index(frame))];
  double length = at.X_BF.p.norm();
  for (int body = at.body; body >= 0 && model.parent[std::size_t(body)] >= 0;
       body = model.parent[std::size_t(body)])
    length += model.X_PJ[std::size_t(body)].p.norm();
  return length;
}

Posture standing(const RobotScene& scene, const Eigen::VectorXd& q, const Stand& stand) {
  check_stand(scene, q, stand);
  Stander here(scene.model, stand), there = here;
  Posture pose{q, 0};
  here.look_at(q);
  double damping = 1e-6;
  for (int k = 0; k < kMostIterations && damping < kMostDamping; ++k) {
    if (here.r.cwiseAbs().maxCoeff() <= kInPlace) break;
    Eigen::MatrixXd A = here.J * here.J.transpose();
    A.diagonal().array() += damping;
    const Eigen::VectorXd step = -here.J.transpose() * solve_positive(A, here.r);
    const Eigen::VectorXd next = dynamics::integrate<double>(scene.model, pose.q, step);
    there.look_at(next);
    const bool is_nearer = there.r.squaredNorm() < here.r.squaredNorm();
    if (is_nearer) pose.q = next, here.r = there.r, here.J = there.J;
    damping = is_nearer ? damping / 10 : damping * 10;
  }
  pose.off = here.r.cwiseAbs().maxCoeff();
  return pose;
}

namespace {

// F(u) = F0 + G u, which is zero where the controls hold the robot at rest in the state x.
struct Holding {
  // |(x, y)| <= friction z of three controls.
  struct Cone {
    Eigen::Index first;
    double friction;
    Eigen::Vector3d nearest(const Eigen::Vector3d& f) const {
      const double across = f.head<2>().norm();
      if (across <= friction * f.z()) return f;
      if (friction * across <= -f.z()) return Eigen::Vector3d::Zero();
      const double z = (friction * across + f.z()) / (1 + friction * friction);
      return {f.x() * friction * z / across, f.y() * friction * z / across, z};
    }
  };

  Eigen::VectorXd F0, least;  // least: the controls of least norm
  Eigen::MatrixXd G;
  std::vector<Cone> cones;

  Holding(const Problem& p, const Eigen::VectorXd& x, const std::vector<HeldContact>& contacts,
          Eigen::Index first) {
    for (const HeldContact& contact : contacts) {
      for (std::size_t point = 0; point < force_points(contact).size(); ++point, first += 3)
        cones.push_back({first, contact.friction});
    }
    const Eigen::VectorXd none = Eigen::VectorXd::Zero(p.n_u());
    F0 = rows(p, x, none);
    G.resize(F0.size(), p.n_u());
    for (Eigen::Index k = 0; k < G.cols(); ++k) G.col(k) = rows(p, x, Eigen::VectorXd::Unit(p.n_u(), k)) - F0;
    for (Eigen::Index i = 0; i < G.rows();
         ++i) {  // in units of the controls, as rows may be divided by limits
      const double size = G.row(i).cwiseAbs().maxCoeff();
      if (size > 0) G.row(i) /= size, F0[i] /= size;
    }
    if (F0.allFinite() && G.allFinite()) least = least_norm_solution(G, -F0);
  }

  // What is left where the controls are within bounds and forces within their cones, relative to F0; descent entry by entry, and
  // cone by cone.
  double left(const Eigen::VectorXd& lower, const Eigen::VectorXd& upper, Eigen::VectorXd& u) const {
    constexpr int kSweeps = 10000;
    constexpr double kNothing = 1e-7;
    u = least.cwiseMax(lower).cwiseMin(upper);
    for (const Cone& cone : cones) u.segment<3>(cone.first) = cone.nearest(u.segment<3>(cone.first));
    Eigen::VectorXd r = F0 + G * u;
    for (int sweep = 0; sweep < kSweeps && r.norm() > kNothing * F0.norm(); ++sweep) {
      for (Eigen::Index k = 0; k < u.size(); ++k) {
        const double square = G.col(k).squaredNorm();
        if (square == 0 || is_in_cone(k)) continue;
        const double next = std::clamp(u[k] - G.col(k).dot(r) / square, lower[k], upper[k]);
        r += G.col(k) * (next - u[k]);
        u[k] = next;
      }
      for (const Cone& cone : cones) {
        const auto columns = G.middleCols(cone.first, 3);
        const double steepest = (columns.transpose() * columns).trace();
        if (steepest == 0) continue;
        const Eigen::Vector3d before = u.segment<3>(cone.first);
        const Eigen::Vector3d next = cone.nearest(before - columns.transpose() * r / steepest);
        r += columns * (next - before);
        u.segment<3>(cone.first) = next;
      }
    }
    return r.norm() / std::max(F0.norm(), 1e-300);
  }

 private:
  bool is_in_cone(Eigen::Index k) const {
    return !cones.empty() && k >= cones.front().first && k < cones.back().first + 3;
  }
  static Eigen::VectorXd rows(const Problem& p, const Eigen::VectorXd& x, const Eigen::VectorXd& u) {
    if (!p.residual.empty()) return p.residual(p.stage(0, x, Eigen::VectorXd::Zero(p.n_a()), u));
    return p.rate(p.stage(0, x, {}, u)).tail(x.size() - p.positions);
  }
};

}  // namespace

std::string weak_motors(const RobotScene& scene, const RobotProblemOptions& options, const Problem& p,
                        const Eigen::VectorXd& x) {
  constexpr double kHeld = 2e-3, kEnough = 1.02, kMost = 1e3;
  const auto& model = scene.model;
  const std::vector<std::string> driven = driven_names(scene);
  const auto motors = Eigen::Index(driven.size());
  if (!x.allFinite() || !x.tail(x.size() - p.positions).isZero(0) || motors == 0 || p.n_u() < motors)
    return "";
  const Holding holding(p, x, options.contacts, motors + Eigen::Index(options.thrusters.size()));
  if (!holding.F0.allFinite() || !holding.G.allFinite() || holding.F0.isZero(0)) return "";
  Eigen::VectorXd u;
  const auto left_with = [&](double factor) {
    Eigen::VectorXd lower = p.u.lower, upper = p.u.upper;
    lower.head(motors) *= factor, upper.head(motors) *= factor;
    return holding.left(lower, upper, u);
  };
  if (left_with(kEnough) < kHeld || !(left_with(kMost) < kHeld)) return "";  // the latter: it falls anyway
  double weak = 1, strong = kMost;
  for (int k = 0; k < 15; ++k) {
    const double factor = std::sqrt(weak * strong);
    (left_with(factor) < kHeld ? strong : weak) = factor;
  }
  left_with(strong);
  Eigen::Index worst = 0;
  (u.head(motors).array().abs() / p.u.upper.head(motors).array().abs()).maxCoeff(&worst);
  const auto& joint = *std::find_if(model.joints.begin(), model.joints.end(),
                                    [&](const auto& of) { return of.name == driven[std::size_t(worst)]; });
  const double gain = options.unit == ControlUnit::kFraction ? joint.limits.effort : 1;
  const char* unit = joint.type == dynamics::JointType::kPrismatic ? " N" : " N m";
  return "at the start the motors cannot hold the robot at rest: '" + driven[std::size_t(worst)] +
         "' would have to give " + io::significant(std::abs(u[worst]) * gain, 3) + unit +
         " at least, and its limit is " + io::significant(p.u.upper[worst] * gain, 3) + unit;
}

std::string short_duration(const RobotScene& scene, const Problem& p) {
  constexpr double kBetween = 1.02;  // limits hold at points, and may be passed a little between them
  const double duration = p.free_time ? p.free_time->longest : p.duration;
  const auto index_of = [&](const std::string& name) {
    return Eigen::Index(std::find(p.states.begin(), p.states.end(), name) - p.states.begin());
  };
  double worst = kBetween;
  std::string sentence;
  for (const auto& joint : scene.model.joints) {
    const Eigen::Index q = index_of("q." + joint.name), v = index_of("v." + joint.name);
    if (q == p.n_x() || v == p.n_x()) continue;
    const double way = p.goal[q] - p.start[q], most = (way > 0 ? p.x.upper[v] : -p.x.lower[v]) * duration;
    if (!(std::abs(way) > worst * most) || most < 0) continue;
    worst = std::abs(way) / std::max(most, 1e-300);
    const std::string unit = unit_of_state(scene.model, joint.idx_q);
    sentence = "'" + joint.name + "' has to move " + io::significant(std::abs(way), 3) + unit + " in " +
               io::significant(duration, 3) + " s, and its velocity limit allows " +
               io::significant(most, 3) + unit;
  }
  return sentence;
}

}  // namespace dyntape
