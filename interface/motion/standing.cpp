// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/motion/standing.h>

#include <algorithm>
#include <random>

#include <dyntape/autodiff/factorisations.h>
#include <dyntape/dynamics/algorithms/centroidal.h>
#include <dyntape/dynamics/model/configuration.h>
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

  Eigen::VectorXd drawn(const Eigen::VectorXd& from) {
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
  constexpr int kStarts = 8;
  constexpr double kThere = 1e-6;  // m
  FeetReacher reacher(scene.model, feet);
  Posture best = reacher.reach(q);
  for (int k = 1; k < kStarts && best.off > kThere; ++k) {
    const Posture other = reacher.reach(reacher.drawn(q));
    if (other.off < best.off) best = other;
  }
  return best;
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

}  // namespace dyntape
