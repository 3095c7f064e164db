// SPDX-License-Identifier: BSD-3-Clause
//
// The computations of differential dynamic programming in lanes, for problems of one structure.  Each problem has
// its own start, parameters and motion, in a slot.  There are more slots than lanes, so that lanes have work while
// problems wait for other work.
//
//   std::unique_ptr<LaneWork> work = make_lane_work({step, end, ...}, 3);   // three slots a lane
//   work->load(slot, parameters, at_end, x, u);        // for every slot
//   work->roll_out(trials);                            // one trial for each lane, of any problem
//   work->accept(slot, trial);                         // the trial's motion becomes the problem's
//   work->linearise(slots);                            // at most as many slots as lanes
//   over = work->backward(slots);                      // any number of slots, each from its stage, until some are over
//   work->predict(slots);                              // slots that are over and convex
//
// The results of a slot have the same bits for any work of the other slots and any number of lanes.  The course of
// each solve (solve/ddp_course.h), where a slot is called a lane, decides about the next work.
#pragma once

#include <memory>
#include <vector>

#include <dyntape/interface/control/batch/lane_setup.h>
#include <dyntape/interface/control/solve/ddp_sensitivities.h>
#include <dyntape/interface/control/solve/ddp_work.h>

namespace dyntape {

struct LaneTrial {
  int slot = 0;  // of the problem
  double length = 1;
  double cost = 0;  // result; not finite if the motion is not finite or leaves a recorded branch
};

class LaneWork : public DdpWork {
 public:
  virtual int lanes() const = 0;
  virtual int slots() const = 0;
  // (2 + 3 n_p x N) and (1 + n_p), the parameters of record_shooting(); the initial motion; no policy.
  virtual void load(int slot, const Eigen::MatrixXd& parameters, const Eigen::VectorXd& at_end,
                    const Eigen::MatrixXd& x, const Eigen::MatrixXd& u) = 0;
  // At most lanes() trials, one for each lane.
  virtual void roll_out(std::vector<LaneTrial>& trials) = 0;
  // The motion of a trial of the last roll_out() becomes the motion of its slot.
  virtual void accept(int slot, int trial) = 0;
  virtual void linearise(const std::vector<int>& slots) = 0;
  virtual std::vector<int> backward(const std::vector<int>& slots) = 0;
  virtual void predict(const std::vector<int>& slots) = 0;

  // After these calls at solutions: the slopes of the cost by the start; the changes of the motions with their
  // policies, one slot for each lane; and whether a control of that lane is weakly held (solve/ddp_sensitivities.h).
  virtual Eigen::VectorXd cost_slopes(int slot) const = 0;  // by the start
  virtual void find_changes(const std::vector<int>& slots) = 0;
  virtual void take_changes(int lane, ChangesOfMotion& to) const = 0;
  virtual bool is_weakly_held(int lane) const = 0;
  virtual bool is_flat(int slot) const = 0;  // of backward(): whether the minimum is not strict
};

std::unique_ptr<LaneWork> make_lane_work(const LaneSetup& setup, int slots_a_lane);

}  // namespace dyntape
