// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Eigenvalues>

#include <dyntape/interface/io/number.h>
#include <dyntape/interface/ocs2/approximation.h>

namespace dyntape {
namespace {

using detail::shape;

using Scalar1 = ScalarFunctionLinearApproximation;
using Scalar2 = ScalarFunctionQuadraticApproximation;
using Vector1 = VectorFunctionLinearApproximation;
using Vector2 = VectorFunctionQuadraticApproximation;

void expect(std::string& complaint, const std::string& name, const char* block, Eigen::Index rows,
            Eigen::Index cols, Eigen::Index expected_rows, Eigen::Index expected_cols) {
  if (rows == expected_rows && cols == expected_cols) return;
  complaint += name + "." + block + " is " + shape(rows, cols) + ", expected " +
               shape(expected_rows, expected_cols) + "\n";
}

template <class Block>
void expect(std::string& complaint, const std::string& name, const char* block, const Block& b,
            Eigen::Index rows, Eigen::Index cols) {
  expect(complaint, name, block, b.rows(), b.cols(), rows, cols);
}

void expect(std::string& complaint, const std::string& name, const char* block,
            const std::vector<matrix_t>& list, int nf, Eigen::Index rows, Eigen::Index cols) {
  if (static_cast<int>(list.size()) != nf) {
    complaint += name + "." + block + " has " + std::to_string(list.size()) + " outputs, expected " +
                 std::to_string(nf) + "\n";
  }
  for (const matrix_t& m : list) expect(complaint, name, block, m, rows, cols);
}

}  // namespace

std::string checkSize(int nx, int nu, const Scalar1& a, const std::string& name) {
  std::string complaint;
  expect(complaint, name, "dfdx", a.dfdx, nx, 1);
  if (nu >= 0) expect(complaint, name, "dfdu", a.dfdu, nu, 1);
  return complaint;
}

std::string checkSize(int nx, int nu, const Scalar2& a, const std::string& name) {
  std::string complaint;
  expect(complaint, name, "dfdx", a.dfdx, nx, 1);
  expect(complaint, name, "dfdxx", a.dfdxx, nx, nx);
  if (nu >= 0) {
    expect(complaint, name, "dfdu", a.dfdu, nu, 1);
    expect(complaint, name, "dfdux", a.dfdux, nu, nx);
    expect(complaint, name, "dfduu", a.dfduu, nu, nu);
  }
  return complaint;
}

std::string checkSize(int nf, int nx, int nu, const Vector1& a, const std::string& name) {
  std::string complaint;
  expect(complaint, name, "f", a.f, nf, 1);
  expect(complaint, name, "dfdx", a.dfdx, nf, nx);
  if (nu >= 0) expect(complaint, name, "dfdu", a.dfdu, nf, nu);
  return complaint;
}

std::string checkSize(int nf, int nx, int nu, const Vector2& a, const std::string& name) {
  std::string complaint;
  expect(complaint, name, "f", a.f, nf, 1);
  expect(complaint, name, "dfdx", a.dfdx, nf, nx);
  expect(complaint, name, "dfdxx", a.dfdxx, nf, nx, nx);
  if (nu >= 0) {
    expect(complaint, name, "dfdu", a.dfdu, nf, nu);
    expect(complaint, name, "dfdux", a.dfdux, nf, nu, nx);
    expect(complaint, name, "dfduu", a.dfduu, nf, nu, nu);
  }
  return complaint;
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
  const double least =
      Eigen::SelfAdjointEigenSolver<matrix_t>(matrix, Eigen::EigenvaluesOnly).eigenvalues().minCoeff();
  if (least < -rounding) {
    return name + " is not positive semi-definite: least eigenvalue " + io::shortest(least) + "\n";
  }
  return "";
}

}  // namespace dyntape
