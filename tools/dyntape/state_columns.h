// SPDX-License-Identifier: BSD-3-Clause
//
// Which columns of a table are what a command reads, whoever wrote the table.
//
//   StateColumns columns(table, robot, inputs(robot.model, function), "states.csv", {});
//   for (int i = 0; i < table.rows(); ++i) columns.read(table, i, state);      // in the order of the blocks
//
// An input has two names: its number (q0, v3, tau1), as identify writes it, and where a joint has one entry, its joint's
// (q.elbow, v.elbow, tau.elbow), as solve does.  A joint that turns without end has two entries, cos and sin; q.JOINT
// is then its angle [rad].
//
// FileError, once for all columns, for what is missing, given by both names, or no input.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/io/csv.h>
#include <dyntape/interface/robot/robot_functions.h>

namespace dyntape::tools {

struct ColumnOptions {
  bool pass_over = false;  // columns that are no input
  bool fill_zero = false;  // inputs that have no column
};
void add_column_options(CLI::App& command, ColumnOptions& options);

class StateColumns {
 public:
  // `inputs`: q, and blocks with an entry a degree of freedom.
  StateColumns(const io::CsvTable& table, const dynamics::UrdfRobot& robot,
               const std::vector<RobotBlock>& inputs, const std::string& file, const ColumnOptions& options);

  // `state` has the size of all inputs, or gets it.  FileError, naming the row, where a pair or a quaternion is zero.
  void read(const io::CsvTable& table, int row, std::vector<double>& state) const;

 private:
  enum class Meaning { kValue, kCosine, kSine };
  struct Source {
    int column = -1;  // -1: zero
    Meaning meaning = Meaning::kValue;
  };
  struct Direction {  // entries of q that are read by their direction: a quaternion, or a pair (cos, sin)
    std::string joint;
    int begin, size;
  };
  void check_directions(int row, const std::vector<double>& state) const;

  std::string file_;
  std::vector<Source> sources_;  // by input
  std::vector<Direction> directions_;
};

}  // namespace dyntape::tools
