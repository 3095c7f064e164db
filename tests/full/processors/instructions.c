/* SPDX-License-Identifier: BSD-3-Clause
 *
 * A plugin of qemu's user emulators that counts the instructions of a program and prints them when it ends (instructions.sh).
 * Debian ships the interface without its header, so what is used of it is declared here (docs/devel/tcg-plugins.rst of qemu 7.2). */
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

struct qemu_plugin_tb;
int qemu_plugin_version = 1;
void qemu_plugin_register_vcpu_tb_trans_cb(uint64_t plugin, void (*translated)(uint64_t, struct qemu_plugin_tb*));
void qemu_plugin_register_vcpu_tb_exec_inline(struct qemu_plugin_tb* block, int add, void* sum, uint64_t number);
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb* block);
void qemu_plugin_register_atexit_cb(uint64_t plugin, void (*ended)(uint64_t, void*), void* nothing);

static uint64_t count;

static void translated(uint64_t plugin, struct qemu_plugin_tb* block) {
  (void)plugin;
  qemu_plugin_register_vcpu_tb_exec_inline(block, 0, &count, qemu_plugin_tb_n_insns(block));
}

static void ended(uint64_t plugin, void* nothing) {
  (void)plugin;
  (void)nothing;
  fprintf(stderr, "instructions %llu\n", (unsigned long long)count);
}

int qemu_plugin_install(uint64_t plugin, const void* about, int n, char** arguments) {
  (void)about;
  (void)n;
  (void)arguments;
  qemu_plugin_register_vcpu_tb_trans_cb(plugin, translated);
  qemu_plugin_register_atexit_cb(plugin, ended, NULL);
  return 0;
}
