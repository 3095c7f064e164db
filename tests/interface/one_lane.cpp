// SPDX-License-Identifier: BSD-3-Clause
//
// The algorithms on packs of one lane: the reference of packed_robot_test.cpp.
#include <dyntape/autodiff/scalars/pack_eigen.h>
#include <dyntape/dynamics/instantiate.h>
#include <dyntape/interface/robot/tables/robot_instantiate.h>

namespace dyntape {
using Pack1 = Pack<double, 1>;
}
DYNTAPE_INSTANTIATE_DYNAMICS(dyntape::Pack1)
DYNTAPE_INSTANTIATE_ROBOT(dyntape::Pack1)
