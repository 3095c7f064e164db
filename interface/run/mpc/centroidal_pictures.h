// SPDX-License-Identifier: BSD-3-Clause
//
// Pictures of a robot as one mass (centroidal_task.h).
//
//   io::draw(mass_plot(task, motion), "out/closed_loop.svg");
//   io::draw(support_plot(task, motion), "out/support.svg");
//   write_player(mass_player(task, motion), "out/motion.html");
#pragma once

#include <dyntape/interface/files/task/centroidal_task.h>
#include <dyntape/interface/report/player/player.h>
#include <dyntape/interface/report/plot/picture.h>

namespace dyntape {

// (3 feet x points) What the floor does to each foot (N): the plan's forces, none on feet in the air.
Eigen::MatrixXd forces_on_floor(const CentroidalTask& task, const Trajectory& motion);

// The corners of the smallest convex polygon around points on the floor, anticlockwise; fewer than three where all are in line.
std::vector<Eigen::Vector2d> support_polygon(std::vector<Eigen::Vector2d> points);

// Where the robot would have to put its pressure to come to rest: c + v / omega on the floor, omega^2 = g / height above the feet
// that are given.  (2), m.
Eigen::Vector2d capture_point(const CentroidalBody& body, const Eigen::VectorXd& state);

// (3) Where the centre of mass is to be, m.
Eigen::Vector3d wanted_mass(const CentroidalTask& task, double t);

// Feet that stand together, from one point of a motion to another: the corners of their support, from above.
struct SupportPhase {
  int first, last;
  std::vector<Eigen::Vector2d> corners;
};
std::vector<SupportPhase> support_phases(const CentroidalTask& task, const Eigen::VectorXd& t);

// Centre of mass beside where it is to be, velocity, angular momentum and forces over time.
io::Plot mass_plot(const CentroidalTask& task, const Trajectory& motion);

// Centre of mass, capture point and centre of pressure with every support: from above, and over time with the supports' edges.
io::Plot support_plot(const CentroidalTask& task, const Trajectory& motion);

// The robot with its trunk as at the start and its legs where they have to be for that.  Where they cannot be, the page says
// by how much.
PlayerInput mass_player(const CentroidalTask& task, const Trajectory& motion,
                        const std::stop_token& stop = {});

}  // namespace dyntape
