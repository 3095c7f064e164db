// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape.record: Python functions on recorded values, their values, Jacobians and Hessians.
#include "functions.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <optional>

#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/graph/dump.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/interface/io/choice.h>

#include "recorded_arrays.h"
#include "watch.h"

namespace dyntape::python {
namespace {

// --- Recording --------------------------------------------------------------------------------------------

RecordOptions record_options(const std::vector<double>& x0, const std::vector<double>& p0,
                             const std::string& branches) {
  RecordOptions options;
  options.variables = x0;
  options.parameters = p0;
  options.branches = io::chosen<RecordOptions::Branches>(
      "record: branches", branches,
      {{"guard", RecordOptions::Branches::kGuard}, {"error", RecordOptions::Branches::kError}});
  return options;
}

// Where a function's code begins; nothing for callables without code.
std::pair<std::string, int> place_of(nb::handle f) {
  if (!nb::hasattr(f, "__code__")) return {"", 0};
  const nb::object code = f.attr("__code__");
  return {nb::cast<std::string>(code.attr("co_filename")), nb::cast<int>(code.attr("co_firstlineno"))};
}

std::string name_of(nb::handle f) {
  std::string name =
      nb::hasattr(f, "__name__") ? nb::cast<std::string>(f.attr("__name__")) : std::string("function");
  if (name == "<lambda>") name = "lambda";
  return name;
}

std::shared_ptr<RecordedFunction> record_function(nb::callable f, std::size_t n_x, std::size_t n_p,
                                                  std::optional<std::string> name,
                                                  const std::vector<double>& x0,
                                                  const std::vector<double>& p0,
                                                  const std::string& branches) {
  const auto [file, line] = place_of(f);
  const std::string called = name.value_or(name_of(f));
  Recorder recorder(called, n_x, n_p, record_options(x0, p0, branches), file.empty() ? nullptr : file.c_str(),
                    line);
  const auto inputs = [](const VectorXad& values) { return recorded_array(values.data(), {values.size()}); };
  const nb::object y = n_p > 0 ? call_recorded(f, called, inputs(recorder.x()), inputs(recorder.p()))
                               : call_recorded(f, called, inputs(recorder.x()));
  const nb::object array = nb::module_::import_("numpy").attr("asarray")(y, "O");
  const VectorXad values = recorded_vector(array, called);
  return std::make_shared<RecordedFunction>(recorder.end(values),
                                            nb::cast<Shape>(nb::list(array.attr("shape"))));
}

// --- Evaluation -------------------------------------------------------------------------------------------

Rows rows_of(const RecordedFunction& f, nb::handle x, nb::handle p, nb::handle weights, bool weighted) {
  Rows rows(f.function.name.c_str());
  rows.add(x, "x", f.n_x());
  if (f.n_p() > 0) {
    if (p.is_none())
      throw ArgumentError(f.function.name + ": expected p of shape (..., " + std::to_string(f.n_p()) +
                          "), got none");
    rows.add(p, "p", f.n_p());
  } else if (!p.is_none()) {
    throw ArgumentError(f.function.name + ": it was recorded without parameters; expected no p");
  }
  if (weighted) rows.add(weights, "weights", f.n_y());
  return rows;
}

void evaluate(const RecordedFunction& f, Kernels& kernels, Order order, const Rows& rows,
              const Write& write) {
  if (kernels.device) return evaluate_on_device(f, *kernels.device, order, rows, write);
  const CompiledFunction& function = kernels.function;
  const std::size_t n_j = order >= Order::kFirst ? function.jacobian_pattern().nnz() : 0;
  const std::size_t n_h = order == Order::kSecond ? function.hessian_pattern().nnz() : 0;
  for_chunks(rows, [&](std::size_t first, std::size_t count, const double* states) {
    thread_local ChunkResults results;
    results.y.resize(count * f.n_y());
    results.jacobian.resize(count * n_j);
    results.hessian.resize(count * n_h);
    const std::size_t n_in = rows.entries();
    const Strides strides{.x = n_in, .p = n_in, .w = n_in, .y = f.n_y(), .jacobian = n_j, .hessian = n_h};
    Points points;
    points.count = count, points.strides = &strides;
    points.x = states, points.p = states + f.n_x(), points.w = states + f.n_x() + f.n_p();
    points.y = results.y.data();
    if (n_j > 0) points.jacobian = results.jacobian.data();
    if (n_h > 0) points.hessian = results.hessian.data();
    const auto workspace =
        kernels.pool.take([&] { return std::make_unique<CompiledFunction::Workspace>(function); });
    const Violation violation = function.run(order, points, *workspace);
    if (violation)
      function.check({violation.guard, first + violation.point}, rows.is_single() ? 1 : rows.count());
    write(first, count, results);
  });
}

nb::object value(const RecordedFunction& f, nb::handle x, nb::handle p) {
  const Rows rows = rows_of(f, x, p, nb::none(), false);
  const std::vector<Block> blocks = {{"y", f.y_shape}};
  const Result result(rows, blocks);
  evaluate(f, *kernels_of(f, Order::kValue), Order::kValue, rows,
           [&](std::size_t first, std::size_t, const ChunkResults& results) {
             std::copy(results.y.begin(), results.y.end(), result.data() + first * f.n_y());
           });
  return result.block(0);
}

// Inside another recording: one call, or its statements.
nb::object recorded_value(const RecordedFunction& f, nb::handle x, nb::handle p) {
  const auto n_x = static_cast<Eigen::Index>(f.n_x()), n_p = static_cast<Eigen::Index>(f.n_p());
  VectorXad arguments(n_x + n_p);
  arguments.head(n_x) = recorded_vector(x, f.function.name + ": x", n_x);
  if (n_p > 0) arguments.tail(n_p) = recorded_vector(p, f.function.name + ": p", n_p);
  const VectorXad y = call(f.callee(), arguments);
  return recorded_array(y.data(), f.y_shape);
}

nb::object call_function(const RecordedFunction& f, nb::handle x, nb::handle p) {
  return holds_objects(x) || holds_objects(p) ? recorded_value(f, x, p) : value(f, x, p);
}

// The non-zeros of a chunk, in a dense matrix a state; both triangles where it is symmetric.
void scatter(const std::vector<double>& values, const Pattern& pattern, std::size_t n_cols, std::size_t count,
             bool symmetric, double* dense) {
  const std::size_t nnz = pattern.nnz(), size = pattern.rows * n_cols;
  std::fill_n(dense, count * size, 0.0);
  for (std::size_t i = 0; i < count; ++i, dense += size) {
    const double* from = values.data() + i * nnz;
    for (std::size_t k = 0; k < nnz; ++k) {
      const std::size_t row = pattern.row[k], col = pattern.col[k];
      dense[row * n_cols + col] = from[k];
      if (symmetric) dense[col * n_cols + row] = from[k];
    }
  }
}

// What a derivative is: dense, or its non-zeros.
nb::object derivative(const RecordedFunction& f, Order order, const Rows& rows, bool dense) {
  const std::shared_ptr<Kernels> kernels = kernels_of(f, order);
  const bool second = order == Order::kSecond;
  const Pattern& pattern =
      second ? kernels->function.hessian_pattern() : kernels->function.jacobian_pattern();
  const auto n_x = static_cast<std::ptrdiff_t>(f.n_x());
  Block block{second ? "hessian" : "jacobian", second ? Shape{n_x} : f.y_shape};
  block.shape.push_back(n_x);
  if (!dense) block.shape = {static_cast<std::ptrdiff_t>(pattern.nnz())};
  const std::vector<Block> blocks = {block};
  const Result result(rows, blocks);
  evaluate(f, *kernels, order, rows, [&](std::size_t first, std::size_t count, const ChunkResults& results) {
    const std::vector<double>& values = second ? results.hessian : results.jacobian;
    double* to = result.data() + first * block.size();
    if (dense)
      scatter(values, pattern, f.n_x(), count, second, to);
    else
      std::copy(values.begin(), values.end(), to);
  });
  return result.block(0);
}

nb::tuple pattern_of(const RecordedFunction& f, Order order) {
  const std::shared_ptr<Kernels> kernels = kernels_of(f, order);
  const Pattern& pattern =
      order == Order::kSecond ? kernels->function.hessian_pattern() : kernels->function.jacobian_pattern();
  return nb::make_tuple(new_integers({pattern.row.begin(), pattern.row.end()}),
                        new_integers({pattern.col.begin(), pattern.col.end()}));
}

// The non-zeros of one state as scipy has them; both triangles of a Hessian.
nb::object sparse(const RecordedFunction& f, Order order, const Rows& rows) {
  if (!rows.is_single()) {
    throw ArgumentError(f.function.name + ": sparse=True: expected one state, got batch axes " +
                        shape_text(rows.batch(), static_cast<std::size_t>(rows.axes())) +
                        "; jacobian_values and hessian_values give the non-zeros of all");
  }
  const nb::object helper = nb::module_::import_("dyntape._sparse");
  const char* kind = order == Order::kSecond ? "symmetric" : "general";
  return helper.attr(kind)(derivative(f, order, rows, false), pattern_of(f, order),
                           nb::make_tuple(order == Order::kSecond ? f.n_x() : f.n_y(), f.n_x()));
}

enum class Form { kDense, kSparse, kValues };

nb::object jacobian(const RecordedFunction& f, nb::handle x, nb::handle p, Form form) {
  const Rows rows = rows_of(f, x, p, nb::none(), false);
  if (form == Form::kSparse) return sparse(f, Order::kFirst, rows);
  return derivative(f, Order::kFirst, rows, form == Form::kDense);
}

nb::object hessian(const RecordedFunction& f, nb::handle x, nb::handle p, nb::handle weights, Form form) {
  if (weights.is_none() && f.n_y() != 1)
    throw ArgumentError(f.function.name + ": expected weights of shape (..., " + std::to_string(f.n_y()) +
                        "), one an output, got none");
  const double one = 1;
  const Rows rows = rows_of(f, x, p, weights.is_none() ? copy_of(&one, {1}) : nb::borrow(weights), true);
  if (form == Form::kSparse) return sparse(f, Order::kSecond, rows);
  return derivative(f, Order::kSecond, rows, form == Form::kDense);
}

// --- Compilation ------------------------------------------------------------------------------------------

Route route_from(const std::string& name) {
  if (name == "tiered") return Route::kTiered;
  if (name == "machine-code") return Route::kMachineCode;
  if (name == "compiled") return Route::kCompiled;
  throw ArgumentError("compile: expected route \"tiered\", \"machine-code\" or \"compiled\", got \"" + name +
                      "\"");
}

std::shared_ptr<RecordedFunction> compile(std::shared_ptr<RecordedFunction> f, int order,
                                          const std::string& route, bool lanes, const std::string& functions,
                                          const std::vector<std::string>& flags,
                                          const std::optional<std::string>& device, bool single) {
  CodegenOptions options;
  options.order = order_from(order);
  options.route = route_from(route);
  options.functions = functions_from(functions);
  options.lanes = lanes ? Lanes::kNative : Lanes::kNone;
  options.flags = flags;
  if (single && !device) throw ArgumentError("compile: single: expected a device, got none");
  left_alone(nb::none(), [=](const std::stop_token& stop) mutable {
    options.stop = stop;
    if (device)
      f->compile_for({.device = *device, .single = single}, options);
    else
      f->compile(options);
  });
  return f;
}

std::string summary(const RecordedFunction& f) {
  const std::shared_ptr<Kernels> compiled = f.compiled();
  return "<dyntape.Function \"" + f.function.name + "\": x (" + std::to_string(f.n_x()) + ",), " +
         (f.n_p() > 0 ? "p (" + std::to_string(f.n_p()) + ",), " : "") + "y " + shape_text(f.y_shape) + ", " +
         std::to_string(total_operations(f.function)) + " operations, " +
         (compiled ? "compiled to order " + std::to_string(static_cast<int>(compiled->function.order()))
                   : "interpreted") +
         ">";
}

void bind_derivatives(nb::class_<RecordedFunction>& f) {
  using F = RecordedFunction;
  f.def(
      "jacobian",
      [](const F& g, nb::handle x, nb::handle p, bool sparse) {
        return jacobian(g, x, p, sparse ? Form::kSparse : Form::kDense);
      },
      nb::arg("x"), nb::arg("p") = nb::none(), nb::kw_only(), nb::arg("sparse") = false,
      nb::sig("def jacobian(self, x: ArrayLike, p: ArrayLike | None = None, *, sparse: bool = False) -> Any"),
      "dy/dx: (..., shape of y, n_x); sparse=True: a scipy.sparse.csr_array (n_y, n_x), of one state.\n\n"
      ">>> dyntape.record(lambda x: x * x, 2).jacobian([1.0, 2.0])\n"
      "array([[2., 0.],\n"
      "       [0., 4.]])");
  f.def(
      "hessian",
      [](const F& g, nb::handle x, nb::handle p, nb::handle weights, bool sparse) {
        return hessian(g, x, p, weights, sparse ? Form::kSparse : Form::kDense);
      },
      nb::arg("x"), nb::arg("p") = nb::none(), nb::arg("weights") = nb::none(), nb::kw_only(),
      nb::arg("sparse") = false,
      nb::sig(
          "def hessian(self, x: ArrayLike, p: ArrayLike | None = None, weights: ArrayLike | None = None, *, "
          "sparse: bool = False) -> Any"),
      "sum_i weights_i d2y_i/dx2, both triangles: (..., n_x, n_x); sparse=True: a scipy.sparse.csr_array, of "
      "one\n"
      "state.  weights: (..., n_y), y in C order; of a single output 1 by default.\n\n"
      ">>> dyntape.record(lambda x: x[0] ** 2 * x[1], 2).hessian([1.0, 2.0])\n"
      "array([[4., 2.],\n"
      "       [2., 0.]])");
  f.def(
      "jacobian_values",
      [](const F& g, nb::handle x, nb::handle p) { return jacobian(g, x, p, Form::kValues); }, nb::arg("x"),
      nb::arg("p") = nb::none(),
      nb::sig("def jacobian_values(self, x: ArrayLike, p: ArrayLike | None = None) -> Array"),
      "(..., nnz) the non-zeros of dy/dx, in the order of jacobian_pattern.");
  f.def(
      "hessian_values",
      [](const F& g, nb::handle x, nb::handle p, nb::handle weights) {
        return hessian(g, x, p, weights, Form::kValues);
      },
      nb::arg("x"), nb::arg("p") = nb::none(), nb::arg("weights") = nb::none(),
      nb::sig("def hessian_values(self, x: ArrayLike, p: ArrayLike | None = None, weights: ArrayLike | None "
              "= None) "
              "-> Array"),
      "(..., nnz) the non-zeros of the Hessian's lower triangle, in the order of hessian_pattern.");
}

void bind_function_facts(nb::class_<RecordedFunction>& f) {
  f.def_prop_ro(
      "name", [](const RecordedFunction& g) { return g.function.name; }, "Its name, in messages and in C.");
  f.def_prop_ro("n_x", &RecordedFunction::n_x, "Number of variables.");
  f.def_prop_ro("n_p", &RecordedFunction::n_p, "Number of parameters.");
  f.def_prop_ro("n_y", &RecordedFunction::n_y, "Number of outputs.");
  f.def_prop_ro(
      "shape", [](const RecordedFunction& g) { return nb::tuple(nb::cast(g.y_shape)); },
      nb::sig("def shape(self) -> tuple[int, ...]"), "Shape of one value.");
  f.def_prop_ro(
      "is_compiled", [](const RecordedFunction& g) { return g.compiled() != nullptr; },
      "Whether machine code or compiled code serves.");
  f.def_prop_ro(
      "operations", [](const RecordedFunction& g) { return total_operations(g.function); },
      "Operations of one value.");
  f.def_prop_ro(
      "content_hash", [](const RecordedFunction& g) { return content_hash(g.function); },
      "32 hexadecimal digits of what it computes; names do not enter.");
  f.def(
      "to_text", [](const RecordedFunction& g) { return to_text(g.function); },
      "What was recorded, a line an operation.");
  f.def("__repr__", summary);
  f.def(
      "_repr_html_",
      [](nb::handle self) { return nb::module_::import_("dyntape._pictures").attr("function_page")(self); },
      "Sizes, and a picture of the non-zeros of the derivatives.");
  f.def(
      "__eq__",
      [](const RecordedFunction& a, nb::handle b) {
        return nb::isinstance<RecordedFunction>(b) &&
               content_hash(a.function) == content_hash(nb::cast<const RecordedFunction&>(b).function);
      },
      nb::arg("other").none(), nb::sig("def __eq__(self, other: object, /) -> bool"),
      "Whether both compute the same: equal content_hash.");
  f.def("__hash__", [](const RecordedFunction& g) { return nb::hash(nb::cast(content_hash(g.function))); });
}

}  // namespace

RecordedFunction::RecordedFunction(Function recorded, Shape shape)
    : function(std::move(recorded)), y_shape(std::move(shape)) {}

std::shared_ptr<Kernels> RecordedFunction::made_kernels(Order order) const {
  const std::scoped_lock lock(mutex_);
  if (compiled_ && compiled_->function.order() >= order) return compiled_;
  return interpreted_[static_cast<int>(order)];
}

std::shared_ptr<Kernels> RecordedFunction::kernels(Order order) const {
  if (auto made = made_kernels(order)) return made;
  CodegenOptions options;
  options.order = order;
  options.route = Route::kInterpreter;
  auto made = std::make_shared<Kernels>(CompiledFunction::make(function, options));
  const std::scoped_lock lock(mutex_);
  auto& place = interpreted_[static_cast<int>(order)];
  if (!place) place = std::move(made);
  return place;
}

std::shared_ptr<Kernels> kernels_of(const RecordedFunction& f, Order order) {
  if (auto made = f.made_kernels(order)) return made;
  return left_alone(nb::find(f), [&f, order](const std::stop_token&) { return f.kernels(order); });
}

void RecordedFunction::compile(const CodegenOptions& options) {
  auto made = std::make_shared<Kernels>(CompiledFunction::make(function, options));
  const std::scoped_lock lock(mutex_);
  compiled_ = std::move(made);
}

// What asks for sizes and patterns asks the interpreter's.
void RecordedFunction::compile_for(const DeviceRunOptions& how, CodegenOptions options) {
  std::optional<DeviceFunction> device = DeviceFunction::make(function, options, how);
  options.route = Route::kInterpreter;
  auto made = std::make_shared<Kernels>(CompiledFunction::make(function, options), std::move(device));
  const std::scoped_lock lock(mutex_);
  compiled_ = std::move(made);
}

std::shared_ptr<Kernels> RecordedFunction::compiled() const {
  const std::scoped_lock lock(mutex_);
  return compiled_;
}

std::shared_ptr<const Callee> RecordedFunction::callee() const {
  const std::scoped_lock lock(mutex_);
  if (!callee_) callee_ = dissolving_callee(n_p() > 0 ? all_as_variables(function) : function);
  return callee_;
}

void bind_functions(nb::module_& module) {
  nb::class_<RecordedFunction> f(
      module, "Function",
      "A recorded function with its exact derivatives, made by `dyntape.record`.\n\n"
      "f(x, p), f.jacobian(x, p), f.hessian(x, p, weights); the leading axes of arguments are batch axes.  "
      "Called with\n"
      "recorded values it becomes part of their recording.  Interpreted until `compile` has run; the bits "
      "are the same.\n"
      "Any number of threads may use it.");
  f.def("__call__", call_function, nb::arg("x"), nb::arg("p") = nb::none(),
        nb::sig("def __call__(self, x: ArrayLike, p: ArrayLike | None = None) -> Array"),
        "The value: x (..., n_x), p (..., n_p); returns (...) + the shape that the Python function "
        "returned.\n\n"
        "Raises ArgumentError for wrong shapes, and GuardViolation, with file and line, where a branch that "
        "was\n"
        "recorded is left.");
  bind_derivatives(f);
  bind_function_state(f);
  bind_casadi(f);
  f.def_prop_ro(
      "jacobian_pattern", [](const RecordedFunction& g) { return pattern_of(g, Order::kFirst); },
      nb::sig("def jacobian_pattern(self) -> tuple[IntArray, IntArray]"),
      "Rows and columns of the Jacobian's non-zeros, sorted by row; y counts in C order.");
  f.def_prop_ro(
      "hessian_pattern", [](const RecordedFunction& g) { return pattern_of(g, Order::kSecond); },
      nb::sig("def hessian_pattern(self) -> tuple[IntArray, IntArray]"),
      "Rows and columns of the non-zeros of the Hessian's lower triangle.");
  f.def(
      "compile", compile, nb::arg("order") = 2, nb::kw_only(), nb::arg("route") = "tiered",
      nb::arg("lanes") = true, nb::arg("functions") = to_string(kDefaultFunctions),
      nb::arg("flags") = std::vector<std::string>(), nb::arg("device") = nb::none(),
      nb::arg("single") = false,
      nb::sig("def compile(self, order: int = 2, *, route: str = 'tiered', lanes: bool = True, "
              "functions: str = 'sines', flags: Sequence[str] = (), device: str | None = None, "
              "single: bool = False) -> Function"),
      "Compiles value and derivatives up to `order`, or takes them from the cache; returns the function "
      "itself.\n\n"
      "route: \"tiered\": machine code within milliseconds, and compiled C as soon as the compiler has "
      "finished;\n"
      "    \"machine-code\": without a compiler; \"compiled\": waits for the compiler.  All have the same "
      "bits.\n"
      "lanes: also compiles kernels of several states per SIMD instruction, which batches take; False halves "
      "the time of the\n"
      "    compiler.\n"
      "functions: \"sines\": dyntape's sine and cosine, the C library's others; \"libm\": all of the C "
      "library;\n"
      "    \"portable\": the same bits on every processor, fastest in lanes.\n"
      "flags: for the C compiler.\n"
      "device: \"opencl:0\", the first of `dyntape.devices()`, evaluates batches; route, lanes and flags are "
      "ignored.\n"
      "single: the device computes in float.\n\n"
      "Raises ToolError if the compiler fails with route \"compiled\"; the function is then interpreted.");
  bind_function_facts(f);
  bind_devices(module);
  module.def(
      "record", record_function, nb::arg("f"), nb::arg("n_x"), nb::arg("n_p") = 0, nb::kw_only(),
      nb::arg("name") = nb::none(), nb::arg("x0") = std::vector<double>(),
      nb::arg("p0") = std::vector<double>(), nb::arg("branches") = "guard",
      nb::sig("def record(f: Callable[..., Any], n_x: int, n_p: int = 0, *, name: str | None = None, "
              "x0: Sequence[float] = (), p0: Sequence[float] = (), branches: str = 'guard') -> Function"),
      "Runs f once on recorded values and keeps what it did.\n\n"
      "f: takes x (n_x,), and p (n_p,) where n_p > 0, as arrays of recorded values, with which numpy "
      "computes;\n"
      "   returns a value or an array of any shape.  Derivatives are taken by x, never by p.\n"
      "x0, p0: the recording point, which decides which branch an `if` takes; by default in (0.3, 1.1).\n"
      "branches: \"guard\", evaluations that leave the branch raise GuardViolation; or \"error\", an `if` on "
      "a\n"
      "   recorded value raises RecordingError at once.  `dyntape.where` leaves no guard.\n\n"
      "What f raises passes through.\n\n"
      ">>> f = dyntape.record(lambda x, p: p[0] * np.sin(x[0]) * x[1], 2, 1)\n"
      ">>> f.jacobian([0.0, 3.0], [2.0])\n"
      "array([6., 0.])");
}

}  // namespace dyntape::python
