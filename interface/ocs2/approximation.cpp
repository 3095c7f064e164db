// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/ocs2/approximation.h>

#include <algorithm>
#include <array>
#include <ostream>
#include <tuple>
#include <utility>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/factorisations.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {
namespace {

using Scalar1 = ScalarFunctionLinearApproximation;
using Scalar2 = ScalarFunctionQuadraticApproximation;
using Vector1 = VectorFunctionLinearApproximation;
using Vector2 = VectorFunctionQuadraticApproximation;
using Matrices = std::vector<matrix_t>;

std::string shape(Eigen::Index rows, Eigen::Index cols) {
  return "(" + std::to_string(rows) + " x " + std::to_string(cols) + ")";
}

// --- the blocks of an approximation, in one order ---

constexpr const char* kNames[] = {"f", "dfdx", "dfdu", "dfdxx", "dfdux", "dfduu"};

template <class A>
auto blocks(A& a) {
  if constexpr (requires { a.dfdxx; }) {
    return std::tie(a.f, a.dfdx, a.dfdu, a.dfdxx, a.dfdux, a.dfduu);
  } else {
    return std::tie(a.f, a.dfdx, a.dfdu);
  }
}

// visit(k, block k of the first, block k of the second, ...)
template <class Visit, class A, class... Others>
void for_each_block(Visit visit, A& a, Others&... others) {
  constexpr std::size_t kCount = std::tuple_size_v<decltype(blocks(a))>;
  const auto visit_one = [&](auto k) { visit(k, std::get<k>(blocks(a)), std::get<k>(blocks(others))...); };
  [&]<std::size_t... k>(std::index_sequence<k...>) {
    (visit_one(std::integral_constant<std::size_t, k>()), ...);
  }
  (std::make_index_sequence<kCount>());
}

using Shapes = std::array<std::pair<int, int>, 6>;

Shapes shapes(std::pair<int, int> f, std::pair<int, int> dfdx, std::pair<int, int> dfdu, int nx, int nu) {
  const int inputs = std::max(nu, 0);
  return {f, dfdx, dfdu, std::pair(nx, nx), std::pair(inputs, nu < 0 ? 0 : nx), std::pair(inputs, inputs)};
}

Shapes shapes_of(int nx, int nu) { return shapes({1, 1}, {nx, 1}, {std::max(nu, 0), 1}, nx, nu); }

Shapes shapes_of(int nf, int nx, int nu) {
  return shapes({nf, 1}, {nf, nx}, {nu < 0 ? 0 : nf, std::max(nu, 0)}, nx, nu);
}

// --- what is done to each ---

// a += b, where an empty block is zero.
void add(scalar_t& a, scalar_t b, const char*) { a += b; }

template <class Block>
void add(Block& a, const Block& b, const char* name) {
  if (b.size() == 0) return;
  if (a.size() == 0) {
    a = b;
    return;
  }
  if (a.rows() != b.rows() || a.cols() != b.cols())
    throw ArgumentError(std::string("sum of approximations: ") + name + " is " + shape(a.rows(), a.cols()) +
                        " in one and " + shape(b.rows(), b.cols()) + " in the other");
  a += b;
}

void add(Matrices& a, const Matrices& b, const char* name) {
  if (a.empty()) a.resize(b.size());
  if (!b.empty() && a.size() != b.size())
    throw ArgumentError(std::string("sum of approximations: ") + name + " has " + std::to_string(a.size()) +
                        " outputs in one and " + std::to_string(b.size()) + " in the other");
  for (std::size_t i = 0; i < b.size(); ++i) add(a[i], b[i], name);
}

template <class Block>
void scale(Block& block, scalar_t factor) {
  block *= factor;
}
void scale(Matrices& list, scalar_t factor) {
  for (matrix_t& m : list) m *= factor;
}

void resize_block(scalar_t&, std::pair<int, int>, int) {}
template <class Block>
void resize_block(Block& block, std::pair<int, int> to, int) {
  block.resize(to.first, to.second);
}
void resize_block(Matrices& list, std::pair<int, int> to, int nf) {
  list.assign(static_cast<std::size_t>(nf), matrix_t(to.first, to.second));
}

void set_zero(scalar_t& number) { number = 0; }
template <class Block>
void set_zero(Block& block) {
  block.setZero();
}
void set_zero(Matrices& list) {
  for (matrix_t& m : list) m.setZero();
}

void print(std::ostream& out, const std::string& name, scalar_t number) {
  out << name << ": " << number << "\n";
}
void print(std::ostream& out, const std::string& name, const vector_t& v) {
  out << name << ": " << v.transpose() << "\n";
}
void print(std::ostream& out, const std::string& name, const matrix_t& m) {
  out << name << ":\n" << m << "\n";
}
void print(std::ostream& out, const std::string& name, const Matrices& list) {
  for (std::size_t i = 0; i < list.size(); ++i) print(out, name + "[" + std::to_string(i) + "]", list[i]);
}

std::string misfit(scalar_t, const std::string&, std::pair<int, int>, int) { return ""; }
template <class Block>
std::string misfit(const Block& block, const std::string& name, std::pair<int, int> expected, int) {
  if (block.rows() == expected.first && block.cols() == expected.second) return "";
  return name + " is " + shape(block.rows(), block.cols()) + ", expected " +
         shape(expected.first, expected.second) + "\n";
}
std::string misfit(const Matrices& list, const std::string& name, std::pair<int, int> expected, int nf) {
  std::string complaint;
  if (static_cast<int>(list.size()) != nf)
    complaint =
        name + " has " + std::to_string(list.size()) + " outputs, expected " + std::to_string(nf) + "\n";
  for (const matrix_t& m : list) complaint += misfit(m, name, expected, nf);
  return complaint;
}

// Without inputs (nu < 0) the blocks of u may be anything.
template <class A>
std::string misfits(const A& a, const Shapes& expected, int nf, int nu, const std::string& name) {
  std::string complaint;
  for_each_block(
      [&](std::size_t k, const auto& block) {
        const std::string_view of = kNames[k];
        if (nu >= 0 || of.find('u') == of.npos)
          complaint += misfit(block, name + "." + kNames[k], expected[k], nf);
      },
      a);
  return complaint;
}

}  // namespace

namespace detail {

template <class Self, class Blocks, class... Size>
Self& ApproximationOf<Self, Blocks, Size...>::operator+=(const Self& other) {
  auto& self = static_cast<Self&>(*this);
  for_each_block([](std::size_t k, auto& a, const auto& b) { add(a, b, kNames[k]); }, self, other);
  return self;
}

template <class Self, class Blocks, class... Size>
Self& ApproximationOf<Self, Blocks, Size...>::operator*=(scalar_t factor) {
  auto& self = static_cast<Self&>(*this);
  for_each_block([&](std::size_t, auto& block) { scale(block, factor); }, self);
  return self;
}

template <class Self, class Blocks, class... Size>
Self& ApproximationOf<Self, Blocks, Size...>::resize(Size... nf, int nx, int nu) {
  auto& self = static_cast<Self&>(*this);
  const Shapes to = shapes_of(nf..., nx, nu);
  for_each_block([&](std::size_t k, auto& block) { resize_block(block, to[k], (1 * ... * nf)); }, self);
  return self;
}

template <class Self, class Blocks, class... Size>
Self& ApproximationOf<Self, Blocks, Size...>::setZero(Size... nf, int nx, int nu) {
  for_each_block([](std::size_t, auto& block) { set_zero(block); }, resize(nf..., nx, nu));
  return static_cast<Self&>(*this);
}

}  // namespace detail

template <Approximation A>
std::ostream& operator<<(std::ostream& out, const A& a) {
  for_each_block([&](std::size_t k, const auto& block) { print(out, kNames[k], block); }, a);
  return out;
}

template <ScalarFunctionApproximation A>
std::string checkSize(int nx, int nu, const A& a, const std::string& name) {
  return misfits(a, shapes_of(nx, nu), 1, nu, name);
}

template <VectorFunctionApproximation A>
std::string checkSize(int nf, int nx, int nu, const A& a, const std::string& name) {
  return misfits(a, shapes_of(nf, nx, nu), nf, nu, name);
}

std::string checkBeingPSD(const matrix_t& matrix, const std::string& name) {
  if (matrix.rows() != matrix.cols()) {
    return name + " is not square: " + shape(matrix.rows(), matrix.cols()) + "\n";
  }
  if (matrix.size() == 0) return "";
  if (!matrix.allFinite()) return name + " is not finite\n";
  const double rounding =
      static_cast<double>(matrix.rows()) * matrix.cwiseAbs().maxCoeff() * Eigen::NumTraits<double>::epsilon();
  if ((matrix - matrix.transpose()).cwiseAbs().maxCoeff() > rounding) return name + " is not symmetric\n";
  const double least = least_eigenvalue(matrix);
  if (least < -rounding) {
    return name + " is not positive semi-definite: least eigenvalue " + io::shortest(least) + "\n";
  }
  return "";
}

template struct detail::ApproximationOf<Scalar1, detail::LinearBlocks<scalar_t, vector_t>>;
template struct detail::ApproximationOf<Scalar2, detail::QuadraticBlocks<scalar_t, vector_t, matrix_t>>;
template struct detail::ApproximationOf<Vector1, detail::LinearBlocks<vector_t, matrix_t>, int>;
template struct detail::ApproximationOf<Vector2, detail::QuadraticBlocks<vector_t, matrix_t, Matrices>, int>;
template std::ostream& operator<<(std::ostream&, const Scalar1&);
template std::ostream& operator<<(std::ostream&, const Scalar2&);
template std::ostream& operator<<(std::ostream&, const Vector1&);
template std::ostream& operator<<(std::ostream&, const Vector2&);
template std::string checkSize(int, int, const Scalar1&, const std::string&);
template std::string checkSize(int, int, const Scalar2&, const std::string&);
template std::string checkSize(int, int, int, const Vector1&, const std::string&);
template std::string checkSize(int, int, int, const Vector2&, const std::string&);

}  // namespace dyntape
