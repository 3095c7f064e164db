// SPDX-License-Identifier: BSD-3-Clause
//
// numpy's C interface, one table of functions for all units; arrays.cpp imports it.
#pragma once

#define NPY_NO_DEPRECATED_API NPY_1_22_API_VERSION
#define NPY_TARGET_VERSION NPY_1_22_API_VERSION
#define PY_ARRAY_UNIQUE_SYMBOL dyntape_numpy_api
#ifndef DYNTAPE_IMPORTS_NUMPY
#define NO_IMPORT_ARRAY
#endif
#include <numpy/arrayobject.h>
