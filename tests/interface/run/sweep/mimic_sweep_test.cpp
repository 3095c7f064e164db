// SPDX-License-Identifier: BSD-3-Clause
//
// Sweeps of robots with mimic joints: rows are motions of their scenes, and known in closed form.
#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>

#include "interface/message_of.h"
#include "interface/run/tied_robots.h"
#include "swept.h"

namespace dyntape::mimic_sweep_test {
namespace {

// Beside the robot's file, in a folder of its own.
class TiedSweep {
 public:
  explicit TiedSweep(const std::string& simulation) : folder_(fs::path(sweep_cache().path()) / "tied") {
    fs::create_directories(folder_);
    std::ofstream(folder_ / "sliders.urdf") << of.urdf();
    std::ofstream(folder_ / "scene.info")
        << "robot { urdf sliders.urdf  mimic true }\ncommands { torque { a 4 } }\nsimulation { " << simulation
        << " }\n";
  }
  SceneSweep sweep(const std::string& values) const {
    SceneSweep sweep = read_sweep_text("scene scene.info\nsamples 8\nvary\n{\n" + values + "}\n",
                                       (folder_ / "sweep.info").string());
    sweep.evaluation.cache_folder = sweep_cache().path();
    return sweep;
  }

  test::Sliders of;

 private:
  fs::path folder_;
};

TEST(MimicSweeps, RowsAreMotionsOfTheirScenes) {
  for (const char* scheme : {"runge-kutta-4", "implicit-midpoint"}) {
    const TiedSweep tied("duration 0.3  integrator " + std::string(scheme));
    const SceneSweep sweep =
        tied.sweep(value("parameter start.q\nfrom -1\nto 1") + value("parameter start.v\nfrom -1\nto 1") +
                   value("parameter robot.mass:b_link\nfrom 0.1\nto 3"));
    expect_rows_of_scenes(sweep, 0, 8);
    const io::CsvTable table = table_of(sweep, computed(sweep, 0, 8));
    for (long k = 0; k < 8; ++k) {
      const Eigen::VectorXd values = values_of(sweep, k);
      const double r = tied.of.ratio, m_b = values[2], t = 0.3;
      const double a = (4 - 9.81 * (tied.of.m_a + r * m_b)) / (tied.of.m_a + r * r * m_b);
      const double q = values[0] + values[1] * t + a * t * t / 2;
      EXPECT_NEAR(table(int(k), table.index("q.a")), q, 1e-10) << scheme;
      EXPECT_NEAR(table(int(k), table.index("q.b")), r * q + tied.of.offset, 1e-10) << scheme;
    }
  }
}

TEST(MimicSweeps, FollowersDoNotStartByThemselves) {
  const TiedSweep tied("duration 0.3");
  for (const char* of : {"start.q", "start.v", "commands.torque"}) {
    const std::string message = message_of<Error>(
        [&] { (void)tied.sweep(value("parameter " + std::string(of) + "\njoint b\nfrom -1\nto 1")); });
    EXPECT_TRUE(
        message.ends_with("sweep.info:8:7: joint 'b' follows 'a' and has no value of its own; expected 'a'"))
        << message;
  }
}

}  // namespace
}  // namespace dyntape::mimic_sweep_test
