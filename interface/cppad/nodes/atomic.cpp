// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cctype>

#include <dyntape/interface/cppad/nodes/detail/atomic.hxx>

namespace CppAD::inline dyntape_names::detail {

std::string c_identifier(const std::string& name) {
  std::string identifier =
      name.empty() || std::isdigit(static_cast<unsigned char>(name[0])) ? "f_" + name : name;
  for (char& c : identifier) {
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  }
  return identifier;
}

namespace {

// The derivatives of a call in doubles, for derivation: by coefficients of orders 0 and 1.
struct AtomicKernels {
  static std::shared_ptr<Callee> callee(const AtomicAt<double>& at, const char* suffix, std::size_t n_in,
                                        std::size_t n_out,
                                        std::function<void(const double*, double*)> evaluate) {
    Kernel kernel;
    kernel.evaluate = std::move(evaluate);
    return std::make_shared<Callee>(c_identifier(at.name) + suffix, n_in, n_out, kernel);
  }
  // Order 1 along the second half of what comes in.
  static vector<double> along(const AtomicAt<double>& at, const double* x, const double* dx) {
    vector<double> tx(2 * at.n_in());
    for (std::size_t j = 0; j < at.n_in(); ++j) tx[2 * j] = x[j], tx[2 * j + 1] = dx[j];
    return tx;
  }
  static std::shared_ptr<const Callee> forward_1(const AtomicAt<double>& at) {
    return callee(at, "_forward", 2 * at.n_in(), at.n_out(), [at](const double* in, double* out) {
      const vector<double> ty = at.forward(1, along(at, in, in + at.n_in()));
      for (std::size_t i = 0; i < at.n_out(); ++i) out[i] = ty[2 * i + 1];
    });
  }
  static std::shared_ptr<const Callee> reverse_1(const AtomicAt<double>& at) {
    const auto gradient =
        callee(at, "_reverse", at.n_in() + at.n_out(), at.n_in(), [at](const double* in, double* out) {
          const vector<double> tx(in, in + at.n_in()), py(in + at.n_in(), in + at.n_in() + at.n_out()),
              px = at.reverse(0, tx, py);
          std::copy(px.begin(), px.end(), out);
        });
    gradient->jvp = [at] { return reverse_2(at); };
    return gradient;
  }
  // (x, w, dx, dw): how the gradient changes along dx and dw.
  static std::shared_ptr<const Callee> reverse_2(const AtomicAt<double>& at) {
    const std::size_t n = at.n_in(), m = at.n_out();
    return callee(at, "_reverse_2", 2 * (n + m), n, [at, n, m](const double* in, double* out) {
      vector<double> py(2 * m);
      for (std::size_t i = 0; i < m; ++i) py[2 * i + 1] = in[n + i], py[2 * i] = in[2 * n + m + i];
      const vector<double> px = at.reverse(1, along(at, in, in + n + m), py);
      for (std::size_t j = 0; j < n; ++j) out[j] = px[2 * j];
    });
  }
};

}  // namespace

std::shared_ptr<const Callee> callee_of_doubles(const AtomicAt<double>& at) {
  const auto callee =
      AtomicKernels::callee(at, "", at.n_in(), at.n_out(), [at](const double* in, double* out) {
        const vector<double> ty = at.forward(0, vector<double>(in, in + at.n_in()));
        std::copy(ty.begin(), ty.end(), out);
      });
  callee->jvp = [at] { return AtomicKernels::forward_1(at); };
  callee->vjp = [at] { return AtomicKernels::reverse_1(at); };
  return callee;
}

}  // namespace CppAD::inline dyntape_names::detail
