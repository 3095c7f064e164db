// SPDX-License-Identifier: BSD-3-Clause
//
// A bare Cortex-M: start, output by semihosting, how deep the stack went (printed at the end), and instructions by the timer
// of qemu -icount shift=0, whose 25 MHz are 40 instructions a tick.
#include "target.h"

extern uint32_t bss_begin[], bss_end[], stack_end[], stack_top[];

static void semihost(uint32_t operation, const void* argument) {
  register uint32_t r0 __asm__("r0") = operation;
  register const void* r1 __asm__("r1") = argument;
  __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
}

void put(const char* text) { semihost(0x04, text); }

void put_number(const char* name, int32_t number) {
  char digits[14];
  int i = 13;
  uint32_t rest = number < 0 ? 0u - (uint32_t)number : (uint32_t)number;
  put(name);
  digits[i] = 0;
  digits[--i] = '\n';
  do {
    digits[--i] = (char)('0' + rest % 10);
  } while (rest /= 10);
  if (number < 0) digits[--i] = '-';
  put(digits + i);
}

// Counts down from 2^24 - 1; a difference of more than 671 million instructions is lost.
uint32_t instructions(void) {
  static uint32_t last, high;
  const uint32_t now = 0xffffffu - *(volatile uint32_t*)0xe000e018;
  if (now < last) high += 0x1000000u;
  last = now;
  return (high + now) * 40u;
}

// The stack below the stack pointer is painted; the first word without paint afterwards is the deepest that was used.
static __attribute__((noinline)) void main_program(void) {
  const uint32_t paint = 0x5ca1ab1eu;
  volatile uint32_t* place;
  uint32_t* top;
  __asm__ volatile("mov %0, sp" : "=r"(top));
  for (place = stack_end; place < top; ++place) *place = paint;
  run();
  for (place = stack_end; place < top && *place == paint;) ++place;
  put_number("stack ", (int32_t)((char*)top - (char*)place));
}

void start(void) {
  *(volatile uint32_t*)0xe000ed88 |= 0xfu << 20;  // the floating-point unit
  __asm__ volatile("dsb\n isb" ::: "memory");
  for (uint32_t* place = bss_begin; place < bss_end; ++place) *place = 0;
  *(volatile uint32_t*)0xe000e014 = 0xffffffu;
  *(volatile uint32_t*)0xe000e018 = 0;
  *(volatile uint32_t*)0xe000e010 = 5;  // the processor's clock, no interrupt
  main_program();
  semihost(0x18, (const void*)0x20026);  // the end, with success
  for (;;) continue;
}

static void fault(void) {
  put("fault\n");
  semihost(0x18, (const void*)0x20024);
  for (;;) continue;
}

__attribute__((section(".vectors"), used)) static void* const vectors[16] = {
    stack_top, (void*)start, (void*)fault, (void*)fault, (void*)fault, (void*)fault, (void*)fault};
