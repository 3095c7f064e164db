// SPDX-License-Identifier: BSD-3-Clause
// What programs use around recording: checks, handlers, memory, optimal values, stiff equations.
#include "programs.h"

namespace {

TEST(CppadChecks, VectorsAndNumbers) {
  CppAD::CheckSimpleVector<double, DVector>();
  CppAD::CheckSimpleVector<double, std::vector<double>>(3, 4);
  CppAD::CheckNumericType<double>();
  CppAD::CheckNumericType<ADouble>();
}

TEST(CppadChecks, FunCheckComparesWithTheCode) {
  ADFun<double> f = recorded({1}, [](const AVector& x) -> std::vector<ADouble> { return {exp(x[0])}; });
  const auto same = [](const DVector& x) { return DVector{std::exp(x[0])}; };
  const auto other = [](const DVector& x) { return DVector{std::exp(x[0]) + 1e-3}; };
  EXPECT_TRUE(CppAD::FunCheck(f, same, DVector{2}, 1e-10, 1e-10));
  EXPECT_FALSE(CppAD::FunCheck(f, other, DVector{2}, 1e-10, 1e-10));
}

struct Refused {
  bool known;
  std::string message;
};
void throw_refused(bool known, int, const char*, const char*, const char* message) {
  throw Refused{known, message};
}

TEST(CppadErrorHandler, TakesAssertionsAndRefusalsUntilItGoes) {
  const auto assertion = [] { CPPAD_ASSERT_KNOWN(1 > 2, "one is less") };
  {
    CppAD::ErrorHandler handler(throw_refused);
    try {
      assertion();
      FAIL();
    } catch (const Refused& refused) {
      EXPECT_TRUE(refused.known);
      EXPECT_EQ(refused.message, "one is less");
    }
    EXPECT_THROW(ADFun<double>().Forward(0, DVector{1}), Refused);
  }
  const std::string sentence = sentence_of<dyntape::ArgumentError>(assertion);
  EXPECT_NE(sentence.find("one is less; expected 1 > 2"), std::string::npos) << sentence;
  EXPECT_THROW(ADFun<double>().Forward(0, DVector{1}), dyntape::RecordingError);
}

TEST(CppadThreadAlloc, CountsWhatIsInUseAndWhatIsKept) {
  using CppAD::thread_alloc;
  ASSERT_TRUE(thread_alloc::free_all());
  thread_alloc::hold_memory(true);
  std::size_t bytes, length;
  void* const block = thread_alloc::get_memory(100, bytes);
  EXPECT_GE(bytes, 100u);
  EXPECT_EQ(thread_alloc::inuse(0), bytes);
  thread_alloc::return_memory(block);
  EXPECT_EQ(thread_alloc::inuse(0), 0u);
  EXPECT_EQ(thread_alloc::available(0), bytes);
  EXPECT_EQ(thread_alloc::get_memory(bytes, bytes), block) << "kept for the next request";
  thread_alloc::return_memory(block);
  std::string* const texts = thread_alloc::create_array<std::string>(3, length);
  ASSERT_GE(length, 3u);
  texts[2] = "a text that is too long to be stored in the string itself";
  EXPECT_FALSE(thread_alloc::free_all());
  thread_alloc::delete_array(texts);
  thread_alloc::hold_memory(false);
  EXPECT_TRUE(thread_alloc::free_all());
  EXPECT_EQ(thread_alloc::available(0), 0u);
}

// F = x^2 y^2 / 2 - 3 x y + exp(x): Y = 3 / x, V = exp(x) - 9 / 2.
struct Inner {
  using ad_vector = AVector;
  template <class X, class Y>
  ADouble value(const X& x, const Y& y) const {
    return x[0] * x[0] * y[0] * y[0] / 2.0 - 3.0 * x[0] * y[0] + exp(x[0]);
  }
  AVector f(const AVector& x, const AVector& y) const { return {value(x, y)}; }
  AVector h(const AVector& x, const DVector& y) const { return {x[0] * x[0] * y[0] - 3.0 * x[0]}; }
  AVector dy(const DVector& x, const DVector&, const AVector& h) const { return {-h[0] / (x[0] * x[0])}; }
  std::size_t ell() const { return 1; }
  ADouble s(std::size_t, const AVector& x, const AVector& y) const { return value(x, y); }
  AVector sy(std::size_t, const AVector& x, const AVector& y) const {
    return {x[0] * x[0] * y[0] - 3.0 * x[0]};
  }
};

TEST(CppadOptimalValue, GradientAndHessian) {
  const DVector x{1.5}, y{2};
  DVector g(1), gx(1), gxx(1), jac(1), hes(1);
  CppAD::BenderQuad(x, y, Inner(), g, gx, gxx);
  EXPECT_EQ(CppAD::opt_val_hes(x, y, Inner(), jac, hes), 1);
  const double e = std::exp(1.5);
  expect_near(g, {e - 4.5});
  for (const DVector& derivative : {gx, gxx, jac, hes}) expect_near(derivative, {e});
}

// x_i = t^(i + 1): exact up to the degree of the polynomial.
struct Monomials {
  void Ode(const double&, const DVector& x, DVector& f) const {
    f[0] = 1;
    for (std::size_t i = 1; i < x.size(); ++i) f[i] = double(i + 1) * x[i - 1];
  }
  void Ode_dep(const double&, const DVector& x, DVector& f_x) const {
    const std::size_t n = x.size();
    for (std::size_t k = 0; k < n * n; ++k) f_x[k] = 0;
    for (std::size_t i = 1; i < n; ++i) f_x[i * n + i - 1] = double(i + 1);
  }
};

TEST(CppadGear, PolynomialsAreExact) {
  const DVector T{0, 0.1, 0.3, 0.7};
  DVector X(12), e(3);
  for (std::size_t j = 0; j < 3; ++j) {
    for (std::size_t i = 0; i < 3; ++i) X[j * 3 + i] = std::pow(T[j], double(i + 1));
  }
  Monomials f;
  CppAD::OdeGear(f, 3, 3, T, X, e);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(X[9 + i], std::pow(0.7, double(i + 1)), 1e-13);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(e[i], 0, 1e-13);  // the points before and a slope give t^3
}

// The first step: x = x0 / (1 + 10 h) by the implicit rule, predicted by the slope at x0 as x0 (1 - 10 h).
TEST(CppadGear, ErrorIsTheDistanceFromThePrediction) {
  struct Decay {
    void Ode(const double&, const DVector& x, DVector& f) const { f[0] = -10 * x[0]; }
    void Ode_dep(const double&, const DVector&, DVector& f_x) const { f_x[0] = -10; }
  } f;
  DVector X{1, 0}, e(1);
  CppAD::OdeGear(f, 1, 1, DVector{0, 0.01}, X, e);
  EXPECT_NEAR(X[1], 1 / 1.1, 1e-14);
  EXPECT_NEAR(e[0], 1 / 1.1 - 0.9, 1e-14);
}

// A chain of decays: x0 = exp(-w0 t), x1 = w0 (exp(-w0 t) - exp(-w1 t)) / (w1 - w0).
struct Decays {
  void Ode(const double&, const DVector& x, DVector& f) const {
    f[0] = -10 * x[0];
    f[1] = 10 * x[0] - x[1];
  }
  void Ode_dep(const double&, const DVector&, DVector& f_x) const { f_x = DVector{-10, 0, 10, -1}; }
};

TEST(CppadGear, ErrorIsControlled) {
  const double smin = 1e-8, smax = 1, ti = 0, tf = 1, erel = 0;
  double sini = 2e-14;  // where errors are rounding
  const DVector xi{1, 0}, eabs{1e-5, 1e-5};
  DVector ef(2), maxabs(2);
  std::size_t steps;
  Decays f;
  const DVector x = CppAD::OdeGearControl(f, 4, ti, tf, xi, smin, smax, sini, eabs, erel, ef, maxabs, steps);
  EXPECT_NEAR(x[0], std::exp(-10), 1e-4);
  EXPECT_NEAR(x[1], 10 * (std::exp(-10.0) - std::exp(-1.0)) / -9, 1e-4);
  EXPECT_LT(steps, 2000u);
}

TEST(CppadTiming, RepeatsUntilTheTimeIsSpent) {
  const auto test = [](std::size_t repeat) {
    const double until = CppAD::elapsed_seconds() + 1e-4 * double(repeat);
    while (CppAD::elapsed_seconds() < until) {
    }
  };
  const double start = CppAD::elapsed_seconds();
  EXPECT_GE(CppAD::time_test(test, 0.01), 1e-4);
  EXPECT_GE(CppAD::elapsed_seconds() - start, 0.01);
}

TEST(CppadSets, UnionAndOrderOfEntries) {
  EXPECT_EQ(CppAD::set_union(std::set<int>{1, 3}, std::set<int>{2, 3}), (std::set<int>{1, 2, 3}));
  CppAD::sparse_rc<std::vector<std::size_t>> rc(2, 2, 3);
  rc.set(0, 1, 1), rc.set(1, 0, 1), rc.set(2, 1, 0);
  EXPECT_EQ(rc.row_major(), (std::vector<std::size_t>{1, 2, 0}));
}

}  // namespace
