// SPDX-License-Identifier: BSD-3-Clause
//
// Words of A64, the instruction set of aarch64: those that encoder_a64.cpp needs.
//
//   word(kAddScalar, 2, 0, 1)             fadd d2, d0, d1
//   load_word(8, 3, 19, 16)               ldr d3, [x19, #16]
//
// Source: Arm Architecture Reference Manual for A-profile architecture (DDI 0487), C6 and C7.
#pragma once

#include <cstdint>

namespace dyntape::codegen::a64 {

using Word = std::uint32_t;

// An instruction of doubles: of one in a register, or of two.
struct Instruction {
  Word scalar, vector;
  Word of(int lanes) const { return lanes == 1 ? scalar : vector; }
};

// To, two arguments.
inline constexpr Instruction kAdd = {0x1e602800, 0x4e60d400};
inline constexpr Instruction kSub = {0x1e603800, 0x4ee0d400};
inline constexpr Instruction kMul = {0x1e600800, 0x6e60dc00};
inline constexpr Instruction kDiv = {0x1e601800, 0x6e60fc00};
// All ones where it holds, else zero.
inline constexpr Instruction kEqual = {0x5e60e400, 0x4e60e400};
inline constexpr Instruction kGreaterEqual = {0x7e60e400, 0x6e60e400};
inline constexpr Instruction kGreater = {0x7ee0e400, 0x6ee0e400};
// To, one argument.
inline constexpr Instruction kNegate = {0x1e614000, 0x6ee0f800};
inline constexpr Instruction kMagnitude = {0x1e60c000, 0x4ee0f800};
inline constexpr Instruction kSquareRoot = {0x1e61c000, 0x6ee1f800};
inline constexpr Instruction kRoundDown = {0x1e654000, 0x4e619800};
inline constexpr Instruction kRoundUp = {0x1e64c000, 0x4ee18800};
inline constexpr Instruction kRoundToZero = {0x1e65c000, 0x4ee19800};
inline constexpr Instruction kRoundAsSet = {0x1e67c000, 0x6ee19800};
inline constexpr Instruction kEqualZero = {0x5ee0d800, 0x4ee0d800};
inline constexpr Instruction kGreaterZero = {0x5ee0c800, 0x4ee0c800};
inline constexpr Instruction kLessZero = {0x5ee0e800, 0x4ee0e800};

// Scalar, with a fourth register: to, two factors, a summand.
inline constexpr Word kMulAdd = 0x1f400000;        // summand + product
inline constexpr Word kMulSub = 0x1f408000;        // summand - product
inline constexpr Word kNegMulAdd = 0x1f600000;     // -summand - product
inline constexpr Word kNegMulSub = 0x1f608000;     // product - summand
inline constexpr Word kVectorMulAdd = 0x4e60cc00;  // to += product
inline constexpr Word kVectorMulSub = 0x4ee0cc00;  // to -= product

// Bits of whole registers.
inline constexpr Word kAnd = 0x4e201c00;
inline constexpr Word kAndNot = 0x4e601c00;
inline constexpr Word kOr = 0x4ea01c00;
inline constexpr Word kChoose = 0x6e601c00;  // to = to ? first : second, bit by bit
inline constexpr Word kZeros = 0x6f00e400;   // to
inline constexpr Word kOnes = 0x6f03f600;    // to: 1.0, twice

inline constexpr Word kReturn = 0xd65f03c0;
inline constexpr int kStack = 31;  // the stack pointer, as a base

constexpr Word at(int r, int bit) { return static_cast<Word>(r) << bit; }

constexpr Word word(Word operation, int to, int first = 0, int second = 0) {
  return operation | at(second, 16) | at(first, 5) | at(to, 0);
}
constexpr Word word_of_four(Word operation, int to, int first, int second, int third) {
  return word(operation, to, first, second) | at(third, 10);
}

// Registers of integers.
constexpr Word move(int to, int from) { return 0xaa0003e0 | at(from, 16) | at(to, 0); }
constexpr Word add(int to, int first, int second) { return word(0x8b000000, to, first, second); }
// `shifted`: times 4096.
constexpr Word add_constant(int to, int from, Word twelve_bits, bool shifted = false) {
  return word(0x91000000, to, from) | twelve_bits << 10 | (shifted ? 1u << 22 : 0u);
}
constexpr Word subtract_and_compare(int to, int from, Word twelve_bits) {
  return word(0xf1000000, to, from) | twelve_bits << 10;
}
constexpr Word times_eight(int to, int from) { return word(0xd37df000, to, from); }
constexpr Word put_bits(int to, Word sixteen_bits, int place, bool keeps_others) {
  return (keeps_others ? 0xf2800000u : 0xd2800000u) | at(place, 21) | sixteen_bits << 5 | at(to, 0);
}
constexpr Word load_integer(int to, int base, Word offset) {
  return word(0xf9400000, to, base) | offset / 8 << 10;
}
constexpr Word store_integer(int from, int base, Word offset) {
  return word(0xf9000000, from, base) | offset / 8 << 10;
}

// Floating-point registers of 8 or 16 bytes.  `offset`: a multiple of their size, at most 4095 times it; or in a
// register.
constexpr Word load_word(int bytes, int to, int base, Word offset) {
  return word(bytes == 8 ? 0xfd400000 : 0x3dc00000, to, base) | offset / static_cast<Word>(bytes) << 10;
}
constexpr Word store_word(int bytes, int from, int base, Word offset) {
  return word(bytes == 8 ? 0xfd000000 : 0x3d800000, from, base) | offset / static_cast<Word>(bytes) << 10;
}
constexpr Word load_word_by(int bytes, int to, int base, int offset) {
  return word(bytes == 8 ? 0xfc606800 : 0x3ce06800, to, base, offset);
}
constexpr Word store_word_by(int bytes, int from, int base, int offset) {
  return word(bytes == 8 ? 0xfc206800 : 0x3ca06800, from, base, offset);
}

// Two registers at [stack pointer + offset].
constexpr Word pair(Word operation, int first, int second, int offset) {
  return operation | (static_cast<Word>(offset / 8) & 0x7f) << 15 | at(second, 10) | at(kStack, 5) |
         at(first, 0);
}
inline constexpr Word kStorePair = 0xa9000000, kLoadPair = 0xa9400000;
inline constexpr Word kStorePairAndMove = 0xa9800000;  // the stack pointer to the address, before
inline constexpr Word kLoadPairAndMove = 0xa8c00000;   // behind
inline constexpr Word kStoreFloatingPair = 0x6d000000, kLoadFloatingPair = 0x6d400000;

// Branches over so many words.
constexpr Word branch(std::int64_t words) { return 0x14000000 | (static_cast<Word>(words) & 0x3ffffff); }
constexpr Word branch_if_zero(int r, int words) { return 0xb4000000 | at(words, 5) | at(r, 0); }
constexpr Word branch_unless_zero(int r, int words) { return 0xb5000000 | at(words, 5) | at(r, 0); }
constexpr Word branch_unless_higher(int words) { return 0x54000009 | at(words, 5); }
constexpr Word call(int r) { return 0xd63f0000 | at(r, 5); }

}  // namespace dyntape::codegen::a64
