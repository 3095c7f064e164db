// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/sweep/sweep_rows.h>

#include <algorithm>
#include <limits>

#include <dyntape/interface/io/number.h>
#include <dyntape/interface/run/sweep/lane_motions.h>

namespace dyntape {

namespace {

void append_number(std::string& line, double x) {
  constexpr double kMost = std::numeric_limits<double>::max();
  line += ',';
  line += io::shortest(std::isnan(x) ? kMost : std::clamp(x, -kMost, kMost));
}

void append_row(SweptFunctions& f, const SampleMotion& motion, bool ok, std::string& text) {
  text += std::to_string(motion.row);
  for (double value : values_of(f.sweep, motion.row)) append_number(text, value);
  const Scene& scene = f.sweep.scene;
  append_number(text, ok ? 1 : 0);
  append_number(text, double(motion.steps) * scene.step);
  for (double x : motion.x.head(scene.robot.model.nq + scene.robot.model.nv)) append_number(text, x);
  const Energy& energies = f.meter.at(motion.x, motion.start.u.col(0), motion.start.p);
  for (double x : {energies.kinetic, energies.stored, motion.extremes.energy, motion.extremes.v})
    append_number(text, x);
  text += '\n';
}

void append_result(SweptFunctions& f, const SampleMotion& motion, const std::string& warning,
                   ComputedRows& rows) {
  const std::string what = !motion.trouble.empty() ? "ended " + motion.trouble
                           : warning.empty()       ? ""
                                                   : "not to be trusted: " + warning;
  append_row(f, motion, what.empty(), rows.text);
  if (!what.empty()) rows.failures.push_back("sample " + std::to_string(motion.row) + ": " + what);
}

// False where it is stopped.
bool append_sample(SweptFunctions& f, long row, const std::stop_token& stop, ComputedRows& rows) {
  SampleMotion motion = begin_of(f, row);
  SampleJudge judge(f);
  if (!advance(f, motion, f.sweep.scene.steps(), &judge, stop)) return false;
  append_result(f, motion, motion.trouble.empty() ? judge.warning(f.sweep, row) : "", rows);
  return true;
}

}  // namespace

long rows_at_a_time(const SceneSweep& sweep) {
  const bool in_lanes = moves_in_lanes(sweep.scene);
  const long least = in_lanes ? 8 : 1;  // one after the other, a row that is done is kept
  constexpr long kMost = 256;
  const long steps = (in_lanes ? 1L << 19 : 1L << 15) / sweep.scene.steps();
  const long share = (sweep.rows() + 63) / 64;
  const long rows = std::clamp(std::min(steps, share), least, kMost);
  return (rows + least - 1) / least * least;
}

SweepRows::SweepRows(const SceneSweep& sweep, const CodegenOptions& options)
    : functions_(std::make_unique<SweptFunctions>(sweep, options)) {}
SweepRows::SweepRows(std::unique_ptr<SweptFunctions> functions) : functions_(std::move(functions)) {}
SweepRows::~SweepRows() = default;
SweepRows::SweepRows(SweepRows&&) noexcept = default;
SweepRows SweepRows::twin() const { return SweepRows(functions_->twin()); }

std::size_t SweepRows::operations() const { return functions_->stepper.report().step_operations; }

std::optional<ComputedRows> SweepRows::compute(long first, long count, const std::stop_token& stop) {
  SweptFunctions& f = *functions_;
  ComputedRows rows;
  if (f.is_in_lanes) {
    LaneMotions together(f, first, count);
    if (!together.run(stop)) return {};
    for (std::size_t k = 0; k < together.motions.size(); ++k)
      append_result(f, together.motions[k], together.warnings[k], rows);
    return rows;
  }
  for (long row = first; row < first + count; ++row)
    if (!append_sample(f, row, stop, rows)) return {};
  return rows;
}

}  // namespace dyntape
