// SPDX-License-Identifier: BSD-3-Clause
//
// The result of a recording in the CppAD layer: a function of the project, and the data that CppAD stores with it.
// Internal: shared by ad_fun.h and its sources.
#pragma once

#include <iosfwd>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <dyntape/interface/cppad/ad.h>

namespace dyntape {
struct Callee;
struct Function;
struct Pattern;
template <class T>
class SeriesKernel;
}  // namespace dyntape

namespace CppAD::inline dyntape_names::detail {

// What a kernel is called in CppAD's graphs.
struct KernelName {
  enum Kind { kOther, kDiscrete, kAtomicThree, kAtomicFour } kind = kOther;
  std::string name;
  std::size_t call_id = 0;
};

// A kernel that the user wrote.  It is a KernelOver<T> for each type T in whose series it is evaluated.
struct KernelInSeries {
  virtual ~KernelInSeries() = default;
  // The pattern of the Jacobian, or of all dependencies; false: that of the callee.
  virtual bool jacobian(bool /*dependency*/, Pattern&) const { return false; }
  // The pattern of the Hessian of result i, both triangles; false: all pairs of what it depends on.
  virtual bool hessian(std::size_t, Pattern&) const { return false; }
  virtual KernelName called() const { return {}; }
};
template <class T>
struct KernelOver {
  virtual ~KernelOver() = default;
  virtual std::shared_ptr<const SeriesKernel<T>> series(const T* of) const = 0;
};
using Kernels = std::map<const Callee*, std::shared_ptr<const KernelInSeries>>;

// PrintFor: texts around the value of output `value`, where output `flag` is not positive.
struct Print {
  std::size_t flag, value;  // outputs of the function, after those of the user
  std::string before, after;
};

// How many nodes of each kind there are.
struct RecordingSizes {
  std::size_t variables = 0, operations = 0, arguments = 0, constants = 0, dynamics = 0,
              dynamic_arguments = 0, text = 0;
};

template <class Base>
struct Recording {
  std::shared_ptr<const Function> function;  // of variables, dynamic parameters, and what is captured
  std::size_t range = 0;                     // the first of its outputs are the user's
  std::vector<Print> prints;
  std::vector<std::size_t>
      guard_places;  // of their conditions, as Independent counts operations; empty: not known
  std::vector<std::size_t> guard_counts;  // of the comparisons that each guard stands for; empty: one each
  Kernels kernels;
  std::vector<Base> captured;             // what a base that records took for a constant
  std::vector<Base> variables, dynamics;  // their values when it was recorded
};

// --- bases/recorded.hxx, for every base ---
struct Begin {
  std::size_t abort_op_index = 0;
  bool record_compare = true;
  const char* file = nullptr;
  int line = 0;
};
// Makes these the inputs of a new recording.
template <class Base>
void begin_recording(AD<Base>* x, std::size_t n_x, AD<Base>* dynamic, std::size_t n_dynamic,
                     const Begin& begin);
// Ends it. Null x: whatever the independents were.
template <class Base>
std::shared_ptr<const Recording<Base>> end_recording(const AD<Base>* x, std::size_t n_x, const AD<Base>* y,
                                                     std::size_t n_y);
// The recording up to here, with these results.  The recording stays open until the next one begins.
template <class Base>
std::shared_ptr<const Recording<Base>> recorded_so_far(const AD<Base>* y, std::size_t n_y);
// The serial number of the open recording of this thread, or 0.
template <class Base>
std::uint32_t open_recording();
template <class Base>
void record_print(const AD<Base>& flag, const std::string& before, const AD<Base>& value,
                  const std::string& after);
// A comparison that is true where the recording is valid.
template <class Base>
void record_guard(Row row, const AD<Base>& x, const AD<Base>& y);
// A call of a kernel as one node, with these values; constants only: no node.
template <class Base>
std::vector<AD<Base>> record_call(const std::shared_ptr<const Callee>& callee,
                                  const std::shared_ptr<const KernelInSeries>& kernel,
                                  const std::vector<AD<Base>>& arguments, const std::vector<Base>& values);
// Functions of the user by their names (nodes/): ArgumentError if there is none.
template <class Base>
std::vector<AD<Base>> atomic_by_name(const std::string& name, std::size_t call_id,
                                     const std::vector<AD<Base>>& x, std::size_t m);
template <class Base>
AD<Base> discrete_by_name(const std::string& name, const AD<Base>& x);
// f as g(x, a(x)): a has the absolute values of f, and g, of x and u, the results of f and what the absolute values are of, where the u are
// in place of them (graph/abs_normal.cpp).  ArgumentError if f calls functions of the user.
template <class Base>
struct AbsNormal {
  std::shared_ptr<const Recording<Base>> g, a;
};
template <class Base>
AbsNormal<Base> abs_normal_of(const Recording<Base>& f);
// The same function over numbers; ArgumentError if it has values of another recording.
template <class Base>
std::shared_ptr<const Recording<double>> recording_of_numbers(const Recording<Base>& of, const char* who);
// C of the values, as CppAD's to_csrc writes it (cg/code_handler.cpp).
void write_csrc(std::ostream& out, const Function& function, const Kernels& kernels,
                const std::vector<std::size_t>& guard_counts, std::size_t range, const std::string& name,
                const std::string& type);
template <class Base>
bool is_recording();

// The error handler of this thread, if the program installed one; without one, or if it returns, the caller throws.
bool has_handler();
void call_handler(const std::string& message);
// A new file in the folder of temporary files; returns its name, or nothing if it could not be written.
std::string write_temporary(const void* bytes, std::size_t count);
void read_temporary(const std::string& name, void* bytes, std::size_t count);  // ArgumentError
[[noreturn]] void refuse(const std::string& sentence);                         // ArgumentError
[[noreturn]] void refuse_recording(const std::string& sentence);               // RecordingError

}  // namespace CppAD::inline dyntape_names::detail
