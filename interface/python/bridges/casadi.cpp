// SPDX-License-Identifier: BSD-3-Clause
//
// Functions in CasADi, in this process: robot.casadi("aba"), f.casadi().
//
// casadi.external(name, library) looks up `name`, `name_n_in`, `jac_name` and so on in a library.  This module is such a library, with
// 100 names; behind each that is in use stands a program of machine code.  CasADi counts its references, by which a name is free again.
#include <Python.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <boost/preprocessor/repetition/repeat.hpp>
#include <memory>
#include <mutex>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/casadi_program.h>
#include <dyntape/interface/robot/robot_callee.h>

#include "../functions.h"
#include "../module.h"
#include "../robot.h"

namespace dyntape::python {
namespace {

// Arguments of BOOST_PP_REPEAT below.
#define DYNTAPE_CASADI_NAMES 100

// A function with its programs: without second derivatives, which of a large robot take long to make, until they are asked for.
class Served {
 public:
  Served(Function function, codegen::CasadiBlocks blocks)
      : function_(std::move(function)), blocks_(std::move(blocks)), first_(program(Order::kFirst)) {}

  const codegen::CasadiProgram& of(std::size_t which) const {
    if (which < 3) return *first_;
    std::call_once(once_, [&] { second_ = program(Order::kSecond); });
    return *second_;
  }

 private:
  std::unique_ptr<codegen::CasadiProgram> program(Order order) const {
    CodegenOptions options;
    options.order = order;
    options.route = Route::kMachineCode;
    return std::make_unique<codegen::CasadiProgram>(function_, blocks_, options);
  }

  const Function function_;
  const codegen::CasadiBlocks blocks_;
  const std::unique_ptr<codegen::CasadiProgram> first_;
  mutable std::once_flag once_;
  mutable std::unique_ptr<codegen::CasadiProgram> second_;
};

struct Slot {
  std::unique_ptr<const Served> served;
  int references = 0;
};

std::mutex places_mutex;
std::array<Slot, DYNTAPE_CASADI_NAMES> places;

// The lowest free place, held until release().
std::size_t occupy(std::unique_ptr<const Served> served) {
  const std::scoped_lock lock(places_mutex);
  for (std::size_t k = 0; k < places.size(); ++k) {
    if (places[k].served) continue;
    places[k] = {std::move(served), 1};
    return k;
  }
  throw ArgumentError("CasADi holds " + std::to_string(places.size()) +
                      " functions of dyntape, as many as there is room for; delete some");
}

void refer(std::size_t k) {
  const std::scoped_lock lock(places_mutex);
  ++places[k].references;
}

void release(std::size_t k) {
  std::unique_ptr<const Served> last;  // destroyed behind the lock
  const std::scoped_lock lock(places_mutex);
  if (--places[k].references == 0) last = std::move(places[k].served);
}

const codegen::CasadiFunction& function_at(std::size_t k, std::size_t which) {
  return places[k].served->of(which).functions()[which];
}

const codegen::CasadiArgument* argument_at(std::size_t k, std::size_t which, bool is_in, long long i) {
  const auto& f = function_at(k, which);
  const auto& all = is_in ? f.in : f.out;
  return i >= 0 && i < static_cast<long long>(all.size()) ? &all[static_cast<std::size_t>(i)] : nullptr;
}

nb::object external(Function function, codegen::CasadiBlocks blocks) {
  nb::object make;
  try {
    make = nb::module_::import_("casadi").attr("external");
  } catch (nb::python_error& missing) {
    if (!missing.matches(PyExc_ImportError)) throw;
    throw ArgumentError("CasADi is not installed here: pip install casadi");
  }
  std::unique_ptr<const Served> served;
  {
    const nb::gil_scoped_release unlocked;
    served = std::make_unique<const Served>(std::move(function), std::move(blocks));
  }
  const std::size_t k = occupy(std::move(served));
  const nb::object module = nb::module_::import_("dyntape._dyntape").attr("__file__");
  try {
    nb::object made = make("dyntape_" + std::to_string(k), module);
    release(k);
    return made;
  } catch (...) {
    release(k);
    throw;
  }
}

nb::object of_robot(const Robot& robot, const std::string& name, const std::string& frame,
                    const std::string& axes, const std::vector<std::string>& contacts) {
  std::string spelled = name;
  for (char& c : spelled)
    if (c == '_') c = '-';
  const RobotFunction function = robot.function(
      {.row = RobotFunction(spelled).row(), .frame = frame, .axes = axes, .contacts = contacts});
  codegen::CasadiBlocks blocks;
  const auto add = [](std::vector<codegen::CasadiBlock>& to, const std::vector<RobotBlock>& from) {
    for (const RobotBlock& block : from)
      to.push_back({block.name, std::size_t(block.rows), std::size_t(block.cols * block.pages)});
  };
  add(blocks.inputs, inputs(robot.model(), function)), add(blocks.outputs, outputs(robot.model(), function));
  return external(record_differentiable(robot.model(), function), std::move(blocks));
}

nb::object of_function(const RecordedFunction& f) {
  codegen::CasadiBlocks blocks;
  blocks.inputs.push_back({"x", f.n_x()});
  if (f.n_p()) blocks.inputs.push_back({"p", f.n_p()});
  blocks.outputs.push_back({"y", f.n_y()});
  return external(f.n_p() ? all_as_variables(f.function) : f.function, std::move(blocks));
}

}  // namespace

void bind_casadi(nb::class_<Robot>& robot) {
  robot.def("casadi", of_robot, nb::arg("function"), nb::kw_only(), nb::arg("frame") = "",
            nb::arg("axes") = "aligned", nb::arg("contacts") = std::vector<std::string>(),
            nb::sig("def casadi(self, function: str, *, frame: str = '', axes: str = 'aligned', contacts: "
                    "Sequence[str] = ()) -> Any"),
            "A function of the robot as a casadi.Function, with sparse Jacobians and exact Hessians, as "
            "machine code in this process: for "
            "Opti, nlpsol,\nintegrator, map.  Inputs are q, v, a or tau; derivatives are by their entries.  "
            "A file of C for acados: `dyntape "
            "generate --casadi`.\n\n"
            "Raises ArgumentError where CasADi is not installed.");
}

void bind_casadi(nb::class_<RecordedFunction>& function) {
  function.def("casadi", of_function, nb::sig("def casadi(self) -> Any"),
               "This function as a casadi.Function of x, and p where there are parameters, by both of which "
               "it is derived.  A branch that was "
               "recorded\nand is left is a failed evaluation in CasADi.");
}

}  // namespace dyntape::python

// --- What CasADi looks up ---------------------------------------------------------------------------------

#define DT_EXPORT extern "C" __attribute__((visibility("default")))
#define DT_FUNCTION(prefix, k, which)                                                                     \
  DT_EXPORT int prefix##dyntape_##k(const double** arg, double** res, long long*, double*, int) {         \
    return dyntape::python::places[k].served->of(which).call(which, arg, res);                            \
  }                                                                                                       \
  DT_EXPORT long long prefix##dyntape_##k##_n_in() {                                                      \
    return static_cast<long long>(dyntape::python::function_at(k, which).in.size());                      \
  }                                                                                                       \
  DT_EXPORT long long prefix##dyntape_##k##_n_out() {                                                     \
    return static_cast<long long>(dyntape::python::function_at(k, which).out.size());                     \
  }                                                                                                       \
  DT_EXPORT const char* prefix##dyntape_##k##_name_in(long long i) {                                      \
    const auto* const argument = dyntape::python::argument_at(k, which, true, i);                         \
    return argument ? argument->name.c_str() : nullptr;                                                   \
  }                                                                                                       \
  DT_EXPORT const char* prefix##dyntape_##k##_name_out(long long i) {                                     \
    const auto* const argument = dyntape::python::argument_at(k, which, false, i);                        \
    return argument ? argument->name.c_str() : nullptr;                                                   \
  }                                                                                                       \
  DT_EXPORT const long long* prefix##dyntape_##k##_sparsity_in(long long i) {                             \
    const auto* const argument = dyntape::python::argument_at(k, which, true, i);                         \
    return argument ? argument->sparsity.data() : nullptr;                                                \
  }                                                                                                       \
  DT_EXPORT const long long* prefix##dyntape_##k##_sparsity_out(long long i) {                            \
    const auto* const argument = dyntape::python::argument_at(k, which, false, i);                        \
    return argument ? argument->sparsity.data() : nullptr;                                                \
  }                                                                                                       \
  DT_EXPORT int prefix##dyntape_##k##_work(long long* arg, long long* res, long long* iw, long long* w) { \
    if (arg) *arg = prefix##dyntape_##k##_n_in();                                                         \
    if (res) *res = prefix##dyntape_##k##_n_out();                                                        \
    if (iw) *iw = 0;                                                                                      \
    if (w) *w = 0;                                                                                        \
    return 0;                                                                                             \
  }                                                                                                       \
  DT_EXPORT void prefix##dyntape_##k##_incref() { dyntape::python::refer(k); }                            \
  DT_EXPORT void prefix##dyntape_##k##_decref() { dyntape::python::release(k); }
#define DT_NAME(z, k, unused) \
  DT_FUNCTION(, k, 0)         \
  DT_FUNCTION(jac_, k, 1)     \
  DT_FUNCTION(adj1_, k, 2)    \
  DT_FUNCTION(jac_adj1_, k, 3)

BOOST_PP_REPEAT(DYNTAPE_CASADI_NAMES, DT_NAME, _)
