// SPDX-License-Identifier: BSD-3-Clause
//
// Prints a function and its derivatives as kernels of a graphics card, OpenCL C or CUDA C: one state a work-item.
//
//   DeviceOptions how;
//   how.language = DeviceLanguage::kCuda;
//   DeviceSource d = generate_device(function, options, how);                                 // pipeline.h
//   d.source.text        extern "C" __global__ void arm_value(const double* x, double* y, dt_count count)
//
// Entry i of state s is at x[i * count + s], in every array, so that neighbouring work-items read neighbouring numbers.
// Parameters of a kernel are x, p, w, y, jacobian, hessian, without empty ones; status, of a function with guards: 0, or 1 +
// the index of the first violated guard; count, of states, 64 bits.  In second order the Hessian's weights, one per output,
// follow the function's own in w.
//
// A loop, for functions whose first outputs are the next variables, x' = f(x, p): DeviceOptions::loop.  Its only kernel
// takes many steps and keeps each `every`-th state.  DeviceLoop (device_loop.h) runs it.
//
//   arm_loop(real* x, const real* shared, const real* p, const real* constants, real* states, const dt_count* loop,
//            dt_count count)
//
// x: the states, before and after; shared: the first parameters of each step, the same for all states; p: the next, at
// [(step * n + i) * p_count + s]; constants: the last, the same in all steps, at [i * constants_count + s]; states: kept
// ones, at [(kept * n_x + i) * count + s]; loop: steps, every, steps taken before, p_count and constants_count (count, or 1:
// the same for all states).  Without parameters of a kind the kernel has no array of them.  From
// a step on that violates a guard, or whose arguments or results (other outputs, too) are not finite, a state is NaN.
//
// Without contraction a kernel has the interpreter's bits, as long as it calls no function but square roots, sines,
// cosines and the exact ones (floor, fmod, ...): the others are the device's.  OpenCL's text turns contraction off itself;
// CUDA's needs -fmad=false.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <dyntape/codegen/print/source.h>

namespace dyntape::codegen {

enum class DeviceLanguage { kOpenCl, kCuda };

// Parameters of a loop by kind; the others are of each step and state.
struct LoopParameters {
  std::size_t shared = 0, constants = 0;
};

struct DeviceOptions {
  DeviceLanguage language = DeviceLanguage::kOpenCl;
  bool single = false;                      // float instead of double
  std::size_t piece_statements = 4000;      // longer bodies are cut into functions of about this length
  std::optional<LoopParameters> loop = {};  // a loop in place of the function
};

// A kernel as a program calls it.
struct DeviceKernel {
  std::string name;  // "arm_value"
  bool is_guarded = false;
  std::size_t inputs[3] = {}, outputs[3] = {};  // entries of a state: x, p, w; y, jacobian, hessian
  std::size_t work =
      0;  // bytes of a state's own memory beside registers: values that live longer than a piece
};

struct DeviceSource {
  Source source;                      // the header declares nothing: sizes, and the places of the non-zeros
  std::vector<DeviceKernel> kernels;  // by order
  Pattern jacobian, hessian;
};

// Throws ArgumentError if sets.functions are the portable ones, which need a library, and for a loop of a function with
// fewer outputs than variables.
DeviceSource print_device(const KernelSets& sets, const DeviceOptions& options);

}  // namespace dyntape::codegen
