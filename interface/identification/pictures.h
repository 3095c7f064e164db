// SPDX-License-Identifier: BSD-3-Clause
//
// Draws an excitation: positions and velocities over a period, and the condition over the iterations.
//
//   draw_excitation(arm, optimal_excitation(arm, base), "out/excitation.svg");
//
// Errors: those of io::draw (interface/report/plot/picture.h).
#pragma once

#include <string>

#include <dyntape/interface/identification/excitation.h>

namespace dyntape {

void draw_excitation(const dynamics::Model<double>& model, const Excitation& excitation,
                     const std::string& path);

}  // namespace dyntape
