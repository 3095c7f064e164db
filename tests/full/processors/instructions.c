/* SPDX-License-Identifier: BSD-3-Clause
 *
 * A plugin of qemu's user emulators that counts instructions, and prints those so far whenever the program calls
 * close(-31415) (instructions.py).  Debian ships the interface without its header, so what is used of it is declared
 * here (docs/devel/tcg-plugins.rst of qemu 7.2). */
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

struct qemu_plugin_tb;
int qemu_plugin_version = 1;
void qemu_plugin_register_vcpu_tb_trans_cb(uint64_t plugin,
                                           void (*translated)(uint64_t, struct qemu_plugin_tb*));
void qemu_plugin_register_vcpu_tb_exec_inline(struct qemu_plugin_tb* block, int add, void* sum,
                                              uint64_t number);
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb* block);
typedef void (*Called)(uint64_t, unsigned, int64_t, uint64_t, uint64_t, uint64_t, uint64_t, uint64_t,
                       uint64_t, uint64_t, uint64_t);
void qemu_plugin_register_vcpu_syscall_cb(uint64_t plugin, Called called);

static uint64_t count;

static void translated(uint64_t plugin, struct qemu_plugin_tb* block) {
  (void)plugin;
  qemu_plugin_register_vcpu_tb_exec_inline(block, 0, &count, qemu_plugin_tb_n_insns(block));
}

static void called(uint64_t plugin, unsigned processor, int64_t number, uint64_t a, uint64_t b, uint64_t c,
                   uint64_t d, uint64_t e, uint64_t f, uint64_t g, uint64_t h) {
  (void)plugin, (void)processor, (void)number, (void)b, (void)c, (void)d, (void)e, (void)f, (void)g, (void)h;
  if ((int32_t)a == -31415) fprintf(stderr, "instructions %llu\n", (unsigned long long)count);
}

int qemu_plugin_install(uint64_t plugin, const void* about, int n, char** arguments) {
  (void)about;
  (void)n;
  (void)arguments;
  qemu_plugin_register_vcpu_tb_trans_cb(plugin, translated);
  qemu_plugin_register_vcpu_syscall_cb(plugin, called);
  return 0;
}
