// SPDX-License-Identifier: BSD-3-Clause
//
// The part of Encoder that is the same for every processor.  A source that defines Encoder::Instructions, registers(), code(),
// can_encode() and pool_start() includes this file at its end.
#pragma once

namespace dyntape::codegen {

Encoder::Encoder(const KernelLayout& layout) : made_(std::make_unique<Instructions>(layout)) {}
Encoder::~Encoder() = default;

bool Encoder::has_instruction(Op op) {
  switch (op) {
    case Op::Add:
    case Op::Sub:
    case Op::Mul:
    case Op::Div:
    case Op::Min:
    case Op::Max:
    case Op::Neg:
    case Op::Abs:
    case Op::Copysign:
    case Op::Sqrt:
    case Op::Floor:
    case Op::Ceil:
    case Op::Trunc:
    case Op::Rint:
    case Op::Lt:
    case Op::Le:
    case Op::Eq:
    case Op::Ne:
    case Op::Sign:
    case Op::Azmul:
    case Op::Gate:
    case Op::Select:
    case Op::Fma:
    case Op::Fms:
    case Op::Fnma:
    case Op::Fnms:
      return true;
    default:
      return false;
  }
}

int Encoder::memory_argument(Op op) { return op == Op::Min || op == Op::Max || info(op).arity == 1 ? 0 : 1; }

// Fused operations add to a register in place.
bool Encoder::result_is_apart(Op op) {
  return op == Op::Fma || op == Op::Fms || op == Op::Fnma || op == Op::Fnms;
}

void Encoder::load(int to, Location from) { made_->load(to, from); }
void Encoder::store(Location to, int from) { made_->store(to, from); }
void Encoder::copy(Location to, Location from) { made_->copy(to, from); }
void Encoder::operate(Op op, int to, const std::array<Location, 3>& arguments) {
  made_->operate(op, to, arguments);
}
void Encoder::call(ScalarFunction* function, const std::array<Location, 3>& arguments) {
  made_->call(function, arguments);
}
void Encoder::call(LaneFunction* function, const std::array<Location, 3>& arguments, Location result) {
  made_->call(function, arguments, result);
}
void Encoder::call(CalleeFunction* function, const void* callee, Location in, Location out, Location work) {
  made_->call(function, callee, in, out, work);
}
void Encoder::finish() { made_->finish(); }

}  // namespace dyntape::codegen
