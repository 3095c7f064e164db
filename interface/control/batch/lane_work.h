// SPDX-License-Identifier: BSD-3-Clause
//
// What differential dynamic programming computes, for as many problems at once as a register has lanes: problems of one
// structure, each with its own start, parameters and motion.
//
//   std::unique_ptr<LaneWork> work = make_lane_work({step, end, ...});
//   work->load(lane, parameters, at_end, x, u);        // into every lane
//   work->roll_out(trials);                            // a trial a lane, of any problem
//   work->accept(trial_of);                            // that motion is the problem's now
//   work->linearise(wanted), work->backward(wanted);   // of the lanes that want it; the others keep what they have
//
// What a lane computes has the same bits whatever the others hold and want, in registers of any width.  The course of each solve
// (solve/ddp_course.h) says what is wanted next.
#pragma once

#include <memory>
#include <vector>

#include <dyntape/interface/control/batch/lane_setup.h>
#include <dyntape/interface/control/solve/ddp_sensitivities.h>
#include <dyntape/interface/control/solve/ddp_work.h>

namespace dyntape {

struct LaneTrial {
  int lane = 0;  // the problem's
  double length = 1;
  double cost = 0;  // found; not finite where the motion is not, or leaves a recorded branch
};

class LaneWork : public DdpWork {
 public:
  virtual int lanes() const = 0;
  // (2 + 3 n_p x N) and (1 + n_p), as record_shooting() asks for them; the motion that it starts from; no policy.
  virtual void load(int lane, const Eigen::MatrixXd& parameters, const Eigen::VectorXd& at_end,
                    const Eigen::MatrixXd& x, const Eigen::MatrixXd& u) = 0;
  // One trial a lane, lanes() of them at most.
  virtual void roll_out(std::vector<LaneTrial>& trials) = 0;
  // Of each lane the trial that becomes its motion; -1: none.
  virtual void accept(const std::vector<int>& trial_of) = 0;
  virtual void linearise(const std::vector<bool>& wanted) = 0;
  virtual void backward(const std::vector<bool>& wanted) = 0;

  // After these two, at solutions: what all motions change by with their starts, by the policies; and, of each, whether a control is
  // weakly held (solve/ddp_sensitivities.h).
  virtual void find_changes() = 0;
  virtual ChangesOfMotion changes(int lane, bool with_motion) const = 0;
  virtual bool is_weakly_held(int lane) const = 0;
};

std::unique_ptr<LaneWork> make_lane_work(const LaneSetup& setup);

}  // namespace dyntape
