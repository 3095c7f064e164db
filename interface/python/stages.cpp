// SPDX-License-Identifier: BSD-3-Clause
//
// Functions of a stage from Python: recorded once, then called by recordings and in doubles.
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>

#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/motion/standing.h>

#include "functions.h"
#include "module.h"
#include "problems.h"
#include "recorded_arrays.h"

namespace dyntape::python {
namespace {

// (t, x, a, u, p) in one vector.
template <class T>
typename Stage<T>::Vector joined(const Stage<T>& stage, const StageSizes& sizes) {
  typename Stage<T>::Vector all = Stage<T>::Vector::Constant(1 + sizes.x + sizes.a + sizes.u + sizes.p, T(0));
  all[0] = stage.t;
  Eigen::Index at = 1;
  // What a stage does not have, as accelerations behind a solve, is zero; parameters that came later are not known here.
  const auto put = [&](const auto& part, Eigen::Index entries) {
    if (part.size() >= entries) all.segment(at, entries) = part.head(entries);
    at += entries;
  };
  put(stage.x, sizes.x), put(stage.a, sizes.a), put(stage.u, sizes.u), put(stage.p, sizes.p);
  return all;
}

PythonStage stage_of(const VectorXad& all, const StageSizes& sizes, const Parameters& parameters) {
  const AD* from = all.data();
  const auto part = [&](Eigen::Index entries) {
    nb::object array = recorded_array(from, {entries});
    from += entries;
    return array;
  };
  PythonStage stage;
  stage.sizes = sizes;
  stage.parameters = parameters;
  stage.t = nb::cast(*from++);
  stage.x = part(sizes.x), stage.a = part(sizes.a), stage.u = part(sizes.u), stage.p = part(sizes.p);
  return stage;
}

// At these values, or at the default point.
Function record_python(const std::string& name, const PythonProblem& problem, const nb::callable& f,
                       const Eigen::VectorXd& at = {}) {
  const StageSizes sizes = problem.sizes();
  const auto n = static_cast<std::size_t>(1 + sizes.x + sizes.a + sizes.u + sizes.p);
  RecordOptions options;
  options.variables.assign(at.begin(), at.end());
  options.branches = RecordOptions::Branches::kError;  // a solve goes through both sides
  Recorder recorder(name, n, 0, options, nullptr, 0);
  const nb::object stage = nb::cast(stage_of(recorder.x(), sizes, problem.problem.parameters));
  const nb::object y = call_recorded(f, name, stage);
  return recorder.end(recorded_vector(y, name));
}

nb::object slice(const nb::object& array, Eigen::Index from, Eigen::Index to) {
  return array[nb::slice(nb::cast(from), nb::cast(to), nb::none())];
}

void check_is_robot(const PythonStage& stage) {
  if (stage.sizes.nq == 0) throw MissingError("stage: q and v are of a robot's problem; expected x");
}

}  // namespace

StageFunction record_stage_function(PythonProblem& problem, const std::string& name, nb::callable f) {
  const StageSizes sizes = problem.sizes();
  const Function recorded = record_python(name, problem, f);
  problem.given.push_back({name, f});
  const std::shared_ptr<const Callee> callee = dissolving_callee(recorded);
  CodegenOptions options;
  options.order = Order::kValue;
  options.route = Route::kInterpreter;
  const auto kernels = std::make_shared<Kernels>(CompiledFunction::make(recorded, options));
  return StageFunction([callee, sizes](const Stage<AD>& s) { return call(callee, joined(s, sizes)); },
                       [kernels, sizes](const Stage<double>& s) {
                         const auto workspace = kernels->pool.take([&] {
                           return std::make_unique<CompiledFunction::Workspace>(kernels->function);
                         });
                         const Eigen::VectorXd all = joined(s, sizes);
                         Eigen::VectorXd y(static_cast<Eigen::Index>(kernels->function.n_y()));
                         kernels->function.value(all.data(), nullptr, y.data(), *workspace);
                         return y;
                       });
}

std::string first_not_finite_line(const PythonProblem& problem) {
  constexpr int kInstants = 33;
  const Problem& p = problem.problem;
  for (const PythonProblem::Given& given : problem.given) {
    for (int k = 0; k < kInstants; ++k) {
      const double t = p.duration * k / (kInstants - 1);
      Stage<double> stage = p.first_guess(t);
      stage.t = t, stage.p = p.parameters.at(t);
      try {
        const FindNotFinite found;
        record_python(given.name, problem, given.function, joined(stage, problem.sizes()));
      } catch (nb::python_error& error) {
        if (!error.matches(nb::module_::import_("dyntape").attr("NumericalError"))) return "";
        return nb::cast<std::string>(nb::str(error.value())) + ", in \"" + given.name + "\"";
      }
    }
  }
  return "";
}

void throw_with_line(const PythonProblem& p, const NumericalError& error) {
  const std::string sentence = error.what(), line = first_not_finite_line(p);
  if (line.empty()) throw error;
  const std::size_t node = sentence.find("; node "), advice = sentence.find("; write ");
  throw NumericalError(sentence.substr(0, node) + "; " + line +
                       (advice == sentence.npos ? "" : sentence.substr(advice)));
}

StageFunction stage_function_of(PythonProblem& problem, const std::string& name, nb::handle given) {
  if (nb::isinstance<PythonStageFunction>(given)) return nb::cast<const PythonStageFunction&>(given).function;
  if (PyCallable_Check(given.ptr()))
    return record_stage_function(problem, name, nb::borrow<nb::callable>(given));
  throw ArgumentError(name + ": expected a function of the stage, got " +
                      nb::cast<std::string>(nb::repr(given.type())));
}

void bind_stages(nb::module_& module) {
  nb::class_<PythonStage>(
      module, "Stage", "One instant of a motion: what functions of a problem are given, as recorded values.")
      .def_ro("t", &PythonStage::t, "s.")
      .def_ro("x", &PythonStage::x, "State.")
      .def_ro("a", &PythonStage::a, "Accelerations, in the inverse form; else empty.")
      .def_ro("u", &PythonStage::u, "Controls.")
      .def_ro("p", &PythonStage::p, "Entries of all parameters.")
      .def_prop_ro(
          "q", [](const PythonStage& s) { return check_is_robot(s), slice(s.x, 0, s.sizes.nq); },
          "(nq,) of a robot's problem.")
      .def_prop_ro(
          "v",
          [](const PythonStage& s) {
            return check_is_robot(s), slice(s.x, s.sizes.nq, s.sizes.nq + s.sizes.nv);
          },
          "(nv,) of a robot's problem.")
      .def(
          "__getitem__",
          [](const PythonStage& s, const std::string& name) {
            const Parameter parameter = s.parameters.find(name);
            return slice(s.p, parameter.first(), parameter.first() + parameter.size());
          },
          nb::arg("name"), "The entries of the parameter of this name.");
  nb::class_<PythonStageFunction>(module, "StageFunction",
                                  "A function of the stage that is ready to be made a term.")
      .def_ro("name", &PythonStageFunction::name, "What it is.")
      .def("__repr__", [](const PythonStageFunction& f) { return "<dyntape.StageFunction " + f.name + ">"; });
}

}  // namespace dyntape::python
