// SPDX-License-Identifier: BSD-3-Clause
//
// Numbers between numpy and C++: arguments whose leading axes are batch axes, and results of that shape.
//
//   Rows rows("rnea");
//   rows.add(q, "q", 7), rows.add(v, "v", 7);         // (..., 7) each; batch axes broadcast as numpy's do
//   rows.gather(first, count, states);                // count states (q, v), one after the other
//   Result y(rows, {{"tau", {7}}});                   // float64, batch shape + (7)
//
// An argument that is a float64 array is read where it lies, whatever its strides; anything else that numpy can make a
// float64 array of without loss is converted once.  Tensors with __dlpack__ or __cuda_array_interface__ are read likewise,
// those of a card by their own copy to the host.  A wrong shape is an ArgumentError: what, expected, got.
#pragma once

#include <nanobind/nanobind.h>
// In every unit that casts these or in none: a caster is chosen when a unit is compiled, and two choices are one program too many.
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace dyntape::python {

namespace nb = nanobind;
using Shape = std::vector<std::ptrdiff_t>;

// "(2, 7)", "(7,)", "()": as numpy prints shapes.
std::string shape_text(const std::ptrdiff_t* shape, std::size_t n);
inline std::string shape_text(const Shape& shape) { return shape_text(shape.data(), shape.size()); }

// Text that Python refers to for as long as the process lives: signatures, docstrings.
const char* kept(std::string text);

// A str; TypeError, naming `what`, for anything else.
std::string text_of(nb::handle given, const std::string& what);

// What notebooks show (dyntape/_pictures.py): a page as a part of theirs, and the pictures that writing a result makes.
std::string in_notebook(const std::string& page);
nb::object pictures_of(nb::handle result);

// Must run once, before anything else here.
void import_numpy();

// Whether it is a numpy array of Python objects, or a list that would become one: recorded values, mostly.
bool holds_objects(nb::handle given);

// A float64 array of any shape, as it was given or converted: C-contiguous where asked for.
struct Numbers {
  nb::object array;
  const double* data = nullptr;
  Shape shape;
  std::size_t size() const;
};
Numbers numbers(nb::handle given, const std::string& what);                         // contiguous
Numbers numbers(nb::handle given, const std::string& what, const Shape& expected);  // -1: any extent
nb::object copy_of(const double* data, const Shape& shape);                         // a new array
nb::object new_array(const Shape& shape, double*& data);
nb::object new_integers(const std::vector<std::ptrdiff_t>& values);

class Rows {
 public:
  static constexpr int kMostAxes = 30, kMostArguments = 5;

  explicit Rows(const char* function) : function_(function) {}
  // Takes the next argument: (..., entries).
  void add(nb::handle given, const char* name, std::size_t entries);

  bool is_single() const { return axes_ == 0; }  // without batch axes
  int axes() const { return axes_; }
  const std::ptrdiff_t* batch() const { return batch_; }
  std::size_t count() const;
  std::size_t entries() const { return entries_; }  // of all arguments together
  const char* function() const { return function_; }

  // Where all states lie one after the other already: one argument, contiguous.  Null: they are to be gathered.
  const double* in_place() const;
  void gather(std::size_t first, std::size_t count, double* states) const;

 private:
  struct Argument {
    const char* name;
    nb::object array;
    const char* data;
    std::size_t entries;
    std::ptrdiff_t stride;            // from entry to entry, in bytes
    int axes;                         // of its own, batch axes only
    std::ptrdiff_t shape[kMostAxes];  // likewise
    std::ptrdiff_t
        strides[kMostAxes];  // along the batch axes of all, once they are known; 0 where it is broadcast
  };
  void check_shape(const Argument& argument) const;
  void broadcast(const Argument& argument);

  const char* function_;
  Argument arguments_[kMostArguments];
  int n_ = 0, axes_ = 0;
  std::size_t entries_ = 0;
  std::ptrdiff_t batch_[kMostAxes];
};

// All states, some at a time, shared out among the threads of the process; releases the lock.
//   body(first, count, states)    states first to first + count, one after the other; must not touch Python
using ChunkBody = std::function<void(std::size_t first, std::size_t count, const double* states)>;
void for_chunks(const Rows& rows, const ChunkBody& body);
// The same in large parts, one after the other: for what has threads of its own.  `numbers`: of a state and its results.
void for_parts(const Rows& rows, std::size_t numbers, const ChunkBody& body);
// The one state of rows without batch axes, in this thread, with the lock: of work that is done in a microsecond or two,
// which is about what it takes to give the lock away and to get it back.
void for_one(const Rows& rows, const ChunkBody& body);

// A block of a result: shape of one, row by row.
struct Block {
  std::string name;
  Shape shape;
  std::size_t size() const;
};

// Memory for all results, state after state; each block is a view into it.
class Result {
 public:
  Result(const Rows& rows, const std::vector<Block>& blocks);
  double* data() const { return data_; }
  nb::object block(std::size_t i) const;

 private:
  const Rows& rows_;
  const std::vector<Block>& blocks_;
  std::size_t entries_ = 0;
  nb::object whole_;
  double* data_ = nullptr;
};

}  // namespace dyntape::python
