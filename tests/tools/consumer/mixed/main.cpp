// Eigen's objects from a plain unit to one for the processor at hand, to the library, and back: whoever made a matrix,
// whoever frees it, whichever copy of Eigen's inline functions the linker has taken.
//   mixed ROBOT.urdf
#include <Eigen/Dense>
#include <cstdio>

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>

#include "algebra.h"

int main(int, char** arguments) {
  using namespace dyntape::dynamics;
  const Model<double> model = load_urdf(arguments[1]);
  for (int n = 1; n < 80; n += 13) {
    Eigen::VectorXd x = plain::longer(native::longer(plain::longer(Eigen::VectorXd::Random(n))));
    if (x.size() != n + 9 || x[n + 8] != 1) return std::puts("a vector is damaged"), 1;
    Eigen::MatrixXd a = Eigen::MatrixXd::Random(n, n), b = native::solved(plain::solved(a)),
                    c = plain::solved(native::solved(a));
    if (!((b - c).norm() <= 1e-9 * b.norm())) return std::puts("a matrix is damaged"), 1;
  }
  const Pose pose = plain::turned(native::turned(Pose()));
  if (!pose.T.isIdentity() || pose.u.sum() != 2 || pose.f.sum() != 8)
    return std::puts("a pose is damaged"), 1;

  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(model.nv);
  Eigen::VectorXd q = neutral(model);  // the library makes it, this unit frees it,
  q = integrate<double>(model, q, native::longer(zero).head(model.nv));
  q = plain::longer(std::move(q)).head(model.nq).eval();  // a plain one changes its length
  Data<double> data(model);
  data.M.resize(1, 1);         // freed here what the library made,
  data = Data<double>(model);  // and the other way round
  if (!rnea<double>(model, data, q, zero, zero).allFinite()) return std::puts("a torque is damaged"), 1;
  return 0;
}
