// SPDX-License-Identifier: BSD-3-Clause
#include <map>
#include <mutex>

#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/interface/cppad/nodes/atomic.h>
#include <dyntape/interface/cppad/detail/fun.hxx>

namespace CppAD::inline dyntape_names::detail {

namespace {

template <class Base>
struct Discrete {
  const char* name;
  Base (*of)(const Base&);
};

template <class Base>
class StepSeries : public SeriesKernel<Base> {
 public:
  using Many = std::vector<Series<Base>>;
  explicit StepSeries(Discrete<Base> step) : step_(step) {}
  Many forward(const Many& in) const override { return {Series<Base>::constant(step_.of(in[0][0]))}; }
  Many reverse(const Many&, const Many&, const Many&) const override { return Many(1); }

 private:
  Discrete<Base> step_;
};

// Recorded again, a level above.
template <class Base>
class RecordedStepSeries : public SeriesKernel<AD<Base>> {
 public:
  using Many = std::vector<Series<AD<Base>>>;
  explicit RecordedStepSeries(Discrete<Base> step) : step_(step) {}
  Many forward(const Many& in) const override {
    return {Series<AD<Base>>::constant(discrete_call(step_.name, step_.of, in[0][0]))};
  }
  Many reverse(const Many&, const Many&, const Many&) const override { return Many(1); }

 private:
  Discrete<Base> step_;
};

template <class Base>
struct StepInSeries : KernelInSeries, KernelOver<Base>, KernelOver<AD<Base>> {
  explicit StepInSeries(Discrete<Base> s) : step(s) {}
  std::shared_ptr<const SeriesKernel<Base>> series(const Base*) const override {
    return std::make_shared<StepSeries<Base>>(step);
  }
  std::shared_ptr<const SeriesKernel<AD<Base>>> series(const AD<Base>*) const override {
    return std::make_shared<RecordedStepSeries<Base>>(step);
  }
  KernelName called() const override { return {KernelName::kDiscrete, step.name, 0}; }
  Discrete<Base> step;
};

// (x, tangent or adjoint) -> 0
std::shared_ptr<const Callee> no_slope() {
  Function zero;
  zero.name = "no_slope";
  zero.inputs = {2, 0, 0};
  zero.outputs = {zero.graph.constant(0)};
  return recorded_callee(zero);
}

template <class Base>
struct KnownSteps {
  std::mutex mutex;
  std::map<Base (*)(const Base&), std::shared_ptr<const Callee>> callees;
  std::map<std::string, Discrete<Base>> of_name;
};
template <class Base>
KnownSteps<Base>& known_steps() {
  static KnownSteps<Base> known;
  return known;
}

// One callee a function, so that equal calls are one.
template <class Base>
std::shared_ptr<const Callee> step_callee(const Discrete<Base>& step) {
  KnownSteps<Base>& known = known_steps<Base>();
  const std::scoped_lock lock(known.mutex);
  auto& callee = known.callees[step.of];
  if (callee) return callee;
  known.of_name[step.name] = step;
  Kernel kernel;
  kernel.evaluate = [step](const double* in, double* out) { out[0] = double(step.of(Base(in[0]))); };
  auto made = std::make_shared<Callee>(step.name, 1, 1, kernel);
  made->pattern = Pattern{1, 1, {}, {}};
  made->has_poles = false;
  made->jvp = made->vjp = no_slope;
  return callee = made;
}

}  // namespace

template <class Base>
AD<Base> discrete_call(const char* name, Base (*of)(const Base&), const AD<Base>& x) {
  const Discrete<Base> step{name, of};
  return record_call(step_callee(step), std::make_shared<StepInSeries<Base>>(step), std::vector<AD<Base>>{x},
                     std::vector<Base>{of(x.value())})[0];
}

template <class Base>
AD<Base> discrete_by_name(const std::string& name, const AD<Base>& x) {
  if constexpr (std::is_floating_point_v<Base>) {
    KnownSteps<Base>& known = known_steps<Base>();
    std::unique_lock lock(known.mutex);
    if (const auto found = known.of_name.find(name); found != known.of_name.end()) {
      const Discrete<Base> step = found->second;
      lock.unlock();
      return discrete_call(step.name, step.of, x);
    }
  }
  refuse("there is no discrete function \"" + name + "\"; call its AD version first");
}

template AD<float> discrete_by_name(const std::string&, const AD<float>&);
template AD<double> discrete_by_name(const std::string&, const AD<double>&);
template AD<AD<double>> discrete_by_name(const std::string&, const AD<AD<double>>&);
template AD<float> discrete_call(const char*, float (*)(const float&), const AD<float>&);
template AD<double> discrete_call(const char*, double (*)(const double&), const AD<double>&);

}  // namespace CppAD::inline dyntape_names::detail
