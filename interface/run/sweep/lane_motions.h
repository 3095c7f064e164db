// SPDX-License-Identifier: BSD-3-Clause
//
// Samples of an explicit scheme that move together in lanes, from start to end.  Internal.
//
//   LaneMotions together(functions, first, count);
//   if (together.run(stop)) ... together.motions[i], together.warnings[i]
//
// No data is rearranged between steps.  Every few steps the states are checked for finite values.  A sample that is
// not finite returns to its last checked state and continues alone, up to the failing step and its message.
#pragma once

#include <cstdint>
#include <stop_token>

#include <dyntape/codegen/run/lanes.h>
#include <dyntape/interface/run/simulate/step_work.h>
#include <dyntape/interface/run/sweep/sample_motion.h>

namespace dyntape {

class LaneMotions {
 public:
  LaneMotions(SweptFunctions& functions, long first, long count);

  bool run(const std::stop_token& stop);  // false: stopped by the token

  std::vector<SampleMotion> motions;
  std::vector<std::string> warnings;

 private:
  // Entry i of sample k; each sample has `entries` entries.
  double& at(double* array, long entries, long i, long k) const {
    return array[(k / width_ * entries + i) * width_ + k % width_];
  }
  long places() const { return (long(motions.size()) + width_ - 1) / width_ * width_; }
  void put(long k, const SampleMotion& motion);
  Eigen::VectorXd entries_of(codegen::AlignedRoom& array, long entries, long first, long n, long k) const;
  void take(long k, codegen::AlignedRoom& x, const SampleExtremes& extremes);
  friend struct LaneSteps;
  void after_step(const StepTime& s);
  void set_times(double t, double h);
  void note_state(long k);
  void note_speeds();
  void evaluate_energies(const double* x);
  void put_energy_arguments(const double* x);
  void note_energies();
  void judge_energies();
  void work_of_step(double t);
  void work_of_stage();
  void try_halves(double t);
  void keep();
  void look_for_failures();
  void look_behind_the_end();
  bool is_within(long k);

  SweptFunctions& functions_;
  const Scene& scene_;
  long width_, nx_, nq_, nv_, n_arguments_, n_energy_arguments_;
  std::vector<char> is_over_;
  codegen::AlignedRoom x_, next_, arguments_, energy_arguments_, half_, twice_, energies_, speeds_,
      most_energy_;
  codegen::AlignedRoom kept_x_, kept_speeds_, kept_most_energy_;
  long kept_step_ = 0, step_ = 0;
  bool is_sound_ = true;  // the last step took no branch other than the recording
  std::vector<std::uint32_t> status_, unread_;
  std::vector<SampleJudge> judges_;
  const WorkRule rule_;
  StepWork of_steps_;
  std::vector<Eigen::MatrixXd> work_;  // of the step, a matrix a sample
  Energy energy_;                      // of one of them
};

}  // namespace dyntape
