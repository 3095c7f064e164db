// SPDX-License-Identifier: BSD-3-Clause
//
// A user's unit that reaches the definitions of the algorithms, compiled with flags of its own.
#include <dyntape/dynamics/instantiate.h>

using namespace dyntape::dynamics;

double DYNTAPE_OTHER(const Model<double>& model) {
  Data<double> data(model);
  const VectorX<double> q = neutral<double>(model), v = VectorX<double>::Constant(model.nv, 0.3);
  Centroidal<double> centroidal(model);
  SecondOrder<double> second(model);
  double sum = rnea<double>(model, data, q, v, v).sum() + aba<double>(model, data, q, v, v).sum();
  sum += crba<double>(model, data, q).sum() + minverse<double>(model, data, q).sum();
  id_derivatives<double>(model, data, q, v, v);
  fd_derivatives<double>(model, data, q, v, v);
  id_second_order<double>(model, data, second, q, v, v);
  return sum + data.dtau_dq.sum() + integrate<double>(model, q, v).sum() +
         center_of_mass<double>(model, data, centroidal, q).sum();
}
