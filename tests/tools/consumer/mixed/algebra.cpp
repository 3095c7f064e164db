// Takes and gives Eigen's objects; compiled once a kind of unit, NAME telling them apart.
#include <Eigen/Cholesky>

#include "algebra.h"

namespace NAME {

Eigen::VectorXd longer(Eigen::VectorXd x) {
  x.conservativeResize(x.size() + 3);
  x.tail(3).setOnes();
  return x;
}

// Large enough for Eigen's packed products.
Eigen::MatrixXd solved(Eigen::MatrixXd a) {
  Eigen::MatrixXd square = a * a.transpose();
  square.diagonal().array() += 1;
  a = square.llt().solve(a);
  return a;
}

Pose turned(Pose pose) {
  pose.T = pose.T * pose.T;
  return pose;
}

}  // namespace NAME
