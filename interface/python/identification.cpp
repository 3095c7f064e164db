// SPDX-License-Identifier: BSD-3-Clause
//
// robot.identify: base parameters from measured motions and torques.
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <dyntape/interface/identification/estimator.h>
#include <dyntape/interface/io/number.h>

#include "module.h"
#include "robot.h"
#include "watch.h"

namespace dyntape::python {
namespace {

struct PythonIdentification {
  BaseParameters base;
  Identification found;
  Eigen::VectorXd nominal;
};

// (samples, entries), a sample a column in C++.
Eigen::MatrixXd columns_of(nb::handle given, const char* name, int entries, std::ptrdiff_t& count) {
  const Numbers values = numbers(given, std::string("identify: ") + name, {count, entries});
  count = values.shape[0];
  return Eigen::Map<const Eigen::MatrixXd>(values.data, entries, count);
}

std::shared_ptr<PythonIdentification> identified(const Robot& robot, nb::handle q, nb::handle v, nb::handle a,
                                                 nb::handle tau, bool armature, bool friction) {
  std::ptrdiff_t count = -1;
  Samples samples;
  samples.q = columns_of(q, "q", robot.nq, count);
  samples.v = columns_of(v, "v", robot.nv, count);
  samples.a = columns_of(a, "a", robot.nv, count);
  samples.tau = columns_of(tau, "tau", robot.nv, count);
  BaseOptions options;
  options.columns.armature = armature;
  options.columns.viscous = options.columns.coulomb = friction;
  options.mimics = robot.urdf.mimics;
  return left_alone(nb::none(), [model = robot.model(), options, samples](const std::stop_token&) {
    auto result = std::make_shared<PythonIdentification>();
    result->base = base_parameters(model, options);
    result->found = identify(model, result->base, samples);
    result->nominal = result->base.regrouping * parameter_values(model, options.columns);
    return result;
  });
}

nb::object array_of_vector(const Eigen::VectorXd& values) { return copy_of(values.data(), {values.size()}); }

}  // namespace

void bind_identification(nb::module_& module) {
  using I = PythonIdentification;
  nb::class_<I>(module, "Identification",
                "The inertial parameters that torques determine (base parameters), and their errors.")
      .def_prop_ro(
          "names", [](const I& i) { return i.base.names; }, "Which combination of parameters each is.")
      .def_prop_ro(
          "values", [](const I& i) { return array_of_vector(i.found.beta); },
          nb::sig("def values(self) -> Array"), "(n,) the estimates; kg, kg m, kg m^2.")
      .def_prop_ro(
          "deviations", [](const I& i) { return array_of_vector(i.found.standard_deviation); },
          nb::sig("def deviations(self) -> Array"),
          "(n,) standard deviations, the least that any unbiased estimate has.")
      .def_prop_ro(
          "nominal", [](const I& i) { return array_of_vector(i.nominal); },
          nb::sig("def nominal(self) -> Array"), "(n,) the same of the robot's file.")
      .def_prop_ro(
          "noise", [](const I& i) { return array_of_vector(i.found.sigma); },
          nb::sig("def noise(self) -> Array"), "(nv,) standard deviation of the torques, N m or N.")
      .def_prop_ro(
          "condition", [](const I& i) { return i.found.condition; },
          "Of the regressor with columns of unit length.")
      .def("__repr__", [](const I& i) {
        return "<dyntape.Identification: " + std::to_string(i.base.rank()) + " base parameters, condition " +
               io::with_digits(i.found.condition, 3) + ">";
      });
  nb::object robot = module.attr("Robot");
  robot.attr("identify") = nb::cpp_function(
      identified, nb::name("identify"), nb::is_method(), nb::scope(robot), nb::arg("q"), nb::arg("v"),
      nb::arg("a"), nb::arg("tau"), nb::kw_only(), nb::arg("armature") = false, nb::arg("friction") = false,
      nb::sig("def identify(self, q: ArrayLike, v: ArrayLike, a: ArrayLike, tau: ArrayLike, *, armature: "
              "bool = False, "
              "friction: bool = False) -> Identification"),
      "The base parameters that measured motions and torques show.\n\n"
      "q (samples, nq), v, a, tau (samples, nv).  armature, friction (viscous and Coulomb): of joints, among "
      "the parameters.\n\n"
      "Raises NumericalError where the motion does not excite all of them, ArgumentError for too few "
      "samples.");
}

}  // namespace dyntape::python
