// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/system/steps/cvodes.h>

#include <cvodes/cvodes.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>
#include <sunnonlinsol/sunnonlinsol_newton.h>

#include <algorithm>
#include <stdexcept>
#include <vector>

namespace dyntape {

// What objects of SUNDIALS go back through.
namespace sundials {

template <class T, auto kFree>
struct Freed {
  void operator()(T* object) const { kFree(object); }
};
template <class Handle, auto kFree>
using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, Freed<std::remove_pointer_t<Handle>, kFree>>;

inline void free_context(SUNContext context) { SUNContext_Free(&context); }
inline void free_memory(void* memory) { CVodeFree(&memory); }
inline void free_linear(SUNLinearSolver solver) { SUNLinSolFree(solver); }
inline void free_newton(SUNNonlinearSolver solver) { SUNNonlinSolFree(solver); }

}  // namespace sundials

namespace {

constexpr int kDone = 0, kTryShorter = 1;  // what callbacks return
// How often an internal step is tried anew, ten times and four times as short: down to 1e-30 of the first try.  The
// 7 and 10 tries that are usual in CVODES are not enough where the first is too long for the sensitivities.
constexpr int kMostErrorFailures = 30, kMostSolverFailures = 50;

void require(bool done) {
  if (!done) throw std::runtime_error("SUNDIALS refuses the options");
}

template <class Handle>
Handle made(Handle object) {
  if (!object) throw std::bad_alloc();
  return object;
}

}  // namespace

struct Cvodes::Solver {
  Solver(InitialValueProblem& p, int n, int columns) : problem(p), S(n, columns), dS(n, columns) {
    SUNContext made_context = nullptr;
    require(SUNContext_Create(nullptr, &made_context) == 0);
    context.reset(made_context);
  }

  static Solver& of(void* user) { return *static_cast<Solver*>(user); }
  static int f(double s, N_Vector y, N_Vector dy, void* user) {
    return of(user).problem.rate(s, NV_DATA_S(y), NV_DATA_S(dy)) ? kDone : kTryShorter;
  }
  static int jacobian(double s, N_Vector y, N_Vector, SUNMatrix J, void* user, N_Vector, N_Vector, N_Vector) {
    return of(user).problem.jacobian(s, NV_DATA_S(y), SUNDenseMatrix_Data(J)) ? kDone : kTryShorter;
  }
  static int sensitivities(int columns, double s, N_Vector y, N_Vector, N_Vector* S, N_Vector* dS, void* user,
                           N_Vector, N_Vector) {
    Solver& solver = of(user);
    const auto column = [&](N_Vector x) {
      return Eigen::Map<Eigen::VectorXd>(NV_DATA_S(x), solver.S.rows());
    };
    for (int k = 0; k < columns; ++k) solver.S.col(k) = column(S[k]);
    if (!solver.problem.sensitivity_rate(s, NV_DATA_S(y), solver.S, solver.dS)) return kTryShorter;
    for (int k = 0; k < columns; ++k) column(dS[k]) = solver.dS.col(k);
    return kDone;
  }
  static int weights(N_Vector y, N_Vector weights, void* user) {
    double* w = NV_DATA_S(weights);
    of(user).problem.allowed_errors(NV_DATA_S(y), w);
    for (Eigen::Index i = 0; i < NV_LENGTH_S(weights); ++i) w[i] = 1 / w[i];
    return kDone;
  }
  static void say_nothing(int, const char*, const char*, char*, void*) {}

  InitialValueProblem& problem;
  Eigen::MatrixXd S, dS;
  // In the order in which they need each other.
  template <class Handle, auto kFree>
  using Owned = sundials::Owned<Handle, kFree>;
  Owned<SUNContext, &sundials::free_context> context;
  Owned<N_Vector, &N_VDestroy> y, at;
  std::vector<Owned<N_Vector, &N_VDestroy>> columns;
  std::vector<N_Vector> column_handles;
  Owned<SUNMatrix, &SUNMatDestroy> matrix;
  Owned<SUNLinearSolver, &sundials::free_linear> linear;
  Owned<SUNNonlinearSolver, &sundials::free_newton> of_state, of_sensitivities;
  std::unique_ptr<void, sundials::Freed<void, &sundials::free_memory>> memory;
};

Cvodes::Cvodes(InitialValueProblem& problem, int n, int columns, double relative, double absolute,
               Method method)
    : y_(Eigen::VectorXd::Zero(n)),
      at_(Eigen::VectorXd::Zero(n)),
      S_(Eigen::MatrixXd::Zero(n, columns)),
      solver_(std::make_unique<Solver>(problem, n, columns)) {
  Solver& s = *solver_;
  const SUNContext context = s.context.get();
  const bool is_adams = method == Method::kAdams;
  s.y.reset(made(N_VMake_Serial(n, y_.data(), context)));
  s.at.reset(made(N_VMake_Serial(n, at_.data(), context)));
  s.memory.reset(made(CVodeCreate(is_adams ? CV_ADAMS : CV_BDF, context)));
  void* memory = s.memory.get();
  require(CVodeSetErrHandlerFn(memory, &Solver::say_nothing, nullptr) == CV_SUCCESS);
  require(CVodeInit(memory, &Solver::f, 0, s.y.get()) == CV_SUCCESS);
  require(CVodeWFtolerances(memory, &Solver::weights) == CV_SUCCESS);
  require(CVodeSetUserData(memory, &s) == CV_SUCCESS);
  require(CVodeSetMaxErrTestFails(memory, kMostErrorFailures) == CV_SUCCESS);
  require(CVodeSetMaxConvFails(memory, kMostSolverFailures) == CV_SUCCESS);
  s.of_state.reset(made(is_adams ? SUNNonlinSol_FixedPoint(s.y.get(), 0, context)
                                 : SUNNonlinSol_Newton(s.y.get(), context)));
  require(CVodeSetNonlinearSolver(memory, s.of_state.get()) == CV_SUCCESS);
  if (!is_adams) {
    s.matrix.reset(made(SUNDenseMatrix(n, n, context)));
    s.linear.reset(made(SUNLinSol_Dense(s.y.get(), s.matrix.get(), context)));
    require(CVodeSetLinearSolver(memory, s.linear.get(), s.matrix.get()) == CV_SUCCESS);
    require(CVodeSetJacFn(memory, &Solver::jacobian) == CV_SUCCESS);
  }
  if (columns == 0) return;
  for (int k = 0; k < columns; ++k) {
    s.columns.emplace_back(made(N_VMake_Serial(n, S_.col(k).data(), context)));
    s.column_handles.push_back(s.columns.back().get());
  }
  require(CVodeSensInit(memory, columns, CV_STAGGERED, &Solver::sensitivities, s.column_handles.data()) ==
          CV_SUCCESS);
  std::vector<double> allowed(std::size_t(columns), absolute);
  require(CVodeSensSStolerances(memory, relative, allowed.data()) == CV_SUCCESS);
  require(CVodeSetSensErrCon(memory, SUNTRUE) == CV_SUCCESS);
  s.of_sensitivities.reset(made(is_adams ? SUNNonlinSol_FixedPointSens(columns, s.y.get(), 0, context)
                                         : SUNNonlinSol_NewtonSens(columns, s.y.get(), context)));
  require(CVodeSetNonlinearSolverSensStg(memory, s.of_sensitivities.get()) == CV_SUCCESS);
}

Cvodes::~Cvodes() = default;

void Cvodes::begin(double s, const double* y) {
  s_ = s;
  std::copy_n(y, y_.size(), y_.data());
}

void Cvodes::start(double end, double first_step) {
  void* memory = solver_->memory.get();
  end_ = end;
  require(CVodeReInit(memory, s_, solver_->y.get()) == CV_SUCCESS);
  require(CVodeSetInitStep(memory, first_step) == CV_SUCCESS);
  require(CVodeSetStopTime(memory, end) == CV_SUCCESS);
  if (S_.cols() > 0)
    require(CVodeSensReInit(memory, CV_STAGGERED, solver_->column_handles.data()) == CV_SUCCESS);
}

Cvodes::Outcome Cvodes::advance() {
  switch (CVode(solver_->memory.get(), end_, solver_->y.get(), &s_, CV_ONE_STEP)) {
    case CV_SUCCESS:
    case CV_TSTOP_RETURN:
      return Outcome::kAdvanced;
    case CV_RHSFUNC_FAIL:
    case CV_FIRST_RHSFUNC_ERR:
    case CV_REPTD_RHSFUNC_ERR:
    case CV_UNREC_RHSFUNC_ERR:
    case CV_SRHSFUNC_FAIL:
    case CV_FIRST_SRHSFUNC_ERR:
    case CV_REPTD_SRHSFUNC_ERR:
    case CV_UNREC_SRHSFUNC_ERR:
      return Outcome::kNoRate;
    case CV_ERR_FAILURE:
      return Outcome::kRough;
    case CV_CONV_FAILURE:
    case CV_LSETUP_FAIL:
    case CV_LSOLVE_FAIL:
      return Outcome::kUnsolved;
    case CV_TOO_MUCH_ACC:
      return Outcome::kTooTight;
    default:
      return Outcome::kOther;
  }
}

void Cvodes::read_sensitivities() {
  if (S_.cols() == 0) return;
  double s = 0;
  require(CVodeGetSens(solver_->memory.get(), &s, solver_->column_handles.data()) == CV_SUCCESS);
}

int Cvodes::order() const {
  int order = 0;
  require(CVodeGetLastOrder(solver_->memory.get(), &order) == CV_SUCCESS);
  return order;
}

void Cvodes::at(double s, double* y) {
  require(CVodeGetDky(solver_->memory.get(), s, 0, solver_->at.get()) == CV_SUCCESS);
  std::copy_n(at_.data(), at_.size(), y);
}

}  // namespace dyntape
