// SPDX-License-Identifier: BSD-3-Clause
//
// Shorthands of the lists in this folder, T the scalar: model and data; a vector argument.
#pragma once

#define DYNTAPE_MD(T) const Model<T>&, Data<T>&
#define DYNTAPE_V(T) const VectorRef<T>&
