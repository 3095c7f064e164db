// SPDX-License-Identifier: BSD-3-Clause
//
// Pictures of a centroidal task (centroidal_task.h).
//
//   io::draw(mass_plot(task, motion), "out/closed_loop.svg");
//   io::draw(support_plot(task, motion), "out/support.svg");
//   write_player(mass_player(task, motion), "out/motion.html");
#pragma once

#include <dyntape/interface/files/task/centroidal_task.h>
#include <dyntape/interface/report/player/player.h>
#include <dyntape/interface/report/plot/picture.h>

namespace dyntape {

// (3 feet x points) The contact forces on the feet (N): the plan's, zero for feet in the air.
Eigen::MatrixXd forces_on_floor(const CentroidalTask& task, const Trajectory& motion);

// The convex hull of points on the floor, anticlockwise; fewer than three corners if all points are on a line.
std::vector<Eigen::Vector2d> support_polygon(std::vector<Eigen::Vector2d> points);

// The capture point c + v / omega on the floor, omega^2 = g / height above the given feet.  (2), m.
Eigen::Vector2d capture_point(const CentroidalBody& body, const Eigen::VectorXd& state);

// (3) The target of the centre of mass, m.
Eigen::Vector3d wanted_mass(const CentroidalTask& task, double t);

// Feet that are on the floor together, from one point of a motion to another: the corners of the support polygon,
// from above.
struct SupportPhase {
  int first, last;
  std::vector<Eigen::Vector2d> corners;
};
std::vector<SupportPhase> support_phases(const CentroidalTask& task, const Eigen::VectorXd& t);

// Centre of mass with its target, velocity, angular momentum and forces over time.
io::Plot mass_plot(const CentroidalTask& task, const Trajectory& motion);

// Centre of mass, capture point and centre of pressure with every support polygon: from above, and over time with
// the polygon's edges.
io::Plot support_plot(const CentroidalTask& task, const Trajectory& motion);

// The robot with its trunk as at the start and the required leg positions.  If the legs cannot reach them, the page
// shows the distance.
PlayerInput mass_player(const CentroidalTask& task, const Trajectory& motion,
                        const std::stop_token& stop = {});

}  // namespace dyntape
