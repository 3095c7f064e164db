// SPDX-License-Identifier: BSD-3-Clause
//
// A function that answers at once and gets faster: interpreted while a thread compiles it in the background.
//
//   const TieredFunction f = TieredFunction::make(recorded, options);   // back before a compiler has started
//   TieredFunction::Workspace workspace(f);                             // one a thread
//   f.first_order(x, p, y, J, workspace);                               // now by the interpreter,
//   f.first_order(x, p, y, J, workspace);                               // some day by compiled code
//   f.wait();                                                           // until nothing changes any more
//
// Calls, shapes and errors of evaluation are those of CompiledFunction (compiled_function.h).  A new tier is
// swapped in between two evaluations of a workspace, by one pointer: evaluations never wait and never
// allocate, and in the strict profile their results have the same bits whoever computes them.
//
// What the cache has is used at once and for good.  Where there is no compiler, or the route is kInterpreter,
// the interpreter is the only tier.  Where options.flags ask for more than -O1, a long function is compiled at
// -O1 first, which is soon done; that library does not enter the cache.  There is no tier at -O0: such code
// runs at the speed of the interpreter.
//
// If the compiler fails, the tier that serves goes on serving: it is said once on stderr, trouble() has the
// reason, wait() throws it.  make() itself throws what it meets before (ArgumentError, RecordingError), and
// for route kCompiled ToolError where there is no compiler.
//
// Copies share everything.  When the last one goes, a compiler that still runs is ended.  One function at a
// time is compiled in a process, so that memory is bounded (options.jobs compilers side by side).
#pragma once

#include <memory>
#include <string>

#include <dyntape/codegen/compiled_function.h>

namespace dyntape {

class TieredFunction {
 public:
  enum class Tier {
    kInterpreted,
    kQuick,  // compiled at -O1, where the options ask for more
    kFinal   // compiled as the options say, or from the cache
  };

  class Workspace;

  static TieredFunction make(const Function& function, const CodegenOptions& options = {});
  // The only tier is what is there already.
  static TieredFunction of(CompiledFunction function);

  // --- evaluation: as CompiledFunction ---
  void value(const double* x, const double* p, double* y, Workspace& workspace) const;
  void first_order(const double* x, const double* p, double* y, double* jacobian, Workspace& workspace) const;
  void second_order(const double* x, const double* p, const double* w, double* y, double* jacobian,
                    double* hessian, Workspace& workspace) const;
  [[nodiscard]] Violation run(Order order, const Points& points, Workspace& workspace) const;
  void check(const Violation& violation, std::size_t lanes = 1) const;

  // --- what it is: patterns, sizes, name, which no tier changes ---
  const CompiledFunction& first() const;

  // --- which tier serves ---
  Tier tier() const;
  CompiledFunction serving() const;
  bool is_settled() const;      // no other tier will come
  void wait() const;            // until then; throws what ended the compilation
  std::string trouble() const;  // what did; empty: nothing

 private:
  struct Tiers;    // those that are there, and who evaluates
  struct Builder;  // makes the others
  struct Room;
  Room& room(Workspace& workspace) const;
  TieredFunction(std::shared_ptr<Tiers> tiers, std::shared_ptr<Builder> builder)
      : tiers_(std::move(tiers)), builder_(std::move(builder)) {}

  std::shared_ptr<Tiers> tiers_;
  std::shared_ptr<Builder> builder_;  // null: settled from the start
};

const char* to_string(TieredFunction::Tier tier);

// Room for one evaluation at a time, by whichever tier.
class TieredFunction::Workspace {
 public:
  explicit Workspace(const TieredFunction& function);
  ~Workspace();
  Workspace(Workspace&&) noexcept;
  Workspace& operator=(Workspace&&) noexcept;

 private:
  friend class TieredFunction;
  struct Place;
  std::shared_ptr<Tiers> tiers_;
  std::unique_ptr<Place> place_;
};

}  // namespace dyntape
