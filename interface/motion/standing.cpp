// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/motion/standing.h>

#include <algorithm>

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

}  // namespace

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
