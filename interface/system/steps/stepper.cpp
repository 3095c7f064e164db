// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/system/steps/stepper.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/system/steps/adaptive_steps.h>
#include <dyntape/interface/system/steps/newton.h>
#include <dyntape/interface/system/steps/record_step.h>
#include <dyntape/interface/system/steps/step_jacobians.h>

namespace dyntape {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

CompiledFunction compiled(const Function& function, CodegenOptions options, Order order) {
  options.order = order;
  return CompiledFunction::make(function, options);
}

void add_to(StepperReport& report, const CompiledFunction& f) {
  report.seconds += f.timings();
  const bool compiled_now = f.route() == Route::kCompiled && !f.timings().cache_hit;
  report.from_cache = report.from_cache && !compiled_now;
  if (!f.source_path().empty()) report.sources.push_back(f.source_path());
}

std::string seconds(double t) { return io::shortest(t) + " s"; }

}  // namespace

// What a scheme of fixed steps is made of; arguments of an implicit step are (x, t, h, u, p), of an explicit one all but x.
struct Stepper::Fixed {
  Fixed(const System& s, Integrator i, const CodegenOptions& options, bool with_jacobians, unsigned n_threads,
        StepperReport& report)
      : recorded(record_step(s, i)),
        end(compiled(recorded.end, options, Order::kValue)),
        of_end(end),
        of_many(end, is_implicit() ? 1 : n_threads) {
    report.step_operations = end.operations(Order::kValue);
    add_to(report, end);
    if (is_implicit()) {
      const CompiledFunction residual = compiled(recorded.residual, options, Order::kFirst);
      report.step_operations += residual.operations(Order::kValue);
      report.newton_operations = residual.operations(Order::kFirst);
      add_to(report, residual);
      newton.emplace(residual);
    }
    if (!with_jacobians) return;
    derivatives.emplace(s, i, options);
    report.jacobian_operations = derivatives->operations();
    for (const CompiledFunction* f : derivatives->functions()) add_to(report, *f);
  }

  // Shares the functions of the other, but those of its Jacobians.
  Fixed(const Fixed& other) : recorded(other.recorded), end(other.end), of_end(end), of_many(end) {
    if (other.newton) newton.emplace(other.newton->residual());
  }

  bool is_implicit() const { return recorded.n_z > 0; }

  RecordedStep recorded;
  CompiledFunction end;
  CompiledFunction::Workspace of_end, of_many;
  std::optional<Newton> newton;
  std::optional<StepJacobians> derivatives;
};

// Everything that a stepper has made: a scheme, fixed or adaptive.
struct Stepper::Made {
  Made(const System& s, Integrator i, const CodegenOptions& options, bool with_jacobians, unsigned n_threads,
       const Tolerances& tolerances)
      : system(s), integrator(i), has_jacobians(with_jacobians), options(options), tolerances(tolerances) {
    report.from_cache = true;
    const int n_m = int(lagged_motors(s).size());
    if (is_adaptive(i)) {
      adaptive.emplace(s, i, tolerances, options, with_jacobians);
      const StepProblem& problem = adaptive->problem();
      for (const CompiledFunction* f : problem.functions()) add_to(report, *f);
      report.step_operations = problem.operations(Order::kValue);
      if (i == Integrator::kAdaptiveStiff) report.newton_operations = problem.operations(Order::kFirst);
      report.jacobian_operations = problem.sensitivity_operations();
    } else {
      fixed.emplace(s, i, options, with_jacobians, n_threads, report);
    }
    nx = s.model.nq + s.model.nv + n_m, nt = 2 * s.model.nv + n_m;
    arguments = VectorXd::Zero(nx + 2 + system.n_u + system.n_p);
  }

  // Without Jacobians.
  Made(const Made& other)
      : system(other.system),
        integrator(other.integrator),
        has_jacobians(false),
        options(other.options),
        tolerances(other.tolerances),
        nx(other.nx),
        nt(other.nt),
        arguments(other.arguments),
        report(other.report) {
    if (other.fixed) fixed.emplace(*other.fixed);
    if (other.adaptive) adaptive.emplace(system, integrator, tolerances, options, false);
  }

  bool is_explicit() const { return fixed && !fixed->is_implicit(); }
  double* behind_x() { return arguments.data() + nx; }

  void set_arguments(double t, double h, const double* x, const double* u, const double* p) {
    std::copy_n(x, nx, arguments.data());
    double* next = behind_x();
    *next++ = t;
    *next++ = h;
    next = std::copy_n(u, system.n_u, next);
    std::copy_n(p, system.n_p, next);
  }

  // Size of the numbers that the unknowns are added to: velocities, or how far these go in a step.  At rest it is forces
  // that cancel whose rounding is left, as if something moved slowly.
  double size_of_unknowns(double h) const {
    constexpr double kSlow = 1e-3;
    const double v =
        std::max(kSlow, arguments.segment(system.model.nq, system.model.nv).cwiseAbs().maxCoeff());
    return integrator == Integrator::kVariational ? std::abs(h) * v : v;
  }

  Newton::Outcome solve(double h) {
    Newton& newton = *fixed->newton;
    newton.z().setZero();
    if (integrator == Integrator::kVariational)
      newton.z() = h * arguments.segment(system.model.nq, system.model.nv);
    return newton.solve(arguments.data(), size_of_unknowns(h));
  }

  std::string where() const {
    return "step of \"" + system.name + "\" from t = " + seconds(arguments[nx]) + " by " +
           seconds(arguments[nx + 1]) + ": ";
  }

  // About the first entry that is not finite: of a state, or of all arguments.
  std::string not_finite(const double* entries, const char* when) const {
    int i = 0;
    while (std::isfinite(entries[i])) ++i;
    const std::string value = std::isnan(entries[i]) ? "nan" : io::shortest(entries[i]);
    return where() + argument_name(system, i) + " is " + value + when;
  }

  std::string guard(const CompiledFunction& f, const Violation& violation) const {
    return where() + describe_guard(f.function(), violation.guard);
  }

  std::string unsolved(Newton::Outcome outcome) const;
  bool fail(double* x_next, std::string* why, const std::string& sentence) const;
  bool step(double t, double h, const double* x, const double* u, const double* p, double* x_next,
            std::string* why);
  bool fixed_step(double h, double* x_next, std::string* why);
  bool jacobians(const double* x_next, MatrixXd& all, std::string* why);
  std::size_t steps(double h, StateRows rows, std::string* why);
  std::size_t steps_at_once(double h, const StateRows& rows, std::string* why);

  System system;
  Integrator integrator;
  bool has_jacobians;
  CodegenOptions options;  // for a twin
  Tolerances tolerances;
  std::optional<Fixed> fixed;
  std::optional<AdaptiveSteps> adaptive;
  int nx = 0, nt = 0;
  VectorXd arguments;        // (x, t, h, u, p)
  MatrixXd all_slopes;       // A, B and P
  std::vector<double> rows;  // of steps(): (t, h, u, p) of each state
  std::vector<std::uint32_t> status;
  StepperReport report;
};

std::string Stepper::Made::unsolved(Newton::Outcome outcome) const {
  const Newton& newton = *fixed->newton;
  const std::string after = " after " + std::to_string(newton.residuals()) + " residuals";
  const std::string last = ", the last step is " + io::with_digits(newton.last_step(), 3);
  switch (outcome) {
    case Newton::Outcome::kNotFinite:
      if (newton.residuals() <= 1)
        return where() +
               "the equations of the step are not finite where it begins; look at the state, and at h";
      return where() + "the residual of Newton's method is not finite" + after + "; take a shorter step";
    case Newton::Outcome::kSingular:
      return where() + "the Jacobian of Newton's method is singular" + after + "; take a shorter step";
    case Newton::Outcome::kNoDescent:
      return where() + "Newton's method finds no solution nearby" + after + last + "; take a shorter step";
    case Newton::Outcome::kTooLong:
      return where() + "Newton's method has no solution" + after + last + "; take a shorter step";
    case Newton::Outcome::kGuard:
    case Newton::Outcome::kSolved:
      break;
  }
  return guard(newton.residual(), newton.violation());
}

bool Stepper::Made::fail(double* x_next, std::string* why, const std::string& sentence) const {
  std::fill_n(x_next, nx, std::nan(""));
  if (why) *why = sentence;
  return false;
}

bool Stepper::Made::step(double t, double h, const double* x, const double* u, const double* p,
                         double* x_next, std::string* why) {
  set_arguments(t, h, x, u, p);
  if (!arguments.allFinite()) return fail(x_next, why, not_finite(arguments.data(), " before it"));
  if (adaptive) {
    if (!adaptive->step(arguments.data(), x_next)) return fail(x_next, why, where() + adaptive->trouble());
  } else if (!fixed_step(h, x_next, why)) {
    return false;
  }
  if (Eigen::Map<const VectorXd>(x_next, nx).allFinite()) return true;
  return fail(x_next, why, not_finite(x_next, " after it"));
}

bool Stepper::Made::fixed_step(double h, double* x_next, std::string* why) {
  if (fixed->is_implicit()) {
    const Newton::Outcome outcome = solve(h);
    if (outcome != Newton::Outcome::kSolved) return fail(x_next, why, unsolved(outcome));
  }
  const Points points{.x = fixed->is_implicit() ? fixed->newton->z().data() : arguments.data(),
                      .p = fixed->is_implicit() ? arguments.data() : behind_x(),
                      .y = x_next};
  if (const Violation violation = fixed->end.run(Order::kValue, points, fixed->of_end))
    return fail(x_next, why, guard(fixed->end, violation));
  return true;
}

// Of the step before.
bool Stepper::Made::jacobians(const double* x_next, MatrixXd& all, std::string* why) {
  if (adaptive) {
    if (adaptive->jacobians(arguments.data(), all)) return true;
    if (why) *why = where() + "its Jacobians: " + adaptive->trouble();
    return false;
  }
  fixed->derivatives->evaluate(fixed->newton ? fixed->newton->z().data() : nullptr, arguments.data(), x_next);
  all = fixed->derivatives->matrix();
  return true;
}

// All states of an explicit scheme in one call.
std::size_t Stepper::Made::steps_at_once(double h, const StateRows& r, std::string* why) {
  const std::size_t n_u = std::size_t(system.n_u), n_p = std::size_t(system.n_p), width = 2 + n_u + n_p;
  rows.resize(r.count * width);
  status.assign(r.count, 0);
  for (std::size_t i = 0; i < r.count; ++i) {
    double* next = &rows[i * width];
    *next++ = r.t[i * r.stride_t];
    *next++ = h;
    next = std::copy_n(r.u + i * r.stride_u, n_u, next);
    std::copy_n(r.p + i * r.stride_p, n_p, next);
  }
  Strides strides{};
  strides.x = r.stride_x;
  strides.p = width;
  strides.y = r.stride_next;
  Points points{.count = r.count,
                .x = r.x,
                .p = rows.data(),
                .y = r.x_next,
                .strides = &strides,
                .status = status.data()};
  (void)fixed->end.run(Order::kValue, points, fixed->of_many);  // status has it
  std::size_t failed = 0;
  for (std::size_t i = 0; i < r.count; ++i) {
    double* x_next = r.x_next + i * r.stride_next;
    const double* x = r.x + i * r.stride_x;
    const auto finite = [&](const double* entries) {
      return std::all_of(entries, entries + nx, [](double v) { return std::isfinite(v); });
    };
    const auto arguments_at = rows.begin() + long(i * width);
    const bool sound =
        std::all_of(arguments_at, arguments_at + long(width), [](double v) { return std::isfinite(v); });
    if (status[i] == 0 && sound && finite(x_next) && finite(x)) continue;
    // Once more alone, for the sentence.
    step(r.t[i * r.stride_t], h, x, r.u + i * r.stride_u, r.p + i * r.stride_p, x_next,
         failed++ == 0 ? why : nullptr);
  }
  return failed;
}

std::size_t Stepper::Made::steps(double h, StateRows r, std::string* why) {
  const auto dense = [](std::size_t& stride, int size) {
    if (stride == StateRows::kDense) stride = std::size_t(size);
  };
  dense(r.stride_t, 1);
  dense(r.stride_x, nx);
  dense(r.stride_next, nx);
  dense(r.stride_u, system.n_u);
  dense(r.stride_p, system.n_p);
  if (is_explicit()) return steps_at_once(h, r, why);
  std::size_t failed = 0;
  for (std::size_t i = 0; i < r.count; ++i) {
    const bool done = step(r.t[i * r.stride_t], h, r.x + i * r.stride_x, r.u + i * r.stride_u,
                           r.p + i * r.stride_p, r.x_next + i * r.stride_next, failed ? nullptr : why);
    failed += !done;
  }
  return failed;
}

Stepper::Stepper(const System& system, Integrator integrator, const CodegenOptions& options,
                 bool with_jacobians, unsigned threads, const Tolerances& tolerances)
    : made_(std::make_unique<Made>(system, integrator, options, with_jacobians, threads, tolerances)) {}
Stepper::Stepper(std::unique_ptr<Made> made) : made_(std::move(made)) {}
Stepper::~Stepper() = default;
Stepper::Stepper(Stepper&&) noexcept = default;
Stepper& Stepper::operator=(Stepper&&) noexcept = default;

int Stepper::nx() const { return made_->nx; }
int Stepper::nt() const { return made_->nt; }
int Stepper::n_u() const { return made_->system.n_u; }
int Stepper::n_p() const { return made_->system.n_p; }
int Stepper::residuals() const {
  return made_->fixed && made_->fixed->newton ? made_->fixed->newton->residuals() : 0;
}
const std::optional<StepEvent>& Stepper::event() const {
  static const std::optional<StepEvent> none;
  return made_->adaptive ? made_->adaptive->event() : none;
}
void Stepper::watch(const std::function<void(const double* x, double weight)>& at) {
  if (made_->adaptive) made_->adaptive->watch(at);
}
StepEffort Stepper::effort() const { return made_->adaptive ? made_->adaptive->effort() : StepEffort(); }
std::size_t Stepper::lane_width() const { return made_->fixed ? made_->fixed->end.lane_width() : 1; }
const StepperReport& Stepper::report() const { return made_->report; }

bool Stepper::step(double t, double h, const double* x, const double* u, const double* p, double* x_next,
                   std::string* why) {
  return made_->step(t, h, x, u, p, x_next, why);
}

bool Stepper::jacobians(double t, double h, const double* x, const double* u, const double* p, double* x_next,
                        MatrixXd& A, MatrixXd& B, MatrixXd& P, std::string* why) {
  if (!made_->has_jacobians)
    throw ArgumentError("stepper of \"" + made_->system.name +
                        "\": it was made without Jacobians; set with_jacobians");
  if (!step(t, h, x, u, p, x_next, why)) return false;
  MatrixXd& all = made_->all_slopes;
  if (!made_->jacobians(x_next, all, why)) return made_->fail(x_next, nullptr, "");
  A = all.leftCols(nt());
  B = all.middleCols(nt(), n_u());
  P = all.rightCols(n_p());
  return true;
}

Stepper Stepper::twin() const { return Stepper(std::make_unique<Made>(*made_)); }

bool Stepper::steps_side_by_side(std::size_t count, const double* x, const double* arguments, double* x_next,
                                 std::uint32_t* status) {
  const Points points{
      .count = count, .x = x, .p = arguments, .y = x_next, .status = status, .side_by_side = lane_width()};
  return !made_->fixed->end.run(Order::kValue, points, made_->fixed->of_many);
}

std::size_t Stepper::steps(double h, const StateRows& rows, std::string* why) {
  return made_->steps(h, rows, why);
}

}  // namespace dyntape
