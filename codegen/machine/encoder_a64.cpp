// SPDX-License-Identifier: BSD-3-Clause
//
// A64, the instruction set of aarch64.  Registers of a kernel: x19 to x25 hold x, p, w, y, Jacobian, Hessian and
// the work array, x26 the constants, x27 the number of points left, x28 the status; called functions preserve them.
// Strides are on the stack.  x9, x10, x16 and the last three vector registers are scratch within an operation.
#if defined(__AARCH64EL__)
#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/machine/a64_instructions.h>
#include <dyntape/codegen/machine/encoder.h>
#include <dyntape/codegen/machine/note_guards.h>
#include <dyntape/codegen/system/files.h>

namespace dyntape::codegen {
namespace {

using a64::Instruction;
using a64::Word;

constexpr int kVectorRegisters = 32, kScratchRegisters = 3;

enum Integer : int {
  kAtX = 19,
  kAtP,
  kAtW,
  kAtY,
  kAtJacobian,
  kAtHessian,
  kAtWork,
  kAtPool,
  kLeft,
  kAtStatus,
  kFrame,
  kLink
};
constexpr int kStep = 9, kSecondStep = 10, kAddress = 16;

// Bytes above the stack pointer: x29, x30; x19 to x28; d8 to d15; six strides.  The ninth argument is above.
constexpr int kSaved = 16, kSavedFloating = 96, kStrides = 160, kFrameBytes = 208;

}  // namespace

std::span<const double> pool_start() { return {}; }

class Encoder::Instructions {
 public:
  explicit Instructions(const KernelLayout& layout) : layout_(layout), lanes_(layout.lanes) { begin(); }

  std::span<const std::uint8_t> code() const {
    return {reinterpret_cast<const std::uint8_t*>(words_.data()), words_.size() * sizeof(Word)};
  }

  void load(int to, Location from) {
    if (!from.is_register()) return access(to, from, a64::load_word, a64::load_word_by);
    if (int(from.index) != to) add(a64::word(a64::kOr, to, int(from.index), int(from.index)));
  }
  void store(Location to, int from) { access(from, to, a64::store_word, a64::store_word_by); }
  void copy(Location to, Location from) { load(scratch(0), from), store(to, scratch(0)); }

  void operate(Op op, int r, const std::array<Location, 3>& a) {
    switch (op) {
      case Op::Add:
        return binary(a64::kAdd, r, a);
      case Op::Sub:
        return binary(a64::kSub, r, a);
      case Op::Mul:
        return binary(a64::kMul, r, a);
      case Op::Div:
        return binary(a64::kDiv, r, a);
      case Op::Min:
        return extreme(r, reg(a[0]), reg(a[1]), true);
      case Op::Max:
        return extreme(r, reg(a[0]), reg(a[1]), false);
      case Op::Neg:
        return unary(a64::kNegate, r, a[0]);
      case Op::Abs:
        return unary(a64::kMagnitude, r, a[0]);
      case Op::Copysign:
        return copy_sign(r, reg(a[0]), reg(a[1]));
      case Op::Sqrt:
        return unary(a64::kSquareRoot, r, a[0]);
      case Op::Floor:
        return unary(a64::kRoundDown, r, a[0]);
      case Op::Ceil:
        return unary(a64::kRoundUp, r, a[0]);
      case Op::Trunc:
        return unary(a64::kRoundToZero, r, a[0]);
      case Op::Rint:
        return unary(a64::kRoundAsSet, r, a[0]);
      case Op::Fma:
        return fused(r, a, a64::kMulAdd, a64::kVectorMulAdd, false);
      case Op::Fms:
        return fused(r, a, a64::kNegMulSub, a64::kVectorMulAdd, true);
      case Op::Fnma:
        return fused(r, a, a64::kMulSub, a64::kVectorMulSub, false);
      case Op::Fnms:
        return fused(r, a, a64::kNegMulAdd, a64::kVectorMulSub, true);
      case Op::Lt:
        return truth(r, a64::kGreater, reg(a[1]), reg(a[0]), a64::kAnd);
      case Op::Le:
        return truth(r, a64::kGreaterEqual, reg(a[1]), reg(a[0]), a64::kAnd);
      case Op::Eq:
        return truth(r, a64::kEqual, reg(a[0]), reg(a[1]), a64::kAnd);
      case Op::Ne:
        return truth(r, a64::kEqual, reg(a[0]), reg(a[1]), a64::kAndNot);
      case Op::Sign:
        return sign(r, reg(a[0]));
      case Op::Azmul:
        add(a64::word(a64::kEqualZero.of(lanes_), scratch(1), reg(a[0])));
        binary(a64::kMul, r, a);
        return add(a64::word(a64::kAndNot, r, r, scratch(1)));
      case Op::Gate:
        add(a64::word(a64::kEqualZero.of(lanes_), scratch(1), reg(a[0])));
        return add(a64::word(a64::kAndNot, r, reg(a[1]), scratch(1)));
      case Op::Select:
        return select(r, reg(a[0]), reg(a[1]), reg(a[2]));
      default:
        throw ToolError("there is no instruction for " + std::string(info(op).name));
    }
  }

  void call(ScalarFunction* function, const std::array<Location, 3>& a) {
    load(scratch(0), a[1]), load(scratch(1), a[2]), load(0, a[0]);
    load(1, Location::in(scratch(0))), load(2, Location::in(scratch(1)));
    call_address(reinterpret_cast<const void*>(function));
  }
  void call(LaneFunction* function, const std::array<Location, 3>& a, Location result) {
    address(0, a[0]), address(1, a[1]), address(2, a[2]), address(3, result);
    call_address(reinterpret_cast<const void*>(function));
  }
  void call(CalleeFunction* function, const void* callee, Location in, Location out, Location work) {
    address(1, in), address(2, out), address(3, work);
    constant(0, reinterpret_cast<std::uintptr_t>(callee));
    call_address(reinterpret_cast<const void*>(function));
  }

  // Of the block, and of the loop over blocks.
  void finish() {
    skipping(a64::branch_if_zero, kAtStatus, [&] {
      address(0, {Location::kWork, layout_.conditions});
      constant(1, reinterpret_cast<std::uintptr_t>(layout_.guards));
      add(a64::move(2, kAtStatus));
      constant(3, static_cast<std::uint64_t>(lanes_));
      call_address(reinterpret_cast<const void*>(&note_guards));
      add(a64::add_constant(kAtStatus, kAtStatus, static_cast<Word>(4 * lanes_)));
    });
    for (int k = 0; k < 6; ++k) {
      add(a64::load_integer(kStep, kFrame, stride(k)));
      add(a64::add(kAtX + k, kAtX + k, kStep));
    }
    add(a64::subtract_and_compare(kLeft, kLeft, static_cast<Word>(lanes_)));
    add(a64::branch_unless_higher(2));
    add(branch_to(again_));
    words_[done_] = a64::branch(distance(done_, words_.size()));
    end();
  }

 private:
  void add(Word word) { words_.push_back(word); }

  static int scratch(int k) { return kVectorRegisters - kScratchRegisters + k; }
  static Word stride(int k) { return static_cast<Word>(kStrides + 8 * k); }

  // --- the frame ---

  void begin() {
    add(a64::pair(a64::kStorePairAndMove, kFrame, kLink, -kFrameBytes));
    add(a64::add_constant(kFrame, a64::kStack, 0));
    for (int k = 0; k < 5; ++k)
      add(a64::pair(a64::kStorePair, kAtX + 2 * k, kAtX + 2 * k + 1, kSaved + 16 * k));
    for (int k = 0; k < 4; ++k)
      add(a64::pair(a64::kStoreFloatingPair, 8 + 2 * k, 9 + 2 * k, kSavedFloating + 16 * k));
    for (int k = 0; k < 7; ++k) add(a64::move(kAtX + k, k));
    add(a64::move(kLeft, 7));
    add(a64::load_integer(kAtStatus, kFrame, kFrameBytes + 8));
    constant(kAtPool, reinterpret_cast<std::uintptr_t>(layout_.pool));
    begin_strides();
    address(kSecondStep, {Location::kWork, layout_.unwanted});
    for (int k : {kAtY, kAtJacobian, kAtHessian}) begin_output(k);
    add(a64::branch_unless_zero(kLeft, 2));
    done_ = words_.size();
    add(0);  // a branch to the end
    again_ = words_.size();
  }

  void begin_strides() {
    const dyntape_strides& n = layout_.sizes;
    const std::size_t sizes[] = {n.x, n.p, n.w, n.y, n.jacobian, n.hessian};
    for (int k = 0; k < 6; ++k) {
      constant(kStep, sizes[k] * 8 * std::size_t(lanes_));
      add(a64::store_integer(kStep, kFrame, stride(k)));
    }
    add(a64::load_integer(kSecondStep, kFrame, kFrameBytes));
    skipping(a64::branch_if_zero, kSecondStep, [&] {
      for (int k = 0; k < 6; ++k) {
        add(a64::load_integer(kStep, kSecondStep, static_cast<Word>(8 * k)));
        add(a64::times_eight(kStep, kStep));
        add(a64::store_integer(kStep, kFrame, stride(k)));
      }
    });
  }

  // What nobody wants goes to the work array, and stays there.
  void begin_output(int output) {
    skipping(a64::branch_unless_zero, output, [&] {
      add(a64::move(output, kSecondStep));
      constant(kStep, 0);
      add(a64::store_integer(kStep, kFrame, stride(output - kAtX)));
    });
  }

  void end() {
    for (int k = 0; k < 5; ++k)
      add(a64::pair(a64::kLoadPair, kAtX + 2 * k, kAtX + 2 * k + 1, kSaved + 16 * k));
    for (int k = 0; k < 4; ++k)
      add(a64::pair(a64::kLoadFloatingPair, 8 + 2 * k, 9 + 2 * k, kSavedFloating + 16 * k));
    add(a64::pair(a64::kLoadPairAndMove, kFrame, kLink, kFrameBytes));
    add(a64::kReturn);
  }

  // --- branches, calls, addresses ---

  static std::int64_t distance(std::size_t from, std::size_t to) {
    const auto words = static_cast<std::int64_t>(to) - static_cast<std::int64_t>(from);
    if (words >= 1 << 25 || words < -(1 << 25)) throw Unavailable("a function is too long for machine code");
    return words;
  }
  Word branch_to(std::size_t target) const { return a64::branch(distance(words_.size(), target)); }

  // A branch, depending on a register, over what `inner` adds, which is short.
  template <class Inner>
  void skipping(Word (*branch)(int, int), int r, Inner&& inner) {
    const std::size_t from = words_.size();
    add(0);
    inner();
    words_[from] = branch(r, int(words_.size() - from));
  }

  void call_address(const void* function) {
    constant(kAddress, reinterpret_cast<std::uintptr_t>(function));
    add(a64::call(kAddress));
  }

  void constant(int to, std::uint64_t value) {
    bool keeps_others = false;
    for (int k = 0; k < 4; ++k) {
      const auto part = static_cast<Word>(value >> 16 * k & 0xffff);
      if (part == 0 && !(k == 3 && !keeps_others)) continue;
      add(a64::put_bits(to, part, k, keeps_others));
      keeps_others = true;
    }
  }

  int base(Location place) const {
    switch (place.kind) {
      case Location::kX:
        return kAtX;
      case Location::kP:
        return kAtP;
      case Location::kW:
        return kAtW;
      case Location::kPool:
        return kAtPool;
      case Location::kY:
        return kAtY;
      case Location::kJacobian:
        return kAtJacobian;
      case Location::kHessian:
        return kAtHessian;
      default:
        return kAtWork;
    }
  }
  int bytes() const { return 8 * lanes_; }
  std::uint64_t offset(Location place) const {
    return std::uint64_t{place.index} * static_cast<std::uint64_t>(bytes());
  }

  void address(int to, Location place) {
    const std::uint64_t by = offset(place);
    if (by < 4096) return add(a64::add_constant(to, base(place), static_cast<Word>(by)));
    constant(kAddress, by);
    add(a64::add(to, base(place), kAddress));
  }

  // Offsets of twelve bits stand in the instruction, those of twenty-four in an addition and the instruction.
  template <class Near, class Far>
  void access(int r, Location place, Near near, Far far) {
    const std::uint64_t by = offset(place);
    const int from = base(place);
    if (by / static_cast<std::uint64_t>(bytes()) < 4096)
      return add(near(bytes(), r, from, static_cast<Word>(by)));
    if (by < 1 << 24) {
      add(a64::add_constant(kAddress, from, static_cast<Word>(by >> 12), true));
      return add(near(bytes(), r, kAddress, static_cast<Word>(by & 4095)));
    }
    constant(kAddress, by);
    add(far(bytes(), r, from, kAddress));
  }

  // --- operations ---

  // One argument stands in memory at most.
  int reg(Location place) {
    if (place.is_register()) return int(place.index);
    load(scratch(0), place);
    return scratch(0);
  }

  void binary(Instruction instruction, int r, const std::array<Location, 3>& a) {
    const int x = reg(a[0]), y = reg(a[1]);
    add(a64::word(instruction.of(lanes_), r, x, y));
  }
  void unary(Instruction instruction, int r, Location x) {
    const int value = reg(x);
    add(a64::word(instruction.of(lanes_), r, value));
  }

  // mask ? x : y, bit by bit; `mask` is lost.
  void choose(int r, int mask, int x, int y) {
    add(a64::word(a64::kChoose, mask, x, y));
    load(r, Location::in(mask));
  }
  // Where a mask may be made: in r unless an argument is there.
  static int mask_in(int r, int x, int y) { return r == x || r == y ? scratch(1) : r; }

  // The first where they are equal or not ordered.
  void extreme(int r, int x, int y, bool least) {
    const int mask = mask_in(r, x, y);
    add(a64::word(a64::kGreater.of(lanes_), mask, least ? x : y, least ? y : x));
    choose(r, mask, y, x);
  }

  void copy_sign(int r, int x, int y) {
    add(a64::word(a64::kZeros, scratch(1)));
    add(a64::word(a64::kNegate.vector, scratch(1), scratch(1)));
    choose(r, scratch(1), y, x);
  }

  // r = +-x y +- z.
  void fused(int r, const std::array<Location, 3>& a, Word scalar, Word vector, bool negates) {
    const int x = reg(a[0]), y = reg(a[1]);
    int z = r;
    if (a[2].is_register())
      z = int(a[2].index);
    else
      load(r, a[2]);
    if (lanes_ == 1) return add(a64::word_of_four(scalar, r, x, y, z));
    negates ? add(a64::word(a64::kNegate.vector, r, z)) : load(r, Location::in(z));
    add(a64::word(vector, r, x, y));
  }

  // 1 where it holds, or where it does not.
  void truth(int r, Instruction comparison, int x, int y, Word with_mask) {
    add(a64::word(comparison.of(lanes_), scratch(1), x, y));
    add(a64::word(a64::kOnes, scratch(2)));
    add(a64::word(with_mask, r, scratch(2), scratch(1)));
  }

  void sign(int r, int x) {
    add(a64::word(a64::kGreaterZero.of(lanes_), scratch(1), x));
    add(a64::word(a64::kLessZero.of(lanes_), r, x));
    add(a64::word(a64::kOnes, scratch(2)));
    add(a64::word(a64::kAnd, scratch(1), scratch(1), scratch(2)));
    add(a64::word(a64::kAnd, r, r, scratch(2)));
    add(a64::word(a64::kSub.of(lanes_), r, scratch(1), r));
  }

  void select(int r, int condition, int x, int y) {
    const int mask = mask_in(r, x, y);
    add(a64::word(a64::kEqualZero.of(lanes_), mask, condition));
    choose(r, mask, y, x);
  }

  const KernelLayout layout_;
  const int lanes_;
  std::vector<Word> words_;
  std::size_t again_ = 0, done_ = 0;
};

bool Encoder::can_encode(int lanes) { return lanes <= 2; }

int Encoder::registers() const { return kVectorRegisters - kScratchRegisters; }

std::span<const std::uint8_t> Encoder::code() const { return made_->code(); }

}  // namespace dyntape::codegen

#include <dyntape/codegen/machine/encoder_calls.hxx>

#endif
