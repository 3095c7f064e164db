// SPDX-License-Identifier: BSD-3-Clause
//
// What differential dynamic programming computes, for as many problems at once as a register has lanes: problems of one
// structure, each with its own start, parameters and motion, in a slot of its own.  There are more slots than lanes, so that lanes
// find work while problems wait for other work.
//
//   std::unique_ptr<LaneWork> work = make_lane_work({step, end, ...}, 3);   // three slots a lane
//   work->load(slot, parameters, at_end, x, u);        // into every slot
//   work->roll_out(trials);                            // a trial a lane, of any problem
//   work->accept(slot, trial);                         // that motion is the problem's now
//   work->linearise(slots);                            // of so many slots at most as there are lanes
//   over = work->backward(slots);                      // of any number of slots: each from where it is, until some are over
//   work->predict(slots);                              // of those that are over and convex
//
// What is computed of a slot has the same bits whatever the others hold and want, in registers of any width.  The course of each solve
// (solve/ddp_course.h), whose lane is a slot here, says what is wanted next.
#pragma once

#include <memory>
#include <vector>

#include <dyntape/interface/control/batch/lane_setup.h>
#include <dyntape/interface/control/solve/ddp_sensitivities.h>
#include <dyntape/interface/control/solve/ddp_work.h>

namespace dyntape {

struct LaneTrial {
  int slot = 0;  // the problem's
  double length = 1;
  double cost = 0;  // found; not finite where the motion is not, or leaves a recorded branch
};

class LaneWork : public DdpWork {
 public:
  virtual int lanes() const = 0;
  virtual int slots() const = 0;
  // (2 + 3 n_p x N) and (1 + n_p), as record_shooting() asks for them; the motion that it starts from; no policy.
  virtual void load(int slot, const Eigen::MatrixXd& parameters, const Eigen::VectorXd& at_end,
                    const Eigen::MatrixXd& x, const Eigen::MatrixXd& u) = 0;
  // One trial a lane, lanes() of them at most.
  virtual void roll_out(std::vector<LaneTrial>& trials) = 0;
  // The motion of a trial of the last roll_out() becomes that of its slot.
  virtual void accept(int slot, int trial) = 0;
  virtual void linearise(const std::vector<int>& slots) = 0;
  virtual std::vector<int> backward(const std::vector<int>& slots) = 0;
  virtual void predict(const std::vector<int>& slots) = 0;

  // After these, at solutions: what the cost changes by with the start; what motions do, by the policies, a slot a lane; and whether
  // a control of that lane is weakly held (solve/ddp_sensitivities.h).
  virtual Eigen::VectorXd cost_slopes(int slot) const = 0;  // by the start
  virtual void find_changes(const std::vector<int>& slots) = 0;
  virtual void take_changes(int lane, ChangesOfMotion& to) const = 0;
  virtual bool is_weakly_held(int lane) const = 0;
  virtual bool is_flat(int slot) const = 0;  // of backward(): whether the minimum is not strict
};

std::unique_ptr<LaneWork> make_lane_work(const LaneSetup& setup, int slots_a_lane);

}  // namespace dyntape
