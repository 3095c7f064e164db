// SPDX-License-Identifier: BSD-3-Clause
#include "oracles.h"

#include <boost/numeric/odeint.hpp>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algebra/float128.h>
#include <dyntape/dynamics/algorithms/algorithms.h>

// Numbers of Boost.Multiprecision are no containers, which Odeint cannot tell.
template <>
struct boost::numeric::odeint::detail::extract_value_type<dyntape::dynamics::Float128, void> {
  using type = dyntape::dynamics::Float128;
};

namespace dyntape::tools {
namespace {

using Quad = dynamics::Float128;
using State = std::vector<Quad>;

class Rate {
 public:
  explicit Rate(const dynamics::Model<double>& model) : model_(model.cast<Quad>()), data_(model_) {
    for (const auto& joint : model_.joints) {
      if (!dynamics::is_single(joint.type) && joint.type != dynamics::JointType::kFreeFlyer)
        throw ArgumentError("exact_end: joint '" + joint.name +
                            "' is neither of one velocity nor a free base");
      if (dynamics::nq(joint.type) != dynamics::nv(joint.type) &&
          joint.type != dynamics::JointType::kFreeFlyer)
        throw ArgumentError("exact_end: joint '" + joint.name + "' is not on a line");
    }
  }

  void operator()(const State& x, State& rate, const Quad&) {
    const int nq = model_.nq, nv = model_.nv;
    const Eigen::Map<const dynamics::VectorX<Quad>> at(x.data(), nq + nv);
    dynamics::VectorX<Quad> q = at.head(nq);
    const dynamics::VectorX<Quad> v = at.tail(nv);
    for (const auto& joint : model_.joints) {
      if (joint.type != dynamics::JointType::kFreeFlyer) {
        rate[std::size_t(joint.idx_q)] = v[joint.idx_v];
        continue;
      }
      const Eigen::Quaternion<Quad> turned(q[joint.idx_q + 6], q[joint.idx_q + 3], q[joint.idx_q + 4],
                                           q[joint.idx_q + 5]);
      const Eigen::Matrix<Quad, 3, 1> linear = v.segment<3>(joint.idx_v), w = v.segment<3>(joint.idx_v + 3);
      const Eigen::Matrix<Quad, 3, 1> along = turned.normalized() * linear;
      const Eigen::Matrix<Quad, 4, 1> turns =
          (turned * Eigen::Quaternion<Quad>(0, w[0], w[1], w[2])).coeffs() / Quad(2);
      for (int i = 0; i < 3; ++i) rate[std::size_t(joint.idx_q + i)] = along[i];
      for (int i = 0; i < 4; ++i) rate[std::size_t(joint.idx_q + 3 + i)] = turns[i];
      q.segment<4>(joint.idx_q + 3).normalize();
    }
    const dynamics::VectorX<Quad> none = dynamics::VectorX<Quad>::Zero(nv);
    const dynamics::VectorX<Quad> a = dynamics::aba<Quad>(model_, data_, q, v, none);
    for (int i = 0; i < nv; ++i) rate[std::size_t(nq + i)] = a[i];
  }

 private:
  dynamics::Model<Quad> model_;
  dynamics::Data<Quad> data_;
};

template <class Stepper>
State end_of(Rate& rate, const Eigen::VectorXd& x0, double seconds, Stepper stepper) {
  State x;
  for (double entry : x0) x.emplace_back(entry);
  boost::numeric::odeint::integrate_adaptive(stepper, std::ref(rate), x, Quad(0), Quad(seconds),
                                             Quad(seconds) / 1000);
  return x;
}

}  // namespace

Eigen::VectorXd exact_end(const dynamics::Model<double>& model, const Eigen::VectorXd& x0, double seconds) {
  namespace odeint = boost::numeric::odeint;
  Rate rate(model);
  const Quad tolerance("1e-24");
  const State one =
      end_of(rate, x0, seconds,
             odeint::make_controlled(tolerance, tolerance, odeint::runge_kutta_fehlberg78<State, Quad>()));
  const State other = end_of(rate, x0, seconds, odeint::bulirsch_stoer<State, Quad>(tolerance, tolerance));
  Eigen::VectorXd end(x0.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    if (abs(one[i] - other[i]) > Quad("1e-18") * (1 + abs(one[i])))
      throw ArgumentError("exact_end: two methods in 113 bits differ by " +
                          std::to_string(double(abs(one[i] - other[i]))) + " at entry " + std::to_string(i));
    end[Eigen::Index(i)] = double(one[i]);
  }
  return end;
}

}  // namespace dyntape::tools
