// SPDX-License-Identifier: BSD-3-Clause
//
// Atomic functions of CppAD's first generation: five functions of the user.  Deprecated in CppAD; see atomic.h.
//
//   CPPAD_USER_ATOMIC(square, CppAD::vector, double, forward, reverse, for_jac_sparse, rev_jac_sparse, rev_hes_sparse)
//   square(id, ax, ay);                                  // id: passed to each of the five
//
// forward() computes the coefficient of one order; coefficients have the indices [j (order + 1) + k].
#pragma once

#include <dyntape/interface/cppad/nodes/atomic_base.h>

namespace CppAD::inline dyntape_names::detail {

template <class Base, template <class...> class Vector>
class UserAtomic : public atomic_base<Base> {
  using Size = std::size_t;
  using Numbers = Vector<Base>;
  using Bools = Vector<bool>;
  using Sets = vector<std::set<Size>>;
  using UserSets = Vector<std::set<Size>>;

 public:
  struct Functions {
    bool (*forward)(Size id, Size k, Size n, Size m, const Bools& vx, Bools& vy, const Numbers& tx,
                    Numbers& ty);
    bool (*reverse)(Size id, Size k, Size n, Size m, const Numbers& tx, const Numbers& ty, Numbers& px,
                    const Numbers& py);
    bool (*for_jac_sparse)(Size id, Size n, Size m, Size q, const UserSets& r, UserSets& s);
    bool (*rev_jac_sparse)(Size id, Size n, Size m, Size q, UserSets& r, const UserSets& s);
    bool (*rev_hes_sparse)(Size id, Size n, Size m, Size q, const UserSets& r, const Bools& s, Bools& t,
                           const UserSets& u, UserSets& v);
  };
  UserAtomic(const char* name, const Functions& functions) : atomic_base<Base>(name), call_(functions) {}
  void set_old(Size id) override { id_ = id; }

 private:
  template <class To, class From>
  static bool give(bool done, const From& values, To& to) {
    to = copied<To>(values);
    return done;
  }
  // The coefficients up to order k, of `orders` coefficients each.
  template <class To, class From>
  static To lowest(const From& t, Size k, Size orders) {
    To low(t.size() / orders * (k + 1));
    for (Size i = 0; i < low.size(); ++i) low[i] = t[i / (k + 1) * orders + i % (k + 1)];
    return low;
  }

  using atomic_base<Base>::forward;
  using atomic_base<Base>::reverse;
  using atomic_base<Base>::for_sparse_jac;
  using atomic_base<Base>::rev_sparse_jac;
  using atomic_base<Base>::rev_sparse_hes;
  bool forward(Size low, Size up, const vector<bool>& vx, vector<bool>& vy, const vector<Base>& tx,
               vector<Base>& ty) override {
    const Size orders = up + 1, n = tx.size() / orders, m = ty.size() / orders;
    for (Size k = low; k <= up; ++k) {
      const Bools user_vx = k == 0 ? copied<Bools>(vx) : Bools(0);
      Bools user_vy = k == 0 ? copied<Bools>(vy) : Bools(0);
      Numbers user_ty = lowest<Numbers>(ty, k, orders);
      if (!call_.forward(id_, k, n, m, user_vx, user_vy, lowest<Numbers>(tx, k, orders), user_ty))
        return false;
      for (Size i = 0; i < m; ++i) ty[i * orders + k] = user_ty[i * (k + 1) + k];
      if (k == 0) vy = copied<vector<bool>>(user_vy);
    }
    return true;
  }
  bool reverse(Size up, const vector<Base>& tx, const vector<Base>& ty, vector<Base>& px,
               const vector<Base>& py) override {
    Numbers user_px = copied<Numbers>(px);
    const bool done = call_.reverse(id_, up, tx.size() / (up + 1), ty.size() / (up + 1), copied<Numbers>(tx),
                                    copied<Numbers>(ty), user_px, copied<Numbers>(py));
    return give(done, user_px, px);
  }
  bool for_sparse_jac(Size q, const Sets& r, Sets& s) override {
    UserSets user_s(s.size());
    return give(call_.for_jac_sparse(id_, r.size(), s.size(), q, copied<UserSets>(r), user_s), user_s, s);
  }
  bool rev_sparse_jac(Size q, const Sets& rt, Sets& st) override {
    UserSets user_st(st.size());
    return give(call_.rev_jac_sparse(id_, st.size(), rt.size(), q, user_st, copied<UserSets>(rt)), user_st,
                st);
  }
  bool rev_sparse_hes(const vector<bool>&, const vector<bool>& s, vector<bool>& t, Size q, const Sets& r,
                      const Sets& u, Sets& v) override {
    Bools user_t(t.size());
    UserSets user_v(v.size());
    return give(call_.rev_hes_sparse(id_, t.size(), s.size(), q, copied<UserSets>(r), copied<Bools>(s),
                                     user_t, copied<UserSets>(u), user_v),
                user_v, v);
  }

  Functions call_;
  Size id_ = 0;
};

}  // namespace CppAD::inline dyntape_names::detail

namespace CppAD::inline dyntape_names {
template <class Base>
using user_atomic = atomic_base<Base>;  // user_atomic<Base>::clear() has nothing to free
}

#define CPPAD_USER_ATOMIC(name, Vector, Base, forward, reverse, for_jac_sparse, rev_jac_sparse,          \
                          rev_hes_sparse)                                                                \
  inline void name(std::size_t id, const Vector<::CppAD::AD<Base>>& ax, Vector<::CppAD::AD<Base>>& ay) { \
    static ::CppAD::detail::UserAtomic<Base, Vector> function(                                           \
        #name, {forward, reverse, for_jac_sparse, rev_jac_sparse, rev_hes_sparse});                      \
    function(ax, ay, id);                                                                                \
  }
