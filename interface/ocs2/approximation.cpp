// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/ocs2/approximation.h>

#include <algorithm>
#include <ostream>

#include <dyntape/autodiff/error.h>

namespace dyntape {
std::string detail::shape(Eigen::Index rows, Eigen::Index cols) {
  return "(" + std::to_string(rows) + " x " + std::to_string(cols) + ")";
}

namespace {

using detail::shape;
using Scalar1 = ScalarFunctionLinearApproximation;
using Scalar2 = ScalarFunctionQuadraticApproximation;
using Vector1 = VectorFunctionLinearApproximation;
using Vector2 = VectorFunctionQuadraticApproximation;

// a += b, where an empty block is zero.
template <class Block>
void add(Block& a, const Block& b, const char* name) {
  if (b.size() == 0) return;
  if (a.size() == 0) {
    a = b;
    return;
  }
  if (a.rows() != b.rows() || a.cols() != b.cols()) {
    throw ArgumentError(std::string("sum of approximations: ") + name + " is " + shape(a.rows(), a.cols()) +
                        " in one and " + shape(b.rows(), b.cols()) + " in the other");
  }
  a += b;
}

void add(std::vector<matrix_t>& a, const std::vector<matrix_t>& b, const char* name) {
  if (a.empty()) a.resize(b.size());
  if (!b.empty() && a.size() != b.size()) {
    throw ArgumentError(std::string("sum of approximations: ") + name + " has " + std::to_string(a.size()) +
                        " outputs in one and " + std::to_string(b.size()) + " in the other");
  }
  for (std::size_t i = 0; i < b.size(); ++i) add(a[i], b[i], name);
}

void scale(std::vector<matrix_t>& a, scalar_t factor) {
  for (matrix_t& m : a) m *= factor;
}

}  // namespace

// --- scalar, linear ---

Scalar1::ScalarFunctionLinearApproximation(int nx, int nu) { resize(nx, nu); }

Scalar1& Scalar1::operator+=(const Scalar1& other) {
  f += other.f;
  add(dfdx, other.dfdx, "dfdx");
  add(dfdu, other.dfdu, "dfdu");
  return *this;
}

Scalar1& Scalar1::operator*=(scalar_t factor) {
  f *= factor;
  dfdx *= factor;
  dfdu *= factor;
  return *this;
}

Scalar1& Scalar1::resize(int nx, int nu) {
  dfdx.resize(nx);
  dfdu.resize(std::max(nu, 0));
  return *this;
}

Scalar1& Scalar1::setZero(int nx, int nu) {
  resize(nx, nu);
  f = 0;
  dfdx.setZero();
  dfdu.setZero();
  return *this;
}

Scalar1 Scalar1::Zero(int nx, int nu) { return Scalar1().setZero(nx, nu); }

// --- scalar, quadratic ---

Scalar2::ScalarFunctionQuadraticApproximation(int nx, int nu) { resize(nx, nu); }

Scalar2& Scalar2::operator+=(const Scalar2& other) {
  f += other.f;
  add(dfdx, other.dfdx, "dfdx");
  add(dfdu, other.dfdu, "dfdu");
  add(dfdxx, other.dfdxx, "dfdxx");
  add(dfdux, other.dfdux, "dfdux");
  add(dfduu, other.dfduu, "dfduu");
  return *this;
}

Scalar2& Scalar2::operator*=(scalar_t factor) {
  f *= factor;
  dfdx *= factor;
  dfdu *= factor;
  dfdxx *= factor;
  dfdux *= factor;
  dfduu *= factor;
  return *this;
}

Scalar2& Scalar2::resize(int nx, int nu) {
  const int inputs = std::max(nu, 0);
  dfdx.resize(nx);
  dfdu.resize(inputs);
  dfdxx.resize(nx, nx);
  dfdux.resize(inputs, nu < 0 ? 0 : nx);
  dfduu.resize(inputs, inputs);
  return *this;
}

Scalar2& Scalar2::setZero(int nx, int nu) {
  resize(nx, nu);
  f = 0;
  dfdx.setZero();
  dfdu.setZero();
  dfdxx.setZero();
  dfdux.setZero();
  dfduu.setZero();
  return *this;
}

Scalar2 Scalar2::Zero(int nx, int nu) { return Scalar2().setZero(nx, nu); }

// --- vector, linear ---

Vector1::VectorFunctionLinearApproximation(int nf, int nx, int nu) { resize(nf, nx, nu); }

Vector1& Vector1::operator+=(const Vector1& other) {
  add(f, other.f, "f");
  add(dfdx, other.dfdx, "dfdx");
  add(dfdu, other.dfdu, "dfdu");
  return *this;
}

Vector1& Vector1::operator*=(scalar_t factor) {
  f *= factor;
  dfdx *= factor;
  dfdu *= factor;
  return *this;
}

Vector1& Vector1::resize(int nf, int nx, int nu) {
  f.resize(nf);
  dfdx.resize(nf, nx);
  dfdu.resize(nu < 0 ? 0 : nf, std::max(nu, 0));
  return *this;
}

Vector1& Vector1::setZero(int nf, int nx, int nu) {
  resize(nf, nx, nu);
  f.setZero();
  dfdx.setZero();
  dfdu.setZero();
  return *this;
}

Vector1 Vector1::Zero(int nf, int nx, int nu) { return Vector1().setZero(nf, nx, nu); }

// --- vector, quadratic ---

Vector2::VectorFunctionQuadraticApproximation(int nf, int nx, int nu) { resize(nf, nx, nu); }

Vector2& Vector2::operator+=(const Vector2& other) {
  add(f, other.f, "f");
  add(dfdx, other.dfdx, "dfdx");
  add(dfdu, other.dfdu, "dfdu");
  add(dfdxx, other.dfdxx, "dfdxx");
  add(dfdux, other.dfdux, "dfdux");
  add(dfduu, other.dfduu, "dfduu");
  return *this;
}

Vector2& Vector2::operator*=(scalar_t factor) {
  f *= factor;
  dfdx *= factor;
  dfdu *= factor;
  scale(dfdxx, factor);
  scale(dfdux, factor);
  scale(dfduu, factor);
  return *this;
}

Vector2& Vector2::resize(int nf, int nx, int nu) {
  const int inputs = std::max(nu, 0);
  f.resize(nf);
  dfdx.resize(nf, nx);
  dfdu.resize(nu < 0 ? 0 : nf, inputs);
  dfdxx.assign(nf, matrix_t(nx, nx));
  dfdux.assign(nf, matrix_t(inputs, nu < 0 ? 0 : nx));
  dfduu.assign(nf, matrix_t(inputs, inputs));
  return *this;
}

Vector2& Vector2::setZero(int nf, int nx, int nu) {
  resize(nf, nx, nu);
  f.setZero();
  dfdx.setZero();
  dfdu.setZero();
  for (auto* list : {&dfdxx, &dfdux, &dfduu}) {
    for (matrix_t& m : *list) m.setZero();
  }
  return *this;
}

Vector2 Vector2::Zero(int nf, int nx, int nu) { return Vector2().setZero(nf, nx, nu); }

// --- text ---

std::ostream& operator<<(std::ostream& out, const Scalar1& a) {
  return out << "f: " << a.f << "\ndfdx: " << a.dfdx.transpose() << "\ndfdu: " << a.dfdu.transpose() << "\n";
}

std::ostream& operator<<(std::ostream& out, const Scalar2& a) {
  return out << "f: " << a.f << "\ndfdx: " << a.dfdx.transpose() << "\ndfdu: " << a.dfdu.transpose()
             << "\ndfdxx:\n"
             << a.dfdxx << "\ndfdux:\n"
             << a.dfdux << "\ndfduu:\n"
             << a.dfduu << "\n";
}

std::ostream& operator<<(std::ostream& out, const Vector1& a) {
  return out << "f: " << a.f.transpose() << "\ndfdx:\n" << a.dfdx << "\ndfdu:\n" << a.dfdu << "\n";
}

std::ostream& operator<<(std::ostream& out, const Vector2& a) {
  out << "f: " << a.f.transpose() << "\ndfdx:\n" << a.dfdx << "\ndfdu:\n" << a.dfdu << "\n";
  for (std::size_t i = 0; i < a.dfdxx.size(); ++i) out << "dfdxx[" << i << "]:\n" << a.dfdxx[i] << "\n";
  for (std::size_t i = 0; i < a.dfdux.size(); ++i) out << "dfdux[" << i << "]:\n" << a.dfdux[i] << "\n";
  for (std::size_t i = 0; i < a.dfduu.size(); ++i) out << "dfduu[" << i << "]:\n" << a.dfduu[i] << "\n";
  return out;
}

}  // namespace dyntape
