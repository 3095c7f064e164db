// SPDX-License-Identifier: BSD-3-Clause
//
// Every function of the robot table as a method, made from the table: robot.rnea(q, v, a), robot.crba(q), ...
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <deque>
#include <utility>

#include <dyntape/autodiff/error.h>

#include "../recorded_arrays.h"
#include "../robot.h"

namespace dyntape::python {
namespace {

std::string python_name(std::string name) {
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

// "id-derivatives" -> "IdDerivatives".
std::string type_name(const std::string& name) {
  std::string result;
  bool upper = true;
  for (const char c : name) {
    if (c != '-') result += upper ? static_cast<char>(std::toupper(c)) : c;
    upper = c == '-';
  }
  return result;
}

// A row of the table, as Python sees it.
struct Method {
  int row = 0;
  const char* name = nullptr;       // as Python spells it
  std::vector<const char*> inputs;  // "q", "v", ...
  bool has_frame = false, has_contacts = false;
  PyTypeObject* results = nullptr;  // a named tuple, where there are several
};

// What the caller chose besides the state; null: not given.
struct Choice {
  nb::handle route, device, single, frame, axes, contacts;
};

bool is_given(nb::handle given) { return given.is_valid() && !given.is_none(); }
bool is_true(nb::handle given) { return is_given(given) && PyObject_IsTrue(given.ptr()) == 1; }

RobotCall chosen(const Method& method, const Choice& choice, bool many) {
  RobotCall call{.row = method.row};
  if (is_given(choice.device)) {
    if (is_given(choice.route))
      throw ArgumentError(std::string(method.name) +
                          ": a route is the processor's; expected route or device, got both");
    call.device = {text_of(choice.device, "device"), is_true(choice.single)};
  } else {
    if (is_true(choice.single))
      throw ArgumentError(std::string(method.name) + ": single: expected a device, got none");
    call.many = many;
    call.route = is_given(choice.route) ? text_of(choice.route, "route") : default_word(many);
  }
  if (is_given(choice.frame)) call.frame = text_of(choice.frame, "frame");
  if (is_given(choice.axes)) call.axes = text_of(choice.axes, "axes");
  if (is_given(choice.contacts)) {
    for (nb::handle contact : choice.contacts) call.contacts.push_back(text_of(contact, "contacts"));
  }
  return call;
}

bool is_default(const Choice& choice) {
  return !is_given(choice.route) && !is_given(choice.device) && !is_true(choice.single) &&
         !is_given(choice.frame) && !is_given(choice.axes) && !is_given(choice.contacts);
}

nb::object named(const Method& method, std::size_t n, const auto& block) {
  if (n == 1) return block(0);
  PyObject* tuple = PyStructSequence_New(method.results);
  if (!tuple) nb::raise_python_error();
  for (std::size_t i = 0; i < n; ++i)
    PyStructSequence_SetItem(tuple, static_cast<Py_ssize_t>(i), block(i).release().ptr());
  return nb::steal(tuple);
}

std::size_t entries_of(const Robot& robot, const char* input) {
  return static_cast<std::size_t>(std::string_view(input) == "q" ? robot.nq : robot.nv);
}

// Inside a recording: the function becomes part of it.
nb::object record_call(const Robot& robot, const Method& method, const nb::handle* arguments,
                       const Choice& choice) {
  if (is_given(choice.route) || is_given(choice.device))
    throw ArgumentError(std::string(method.name) + ": a " + (is_given(choice.route) ? "route" : "device") +
                        " is for numbers; in a recording the function is recorded");
  const RobotFunction function = robot.function(chosen(method, choice, false));
  VectorXad state(0);
  for (std::size_t i = 0; i < method.inputs.size(); ++i) {
    const auto entries = static_cast<Eigen::Index>(entries_of(robot, method.inputs[i]));
    const Eigen::Index before = state.size();
    state.conservativeResize(before + entries);
    state.tail(entries) =
        recorded_vector(arguments[i], std::string(method.name) + ": " + method.inputs[i], entries);
  }
  const VectorXad y = record_in_place(robot, function, state);
  const std::vector<Block> blocks = blocks_of(robot.model(), function);
  std::vector<nb::object> results;
  const AD* from = y.data();
  for (const Block& block : blocks) {
    results.push_back(recorded_array(from, block.shape));
    from += block.size();
  }
  return named(method, results.size(), [&](std::size_t i) { return results[i]; });
}

nb::object call(const Robot& robot, const Method& method, const nb::handle* arguments, const Choice& choice) {
  const std::size_t n = method.inputs.size();
  if (std::any_of(arguments, arguments + n, holds_objects))
    return record_call(robot, method, arguments, choice);
  Rows rows(method.name);
  for (std::size_t i = 0; i < n; ++i)
    rows.add(arguments[i], method.inputs[i], entries_of(robot, method.inputs[i]));
  const bool many = !rows.is_single();
  std::shared_ptr<RobotPath> owner;
  RobotPath* route = nullptr;
  if (is_default(choice)) {
    route = &robot.default_route(method.row, many);
  } else {
    owner = robot.route(chosen(method, choice, many));
    route = owner.get();
  }
  const Result result(rows, route->blocks);
  evaluate(*route, rows, result.data());
  return named(method, route->blocks.size(), [&](std::size_t i) { return result.block(i); });
}

// --- What is said of a method: signature and docstring ----------------------------------------------------

std::string result_type(const Method& method, const std::vector<RobotBlock>& outputs) {
  return outputs.size() == 1 ? "Array" : type_name(to_string(robot_functions()[std::size_t(method.row)]));
}

std::string signature(const Method& method, const std::vector<RobotBlock>& outputs) {
  std::string text = std::string("def ") + method.name + "(self";
  for (const char* input : method.inputs) text += std::string(", ") + input + ": ArrayLike";
  text += ", *, route: str | None = None, device: str | None = None, single: bool = False";
  if (method.has_frame) text += ", frame: str | None = None, axes: str | None = None";
  if (method.has_contacts) text += ", contacts: Sequence[str] | None = None";
  return text + ") -> " + result_type(method, outputs);
}

// "(..., nv, nv)".
std::string python_shape(const std::string& shape) {
  std::string text = "(...";
  for (const std::string& extent : extents_of(shape)) {
    const std::size_t blank = extent.find(' ');
    text +=
        ", " + (blank == extent.npos ? extent : extent.substr(0, blank) + " * " + extent.substr(blank + 1));
  }
  return text + ")";
}

std::string field_name(const RobotBlock& output) {
  return output.name == "lambda" ? "lambda_" : output.name;  // a word of Python
}

// >>> dtau_dq, dtau_dv, dtau_da = robot.id_derivatives(q, v, a)
std::string example(const Method& method, const std::vector<RobotBlock>& outputs) {
  std::string results, arguments;
  for (const RobotBlock& output : outputs) results += (results.empty() ? "" : ", ") + field_name(output);
  for (const char* input : method.inputs) arguments += (arguments.empty() ? "" : ", ") + std::string(input);
  return ">>> " + results + " = robot." + method.name + "(" + arguments + ")";
}

std::string documentation(const Method& method, const RobotFunction& function,
                          const std::vector<RobotBlock>& outputs) {
  std::string text = description(function);
  text[0] = static_cast<char>(std::toupper(text[0]));
  text += ".\n\n";
  for (const char* input : method.inputs)
    text += std::string(input) + ": (..., " + (std::string_view(input) == "q" ? "nq" : "nv") + ")\n";
  text += "Returns";
  for (const RobotBlock& output : outputs)
    text += (&output == &outputs.front() ? " " : ", ") + output.name + " " + python_shape(output.shape);
  text +=
      ".\n\nroute: \"analytic\", plain double code; \"lanes\", the same several states at a time, and as "
      "machine "
      "code after "
      "some thousand states; \"tape\", the recorded value, interpreted; \"generated\", compiled C";
  if (is_derivative(function)) text += "; \"fd-forward\", \"fd-central\", differences of the value";
  text +=
      ".  By default \"analytic\" for one state and \"lanes\" for batches.\n"
      "device: \"opencl:0\", the first of `dyntape.devices()`, in place of a route: for batches of "
      "thousands.  single: it\n   computes in float.\n";
  if (method.has_frame)
    text +=
        "frame: its name, by default the last.  axes: \"local\", \"world\" or \"aligned\", the world's axes "
        "at "
        "the frame.\n";
  if (method.has_contacts) text += "contacts: frames whose origins are held, by default that of `frame`.\n";
  return text +
         "\nOf values that are recorded, the function becomes part of the recording.\n"
         "Raises ArgumentError for wrong shapes and names, ToolError for a device that is not there" +
         (is_forward(function) ? ", NumericalError for a robot without inertia about a joint.\n\n"
                               : ".\n\n") +
         example(method, outputs);
}

// A named tuple that can be pickled: Python finds it in the module by its name.
PyTypeObject* results_type(nb::module_& module, const RobotFunction& function,
                           const std::vector<RobotBlock>& outputs) {
  const std::string name = type_name(to_string(function));
  std::vector<PyStructSequence_Field> fields;
  std::string what = std::string("Results of ") + python_name(to_string(function)) + ":";
  for (const RobotBlock& output : outputs) {
    fields.push_back({kept(field_name(output)), kept(python_shape(output.shape))});
    what += " " + output.name + " " + python_shape(output.shape) + (&output == &outputs.back() ? "." : ",");
  }
  fields.push_back({nullptr, nullptr});
  PyStructSequence_Desc description{kept("dyntape._dyntape." + name), kept(what), fields.data(),
                                    static_cast<int>(outputs.size())};
  PyTypeObject* type = PyStructSequence_NewType(&description);
  if (!type) nb::raise_python_error();
  module.attr(name.c_str()) = nb::handle(reinterpret_cast<PyObject*>(type));
  return type;
}

template <std::size_t>
using Handle = nb::handle;

// nanobind wants the number of arguments when it is compiled.
template <std::size_t... I>
void define(nb::class_<Robot>& robot, const Method& method, const char* signature, const char* what,
            std::index_sequence<I...>) {
  const Method* m = &method;
  const auto sig = nb::sig(signature);
  if (method.has_contacts) {
    robot.def(
        method.name,
        [m](const Robot& self, Handle<I>... state, nb::handle route, nb::handle device, nb::handle single,
            nb::handle frame, nb::handle axes, nb::handle contacts) {
          const nb::handle arguments[] = {state...};
          return call(self, *m, arguments, {route, device, single, frame, axes, contacts});
        },
        nb::arg(method.inputs[I])..., nb::kw_only(), nb::arg("route") = nb::none(),
        nb::arg("device") = nb::none(), nb::arg("single") = false, nb::arg("frame") = nb::none(),
        nb::arg("axes") = nb::none(), nb::arg("contacts") = nb::none(), sig, what);
  } else if (method.has_frame) {
    robot.def(
        method.name,
        [m](const Robot& self, Handle<I>... state, nb::handle route, nb::handle device, nb::handle single,
            nb::handle frame, nb::handle axes) {
          const nb::handle arguments[] = {state...};
          return call(self, *m, arguments, {route, device, single, frame, axes, {}});
        },
        nb::arg(method.inputs[I])..., nb::kw_only(), nb::arg("route") = nb::none(),
        nb::arg("device") = nb::none(), nb::arg("single") = false, nb::arg("frame") = nb::none(),
        nb::arg("axes") = nb::none(), sig, what);
  } else {
    robot.def(
        method.name,
        [m](const Robot& self, Handle<I>... state, nb::handle route, nb::handle device, nb::handle single) {
          const nb::handle arguments[] = {state...};
          return call(self, *m, arguments, {route, device, single, {}, {}, {}});
        },
        nb::arg(method.inputs[I])..., nb::kw_only(), nb::arg("route") = nb::none(),
        nb::arg("device") = nb::none(), nb::arg("single") = false, sig, what);
  }
}

void define(nb::class_<Robot>& robot, const Method& method, const char* signature, const char* what) {
  switch (method.inputs.size()) {
    case 1:
      return define(robot, method, signature, what, std::make_index_sequence<1>());
    case 2:
      return define(robot, method, signature, what, std::make_index_sequence<2>());
    case 3:
      return define(robot, method, signature, what, std::make_index_sequence<3>());
    case 4:
      return define(robot, method, signature, what, std::make_index_sequence<4>());
  }
  throw ArgumentError(std::string(method.name) + ": a row of the table takes 1 to 4 inputs");
}

}  // namespace

void bind_robot_methods(nb::module_& module, nb::class_<Robot>& robot) {
  static std::deque<Method> methods;
  const dynamics::Model<double> none;
  for (const RobotFunction& function : robot_functions()) {
    Method& method = methods.emplace_back();
    method.row = function.row();
    method.name = kept(python_name(to_string(function)));
    for (const RobotBlock& input : inputs(none, function)) method.inputs.push_back(kept(input.name));
    method.has_frame = takes_frame(function);
    method.has_contacts = takes_contacts(function);
    const std::vector<RobotBlock> results = outputs(none, function);
    if (results.size() > 1) method.results = results_type(module, function, results);
    define(robot, method, kept(signature(method, results)), kept(documentation(method, function, results)));
  }
  robot.def(
      "inputs",
      [](const Robot& self, const std::string& function) {
        nb::dict entries;
        for (const Method& method : methods) {
          if (function != method.name) continue;
          for (const char* input : method.inputs) entries[input] = entries_of(self, input);
          return entries;
        }
        throw ArgumentError("inputs: no function of a robot is called \"" + function + "\"");
      },
      nb::arg("function"), nb::sig("def inputs(self, function: str) -> dict[str, int]"),
      "What a function of this robot takes, in order: the names of its arguments and their entries.\n\n"
      "function: the name of the method.\n\n"
      "Raises ArgumentError where no function has this name.\n\n"
      ">>> robot.inputs(\"aba\")\n"
      "{'q': 7, 'v': 7, 'tau': 7}");
}

}  // namespace dyntape::python
