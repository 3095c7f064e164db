// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/sweep/sample_balance.h>

namespace dyntape {

namespace {

std::vector<std::string> names_in(const EnergyLayout& layout) {
  std::vector<std::string> names;
  for (const Mechanism& mechanism : layout.mechanisms) names.push_back(mechanism.name);
  return names;
}

}  // namespace

WorkRule work_rule(const Scene& scene) {
  if (is_adaptive(scene.integrator)) return WorkRule::kGauss;
  return scene.commands.t.size() > 1 ? WorkRule::kSimpson : WorkRule::kCubic;
}

SampleBalance::SampleBalance(const Scene& scene, const EnergyLayout& layout)
    : is_cubic_(work_rule(scene) == WorkRule::kCubic),
      flows_(Eigen::Index(layout.flows.size()) + 1),
      mechanisms_(Eigen::Index(layout.mechanisms.size())),
      balances_(names_in(layout)),
      cubic_(scene.step, flows_ * mechanisms_),
      work_(Eigen::MatrixXd::Zero(flows_, mechanisms_)) {}

void SampleBalance::take(const Eigen::VectorXd& work) {
  balances_.add(waiting_.front(), work.reshaped(flows_, mechanisms_));
  waiting_.pop_front();
}

void SampleBalance::start(const Energy& energy) {
  if (is_cubic_) return step(energy);
  balances_.add(energy, work_);
}

void SampleBalance::step(const Energy& energy) {
  waiting_.push_back(energy);
  cubic_.append(energy.power.reshaped(), [this](const Eigen::VectorXd& work) { take(work); });
}

void SampleBalance::step(const Energy& energy, const Eigen::MatrixXd& work) {
  work_ += work;
  balances_.add(energy, work_);
}

std::string SampleBalance::warning() {
  if (is_cubic_) cubic_.finish([this](const Eigen::VectorXd& work) { take(work); });
  return doubt_of_energy(balances_.all());
}

}  // namespace dyntape
