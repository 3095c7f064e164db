// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/motion/robot_terms.h>

#include <cmath>
#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algebra/lie.h>
#include <dyntape/dynamics/algorithms/centroidal.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/interface/motion/of_kinematics.h>

namespace dyntape {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

template <class T>
using Of3 = dynamics::Vector3<T>;

// The scalar of a robot.
template <class T>
T scalar_of(const dynamics::Model<T>&);

// A rotation within rounding of what a file's digits give.
constexpr double kRotation = 1e-6;

template <class Derived>
void check_numbers(const RobotScene& scene, const std::string& what,
                   const Eigen::MatrixBase<Derived>& values) {
  if (values.allFinite()) return;
  refuse(scene.model, what + " has an entry that is no finite number");
}

void check_rotation(const RobotScene& scene, const std::string& frame, const Matrix3d& R) {
  const std::string what = "the orientation wanted of frame \"" + frame + "\"";
  check_numbers(scene, what, R);
  const double off = (R.transpose() * R - Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (off < kRotation && R.determinant() > 0) return;
  refuse(scene.model, what + " is no rotation; expected R^T R = 1 and a determinant of 1");
}

// Two unit vectors across a unit vector: columns.
Eigen::Matrix<double, 3, 2> across(const Vector3d& axis) {
  Eigen::Matrix<double, 3, 2> both;
  both.col(0) = axis.unitOrthogonal();
  both.col(1) = axis.cross(Vector3d(both.col(0)));
  return both;
}

}  // namespace

Matrix3d rotation_of(double roll, double pitch, double yaw) {
  return (Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) * Eigen::AngleAxisd(pitch, Vector3d::UnitY()) *
          Eigen::AngleAxisd(roll, Vector3d::UnitX()))
      .toRotationMatrix();
}

int moving_frame(const dynamics::Model<double>& model, const std::string& frame) {
  const int index = model.frame_index(frame);
  if (model.frames[std::size_t(index)].body >= 0) return index;
  refuse(model, "frame \"" + frame + "\" is fixed to the world; expected one that a joint moves");
}

StageFunction frame_position(const RobotScene& scene, const std::string& frame, const Vector3d& target) {
  check_numbers(scene, "the position wanted of frame \"" + frame + "\"", target);
  return of_kinematics(
      scene, [=, index = moving_frame(scene.model, frame)](const auto& model, const auto& data, const auto&) {
        using T = decltype(scalar_of(model));
        return (dynamics::frame_placement(model, data, index).p - Of3<T>(target.cast<T>()));
      });
}

StageFunction frame_orientation(const RobotScene& scene, const std::string& frame, const Matrix3d& target) {
  check_rotation(scene, frame, target);
  return of_kinematics(
      scene, [=, index = moving_frame(scene.model, frame)](const auto& model, const auto& data, const auto&) {
        using T = decltype(scalar_of(model));
        const dynamics::Matrix3<T> back(target.transpose().cast<T>());
        const dynamics::Matrix3<T> R = back * dynamics::frame_placement(model, data, index).R;
        return dynamics::log(R);
      });
}

StageFunction moving_frame_orientation(const RobotScene& scene, const std::string& frame,
                                       const StageFunction& target) {
  return of_kinematics(scene, [target, index = moving_frame(scene.model, frame)](
                                  const auto& model, const auto& data, const auto& s) {
    using T = decltype(scalar_of(model));
    const auto rows = target(s);
    const dynamics::Matrix3<T> back(dynamics::Matrix3<T>::Map(rows.data()));  // by columns: the transpose
    const dynamics::Matrix3<T> R = back * dynamics::frame_placement(model, data, index).R;
    return dynamics::log(R);
  });
}

StageFunction frame_error(const RobotScene& scene, const FrameTarget& target) {
  if (!target.position && !target.orientation) {
    refuse(scene.model, "the target of frame \"" + target.frame +
                            "\" has neither a position nor an orientation; expected one or both");
  }
  if (!target.orientation) return frame_position(scene, target.frame, *target.position);
  const StageFunction turned = frame_orientation(scene, target.frame, *target.orientation);
  if (!target.position) return turned;
  const StageFunction away = frame_position(scene, target.frame, *target.position);
  return [away, turned](const auto& s) {
    auto rows = away(s);
    rows.conservativeResize(6);
    rows.tail(3) = turned(s);
    return rows;
  };
}

StageFunction frame_velocity(const RobotScene& scene, const std::string& frame, dynamics::ReferenceFrame in) {
  return of_kinematics(
      scene, [=, index = moving_frame(scene.model, frame)](const auto& model, const auto& data, const auto&) {
        return dynamics::frame_velocity(model, data, index, in).vector();
      });
}

StageFunction frame_looks_at(const RobotScene& scene, const std::string& frame, const Vector3d& axis,
                             const Vector3d& place) {
  check_numbers(scene, "the place that frame \"" + frame + "\" looks at", place);
  check_numbers(scene, "the axis along which frame \"" + frame + "\" looks", axis);
  if (!(axis.stableNorm() > 0))
    refuse(scene.model, "the axis along which frame \"" + frame + "\" looks is zero, expected a direction");
  const Vector3d ahead = axis.stableNormalized();
  const Eigen::Matrix<double, 3, 2> sides = across(ahead);
  return of_kinematics(
      scene, [=, index = moving_frame(scene.model, frame)](const auto& model, const auto& data, const auto&) {
        using T = decltype(scalar_of(model));
        const dynamics::Placement<T> X = dynamics::frame_placement(model, data, index);
        const Of3<T> d = dynamics::transposed_times(X.R, Of3<T>(place.cast<T>()) - X.p);
        using std::sqrt;
        const T scale = T(1) / (sqrt(d.squaredNorm()) + d.dot(Of3<T>(ahead.cast<T>())));
        return vector(T(d.dot(Of3<T>(sides.col(0).cast<T>())) * scale),
                      T(d.dot(Of3<T>(sides.col(1).cast<T>())) * scale));
      });
}

StageFunction com_position(const RobotScene& scene, const Vector3d& target) {
  check_numbers(scene, "the position wanted of the centre of mass", target);
  return of_kinematics(scene, [target](const auto& model, auto& data, const auto& s) {
    using T = decltype(scalar_of(model));
    dynamics::Centroidal<T> whole(model);
    return (dynamics::center_of_mass<T>(model, data, whole, s.x.head(model.nq)) - Of3<T>(target.cast<T>()))
        .eval();
  });
}

StageFunction centroidal_momentum(const RobotScene& scene, const Eigen::Matrix<double, 6, 1>& target) {
  check_numbers(scene, "the momentum wanted", target);
  return of_kinematics(scene, [target](const auto& model, auto& data, const auto& s) {
    using T = decltype(scalar_of(model));
    dynamics::Centroidal<T> whole(model);
    const dynamics::Force<T> h = dynamics::centroidal_momentum<T>(model, data, whole, s.x.head(model.nq),
                                                                  s.x.segment(model.nq, model.nv));
    return (h.vector() - dynamics::Vector6<T>(target.cast<T>())).eval();
  });
}

StageFunction weighted(const StageFunction& residuals, double weight) {
  if (!(weight >= 0 && std::isfinite(weight)))
    throw ArgumentError("a weight of residuals is " + std::to_string(weight) + ", expected zero or more");
  return [residuals, root = std::sqrt(weight)](const auto& s) { return (residuals(s) * root).eval(); };
}

StageFunction part_of(const StageFunction& values, int first, int count) {
  return [=](const auto& s) {
    const auto all = values(s);
    if (first < 0 || count < 1 || first + count > all.size())
      throw ArgumentError("entries " + std::to_string(first) + " to " + std::to_string(first + count - 1) +
                          " are asked for, the function has " + std::to_string(all.size()));
    return all.segment(first, count).eval();
  };
}

StageFunction entries_of(const StageFunction& values, const std::vector<int>& entries) {
  return [values, entries](const auto& s) {
    const auto all = values(s);
    typename std::decay_t<decltype(s)>::Vector chosen(Eigen::Index(entries.size()));
    for (std::size_t k = 0; k < entries.size(); ++k) {
      if (entries[k] < 0 || entries[k] >= all.size())
        throw ArgumentError("entry " + std::to_string(entries[k]) + " is asked for, the function has " +
                            std::to_string(all.size()));
      chosen[Eigen::Index(k)] = all[entries[k]];
    }
    return chosen;
  };
}

// Looked at in configurations that are like no others.
std::vector<int> moved_axes(const dynamics::Model<double>& model, const std::string& frame) {
  constexpr int kLooks = 3;
  constexpr double kRounding = 1e-10;
  const int index = moving_frame(model, frame);
  dynamics::Data<double> data(model);
  std::mt19937_64 random(1);
  Eigen::Matrix<double, 6, 1> most = Eigen::Matrix<double, 6, 1>::Zero();
  for (int look = 0; look < kLooks; ++look) {
    const Eigen::VectorXd q = dynamics::random_configuration(model, random);
    for (int dof = 0; dof < model.nv; ++dof) {
      dynamics::forward_kinematics<double>(model, data, q, Eigen::VectorXd::Unit(model.nv, dof));
      const Eigen::Matrix<double, 6, 1> speed =
          dynamics::frame_velocity(model, data, index, dynamics::ReferenceFrame::kLocalWorldAligned).vector();
      most = most.cwiseMax(speed.cwiseAbs());
    }
  }
  std::vector<int> axes;
  for (int i = 0; i < 6; ++i)
    if (most[i] > kRounding * most.segment<3>(i / 3 * 3).maxCoeff()) axes.push_back(i);
  return axes;
}

}  // namespace dyntape
