// SPDX-License-Identifier: BSD-3-Clause
//
// Vectors and matrices of three for the recursions: Eigen's types with dyntape's own scalar code.
//
//   Vector3<double> y = R * x + a.cross(b);       // straight-line scalar code, each sum from left to right
//   Eigen::Vector3d z = y;                        // still an Eigen vector
//
// Reason: Eigen stores three doubles as a pair and a single and loads them in other sizes, which stalls the
// processor; and it adds doubles in another order than other scalars.  Here every scalar has the same operations in
// the same order, so double, a recording and a pack of lanes have equal bits.  Operations that are not defined here
// are Eigen's.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <concepts>

#include <dyntape/autodiff/eigen_layout.h>

// Forces inlining of the algebra of three and six entries: the compiler's calls take twice the time.  Sanitizers and
// debug builds use calls, which compile faster.
#if defined(__OPTIMIZE__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define DYNTAPE_INLINE inline __attribute__((always_inline))
#else
#define DYNTAPE_INLINE inline
#endif

namespace dyntape::dynamics {

template <class T>
struct Vector3 : Eigen::Matrix<T, 3, 1> {
  using Eigen3 = Eigen::Matrix<T, 3, 1>;
  using Eigen3::operator+=;
  using Eigen3::operator-=;
  using Eigen3::cross;
  using Eigen3::dot;

  Vector3() = default;
  DYNTAPE_INLINE Vector3(const T& x, const T& y, const T& z) : Eigen3(x, y, z) {}
  DYNTAPE_INLINE Vector3(const Vector3& o) : Eigen3(o.at(0), o.at(1), o.at(2)) {}
  template <class D>
  Vector3(const Eigen::MatrixBase<D>& expression) : Eigen3(expression) {}

  DYNTAPE_INLINE Vector3& operator=(const Vector3& o) {
    const T x = o.at(0), y = o.at(1), z = o.at(2);
    at(0) = x, at(1) = y, at(2) = z;
    return *this;
  }
  template <class D>
  DYNTAPE_INLINE Vector3& operator=(const Eigen::MatrixBase<D>& expression) {
    Eigen3::operator=(expression);
    return *this;
  }

  // Entry k without Eigen's check of the range.
  DYNTAPE_INLINE const T& at(int k) const { return this->data()[k]; }
  DYNTAPE_INLINE T& at(int k) { return this->data()[k]; }
  DYNTAPE_INLINE const T& operator[](int k) const { return at(k); }
  DYNTAPE_INLINE T& operator[](int k) { return at(k); }

  DYNTAPE_INLINE static Vector3 Zero() { return {T(0), T(0), T(0)}; }

  DYNTAPE_INLINE Vector3& operator+=(const Vector3& o) { return *this = *this + o; }
  DYNTAPE_INLINE Vector3& operator-=(const Vector3& o) { return *this = *this - o; }
  DYNTAPE_INLINE T dot(const Vector3& o) const { return at(0) * o.at(0) + at(1) * o.at(1) + at(2) * o.at(2); }
  DYNTAPE_INLINE T squaredNorm() const { return dot(*this); }
  DYNTAPE_INLINE Vector3 cross(const Vector3& o) const {
    return {at(1) * o.at(2) - at(2) * o.at(1), at(2) * o.at(0) - at(0) * o.at(2),
            at(0) * o.at(1) - at(1) * o.at(0)};
  }
  template <class S>
  Vector3<S> cast() const {
    return {static_cast<S>(at(0)), static_cast<S>(at(1)), static_cast<S>(at(2))};
  }
};

template <class T>
DYNTAPE_INLINE Vector3<T> operator+(const Vector3<T>& a, const Vector3<T>& b) {
  return {a.at(0) + b.at(0), a.at(1) + b.at(1), a.at(2) + b.at(2)};
}
template <class T>
DYNTAPE_INLINE Vector3<T> operator-(const Vector3<T>& a, const Vector3<T>& b) {
  return {a.at(0) - b.at(0), a.at(1) - b.at(1), a.at(2) - b.at(2)};
}
template <class T>
DYNTAPE_INLINE Vector3<T> operator-(const Vector3<T>& a) {
  return {-a.at(0), -a.at(1), -a.at(2)};
}
template <class T, std::convertible_to<T> S>
DYNTAPE_INLINE Vector3<T> operator*(const Vector3<T>& a, const S& factor) {
  const T s = static_cast<T>(factor);
  return {a.at(0) * s, a.at(1) * s, a.at(2) * s};
}
template <class T, std::convertible_to<T> S>
DYNTAPE_INLINE Vector3<T> operator*(const S& factor, const Vector3<T>& a) {
  const T s = static_cast<T>(factor);
  return {s * a.at(0), s * a.at(1), s * a.at(2)};
}

template <class T>
struct Matrix3 : Eigen::Matrix<T, 3, 3> {
  using Eigen33 = Eigen::Matrix<T, 3, 3>;
  using Eigen33::operator+=;
  using Eigen33::operator-=;

  Matrix3() = default;
  // Row by row.
  DYNTAPE_INLINE Matrix3(const T& a, const T& b, const T& c, const T& d, const T& e, const T& f, const T& g,
                         const T& h, const T& i) {
    at(0, 0) = a, at(0, 1) = b, at(0, 2) = c;
    at(1, 0) = d, at(1, 1) = e, at(1, 2) = f;
    at(2, 0) = g, at(2, 1) = h, at(2, 2) = i;
  }
  DYNTAPE_INLINE Matrix3(const Matrix3& o)
      : Matrix3(o.at(0, 0), o.at(0, 1), o.at(0, 2), o.at(1, 0), o.at(1, 1), o.at(1, 2), o.at(2, 0),
                o.at(2, 1), o.at(2, 2)) {}
  template <class D>
  Matrix3(const Eigen::EigenBase<D>& expression) : Eigen33(expression) {}

  DYNTAPE_INLINE Matrix3& operator=(const Matrix3& o) {
    T m[9];
    for (int k = 0; k < 9; ++k) m[k] = o.data()[k];
    for (int k = 0; k < 9; ++k) this->data()[k] = m[k];
    return *this;
  }
  template <class D>
  DYNTAPE_INLINE Matrix3& operator=(const Eigen::MatrixBase<D>& expression) {
    Eigen33::operator=(expression);
    return *this;
  }

  // Entry (i, j) without Eigen's check of the range.
  DYNTAPE_INLINE const T& at(int i, int j) const { return this->data()[i + 3 * j]; }
  DYNTAPE_INLINE T& at(int i, int j) { return this->data()[i + 3 * j]; }
  DYNTAPE_INLINE const T& operator()(int i, int j) const { return at(i, j); }
  DYNTAPE_INLINE T& operator()(int i, int j) { return at(i, j); }
  DYNTAPE_INLINE Vector3<T> column(int j) const { return {at(0, j), at(1, j), at(2, j)}; }
  DYNTAPE_INLINE void set_column(int j, const Vector3<T>& v) {
    at(0, j) = v.at(0), at(1, j) = v.at(1), at(2, j) = v.at(2);
  }

  DYNTAPE_INLINE static Matrix3 Zero() {
    const T o = T(0);
    return {o, o, o, o, o, o, o, o, o};
  }
  DYNTAPE_INLINE static Matrix3 Identity() {
    const T o = T(0), i = T(1);
    return {i, o, o, o, i, o, o, o, i};
  }

  DYNTAPE_INLINE Matrix3& operator+=(const Matrix3& o) { return *this = *this + o; }
  DYNTAPE_INLINE Matrix3& operator-=(const Matrix3& o) { return *this = *this - o; }
  template <class S>
  Matrix3<S> cast() const {
    Matrix3<S> m;
    for (int k = 0; k < 9; ++k) m.data()[k] = static_cast<S>(this->data()[k]);
    return m;
  }
};

template <class T>
DYNTAPE_INLINE Matrix3<T> operator+(const Matrix3<T>& a, const Matrix3<T>& b) {
  Matrix3<T> m;
  for (int k = 0; k < 9; ++k) m.data()[k] = a.data()[k] + b.data()[k];
  return m;
}
template <class T>
DYNTAPE_INLINE Matrix3<T> operator-(const Matrix3<T>& a, const Matrix3<T>& b) {
  Matrix3<T> m;
  for (int k = 0; k < 9; ++k) m.data()[k] = a.data()[k] - b.data()[k];
  return m;
}
template <class T>
DYNTAPE_INLINE Matrix3<T> operator-(const Matrix3<T>& a) {
  Matrix3<T> m;
  for (int k = 0; k < 9; ++k) m.data()[k] = -a.data()[k];
  return m;
}
template <class T, std::convertible_to<T> S>
DYNTAPE_INLINE Matrix3<T> operator*(const Matrix3<T>& a, const S& factor) {
  const T s = static_cast<T>(factor);
  Matrix3<T> m;
  for (int k = 0; k < 9; ++k) m.data()[k] = a.data()[k] * s;
  return m;
}
template <class T>
DYNTAPE_INLINE Vector3<T> operator*(const Matrix3<T>& A, const Vector3<T>& x) {
  return {A.at(0, 0) * x.at(0) + A.at(0, 1) * x.at(1) + A.at(0, 2) * x.at(2),
          A.at(1, 0) * x.at(0) + A.at(1, 1) * x.at(1) + A.at(1, 2) * x.at(2),
          A.at(2, 0) * x.at(0) + A.at(2, 1) * x.at(1) + A.at(2, 2) * x.at(2)};
}
// A^T x.
template <class T>
DYNTAPE_INLINE Vector3<T> transposed_times(const Matrix3<T>& A, const Vector3<T>& x) {
  return {A.at(0, 0) * x.at(0) + A.at(1, 0) * x.at(1) + A.at(2, 0) * x.at(2),
          A.at(0, 1) * x.at(0) + A.at(1, 1) * x.at(1) + A.at(2, 1) * x.at(2),
          A.at(0, 2) * x.at(0) + A.at(1, 2) * x.at(1) + A.at(2, 2) * x.at(2)};
}
template <class T>
DYNTAPE_INLINE Matrix3<T> operator*(const Matrix3<T>& A, const Matrix3<T>& B) {
  Matrix3<T> m;
  for (int j = 0; j < 3; ++j) m.set_column(j, A * B.column(j));
  return m;
}
// A B^T.
template <class T>
DYNTAPE_INLINE Matrix3<T> times_transposed(const Matrix3<T>& A, const Matrix3<T>& B) {
  Matrix3<T> m;
  for (int j = 0; j < 3; ++j) m.set_column(j, A * Vector3<T>(B.at(j, 0), B.at(j, 1), B.at(j, 2)));
  return m;
}
// a b^T.
template <class T>
DYNTAPE_INLINE Matrix3<T> outer(const Vector3<T>& a, const Vector3<T>& b) {
  Matrix3<T> m;
  for (int j = 0; j < 3; ++j) m.set_column(j, a * b.at(j));
  return m;
}

// Matrix of the cross product: skew(a) b = a x b.
template <class T>
DYNTAPE_INLINE Matrix3<T> skew(const Vector3<T>& a) {
  return {T(0), -a.at(2), a.at(1), a.at(2), T(0), -a.at(0), -a.at(1), a.at(0), T(0)};
}

// R A R^T for a symmetric A: only six entries are computed, so the result is symmetric to the last bit.
template <class T>
DYNTAPE_INLINE Matrix3<T> rotate_symmetric(const Matrix3<T>& R, const Matrix3<T>& A) {
  const Matrix3<T> RA = R * A;
  Matrix3<T> B;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j <= i; ++j) {
      B.at(i, j) = B.at(j, i) =
          RA.at(i, 0) * R.at(j, 0) + RA.at(i, 1) * R.at(j, 1) + RA.at(i, 2) * R.at(j, 2);
    }
  }
  return B;
}

}  // namespace dyntape::dynamics
