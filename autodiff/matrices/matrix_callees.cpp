// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/matrices/matrix_callees.h>

#include <map>
#include <mutex>

#include <dyntape/autodiff/derive/recorded_callee.h>

namespace dyntape::detail {

std::shared_ptr<const Callee> made_once(const std::string& name, const CalleeMaker& make) {
  static std::recursive_mutex mutex;  // the making of one may ask for another
  static std::map<std::string, std::weak_ptr<const Callee>> all;
  const std::scoped_lock lock(mutex);
  std::weak_ptr<const Callee>& known = all[name];
  if (auto callee = known.lock()) return callee;
  auto callee = make();
  known = callee;
  return callee;
}

VectorXad flat(std::initializer_list<MatrixXad> matrices) {
  Eigen::Index n = 0, at = 0;
  for (const MatrixXad& m : matrices) n += m.size();
  VectorXad all(n);
  for (const MatrixXad& m : matrices) {
    all.segment(at, m.size()) = m.reshaped();
    at += m.size();
  }
  return all;
}

namespace {

std::shared_ptr<const Callee> dissolving(const std::string& name, Eigen::Index n_in,
                                         const MatrixFunction::Body& body, CalleeMaker jvp = {},
                                         CalleeMaker vjp = {}) {
  const Function f =
      record(name, static_cast<std::size_t>(n_in), [&](const VectorXad& v) { return body(FlatReader(v)); });
  return dissolving_callee(f, std::move(jvp), std::move(vjp));
}

}  // namespace

std::shared_ptr<const Callee> callee_of(const MatrixFunction& f) {
  return made_once(f.name, [&f] {
    return dissolving(
        f.name, f.n_in, f.value, [f] { return dissolving(f.name + "_jvp", 2 * f.n_in, f.jvp); },
        [f] { return dissolving(f.name + "_vjp", f.n_in + f.n_out, f.vjp); });
  });
}

std::string sized_name(const char* name, Eigen::Index m, Eigen::Index n, Eigen::Index k) {
  return std::string(name) + "_" + std::to_string(m) + "x" + std::to_string(n) + "_" + std::to_string(k);
}

}  // namespace dyntape::detail
