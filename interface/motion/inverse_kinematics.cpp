// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/factorisations.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/motion/inverse_kinematics.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algebra/lie.h>

namespace dyntape {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kLeastMu = 1e-12, kMostMu = 1e6;
constexpr unsigned kSeedOfStarts = 1;

// The error of a target and its derivatives by the joints.
struct TargetError {
  VectorXd r;
  MatrixXd J;
};

class Reacher {
 public:
  Reacher(const RobotScene& scene, const FrameTarget& target, const InverseKinematicsOptions& options)
      : model_(scene.model), data_(model_), target_(target), options_(options) {
    frame_ = moving_frame(model_, target.frame);
    lower_.resize(model_.nv);
    upper_.resize(model_.nv);
    for (int i = 0; i < model_.nv; ++i) {
      lower_[i] = model_.joints[std::size_t(i)].limits.lower;
      upper_[i] = model_.joints[std::size_t(i)].limits.upper;
    }
  }

  std::optional<VectorXd> reach(VectorXd q) {
    q = within(q);
    double damping = 1e-3;
    TargetError here = error(q);
    for (int k = 0;; ++k) {
      if (here.r.cwiseAbs().maxCoeff() <= options_.tolerance) return q;
      if (k >= options_.iterations || damping > kMostMu) break;
      const VectorXd next = step(q, here, damping);
      TargetError there = error(next);
      if (there.r.squaredNorm() < here.r.squaredNorm()) {
        q = next;
        here = std::move(there);
        damping = std::max(damping / 10, kLeastMu);
      } else {
        damping *= 10;
      }
    }
    return std::nullopt;
  }

  VectorXd drawn(const VectorXd& from) {
    VectorXd q(model_.nv);
    for (int i = 0; i < model_.nv; ++i) {
      const bool slides = model_.joints[std::size_t(i)].type == dynamics::JointType::kPrismatic;
      const double room = slides ? 0.5 : std::numbers::pi;
      const double low = std::isfinite(lower_[i]) ? lower_[i] : from[i] - room;
      const double high = std::isfinite(upper_[i]) ? upper_[i] : from[i] + room;
      // Not uniform_real_distribution, which every library draws in its own way.
      q[i] = low + (high - low) * (double(random_() >> 11) * 0x1p-53);
    }
    return q;
  }

 private:
  VectorXd within(const VectorXd& q) const { return q.cwiseMax(lower_).cwiseMin(upper_); }

  TargetError error(const VectorXd& q) {
    const MatrixXd local =
        dynamics::frame_jacobian(model_, data_, q, frame_, dynamics::ReferenceFrame::kLocal);
    dynamics::forward_kinematics(model_, data_, q);
    const dynamics::Placement<double> X = dynamics::frame_placement(model_, data_, frame_);
    const int places = target_.position ? 3 : 0, turns = target_.orientation ? 3 : 0;
    TargetError e{VectorXd(places + turns), MatrixXd(places + turns, model_.nv)};
    if (places) {
      e.r.head(3) = X.p - *target_.position;
      e.J.topRows(3) = X.R * local.topRows(3);
    }
    if (turns) {
      const dynamics::Matrix3<double> off(target_.orientation->transpose() * X.R);
      const dynamics::Vector3<double> w = dynamics::log(off);
      e.r.tail(3) = w;
      e.J.bottomRows(3) = dynamics::inverse_right_jacobian(w) * local.bottomRows(3);
    }
    return e;
  }

  // Joints at a limit that the step would leave are held, until none is.
  VectorXd step(const VectorXd& q, const TargetError& at, double damping) const {
    MatrixXd J = at.J;
    VectorXd next = q, r = at.r;
    for (int round = 0; round <= model_.nv; ++round) {
      MatrixXd A = J * J.transpose();
      A.diagonal().array() += damping;
      const VectorXd wanted = next - J.transpose() * solve_positive(A, r);
      const VectorXd kept = within(wanted);
      bool is_held = false;
      for (int i = 0; i < model_.nv; ++i) {
        if (kept[i] == wanted[i] || J.col(i).isZero(0)) continue;
        r += J.col(i) * (kept[i] - next[i]);  // the remainder, for the other joints
        next[i] = kept[i];
        J.col(i).setZero();
        is_held = true;
      }
      if (!is_held) return kept;
    }
    return next;
  }

  const dynamics::Model<double>& model_;
  dynamics::Data<double> data_;
  FrameTarget target_;
  InverseKinematicsOptions options_;
  int frame_ = -1;
  VectorXd lower_, upper_;
  std::mt19937_64 random_{kSeedOfStarts};
};

void check_search(const RobotScene& scene, const VectorXd& from) {
  const auto& model = scene.model;
  for (const auto& joint : model.joints) {
    if (dynamics::traits(joint.type).on_a_line) continue;
    refuse(model, "joint \"" + joint.name + "\" is " + dynamics::to_string(joint.type) +
                      "; inverse kinematics takes joints of one degree of freedom");
  }
  if (from.size() != model.nq || !from.allFinite())
    refuse(model, "inverse kinematics starts from " + std::to_string(from.size()) + " values, expected " +
                      std::to_string(model.nq) + " finite ones");
}

}  // namespace

std::optional<VectorXd> inverse_kinematics(const RobotScene& scene, const FrameTarget& target,
                                           const VectorXd& from, const InverseKinematicsOptions& options) {
  check_search(scene, from);
  frame_error(scene, target);  // what is wrong with a target, it says
  Reacher reacher(scene, target, options);
  for (int k = 0; k < options.starts; ++k) {
    const auto q = reacher.reach(k == 0 ? from : reacher.drawn(from));
    if (q && (!options.accept || options.accept(*q))) return q;
  }
  return std::nullopt;
}

Reach reach_of(const dynamics::Model<double>& model, const std::string& frame) {
  const auto& at = model.frames[std::size_t(model.frame_index(frame))];
  Reach reach{"", at.X_BF.p, 0};
  double beyond = at.X_BF.p.norm();  // of the origin of the joint that is looked at
  for (int i = at.body; i >= 0; i = model.parent[std::size_t(i)]) {
    const auto& joint = model.joints[std::size_t(i)];
    if (joint.type == dynamics::JointType::kPrismatic)
      beyond += std::max(std::abs(joint.limits.lower), std::abs(joint.limits.upper));
    if (joint.type == dynamics::JointType::kHelical || !dynamics::is_single(joint.type)) beyond = HUGE_VAL;
    reach = {joint.name, model.X_PJ[std::size_t(i)].p, beyond};
    beyond += model.X_PJ[std::size_t(i)].p.norm();
  }
  return reach;
}

std::string why_unreachable(const dynamics::Model<double>& model, const FrameTarget& target,
                            const std::string& what) {
  if (!target.position) return "";
  constexpr double kRounding = 1e-9;
  const Reach reach = reach_of(model, target.frame);
  const double distance = (*target.position - reach.centre).norm();
  if (reach.joint.empty() || !(distance > (1 + kRounding) * reach.radius)) return "";
  return what + " is " + io::significant(distance, 3) + " m from joint '" + reach.joint + "', and '" +
         target.frame + "' gets " + io::significant(reach.radius, 3) + " m away from it at most" +
         (distance > 30 * reach.radius ? "; positions are in metres" : "");
}

}  // namespace dyntape
