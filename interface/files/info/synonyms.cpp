// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/info/synonyms.h>

#include <algorithm>

namespace dyntape::io {
namespace {

struct Meaning {
  std::string_view here;
  std::vector<std::string_view> elsewhere;  // in small letters, words joined by _
};

const std::vector<Meaning>& meanings() {
  static const std::vector<Meaning> all = {
      // Keys: of OCS2, Crocoddyl, acados, CasADi, Drake, MuJoCo, SDF and of textbooks.
      {"step", {"dt", "h", "timestep", "time_step", "step_size", "max_step_size"}},
      {"intervals",
       {"n", "nodes", "n_nodes", "num_nodes", "knots", "knot_points", "n_steps", "horizon_length",
        "n_horizon"}},
      {"duration", {"t", "tf", "t_final", "final_time", "time", "seconds", "time_horizon", "horizon"}},
      {"tolerance", {"tol", "eps", "epsilon", "accuracy", "th_stop"}},
      {"max_iterations", {"max_iter", "maxiter", "iterations", "n_iter", "num_iterations"}},
      {"start", {"x0", "initial", "initial_state", "init", "initial_conditions", "keyframe"}},
      {"goal", {"xf", "x_goal", "final", "final_state", "x_ref", "reference_state"}},
      {"q", {"position", "positions", "pos", "qpos", "joint_positions", "configuration", "angles"}},
      {"v", {"velocity", "velocities", "vel", "qvel", "qd", "dq", "qdot", "joint_velocities"}},
      {"control", {"torque", "torques", "u", "tau", "r", "input", "inputs", "ctrl"}},
      {"efforts", {"torque", "torques", "controls", "inputs", "effort"}},
      {"tracking", {"state", "states", "error", "goal", "position"}},
      {"friction", {"mu", "friction_coefficient", "mu_static"}},
      {"stiffness", {"k", "kp", "p_gain", "spring"}},
      {"damping", {"d", "kd", "d_gain", "damper"}},
      {"scheme", {"integrator", "method", "collocation", "discretization", "integration"}},
      {"integrator", {"scheme", "method", "solver", "integration"}},
      {"contacts", {"feet", "contact_points", "foot"}},
      {"points", {"feet", "frames", "links", "contact_points"}},
      {"obstacles", {"collision", "collisions", "environment", "world"}},
      {"samples", {"n", "count", "number", "runs", "trials"}},
      {"urdf", {"file", "model", "path", "filename"}},
      {"base", {"floating_base", "root_joint", "fixed_base"}},
      // Values.
      {"runge-kutta-4", {"rk4", "erk4", "runge_kutta", "erk", "explicit_rk4"}},
      {"semi-implicit-euler", {"symplectic_euler", "semi_implicit", "implicit_euler_velocity", "euler"}},
      {"implicit-midpoint", {"midpoint", "irk", "implicit"}},
      {"adaptive", {"rk45", "ode45", "dopri", "dopri5", "adams", "variable_step"}},
      {"adaptive-stiff", {"bdf", "cvode", "cvodes", "ode15s", "stiff"}},
      {"hermite-simpson", {"simpson", "hs", "direct_collocation"}},
      {"trapezoid", {"trapezoidal", "crank_nicolson"}},
      {"riccati", {"ipm", "hpipm", "structured", "interior_point", "fatrop"}},
      {"ddp", {"ilqr", "ilqg", "fddp", "box_ddp", "slq"}},
      {"gauss_newton", {"gn"}},
      {"limited_memory", {"bfgs", "lbfgs", "l_bfgs", "quasi_newton"}},
      {"floating", {"free", "freeflyer", "free_flyer", "true"}},
      {"fixed", {"welded", "false"}}};
  return all;
}

}  // namespace

std::string synonym_of(std::string_view word, const std::vector<std::string>& valid) {
  std::string plain(word);
  for (char& c : plain)
    c = c == '-' || c == ' ' ? '_' : c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  for (const Meaning& meaning : meanings()) {
    const auto& names = meaning.elsewhere;
    if (std::find(names.begin(), names.end(), plain) == names.end()) continue;
    if (std::find(valid.begin(), valid.end(), meaning.here) != valid.end()) return std::string(meaning.here);
  }
  return {};
}

}  // namespace dyntape::io
