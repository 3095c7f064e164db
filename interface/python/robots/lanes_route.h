// SPDX-License-Identifier: BSD-3-Clause
//
// The default route of batches: plain double code in packs, and for many states machine code with the same bits.
//
//   const auto route = make_lanes_route(model, RobotFunction("rnea"));
//   route->evaluate(states, count, results);        // from any thread; a column per state
//
// After some thousand states the function is recorded and becomes machine code, within milliseconds, which leaves out the
// zeros of the robot's constants: 2 to 5 times as fast.  It runs the operations of the plain code in their order, so its
// results are equal to the last bit, with three exceptions (autodiff/graph/graph.h): the sign of a zero, values that are
// not finite, and intermediate values that overflow.  evaluate() in robot_routes.h makes zeros positive.  A state with an input
// above 1e30, with a quaternion or a pair (cos, sin) of zeros, or with a result that is infinite or NaN, is evaluated
// again by the plain code; where nothing is divided and no root taken, results of smaller inputs are finite, and only
// inputs are looked at.  So bits never depend on the path, the number of threads or the other states of a batch.
//
// A robot's minverse, fd-derivatives and what uses them have another formula with fewer operations, which other
// routes take: 1.4 to 1.6 times as fast, with other bits.
//
// Functions that factorise matrices, second derivatives, and robots with mimic joints stay with packs.
#pragma once

#include <memory>

#include "../robot_routes.h"

namespace dyntape::python {

std::shared_ptr<RobotPath> make_lanes_route(const dynamics::Model<double>& model,
                                            const RobotFunction& function);

}  // namespace dyntape::python
