// SPDX-License-Identifier: BSD-3-Clause
//
// Shorthands of the lists in this folder, T the scalar: model and data, and effects; a vector argument.
#pragma once

#define DYNTAPE_MD(T) const Model<T>&, Data<T>&
#define DYNTAPE_MDE(T) const Model<T>&, Data<T>&, EffectTorques<T>&, const Effects<T>&
#define DYNTAPE_V(T) const VectorRef<T>&
