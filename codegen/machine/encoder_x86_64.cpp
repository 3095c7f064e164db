// SPDX-License-Identifier: BSD-3-Clause
//
// x86-64.  Registers of a kernel: rbx, rbp, r12 hold x, p, w; r13 the work array, r14 the constants, r15 y; rsi and rdi the
// Jacobian and the Hessian, which calls overwrite.  What changes from block to block stands on the stack (Frame).  The last two
// vector registers are for steps within an operation.
#if defined(__x86_64__)
#include <dyntape/codegen/machine/encoder.h>

#include <bit>
#include <cstddef>

#include <xbyak/xbyak.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/processor_level.h>
#include <dyntape/codegen/machine/note_guards.h>
#include <dyntape/codegen/system/files.h>

namespace dyntape::codegen {
namespace {

using Xbyak::Address;
using Xbyak::Operand;
using Xbyak::Xmm;

enum PoolStart : std::uint32_t { kSign, kMagnitude, kOne, kMinusOne };

enum Comparison : std::uint8_t { kEqual = 0, kLess = 1, kLessEqual = 2, kNotEqual = 4, kGreater = 14 };

enum Rounding : std::uint8_t { kAsSet = 4, kDown = 9, kUp = 10, kToZero = 11 };  // 8: without an exception

// As registers and masks go: none, 16 (AVX2, FMA) or 32 (AVX-512).
enum class Registers { kNone, k16, k32 };

Registers registers_of_processor() {
  __builtin_cpu_init();
  const std::string level = processor_level();
  if (level == "x86-64-v2" || !__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma"))
    return Registers::kNone;
  const bool is_wide = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
                       __builtin_cpu_supports("avx512vl");
  return is_wide && level != "x86-64-v3" ? Registers::k32 : Registers::k16;
}

// Memory that is never executable: the code is copied when it is whole.
struct Heap : Xbyak::Allocator {
  bool useProtect() const override { return false; }
};
Heap& heap() {
  static Heap one;
  return one;
}

}  // namespace

std::span<const double> pool_start() {
  static const double all[] = {-0.0, std::bit_cast<double>(~std::uint64_t{0} >> 1), 1, -1};
  return all;
}

class Encoder::Instructions : public Xbyak::CodeGenerator {
 public:
  explicit Instructions(const KernelLayout& layout)
      : CodeGenerator(1 << 14, Xbyak::AutoGrow, &heap()),
        layout_(layout),
        lanes_(layout.lanes),
        wide_(registers_of_processor() == Registers::k32) {
    begin();
  }

  int registers() const { return (wide_ ? 32 : 16) - 2; }

  void load(int to, Location from) {
    if (from.is_register()) return vmovapd(vec(to), vec(int(from.index)));
    lanes_ == 1 ? vmovsd(vec(to), at(from)) : vmovupd(vec(to), at(from));
  }
  void store(Location to, int from) { lanes_ == 1 ? vmovsd(at(to), vec(from)) : vmovupd(at(to), vec(from)); }
  void copy(Location to, Location from) { load(first_scratch(), from), store(to, first_scratch()); }

  void operate(Op op, int to, const std::array<Location, 3>& a) {
    const Xmm r = vec(to);
    switch (op) {
      case Op::Add:
        return binary(r, a[0], a[1], &Instructions::vaddsd, &Instructions::vaddpd);
      case Op::Sub:
        return binary(r, a[0], a[1], &Instructions::vsubsd, &Instructions::vsubpd);
      case Op::Mul:
        return binary(r, a[0], a[1], &Instructions::vmulsd, &Instructions::vmulpd);
      case Op::Div:
        return binary(r, a[0], a[1], &Instructions::vdivsd, &Instructions::vdivpd);
      case Op::Min:  // the second where they are equal or not ordered
        return binary(r, a[1], a[0], &Instructions::vminsd, &Instructions::vminpd);
      case Op::Max:
        return binary(r, a[1], a[0], &Instructions::vmaxsd, &Instructions::vmaxpd);
      case Op::Neg:
        return vxorpd(r, in_register(a[0]), constant(kSign));
      case Op::Abs:
        return vandpd(r, in_register(a[0]), constant(kMagnitude));
      case Op::Copysign:
        vandpd(scratch(1), in_register(a[1]), constant(kSign));
        vandpd(scratch(0), in_register(a[0]), constant(kMagnitude));
        return vorpd(r, scratch(0), scratch(1));
      case Op::Sqrt:
        return square_root(r, a[0]);
      case Op::Floor:
        return round(r, a[0], kDown);
      case Op::Ceil:
        return round(r, a[0], kUp);
      case Op::Trunc:
        return round(r, a[0], kToZero);
      case Op::Rint:
        return round(r, a[0], kAsSet);
      case Op::Fma:
        return fused(r, a, &Instructions::vfmadd231sd, &Instructions::vfmadd231pd);
      case Op::Fms:
        return fused(r, a, &Instructions::vfmsub231sd, &Instructions::vfmsub231pd);
      case Op::Fnma:
        return fused(r, a, &Instructions::vfnmadd231sd, &Instructions::vfnmadd231pd);
      case Op::Fnms:
        return fused(r, a, &Instructions::vfnmsub231sd, &Instructions::vfnmsub231pd);
      case Op::Lt:
        return truth(r, in_register(a[0]), a[1], kLess);
      case Op::Le:
        return truth(r, in_register(a[0]), a[1], kLessEqual);
      case Op::Eq:
        return truth(r, in_register(a[0]), a[1], kEqual);
      case Op::Ne:
        return truth(r, in_register(a[0]), a[1], kNotEqual);
      case Op::Sign:
        return sign(r, a[0]);
      case Op::Azmul:
        return multiply_unless_zero(r, a[0], a[1]);
      case Op::Gate:
        return gate(r, a[0], a[1]);
      case Op::Select:
        return select(r, a);
      default:
        throw ToolError("there is no instruction for " + std::string(info(op).name));
    }
  }

  void call(ScalarFunction* function, const std::array<Location, 3>& a) {
    load(first_scratch(), a[1]), load(second_scratch(), a[2]), load(0, a[0]);
    load(1, Location::in(first_scratch())), load(2, Location::in(second_scratch()));
    call_address(reinterpret_cast<const void*>(function));
  }
  void call(LaneFunction* function, const std::array<Location, 3>& a, Location result) {
    address(rdi, a[0]), address(rsi, a[1]), address(rdx, a[2]), address(rcx, result);
    call_address(reinterpret_cast<const void*>(function));
  }
  void call(CalleeFunction* function, const void* callee, Location in, Location out, Location work) {
    address(rsi, in), address(rdx, out), address(rcx, work);
    mov(rdi, reinterpret_cast<std::uintptr_t>(callee));
    call_address(reinterpret_cast<const void*>(function));
  }

  // Of the block, and of the loop over blocks.
  void finish() {
    Xbyak::Label unwatched;
    mov(rdx, frame(kStatus));
    test(rdx, rdx);
    jz(unwatched, T_NEAR);
    lea(rdi, at({Location::kWork, layout_.conditions}));
    mov(rsi, reinterpret_cast<std::uintptr_t>(layout_.guards));
    mov(rcx, lanes_);
    if (lanes_ > 1) vzeroupper();
    mov(rax, reinterpret_cast<std::uintptr_t>(&note_guards));
    Xbyak::CodeGenerator::call(rax);
    add(qword[rsp + 8 * kStatus], 4 * lanes_);
    L(unwatched);
    add(rbx, frame(kStrideX)), add(rbp, frame(kStrideP)), add(r12, frame(kStrideW)),
        add(r15, frame(kStrideY));
    for (const auto& [slot, stride] :
         {std::pair(kJacobian, kStrideJacobian), std::pair(kHessian, kStrideHessian)})
      mov(rax, frame(stride)), add(qword[rsp + 8 * slot], rax);
    sub(qword[rsp + 8 * kLeft], lanes_);
    ja(again_, T_NEAR);
    L(done_);
    if (lanes_ > 1) vzeroupper();
    add(rsp, 8 * kFrame);
    for (const Xbyak::Reg64& reg : {r15, r14, r13, r12, rbp, rbx}) pop(reg);
    ret();
    ready(PROTECT_RW);
  }

 private:
  enum FrameSlot {
    kJacobian,
    kHessian,
    kLeft,
    kStatus,
    kStrideX,
    kStrideP,
    kStrideW,
    kStrideY,
    kStrideJacobian,
    kStrideHessian,
    kFrame = 11
  };
  static constexpr int kPushed = 6;
  using Packed = void (CodeGenerator::*)(const Xmm&, const Xmm&, const Operand&);

  Address frame(int slot) { return qword[rsp + 8 * slot]; }
  Address argument(int k) {
    return qword[rsp + 8 * (kFrame + kPushed + 1 + k)];
  }  // of those behind the sixth

  void begin() {
    for (const Xbyak::Reg64& reg : {rbx, rbp, r12, r13, r14, r15}) push(reg);
    sub(rsp, 8 * kFrame);
    mov(rbx, rdi), mov(rbp, rsi), mov(r12, rdx), mov(r15, rcx);
    mov(r13, argument(0));
    mov(r14, reinterpret_cast<std::uintptr_t>(layout_.pool));
    mov(rax, argument(1)), mov(frame(kLeft), rax);
    mov(rax, argument(3)), mov(frame(kStatus), rax);
    begin_strides();
    lea(rax, at({Location::kWork, layout_.unwanted}));
    begin_output(r15, kStrideY);
    begin_output(r8, kStrideJacobian), mov(frame(kJacobian), r8);
    begin_output(r9, kStrideHessian), mov(frame(kHessian), r9);
    cmp(frame(kLeft), 0);
    jz(done_, T_NEAR);
    L(again_);
    reload();
  }

  void begin_strides() {
    Xbyak::Label dense, known;
    mov(rdx, argument(2));
    test(rdx, rdx);
    jz(dense, T_NEAR);
    for (int k = 0; k < 6; ++k) mov(rax, qword[rdx + 8 * k]), shl(rax, 3), mov(frame(kStrideX + k), rax);
    jmp(known, T_NEAR);
    L(dense);
    const dyntape_strides& n = layout_.sizes;
    const std::size_t sizes[] = {n.x, n.p, n.w, n.y, n.jacobian, n.hessian};
    for (int k = 0; k < 6; ++k) mov(rax, sizes[k] * 8 * std::size_t(lanes_)), mov(frame(kStrideX + k), rax);
    L(known);
  }

  // Unused results go to rax.
  void begin_output(const Xbyak::Reg64& output, int stride) {
    Xbyak::Label wanted;
    test(output, output);
    jnz(wanted, T_NEAR);
    mov(output, rax);
    mov(frame(stride), 0);
    L(wanted);
  }

  void reload() { mov(rsi, frame(kJacobian)), mov(rdi, frame(kHessian)); }

  void call_address(const void* function) {
    if (lanes_ > 1) vzeroupper();
    mov(rax, reinterpret_cast<std::uintptr_t>(function));
    Xbyak::CodeGenerator::call(rax);
    reload();
  }

  Xmm vec(int r) const {
    if (lanes_ == 8) return Xbyak::Zmm(r);
    if (lanes_ == 4) return Xbyak::Ymm(r);
    return Xmm(r);
  }
  int first_scratch() const { return registers(); }
  int second_scratch() const { return registers() + 1; }
  Xmm scratch(int k) const { return vec(registers() + k); }

  Address at(Location place) {
    const std::size_t bytes = std::size_t(place.index) * 8 * std::size_t(lanes_);
    if (bytes > std::size_t{1} << 30) throw Unavailable("a function is too long for machine code");
    const Xbyak::RegExp by(bytes);
    switch (place.kind) {
      case Location::kX:
        return ptr[rbx + by];
      case Location::kP:
        return ptr[rbp + by];
      case Location::kW:
        return ptr[r12 + by];
      case Location::kPool:
        return ptr[r14 + by];
      case Location::kY:
        return ptr[r15 + by];
      case Location::kJacobian:
        return ptr[rsi + by];
      case Location::kHessian:
        return ptr[rdi + by];
      default:
        return ptr[r13 + by];
    }
  }
  Address constant(PoolStart which) { return at({Location::kPool, which}); }
  void address(const Xbyak::Reg64& to, Location place) { lea(to, at(place)); }

  // A scalar in memory is read as one, not as the first of two.
  Xmm in_register(Location place) {
    if (place.is_register()) return vec(int(place.index));
    load(first_scratch(), place);
    return scratch(0);
  }

  template <class Use>
  void with(Location place, Use&& use) {
    place.is_register() ? use(vec(int(place.index))) : use(at(place));
  }

  template <class Scalar, class Vector>
  void binary(const Xmm& r, Location x, Location y, Scalar scalar, Vector vector) {
    with(y, [&](const Operand& b) {
      lanes_ == 1 ? (this->*scalar)(r, vec(int(x.index)), b) : (this->*vector)(r, vec(int(x.index)), b);
    });
  }

  // r = +-x y +- z where r is apart from x and y.
  template <class Scalar, class Vector>
  void fused(const Xmm& r, const std::array<Location, 3>& a, Scalar scalar, Vector vector) {
    if (!(a[2].is_register() && int(a[2].index) == r.getIdx())) load(r.getIdx(), a[2]);
    with(a[1], [&](const Operand& b) {
      lanes_ == 1 ? (this->*scalar)(r, vec(int(a[0].index)), b) : (this->*vector)(r, vec(int(a[0].index)), b);
    });
  }

  void square_root(const Xmm& r, Location x) {
    if (lanes_ > 1) return with(x, [&](const Operand& b) { vsqrtpd(r, b); });
    const Xmm value = in_register(x);
    vsqrtsd(r, value, value);
  }

  void round(const Xmm& r, Location x, Rounding how) {
    const Xmm value = in_register(x);
    if (wide_) return lanes_ == 1 ? vrndscalesd(r, value, value, how) : vrndscalepd(r, value, how);
    lanes_ == 1 ? vroundsd(r, value, value, how) : vroundpd(r, value, how);
  }

  // Masks: in k1, or all ones in a register.
  template <class Mask>
  void compare(const Mask& mask, const Xmm& x, const Operand& y, Comparison how) {
    lanes_ == 1 ? vcmpsd(mask, x, y, how) : vcmppd(mask, x, y, how);
  }
  // Where the mask holds, else 0.
  void masked_load(const Xmm& r, PoolStart which) {
    lanes_ == 1 ? vmovsd(r | k1 | T_z, constant(which)) : vmovupd(r | k1 | T_z, constant(which));
  }
  // 1 where it holds, else 0.
  void truth(const Xmm& r, const Xmm& x, Location y, Comparison how) {
    with(y, [&](const Operand& b) {
      if (wide_) return compare(k1, x, b, how), masked_load(r, kOne);
      compare(scratch(1), x, b, how);
      vandpd(r, scratch(1), constant(kOne));
    });
  }

  void sign(const Xmm& r, Location x) {
    const Xmm value = in_register(x);
    if (wide_) {
      compare(k1, value, constant(kSign), kGreater), compare(k2, value, constant(kSign), kLess);
      masked_load(r, kOne);
      return lanes_ == 1 ? vmovsd(r | k2, constant(kMinusOne)) : vmovupd(r | k2, constant(kMinusOne));
    }
    compare(scratch(1), value, constant(kSign), kGreater), vandpd(scratch(1), scratch(1), constant(kOne));
    compare(r, value, constant(kSign), kLess), vandpd(r, r, constant(kOne));
    vsubpd(r, scratch(1), r);
  }

  void multiply_unless_zero(const Xmm& r, Location x, Location y) {
    const Xmm factor = vec(int(x.index));
    if (wide_) {
      compare(k1, factor, constant(kSign), kNotEqual);
      return with(y, [&](const Operand& b) {
        lanes_ == 1 ? vmulsd(r | k1 | T_z, factor, b) : vmulpd(r | k1 | T_z, factor, b);
      });
    }
    compare(scratch(1), factor, constant(kSign), kNotEqual);
    binary(r, x, y, &Instructions::vmulsd, &Instructions::vmulpd);
    vandpd(r, r, scratch(1));
  }

  void gate(const Xmm& r, Location condition, Location y) {
    const Xmm value = in_register(y);
    if (wide_) {
      compare(k1, vec(int(condition.index)), constant(kSign), kNotEqual);
      return vmovapd(r | k1 | T_z, value);
    }
    compare(scratch(1), vec(int(condition.index)), constant(kSign), kNotEqual);
    vandpd(r, scratch(1), value);
  }

  void select(const Xmm& r, const std::array<Location, 3>& a) {
    const Xmm chosen = in_register(a[1]), other = vec(int(a[2].index));
    if (wide_) {
      compare(k1, vec(int(a[0].index)), constant(kSign), kNotEqual);
      return vblendmpd(r | k1, other, chosen);
    }
    compare(scratch(1), vec(int(a[0].index)), constant(kSign), kNotEqual);
    vblendvpd(r, other, chosen, scratch(1));
  }

  const KernelLayout layout_;
  const int lanes_;
  const bool wide_;  // 32 registers, masks
  Xbyak::Label again_, done_;
};

bool Encoder::can_encode(int lanes) {
  const Registers has = registers_of_processor();
  return lanes == 8 ? has == Registers::k32 : has != Registers::kNone;
}

int Encoder::registers() const { return made_->registers(); }

std::span<const std::uint8_t> Encoder::code() const { return {made_->getCode(), made_->getSize()}; }

}  // namespace dyntape::codegen

#include <dyntape/codegen/machine/encoder_calls.hxx>

#endif
