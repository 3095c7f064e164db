// SPDX-License-Identifier: BSD-3-Clause
//
// What tests of sweeps have in common: files, rows, and rows against the motions of their scenes.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include <dyntape/interface/io/csv.h>
#include <dyntape/interface/run/simulate/simulate.h>
#include <dyntape/interface/run/sweep/run_sweep.h>

#include "interface/temporary_cache.h"
#include "source_folder.h"

namespace dyntape {

namespace fs = std::filesystem;

inline const TemporaryCache& sweep_cache() {
  static const TemporaryCache cache;
  return cache;
}

inline const std::string kSource = test::source_folder();

// Of a text that stands beside the shipped sweeps.
inline SceneSweep sweep_of(const std::string& text) {
  SceneSweep sweep = read_sweep_text(text, kSource + "/config/sweeps/made_up.info");
  sweep.evaluation.cache_folder = sweep_cache().path();
  return sweep;
}
inline SceneSweep shipped_sweep(const std::string& name) {
  SceneSweep sweep = read_sweep(kSource + "/" + name);
  sweep.evaluation.cache_folder = sweep_cache().path();
  return sweep;
}

inline std::string block(const std::string& name, const std::string& lines) {
  return name + "\n{\n" + lines + "\n}\n";
}
inline std::string value(const std::string& lines) { return block("value", lines); }
inline std::string pendulum_sweep(const std::string& values, const std::string& rest = "samples 8\n") {
  return "scene ../scenes/pendulum.info\n" + rest + block("vary", values);
}

inline ComputedRows computed(const SceneSweep& sweep, long first, long count) {
  SweepRows rows(sweep, sweep.evaluation);
  return rows.compute(first, count, {}).value();
}

inline io::CsvTable table_of(const SceneSweep& sweep, const ComputedRows& rows) {
  std::string header;
  for (const std::string& name : row_names(sweep)) header += (header.empty() ? "" : ",") + name;
  return io::parse_csv(header + "\n" + rows.text, "rows");
}

// Each row against the motion of its scene: the same bits.
inline void expect_rows_of_scenes(const SceneSweep& sweep, long first, long count) {
  const io::CsvTable table = table_of(sweep, computed(sweep, first, count));
  for (long k = 0; k < count; ++k) {
    const Scene scene = scene_of(sweep, first + k);
    const SimulatedMotion motion = simulate(scene);
    ASSERT_EQ(motion.trouble, "") << sweep.name << " " << first + k;
    const int last = motion.samples() - 1, q = table.index("t") + 1, v = q + scene.robot.model.nq;
    for (int i = 0; i < scene.robot.model.nq; ++i)
      EXPECT_EQ(table(int(k), q + i), motion.q(i, last)) << sweep.file << " q" << i << " of " << first + k;
    for (int i = 0; i < scene.robot.model.nv; ++i)
      EXPECT_EQ(table(int(k), v + i), motion.v(i, last)) << sweep.file << " v" << i << " of " << first + k;
    double most = -HUGE_VAL;
    for (int i = 0; i < motion.samples(); ++i) most = std::max(most, motion.energy(i));
    const auto near = [&](const char* name, double expected) {
      EXPECT_NEAR(table(int(k), table.index(name)), expected, 1e-12 * (1 + std::abs(expected))) << name;
    };
    near("energy.kinetic", motion.kinetic.back());
    near("energy.stored", motion.stored.back());
    near("most.energy", most);
    EXPECT_GE(table(int(k), table.index("most.v")), motion.v.cwiseAbs().maxCoeff());
  }
}

// In a folder of its own.
class MadeScene {
 public:
  explicit MadeScene(const std::string& scene) : folder_(fs::path(sweep_cache().path()) / "made") {
    fs::create_directories(folder_);
    std::ofstream(folder_ / "scene.info") << scene;
  }
  Scene scene() const { return read_scene((folder_ / "scene.info").string()); }
  SceneSweep sweep(const std::string& text) const {
    SceneSweep sweep = read_sweep_text("scene scene.info\n" + text, (folder_ / "sweep.info").string());
    sweep.evaluation.cache_folder = sweep_cache().path();
    return sweep;
  }

 private:
  fs::path folder_;
};

}  // namespace dyntape
