// SPDX-License-Identifier: BSD-3-Clause
#include "arrays.h"

#define DYNTAPE_IMPORTS_NUMPY
#include "numpy_api.h"

#include <algorithm>
#include <cstring>
#include <deque>
#include <string_view>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/run/threads.h>

#include "watch.h"

namespace dyntape::python {
namespace {

PyArrayObject* array_of(nb::handle object) { return reinterpret_cast<PyArrayObject*>(object.ptr()); }

// Throws for arrays whose numbers are not what their owner means: bools, and entries that a mask hides.
void refuse_what_is_no_number(nb::handle given, const std::string& what) {
  bool holds_bools = PyArray_Check(given.ptr()) && PyArray_TYPE(array_of(given)) == NPY_BOOL;
  if (PyList_Check(given.ptr()) || PyTuple_Check(given.ptr())) {
    for (nb::handle entry : given) holds_bools = holds_bools || PyBool_Check(entry.ptr());
  }
  if (holds_bools)
    throw ArgumentError(what + ": expected numbers, got bools; write np.asarray(a, dtype=float)");
  if (!PyArray_Check(given.ptr())) return;
  if (!PyArray_CheckExact(given.ptr()) && nb::hasattr(given, "mask") &&
      nb::cast<bool>(nb::module_::import_("numpy").attr("any")(given.attr("mask")).attr("item")()))
    throw ArgumentError(what + ": a masked array has entries without a number; write a.filled(number)");
}

// The letter that numpy has for the kind of what an array of it would hold: 'c' for complex numbers; '?' where it makes none.
char kind_of(nb::handle given) {
  PyObject* const made = PyArray_FROM_O(given.ptr());
  if (!made) PyErr_Clear();
  const nb::object array = nb::steal(made);
  return made ? PyArray_DESCR(array_of(array))->kind : '?';
}

// numpy's error at hand, with the name of the argument before its first line.
[[noreturn]] void raise_with_name(nb::handle given, const std::string& what) {
  const nb::python_error error;  // takes the error
  if (!error.matches(PyExc_ValueError) && !error.matches(PyExc_TypeError)) throw error;
  const std::string head = what + ": expected an array of numbers";
  switch (kind_of(given)) {
    case 'c':
      throw ArgumentError(head + ", got complex ones; write a.real");
    case 'U':
    case 'S':
      throw ArgumentError(head + ", got text");
    default:
      break;
  }
  std::string text = nb::cast<std::string>(nb::str(error.value()));
  text = text.substr(0, text.find('\n'));
  constexpr std::string_view kCast = "Cannot cast array data from ";
  if (text.starts_with(
          kCast))  // "Cannot cast array data from dtype('V8') to dtype('float64') according to the rule 'safe'"
    text = "got one of " + text.substr(kCast.size(), text.find(" to dtype") - kCast.size());
  throw ArgumentError(head + ": " + text);
}

// Whether a tensor lies in the memory of a card, by DLPack's number of its device or by CUDA's interface.
bool is_on_card(nb::handle tensor) {
  constexpr long kProcessor = 1, kPinnedByCuda = 3, kPinnedByRocm = 11;
  if (!nb::hasattr(tensor, "__dlpack_device__")) return nb::hasattr(tensor, "__cuda_array_interface__");
  const long kind = nb::cast<long>(nb::int_(tensor.attr("__dlpack_device__")()[0]));
  return kind != kProcessor && kind != kPinnedByCuda && kind != kPinnedByRocm;
}

// Tensors of other libraries as numpy reads them: those of the processor as they are, those of a card by their own copy.
nb::object readable(nb::handle given, const std::string& what) {
  const bool is_tensor = !PyArray_Check(given.ptr()) &&
                         (nb::hasattr(given, "__dlpack__") || nb::hasattr(given, "__cuda_array_interface__"));
  if (!is_tensor) return nb::borrow(given);
  if (nb::hasattr(given, "requires_grad") && given.attr("requires_grad").is(Py_True))
    throw ArgumentError(what +
                        ": the tensor requires a gradient, which numbers do not carry; expected "
                        "tensor.detach(), or a function of dyntape.bridges.torch");
  if (is_on_card(given)) {
    for (const char* copy : {"cpu", "get", "copy_to_host"})  // PyTorch's, CuPy's, Numba's
      if (nb::hasattr(given, copy)) return given.attr(copy)();
  }
  if (nb::hasattr(given, "__array__")) return nb::borrow(given);
  return nb::module_::import_("numpy").attr("from_dlpack")(given);
}

// A float64 array, aligned and of this machine's byte order.
nb::object converted(nb::handle object, const std::string& what, int requirements) {
  nb::object given = readable(object, what);
  refuse_what_is_no_number(given, what);
  if (!PyArray_Check(
          given.ptr())) {  // its own type first: numpy drops the imaginary parts of entries for float64
    PyObject* const own = PyArray_FROM_O(given.ptr());
    if (!own) raise_with_name(given, what);
    given = nb::steal(own);
    refuse_what_is_no_number(given, what);  // nested lists of bools
  }
  if (PyArray_Check(given.ptr()) && PyArray_TYPE(array_of(given)) == NPY_OBJECT)
    requirements |= NPY_ARRAY_FORCECAST;  // of numbers: holds_objects()
  PyObject* made =
      PyArray_FROM_OTF(given.ptr(), NPY_DOUBLE, NPY_ARRAY_ALIGNED | NPY_ARRAY_NOTSWAPPED | requirements);
  if (!made) raise_with_name(given, what);
  return nb::steal(made);
}

// `what`: makes the name of the argument.
template <class What>
nb::object as_float64(nb::handle given, const What& what, int requirements = 0) {
  if (PyArray_CheckExact(given.ptr()) && PyArray_TYPE(array_of(given)) == NPY_DOUBLE &&
      PyArray_ISBEHAVED_RO(array_of(given)) &&
      (!(requirements & NPY_ARRAY_C_CONTIGUOUS) || PyArray_IS_C_CONTIGUOUS(array_of(given))))
    return nb::borrow(given);
  return converted(given, what(), requirements);
}

std::size_t product(const std::ptrdiff_t* shape, std::size_t n) {
  std::size_t size = 1;
  for (std::size_t i = 0; i < n; ++i) size *= static_cast<std::size_t>(shape[i]);
  return size;
}

}  // namespace

const char* kept(std::string text) {
  static std::deque<std::string> texts;
  return texts.emplace_back(std::move(text)).c_str();
}

std::string text_of(nb::handle given, const std::string& what) {
  if (PyUnicode_Check(given.ptr())) return nb::cast<std::string>(given);
  const std::string sentence =
      what + ": expected a str, got " + nb::cast<std::string>(nb::repr(given.type()));
  throw nb::type_error(sentence.c_str());
}

std::string in_notebook(const std::string& page) {
  return nb::cast<std::string>(nb::module_::import_("dyntape._pictures").attr("frame")(page));
}

nb::object pictures_of(nb::handle result) {
  return nb::module_::import_("dyntape._pictures").attr("pictures_of")(result);
}

void import_numpy() {
  if (_import_array() < 0) nb::raise_python_error();
}

std::string shape_text(const std::ptrdiff_t* shape, std::size_t n) {
  std::string text = "(";
  for (std::size_t i = 0; i < n; ++i) text += (i > 0 ? ", " : "") + std::to_string(shape[i]);
  return text + (n == 1 ? ",)" : ")");
}

bool holds_objects(nb::handle given) {
  const auto is_number = [](nb::handle entry) {
    return PyFloat_Check(entry.ptr()) || PyLong_Check(entry.ptr()) ||
           (PyArray_CheckScalar(entry.ptr()) && !PyArray_IsScalar(entry.ptr(), ComplexFloating));
  };
  if (PyArray_Check(given.ptr())) {
    if (PyArray_TYPE(array_of(given)) != NPY_OBJECT) return false;
    for (nb::handle entry : nb::object(given.attr("flat")))
      if (!is_number(entry)) return true;
    return false;
  }
  if (!PyList_Check(given.ptr()) && !PyTuple_Check(given.ptr())) return false;
  const auto is_refused_by_name = [](nb::handle entry) {  // raise_with_name()
    return PyComplex_Check(entry.ptr()) || PyArray_IsScalar(entry.ptr(), ComplexFloating) ||
           PyUnicode_Check(entry.ptr()) || PyBytes_Check(entry.ptr());
  };
  for (nb::handle entry : given)
    if (!is_number(entry) && !is_refused_by_name(entry) && !PyList_Check(entry.ptr()) &&
        !PyTuple_Check(entry.ptr()))
      return true;
  return false;
}

std::size_t Numbers::size() const { return product(shape.data(), shape.size()); }

namespace {

// A sequence or array of objects, one of which is None.
bool holds_none(nb::handle given) {
  const nb::object entries =
      PyArray_Check(given.ptr()) ? nb::object(given.attr("flat")) : nb::borrow<nb::object>(given);
  for (nb::handle entry : entries)
    if (entry.is_none()) return true;
  return false;
}

}  // namespace

Numbers numbers(nb::handle given, const std::string& what) {
  Numbers result;
  if (holds_objects(given))
    throw ArgumentError(
        what + ": expected numbers, got " +
        (holds_none(given) ? "None among them; NaN is an entry that is free" : "an array of Python objects"));
  result.array = as_float64(
      given, [&] { return what; }, NPY_ARRAY_C_CONTIGUOUS);
  PyArrayObject* array = array_of(result.array);
  result.data = static_cast<const double*>(PyArray_DATA(array));
  result.shape.assign(PyArray_DIMS(array), PyArray_DIMS(array) + PyArray_NDIM(array));
  return result;
}

Numbers numbers(nb::handle given, const std::string& what, const Shape& expected) {
  Numbers result = numbers(given, what);
  bool fits = result.shape.size() == expected.size();
  for (std::size_t i = 0; fits && i < expected.size(); ++i)
    fits = expected[i] < 0 || expected[i] == result.shape[i];
  if (fits) return result;
  std::string wanted = shape_text(expected);
  for (std::size_t at; (at = wanted.find("-1")) != wanted.npos;) wanted.replace(at, 2, "any");
  throw ArgumentError(what + ": expected an array of shape " + wanted + ", got " + shape_text(result.shape));
}

nb::object new_array(const Shape& shape, double*& data) {
  PyObject* made = PyArray_SimpleNew(static_cast<int>(shape.size()), shape.data(), NPY_DOUBLE);
  if (!made) nb::raise_python_error();
  data = static_cast<double*>(PyArray_DATA(reinterpret_cast<PyArrayObject*>(made)));
  return nb::steal(made);
}

nb::object copy_of(const double* from, const Shape& shape) {
  double* data = nullptr;
  nb::object array = new_array(shape, data);
  std::copy_n(from, product(shape.data(), shape.size()), data);
  return array;
}

nb::object new_integers(const std::vector<std::ptrdiff_t>& values) {
  const npy_intp n = static_cast<npy_intp>(values.size());
  PyObject* made = PyArray_SimpleNew(1, &n, NPY_INTP);
  if (!made) nb::raise_python_error();
  std::copy(values.begin(), values.end(),
            static_cast<npy_intp*>(PyArray_DATA(reinterpret_cast<PyArrayObject*>(made))));
  return nb::steal(made);
}

void Rows::check_shape(const Argument& argument) const {
  PyArrayObject* array = array_of(argument.array);
  if (argument.axes < 0 || PyArray_DIM(array, argument.axes) != static_cast<npy_intp>(argument.entries))
    throw ArgumentError(std::string(function_) + ": expected " + argument.name + " of shape (..., " +
                        std::to_string(argument.entries) + "), got " +
                        shape_text(PyArray_DIMS(array), static_cast<std::size_t>(PyArray_NDIM(array))));
  if (argument.axes > kMostAxes)
    throw ArgumentError(std::string(function_) + ": " + argument.name + " has " +
                        std::to_string(argument.axes) + " batch axes; expected at most " +
                        std::to_string(kMostAxes));
}

void Rows::add(nb::handle given, const char* name, std::size_t entries) {
  Argument& argument = arguments_[n_];
  argument.name = name;
  argument.entries = entries;
  argument.array = as_float64(given, [&] { return std::string(function_) + ": " + name; });
  PyArrayObject* array = array_of(argument.array);
  argument.data = PyArray_BYTES(array);
  argument.axes = PyArray_NDIM(array) - 1;
  check_shape(argument);
  argument.stride = PyArray_STRIDE(array, argument.axes);
  std::copy_n(PyArray_DIMS(array), argument.axes, argument.shape);
  ++n_;
  entries_ += entries;
  if (argument.axes > 0 || axes_ > 0) broadcast(argument);
}

// As numpy does: axes are aligned at the right, and an extent of one is repeated.
void Rows::broadcast(const Argument& last) {
  const int axes = std::max(axes_, last.axes);
  std::ptrdiff_t shape[kMostAxes];
  for (int k = 0; k < axes; ++k) {
    const int of_batch = k - (axes - axes_), of_last = k - (axes - last.axes);
    const std::ptrdiff_t a = of_batch < 0 ? 1 : batch_[of_batch], b = of_last < 0 ? 1 : last.shape[of_last];
    if (a != b && a != 1 && b != 1)
      throw ArgumentError(
          std::string(function_) + ": the batch axes of " + last.name + " are " +
          shape_text(last.shape, static_cast<std::size_t>(last.axes)) + ", which do not broadcast with " +
          shape_text(batch_, static_cast<std::size_t>(axes_)) + " of the arguments before it");
    shape[k] = a == 1 ? b : a;
  }
  axes_ = axes;
  std::copy_n(shape, axes, batch_);
  for (int i = 0; i < n_; ++i) {
    Argument& argument = arguments_[i];
    for (int k = 0; k < axes; ++k) {
      const int own = k - (axes - argument.axes);
      const bool moves = own >= 0 && argument.shape[own] != 1;
      argument.strides[k] = moves ? PyArray_STRIDE(array_of(argument.array), own) : 0;
    }
  }
}

std::size_t Rows::count() const { return product(batch_, static_cast<std::size_t>(axes_)); }

const double* Rows::in_place() const {
  if (n_ != 1 || !PyArray_IS_C_CONTIGUOUS(array_of(arguments_[0].array))) return nullptr;
  return reinterpret_cast<const double*>(arguments_[0].data);
}

void Rows::gather(std::size_t first, std::size_t count, double* states) const {
  std::ptrdiff_t at[kMostAxes];
  auto left = static_cast<std::ptrdiff_t>(first);
  for (int k = axes_; k-- > 0; left /= batch_[k]) at[k] = left % batch_[k];
  for (std::size_t i = 0; i < count; ++i) {
    for (int n = 0; n < n_; ++n) {
      const Argument& argument = arguments_[n];
      const char* from = argument.data;
      for (int k = 0; k < axes_; ++k) from += at[k] * argument.strides[k];
      if (argument.stride == sizeof(double)) {
        std::memcpy(states, from, argument.entries * sizeof(double));
      } else {
        for (std::size_t e = 0; e < argument.entries; ++e)
          std::memcpy(states + e, from + static_cast<std::ptrdiff_t>(e) * argument.stride, sizeof(double));
      }
      states += argument.entries;
    }
    for (int k = axes_; k-- > 0 && ++at[k] == batch_[k];) at[k] = 0;
  }
}

void for_chunks(const Rows& rows, const ChunkBody& body) {
  constexpr std::size_t kChunk =
      128;  // a multiple of all lanes, and long enough that nobody notices the hand-over
  constexpr std::size_t kBriefChunks = 16;  // which end before anybody could press a key
  const std::size_t all = rows.count(), n_in = rows.entries();
  if (all == 0) return;
  const double* in_place = rows.in_place();
  const auto chunk = [&](std::size_t k) {
    const std::size_t first = k * kChunk, count = std::min(kChunk, all - first);
    if (in_place) return body(first, count, in_place + first * n_in);
    thread_local std::vector<double> states;
    states.resize(std::max(states.size(), count * n_in));
    rows.gather(first, count, states.data());
    body(first, count, states.data());
  };
  const std::size_t chunks = (all + kChunk - 1) / kChunk;
  interruptible(chunks > kBriefChunks, [&](const std::stop_token& stop) {
    if (chunks == 1) return chunk(0);
    codegen::run_tasks(chunks, [&](std::size_t k) {
      if (!stop.stop_requested()) chunk(k);
    });
  });
}

void for_parts(const Rows& rows, std::size_t numbers, const ChunkBody& body) {
  constexpr std::size_t kPart = std::size_t{16} << 20;  // numbers
  constexpr std::size_t kTile = 1024;                   // states gathered together
  const std::size_t all = rows.count(), n_in = rows.entries();
  if (all == 0) return;
  const std::size_t most = std::max<std::size_t>(1024, kPart / std::max<std::size_t>(1, numbers));
  const double* in_place = rows.in_place();
  interruptible(true, [&](const std::stop_token& stop) {
    std::vector<double> states;
    for (std::size_t first = 0; first < all && !stop.stop_requested(); first += most) {
      const std::size_t count = std::min(most, all - first);
      if (in_place) {
        body(first, count, in_place + first * n_in);
        continue;
      }
      states.resize(count * n_in);
      codegen::run_tasks((count + kTile - 1) / kTile, [&](std::size_t tile) {
        const std::size_t begin = tile * kTile;
        rows.gather(first + begin, std::min(kTile, count - begin), states.data() + begin * n_in);
      });
      body(first, count, states.data());
    }
  });
}

void for_one(const Rows& rows, const ChunkBody& body) {
  constexpr std::size_t kMost = 512;
  if (rows.entries() > kMost) return for_chunks(rows, body);
  double state[kMost];
  rows.gather(0, 1, state);
  body(0, 1, state);
}

std::size_t Block::size() const { return product(shape.data(), shape.size()); }

Result::Result(const Rows& rows, const std::vector<Block>& blocks) : rows_(rows), blocks_(blocks) {
  for (const Block& block : blocks) entries_ += block.size();
  npy_intp shape[NPY_MAXDIMS];
  int n = rows.axes();
  std::copy_n(rows.batch(), n, shape);
  if (blocks.size() == 1) {
    for (const std::ptrdiff_t extent : blocks[0].shape) shape[n++] = extent;
  } else {
    shape[n++] = static_cast<npy_intp>(entries_);
  }
  whole_ = nb::steal(PyArray_SimpleNew(n, shape, NPY_DOUBLE));
  if (!whole_.is_valid()) nb::raise_python_error();
  data_ = static_cast<double*>(PyArray_DATA(array_of(whole_)));
}

nb::object Result::block(std::size_t i) const {
  if (blocks_.size() == 1) return whole_;
  npy_intp shape[NPY_MAXDIMS], strides[NPY_MAXDIMS];
  const int axes = rows_.axes();
  int n = axes;
  std::copy_n(rows_.batch(), axes, shape);
  for (const std::ptrdiff_t extent : blocks_[i].shape) shape[n++] = extent;
  if (axes > 0) {
    std::copy_n(PyArray_STRIDES(array_of(whole_)), axes, strides);
    npy_intp step = sizeof(double);
    for (int k = n; k-- > axes; step *= shape[k]) strides[k] = step;
  }
  double* from = data_;
  for (std::size_t k = 0; k < i; ++k) from += blocks_[k].size();
  PyObject* view = PyArray_New(&PyArray_Type, n, shape, NPY_DOUBLE, axes > 0 ? strides : nullptr, from, 0,
                               NPY_ARRAY_CARRAY, nullptr);
  if (!view) nb::raise_python_error();
  Py_INCREF(whole_.ptr());
  if (PyArray_SetBaseObject(reinterpret_cast<PyArrayObject*>(view), whole_.ptr()) < 0)
    nb::raise_python_error();
  return nb::steal(view);
}

}  // namespace dyntape::python
