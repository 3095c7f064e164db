// SPDX-License-Identifier: BSD-3-Clause
//
// Quadratic programs as layers, a batch at a time; dyntape/_quadratic.py broadcasts and names what is here.
#include <algorithm>
#include <memory>

#include <dyntape/codegen/run/threads.h>
#include <dyntape/interface/control/sensitivity/quadratic_layer.h>

#include "arrays.h"
#include "module.h"
#include "watch.h"

namespace dyntape::python {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

struct LayerSizes {
  std::ptrdiff_t count, n, of_A, of_G;
};

// Programs, or changes of programs, one after another: Q (count, n, n), q (count, n), A (count, of_A, n), b, G, h.
class Programs {
 public:
  Programs(const LayerSizes& sizes, nb::handle Q, nb::handle q, nb::handle A, nb::handle b, nb::handle G,
           nb::handle h)
      : sizes_(sizes),
        Q_(numbers(Q, "Q", {sizes.count, sizes.n, sizes.n})),
        q_(numbers(q, "q", {sizes.count, sizes.n})),
        A_(numbers(A, "A", {sizes.count, sizes.of_A, sizes.n})),
        b_(numbers(b, "b", {sizes.count, sizes.of_A})),
        G_(numbers(G, "G", {sizes.count, sizes.of_G, sizes.n})),
        h_(numbers(h, "h", {sizes.count, sizes.of_G})) {}
  QuadraticProgram at(std::size_t k) const {
    const auto matrix = [&](const Numbers& of, std::ptrdiff_t rows) -> MatrixXd {
      return Eigen::Map<const RowMajor>(of.data + Index(k) * rows * sizes_.n, rows, sizes_.n);
    };
    const auto vector = [&](const Numbers& of, std::ptrdiff_t rows) -> VectorXd {
      return Eigen::Map<const VectorXd>(of.data + Index(k) * rows, rows);
    };
    return {matrix(Q_, sizes_.n),    vector(q_, sizes_.n),    matrix(A_, sizes_.of_A),
            vector(b_, sizes_.of_A), matrix(G_, sizes_.of_G), vector(h_, sizes_.of_G)};
  }

 private:
  LayerSizes sizes_;
  Numbers Q_, q_, A_, b_, G_, h_;
};

class QuadraticLayers {
 public:
  QuadraticLayers(nb::handle Q, nb::handle q, nb::handle A, nb::handle b, nb::handle G, nb::handle h) {
    const Numbers costs = numbers(q, "q", {-1, -1}), equal = numbers(b, "b", {-1, -1}),
                  kept = numbers(h, "h", {-1, -1});
    sizes_ = {costs.shape[0], costs.shape[1], equal.shape[1], kept.shape[1]};
    const Programs programs(sizes_, Q, q, A, b, G, h);
    layers_.resize(std::size_t(sizes_.count));
    for_all([&](std::size_t k) { layers_[k] = std::make_unique<QuadraticLayer>(programs.at(k)); });
  }

  QuadraticLayers(const QuadraticLayers&) = delete;

  nb::object solution() const {
    return tuple_of([](const QuadraticLayer& layer) { return layer.solution(); });
  }
  nb::object certificate() const {
    return tuple_of([](const QuadraticLayer& layer) { return layer.certificate(); });
  }
  nb::object forward(nb::handle Q, nb::handle q, nb::handle A, nb::handle b, nb::handle G,
                     nb::handle h) const {
    const Programs changes(sizes_, Q, q, A, b, G, h);
    std::vector<QuadraticSolution> steps(layers_.size());
    for_all([&](std::size_t k) { steps[k] = layers_[k]->forward(changes.at(k)); });
    return tuple_of(steps);
  }
  nb::object backward(nb::handle slope, bool holds_weak) const {
    const Numbers given = numbers(slope, "slope", {sizes_.count, sizes_.n});
    const std::ptrdiff_t n = sizes_.n;
    const std::vector<Shape> shapes{{sizes_.count, n, n},           {sizes_.count, n},
                                    {sizes_.count, sizes_.of_A, n}, {sizes_.count, sizes_.of_A},
                                    {sizes_.count, sizes_.of_G, n}, {sizes_.count, sizes_.of_G}};
    nb::list results;
    std::vector<double*> data(shapes.size());
    for (std::size_t i = 0; i < shapes.size(); ++i) results.append(new_array(shapes[i], data[i]));
    for_all([&](std::size_t k) {
      const QuadraticProgram g =
          layers_[k]->backward(Eigen::Map<const VectorXd>(given.data + Index(k) * n, n),
                               holds_weak ? WeakRows::kHeld : WeakRows::kOpen);
      const auto write = [&](std::size_t i, const MatrixXd& M) {
        RowMajor::Map(data[i] + Index(k) * M.size(), M.rows(), M.cols()) = M;
      };
      write(0, g.Q), write(1, g.q), write(2, g.A), write(3, g.b), write(4, g.G), write(5, g.h);
    });
    return nb::tuple(results);
  }

  template <typename F>
  auto each(const F& of) const {
    std::vector<decltype(of(*layers_[0]))> values;
    for (const auto& layer : layers_) values.push_back(of(*layer));
    return values;
  }

 private:
  template <typename F>
  void for_all(const F& body) const {
    const std::size_t count = layers_.size(), chunk = 16;
    interruptible(count > chunk, [&](const std::stop_token& stop) {
      codegen::run_tasks((count + chunk - 1) / chunk, [&](std::size_t task) {
        for (std::size_t k = task * chunk; k < std::min(count, (task + 1) * chunk); ++k)
          if (!stop.stop_requested()) body(k);
      });
    });
  }
  template <typename F>
  nb::object tuple_of(const F& of) const {
    std::vector<QuadraticSolution> all;
    for (const auto& layer : layers_) all.push_back(of(*layer));
    return tuple_of(all);
  }
  // x (count, n), nu (count, of_A), lambda (count, of_G): NaN for what is not there.
  nb::object tuple_of(const std::vector<QuadraticSolution>& all) const {
    const auto column = [&](VectorXd QuadraticSolution::*part, std::ptrdiff_t rows) {
      double* data = nullptr;
      nb::object array = new_array({sizes_.count, rows}, data);
      std::fill_n(data, sizes_.count * rows, NAN);
      for (std::size_t k = 0; k < all.size(); ++k) {
        const VectorXd& value = all[k].*part;
        std::copy(value.begin(), value.end(), data + Index(k) * rows);
      }
      return array;
    };
    return nb::make_tuple(column(&QuadraticSolution::x, sizes_.n),
                          column(&QuadraticSolution::nu, sizes_.of_A),
                          column(&QuadraticSolution::lambda, sizes_.of_G));
  }

  LayerSizes sizes_{};
  std::vector<std::unique_ptr<QuadraticLayer>> layers_;
};

}  // namespace

void bind_quadratic(nb::module_& module) {
  using L = QuadraticLayers;
  nb::class_<L>(module, "QuadraticLayers",
                "What dyntape.QuadraticLayer is made of: programs one after another.")
      .def(nb::init<nb::handle, nb::handle, nb::handle, nb::handle, nb::handle, nb::handle>(), nb::arg("Q"),
           nb::arg("q"), nb::arg("A"), nb::arg("b"), nb::arg("G"), nb::arg("h"), "Solves them.")
      .def("solution", &L::solution, "x, nu, lambda of each.")
      .def("certificate", &L::certificate,
           "x, nu, lambda of the proof that there is no solution; NaN: not of it.")
      .def("forward", &L::forward, nb::arg("Q"), nb::arg("q"), nb::arg("A"), nb::arg("b"), nb::arg("G"),
           nb::arg("h"), "Derivatives of x, nu, lambda along changes.")
      .def("backward", &L::backward, nb::arg("slope"), nb::arg("holds_weak"),
           "Gradients by Q, q, A, b, G, h of a function of x with this gradient.")
      .def(
          "outcomes",
          [](const L& l) {
            return l.each(
                [](const QuadraticLayer& layer) { return std::string(to_string(layer.outcome())); });
          },
          "How each ended.")
      .def(
          "statuses",
          [](const L& l) {
            return l.each([](const QuadraticLayer& layer) { return std::string(to_string(layer.status())); });
          },
          "What the derivatives of each are.")
      .def(
          "reasons",
          [](const L& l) { return l.each([](const QuadraticLayer& layer) { return layer.why(); }); },
          "A sentence for each that is not good.")
      .def(
          "weak", [](const L& l) { return l.each([](const QuadraticLayer& layer) { return layer.weak(); }); },
          "Active inequalities with multiplier zero.");
}

}  // namespace dyntape::python
