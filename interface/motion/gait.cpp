// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/motion/gait.h>

#include <cmath>
#include <optional>
#include <utility>

#include <dyntape/dynamics/algebra/scalar.h>
#include <dyntape/interface/motion/of_kinematics.h>
#include <dyntape/interface/motion/robot_terms.h>

namespace dyntape {

double Gait::steps(std::size_t foot, double t) const { return t / period - phases[foot] + 1e-9; }

bool Gait::stands(std::size_t foot, double t) const {
  const double at = steps(foot, t);
  return at - std::floor(at) < duty || duty == 1;
}

double Gait::height(std::size_t foot, double t) const {
  if (stands(foot, t)) return 0;
  const double at = steps(foot, t), s = (at - std::floor(at) - duty) / (1 - duty);
  return 16 * lift * s * s * (1 - s) * (1 - s);
}

std::string Gait::fault(std::size_t feet) const {
  if (!(period > 0 && std::isfinite(period)))
    return "a gait's period is " + std::to_string(period) + " s, expected one above zero";
  if (!(duty > 0 && duty <= 1))
    return "a gait's duty is " + std::to_string(duty) + ", expected one above 0 and up to 1";
  if (phases.size() != feet)
    return "a gait has " + std::to_string(phases.size()) + " phases, expected one a foot, " +
           std::to_string(feet);
  return "";
}

namespace {

// Of the point, or of a foot's corners: z, less what it is above that of the frame as the foot stands.
StageFunction heights(const RobotScene& scene, const HeldContact& contact) {
  std::vector<Eigen::Vector3d> points = contact.corners;
  if (points.empty()) points.push_back(Eigen::Vector3d::Zero());
  const Eigen::Matrix3d axes = contact.axes.value_or(Eigen::Matrix3d::Identity());
  return of_kinematics(scene, [=, frame = moving_frame(scene.model, contact.frame)](
                                  const auto& model, const auto& data, const auto& s) {
    using T = typename std::decay_t<decltype(s.x)>::Scalar;
    const auto at = dynamics::frame_placement(model, data, frame);
    dynamics::VectorX<T> z(Eigen::Index(points.size()));
    for (std::size_t i = 0; i < points.size(); ++i)
      z[Eigen::Index(i)] = at.p[2] + at.R.row(2).dot(points[i].template cast<T>()) - T((axes * points[i])[2]);
    return z;
  });
}

}  // namespace

void walk(Problem& problem, const RobotScene& scene, const std::vector<HeldContact>& contacts,
          const Gait& gait, double weight) {
  const auto refuse = [&](const std::string& what) { dyntape::refuse(scene.model, what); };
  if (const std::string fault = gait.fault(contacts.size()); !fault.empty()) refuse(fault);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const HeldContact& contact = contacts[i];
    if (!contact.has_schedule || !contact.place)
      refuse("contact \"" + contact.frame +
             "\" has no schedule or no place, expected both of one that walks");
    problem.parameters.set(contact.frame + " load", [gait, i](double t) {
      return Eigen::VectorXd::Constant(1, gait.stands(i, t) ? 1 : 0);
    });
    const Parameter load = problem.parameters.find(contact.frame + " load");
    const Parameter height = problem.parameters.add(
        contact.frame + " height", [gait, i, floor = contact.place->z()](double t) -> Eigen::VectorXd {
          return Eigen::VectorXd::Constant(1, floor + gait.height(i, t));
        });
    const StageFunction above = heights(scene, contact);
    const double root = std::sqrt(weight / double(force_points(contact).size()));
    problem.add(running_squares(contact.frame + " swing", [=](const auto& s) {
      using T = typename std::decay_t<decltype(s.x)>::Scalar;
      return ((above(s).array() - height(s)[0]) * ((T(1) - load(s)[0]) * T(root))).matrix().eval();
    }));
  }
}

Term squared_forces(const Problem& problem, const RobotScene& scene, const std::vector<HeldContact>& contacts,
                    double weight) {
  // How many forces a contact has, and whether it stands.
  std::vector<std::pair<int, std::optional<Parameter>>> of;
  Eigen::Index n = 0;
  for (const HeldContact& contact : contacts) {
    std::optional<Parameter> load;
    if (contact.has_schedule) load = problem.parameters.find(contact.frame + " load");
    of.emplace_back(int(force_points(contact).size()), load);
    n += 3 * of.back().first;
  }
  return running_squares("force", [=, root = std::sqrt(weight), all = weight_of(scene)](const auto& s) {
    using T = typename std::decay_t<decltype(s.x)>::Scalar;
    using dynamics::select;
    T standing = T(0);
    for (const auto& [points, load] : of) standing += load ? T((*load)(s)[0] * T(points)) : T(points);
    const T count = select(standing > T(1), standing, T(1));
    dynamics::VectorX<T> rows = s.u.tail(n) * T(root);
    Eigen::Index k = 2;
    for (const auto& [points, load] : of) {
      for (int i = 0; i < points; ++i, k += 3)
        rows[k] -= (load ? (*load)(s)[0] : T(1)) * T(root * all) / count;
    }
    return rows;
  });
}

}  // namespace dyntape
