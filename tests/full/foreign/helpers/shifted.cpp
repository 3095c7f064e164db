// SPDX-License-Identifier: BSD-3-Clause
// A member of a class template, which the program that declares it does not define.
template <class Type>
struct Shifted {
  Type value;
  explicit Shifted(Type x);
};

template <class Type>
Shifted<Type>::Shifted(Type x) {
  value = x + 1;
}

template struct Shifted<double>;
