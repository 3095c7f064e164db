// SPDX-License-Identifier: BSD-3-Clause
//
// The harness on a bare Cortex-M7: start, output by semihosting, and how deep the stack went.
#include <stdint.h>

#include "harness.h"

extern uint32_t bss_begin[], bss_end[], stack_end[], stack_top[];

static void semihost(uint32_t operation, const void* argument) {
  register uint32_t r0 __asm__("r0") = operation;
  register const void* r1 __asm__("r1") = argument;
  __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
}

void put(const char* text) { semihost(0x04, text); }

static void put_number(const char* name, uint32_t number) {
  char digits[12];
  int i = 11;
  put(name);
  digits[i] = 0;
  digits[--i] = '\n';
  do {
    digits[--i] = (char)('0' + number % 10);
  } while (number /= 10);
  put(digits + i);
}

// What is below the stack pointer is painted; where paint is missing afterwards, the stack has been.
static __attribute__((noinline)) void main_program(void) {
  const uint32_t paint = 0x5ca1ab1eu;
  volatile uint32_t* place;
  uint32_t* top;
  __asm__ volatile("mov %0, sp" : "=r"(top));
  for (place = stack_end; place < top; ++place) *place = paint;
  run();
  for (place = stack_end; place < top && *place == paint;) ++place;
  put_number("stack ", (uint32_t)((char*)top - (char*)place));
}

void start(void) {
  uint32_t* place;
  *(volatile uint32_t*)0xe000ed88 |= 0xfu << 20;  // the floating-point unit
  __asm__ volatile("dsb\n isb" ::: "memory");
  for (place = bss_begin; place < bss_end; ++place) *place = 0;
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
