// SPDX-License-Identifier: BSD-3-Clause
//
// Devices of OpenCL, and recorded functions on them.
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>

#include "functions.h"

namespace dyntape::python {
namespace {

std::string device_text(const codegen::OpenClDevice& d) {
  return "<dyntape.Device \"" + d.name + "\": " + d.platform + ", driver " + d.driver + ", " +
         (d.has_doubles ? "double and single" : "single") + " precision>";
}

}  // namespace

void evaluate_on_device(const RecordedFunction& f, const DeviceFunction& device, Order order,
                        const Rows& rows, const Write& write) {
  const std::size_t n_in = rows.entries(), n_y = f.n_y();
  const std::size_t n_j = order >= Order::kFirst ? device.jacobian_pattern().nnz() : 0;
  const std::size_t n_h = order == Order::kSecond ? device.hessian_pattern().nnz() : 0;
  const Strides strides{.x = n_in, .p = n_in, .w = n_in, .y = n_y, .jacobian = n_j, .hessian = n_h};
  ChunkResults results;
  for_parts(rows, n_in + n_y + n_j + n_h, [&](std::size_t first, std::size_t count, const double* states) {
    results.y.resize(count * n_y);
    results.jacobian.resize(count * n_j);
    results.hessian.resize(count * n_h);
    Points points;
    points.count = count, points.strides = &strides;
    points.x = states, points.p = states + f.n_x(), points.w = states + f.n_x() + f.n_p();
    points.y = results.y.data();
    points.jacobian = n_j ? results.jacobian.data() : nullptr;
    points.hessian = n_h ? results.hessian.data() : nullptr;
    const Violation violation = device.run(order, points);
    if (violation)
      device.check({violation.guard, first + violation.point}, rows.is_single() ? 1 : rows.count());
    write(first, count, results);
  });
}

void bind_devices(nb::module_& module) {
  using Device = codegen::OpenClDevice;
  nb::class_<Device>(module, "Device", "A device of OpenCL, as `devices` lists it.")
      .def_ro("name", &Device::name, "What its driver calls it.")
      .def_ro("platform", &Device::platform, "Of which driver it is.")
      .def_ro("driver", &Device::driver, "Version of the driver.")
      .def_ro("is_cpu", &Device::is_cpu, "Whether it is the processor.")
      .def_ro("has_doubles", &Device::has_doubles, "Whether it computes in double precision.")
      .def_ro("memory", &Device::memory, "Bytes.")
      .def("__repr__", device_text);
  module.def("devices", &codegen::opencl_devices, nb::sig("def devices() -> list[Device]"),
             "The devices of OpenCL: the first is \"opencl:0\" (`Function.compile`).  Empty if no driver has "
             "one.\n\n"
             "Raises ToolError if there is no loader of OpenCL.");
}

}  // namespace dyntape::python
