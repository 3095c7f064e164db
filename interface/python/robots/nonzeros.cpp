// SPDX-License-Identifier: BSD-3-Clause
//
// robot.nonzeros("id_derivatives"): a function of the table with the results that are not zero everywhere, each of them once.
#include <nanobind/stl/unique_ptr.h>

#include <algorithm>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/graph/nonzero_outputs.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/run/workspace_pool.h>

#include "../robot.h"

namespace dyntape::python {
namespace {

// Called from any number of threads.
class NonzeroResults {
 public:
  NonzeroResults(const Robot& robot, const RobotFunction& function)
      : blocks(blocks_of(robot.model(), function)),
        kept_(nonzero_outputs(record_robot_function(robot.model(), function))),
        compiled_(CompiledFunction::make(kept_.function, options())),
        values_{{"values", {static_cast<std::ptrdiff_t>(kept_.function.n_y())}}} {
    for (const RobotBlock& input : dyntape::inputs(robot.model(), function)) inputs.push_back(input);
  }

  nb::object values(nb::args arguments) {
    if (arguments.size() != inputs.size())
      throw ArgumentError("nonzeros: " + std::to_string(arguments.size()) + " arguments, expected " +
                          input_names());
    Rows rows("nonzeros");
    for (std::size_t i = 0; i < inputs.size(); ++i)
      rows.add(arguments[i], inputs[i].name.c_str(), static_cast<std::size_t>(inputs[i].size()));
    const Result result(rows, values_);
    for_chunks(rows, [&](std::size_t first, std::size_t count, const double* states) {
      const auto workspace =
          pool_.take([&] { return std::make_unique<CompiledFunction::Workspace>(compiled_); });
      Points points;
      points.count = count, points.x = states, points.y = result.data() + first * compiled_.n_y();
      compiled_.check(compiled_.run(Order::kValue, points, *workspace), count);
    });
    return result.block(0);
  }

  nb::dict expand(nb::handle given) const {
    Rows rows("expand");
    rows.add(given, "values", compiled_.n_y());
    const Result result(rows, blocks);
    for_chunks(rows, [&](std::size_t first, std::size_t count, const double* values) {
      for (std::size_t i = 0; i < count; ++i)
        kept_.expand(values + i * compiled_.n_y(), result.data() + (first + i) * kept_.place.size());
    });
    nb::dict dense;
    for (std::size_t i = 0; i < blocks.size(); ++i) dense[blocks[i].name.c_str()] = result.block(i);
    return dense;
  }

  // By block, its shape; -1 where it is zero.
  nb::dict places() const {
    nb::dict all;
    auto from = kept_.place.begin();
    for (const Block& block : blocks) {
      std::vector<std::ptrdiff_t> places(block.size());
      std::transform(from, from + static_cast<std::ptrdiff_t>(block.size()), places.begin(),
                     [](std::int32_t place) { return std::max<std::ptrdiff_t>(place, -1); });
      from += static_cast<std::ptrdiff_t>(block.size());
      nb::object shape = nb::steal(PyTuple_New(static_cast<Py_ssize_t>(block.shape.size())));
      for (std::size_t i = 0; i < block.shape.size(); ++i)
        PyTuple_SetItem(shape.ptr(), static_cast<Py_ssize_t>(i), PyLong_FromSsize_t(block.shape[i]));
      all[block.name.c_str()] = new_integers(places).attr("reshape")(shape);
    }
    return all;
  }

  std::size_t size() const { return compiled_.n_y(); }
  std::string summary() const {
    return "<dyntape.Nonzeros of " + compiled_.name() + ": " + std::to_string(size()) + " of " +
           std::to_string(kept_.place.size()) + " results>";
  }

 private:
  static CodegenOptions options() {
    CodegenOptions options;
    options.order = Order::kValue;
    options.lanes = Lanes::kNative;
    options.functions = Functions::kPortable;
    options.route = Route::kTiered;
    return options;
  }
  std::string input_names() const {
    std::string names;
    for (const RobotBlock& input : inputs) names += (names.empty() ? "" : ", ") + input.name;
    return names;
  }

  std::vector<RobotBlock> inputs;
  const std::vector<Block> blocks;
  const NonzeroOutputs kept_;
  const CompiledFunction compiled_;
  const std::vector<Block> values_;
  dyntape::detail::WorkspacePool<CompiledFunction::Workspace> pool_;
};

}  // namespace

void bind_nonzeros(nb::module_& module, nb::class_<Robot>& robot) {
  nb::class_<NonzeroResults>(
      module, "Nonzeros",
      "The results of a robot's function that are not zero everywhere, each once: of a humanoid's "
      "id_derivatives 1576\nnumbers for 3675.  Made by `Robot.nonzeros`; for any number of threads.")
      .def("__call__", &NonzeroResults::values, nb::sig("def __call__(self, *state: ArrayLike) -> Array"),
           "The non-zeros, (..., size), of arguments as the method has them: portable sines, in lanes for "
           "batches.\n\n"
           "Raises ArgumentError for wrong shapes.\n\n"
           ">>> robot.nonzeros(\"crba\")(q[0]).shape\n"
           "(28,)")
      .def("expand", &NonzeroResults::expand, nb::arg("values"),
           nb::sig("def expand(self, values: ArrayLike) -> dict[str, Array]"),
           "Dense blocks by name, of shape (..., nv, nv) and so on.\n\n"
           "values: (..., size)\n\n"
           "Raises ArgumentError for another number of values.\n\n"
           ">>> f = robot.nonzeros(\"crba\")\n"
           ">>> f.expand(f(q[0]))[\"M\"].shape\n"
           "(7, 7)")
      .def_prop_ro("places", &NonzeroResults::places, nb::sig("def places(self) -> dict[str, numpy.ndarray]"),
                   "Where each entry of a block is among the values: arrays of integers by name, -1 where it "
                   "is zero.\n\n"
                   ">>> robot.nonzeros(\"crba\").places[\"M\"].shape\n"
                   "(7, 7)")
      .def_prop_ro("size", &NonzeroResults::size, "How many values there are.")
      .def("__repr__", &NonzeroResults::summary);
  robot.def(
      "nonzeros",
      [](const Robot& self, const std::string& function, const std::string& frame, const std::string& axes,
         const std::vector<std::string>& contacts) {
        std::string name = function;
        std::replace(name.begin(), name.end(), '_', '-');
        const RobotCall call{
            .row = RobotFunction(name).row(), .frame = frame, .axes = axes, .contacts = contacts};
        const RobotFunction asked = self.function(call);
        const nb::gil_scoped_release unlocked;
        return std::make_unique<NonzeroResults>(self, asked);
      },
      nb::arg("function"), nb::kw_only(), nb::arg("frame") = "", nb::arg("axes") = "aligned",
      nb::arg("contacts") = std::vector<std::string>(),
      "A function of the table with those results only that are not zero everywhere, of a symmetric matrix "
      "one triangle.\n"
      "What is written bounds functions of large robots.\n\n"
      "function: the name of the method.  frame, axes, contacts: as the method has them.\n\n"
      "Raises ArgumentError where no function has this name.\n\n"
      ">>> robot.nonzeros(\"crba\").size\n"
      "28");
}

}  // namespace dyntape::python
