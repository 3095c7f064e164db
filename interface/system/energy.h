// SPDX-License-Identifier: BSD-3-Clause
//
// Energies of a scene and the power of all that acts, recorded and compiled.
//
//   EnergyMeter meter(scene, {});
//   const Energy& e = meter.at(x, drive);        // x = (q, v, ...); e.kinetic, e.stored (J), e.power (W)
//   meter.names()                                // of e.power: "motors", then the effects that supply or take energy
//   meter.mechanisms()                           // what energies and powers are also known of one by one (mechanisms.h)
//
// What moves must obey two balances: T changes by the work of all powers, and what is stored by that of the forces that store
// it.  A scheme whose velocities are not those of its positions breaks the second.
#pragma once

#include <string>
#include <vector>

#include <dyntape/autodiff/record/eigen.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/system/mechanisms.h>

namespace dyntape {

struct Energy {
  double kinetic = 0;
  double stored = 0;                      // in gravity, springs and whatever has a potential
  Eigen::VectorXd kinetic_of, stored_of;  // (mechanisms); what is stored, but for a constant
  // (flows + 1, mechanisms) W; last what is released of what is stored: - d/dt stored, from the forces.
  Eigen::MatrixXd power;
};

// What the results of a recording of energies are: kinetic, stored; both of each mechanism; powers and what is released of each.
struct EnergyLayout {
  std::vector<std::string>
      flows;  // what the powers are of: "motors", then the effects that supply or take energy
  std::vector<Mechanism> mechanisms;

  Eigen::Index size() const { return 2 + Eigen::Index(mechanisms.size()) * (3 + Eigen::Index(flows.size())); }
  // Entry i stands at y[i * stride].
  void read(const double* y, Eigen::Index stride, Energy& energy) const;
};
// Records them at (q, v), tau (nv) that of the motors, with these numbers of the scene; says in `layout` what they are.
VectorXad record_energies(const RobotScene& scene, const dynamics::Model<AD>& model,
                          const dynamics::Effects<AD>& effects, const VectorXad& q, const VectorXad& v,
                          const VectorXad& tau, EnergyLayout& layout);

struct RecordedEnergy;

class EnergyMeter {
 public:
  EnergyMeter(const RobotScene& scene, const CodegenOptions& options);

  const std::vector<std::string>& names() const { return layout_.flows; }
  Eigen::Index flows() const { return Eigen::Index(layout_.flows.size()); }
  const std::vector<Mechanism>& mechanisms() const { return layout_.mechanisms; }
  // x begins with q and v; drive: what the motors give.  Valid until the next call.
  const Energy& at(const Eigen::VectorXd& x, const Eigen::VectorXd& drive);

 private:
  EnergyMeter(const RecordedEnergy& recorded, const RobotScene& scene, const CodegenOptions& options);

  EnergyLayout layout_;
  int n_state_;
  CompiledFunction function_;
  CompiledFunction::Workspace workspace_;
  Eigen::VectorXd input_, output_;
  Energy energy_;
};

}  // namespace dyntape
