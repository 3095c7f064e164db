// SPDX-License-Identifier: BSD-3-Clause
//
// How a task is solved: the blocks `solver` and `contact_implicit` of task files.
#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/ipopt/ipopt_options.h>
#include <dyntape/interface/control/nlp/solver_option_table.h>
#include <dyntape/interface/files/task/task_faults.h>
#include <dyntape/interface/files/task/task_keys.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

using io::Section;

namespace {

// The options of a block (solver_option_table.h).
struct OptionsOfBlock {
  Section& block;

  template <class T>
  void number(const char* name, T& value, const io::Range& range, const char* meaning) {
    value = block.about(meaning).get_or(name, value, range);
  }
  void flag(const char* name, bool& value, const char* meaning) {
    value = block.about(meaning).get_or(name, value);
  }
  template <class E>
  void choice(const char* name, E& value, const io::Choice<E>& words, const char* meaning) {
    value = block.about(meaning).choice_or<E>(name, io::word_of(value, words), words);
  }
};

}  // namespace

void read_solver(Section& file, TaskSpec& task) {
  Section solver = file.about("the solver of the nonlinear program").child_or_empty("solver");
  OptimiseOptions& optimise = task.optimise;
  SolverOptions& options = optimise.solver;
  io::Choice<std::optional<NlpMethod>> methods;
  for (const auto& [word, method] : nlp_methods()) methods.emplace_back(word, method);
  methods.emplace_back("ddp", std::nullopt);
  const auto method = solver
                          .about(std::string(kNlpMethodsMeaning) +
                                 "; ddp: differential dynamic programming, for costs and limits of controls")
                          .choice_or<std::optional<NlpMethod>>("method", "automatic", methods);
  task.by_ddp = !method;
  options.method = method.value_or(NlpMethod::kRiccati);
  if (task.simulated) options.barrier_update = BarrierUpdate::kMonotone;
  OptionsOfBlock reader{solver};
  visit_options(options, reader);
  optimise.check_derivatives = solver.about("compare derivatives with finite differences before solving")
                                   .get_or("check_derivatives", true);
  Section extra =
      solver.about("options of Ipopt by Ipopt's names, except options that name files, print or warm-start")
          .child_or_empty("ipopt");
  for (Section& option : extra.all_children()) {
    try {
      check_ipopt_option(option.name(), option.value());
      options.extra.emplace_back(option.name(), option.value());
    } catch (const ArgumentError& e) {
      extra.problem(option.name(), e.what());
    }
  }
}

// What stands in the file; defaults are of other methods.
void note_ddp_keys(Section& file, const TaskSpec& task) {
  if (!task.by_ddp) return;
  Section form = file.child_or_empty("transcription"), bounds = file.child_or_empty("bounds");
  const Scheme& scheme = task.optimise.mesh.scheme;
  if (form.has("scheme") && scheme.name != "euler" && !(scheme.step && scheme.steps == 1))
    form.problem("scheme",
                 "'transcription.scheme' is one of collocation, which the method ddp does not support; "
                 "expected runge-kutta-4, which is the default, or semi-implicit-euler");
  const auto note_limit = [&](const char* key, const Limit& limit) {
    if (bounds.has(key) && limit.robot)
      bounds.problem(key, limits_of_states(std::string("bounds.") + key).message);
  };
  note_limit("positions", task.bounds.positions), note_limit("velocities", task.bounds.velocities);
}

void read_continuation(Section& file, TaskSpec& task, const dynamics::Model<double>* model) {
  if (model && !task.simulated) {  // in the list of keys it stands
    if (file.has("contact_implicit"))
      file.problem("contact_implicit",
                   "'contact_implicit' is of rigid contacts, and there are none; expected a 'scene' whose "
                   "'constraints' have contacts");
    return;
  }
  Section block = file.about(
                          "for a scene with rigid contacts: contact times and forces are found by "
                          "complementarity, relaxed at first")
                      .child_or_empty("contact_implicit");
  ContactContinuation& c = task.continuation;
  const auto number = [&](const char* key, const std::string& what, double fallback) {
    return block.about(what).get_or(key, fallback, io::positive());
  };
  c.last.relaxation = number("relaxation",
                             "relaxation in the last solve: largest product of a contact force, as a "
                             "fraction of the robot's weight, and the gap [m]",
                             c.last.relaxation);
  c.last.slip = number(
      "slip", "slip in the last solve: sliding speed at which friction nearly reaches its full force [m/s]",
      c.last.slip);
  c.first.relaxation = number("first_relaxation", "relaxation in the first solve [m]", c.first.relaxation);
  c.first.slip = number("first_slip", "slip in the first solve [m/s]", c.first.slip);
  c.solves = block
                 .about(
                     "number of solves; each starts from the previous motion and decreases relaxation and "
                     "slip by the same ratio")
                 .get_or("solves", c.solves, io::between(1, 20));
  const auto check_order = [&](const char* first, double a, const char* last, double b) {
    if (a < b)
      block.problem(first, std::string("'") + first + "' is " + io::shortest(a) + ", expected '" + last +
                               "', " + io::shortest(b) + ", at least");
  };
  check_order("first_relaxation", c.first.relaxation, "relaxation", c.last.relaxation);
  check_order("first_slip", c.first.slip, "slip", c.last.slip);
}

}  // namespace dyntape
