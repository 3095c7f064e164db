// SPDX-License-Identifier: BSD-3-Clause
//
// Your own robot, from its description to a motion: a crane with a trolley on a rail, a winch and a swinging load.
//
// The description is URDF, here as text; `dyntape` does the same with files: `dyntape info crane.urdf`, and a task
// file for the motion (config/tasks).  Trolley and winch have motors, the swing has none.
#include <cstdio>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/control/solve/solve.h>
#include <dyntape/interface/motion/robot_problem.h>
#include <dyntape/interface/motion/robot_terms.h>

using namespace dyntape;

const char* const kCrane = R"(<robot name="crane">
  <link name="rail"/>
  <link name="trolley"><inertial><mass value="20"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="rope"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="load"><inertial><mass value="10"/><inertia ixx="0.2" iyy="0.2" izz="0.2" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="drive" type="prismatic"><parent link="rail"/><child link="trolley"/>
    <origin xyz="0 0 4"/><axis xyz="1 0 0"/><limit lower="0" upper="6" velocity="3" effort="200"/></joint>
  <joint name="swing" type="revolute"><parent link="trolley"/><child link="rope"/>
    <axis xyz="0 -1 0"/><limit lower="-1" upper="1" velocity="9" effort="0"/></joint>
  <joint name="winch" type="prismatic"><parent link="rope"/><child link="load"/>
    <axis xyz="0 0 -1"/><limit lower="0.5" upper="3.5" velocity="2" effort="300"/></joint>
</robot>)";

int main() try {
  const RobotScene scene{dynamics::load_urdf_text(kCrane, "crane.urdf"), {}, {"drive", "winch"}};
  std::printf("%s: %d joints, driven: drive, winch\n", scene.model.name.c_str(), scene.model.nv);

  // From rest to rest over a wall that the load must clear, with least effort; 4 s.
  Problem p = robot_problem(scene, {.duration = 4});
  p.add(squared_controls(1e-3));
  limit_positions(p, scene), limit_velocities(p, scene), limit_efforts(p, scene, ControlUnit::kPhysical);
  p.start << 0.5, 0, 3, 0, 0, 0;  // drive (m), swing (rad), winch (m), then their rates
  p.goal << 5.5, 0, 3, 0, 0, 0;
  const StageFunction load = frame_position(scene, "load", {0, 0, 0});
  p.add(path_inequality(  // 2 m high at x = 3 m: a smooth hill instead of the wall
      "over the wall", StageFunction([load](const auto& s) {
        using std::exp;
        const auto at = load(s);
        using T = std::decay_t<decltype(s.t)>;
        return vector(T(at[2] - 2.0 * exp(-4.0 * (at[0] - 3.0) * (at[0] - 3.0))));
      }),
      Eigen::VectorXd::Zero(1), Eigen::VectorXd::Constant(1, HUGE_VAL)));

  SolveOptions options;
  options.mesh.intervals = 60;
  options.solver.method = NlpMethod::kRiccati;
  const Solution s = solve(p, options);
  double highest = 0, swing = 0, least = 1;
  for (int k = 0; k < s.motion.points(); ++k) {
    const Eigen::VectorXd at = load(p.stage(s.motion.t[k], s.motion.x.col(k), {}, s.motion.u.col(k)));
    if (k % 20 == 0)
      std::printf("t = %.2f s: load at x %.2f, z %.2f m, drive %6.1f N\n", s.motion.t[k], at[0], at[2],
                  s.motion.u(0, k));
    highest = std::max(highest, at[2]), swing = std::max(swing, std::abs(s.motion.x(1, k)));
    least = std::min(least, at[2] - 2 * std::exp(-4 * (at[0] - 3) * (at[0] - 3)));
  }
  std::printf("%s, %d iterations; load lifted to %.2f m, swings up to %.2f rad, clears the hill by %.1e m\n",
              to_string(s.nlp.status), s.iterations(), highest, swing, least);
  // Lengthening is positive, and the rope hangs on the trolley: at rest the winch holds only the load.
  const double pull = -holding_torque(scene, p.start.head(3))[2];
  std::printf("at rest the winch pulls with %.2f N\n", pull);
  const bool holds = std::abs(pull - 10 * 9.81) < 1e-9;
  return s.success() && holds && least > -1e-6 && s.verification.worst_relative < 1e-3 ? 0 : 1;
} catch (const Error& e) {
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
