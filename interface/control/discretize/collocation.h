// SPDX-License-Identifier: BSD-3-Clause
//
// Direct collocation: a problem on a mesh as a nonlinear program.
//
//   Collocation nlp(problem, {.scheme = hermite_simpson(), .intervals = 40});
//   NlpSolution s = solve_with_ipopt(nlp, nlp.start());
//   Trajectory motion = nlp.trajectory(s.x);
//
// Variables (n): z = (x, a, u) of every point, in the order of time.  Constraints (m): the defects of
// interval 0, 1, ... (scheme.h), what the scheme demands of their controls, then the path rows of every point, then the rows
// of instants (at_fraction() in problem.h), those of the end last.  Boundary values are
// variables with equal bounds.  Bounds hold at every point, midpoints included.
//
// The functions of a point are recorded and derived once and evaluated at all points in one call.  Then
//   Jacobian of a defect   alpha I + h beta J_f             blocks of one point each
//   Lagrangian Hessian     sum over points of the Hessian of  w . (f, path rows, L)  at that point,
//                          w = (sum h beta lambda, lambda, sigma h gamma):  block-diagonal
// Patterns are fixed at construction; evaluations allocate nothing.
//
// Where the scheme leaves the last point unused (Euler), or the first (Radau), its controls and accelerations stay at the
// guess and its path rows are left out; in a motion they are what the scheme's polynomial is there.
//
// Magnitudes (collocation_magnitudes.cpp), one for each part of z, row of a point and the cost: how far the start
// moves states; of the others what equilibrates the Jacobian, sampled around the start where it stands still; of rows and
// the cost what they then amount to.  A change of the units of mass, length or time changes them alike.
//
// Between solves values may change: what a problem says besides its functions.  Nothing is recorded or compiled anew,
// patterns stay, and what was evaluated before is forgotten:
//
//   Problem now = nlp.problem();
//   now.start = measured, now.parameters.set("target", target);
//   nlp.set_values(now);
//   NlpSolution s = solve_with_ipopt(nlp, last.x);                       // from the last solution, say
//
// Multiple shooting (multiple_shooting.h).  The program is that of a problem whose rate is what steps make of the state, with
// further parameters; the forward form only.
//
// Free duration (problem.h).  The program is that of scaled_time(problem): one more state in z, and times of points are
// those of the first guess until a motion says otherwise.  Motions in and out are in real time.
//
// Errors: ArgumentError for a problem that does not fit together, Gauss-Newton with a cost that is no sum of
// squares, a mesh whose program outgrows the memory or what the solver can count (collocation_size.cpp).
#pragma once

#include <optional>

#include <dyntape/interface/control/discretize/stage_functions.h>
#include <dyntape/interface/control/discretize/trajectory.h>
#include <dyntape/interface/control/nlp/solution.h>
#include <dyntape/interface/control/problem/record_stage.h>

namespace dyntape {

struct MeshOptions {
  Scheme scheme = hermite_simpson();
  int intervals = 40;
  std::vector<double> nodes =
      {};  // (intervals + 1) node times from 0 to the duration, which the last may miss
           // by rounding; empty: evenly spaced.  Of a free duration their shares count
  HessianKind hessian = HessianKind::kExact;
  CodegenOptions evaluation = {};  // how functions are made; `order` is the collocation's own
  // That share the points; 0: as many as there are.  Of a seven-joint arm two take longer than one on 40 intervals,
  // and save a tenth on 4000.
  unsigned threads = 1;
};

// Node times of a mesh: the last is the duration to the bit.  Of an even mesh that has no node where terms stand at an instant,
// the nearest one moves there and those between are spread evenly.  ArgumentError for what is no mesh, for node times without one
// at an instant, for fewer intervals than there are between instants.
std::vector<double> node_times(const Problem& problem, const MeshOptions& options);
// Which node of a mesh stands at a share of its duration; ArgumentError, naming the problem's terms, where none does.
std::size_t node_at_share(const Problem& problem, double share, const std::vector<double>& nodes);

class Collocation : public Nlp {
 public:
  Collocation(const Problem& problem, const MeshOptions& options);
  // The same problem on other nodes; what is recorded and compiled is taken over.  A free duration is guessed anew: that
  // of the nodes.
  Collocation(const Collocation& ready, std::vector<double> nodes);

  // Of a problem with the same functions: parameters, start, goal, bounds, guess (Problem::take_values); bounds of terms
  // stay.  ArgumentError where something does not fit, and then nothing has changed.
  void set_values(const Problem& now);
  void set_parameters(const Parameters& now);
  // Where the motion begins, beyond its bounds too: a plant may be there.  Of a problem whose start is given.
  void start_at(const Eigen::VectorXd& x);

  // Variables from the problem's guess, and from and to trajectories on this mesh.
  std::vector<double> start() const;
  Trajectory trajectory(const std::vector<double>& x) const;
  std::vector<double> variables(const Trajectory& trajectory) const;
  // Multipliers of a solution, each that of what stood so many intervals later; the last ones stay.  Of an even mesh.
  void make_earlier(NlpSolution& multipliers, int intervals) const;

  // Where the variables of the last point begin, its state first.
  std::size_t last_point() const { return (points_ - 1) * n_z_; }

  const NlpShape& shape() const override { return shape_; }
  bool objective(const double* x, double& value) override;
  bool gradient(const double* x, double* gradient) override;
  bool constraints(const double* x, double* g) override;
  bool jacobian(const double* x, double* nonzeros) override;
  bool hessian(const double* x, double sigma, const double* lambda, double* nonzeros) override;
  NlpScaling scaling(const std::vector<double>& at, const NlpScaling& before = {}) override;
  std::string variable_name(std::size_t i) const override;
  std::string constraint_name(std::size_t j) const override;

  // Throws NumericalError naming function, point, row, variable and operation unless values and first
  // derivatives are finite at x.
  void check_finite(const std::vector<double>& x) override;

  const RecordedStage& stage() const { return stage_; }
  BuildReport build() const;
  const Problem& problem() const { return asked_; }  // as it was given, with the values of now
  std::vector<double> times() const;  // of the points, s; of the first guess where the duration is free

  // Magnitudes of the program as those of its motions, which have no state for the duration (verify.h).
  NlpScaling of_motion(const NlpScaling& scaling) const;

 private:
  // `ready`: of which the functions are taken, or null.
  Collocation(const Problem& problem, const MeshOptions& options, const Collocation* ready);

  // Entry e of the Jacobian: constant + factor * (non-zero `source` of the point Jacobians).
  struct JacobianEntry {
    double constant, factor;
    std::ptrdiff_t source;  // -1: none
  };
  // Gradient: factor * (non-zero `source`) is added to variable `target`.
  struct GradientEntry {
    std::size_t target;
    double factor;
    std::size_t source;
  };
  // Product of two entries of the Jacobian of the residuals, added to a Hessian entry.
  struct SquareEntry {
    std::size_t target;
    double factor;
    std::size_t left, right;
  };

  std::size_t defects() const { return intervals_ * rows_ * n_x_; }
  std::size_t held_rows() const;  // of an interval
  std::size_t first_path_row() const { return defects() + intervals_ * held_rows(); }
  // Of the used points, the one with this number.
  std::size_t path_row(std::size_t used, std::size_t i) const {
    return first_path_row() + used * stage_.path_rows.size() + i;
  }
  std::size_t first_instant_row() const { return path_row(used_, 0); }
  std::size_t first_of_instant(std::size_t k) const { return instant_points_[k] * n_z_; }  // variable
  double step(std::size_t interval) const { return t_[(interval + 1) * stride_] - t_[interval * stride_]; }

  double numbers_of_interval() const;
  void check_size() const;
  void place_points(const MeshOptions& options);
  void set_variable_bounds();
  void set_row_bounds();
  void place_parameters();
  void forget();
  void lay_out_jacobian();
  void lay_out_gradient();
  void lay_out_hessian(HessianKind kind);
  void lay_out_exact_hessian();
  void lay_out_gauss_newton();
  double* held_controls(const double* x, double* g) const;
  void collect_weights(double sigma, const double* lambda);
  bool evaluate(StageFunctions& f, Order order, const double* x, const Points& points);
  bool evaluate_values(const double* x);
  bool evaluate_first(const double* x);
  bool gauss_newton(const double* x, double sigma, double* nonzeros);
  // Of the node's rows, its rates first, then of those of instants, at what was evaluated last.
  struct Linearisation {
    Eigen::MatrixXd derivatives;    // (rows x n_z) the largest |entries| of the Jacobian over the points
    Eigen::VectorXd lacks, values;  // by how much rows lie outside their bounds, and |values|, at most
    Eigen::VectorXd room;           // between their bounds
    Eigen::Array<bool, Eigen::Dynamic, 1> equations() const { return room.array() == 0 || lacks.array() > 0; }
  };
  Linearisation linearisation() const;
  Eigen::VectorXd extents(const std::vector<double>& start) const;
  Eigen::VectorXd completed(Eigen::VectorXd z, const Linearisation& at) const;
  Eigen::VectorXd nominal_values(const std::vector<double>& start, Linearisation at);
  std::pair<Eigen::VectorXd, Eigen::VectorXd> cost_slopes(const std::vector<double>& start,
                                                          const Eigen::VectorXd& displacement);
  double newton_step(const std::vector<double>& start, Eigen::Index entry);
  const double* parameters_at(std::size_t point) const {
    return parameters_.data() + point * stage_.node.n_p();
  }
  std::string at(std::size_t point) const;  // "point 3 (t = 0.5 s)"

  IntervalLength length_;  // of problem_
  Problem asked_,
      problem_;  // problem_: over a fixed time (scaled_time.h), its rate the scheme's (Scheme::taken_by)
  double record_seconds_ = 0;
  RecordedStage stage_;
  Scheme scheme_;
  std::size_t n_x_, n_z_, intervals_, stride_, rows_;  // stride: points from node to node
  std::size_t points_, first_used_, used_;  // used: points at which the stage is evaluated, one after another
  std::vector<double> t_, quadrature_;      // (points) of problem_; (used) sums of h gamma
  std::vector<double> parameters_;          // (points x 1 + n_p) what the functions take: t, p
  CodegenOptions evaluation_;
  unsigned threads_;

  std::optional<StageFunctions> functions_, squares_;  // squares: for Gauss-Newton
  std::vector<std::size_t> instant_points_;            // where the instants of stage_ stand
  std::vector<StageFunctions::At> at_instants_;        // what their functions take, for a call
  NlpShape shape_;
  std::vector<JacobianEntry> jacobian_map_;
  std::vector<GradientEntry> gradient_map_;
  std::vector<std::size_t> hessian_map_;  // of each entry of the point Hessians, then of the instants'
  std::vector<SquareEntry> square_map_;

  // The last point evaluated, and what was found there: points one after another, the instants behind them.
  std::vector<double> x_values_, x_first_;
  bool values_good_ = false, first_good_ = false;
  std::vector<double> y_, first_y_, first_j_, second_h_, weights_, residuals_, residual_j_;
};

}  // namespace dyntape
