// SPDX-License-Identifier: BSD-3-Clause
//
// Computes the energies of a scene and the power of each effect; recorded and compiled.
//
//   EnergyMeter meter(scene, {});
//   const Energy& e = meter.at(x, u);            // x = (q, v, motors with a lag); e.kinetic, e.stored (J), e.power (W)
//   meter.layout().flows                         // rows of e.power: "motors", then effects that supply or dissipate
//                                                energy
//   meter.layout().mechanisms                    // columns: energies are also computed per mechanism (mechanisms.h)
//
// The kinetic energy changes by the work of all flows.  The work of a potential is the decrease of its energy,
// exactly.  `unstored` is the power of all other flows, whose work is an integral over time (step_work.h).
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
  double stored = 0;           // in gravity, springs and other potentials
  Eigen::VectorXd kinetic_of;  // (mechanisms)
  // (flows x mechanisms): W, W and J, the last up to a constant.  power = unstored - d/dt stored_of
  Eigen::MatrixXd power, unstored, stored_of;
};

// The layout of the results: kinetic, stored; then for each mechanism its kinetic energy, and power, unstored power
// and stored energy of each flow.
struct EnergyLayout {
  std::vector<std::string>
      flows;  // names of the flows: "motors", then the effects that supply or dissipate energy
  std::vector<Mechanism> mechanisms;

  Eigen::Index size() const {
    return 2 + Eigen::Index(mechanisms.size()) * (1 + 3 * Eigen::Index(flows.size()));
  }
  // Entry i is at y[i * stride].
  void read(const double* y, Eigen::Index stride, Energy& energy) const;
};

class EnergyMeter {
 public:
  // With numbers of the scene as parameters, as in its system (scene_system.h).
  EnergyMeter(const RobotScene& scene, const CodegenOptions& options, int n_p = 0,
              const SceneEdit& edit = {});
  EnergyMeter(const EnergyMeter& other);  // with its own working memory, for another thread

  const EnergyLayout& layout() const { return layout_; }
  // u: commands of the motors, also their outputs without lag; p (n_p).  Valid until the next call.
  const Energy& at(const Eigen::VectorXd& x, const Eigen::VectorXd& u, const Eigen::VectorXd& p = {});
  // Powers of the forces at x along another velocity (nv).
  const Energy& along(const Eigen::VectorXd& velocity, const Eigen::VectorXd& x, const Eigen::VectorXd& u,
                      const Eigen::VectorXd& p = {});
  const Energy& latest() const { return energy_; }

  // Many states in SIMD layout, as in Stepper::steps_side_by_side; arguments (t, h, u, p, velocity for the powers),
  // y (layout().size()).
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
