// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/printed/controller_library.h>

#include <algorithm>
#include <cstring>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/printed/controller_functions.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

// The text with its header in place of the include.
codegen::Source alone(const PrintedController& c) {
  codegen::Source source = c.source;
  const std::string include = "#include \"" + c.name + ".h\"\n";
  source.text.replace(
      source.text.find(include), include.size(),
      "#pragma GCC visibility push(default)\n" + c.source.header + "#pragma GCC visibility pop\n");
  source.pieces = {1};
  return source;
}

template <class Real>
int run_step(void* function, void* state, const std::vector<double>& x, double t, int budget) {
  const std::vector<Real> at(x.begin(), x.end());
  return reinterpret_cast<int (*)(void*, const Real*, Real, int)>(function)(state, at.data(), Real(t),
                                                                            budget);
}

template <class Real>
Eigen::VectorXd run_control(void* function, const void* state, const std::vector<double>& x, double t,
                            int n_u) {
  const std::vector<Real> at(x.begin(), x.end());
  std::vector<Real> u(std::size_t(n_u), Real(0));
  reinterpret_cast<void (*)(const void*, Real, const Real*, Real*)>(function)(state, Real(t), at.data(),
                                                                              u.data());
  return Eigen::Map<const Eigen::Matrix<Real, Eigen::Dynamic, 1>>(u.data(), n_u).template cast<double>();
}

CodegenOptions at_level(CodegenOptions options) {
  const bool has_level = std::any_of(options.flags.begin(), options.flags.end(),
                                     [](const std::string& flag) { return flag.starts_with("-O"); });
  if (!has_level) options.flags.push_back("-O3");
  return options;
}

}  // namespace

ControllerLibrary::ControllerLibrary(const Problem& problem, const ControllerOptions& options,
                                     const CodegenOptions& codegen)
    : problem_(problem),
      options_(options),
      printed_(generate_controller(problem, options)),
      library_(codegen::TextLibrary::make(alone(printed_), at_level(codegen))),
      state_(printed_.state_bytes / sizeof(double) + 1) {
  restart();
}

void ControllerLibrary::restart() {
  std::fill(state_.begin(), state_.end(), 0.0);
  reinterpret_cast<void (*)(void*)>(library_->symbol(printed_.name + "_init"))(state_.data());
}

double ControllerLibrary::number(std::size_t i) const {
  if (!printed_.single) return state_[i];
  float value = 0;
  std::memcpy(&value, reinterpret_cast<const char*>(state_.data()) + i * sizeof(float), sizeof(float));
  return double(value);
}

void ControllerLibrary::set(std::size_t i, double value) {
  if (!printed_.single) {
    state_[i] = value;
    return;
  }
  const float single = float(value);
  std::memcpy(reinterpret_cast<char*>(state_.data()) + i * sizeof(float), &single, sizeof(float));
}

std::vector<double> ControllerLibrary::state_vector(const Eigen::VectorXd& x) const {
  if (x.size() != printed_.n_x)
    throw ArgumentError("controller \"" + printed_.name + "\": the state has " + std::to_string(x.size()) +
                        " entries, expected " + std::to_string(printed_.n_x));
  return {x.begin(), x.end()};
}

ControllerStep ControllerLibrary::step(double t, const Eigen::VectorXd& x, int budget) {
  const std::vector<double> at = state_vector(x);
  if (problem_.parameters.size() > 0) {
    Problem now = problem_;
    now.parameters = problem_.parameters.later(t);
    const Problem taken = options_.mesh.scheme.taken_by(now, [h = printed_.times[1]](double) { return h; });
    const std::size_t n_p = printed_.parameter_names.size();
    for (std::size_t k = 0; k < printed_.times.size(); ++k) {
      const Eigen::VectorXd p = controller_parameters(taken, printed_.times[k]);
      for (std::size_t i = 0; i < n_p; ++i) set(printed_.layout.p + k * n_p + i, p[long(i)]);
    }
  }
  void* const function = library_->symbol(printed_.name + "_step");
  const int status = printed_.single ? run_step<float>(function, state_.data(), at, t, budget)
                                     : run_step<double>(function, state_.data(), at, t, budget);
  ControllerStep step;
  step.status = static_cast<ControllerStep::Status>(status);
  const std::size_t bytes = printed_.single ? sizeof(float) : sizeof(double);
  const char* integers = reinterpret_cast<const char*>(state_.data()) + printed_.layout.numbers * bytes;
  std::memcpy(&step.iterations, integers + sizeof(int), sizeof(int));
  std::memcpy(&step.interior_steps, integers + 2 * sizeof(int), sizeof(int));
  step.cost = number(printed_.layout.cost);
  step.violation = number(printed_.layout.violation);
  return step;
}

Eigen::VectorXd ControllerLibrary::control(double t, const Eigen::VectorXd& x) const {
  const std::vector<double> at = state_vector(x);
  void* const function = library_->symbol(printed_.name + "_control");
  return printed_.single ? run_control<float>(function, state_.data(), at, t, printed_.n_u)
                         : run_control<double>(function, state_.data(), at, t, printed_.n_u);
}

Eigen::MatrixXd ControllerLibrary::gain() const {
  Eigen::MatrixXd gain(printed_.n_u, printed_.n_x);
  for (int b = 0; b < printed_.n_u; ++b) {
    for (int i = 0; i < printed_.n_x; ++i)
      gain(b, i) = number(printed_.layout.gain + std::size_t(b * printed_.n_x + i));
  }
  return gain;
}

Trajectory ControllerLibrary::plan() const {
  const auto points = Eigen::Index(printed_.times.size());
  Trajectory motion{Eigen::Map<const Eigen::VectorXd>(printed_.times.data(), points),
                    Eigen::MatrixXd(printed_.n_x, points), Eigen::MatrixXd(0, points),
                    Eigen::MatrixXd(printed_.n_u, points), options_.mesh.scheme};
  for (Eigen::Index k = 0; k < points; ++k) {
    const std::size_t first = printed_.layout.z + std::size_t(k) * std::size_t(printed_.n_x + printed_.n_u);
    for (int i = 0; i < printed_.n_x; ++i) motion.x(i, k) = number(first + std::size_t(i));
    for (int i = 0; i < printed_.n_u; ++i) motion.u(i, k) = number(first + std::size_t(printed_.n_x + i));
  }
  motion.extend_to_unused();
  return motion;
}

}  // namespace dyntape
