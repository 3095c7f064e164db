/* SPDX-License-Identifier: BSD-3-Clause
 *
 * A compiler for aarch64 that runs on this machine: -DCOMPILER, with the words -DWORDS before the others.  It knows no processor of its
 * own, so "native" is a Cortex-A76.  A program, since the identity of a script is never stored (codegen/build/identity.h). */
#include <stdio.h>
#include <string.h>
#include <unistd.h>

int main(int count, char** arguments) {
  static char* words[100000] = {COMPILER, WORDS};
  int n = 0, i;
  while (words[n]) ++n;
  for (i = 1; i < count; ++i) {
    const char* const value = strchr(arguments[i], '=');
    const int is_native = strncmp(arguments[i], "-m", 2) == 0 && value && strcmp(value, "=native") == 0;
    words[n++] = is_native ? "-mcpu=cortex-a76" : arguments[i];
  }
  execvp(words[0], words);
  perror(words[0]);
  return 1;
}
