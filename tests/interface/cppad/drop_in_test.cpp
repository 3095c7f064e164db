// SPDX-License-Identifier: BSD-3-Clause
// The drop-in folder: CppAD's file names give a namespace CppAD that programs open, specialise and alias.
#include <cppad/utility/vector.hpp>

#include <cppad/cg.hpp>
#include <cppad/cg/cppadcg.hpp>
#include <cppad/cppad.hpp>
#include <cppad/example/cppad_eigen.hpp>

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

// An error handler that throws the pointer that it got, as handlers of CppAD do.
void throwing_handler(bool, int, const char*, const char*, const char* message) { throw message; }

template <class Code>
std::string message_of(Code&& code) {
  const CppAD::ErrorHandler handler(throwing_handler);
  try {
    code();
  } catch (const char* message) {
    return message;
  }
  return "";
}

TEST(CppadDropIn, HandlerGetsDocumentedWordsOfAbort) {
  EXPECT_EQ(message_of([] {
              AVector x(1);
              Independent(x, 1);
              [[maybe_unused]] const ADouble y = sin(x[0]) * x[0] + exp(x[0]);
            }),
            "Operator index equals abort_op_index in Independent");
  ADouble::abort_recording();
}

TEST(CppadDropIn, HandlerGetsFileWithVariablesOfNan) {
  ADFun<double> f = recorded({2, 1, 3}, [](const AVector& x) -> std::vector<ADouble> {
    return {x[0], log(x[1]), sqrt(x[2])};
  });
  f.check_for_nan(true);
  const std::string message = message_of([&] { f.Forward(0, DVector{2, -1, -4}); });
  EXPECT_NE(message.find("vector_size = 3\n"), std::string::npos) << message;
  EXPECT_NE(message.find("index = 1\n"), std::string::npos) << message;
  const std::size_t begin = message.find("file_name = ") + 12;
  const std::string file = message.substr(begin, message.find('\n', begin) - begin);
  CppAD::vector<double> x(3);
  CppAD::get_check_for_nan(x, file);
  EXPECT_EQ(x, (CppAD::vector<double>{2, -1, -4}));
  EXPECT_EQ(std::remove(file.c_str()), 0);
  EXPECT_NE(sentence_of<dyntape::ArgumentError>([&] { CppAD::get_check_for_nan(x, file); }).find("24 bytes"),
            std::string::npos);
  EXPECT_THROW(f.Forward(0, DVector{2, -1, -4}), dyntape::NumericalError);
}

TEST(CppadDropIn, MemoryOfOmpAllocIsKeptForSeveralThreads) {
  using CppAD::omp_alloc;
  omp_alloc::set_max_num_threads(2);
  EXPECT_EQ(omp_alloc::get_max_num_threads(), 2u);
  const std::size_t thread = omp_alloc::get_thread_num(), before = omp_alloc::inuse(thread);
  std::size_t capacity;
  void* const block = omp_alloc::get_memory(100, capacity);
  EXPECT_EQ(omp_alloc::inuse(thread) - before, capacity);
  omp_alloc::return_memory(block);
  EXPECT_GE(omp_alloc::available(thread), capacity);
  omp_alloc::free_available(thread);
  EXPECT_EQ(omp_alloc::available(thread), 0u);
  omp_alloc::set_max_num_threads(1);
  EXPECT_EQ(omp_alloc::get_max_num_threads(), 1u);
}

TEST(CppadDropIn, TrackedArraysAreCounted) {
  const std::size_t before = CPPAD_TRACK_COUNT();
  int* array = nullptr;
  array = CPPAD_TRACK_NEW_VEC(3, array);
  for (int i = 0; i < 3; ++i) array[i] = i * i;
  EXPECT_EQ(CPPAD_TRACK_COUNT(), before + 1);
  array = CPPAD_TRACK_EXTEND(300, 3, array);
  EXPECT_EQ(CPPAD_TRACK_COUNT(), before + 1);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(array[i], i * i);
  CPPAD_TRACK_DEL_VEC(array);
  EXPECT_EQ(CPPAD_TRACK_COUNT(), before);
}

TEST(CppadDropIn, SetsEndWithTheirEnd) {
  CppAD::local::sparse::list_setvec sets;
  sets.resize(2, 9);
  for (const std::size_t element : {5, 1, 5}) sets.add_element(1, element);
  EXPECT_TRUE(sets.is_element(1, 5));
  EXPECT_FALSE(sets.is_element(0, 5));
  CppAD::local::sparse::list_setvec::const_iterator of_none(sets, 0), at(sets, 1);
  EXPECT_EQ(*of_none, 9u);
  std::vector<std::size_t> found;
  for (; *at != sets.end(); ++at) found.push_back(*at);
  EXPECT_EQ(found, (std::vector<std::size_t>{1, 5}));
}

TEST(CppadDropIn, NumbersAreClassifiedByBothNamespaces) {
  using std::isnan;
  const ADouble nan = kNan, infinite = kInf;
  EXPECT_TRUE(isnan(nan) && std::isnan(nan) && CppAD::isnan(nan));
  EXPECT_TRUE(std::isinf(infinite) && !std::isnan(infinite) && !std::isinf(nan));
  EXPECT_TRUE((Eigen::Matrix<ADouble, 2, 1>(nan, 1.0).hasNaN()));
}

}  // namespace
