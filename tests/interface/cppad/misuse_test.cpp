// SPDX-License-Identifier: BSD-3-Clause
// Misuse is an exception with a sentence, in every build: what, where, expected, got.
#include <set>
#include <thread>

#include "programs.h"

namespace {

using Sizes = CPPAD_TESTVECTOR(std::size_t);

struct Misuse {
  const char* name;
  void (*code)();
  const char* words[2];  // of the sentence
};

ADFun<double> product() {
  return recorded({1, 2}, [](const AVector& x) -> std::vector<ADouble> { return {x[0] * x[1]}; });
}

const Misuse kMisuses[] = {
    {"NoIndependents",
     [] {
       AVector none;
       Independent(none);
     },
     {"Independent", "at least one"}},
    {"IndependentTwice",
     [] {
       AVector x(1);
       Independent(x);
       Independent(x);
     },
     {"is open", "misuse_test.cpp"}},
    {"NoRecording",
     [] {
       AVector x(1);
       ADFun<double> f(x, x);
     },
     {"no recording", "Independent"}},
    {"NoDependents",
     [] {
       AVector x(1), none;
       Independent(x);
       ADFun<double> f(x, none);
     },
     {"dependent", "at least one"}},
    {"OtherIndependents",
     [] {
       AVector x(2), y(1);
       Independent(x);
       ADFun<double> f(y, y);
     },
     {"1 entries", "had 2"}},
    {"AssignedIndependent",
     [] {
       AVector x(1);
       Independent(x);
       x[0] = 3;
       ADFun<double> f(x, x);
     },
     {"x[0]", "assigned"}},
    {"ValueOfAVariable",
     [] {
       AVector x(1);
       Independent(x);
       CppAD::Value(x[0]);
     },
     {"Value", "Var2Par"}},
    {"SignOfNan",
     [] {
       AVector x(1);
       Independent(x);
       copysign(x[0], ADouble(kNan));
     },
     {"copysign", "NaN"}},
    {"SignOfNanOfAnEndedRecording",
     [] {
       AVector x{-1}, y(1);
       Independent(x);
       y[0] = log(x[0]);
       ADFun<double> f(x, y);
       Independent(x);
       copysign(x[0], y[0]);
     },
     {"copysign", "NaN"}},
    {"AbortIndex",
     [] {
       AVector x(1);
       Independent(x, std::size_t(4));
       ADouble y = x[0];
       for (int i = 0; i < 9; ++i) y = sin(y);
     },
     {"operation 4", "reached"}},
    {"EmptyFunction",
     [] {
       ADFun<double> f;
       f.Forward(0, DVector{1});
     },
     {"empty", "recorded"}},
    {"ForwardSize", [] { product().Forward(0, DVector{1}); }, {"1 entries", "expected 2"}},
    {"ForwardWithoutLowerOrders",
     [] {
       product().Forward(2, DVector{1, 2});
     },
     {"order 2", "below"}},
    {"ReverseWithoutForward", [] { product().Reverse(1, DVector{1}); }, {"Forward", "order 0"}},
    {"ReverseSize",
     [] {
       ADFun<double> f = product();
       f.Forward(0, DVector{1, 2});
       f.Reverse(1, DVector{1, 2});
     },
     {"w has 2", "expected 1"}},
    {"ReverseOfOrderZero", [] { product().Reverse(0, DVector{1}); }, {"order is 0", "at least 1"}},
    {"ReverseAfterDirections",
     [] {
       ADFun<double> f = product();
       f.Forward(0, DVector{1, 2});
       f.Forward(1, 2, DVector{1, 0, 0, 1});
       f.Reverse(1, DVector{1});
     },
     {"2 directions", "expected one"}},
    {"DirectionsAtOrderZero",
     [] {
       product().Forward(0, 2, DVector{1, 2, 3, 4});
     },
     {"directions", "order 1"}},
    {"NewDynamicSize", [] { product().new_dynamic(DVector{1}); }, {"new_dynamic", "expected 0"}},
    {"HessianIndex",
     [] {
       product().Hessian(DVector{1, 2}, std::size_t(3));
     },
     {"result 3", "there are 1"}},
    {"HessianWeights",
     [] {
       product().Hessian(DVector{1, 2}, DVector{1, 2});
     },
     {"w has 2", "expected 1"}},
    {"ParameterIndex", [] { product().Parameter(1); }, {"result 1", "there are 1"}},
    {"ForOneIndex",
     [] {
       product().ForOne(DVector{1, 2}, 2);
     },
     {"variable 2", "there are 2"}},
    {"RevOneIndex",
     [] {
       product().RevOne(DVector{1, 2}, 1);
     },
     {"result 1", "there are 1"}},
    {"RevTwoSizes",
     [] {
       product().RevTwo(DVector{1, 2}, Sizes{0}, Sizes{0, 1});
     },
     {"2 entries", "expected 1"}},
    {"OptimizeOption", [] { product().optimize("no_compare_ops"); }, {"no_compare_ops", "no_compare_op,"}},
    {"Coloring",
     [] {
       ADFun<double> f = product();
       CppAD::sparse_jac_work work;
       CppAD::sparse_rc<Sizes> p(1, 2, 0);
       CppAD::sparse_rcv<Sizes, DVector> s(p);
       f.sparse_jac_for(1, DVector{1, 2}, s, p, "rainbow", work);
     },
     {"rainbow", "cppad"}},
    {"PatternSize",
     [] {
       ADFun<double> f = product();
       CppAD::sparse_rc<Sizes> p(3, 3, 0), q;
       f.for_jac_sparsity(p, false, false, false, q);
     },
     {"got 3", "expected 2"}},
    {"HessianPatternFirst",
     [] {
       ADFun<double> f = product();
       CppAD::sparse_rc<Sizes> q;
       f.rev_hes_sparsity(CppAD::vector<bool>{true}, false, false, q);
     },
     {"rev_hes_sparsity", "for_jac_sparsity"}},
    {"SetColumn",
     [] {
       ADFun<double> f = product();
       CPPAD_TESTVECTOR(std::set<std::size_t>) r(2);
       r[0] = {5};
       f.ForSparseJac(2, r);
     },
     {"column 5", "of 2"}},
    {"SubgraphDomainFirst",
     [] {
       ADFun<double> f = product();
       Sizes col;
       DVector dw;
       f.subgraph_reverse(1, 0, col, dw);
     },
     {"subgraph_reverse", "select_domain"}},
    {"VectorIndex",
     [] {
       DVector v(2);
       v[2] = 1;
     },
     {"element 2", "there are 2"}},
    {"SparseEntry",
     [] {
       CppAD::sparse_rc<Sizes> p(1, 2, 1);
       p.set(0, 1, 0);
     },
     {"(1, 0)", "1 x 2"}},
    {"ArrayIndex",
     [] {
       CppAD::VecAD<double> v(2);
       [[maybe_unused]] const ADouble y = v[ADouble(2)];
     },
     {"index 2", "0 to 2"}},
    {"CheckpointSize",
     [] {
       ADFun<double> f = product();
       CppAD::chkpoint_two<double> c(f, "product");
       AVector x(1), y(1);
       c(x, y);
     },
     {"got 1", "expected 2"}},
    {"LuSize",
     [] {
       DVector A(3), B(2), X(2);
       double d;
       CppAD::LuSolve(2, 1, A, B, X, d);
     },
     {"A: got 3", "expected 4"}},
};

class CppadMisuse : public ::testing::TestWithParam<Misuse> {
 protected:
  void TearDown() override { ADouble::abort_recording(); }
};

TEST_P(CppadMisuse, IsASentence) {
  const std::string sentence = sentence_of<dyntape::Error>(GetParam().code);
  for (const char* words : GetParam().words)
    EXPECT_NE(sentence.find(words), std::string::npos) << "\"" << sentence << "\"";
  EXPECT_EQ(sentence.find('\n'), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(Calls, CppadMisuse, ::testing::ValuesIn(kMisuses),
                         [](const auto& row) { return row.param.name; });

TEST(CppadThreads, EachHasItsOwnRecording) {
  std::vector<std::thread> threads;
  std::vector<double> slopes(4);
  for (std::size_t t = 0; t < slopes.size(); ++t) {
    threads.emplace_back([&slopes, t] {
      for (int k = 0; k < 50; ++k) {
        ADFun<double> f = recorded(
            {1}, [t](const AVector& x) -> std::vector<ADouble> { return {x[0] * x[0] * double(t)}; });
        slopes[t] = f.Jacobian(DVector{3})[0];
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (std::size_t t = 0; t < slopes.size(); ++t) EXPECT_EQ(slopes[t], 6 * double(t));
}

// An exception of the user's code leaves the recording open, as in CppAD, and abort_recording ends it.
TEST(CppadThreads, ExceptionsInARecording) {
  AVector ax(1);
  try {
    Independent(ax);
    throw 1;
  } catch (int) {
    ADouble::abort_recording();
  }
  EXPECT_NO_THROW(Independent(ax));
  ADouble::abort_recording();
}

}  // namespace
