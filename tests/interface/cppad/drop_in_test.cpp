// SPDX-License-Identifier: BSD-3-Clause
// The drop-in folder: CppAD's file names give a namespace CppAD that programs open, specialise and alias.
#include <cppad/utility/vector.hpp>

#include <cppad/cg.hpp>
#include <cppad/cg/cppadcg.hpp>
#include <cppad/cppad.hpp>

#include <type_traits>

namespace {
struct Colour {
  int code;
};
}  // namespace

namespace CppAD {

template <>
struct numeric_limits<Colour> {
  static Colour max() { return {255}; }
};
bool isnan(const Colour& c) { return c.code < 0; }

template <class Base>
AD<Base> cube(const AD<Base>& x) {
  return x * x * x;
}

}  // namespace CppAD

#include "programs.h"

static_assert(std::is_same_v<CppAD::AD<CppAD::cg::CG<double>>, CppAD::AD<CppAD::AD<double>>>);
static_assert(std::is_same_v<CppAD::AD<double>, dyntape::cppad::AD<double>>, "one type under both names");

namespace {

TEST(CppadDropIn, NamespaceIsOpenedAndSpecialised) {
  EXPECT_EQ(CppAD::numeric_limits<Colour>::max().code, 255);
  EXPECT_TRUE(CppAD::isnan(Colour{-1}));
  EXPECT_TRUE(CppAD::isnan(kNan));
  ADFun<double> f =
      recorded({2}, [](const AVector& x) -> std::vector<ADouble> { return {CppAD::cube(x[0])}; });
  expect_near(f.Jacobian(DVector{2}), {12});
}

TEST(CppadDropIn, StandardHeadersComeAlong) {
  std::map<std::string, std::set<int>> known;
  std::ostringstream text;
  text << std::setprecision(3) << std::complex<double>(1, 2);
  assert(known.empty());
  EXPECT_EQ(text.str(), "(1,2)");
}

}  // namespace
