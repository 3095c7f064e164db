// SPDX-License-Identifier: BSD-3-Clause
//
// Instructions of one processor: what the table's operators become, on registers that hold one value, or one of each of 2, 4 or 8
// lanes.  encoder_x86_64.cpp: x86-64 with AVX2 and FMA (level v3), or AVX-512 (v4).  encoder_a64.cpp: aarch64 (A64), two lanes.
//
//   Encoder encode(8, layout);
//   encode.load(0, {Location::kX, 3});                                  register 0 = x[3], of all lanes
//   encode.operate(Op::Mul, 1, {Location::in(0), {Location::kPool, 5}});   register 1 = register 0 * constant 5
//   encode.store({Location::kY, 0}, 1);                                 y[0] = register 1
//   encode.finish();
//   encode.code();                                                   a dyntape_function (store/abi.h)
//
// Of operate()'s arguments all stand in registers but one, which may stand in memory.  The result may have the register of an
// argument, except where result_is_apart().
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <dyntape/autodiff/graph/op.h>
#include <dyntape/codegen/store/abi.h>

namespace dyntape::codegen {

struct Location {
  enum Kind : std::uint8_t { kRegister, kX, kP, kW, kPool, kWork, kY, kJacobian, kHessian };
  Kind kind = kRegister;
  std::uint32_t index = 0;  // of the register, or the entry
  static Location in(int r) { return {kRegister, static_cast<std::uint32_t>(r)}; }
  bool is_register() const { return kind == kRegister; }
};

// Which of the conditions were true when recorded, by guard.
using GuardTable = std::vector<std::uint8_t>;

// What of a kernel does not depend on its operations.  Entries are counted in values of all lanes.
struct KernelLayout {
  int lanes = 1;
  dyntape_strides sizes = {};  // entries of a point in each array
  const double* pool =
      nullptr;  // constants, each once a lane, and room for one more number; first those of pool_start()
  std::uint32_t unwanted = 0;    // index in `work` of unused outputs
  std::uint32_t conditions = 0;  // where in `work` the conditions of the guards stand
  const GuardTable* guards = nullptr;
};

// Constants that instructions need besides those of functions.
std::span<const double> pool_start();

// What machine code calls: of one value in registers, of values in memory.
using ScalarFunction = double(double, double, double);
using LaneFunction = void(const double*, const double*, const double*, double*);
using CalleeFunction = void(const void* callee, const double* in, double* out, double* work);

class Encoder {
 public:
  // Whether this processor runs what it makes.
  static bool can_encode(int lanes);

  explicit Encoder(const KernelLayout& layout);
  ~Encoder();

  int registers() const;  // that are free to be used, 0, 1, ...
  static bool has_instruction(Op op);
  static int memory_argument(Op op);  // which may stand in memory
  static bool result_is_apart(Op op);

  void load(int to, Location from);
  void store(Location to, int from);
  void copy(Location to, Location from);  // from memory to memory
  void operate(Op op, int to, const std::array<Location, 3>& arguments);

  // These leave no register as it was.  Of arguments that there are not, any will do.  The result is in register 0.
  void call(ScalarFunction* function, const std::array<Location, 3>& arguments);
  // The result is in memory, as the arguments are.
  void call(LaneFunction* function, const std::array<Location, 3>& arguments, Location result);
  void call(CalleeFunction* function, const void* callee, Location in, Location out, Location work);

  void finish();
  std::span<const std::uint8_t> code() const;

 private:
  class Instructions;
  std::unique_ptr<Instructions> made_;
};

}  // namespace dyntape::codegen
