/* SPDX-License-Identifier: BSD-3-Clause
 *
 * The C interface of generated code, in C99 that is also C++: what a kernel is called with, and the
 * description that every library exports.  The text between the two marks below stands in every generated
 * file as well, so that a file needs nothing else.
 *
 *   const dyntape_descriptor* d = ...;              dlsym(handle, "dyntape_<content hash>")
 *   d->kernels[0].run(x, p, w, y, NULL, NULL, work, 1, NULL, &status);          y = f(x, p)
 *
 * A change of anything between the marks raises DYNTAPE_ABI; libraries of another number are never used.
 */
#ifndef DYNTAPE_CODEGEN_ABI_H
#define DYNTAPE_CODEGEN_ABI_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* --- begin of the interface --- */
#ifndef DYNTAPE_ABI
#define DYNTAPE_ABI 3

/* Doubles from one point, or block of points, to the next, for each array. */
typedef struct dyntape_strides {
  size_t x, p, w, y, jacobian, hessian;
} dyntape_strides;

/* Evaluates `lanes` points, one after the other or, in a kernel of lane width W > 1, in blocks of W: entry i of
 * lane l of block b of an array of n entries a point is at [(b * n + i) * W + l], and `lanes` is a multiple of W.
 *   x, p, w    variables, parameters, weights; w is the function's own weights and then, for second order,
 *              one weight an output.  A block of no entries may be NULL.
 *   y, jacobian, hessian   outputs: all of y; the non-zeros in the order of the patterns (of the Hessian of
 *              the weighted sum of outputs: the lower triangle).  NULL: not wanted.
 *   work       room for as many doubles as the kernel says, for all lanes together
 *   strides    NULL: the points, or blocks, of every array follow each other without gaps
 *   status     one word a point: 0, or 1 + index of the first violated guard.  NULL: not wanted.
 * Outputs and work overlap with nothing. */
typedef void dyntape_function(const double* x, const double* p, const double* w, double* y, double* jacobian,
                              double* hessian, double* work, size_t lanes, const dyntape_strides* strides,
                              uint32_t* status);
typedef dyntape_function* dyntape_run;

typedef struct dyntape_kernel {
  uint32_t order;      /* 0: y; 1: and Jacobian; 2: and Hessian */
  uint32_t lane_width; /* points side by side in memory: 1 is an array of structures */
  size_t work;         /* doubles */
  uint32_t operations; /* of one point */
  uint32_t live;       /* most values that are live at once */
  dyntape_run run;
} dyntape_kernel;

typedef struct dyntape_block {
  uint32_t size;
  const char* const* names; /* NULL, or one an entry */
} dyntape_block;

typedef struct dyntape_pattern {
  uint32_t rows, cols, nnz;
  const uint32_t *row, *col; /* sorted by row, then column; NULL where nnz is 0 */
} dyntape_pattern;

typedef struct dyntape_guard {
  const char* file;
  uint32_t line;
  uint32_t expected; /* 1: the comparison was true when recorded */
} dyntape_guard;

typedef struct dyntape_descriptor {
  uint32_t abi;   /* DYNTAPE_ABI */
  uint32_t bytes; /* sizeof(dyntape_descriptor) */
  const char* generator;
  const char* name;
  const char* content_hash; /* of the function, before derivation */
  const char* scalar;       /* "double" */
  dyntape_block x, p, w, y;
  dyntape_pattern jacobian, hessian;
  uint32_t n_guards, n_kernels;
  const dyntape_guard* guards;
  const dyntape_kernel* kernels; /* by lane width, then by order; of one lane always */
} dyntape_descriptor;
#endif
/* --- end of the interface --- */

#ifdef __cplusplus
}
#endif

#endif
