// Reads a robot's file and prints the torques that hold the robot at rest.
#include <iostream>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>

int main(int argc, char** argv) try {
  if (argc != 2) return std::cerr << "usage: my_robot ROBOT.urdf\n", 2;
  const auto robot = dyntape::dynamics::load_urdf(argv[1]);
  dyntape::dynamics::Data<double> data(robot);
  const Eigen::VectorXd q = dyntape::dynamics::neutral(robot), zero = Eigen::VectorXd::Zero(robot.nv);
  std::cout << robot.name << ": " << robot.nv << " degrees of freedom\n"
            << "torques at rest: " << dyntape::dynamics::rnea(robot, data, q, zero, zero).transpose() << "\n";
} catch (const dyntape::Error& problem) {
  std::cerr << problem.what() << "\n";
  return 1;
}
