// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/ipopt/ipopt_options.h>

#include <IpIpoptApplication.hpp>
#include <IpRegOptions.hpp>
#include <algorithm>
#include <array>
#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/suggest.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

using Ipopt::RegisteredOption;

// Of Ipopt's categories, those that change how it solves and nothing outside it.
constexpr std::array kAllowed = {"Barrier Parameter Update",
                                 "Convergence",
                                 "Hessian Approximation",
                                 "Initialization",
                                 "Line Search",
                                 "Linear Solver",
                                 "MA27 Linear Solver",
                                 "MA57 Linear Solver",
                                 "MA86 Linear Solver",
                                 "MA97 Linear Solver",
                                 "Mumps Linear Solver",
                                 "NLP",
                                 "NLP Scaling",
                                 "Pardiso Linear Solver",
                                 "Restoration Phase",
                                 "Step Calculation"};

// Of their options, those that print, or ask the program what it cannot answer.
constexpr std::array kRefused = {"ma86_print_level", "ma97_print_level", "pardiso_msglvl",
                                 "dependency_detector"};

std::string in_quotes(const std::string& text) { return "\"" + text + "\""; }

std::vector<std::string> choices(const RegisteredOption& option) {
  std::vector<std::string> names;
  for (const auto& entry : option.GetValidStrings()) names.push_back(entry.value_);
  return names;
}

// An option that takes any text takes the name of a file or of a library.
bool takes_any_text(const RegisteredOption& option) {
  const std::vector<std::string> names = choices(option);
  return option.Type() == Ipopt::OT_String && std::find(names.begin(), names.end(), "*") != names.end();
}

bool is_allowed(const RegisteredOption& option) {
  const auto among = [](const auto& list, const std::string& name) {
    return std::find(list.begin(), list.end(), name) != list.end();
  };
  return among(kAllowed, option.RegisteringCategory()) && !among(kRefused, option.Name()) &&
         !takes_any_text(option);
}

const RegisteredOption& find(Ipopt::IpoptApplication& application, const std::string& name) {
  Ipopt::SmartPtr<const RegisteredOption> option = application.RegOptions()->GetOption(name);
  if (IsValid(option)) return *option;
  std::vector<std::string> names;
  for (const auto& [known, registered] : application.RegOptions()->RegisteredOptionsList()) {
    if (is_allowed(*registered)) names.push_back(known);
  }
  throw ArgumentError("Ipopt has no option " + in_quotes(name) + suggestion(name, names));
}

[[noreturn]] void refuse_value(const std::string& name, const std::string& value,
                               const std::string& expected) {
  throw ArgumentError("Ipopt's option " + in_quotes(name) + " refuses the value " + in_quotes(value) +
                      ": expected " + expected);
}

// "a number above 0 up to 1"
std::string range(const RegisteredOption& option) {
  std::string text = "a number";
  if (option.HasLower()) {
    text += (option.LowerStrict() ? " above " : " from ") + io::shortest(option.LowerNumber());
  }
  if (option.HasUpper()) {
    text += (option.UpperStrict() ? " below " : " up to ") + io::shortest(option.UpperNumber());
  }
  return text;
}

void set(Ipopt::IpoptApplication& application, const std::string& name, double value) {
  if (std::isfinite(value) && application.Options()->SetNumericValue(name, value)) return;
  refuse_value(name, io::shortest(value), range(find(application, name)));
}

void set(Ipopt::IpoptApplication& application, const std::string& name, int value) {
  if (application.Options()->SetIntegerValue(name, value)) return;
  const RegisteredOption& option = find(application, name);
  refuse_value(name, std::to_string(value),
               "a whole number" +
                   (option.HasLower() ? " from " + std::to_string(option.LowerInteger()) : "") +
                   (option.HasUpper() ? " to " + std::to_string(option.UpperInteger()) : ""));
}

void set(Ipopt::IpoptApplication& application, const std::string& name, const std::string& value) {
  const std::vector<std::string> valid = choices(find(application, name));
  const bool known = std::any_of(valid.begin(), valid.end(), [&](const std::string& choice) {
    return detail::same_but_for_case(choice, value);
  });
  if (known && application.Options()->SetStringValue(name, value)) return;
  throw ArgumentError("Ipopt's option " + in_quotes(name) + " refuses the value " + in_quotes(value) +
                      suggestion(value, valid));
}

template <class T>
T parsed(const std::string& name, const std::string& value, const char* expected) {
  const std::optional<T> number = io::parse_number<T>(value);
  if (!number) refuse_value(name, value, expected);
  return *number;
}

// What a user asks for by Ipopt's name.
const RegisteredOption& allowed(Ipopt::IpoptApplication& application, const std::string& name) {
  const RegisteredOption& option = find(application, name);
  if (is_allowed(option)) return option;
  throw ArgumentError("Ipopt's option " + in_quotes(name) +
                      " is not for use here: expected one that neither "
                      "names a file nor prints nor needs multipliers to start from (what is printed is "
                      "print_level of SolverOptions)");
}

void set_by_name(Ipopt::IpoptApplication& application, const std::string& name, const std::string& value) {
  const RegisteredOption& option = allowed(application, name);
  if (option.Type() == Ipopt::OT_Number) {
    const double number = parsed<double>(name, value, "a number");
    // Ipopt maximises where it is negative.
    if (option.Name() == "obj_scaling_factor" && !(number > 0)) refuse_value(name, value, "a number above 0");
    set(application, name, number);
  } else if (option.Type() == Ipopt::OT_Integer) {
    set(application, name, parsed<int>(name, value, "a whole number"));
  } else {
    set(application, name, value);
  }
}

constexpr double kRowsOfTolerance = 10;  // as the structured interior point keeps them

void start_warm(Ipopt::IpoptApplication& application, double barrier) {
  constexpr double kPush = 1e-9;  // from bounds: the start is a solution
  set(application, "warm_start_init_point", std::string("yes"));
  set(application, "mu_init", barrier);
  for (const char* name : {"warm_start_bound_push", "warm_start_bound_frac", "warm_start_slack_bound_push",
                           "warm_start_slack_bound_frac", "warm_start_mult_bound_push"})
    set(application, name, kPush);
}

// From a point near a solution: bounds have the multipliers of the barrier, and rows those of least squares, however large.
void start_near(Ipopt::IpoptApplication& application, double barrier, double push) {
  constexpr double kMostMultiplier = 1e12;
  set(application, "mu_init", barrier);
  set(application, "bound_mult_init_method", std::string("mu-based"));
  set(application, "constr_mult_init_max", kMostMultiplier);
  for (const char* name : {"bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac"})
    set(application, name, push);
}

}  // namespace

void check_ipopt_option(const std::string& name, const std::string& value) {
  const Ipopt::SmartPtr<Ipopt::IpoptApplication> application = new Ipopt::IpoptApplication(false);
  set_by_name(*application, name, value);
}

void detail::configure(Ipopt::IpoptApplication& application, const SolverOptions& options, double barrier,
                       double push) {
  const auto assign = [&](const char* name, const auto& value) { set(application, name, value); };
  assign("sb", std::string("yes"));  // no banner
  assign("tol", options.tolerance);
  assign("dual_inf_tol", options.dual_tolerance);
  // Of rows in the program's units: Ipopt's own scaling weakens rows with large slopes, and 1e-8 of them may be 1e-5 here.
  assign("constr_viol_tol", kRowsOfTolerance * options.tolerance);
  assign("bound_relax_factor", 0.0);  // they come widened (ipopt.cpp)
  assign("honor_original_bounds", std::string("no"));
  assign("max_iter", options.max_iterations);
  assign("max_cpu_time", options.max_seconds);
  assign("print_level", options.print_level);
  if (!options.stop_at_acceptable) assign("acceptable_iter", 0);
  if (options.limited_memory) assign("hessian_approximation", std::string("limited-memory"));
  if (barrier > 0) {
    start_warm(application, barrier);
  } else if (options.first_barrier > 0) {
    start_near(application, options.first_barrier, push);
  }
  for (const auto& [name, value] : options.extra) set_by_name(application, name, value);
}

}  // namespace dyntape
