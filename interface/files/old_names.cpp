// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/old_names.h>

namespace dyntape {

const std::vector<io::Renamed>& old_names() {
  static const std::vector<io::Renamed> names = {
      // The field's words: those of URDF and SRDF, MuJoCo, Crocoddyl, OCS2, acados.
      {"robot.snap", "rotation_tolerance", {}},
      {"planar.turn", "angle", {}},
      {"planar.turn_rate", "angular_velocity", {}},
      {"horizon.shortest", "min_duration", {}},
      {"horizon.longest", "max_duration", {}},
      {"phase.shortest", "min_duration", {}},
      {"phase.longest", "max_duration", {}},
      {"phase.hold", "contacts", {}},
      {"phase.lands", "foothold_offset", {}},
      {"contacts.hold", "points", {}},
      {"closed", "periodic", {}},
      {"obstacles.ball", "sphere", {}},
      {"obstacles.bar", "capsule", {}},
      {"bodies.ball", "sphere", {}},
      {"bodies.bar", "capsule", {}},
      {"bodies.apart", "pair", {}},
      {"terms.term.what", "type", {}},
      {"solver.method", "method", "stages", "riccati"},
      {"mpc.seconds", "duration", {}},
      {"mpc.feedback", "feedback_period", {}},
      {"mpc.late", "max_late", {}},
      {"mpc.push", "disturbance", {}},
      {"verify.true_defect", "integration_error", {}},
      {"verify.between", "between_nodes", {}},
      {"verify.refinements", "max_refinements", {}},
      {"verify.goal", "goal_error", {}},
      {"centroidal.level", "constant_height", {}},
      {"centroidal.turnless", "zero_angular_momentum", {}},
      {"centroidal.rest", "end_at_rest", {}},
      {"centroidal.most_force", "max_force", {}},
      {"gait.duty", "duty_factor", {}},
      {"gait.phases", "phase_offsets", {}},
      {"loop.holds", "type", {}},
      {"actuators.lag", "time_constant", {}},
      {"vary.value.of", "parameter", {}},
      {"vary.value.spread", "distribution", {}},
      {"vary.value.deviation", "standard_deviation", {}},
      {"show", "plot", {}},
  };
  return names;
}

void note_old_names(std::vector<std::string>& notes, const io::Section& file) {
  for (const io::Replacement& replacement : file.replacements()) notes.push_back(to_sentence(replacement));
}

}  // namespace dyntape
