// SPDX-License-Identifier: BSD-3-Clause
//
// Processors that no encoder is written for.
#if !defined(__x86_64__) && !defined(__AARCH64EL__)
#include <dyntape/codegen/machine/encoder.h>

#include <dyntape/autodiff/error.h>

namespace dyntape::codegen {
namespace {

[[noreturn]] void refuse() { throw ToolError("there is no machine code for this processor"); }

}  // namespace

class Encoder::Instructions {};

bool Encoder::can_encode(int) { return false; }
bool Encoder::has_instruction(Op) { return false; }
int Encoder::memory_argument(Op) { return 0; }
bool Encoder::result_is_apart(Op) { return false; }
std::span<const double> pool_start() { return {}; }

Encoder::Encoder(const KernelLayout&) { refuse(); }
Encoder::~Encoder() = default;
int Encoder::registers() const { return 0; }
void Encoder::load(int, Location) { refuse(); }
void Encoder::store(Location, int) { refuse(); }
void Encoder::copy(Location, Location) { refuse(); }
void Encoder::operate(Op, int, const std::array<Location, 3>&) { refuse(); }
void Encoder::call(ScalarFunction*, const std::array<Location, 3>&) { refuse(); }
void Encoder::call(LaneFunction*, const std::array<Location, 3>&, Location) { refuse(); }
void Encoder::call(CalleeFunction*, const void*, Location, Location, Location) { refuse(); }
void Encoder::finish() { refuse(); }
std::span<const std::uint8_t> Encoder::code() const { return {}; }

}  // namespace dyntape::codegen

#endif
