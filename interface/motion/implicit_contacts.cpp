// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/motion/implicit_contacts.h>

#include <algorithm>
#include <cmath>

namespace dyntape {

namespace {

using dynamics::RigidContact;
using dynamics::UnilateralConstraints;

// "foot", and where a frame touches several planes "foot.2" of the second.
std::vector<std::string> contact_names(const UnilateralConstraints& rigid) {
  std::vector<std::string> names;
  for (const RigidContact& contact : rigid.contacts) {
    const auto has_name = [&](const std::string& name) {
      return std::find(names.begin(), names.end(), name) != names.end();
    };
    std::string name = contact.name;
    for (int number = 2; has_name(name); ++number) name = contact.name + "." + std::to_string(number);
    names.push_back(name);
  }
  return names;
}

}  // namespace

void check_implicit_contacts(const RobotScene& scene) {
  const auto refuse = [&](const std::string& what) { dyntape::refuse(scene.model, what); };
  if (!scene.constraints.loops.empty())
    refuse("the scene has closed loops, which optimal control does not know; only simulate does");
  if (!scene.constraints.rigid.stops.empty())
    refuse("the scene has hard limits, which optimal control does not know; expected bounds of positions");
  for (const RigidContact& contact : scene.constraints.rigid.contacts) {
    if (contact.restitution > 0)
      refuse("the contact of \"" + contact.name + "\" rebounds (restitution " +
             std::to_string(contact.restitution) + "), which optimal control does not know; expected 0");
  }
}

std::vector<std::string> force_names(const UnilateralConstraints& rigid) {
  std::vector<std::string> names;
  const std::vector<std::string> contacts = contact_names(rigid);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    names.push_back("f." + contacts[i] + ".n");
    if (rigid.contacts[i].friction == 0) continue;
    names.push_back("f." + contacts[i] + ".t1");
    names.push_back("f." + contacts[i] + ".t2");
  }
  return names;
}

void add_implicit_contacts(Problem& problem, const UnilateralConstraints& rigid, double weight,
                           const TouchingFunction& touching) {
  if (rigid.contacts.empty()) return;
  const ContactRounding rounding;
  const Parameter relaxation = problem.parameters.add(kContactRelaxation, rounding.relaxation),
                  slip = problem.parameters.add(kContactSlip, rounding.slip);
  const std::vector<std::string> names = contact_names(rigid);
  Eigen::Index k = problem.n_u() - Eigen::Index(force_names(rigid).size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    const UnilateralConstraints one{{rigid.contacts[i]}, {}};
    problem.u.lower[k] = 0;
    problem.add(path_not_negative(names[i] + " gap", [=](const auto& s) { return touching(s, one).gap; }));
    problem.add(path_not_negative(names[i] + " complementarity", [=, scale = 1 / weight](const auto& s) {
      using T = typename std::decay_t<decltype(s.u)>::Scalar;
      return vector(T(relaxation(s)[0] - s.u[k] * T(scale) * touching(s, one).gap[0]));
    }));
    const double mu = rigid.contacts[i].friction;
    if (mu > 0) {
      problem.add(path_equality(
          names[i] + " friction", [=, scale = 1 / weight, n = problem.positions](const auto& s) {
            using T = typename std::decay_t<decltype(s.u)>::Scalar;
            using std::sqrt;
            const auto J = touching(s, one).J;
            const typename Stage<T>::Vector v = J.bottomRows(2) * s.x.segment(n, J.cols());
            const T speed = sqrt(v.squaredNorm() + slip(s)[0] * slip(s)[0]), normal = s.u[k] * T(mu);
            return typename Stage<T>::Vector((s.u.segment(k + 1, 2) * speed + v * normal) * T(scale));
          }));
    }
    k += mu > 0 ? 3 : 1;
  }
}

std::vector<Parameters> contact_continuation(const Problem& problem, const ContactContinuation& c) {
  std::vector<Parameters> all;
  for (int solve = 0; solve < c.solves; ++solve) {
    const double share = c.solves > 1 ? double(solve) / (c.solves - 1) : 1;
    const auto between = [&](double first, double last) { return first * std::pow(last / first, share); };
    Parameters now = problem.parameters;
    now.set(kContactRelaxation, between(c.first.relaxation, c.last.relaxation));
    now.set(kContactSlip, between(c.first.slip, c.last.slip));
    all.push_back(std::move(now));
  }
  return all;
}

}  // namespace dyntape
