// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/batch/batch_cases.h>

namespace dyntape {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

BatchCases::BatchCases(const Problem& problem, const DdpOptions& options, const DdpBatchValues& values)
    : problem_(problem),
      values_(values),
      N_(options.intervals),
      is_at_nodes_(options.start == DdpStart::kNodes) {
  find_count();
  check_starts();
  const double h = problem.duration / N_;
  const Index n_p = problem.parameters.size();
  parameters_.resize(2 + 3 * n_p, N_), u_.resize(problem.n_u(), N_), x_.resize(problem.n_x(), N_ + 1);
  for (int k = 0; k < N_; ++k) {
    parameters_.col(k).head(2) << k * h, h;
    for (int part = 0; part < 3; ++part)
      parameters_.col(k).segment(2 + part * n_p, n_p) = problem.parameters.at((k + part / 2.0) * h);
  }
  at_end_ = parameters_of(problem, problem.duration);
  for (int k = 0; k <= N_; ++k) {
    const Stage<double> stage = problem.first_guess(k < N_ ? k * h : problem.duration);
    if (stage.x.size() != problem.n_x() || (k < N_ && stage.u.size() != problem.n_u()))
      refuse("the guess has other sizes than the problem");
    x_.col(k) = stage.x;
    if (k < N_) u_.col(k) = stage.u;
  }
}

Problem BatchCases::problem(std::size_t i) const {
  Problem own = problem_;
  own.start = start(Index(i));
  if (values_.parameters.cols() == 0) return own;
  const VectorXd p = values_.parameters.col(Index(i));
  own.parameters = {};
  const std::vector<std::string> names = problem_.parameters.entry_names();
  for (Index j = 0; j < p.size(); ++j) own.parameters.add(names[std::size_t(j)], p[j]);
  return own;
}

void BatchCases::take_parameters(Index i) {
  if (values_.parameters.cols() == 0) return;
  const VectorXd p = values_.parameters.col(i);
  for (int part = 0; part < 3; ++part) parameters_.middleRows(2 + part * p.size(), p.size()).colwise() = p;
  at_end_.tail(p.size()) = p;
}

void BatchCases::load(LaneWork& work, int slot, std::size_t i) {
  const Index column = Index(i);
  take_parameters(column);
  if (values_.controls.cols() > 0) u_ = values_.controls.col(column).reshaped(u_.rows(), u_.cols());
  const VectorXd first = start(column);
  if (is_at_nodes_ && !problem_.guess) x_ = first.replicate(1, N_ + 1);
  x_.col(0) = first;
  u_ = u_.cwiseMax(problem_.u.lower.replicate(1, N_)).cwiseMin(problem_.u.upper.replicate(1, N_));
  work.load(slot, parameters_, at_end_, x_, u_);
}

void BatchCases::load_solution(LaneWork& work, int slot, std::size_t i, const DdpSolution& solution) {
  take_parameters(Index(i));
  MatrixXd x = MatrixXd::Zero(problem_.n_x() + problem_.parameters.size(), N_ + 1);
  x.topRows(problem_.n_x()) = solution.x;
  work.load(slot, parameters_, at_end_, x, solution.u);
}

VectorXd BatchCases::start(Index i) const {
  if (values_.starts.cols() > 0) return values_.starts.col(i);
  return problem_.start;
}

void BatchCases::refuse(const std::string& what) const { dyntape::refuse(problem_, what); }

void BatchCases::find_count() {
  struct Block {
    const char* name;
    const MatrixXd& values;
    Index rows;
  };
  const Block blocks[] = {{"starts", values_.starts, problem_.n_x()},
                          {"parameters", values_.parameters, problem_.parameters.size()},
                          {"controls", values_.controls, Index(problem_.n_u()) * N_}};
  for (const Block& block : blocks) {
    const Index cols = block.values.cols();
    if (cols == 0) continue;
    if (block.values.rows() != block.rows)
      refuse(std::string(block.name) + " of " + std::to_string(block.values.rows()) + " rows, expected " +
             std::to_string(block.rows));
    if (count_ > 0 && cols != count_)
      refuse(std::string(block.name) + " of " + std::to_string(cols) + " columns, expected " +
             std::to_string(count_) + ", one a problem");
    count_ = cols;
    for (Index i = 0; i < cols; ++i)
      if (!block.values.col(i).allFinite())
        refuse(std::string(block.name) + ": column " + std::to_string(i) + " is not finite");
  }
}

void BatchCases::check_starts() const {
  if (values_.starts.cols() > 0 || problem_.start.allFinite()) return;
  refuse("its start is not finite, and no starts are given");
}

}  // namespace dyntape
