// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/casadi_program.h>

#include <algorithm>

namespace dyntape::codegen {

// One evaluation.
struct CasadiProgram::Room {
  explicit Room(const CompiledFunction& f)
      : workspace(f), x(f.n_x()), weights(f.n_y()), y(f.n_y()), gradient(f.n_x()) {
    if (f.order() >= Order::kFirst) jacobian.resize(f.jacobian_pattern().nnz());
    if (f.order() >= Order::kSecond) hessian.resize(f.hessian_pattern().nnz());
  }
  double* array(CasadiArgument::Array which) {
    std::vector<double>* const arrays[] = {nullptr, &x, &weights, &y, &jacobian, &hessian, &gradient};
    return arrays[which]->data();
  }
  CompiledFunction::Workspace workspace;
  std::vector<double> x, weights, y, jacobian, hessian, gradient;
};

CasadiProgram::CasadiProgram(const Function& function, const CasadiBlocks& blocks,
                             const CodegenOptions& options)
    : compiled_(CompiledFunction::make(function, options)),
      functions_(
          casadi_functions(function, blocks, options.order,
                           options.order >= Order::kFirst ? compiled_.jacobian_pattern() : Pattern{},
                           options.order >= Order::kSecond ? compiled_.hessian_pattern() : Pattern{})) {}
CasadiProgram::~CasadiProgram() = default;

int CasadiProgram::call(std::size_t k, const double* const* arg, double* const* res) const noexcept try {
  std::unique_ptr<Room> room;
  {
    const std::lock_guard lock(mutex_);
    if (!rooms_.empty()) room = std::move(rooms_.back()), rooms_.pop_back();
  }
  if (!room) room = std::make_unique<Room>(compiled_);
  run(functions_[k], arg, res, *room);
  const std::lock_guard lock(mutex_);
  rooms_.push_back(std::move(room));
  return 0;
} catch (...) {
  return 1;
}

void CasadiProgram::run(const CasadiFunction& f, const double* const* arg, double* const* res,
                        Room& room) const {
  for (std::size_t i = 0; i < f.in.size(); ++i) {
    const CasadiArgument& argument = f.in[i];
    for (std::size_t n = 0; n < argument.places.size(); ++n)
      room.array(argument.array)[argument.places[n]] = arg[i] ? arg[i][n] : 0;
  }
  Points point{.count = 1, .x = room.x.data(), .y = room.y.data()};
  if (f.order >= Order::kFirst) point.jacobian = room.jacobian.data();
  if (f.order >= Order::kSecond) point.w = room.weights.data(), point.hessian = room.hessian.data();
  compiled_.check(compiled_.run(f.order, point, room.workspace), 1);
  if (f.prefix == "adj1_") {
    const Pattern& pattern = compiled_.jacobian_pattern();
    std::fill(room.gradient.begin(), room.gradient.end(), 0.0);
    for (std::size_t n = 0; n < pattern.nnz(); ++n)
      room.gradient[pattern.col[n]] += room.jacobian[n] * room.weights[pattern.row[n]];
  }
  for (std::size_t i = 0; i < f.out.size(); ++i) {
    const CasadiArgument& argument = f.out[i];
    for (std::size_t n = 0; res[i] && n < argument.places.size(); ++n)
      res[i][n] = room.array(argument.array)[argument.places[n]];
  }
}

}  // namespace dyntape::codegen
