// Packs go by value: a unit that uses them is compiled for the library's processor.
//   mixed_packs ROBOT.urdf
#include <cstdio>

#include <dyntape/autodiff/scalars/pack_eigen.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/urdf/urdf.h>

int main(int, char** arguments) {
  using namespace dyntape;
  const auto model = dynamics::load_urdf(arguments[1]).cast<Pack8>();
  dynamics::Data<Pack8> data(model);
  const dynamics::VectorX<Pack8> zero = dynamics::VectorX<Pack8>::Zero(model.nv);
  const Pack8 torque =
      dynamics::rnea<Pack8>(model, data, zero.head(model.nq), zero, zero)[0] + sin(Pack8(0.5));
  return torque[0] == torque[7] ? 0 : (std::puts("lanes differ"), 1);
}
