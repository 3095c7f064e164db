// SPDX-License-Identifier: BSD-3-Clause
//
// Where every entry of the derivatives comes from.
#include <algorithm>
#include <numeric>

#include <dyntape/interface/control/discretize/staged_nlp.h>

namespace dyntape {

namespace {

using Place = std::pair<std::size_t, std::size_t>;  // row, column

// Non-zeros of each row of a pattern: [first, last) of row i.
std::vector<std::size_t> row_begins(const Pattern& pattern) {
  std::vector<std::size_t> begins(pattern.rows + 1, 0);
  for (std::uint32_t row : pattern.row) ++begins[row + 1];
  std::partial_sum(begins.begin(), begins.end(), begins.begin());
  return begins;
}

// Numbers the places in sorted order and says which number each has.
std::vector<std::size_t> number_places(const std::vector<Place>& places, Pattern& pattern) {
  std::vector<Place> sorted = places;
  std::sort(sorted.begin(), sorted.end());
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  for (const Place& place : sorted) {
    pattern.row.push_back(static_cast<std::uint32_t>(place.first));
    pattern.col.push_back(static_cast<std::uint32_t>(place.second));
  }
  std::vector<std::size_t> numbers;
  for (const Place& place : places)
    numbers.push_back(std::size_t(std::lower_bound(sorted.begin(), sorted.end(), place) - sorted.begin()));
  return numbers;
}

// The non-zeros of one output.
struct OutputSlopes {
  std::size_t variable;              // to which columns are relative
  std::size_t source;                // of the first one
  const std::uint32_t *begin, *end;  // columns
};

class Outputs {
 public:
  explicit Outputs(const std::vector<Evaluator>& evaluators) : evaluators_(evaluators) {
    for (const Evaluator& e : evaluators) begins_.push_back(row_begins(e.function.jacobian_pattern()));
  }

  OutputSlopes slopes(std::size_t evaluator, std::size_t output) const {
    const Evaluator& e = evaluators_[evaluator];
    const Pattern& pattern = e.function.jacobian_pattern();
    const std::size_t point = (output - e.y) / e.function.n_y(), row = (output - e.y) % e.function.n_y();
    const std::size_t first = begins_[evaluator][row], last = begins_[evaluator][row + 1];
    return {e.at.variable + point * e.function.n_x(), e.jacobian + point * pattern.nnz() + first,
            pattern.col.data() + first, pattern.col.data() + last};
  }

 private:
  const std::vector<Evaluator>& evaluators_;
  std::vector<std::vector<std::size_t>> begins_;
};

}  // namespace

void StagedNlp::lay_out_jacobian() {
  struct Entry {
    std::size_t col;
    double constant, factor;
    std::size_t source;
    bool is_constant() const { return factor == 0; }
  };
  Pattern& J = program_.shape.jacobian;
  J = {shape().m(), shape().n(), {}, {}};
  const Outputs outputs(program_.evaluators);
  std::vector<Entry> entries;
  for (const RowBlock& block : program_.rows) {
    for (std::size_t i = 0; i < block.size; ++i) {
      entries.clear();
      for (std::size_t t = block.first_term; t < block.last_term; ++t) {
        const LinearTerm& term = program_.terms[t];
        if (term.evaluator == LinearTerm::kVariables) {
          entries.push_back({term.first + i, term.factor, 0, 0});
          continue;
        }
        const OutputSlopes slopes = outputs.slopes(term.evaluator, term.first + i);
        for (const std::uint32_t* col = slopes.begin; col != slopes.end; ++col)
          entries.push_back(
              {slopes.variable + *col, 0, term.factor, slopes.source + std::size_t(col - slopes.begin)});
      }
      std::stable_sort(entries.begin(), entries.end(),
                       [](const Entry& a, const Entry& b) { return a.col < b.col; });
      for (std::size_t e = 0; e < entries.size(); ++e) {
        if (e == 0 || entries[e].col != entries[e - 1].col) {
          J.row.push_back(std::uint32_t(block.row + i)), J.col.push_back(std::uint32_t(entries[e].col));
          constants_.push_back(0);
        }
        constants_.back() += entries[e].constant;
        if (!entries[e].is_constant())
          of_jacobian_.push_back({J.nnz() - 1, entries[e].factor, entries[e].source});
      }
    }
  }
}

void StagedNlp::lay_out_gradient() {
  const Outputs outputs(program_.evaluators);
  for (std::size_t k = 0; k < phases(); ++k) {
    gradient_begin_.push_back(of_gradient_.size());
    for (std::size_t c = phase(k).cost; c < program_.end_of_costs(k); ++c) {
      const CostTerm& cost = program_.costs[c];
      const OutputSlopes slopes = outputs.slopes(cost.evaluator, cost.output);
      for (const std::uint32_t* col = slopes.begin; col != slopes.end; ++col)
        of_gradient_.push_back(
            {slopes.variable + *col, cost.factor, slopes.source + std::size_t(col - slopes.begin)});
    }
  }
  gradient_begin_.push_back(of_gradient_.size());
}

void StagedNlp::lay_out_exact_hessian() {
  std::vector<Place> places;
  for (const Evaluator& e : program_.evaluators) {
    const Pattern& own = e.function.hessian_pattern();
    for (std::size_t p = 0; p < e.at.count; ++p) {
      const std::size_t first = e.at.variable + p * e.function.n_x();
      for (std::size_t i = 0; i < own.nnz(); ++i) places.emplace_back(first + own.row[i], first + own.col[i]);
    }
  }
  of_hessian_ = number_places(places, program_.shape.hessian);
}

// 2 J^T J of every point; along the path it is integrated as costs are.
void StagedNlp::lay_out_gauss_newton() {
  std::vector<Place> places;
  const auto add = [&](const Evaluator& e, std::size_t point, double weight) {
    const Pattern& own = e.function.jacobian_pattern();
    const std::vector<std::size_t> begin = row_begins(own);
    const std::size_t source = e.jacobian + point * own.nnz(),
                      variable = e.at.variable + point * e.function.n_x();
    for (std::size_t r = 0; r < own.rows; ++r) {
      for (std::size_t i = begin[r]; i < begin[r + 1]; ++i) {
        for (std::size_t j = begin[r]; j <= i; ++j) {
          places.emplace_back(variable + own.col[i], variable + own.col[j]);
          of_squares_.push_back({0, 2 * weight, source + i, source + j});
        }
      }
    }
  };
  for (const StagedPhase& phase : program_.phases) {
    for (std::size_t p = 0; p < phase.used; ++p)
      add(program_.squares[phase.squares], p, program_.costs[phase.cost + p].factor);
    for (std::size_t k = 0; k < phase.instants.size(); ++k)
      add(program_.squares[phase.squares + 1 + k], 0, 1);
  }
  const std::vector<std::size_t> numbers = number_places(places, program_.shape.hessian);
  for (std::size_t e = 0; e < numbers.size(); ++e) of_squares_[e].target = numbers[e];
}

}  // namespace dyntape
