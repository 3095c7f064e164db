// SPDX-License-Identifier: BSD-3-Clause
//
// Vectors that travel along a tree for every column of the motion subspace.  They are stored by quantity, `stride`
// apart, with the columns of a subtree contiguous (Tree::begin, end), so that one instruction serves several.
#pragma once

#include <dyntape/dynamics/algorithms/data.h>
#include <dyntape/dynamics/algorithms/detail/lanes.hxx>

namespace dyntape::dynamics::detail {

template <class T>
DYNTAPE_INLINE void put(T* quantity, std::ptrdiff_t stride, int place, const Vector3<T>& v) {
  for (int k = 0; k < 3; ++k) put_lane(quantity + k * stride, place, v.at(k));
}
template <class T, class Spatial>
DYNTAPE_INLINE void put_spatial(T* quantity, std::ptrdiff_t stride, int place, const Spatial& x) {
  put(quantity, stride, place, x.linear);
  put(quantity + 3 * stride, stride, place, x.angular);
}

// S . F_s of one group of columns.
template <class T, class Group>
DYNTAPE_INLINE typename Lanes<T>::Vector dot_group(const Axis& axis, const T* x, std::ptrdiff_t stride,
                                                   const Group& lanes) {
  using Vector = typename Lanes<T>::Vector;
  if (axis.index >= 0) {
    const Vector along = lanes.load(x + axis.index * stride);
    return axis.flipped ? Vector(-along) : along;
  }
  const Vector3<T> a = vector<T>(axis);
  return lanes.load(x) * a.at(0) + lanes.load(x + stride) * a.at(1) + lanes.load(x + 2 * stride) * a.at(2);
}
template <class T, class Group>
DYNTAPE_INLINE typename Lanes<T>::Vector dot_group(const Dof& S, const T* F, std::ptrdiff_t stride,
                                                   const Group& lanes) {
  using Vector = typename Lanes<T>::Vector;
  const Vector along = dot_group<T>(S.axis, S.angular ? F + 3 * stride : F, stride, lanes);
  if (S.pitch == 0) return along;
  const Vector3<T> a = motion<T>(S).linear;
  return along +
         (lanes.load(F) * a.at(0) + lanes.load(F + stride) * a.at(1) + lanes.load(F + 2 * stride) * a.at(2));
}

// Six entries of one group of columns.
template <class T>
struct SixLanes {
  using Vector = typename Lanes<T>::Vector;
  Vector x[6];

  template <class Group>
  DYNTAPE_INLINE SixLanes(const T* from, std::ptrdiff_t stride, const Group& lanes) {
    for (int k = 0; k < 6; ++k) x[k] = lanes.load(from + k * stride);
  }
  template <class Group>
  DYNTAPE_INLINE void store(T* to, std::ptrdiff_t stride, const Group& lanes) const {
    for (int k = 0; k < 6; ++k) lanes.store(to + k * stride, x[k]);
  }
  template <class Spatial>
  DYNTAPE_INLINE Vector dot(const Spatial& a) const {
    const Vector3<T>&l = a.linear, &w = a.angular;
    return (x[0] * l.at(0) + x[1] * l.at(1) + x[2] * l.at(2)) +
           (x[3] * w.at(0) + x[4] * w.at(1) + x[5] * w.at(2));
  }
  // Forces, in the parent's frame.
  DYNTAPE_INLINE void act(const Placement<T>& X_PB) {
    const Matrix3<T>& R = X_PB.R;
    const Vector3<T>& p = X_PB.p;
    rotate(R, 0, false);
    rotate(R, 3, false);
    x[3] = x[3] + (x[2] * p.at(1) - x[1] * p.at(2));
    x[4] = x[4] + (x[0] * p.at(2) - x[2] * p.at(0));
    x[5] = x[5] + (x[1] * p.at(0) - x[0] * p.at(1));
  }
  // Motions of the parent, in the body's frame.
  DYNTAPE_INLINE void act_inverse(const Placement<T>& X_PB) {
    const Vector3<T>& p = X_PB.p;
    x[0] = x[0] - (x[5] * p.at(1) - x[4] * p.at(2));
    x[1] = x[1] - (x[3] * p.at(2) - x[5] * p.at(0));
    x[2] = x[2] - (x[4] * p.at(0) - x[3] * p.at(1));
    rotate(X_PB.R, 0, true);
    rotate(X_PB.R, 3, true);
  }
  DYNTAPE_INLINE void rotate(const Matrix3<T>& R, int first, bool back) {
    const Vector a = x[first], b = x[first + 1], c = x[first + 2];
    for (int k = 0; k < 3; ++k) {
      x[first + k] = back ? Vector(a * R.at(0, k) + b * R.at(1, k) + c * R.at(2, k))
                          : Vector(a * R.at(k, 0) + b * R.at(k, 1) + c * R.at(k, 2));
    }
  }
};

// A (k, s) = A (s, k) = row[s] for the columns at the positions [begin, end).
template <class T>
DYNTAPE_INLINE void mirror(const Tree& tree, int k, int begin, int end, const T* row, MatrixX<T>& A) {
  const std::ptrdiff_t nv = A.rows();
  T *column = A.data() + k * nv, *across = A.data() + k;
  if (tree.in_order) {
    for (std::ptrdiff_t s = begin; s < end; ++s) column[s] = row[s];
    for (std::ptrdiff_t s = begin; s < end; ++s) across[s * nv] = row[s];
  } else {
    for (int s = begin; s < end; ++s) column[tree.dof_at[s]] = across[tree.dof_at[s] * nv] = row[s];
  }
}

// row[s] = S . F_s, six quantities at F.
template <class T>
DYNTAPE_INLINE void dot_columns(const Dof& S, const T* F, std::ptrdiff_t stride, int begin, int end, T* row) {
  over<T>(begin, end,
          [&](int s, auto lanes) { lanes.store(row + s, dot_group<T>(S, F + s, stride, lanes)); });
}

// row[s] = a . m_s, six quantities at m.
template <class T, class Spatial>
DYNTAPE_INLINE void project_columns(const Spatial& a, const T* m, std::ptrdiff_t stride, int begin, int end,
                                    T* row) {
  over<T>(begin, end,
          [&](int s, auto lanes) { lanes.store(row + s, SixLanes<T>(m + s, stride, lanes).dot(a)); });
}

// m_s += S row[s].
template <class T>
DYNTAPE_INLINE void add_along_columns(const Dof& S, const T* row, T* m, std::ptrdiff_t stride, int begin,
                                      int end) {
  const auto add = [&](T* x, double scale) {
    for (int k = 0; k < 3; ++k) {
      const double a = S.axis.direction[k] * scale;
      if (a == 0) continue;
      T* along = x + k * stride;
      over<T>(begin, end, [&](int s, auto lanes) {
        const auto r = lanes.load(row + s), x = lanes.load(along + s);
        if (a == 1) {
          lanes.store(along + s, x + r);
        } else if (a == -1) {
          lanes.store(along + s, x - r);
        } else {
          lanes.store(along + s, x + r * T(a));
        }
      });
    }
  };
  add(S.angular ? m + 3 * stride : m, 1);
  if (S.pitch != 0) add(m, S.pitch);
}

// Rotates three quantities: x_s <- R x_s.
template <class T>
DYNTAPE_INLINE void rotate_columns(const Matrix3<T>& R, T* x, std::ptrdiff_t stride, int begin, int end) {
  over_before<T>(begin, end, [&](int s, auto lanes) {
    const auto a = lanes.load(x + s), b = lanes.load(x + s + stride), c = lanes.load(x + s + 2 * stride);
    for (int k = 0; k < 3; ++k) {
      lanes.store(x + s + k * stride, a * R.at(k, 0) + b * R.at(k, 1) + c * R.at(k, 2));
    }
  });
}

// Transforms forces to the parent: F_s <- act(X_PB, F_s).
template <class T>
DYNTAPE_INLINE void act_columns(const Placement<T>& X_PB, T* F, std::ptrdiff_t stride, int begin, int end) {
  over_before<T>(begin, end, [&](int s, auto lanes) {
    SixLanes<T> f(F + s, stride, lanes);
    f.act(X_PB);
    f.store(F + s, stride, lanes);
  });
}

// Transforms motions of the parent to the body: to_s = act_inverse(X_PB, from_s).
template <class T>
DYNTAPE_INLINE void act_inverse_columns(const Placement<T>& X_PB, const T* from, T* to, std::ptrdiff_t stride,
                                        int begin, int end) {
  over<T>(begin, end, [&](int s, auto lanes) {
    SixLanes<T> m(from + s, stride, lanes);
    m.act_inverse(X_PB);
    m.store(to + s, stride, lanes);
  });
}

}  // namespace dyntape::dynamics::detail
