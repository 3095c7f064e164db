// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/sweep/lane_motions.h>

#include <algorithm>
#include <cmath>

namespace dyntape {

using Eigen::VectorXd;

LaneMotions::LaneMotions(SweptFunctions& functions, long first, long count)
    : functions_(functions),
      scene_(functions.sweep.scene),
      width_(long(functions.stepper.lane_width())),
      nx_(functions.stepper.nx()),
      nq_(scene_.robot.model.nq),
      nv_(scene_.robot.model.nv),
      n_arguments_(2 + functions.stepper.n_u() + functions.stepper.n_p()),
      n_energy_arguments_(n_arguments_ + nv_),
      rule_(work_rule(scene_)),
      of_steps_(scene_, functions.meter) {
  for (long k = 0; k < count; ++k) {
    motions.push_back(begin_of(functions, first + k));
    const SampleMotion& motion = motions.back();
    judges_.emplace_back(functions);
    judges_.back().account.start(
        functions.meter.at(motion.x, commands_at(functions.sweep, motion.start, 0), motion.start.p));
  }
  is_over_.assign(std::size_t(count), 0);
  work_.resize(std::size_t(count));
  const auto n = std::size_t(places());
  status_.assign(n, 0), unread_.assign(n, 0);
  for (codegen::AlignedRoom* array : {&x_, &next_, &half_, &twice_, &kept_x_})
    array->resize(n * std::size_t(nx_));
  arguments_.resize(n * std::size_t(n_arguments_));
  energy_arguments_.resize(n * std::size_t(n_energy_arguments_));
  energies_.resize(n * std::size_t(functions.meter.layout().size()));
  for (codegen::AlignedRoom* array : {&speeds_, &most_energy_, &kept_speeds_, &kept_most_energy_})
    array->resize(n);
  // Places without a sample of their own repeat the last.
  for (long k = 0; k < places(); ++k) put(k, motions[std::size_t(std::min(k, count - 1))]);
  set_times(0, scene_.step);
}

VectorXd LaneMotions::entries_of(codegen::AlignedRoom& array, long entries, long first, long n,
                                 long k) const {
  VectorXd values(n);
  for (long i = 0; i < n; ++i) values[i] = at(array.data(), entries, first + i, k);
  return values;
}

void LaneMotions::put(long k, const SampleMotion& motion) {
  for (long i = 0; i < nx_; ++i) at(x_.data(), nx_, i, k) = motion.x[i];
  const VectorXd u = motion.start.u.col(0);
  for (long i = 0; i < u.size(); ++i) at(arguments_.data(), n_arguments_, 2 + i, k) = u[i];
  for (long i = 0; i < motion.start.p.size(); ++i)
    at(arguments_.data(), n_arguments_, 2 + u.size() + i, k) = motion.start.p[i];
  speeds_.data()[k] = motion.extremes.v;
  most_energy_.data()[k] = motion.extremes.energy;
}

void LaneMotions::set_times(double t, double h) {
  for (long b = 0; b < places() / width_; ++b) {
    double* block = arguments_.data() + b * n_arguments_ * width_;
    std::fill_n(block, width_, t);
    std::fill_n(block + width_, width_, h);
  }
  if (!functions_.has_table) return;
  const long n_u = functions_.stepper.n_u();
  const VectorXd u = scene_.commands.at(double(step_) * scene_.step + scene_.step / 2, {});
  for (long k = 0; k < places(); ++k) {
    for (long i = 0; i < n_u; ++i) at(arguments_.data(), n_arguments_, 2 + i, k) = u[i];
  }
}

void LaneMotions::note_speeds() {
  for (long b = 0; b < places() / width_; ++b) {
    double* most = speeds_.data() + b * width_;
    const double* v = x_.data() + (b * nx_ + nq_) * width_;
    for (long i = 0; i < nv_; ++i, v += width_) {
      for (long lane = 0; lane < width_; ++lane) {
        const double speed = std::abs(v[lane]);
        most[lane] = speed > most[lane] ? speed : most[lane];
      }
    }
  }
}

// Those of the steps, with powers along the velocities of x.
void LaneMotions::put_energy_arguments(const double* x) {
  for (long b = 0; b < places() / width_; ++b) {
    double* to = energy_arguments_.data() + b * n_energy_arguments_ * width_;
    to = std::copy_n(arguments_.data() + b * n_arguments_ * width_, n_arguments_ * width_, to);
    std::copy_n(x + (b * nx_ + nq_) * width_, nv_ * width_, to);
  }
}

void LaneMotions::evaluate_energies(const double* x) {
  functions_.meter.side_by_side(std::size_t(places()), std::size_t(width_), x, energy_arguments_.data(),
                                energies_.data(), unread_.data());
}

void LaneMotions::note_energies() {
  const Eigen::Index size = functions_.meter.layout().size();
  for (long k = 0; k < places(); ++k) {
    double& most = most_energy_.data()[k];
    most = std::max(most, at(energies_.data(), size, 0, k) + at(energies_.data(), size, 1, k));
  }
}

void LaneMotions::judge_energies() {
  const Eigen::Index size = functions_.meter.layout().size();
  for (std::size_t k = 0; k < motions.size(); ++k) {
    if (is_over_[k]) continue;
    functions_.meter.layout().read(&at(energies_.data(), size, 0, long(k)), width_, energy_);
    judges_[k].account.add(energy_, work_[k]);
  }
}

// Of schemes with one evaluation of the forces; after the whole step, whose end is in next_.
void LaneMotions::work_of_stage() {
  const int n_u = functions_.stepper.n_u();
  put_energy_arguments(x_.data());
  for (long k = 0; k < long(motions.size()); ++k) {
    const StepWork::Stage stage =
        of_steps_.stage_of(entries_of(x_, nx_, 0, nx_, k), entries_of(next_, nx_, 0, nx_, k),
                           entries_of(arguments_, n_arguments_, 2, n_u, k), scene_.step);
    for (long i = 0; i < nx_; ++i) at(half_.data(), nx_, i, k) = stage.x[i];
    for (long i = 0; i < nv_; ++i)
      at(energy_arguments_.data(), n_energy_arguments_, n_arguments_ + i, k) = stage.along[i];
  }
  evaluate_energies(half_.data());
  const Eigen::Index size = functions_.meter.layout().size();
  for (std::size_t k = 0; k < motions.size(); ++k) {
    functions_.meter.layout().read(&at(energies_.data(), size, 0, long(k)), width_, energy_);
    work_[k] = scene_.step * energy_.unstored;
  }
}

// By Simpson's rule; after the whole step, whose end is in next_.
void LaneMotions::work_of_step(double t) {
  const double h = scene_.step;
  const auto n = std::size_t(places());
  const Eigen::Index size = functions_.meter.layout().size();
  std::fill(unread_.begin(), unread_.end(), 0);
  set_times(t, h / 2);
  functions_.stepper.steps_side_by_side(n, x_.data(), arguments_.data(), half_.data(), unread_.data());
  set_times(t, h);
  const std::pair<double*, double> states[] = {
      {x_.data(), h / 6}, {half_.data(), 4 * h / 6}, {next_.data(), h / 6}};
  for (const auto& [x, weight] : states) {
    put_energy_arguments(x);
    evaluate_energies(x);
    for (std::size_t k = 0; k < motions.size(); ++k) {
      functions_.meter.layout().read(&at(energies_.data(), size, 0, long(k)), width_, energy_);
      if (x == x_.data()) work_[k].setZero(energy_.unstored.rows(), energy_.unstored.cols());
      work_[k] += weight * energy_.unstored;
    }
  }
  const int n_u = functions_.stepper.n_u();
  for (long k = 0; k < long(motions.size()); ++k) {
    const VectorXd begin = entries_of(x_, nx_, 0, nx_, k), middle = entries_of(half_, nx_, 0, nx_, k),
                   end = entries_of(next_, nx_, 0, nx_, k);
    of_steps_.put_motors({begin, middle, end}, entries_of(arguments_, n_arguments_, 2, n_u, k), h,
                         work_[std::size_t(k)]);
  }
}

// After the whole step, whose end is in next_.
void LaneMotions::try_halves(double t) {
  const double h = scene_.step;
  Stepper& stepper = functions_.stepper;
  const auto n = std::size_t(places());
  std::fill(unread_.begin(), unread_.end(), 0);
  set_times(t, h / 2);
  stepper.steps_side_by_side(n, x_.data(), arguments_.data(), half_.data(), unread_.data());
  std::vector<std::uint32_t> second(n, 0);
  set_times(t + h / 2, h / 2);
  stepper.steps_side_by_side(n, half_.data(), arguments_.data(), twice_.data(), second.data());
  for (long k = 0; k < long(motions.size()); ++k) {
    if (is_over_[std::size_t(k)] || unread_[std::size_t(k)] || second[std::size_t(k)]) continue;
    judges_[std::size_t(k)].halves.note(scene_, {step_, entries_of(x_, nx_, 0, nx_, k)},
                                        entries_of(next_, nx_, 0, nx_, k),
                                        entries_of(twice_, nx_, 0, nx_, k));
  }
}

// The steps of all samples, and the observer of what they come to.
struct LaneSteps {
  bool step(const StepTime& s, long) {
    all.step_ = s.k;
    all.set_times(s.t, s.h);
    all.is_sound_ = all.functions_.stepper.steps_side_by_side(std::size_t(all.places()), all.x_.data(),
                                                              all.arguments_.data(), all.next_.data(),
                                                              all.status_.data());
    return true;
  }
  void advance() { std::swap(all.x_, all.next_); }

  bool goes_on(const StepTime&) const { return all.is_sound_; }
  void after(const StepTime& s, long) { all.after_step(s); }
  void reached(long k) { all.note_state(k); }

  LaneMotions& all;
};

void LaneMotions::after_step(const StepTime& s) {
  if (rule_ == WorkRule::kSimpson) work_of_step(s.t);
  if (rule_ == WorkRule::kStage) work_of_stage();
  if (is_look(scene_, s.k)) try_halves(s.t);
}

void LaneMotions::note_state(long k) {
  const double t = double(step_) * scene_.step;
  step_ = k;
  note_speeds();
  set_times(t, scene_.step);
  put_energy_arguments(x_.data());
  evaluate_energies(x_.data());
  judge_energies();
  if (scene_.is_sample(step_)) note_energies();
}

void LaneMotions::keep() {
  kept_step_ = step_;
  std::copy_n(x_.data(), places() * nx_, kept_x_.data());
  std::copy_n(speeds_.data(), places(), kept_speeds_.data());
  std::copy_n(most_energy_.data(), places(), kept_most_energy_.data());
}

bool LaneMotions::is_within(long k) {
  double squares = 0;
  for (long i = 0; i < nx_; ++i) squares += at(x_.data(), nx_, i, k) * at(x_.data(), nx_, i, k);
  return squares < kBeyond;
}

void LaneMotions::take(long k, codegen::AlignedRoom& x, const SampleExtremes& extremes) {
  motions[std::size_t(k)].x = entries_of(x, nx_, 0, nx_, k);
  motions[std::size_t(k)].extremes = extremes;
}

void LaneMotions::look_for_failures() {
  for (long k = 0; k < long(motions.size()); ++k) {
    const auto place = std::size_t(k);
    if (is_over_[place] || (status_[place] == 0 && is_within(k))) continue;
    take(k, kept_x_, {kept_speeds_.data()[k], kept_most_energy_.data()[k]});
    SampleMotion& motion = motions[place];
    motion.steps = kept_step_;
    advance(functions_, motion, step_);
    is_over_[place] = !motion.trouble.empty();
    // What is over runs on from its start, unseen.
    SampleMotion now = motion;
    if (is_over_[place]) now.x = motion.start.x;
    put(k, now);
  }
}

// The last place where half steps are tried, of which the whole one is made for that alone.
void LaneMotions::look_behind_the_end() {
  if (!is_look(scene_, step_)) return;
  const double t = double(step_) * scene_.step;
  std::fill(unread_.begin(), unread_.end(), 0);
  set_times(t, scene_.step);
  functions_.stepper.steps_side_by_side(std::size_t(places()), x_.data(), arguments_.data(), next_.data(),
                                        unread_.data());
  try_halves(t);
}

bool LaneMotions::run(const std::stop_token& stop) {
  constexpr long kWindow = 16;
  const long steps = scene_.steps();
  LaneSteps together{*this};
  while (step_ < steps) {
    if (stop.stop_requested()) return false;
    keep();
    is_sound_ = true;
    const StepRange window{.from = step_, .to = std::min(step_ + kWindow, steps), .h = scene_.step};
    dyntape::run(
        together, window, [](const StepTime& s) { return s.k; }, together);
    look_for_failures();
  }
  look_behind_the_end();
  for (long k = 0; k < long(motions.size()); ++k) {
    const bool is_over = is_over_[std::size_t(k)];
    warnings.push_back(
        is_over ? "" : judges_[std::size_t(k)].warning(functions_.sweep, motions[std::size_t(k)].row));
    if (is_over) continue;
    take(k, x_, {speeds_.data()[k], most_energy_.data()[k]});
    motions[std::size_t(k)].steps = steps;
  }
  return true;
}

}  // namespace dyntape
