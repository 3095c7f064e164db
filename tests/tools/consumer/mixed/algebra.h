#pragma once

#include <Eigen/Core>

struct Pose {  // members whose places an alignment moves
  char c = 0;
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  Eigen::Vector2d u = Eigen::Vector2d::Ones();
  Eigen::Matrix<float, 8, 1> f = Eigen::Matrix<float, 8, 1>::Ones();
};

#define DECLARE_ALGEBRA(name)                \
  namespace name {                           \
  Eigen::VectorXd longer(Eigen::VectorXd x); \
  Eigen::MatrixXd solved(Eigen::MatrixXd a); \
  Pose turned(Pose pose);                    \
  }
DECLARE_ALGEBRA(plain)
DECLARE_ALGEBRA(native)
