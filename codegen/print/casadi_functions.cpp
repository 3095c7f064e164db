// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/print/casadi_functions.h>

#include <algorithm>
#include <utility>

#include <dyntape/autodiff/error.h>

namespace dyntape::codegen {
namespace {

using Array = CasadiArgument::Array;

// An entry of a sparse block, and where its value stands.
struct CasadiEntry {
  std::size_t row, col;
  std::size_t from;
};

// Blocks with the places of their entries in all of x or y.
class Layout {
 public:
  explicit Layout(const std::vector<CasadiBlock>& blocks) : blocks_(blocks) {
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      first_.push_back(of_.size());
      of_.insert(of_.end(), blocks[b].size(), b);
    }
  }
  std::size_t size() const { return of_.size(); }
  const CasadiBlock& operator[](std::size_t b) const { return blocks_[b]; }
  std::size_t count() const { return blocks_.size(); }
  std::size_t block_of(std::size_t entry) const { return of_[entry]; }
  // In CasADi's vector of its block.
  std::size_t place_of(std::size_t entry) const {
    const CasadiBlock& block = blocks_[of_[entry]];
    const std::size_t k = entry - first_[of_[entry]];
    return k / block.cols + k % block.cols * block.rows;
  }
  // Of a block's entries in CasADi's order.
  std::vector<std::uint32_t> places(std::size_t b) const {
    std::vector<std::uint32_t> all(blocks_[b].size());
    for (std::size_t k = 0; k < all.size(); ++k)
      all[place_of(first_[b] + k)] = static_cast<std::uint32_t>(first_[b] + k);
    return all;
  }

 private:
  const std::vector<CasadiBlock>& blocks_;
  std::vector<std::size_t> first_, of_;
};

class Signatures {
 public:
  Signatures(const CasadiBlocks& blocks, const Pattern& jacobian, const Pattern& hessian)
      : x_(blocks.inputs), y_(blocks.outputs), jacobian_(jacobian), hessian_(hessian) {}

  const Layout& x() const { return x_; }
  const Layout& y() const { return y_; }

  CasadiFunction value() const { return {"", Order::kValue, inputs(), dense(y_, "", Array::kY)}; }

  CasadiFunction jacobian() const {
    CasadiFunction f{"jac_", Order::kFirst, inputs(), {}};
    append(f.in, dense(y_, "out_", Array::kNothing));
    for (std::size_t i = 0; i < y_.count(); ++i) {
      for (std::size_t j = 0; j < x_.count(); ++j)
        f.out.push_back(sparse("jac_" + y_[i].name + "_" + x_[j].name, y_[i].size(), x_[j].size(),
                               of_jacobian(i, j, false), Array::kJacobian));
    }
    return f;
  }

  CasadiFunction gradient() const {
    CasadiFunction f{"adj1_", Order::kFirst, inputs(), dense(x_, "adj_", Array::kGradient)};
    append(f.in, dense(y_, "out_", Array::kNothing));
    append(f.in, dense(y_, "adj_", Array::kWeights));
    return f;
  }

  CasadiFunction gradient_jacobian() const {
    CasadiFunction f{"jac_adj1_", Order::kSecond, gradient().in, {}};
    append(f.in, dense(x_, "out_adj_", Array::kNothing));
    for (std::size_t i = 0; i < x_.count(); ++i) {
      const std::string name = "jac_adj_" + x_[i].name + "_";
      for (std::size_t j = 0; j < x_.count(); ++j)
        f.out.push_back(
            sparse(name + x_[j].name, x_[i].size(), x_[j].size(), of_hessian(i, j), Array::kHessian));
      for (std::size_t j = 0; j < y_.count(); ++j)
        f.out.push_back(sparse(name + "out_" + y_[j].name, x_[i].size(), y_[j].size(), {}, Array::kNothing));
      for (std::size_t j = 0; j < y_.count(); ++j)
        f.out.push_back(sparse(name + "adj_" + y_[j].name, x_[i].size(), y_[j].size(),
                               of_jacobian(j, i, true), Array::kJacobian));
    }
    return f;
  }

 private:
  using Arguments = std::vector<CasadiArgument>;

  static void append(Arguments& to, Arguments&& more) {
    std::move(more.begin(), more.end(), std::back_inserter(to));
  }

  Arguments inputs() const { return dense(x_, "", Array::kX); }

  static Arguments dense(const Layout& blocks, const std::string& prefix, Array array) {
    Arguments all;
    for (std::size_t b = 0; b < blocks.count(); ++b) {
      const CasadiBlock& block = blocks[b];
      all.push_back({prefix + block.name,
                     {static_cast<long long>(block.rows), static_cast<long long>(block.cols), 1},
                     array,
                     array == Array::kNothing ? std::vector<std::uint32_t>() : blocks.places(b)});
    }
    return all;
  }

  static CasadiArgument sparse(const std::string& name, std::size_t rows, std::size_t cols,
                               std::vector<CasadiEntry> entries, Array array) {
    std::sort(entries.begin(), entries.end(), [](const CasadiEntry& a, const CasadiEntry& b) {
      return std::pair(a.col, a.row) < std::pair(b.col, b.row);
    });
    CasadiArgument made{name, {static_cast<long long>(rows), static_cast<long long>(cols)}, array, {}};
    std::size_t k = 0;
    for (std::size_t j = 0; j <= cols; ++j) {
      made.sparsity.push_back(static_cast<long long>(k));
      while (k < entries.size() && entries[k].col == j) ++k;
    }
    for (const CasadiEntry& entry : entries) {
      made.sparsity.push_back(static_cast<long long>(entry.row));
      made.places.push_back(static_cast<std::uint32_t>(entry.from));
    }
    return made;
  }

  // Of a result by an input; transposed: of the gradient by the weights.
  std::vector<CasadiEntry> of_jacobian(std::size_t output, std::size_t input, bool transposed) const {
    std::vector<CasadiEntry> entries;
    for (std::size_t k = 0; k < jacobian_.nnz(); ++k) {
      const std::size_t i = jacobian_.row[k], j = jacobian_.col[k];
      if (y_.block_of(i) != output || x_.block_of(j) != input) continue;
      const std::size_t row = y_.place_of(i), col = x_.place_of(j);
      entries.push_back(transposed ? CasadiEntry{col, row, k} : CasadiEntry{row, col, k});
    }
    return entries;
  }

  std::vector<CasadiEntry> of_hessian(std::size_t rows, std::size_t cols) const {
    std::vector<CasadiEntry> entries;
    const auto take = [&](std::size_t i, std::size_t j, std::size_t k) {
      if (x_.block_of(i) == rows && x_.block_of(j) == cols)
        entries.push_back({x_.place_of(i), x_.place_of(j), k});
    };
    for (std::size_t k = 0; k < hessian_.nnz(); ++k) {
      take(hessian_.row[k], hessian_.col[k], k);
      if (hessian_.row[k] != hessian_.col[k]) take(hessian_.col[k], hessian_.row[k], k);
    }
    return entries;
  }

  const Layout x_, y_;
  const Pattern &jacobian_, &hessian_;
};

}  // namespace

std::vector<CasadiFunction> casadi_functions(const Function& f, const CasadiBlocks& blocks, Order order,
                                             const Pattern& jacobian, const Pattern& hessian) {
  const Signatures functions(blocks, jacobian, hessian);
  const std::string of = "CasADi's interface of \"" + f.name + "\": ";
  if (f.n_p() || f.n_w())
    throw ArgumentError(of + "expected variables only, got " + std::to_string(f.n_p()) + " parameters and " +
                        std::to_string(f.n_w()) + " weights; all_as_variables() turns them into variables");
  if (functions.x().size() != f.n_x() || functions.y().size() != f.n_y())
    throw ArgumentError(of + "the blocks have " + std::to_string(functions.x().size()) + " inputs and " +
                        std::to_string(functions.y().size()) + " outputs; expected " +
                        std::to_string(f.n_x()) + " and " + std::to_string(f.n_y()));
  std::vector<CasadiFunction> all = {functions.value()};
  if (order >= Order::kFirst) all.push_back(functions.jacobian()), all.push_back(functions.gradient());
  if (order >= Order::kSecond) all.push_back(functions.gradient_jacobian());
  return all;
}

}  // namespace dyntape::codegen
