// SPDX-License-Identifier: BSD-3-Clause
//
// Energies of a scene and the power of all that acts, recorded and compiled.
//
//   EnergyMeter meter(scene, {});
//   const Energy& e = meter.at(x, u);            // x = (q, v, motors with a lag); e.kinetic, e.stored (J), e.power (W)
//   meter.layout().flows                         // rows of e.power: "motors", then the effects that supply or take energy
//   meter.layout().mechanisms                    // columns: energies are also known of each mechanism (mechanisms.h)
//
// The kinetic energy changes by the work of all flows.  The work of what has a potential is what it stores less, exactly;
// `unstored` is the power of everything else, of which the work is an integral over time (step_work.h).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <dyntape/autodiff/record/eigen.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/system/mechanisms.h>
#include <dyntape/interface/system/scene_system.h>

namespace dyntape {

struct Energy {
  double kinetic = 0;
  double stored = 0;           // in gravity, springs and whatever has a potential
  Eigen::VectorXd kinetic_of;  // (mechanisms)
  // (flows x mechanisms): W, W and J, the last but for a constant.  power = unstored - d/dt stored_of
  Eigen::MatrixXd power, unstored, stored_of;
};

// What the results of a recording of energies are: kinetic, stored; then of each mechanism its kinetic energy, and power,
// unstored power and stored energy of each flow.
struct EnergyLayout {
  std::vector<std::string>
      flows;  // what the powers are of: "motors", then the effects that supply or take energy
  std::vector<Mechanism> mechanisms;

  Eigen::Index size() const {
    return 2 + Eigen::Index(mechanisms.size()) * (1 + 3 * Eigen::Index(flows.size()));
  }
  // Entry i stands at y[i * stride].
  void read(const double* y, Eigen::Index stride, Energy& energy) const;
};

class EnergyMeter {
 public:
  // With numbers of the scene as parameters, as its system has them (scene_system.h).
  EnergyMeter(const RobotScene& scene, const CodegenOptions& options, int n_p = 0,
              const SceneEdit& edit = {});
  EnergyMeter(const EnergyMeter& other);  // with working memory of its own, for another thread

  const EnergyLayout& layout() const { return layout_; }
  // u: what the motors are told, which those without a lag give at once; p (n_p).  Valid until the next call.
  const Energy& at(const Eigen::VectorXd& x, const Eigen::VectorXd& u, const Eigen::VectorXd& p = {});
  // Powers are of the forces at x along another velocity (nv).
  const Energy& along(const Eigen::VectorXd& velocity, const Eigen::VectorXd& x, const Eigen::VectorXd& u,
                      const Eigen::VectorXd& p = {});
  const Energy& latest() const { return energy_; }

  // Of many states in lanes, laid out as those of Stepper::steps_side_by_side; arguments (t, h, u, p, the velocity that
  // powers are along), y (layout().size()).
  void side_by_side(std::size_t count, std::size_t width, const double* x, const double* arguments, double* y,
                    std::uint32_t* status);

 private:
  EnergyLayout layout_;
  CompiledFunction function_;  // of variables x and parameters (t, h, u, p, along)
  CompiledFunction::Workspace workspace_;
  Eigen::Index nq_, nv_;
  Eigen::VectorXd arguments_, output_;
  Energy energy_;
};

}  // namespace dyntape
